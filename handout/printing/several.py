"""Several devices at once: each makes the next row that no other has, in a thread of its own, by one journal.

All pages of a row go to one device; or letters go to some and envelopes to others, an envelope only when its letters
are made, so that none is ever without the other.  A device that stops does not stop the others: they make the rows of
which it has begun nothing, and what it has begun waits until it goes on.
"""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Literal, Self

from handout.errors import HandoutError
from handout.printing.journal import BACK, ENVELOPE, Piece
from handout.printing.prepared import BatchPage, Destination, Prepare, PreparedPage
from handout.printing.queue import Device
from handout.printing.sending import BatchRun, Failed, Job, Spool, device_of, follow, jobs_of, tell_rows
from handout.progress import Tell
from handout.signals import interrupt

Makes = Literal["rows", "letters", "envelopes"]
_GLANCE = 0.05  # s between two looks whether all devices have ended
_PATIENCE = 30.0  # s that an interrupted device has to lift its pen or to cancel its job; set by eye


@dataclass
class Station:
    """A device of a batch, and what it makes.

    collecting : it may take further rows; idle : it waits for one; ended : it makes nothing more.
    sheet : that it is sending, or was when it stopped; error : why it stopped.
    held : the pieces that it has been given; own : rows that it had begun before.
    """

    spool: Spool
    makes: Makes = "rows"
    collecting: bool = True
    idle: bool = False
    ended: bool = False
    sheet: Sequence[Piece] = ()
    held: list[Piece] = field(default_factory=list)
    own: deque[list[Piece]] = field(default_factory=deque)
    error: BaseException | None = None

    @property
    def name(self) -> str:
        """Of the device."""
        return self.spool.queue.name


def makes(piece: Piece, split: bool) -> Makes:
    """Which devices make a piece."""
    return "rows" if not split else "envelopes" if piece.part in (ENVELOPE, BACK) else "letters"


def prepare_by_part(letters: Prepare, envelopes: Prepare, number: int, page: BatchPage) -> PreparedPage:
    """Prepare letters for one kind of device, and envelopes for another; a `Prepare` with the first two given."""
    return (envelopes if page.part in (ENVELOPE, BACK) else letters)(number, page)


class Several(Destination):
    """A destination that is several devices; the pages of a row wait on the disk until one of them makes it."""

    def __init__(self, rows: Sequence[Spool], envelopes: Sequence[Spool] = ()) -> None:
        """`rows` make all pages, or with `envelopes` letters only."""
        super().__init__()
        self.split = bool(envelopes)
        kind: Makes = "letters" if envelopes else "rows"
        self.stations = [*(Station(spool, kind) for spool in rows), *(Station(each, "envelopes") for each in envelopes)]
        self.prepare = rows[0].prepare
        if envelopes:
            self.prepare = partial(prepare_by_part, rows[0].prepare, envelopes[0].prepare)
        self._pages: dict[int, tuple[list[tuple[PreparedPage, Path]], int]] = {}

    @property
    def devices(self) -> list[Device]:
        """All of them."""
        return [station.spool.queue for station in self.stations]

    def __enter__(self) -> Self:
        super().__enter__()
        for station in self.stations:
            self._stack.enter_context(station.spool)
        return self

    def take(self, number: int, pages: Sequence[PreparedPage], copies: int) -> None:
        """Keep the pages of a row."""
        kept = [(replace(page, data=b""), self.keep(f"row-{number}-{n}", page.data)) for n, page in enumerate(pages)]
        self._pages[number] = kept, copies

    def hand(self, row: Sequence[Piece], spool: Spool) -> None:
        """Give a device the pages of the pieces of a row."""
        pages, copies = self._pages[row[0].row]
        parts = {piece.part for piece in row}
        wanted = [replace(page, data=path.read_bytes()) for page, path in pages if page.part in parts]
        spool.take(row[0].row, wanted, copies)

    def drop(self, number: int) -> None:
        """The pages of a row are not needed any more."""
        for _, path in self._pages.pop(number, ([], 0))[0]:
            path.unlink(missing_ok=True)

    def send_rows(self, taken: Iterable[Sequence[Piece]], run: BatchRun, tell: Tell) -> tuple[Job, ...]:
        """Send the rows of a batch by all of the devices at once; see `Spool.send_rows`.

        Raises PrintingStopped: devices stopped, and something is left that the others could not make.
        """
        sharing = _Sharing(self, iter(taken), run, tell)
        for piece in run.todo.wait:
            owner = device_of(run.journal.steps[piece], self.devices)
            sharing.waiting[self.devices.index(owner) if owner is not None else 0].append(piece)
        sharing.make_all()
        if sharing.broken is not None:
            raise sharing.broken
        self._tell_stopped(sharing.interrupted, run)
        return tuple(run.jobs)

    def _tell_stopped(self, interrupted: KeyboardInterrupt | None, run: BatchRun) -> None:
        """Raise where devices stopped and something is left; say which did where the others made it all."""
        stopped = [station for station in self.stations if station.error is not None]
        halted = [piece for station in stopped for piece in station.sheet]
        sent, rest = run.split_rows(halted)
        rest = run.list_unmade(rest)
        if interrupted is not None:
            going = " and ".join(station.name for station in self.stations if not station.ended)
            told = f" {going} did not answer: look whether the pen is up and nothing runs." if going else ""
            interrupted.add_note(f"Stopped.{told} {run.way_out((), sent, rest)}")
            raise interrupted
        errors = [f"{station.name}: {station.error}" for station in stopped]
        if rest or halted:
            message = f"{' '.join(errors)} {run.way_out((), sent, rest)}"
            failed = [Failed(number, "not made") for number in rest]
            raise run.broken_off(message, sent, failed) from stopped[0].error
        run.checked.said += [f"{words} The other devices made its rows." for words in errors]


class _Sharing:
    """The rows of a batch, as its devices share them.

    waiting : of every device, what it had begun before and may still make.
    """

    def __init__(self, place: Several, rows: Iterator[Sequence[Piece]], run: BatchRun, tell: Tell) -> None:
        self.place, self.run, self.tell = place, run, tell
        self.waiting: list[list[Piece]] = [[] for _ in place.stations]
        self.interrupted: KeyboardInterrupt | None = None
        self.broken: BaseException | None = None
        self._rows, self._exhausted = rows, False
        self._open: dict[Makes, deque[list[Piece]]] = {"rows": deque(), "letters": deque(), "envelopes": deque()}
        self._later: dict[int, list[Piece]] = {}  # row → envelopes whose letters are not all made
        self._making, self._changed = threading.Lock(), threading.Condition(threading.RLock())

    def make_all(self) -> None:
        """Every device makes rows in a thread, until none is left."""
        threads = [
            threading.Thread(target=self._work, args=(station, waiting), name=station.name, daemon=True)
            for station, waiting in zip(self.place.stations, self.waiting, strict=True)
        ]
        try:
            for thread in threads:
                thread.start()
            self._wait(math.inf)
        except KeyboardInterrupt as stop:
            self.interrupted = stop
            with self._changed:
                self._changed.notify_all()
            for station, thread in zip(self.place.stations, threads, strict=True):
                if thread.ident is None:  # it was not begun, and makes nothing if it begins yet
                    station.ended = True
                elif not station.ended:
                    interrupt(thread.ident)
            self._wait(_PATIENCE)

    def _wait(self, seconds: float) -> None:
        """Until all devices have ended, at most so long.

        Not by joining their threads: Python before 3.13 takes a thread for ended when its join is interrupted.
        """
        end = time.monotonic() + seconds
        while not all(station.ended for station in self.place.stations) and time.monotonic() < end:
            time.sleep(_GLANCE)

    def _work(self, station: Station, waiting: Sequence[Piece]) -> None:
        """One device, until nothing is left for it."""
        run = self.run
        try:
            for begun in jobs_of(waiting, run.journal):
                with self._sending(station, begun):
                    follow(station.spool.queue, run.journal, begun)
                    run.drop_pieces(begun)
            more = True
            while more:  # while it made its last sheet, others may have given back what they cannot make
                more = False
                for sheet in station.spool.sheets(self._pieces(station)):
                    more = True
                    with self._sending(station, sheet):
                        run.send(station.spool, sheet)
        except HandoutError as error:
            station.error = error
        except KeyboardInterrupt as stop:
            station.error = stop
            if station.sheet:
                run.cancel(station.spool.queue, station.sheet)
        except BaseException as error:  # of this program: all stop, and it is raised where they were begun
            self.broken = self.broken or error
        finally:
            with self._changed:
                station.collecting, station.ended = False, True
                self._give_back(station)
                station.sheet = [piece for piece in station.sheet if run.is_begun(piece)]
                self._changed.notify_all()

    @contextlib.contextmanager
    def _sending(self, station: Station, sheet: Sequence[Piece]) -> Iterator[None]:
        """While a sheet is made; then, envelopes of which the letters are made may be."""
        with self._changed:
            station.sheet = sheet
            total = len(self.run.checked.wanted)
            tell_rows(self.tell, "send", min(self.run.begun_rows, total), total)
        yield
        with self._changed:
            station.sheet = ()
            for row in dict.fromkeys(piece.row for piece in sheet):
                if row in self._later and not self._has_letters(row):
                    self._queue_of("envelopes", row).append(self._later.pop(row))
                if not self.run.left[row]:
                    self.place.drop(row)
            station.held = [piece for piece in station.held if piece in self.run.left[piece.row]]
            self._changed.notify_all()

    def _has_letters(self, row: int) -> bool:
        """Whether letters of a row are still to be made."""
        return any(makes(piece, self.place.split) == "letters" for piece in self.run.left[row])

    def _pieces(self, station: Station) -> Iterator[Piece]:
        """What a device makes next, row after row."""
        station.collecting = True
        while (row := self._take_next(station)) is not None:
            self.place.hand(row, station.spool)
            yield from row
        with self._changed:
            station.collecting = False
            self._changed.notify_all()

    def _take_next(self, station: Station) -> list[Piece] | None:
        """The next row that no other device has; None when there will be none."""
        while True:
            with self._changed:
                if self.broken is not None or self.interrupted is not None:
                    return None
                rows = station.own or self._open[station.makes]
                was_idle, station.idle = station.idle, not rows and (self._exhausted or station.makes == "envelopes")
                if rows:
                    station.held += rows[0]
                    return rows.popleft()
                if station.idle:
                    if not was_idle:
                        self._changed.notify_all()
                    if self._is_over(station):
                        return None
                    self._changed.wait()
                    continue
            with self._making:
                if not self._exhausted and not station.own and not self._open[station.makes]:
                    self._share_row(next(self._rows, None))

    def _share_row(self, every: Sequence[Piece] | None) -> None:
        """A row that is made, or None after the last, laid where its device finds it."""
        with self._changed:
            if every is None:
                self._exhausted = True
            else:
                waiting = {piece for pieces in self.waiting for piece in pieces}
                wanted = [piece for piece in self.run.begin(every) if piece not in waiting]
                for kind in self._open:
                    pieces = [piece for piece in wanted if makes(piece, self.place.split) == kind]
                    if pieces and kind == "envelopes" and self._has_letters(pieces[0].row):
                        self._later[pieces[0].row] = pieces
                    elif pieces:
                        self._queue_of(kind, pieces[0].row).append(pieces)
            self._changed.notify_all()

    def _queue_of(self, kind: Makes, row: int) -> deque[list[Piece]]:
        """Of the device that has begun what it makes of a row, if it is there, else of all."""
        steps, split = self.run.journal.steps, self.place.split
        begun = [steps[p] for p in self.run.made[row] if makes(p, split) == kind and self.run.is_begun(p)]
        devices = {step.device for step in begun}
        stations = (station for station in self.place.stations if station.makes == kind)
        return next((station.own for station in stations if station.name in devices), self._open[kind])

    def _is_over(self, station: Station) -> bool:
        """Whether no more rows can come for a device."""
        others = [each for each in self.place.stations if each is not station]
        if station.makes == "envelopes" and not all(each.ended for each in others if each.makes == "letters"):
            return False
        alike = [each for each in others if each.makes == station.makes]
        if any(each.collecting and not each.idle for each in alike):
            return False
        # what another holds it may still give back; who holds something makes that first
        return bool(station.held) or not any(each.held and not each.ended for each in alike)

    def _give_back(self, station: Station) -> None:
        """Rows of which a device that has stopped has begun nothing may be made by others."""
        rows: dict[int, list[Piece]] = {}
        for piece in station.held:
            rows.setdefault(piece.row, []).append(piece)
        for row, held in [*rows.items(), *((pieces[0].row, pieces) for pieces in station.own)]:
            mine = [piece for piece in self.run.made[row] if makes(piece, self.place.split) == station.makes]
            if not any(self.run.is_begun(piece) for piece in mine):
                self._open[station.makes].append(held)
        station.held, station.own = [], deque()
