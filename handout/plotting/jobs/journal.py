"""Records how far a plot has come, so that it can be resumed after a pulled cable, a crash or a power cut.

A journal of `handout.journal_lines`::

    5d3ae2f1 run 2026-03-01T09:30:00            a program took the job up
    1c0f55b0 part 0                             the person has done what was asked; the part begins
    ad56275b opened                             what comes before the page is done (hooks of the machine)
    90a1be17 drawn 0 17 12.345                  of part 0 certainly all before stroke 17 is drawn, and of that one what
                                                lies before 12.345 s of the drawing's clock
    4e6f3d10 drawn 0 17 14.101 unproven         the same, but whether all came over right since the last such line
                                                without that word has not been seen yet
    77bd03e2 doubtful                           a command came over wrong: what was drawn behind the last place without
                                                that word may be wrong, and is drawn again
    0d4c1a9e complete 0                         all of the part is
    7be2a5c8 stopped The connection is lost     the program ended in good order, and why
    35cf0a7d finished                           all parts are complete

A place on the drawing stays true whatever becomes of the program and of the way it plans.  A line is written as soon
as something is certain; `secure` makes sure that all lines survive a power cut too, and only then may the driver rely
on them.

Where lines are damaged, which no power cut does, only what they said is lost: whatever line after them names a place
says where the job stands.  A word that something came over wrong may have been among them, so what was not proven
before them is drawn again.  If nothing after them names a place, the job stands at least where the lines before them
say; what was drawn since is `uncertain`, and a person has to look.

A disk may take a second for one line (a memory card, a disk that is busy).  So a thread of its own writes, and whoever
draws goes on: `drawn` and `doubt` never wait.  Of places that wait to be written only the last of
either kind is kept.
"""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Iterable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from types import TracebackType

from handout import journal_lines
from handout.errors import reason
from handout.journal_lines import Damage, JournalFile, seal
from handout.plotting.jobs.places import START, DrawnPlace

_DRAWN, _UNPROVEN = "drawn", "unproven"
_PLACES = {"part", _DRAWN, "complete", "finished"}  # lines that say where a job stands, whatever was before them


@dataclass(frozen=True)
class JobProgress:
    """How far a job has come.

    part : the part that is under way or comes next; begun : whether it was begun; opened : whether all that comes
        before its page is done.
    place : what of its drawing is certainly drawn, or if a command came over wrong, what of it is certainly right;
        proven : what of it is certainly right; doubtful : whether what lies behind `place` may be drawn wrong.
    finished : all parts are complete; stopped : why it ended the last time, "" if that is not known.
    runs : when programs took it up.
    damaged : the first line of the journal that is, 0 for none; uncertain : whether more may be drawn than is known.
    """

    part: int = 0
    begun: bool = False
    opened: bool = False
    place: DrawnPlace = START
    proven: DrawnPlace = START
    doubtful: bool = False
    finished: bool = False
    stopped: str = ""
    runs: tuple[str, ...] = ()
    damaged: int = 0
    uncertain: bool = False


def read_progress(path: Path) -> JobProgress:
    """How far a job has come; InputError if its journal cannot be read."""
    return _standing(journal_lines.read_lines(path))


def _standing(lines: Iterable[str | Damage]) -> JobProgress:
    return functools.reduce(_advance_progress, lines, JobProgress())


def _advance_progress(standing: JobProgress, line: str | Damage) -> JobProgress:
    """The standing after a line."""
    if isinstance(line, Damage):
        first = standing.damaged or line.line
        return replace(standing, place=standing.proven, damaged=first, uncertain=not standing.finished)
    word, _, rest = line.partition(" ")
    if word in _PLACES:
        standing = replace(standing, uncertain=False)
    if word == "run":
        return replace(standing, runs=(*standing.runs, rest), stopped="")
    if word == "part":
        part = int(rest)
        return replace(standing, part=part, begun=True, opened=False, place=START, proven=START, doubtful=False)
    if word == "opened":
        return replace(standing, opened=True)
    if word == _DRAWN:
        number, stroke, time, *unproven = rest.split()
        if int(number) != standing.part:  # that it began was said in a line that is damaged
            standing = replace(standing, opened=False, place=START, proven=START)
        place = DrawnPlace(int(stroke), float(time))
        proven, place = (standing.proven, place) if unproven else (place, max(place, standing.place))
        return replace(standing, part=int(number), begun=True, place=place, proven=proven, doubtful=False)
    if word == "doubtful":
        return replace(standing, place=standing.proven, doubtful=True)
    if word == "complete":
        return replace(standing, part=int(rest) + 1, begun=False, place=START, proven=START)
    if word == "stopped":
        return replace(standing, stopped=rest)
    return replace(standing, finished=True) if word == "finished" else standing


def disk() -> Executor:
    """The thread that writes a journal, entry by entry."""
    return ThreadPoolExecutor(1, "journal")


class PlotJournal:
    """The journal of a job, locked against other programs while it is open.

    standing : how far the job has come, as far as it is known.
    certain : the same, as far as it would survive a power cut.
    syncs : how often the disk was told to keep what it has.

    Raises InputError: it cannot be read or written, or another program has it open.  What cannot be written in the
    thread is raised by whatever is called next.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.syncs = path, 0
        self._file = JournalFile(path, f"The job {path.parent.name} is being plotted by another program.")
        self.standing = _standing(self._file.lines)
        self.certain = self.standing
        self._disk, self._lock = disk(), threading.Lock()
        self._waiting: list[str] = []  # lines that are not written; of places at most two
        self._asked: Future[None] | None = None  # the thread will write these lines
        self._failed: OSError | None = None
        try:
            self._write(f"run {datetime.now().isoformat(timespec='seconds')}")
            self.sync()
        except BaseException:
            self.close()
            raise

    def begin(self, part: int) -> None:
        """A part begins; the person has done what it needs."""
        self._write(f"part {part}")
        self.sync()

    def note_opened(self) -> None:
        """What comes before the page is done."""
        if not self.standing.opened:
            self._write("opened")

    def note_drawn(self, place: DrawnPlace, proven: bool = True) -> None:
        """The part under way is certainly drawn up to a place, and whether that is proven right."""
        if place != (self.standing.proven if proven else self.standing.place):
            more = "" if proven else f" {_UNPROVEN}"
            self._write(f"{_DRAWN} {self.standing.part} {place.stroke} {place.time!r}{more}")

    def doubt(self) -> None:
        """What was drawn after the last proven place may be wrong and will be drawn again."""
        self._write("doubtful")

    def complete(self) -> None:
        """All of the part under way is drawn."""
        self._write(f"complete {self.standing.part}")
        self.sync()

    def finish(self) -> None:
        """All parts are complete."""
        self._write("finished")
        self.sync()

    def secure(self) -> Future[None]:
        """Begin to put all lines on the disk; the future ends when they would survive a power cut, or with an error."""
        return self._disk.submit(self._write_waiting, True)

    def sync(self) -> None:
        """Wait until all lines are on the disk."""
        if self.certain is self.standing:
            return
        self.secure().result()

    def _write(self, text: str) -> None:
        self._check()
        line = " ".join(text.split())
        with self._lock:
            # of places at the end, those of the same kind are left out: a later place says it all
            many = len(self._waiting)
            while _kind(line) and many and _kind(self._waiting[many - 1]):
                many -= 1
            others = [other for other in self._waiting[many:] if _kind(other) != _kind(line)]
            self._waiting = [*self._waiting[:many], *others, line]
            self.standing = _advance_progress(self.standing, line)
        if self._asked is None or self._asked.done():
            self._asked = self._disk.submit(self._write_waiting, False)

    def _check(self) -> None:
        if self._failed is not None:
            raise journal_lines.cannot("write", self.path, self._failed) from self._failed

    def _write_waiting(self, sync: bool) -> None:
        """Write the waiting lines and flush them to the disk (in the thread)."""
        self._check()
        with self._lock:
            lines, self._waiting, standing = self._waiting, [], self.standing
        try:
            self._file.add(b"".join(map(seal, lines)))
            if sync and self.certain is not standing:
                self._file.sync()
                self.certain = standing
                self.syncs += 1
        except OSError as error:
            self._failed = error
            self._check()

    def __enter__(self) -> PlotJournal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if error is not None and not self.standing.finished:
                self._write(f"stopped {reason(error)}")
                self.sync()
        finally:
            self.close()

    def close(self) -> None:
        """Close it when the waiting lines are written and the thread has ended."""
        with contextlib.suppress(RuntimeError):  # closed before
            self._disk.submit(self._file.close)
        self._disk.shutdown()


def _kind(line: str) -> str:
    """The kind of place that a line holds; "" if none."""
    words = line.split()
    return "" if words[0] != _DRAWN else words[-1] if words[-1] == _UNPROVEN else _DRAWN
