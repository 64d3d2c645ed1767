"""Records how far a plot has come, so that it can be resumed after a pulled cable, a crash or a power cut.

A file of short lines, only ever added to, each with a check sum of its own (CRC-32) in front::

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
on them.  A power cut leaves a torn end at most: that is cut off.  Damage before the end is not what a power cut does.

A disk may take a second for one line (a memory card, a disk that is busy).  So a thread of its own writes, and whoever
draws goes on: `drawn` and `doubt` never wait.  Of places that wait to be written only the last of
either kind is kept.
"""

from __future__ import annotations

import contextlib
import os
import threading
import zlib
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from types import TracebackType

from handout import atomic
from handout.errors import InputError, reason
from handout.plotting.jobs.places import START, Place

_DRAWN, _UNPROVEN = "drawn", "unproven"


@dataclass(frozen=True)
class JobProgress:
    """How far a job has come.

    part : the part that is under way or comes next; begun : whether it was begun; opened : whether all that comes
        before its page is done.
    place : what of its drawing is certainly drawn, or if a command came over wrong, what of it is certainly right;
        proven : what of it is certainly right; doubtful : whether what lies behind `place` may be drawn wrong.
    finished : all parts are complete; stopped : why it ended the last time, "" if that is not known.
    runs : when programs took it up.
    """

    part: int = 0
    begun: bool = False
    opened: bool = False
    place: Place = START
    proven: Place = START
    doubtful: bool = False
    finished: bool = False
    stopped: str = ""
    runs: tuple[str, ...] = ()


def read(path: Path) -> tuple[JobProgress, int]:
    """How far a job has come, and how many bytes of its journal are whole.

    Raises
    ------
    InputError
        It cannot be read, or is damaged before its end.
    """
    try:
        data = path.read_bytes() if path.exists() else b""
    except OSError as error:
        raise _cannot("read", path, error) from error
    standing, whole, start = JobProgress(), 0, 0
    for number, line in enumerate(data.splitlines(keepends=True), 1):
        start += len(line)
        after = _after(standing, line)
        if after is None:
            continue
        if whole != start - len(line):
            raise InputError(
                f"The journal {path} is damaged before line {number}: what is drawn is not certain. Take out the "
                "damaged lines if you know that no ink is missing, or plot the job anew."
            )
        standing, whole = after, start
    return standing, whole


def _after(standing: JobProgress, line: bytes) -> JobProgress | None:
    """The standing after a line; None if the line is damaged or torn."""
    if not line.endswith(b"\n") or line[8:9] != b" " or line[:8] != _sum(line[9:-1]):
        return None
    word, _, rest = line[9:-1].decode("utf-8", "replace").partition(" ")
    if word == "run":
        return replace(standing, runs=(*standing.runs, rest), stopped="")
    if word == "part":
        part = int(rest)
        return replace(standing, part=part, begun=True, opened=False, place=START, proven=START, doubtful=False)
    if word == "opened":
        return replace(standing, opened=True)
    if word == _DRAWN:
        number, stroke, time, *unproven = rest.split()
        place = Place(int(stroke), float(time))
        proven, place = (standing.proven, place) if unproven else (place, max(place, standing.place))
        return replace(standing, part=int(number), begun=True, place=place, proven=proven, doubtful=False)
    if word == "doubtful":
        return replace(standing, place=standing.proven, doubtful=True)
    if word == "complete":
        return replace(standing, part=int(rest) + 1, begun=False, place=START, proven=START)
    if word == "stopped":
        return replace(standing, stopped=rest)
    return replace(standing, finished=True) if word == "finished" else standing


def _cannot(what: str, path: Path, error: OSError) -> InputError:
    return InputError(f"Cannot {what} the journal {path}: {error.strerror or error}.")


def _sum(text: bytes) -> bytes:
    return b"%08x" % zlib.crc32(text)


def disk() -> Executor:
    """The thread that writes a journal, entry by entry."""
    return ThreadPoolExecutor(1, "journal")


class Journal:
    """The journal of a job, locked against other programs while it is open.

    Attributes
    ----------
    standing : how far the job has come, as far as it is known.
    certain : the same, as far as it would survive a power cut.
    syncs : how often the disk was told to keep what it has.

    Raises
    ------
    InputError
        It cannot be read or written, is damaged, or another program has it open.  What cannot be written in the thread
        is raised by whatever is called next.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.syncs = path, 0
        try:
            self._file = path.open("ab", buffering=0)
        except OSError as error:
            raise _cannot("write", path, error) from error
        try:
            atomic.lock(self._file)
            self.standing, whole = read(path)
            self._file.truncate(whole)
        except OSError as error:
            self._file.close()
            raise InputError(f"The job {path.parent.name} is being plotted by another program.") from error
        except InputError:
            self._file.close()
            raise
        self.certain = self.standing
        self._disk, self._lock = disk(), threading.Lock()
        self._waiting: list[bytes] = []  # lines that are not written; of places at most two
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

    def opened(self) -> None:
        """What comes before the page is done."""
        if not self.standing.opened:
            self._write("opened")

    def drawn(self, place: Place, proven: bool = True) -> None:
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
        return self._disk.submit(self._put, True)

    def sync(self) -> None:
        """Wait until all lines are on the disk."""
        if self.certain is self.standing:
            return
        self.secure().result()

    def _write(self, text: str) -> None:
        self._check()
        line = " ".join(text.split()).encode("utf-8", "replace")
        whole = _sum(line) + b" " + line + b"\n"
        with self._lock:
            self._waiting = [*_behind(self._waiting, whole), whole]
            after = _after(self.standing, whole)
            assert after is not None
            self.standing = after
        if self._asked is None or self._asked.done():
            self._asked = self._disk.submit(self._put, False)

    def _check(self) -> None:
        if self._failed is not None:
            raise _cannot("write", self.path, self._failed) from self._failed

    def _put(self, sync: bool) -> None:
        """Write the waiting lines and flush them to the disk (in the thread)."""
        self._check()
        with self._lock:
            lines, self._waiting, standing = b"".join(self._waiting), [], self.standing
        try:
            while lines:  # a disk that fills up takes a part
                lines = lines[self._file.write(lines) or 0 :]
            if sync and self.certain is not standing:
                os.fsync(self._file.fileno())
                self.certain = standing
                self.syncs += 1
        except OSError as error:
            self._failed = error
            self._check()

    def __enter__(self) -> Journal:
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


def _behind(waiting: list[bytes], line: bytes) -> list[bytes]:
    """The waiting lines without those that a new line of this kind replaces: places of the same kind at the end."""
    if not (kind := _kind(line)):
        return waiting
    many = len(waiting)
    while many and _kind(waiting[many - 1]):
        many -= 1
    return waiting[:many] + [line for line in waiting[many:] if _kind(line) != kind]  # a later place says it all


def _kind(line: bytes) -> str:
    """The kind of place that a line holds; "" if none."""
    words = line[9:].decode("utf-8", "replace").split()
    return "" if words[0] != _DRAWN else words[-1] if words[-1] == _UNPROVEN else _DRAWN
