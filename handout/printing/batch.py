"""Turns the rows of a table into pages: writes, checks and prepares each, then sends them or writes files."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from handout import atomic, units
from handout.errors import InputError
from handout.printing import media
from handout.printing.journal import BACK, ENVELOPE, Journal, Piece
from handout.printing.prepared import (
    Destination,
    MakeRows,
    PdfPage,
    PicturePage,
    PreparedPage,
    PreparedRow,
    PrinterPage,
)
from handout.printing.printers import open_queue, ticket
from handout.printing.queue import Queue, Say, SimulatedQueue
from handout.printing.rows import TableRow, select
from handout.printing.sending import (
    BatchRun,
    Checked,
    Failed,
    Job,
    Remaining,
    Report,
    Spool,
    pieces,
    remaining,
    tell_rows,
)
from handout.printing.several import Several
from handout.profiles import Printer
from handout.progress import Tell, silent
from handout.sinks import picture_pdf
from handout.values import Page

MOST_COPIES = 100  # of a row; set by eye, against a slip of the keyboard

SIMULATED = Path("printed")  # the folder of a simulated queue that was given none


@dataclass(frozen=True)
class BatchOptions:
    """Which rows are made, and where.

    rows : by their numbers in the file, ``"3-7,9"``, ``"7-"``; all for "".
    copies : of each row, 1 to 100, all alike; a row may have a number of its own besides.
    again : rows to make again when a run is gone on with, whatever became of them.
    out : .pdf (all pages in one), .png or .svg (a file a page), written instead of printing; for a simulated printer
        the folder of its jobs, unless it has one of these endings.
    all_or_none : whether a row that cannot be made keeps all of them from being made.
    """

    rows: str = ""
    copies: int = 1
    again: str = ""
    out: Path | None = None
    all_or_none: bool = False


def make_rows(
    rows: Sequence[TableRow],
    make: MakeRows,
    place: Destination,
    options: BatchOptions,
    journal: Journal,
    *,
    tell: Tell = silent,
    check: MakeRows | None = None,
) -> Report:
    """Hand the pages of every row that is asked for to the device exactly once, each as soon as it is made.

    make : makes rows as they are asked for; it may be some rows ahead.
    check : the same, but their pages, for a device that gets none where one row cannot be made; None: `make`.

    Raises InputError: rows that do not exist, or copies out of bounds. RowsRefused: some cannot be made, and `options`
    say that then none is. PrintingStopped: the device refused a page after others had been sent.
    """
    chosen, again = chosen_rows(rows, options, journal.resumed)
    copies = {row.number: options.copies * row.copies for row in chosen}
    sender = place if isinstance(place, Spool | Several) else None
    todo = Remaining(_makeable(chosen))
    if sender is not None:
        todo = remaining(journal, sender.devices, todo.fresh, copies, again)
        left = todo.rows  # worked out once: a table may have 100,000
        chosen = [row for row in chosen if row.problem or row.number in left]
    checked = Checked(wanted=_makeable(chosen), said=journal.damage_notes)
    if options.all_or_none and sender is not None:
        _check_rows((check or make)(chosen), len(chosen), tell)
    taken, jobs = _take_rows(make(chosen), place, copies, checked), tuple[Job, ...]()
    if sender is not None:
        taken = _skip_lost(taken, checked, todo, journal, again)
        jobs = sender.send_rows(taken, BatchRun(checked, _makeable(rows), journal, todo), tell)
    else:  # for a file, which appears whole or not at all
        for number, _ in enumerate(taken):
            tell_rows(tell, "make", number, len(chosen))
        if options.all_or_none and checked.failed:
            raise RowsRefused(checked.failed, checked.warnings)
    place.finish()
    done = tuple(sorted({*checked.done, *(piece.row for piece in todo.wait)}))
    before, unknown = tuple(todo.done), tuple(todo.unknown)
    return Report(done, tuple(checked.failed), place.files(), jobs, tuple(checked.warnings), before, unknown)


def _makeable(rows: Sequence[TableRow]) -> list[int]:
    """The numbers of the rows that can be made, as far as is known."""
    return [row.number for row in rows if not row.problem]


def _take_rows(
    made: Iterable[PreparedRow], place: Destination, copies: Mapping[int, int], checked: Checked
) -> Iterator[Sequence[Piece]]:
    """The pieces of every row, when the destination has taken them; of one that cannot be made, none."""
    for row in made:
        checked.warn(row.number, row.warnings)
        if row.problem:
            checked.failed.append(Failed(row.number, row.problem))
            yield []
            continue
        place.take(row.number, row.pages, copies[row.number])
        checked.done.append(row.number)
        yield pieces(row.number, copies[row.number], [page.part for page in row.pages])


def _skip_lost(
    taken: Iterable[Sequence[Piece]], checked: Checked, todo: Remaining, journal: Journal, again: Collection[int]
) -> Iterator[Sequence[Piece]]:
    """The pieces of rows without the first fresh ones, which may have been sent in lines that are damaged."""
    fresh = set(todo.fresh)
    for every in taken:
        row = every[0].row if every else 0
        if not journal.lost or row not in fresh:
            yield every
        elif row in again:
            journal.settle()
            yield every
        else:
            todo.unknown.append(Failed(row, journal.doubt(every)))
            checked.wanted.remove(row)
            checked.done.remove(row)
            yield []


def _check_rows(checked: Iterable[PreparedRow], total: int, tell: Tell) -> None:
    """Raise RowsRefused where a row cannot be made."""
    found = Checked()
    for number, row in enumerate(checked):
        tell_rows(tell, "check", number, total)
        found.warn(row.number, row.warnings)
        found.failed += [Failed(row.number, row.problem)] if row.problem else []
    if found.failed:
        raise RowsRefused(found.failed, found.warnings)


class RowsRefused(InputError):
    """Some rows cannot be made, so that none is; `report` says which and why."""

    def __init__(self, failed: Sequence[Failed], warnings: Sequence[str]) -> None:
        first = failed[0]
        more = f", nor can {units.count(len(failed) - 1, 'other')}" if len(failed) > 1 else ""
        super().__init__(
            f"Row {first.row} cannot be made{more}: {first.reason.rstrip('.')}. Nothing was made: mend the table or "
            "the letter, or make the other rows with --skip-bad."
        )
        self.report = Report((), tuple(failed), warnings=tuple(warnings))


def chosen_rows(rows: Sequence[TableRow], options: BatchOptions, resumed: bool) -> tuple[list[TableRow], set[int]]:
    """The rows that are asked for, and the numbers of those that are to be made whatever became of them."""
    if not 1 <= options.copies <= MOST_COPIES:
        raise InputError(f"copies: {options.copies} is outside 1 to {MOST_COPIES}.")
    chosen = select(rows, options.rows)
    again = {row.number for row in select(chosen, options.again)} if options.again else set()
    if again and not resumed:
        raise InputError("--again prints rows of a batch again that is gone on with: give --resume too.")
    return chosen, again


@dataclass(frozen=True)
class PrinterWay:
    """The way to a printer, or to the file that stands for one.

    fed : page → the printer as it is fed with that.
    about : stored in every PDF.
    queue : that pages go to, if it is not the profile's own; resumed : whether a batch is gone on with.
    change : asks somebody to put in other paper, in words; shared : whether there are other printers, too, so that
    this one has to be named; calibrated : whether the calibration of pages is this printer's.
    """

    profile: Printer
    fed: Callable[[Page], Printer]
    about: Mapping[str, object]
    queue: Queue | None = None
    resumed: bool = False
    say: Say = lambda sentence: None
    change: Callable[[str], object] = lambda request: None
    shared: bool = False
    calibrated: bool = True


class PdfFile(Destination):
    """All pages in one PDF, each as it is read; the file appears when the batch is done."""

    def __init__(self, path: Path, way: PrinterWay) -> None:
        """Check now that `path` can be written."""
        super().__init__()
        atomic.check_writable(path)
        self._path, self._way = path, way
        self._writer: picture_pdf.PdfWriter | None = None
        self.prepare = PdfPage(way.fed, way.profile.dpi)

    def take(self, number: int, pages: Sequence[PreparedPage], copies: int) -> None:
        """Add the row's pages, once for each copy."""
        if self._writer is None:
            # only now, so that a batch without a single good row leaves no empty file
            self._writer = self._stack.enter_context(picture_pdf.document(self._path, self._way.about))
        pictures = [(page.page, picture_pdf.PagePicture.unpack(page.data)) for page in pages]
        for _ in range(copies):
            for sheet, picture in pictures:
                self._writer.add_picture(sheet, picture)

    def files(self) -> tuple[Path, ...]:
        """The PDF, if it has a page."""
        return (self._path,) if self._writer is not None else ()


class PictureFiles(Destination):
    """A file a page: ``cards.png`` becomes ``cards-002.png``, ``cards-003.png`` …, numbered as the table's rows.

    Of a row with several pages they are ``cards-002-letter-1.png``, ``cards-002-letter-2.png``, ``cards-002.png``.
    """

    def __init__(self, path: Path, way: PrinterWay) -> None:
        """Check now that `path` can be written."""
        super().__init__()
        atomic.check_writable(path)
        self._path = path
        self._pages: dict[Path, Path] = {}
        self.prepare = PicturePage(way.fed, path)

    def take(self, number: int, pages: Sequence[PreparedPage], copies: int) -> None:
        """Keep the row's pictures."""
        for page in pages:
            part = f"-{page.part.replace(' ', '-')}" if page.part and len(pages) > 1 else ""
            path = self._path.with_name(f"{self._path.stem}-{number:03d}{part}{self._path.suffix}")
            self._pages[path] = self.keep(path.name, page.data)

    def finish(self) -> None:
        """Write the pictures."""
        for path, kept in self._pages.items():
            atomic.write(path, kept.read_bytes())

    def files(self) -> tuple[Path, ...]:
        """The pictures."""
        return tuple(self._pages)


class PrintSpool(Spool):
    """Pages prepared for a printer's queue, each a document in the direction of feed, in a temporary folder.

    Where envelopes are fed from a tray of their own, the pages of a row come out one after the other; else all
    letters come first, and somebody is asked once for the envelopes, and once for their backs.
    """

    queue: Queue
    prepare: PrinterPage

    def __init__(self, queue: Queue, way: PrinterWay, sheets: Collection[Page] = ()) -> None:
        """`sheets` are the sizes of the pages of a row; nothing is sent before `send` is called."""
        super().__init__()
        self.queue, self._way = queue, way
        self._apart = len({way.fed(sheet).source for sheet in sheets}) < len(set(sheets))
        self._pages: dict[tuple[int, str], tuple[Path, Page, int]] = {}
        self._last: int | None = None
        dpi = queue.resolution(way.profile.dpi)
        self.prepare = PrinterPage(way.fed, queue.format, dpi, way.about, way.calibrated)

    def take(self, number: int, pages: Sequence[PreparedPage], copies: int) -> None:
        """Keep the row's pages until they are sent."""
        for page in pages:
            name = f"{_file_name(Piece(number, 1, page.part))}.{self.queue.format}"
            self._pages[number, page.part] = self.keep(name, page.data), page.page, copies

    def sheets(self, pieces: Iterable[Piece]) -> Iterator[Sequence[Piece]]:
        """Every page is a job; in passes, where the paper has to be changed."""
        later: dict[int, list[Piece]] = {1: [], 2: []}
        for piece in pieces:
            if number := self._pass(piece):
                later[number].append(piece)
            else:
                yield (piece,)
        yield from ((piece,) for waiting in later.values() for piece in waiting)

    def _pass(self, piece: Piece) -> int:
        """In which pass a page is printed."""
        return 2 if piece.part == BACK else int(piece.part == ENVELOPE and self._apart)

    def ready(self, sheet: Sequence[Piece]) -> None:
        """Ask for other paper where a new pass begins."""
        (piece,) = sheet
        number, page = self._pass(piece), self._pages[piece.row, piece.part][1]
        if self._last is not None and number != self._last:
            name = page.name or f"{page.width:g} x {page.height:g} mm"
            back = " again, with their backs to the print side and in the same order" if piece.part == BACK else ""
            where = f" at {self.queue.name}" if self._way.shared else ""
            what = "the envelopes" if number else "the letters' paper"
            self._way.change(f"Put in {what} ({name}){back}{where}")
        self._last = number

    def send(self, sheet: Sequence[Piece], title: str) -> str:
        """Hand a page to the queue as a job of that title; the job's name there."""
        (piece,) = sheet
        path, page, copies = self._pages[piece.row, piece.part]
        job = self.queue.send(path, ticket(self._way.fed(page), page, title, _file_name(piece)))
        if piece.copy == copies:
            path.unlink()
        return job


def _file_name(piece: Piece) -> str:
    words = [f"row-{piece.row:03d}", *filter(None, [piece.part.replace(" ", "-")])]
    return "-".join([*words, *([str(piece.copy)] * (piece.copy > 1))])


def destination(way: PrinterWay, options: BatchOptions, sheets: Collection[Page]) -> Destination:
    """Where the pages go: a queue, a simulated one, or the files that a name asks for.

    sheets : the sizes of a row's pages, of which the printer is asked, before any work, whether it takes them.
    """
    out, profile, queue = options.out, way.profile, way.queue
    if queue is None and profile.simulated and (out is None or out.suffix == ""):
        queue = SimulatedQueue(out or SIMULATED, go_on=way.resumed)
    elif out is None:
        if queue is None and profile.file:
            raise InputError(f"{profile.title} writes a file: give it a name, such as --dry-run out.pdf.")
        queue = queue or open_queue(profile, way.say)
    else:
        suffix = out.suffix.lower()
        if suffix == ".pdf":
            return PdfFile(out, way)
        if suffix in (".png", ".svg"):
            return PictureFiles(out, way)
        raise InputError(f"{out}: pages are written as .pdf, .png or .svg; give the file one of these endings.")
    for page in sheets:
        queue.check(ticket(way.fed(page), page, "handout"))
    return PrintSpool(queue, way, sheets)


def destinations(
    ways: Sequence[PrinterWay], apart: Sequence[PrinterWay], options: BatchOptions, sheets: Collection[Page]
) -> Destination:
    """Where the pages go when there may be several printers: rows are shared by those of `ways`.

    apart : the ways to printers that make the envelopes, if there are such.

    Raises InputError: two are one, or they take pages in different ways.
    """
    if options.out is not None or len(ways) + len(apart) == 1:
        return destination(ways[0], options, sheets)
    asking = threading.Lock()

    def change(request: str) -> None:
        with asking:
            ways[0].change(request)

    def spools(ways: Sequence[PrinterWay], envelopes: Collection[bool]) -> list[PrintSpool]:
        wanted = [sheet for sheet in sheets if media.is_envelope(sheet) in envelopes]
        places = (destination(replace(way, change=change, shared=True), options, wanted) for way in ways)
        return [place for place in places if isinstance(place, PrintSpool)]

    rows, others = spools(ways, [False] if apart else [False, True]), spools(apart, [True])
    _check_alike(rows, others)
    return Several(rows, others)


def _check_alike(*kinds: Sequence[PrintSpool]) -> None:
    """Refuse printers that are one, and printers of the same pages that take them in different ways."""
    names = [spool.queue.name for spools in kinds for spool in spools]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(f"{twice[0]} is named twice: each device makes its own pages.")
    for one, other in (pair for spools in kinds for pair in itertools.pairwise(spools)):
        if (one.prepare.format, one.prepare.dpi) != (other.prepare.format, other.prepare.dpi):
            told = " and ".join(f"{s.queue.name} {s.prepare.format} at {s.prepare.dpi} dpi" for s in (one, other))
            raise InputError(f"The printers take pages otherwise ({told}): say --format, or leave one out.")
