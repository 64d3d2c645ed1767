"""What became of a plot, kept so that it can be gone on with after anything: a pulled cable, a crash, a power cut.

A file of short lines, only ever added to, each with a check sum of its own (CRC-32) in front::

    5d3ae2f1 run 2026-03-01T09:30:00            a program took the job up
    1c0f55b0 part 0                             the person has done what was asked; the part begins
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
as something is certain; `sync` makes sure that all lines survive a power cut too, and only then may the driver rely on
them.  A power cut leaves a torn end at most: that is cut off.  Damage before the end is not what a power cut does.
"""

from __future__ import annotations

import os
import zlib
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from types import TracebackType

from handout import atomic
from handout.errors import InputError
from handout.plotting.places import START, Place


@dataclass(frozen=True)
class Standing:
    """How far a job has come.

    part : the part that is under way or comes next; begun : whether it was begun.
    place : what of its drawing is certainly drawn, or if a command came over wrong, what of it is certainly right;
        proven : what of it is certainly right; doubtful : whether what lies behind `place` may be drawn wrong.
    finished : all parts are complete; stopped : why it ended the last time, "" if that is not known.
    runs : when programs took it up.
    """

    part: int = 0
    begun: bool = False
    place: Place = START
    proven: Place = START
    doubtful: bool = False
    finished: bool = False
    stopped: str = ""
    runs: tuple[str, ...] = ()


def read(path: Path) -> tuple[Standing, int]:
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
    standing, whole, start = Standing(), 0, 0
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


def _after(standing: Standing, line: bytes) -> Standing | None:
    """The standing after a line; None if the line is damaged or torn."""
    if not line.endswith(b"\n") or line[8:9] != b" " or line[:8] != _sum(line[9:-1]):
        return None
    word, _, rest = line[9:-1].decode("utf-8", "replace").partition(" ")
    if word == "run":
        return replace(standing, runs=(*standing.runs, rest), stopped="")
    if word == "part":
        return replace(standing, part=int(rest), begun=True, place=START, proven=START, doubtful=False)
    if word == "drawn":
        part, stroke, time, *unproven = rest.split()
        place = Place(int(stroke), float(time))
        proven, place = (standing.proven, place) if unproven else (place, max(place, standing.place))
        return replace(standing, part=int(part), begun=True, place=place, proven=proven, doubtful=False)
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


class Journal:
    """The journal of a job, held against other programs as long as it is open.

    Attributes
    ----------
    standing : how far the job has come, as far as it is written.
    certain : the same, as far as it would survive a power cut.
    syncs : how often the disk was waited for.

    Raises
    ------
    InputError
        It cannot be read or written, is damaged, or another program has it open.
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
        self._write(f"run {datetime.now().isoformat(timespec='seconds')}")
        self.sync()

    def begin(self, part: int) -> None:
        """A part begins; what was asked of the person before it is done."""
        self._write(f"part {part}")
        self.sync()

    def drawn(self, place: Place, proven: bool = True) -> None:
        """What of the part under way is certainly drawn by now, and whether it is known to be right."""
        if place != (self.standing.proven if proven else self.standing.place):
            more = "" if proven else " unproven"
            self._write(f"drawn {self.standing.part} {place.stroke} {place.time!r}{more}")

    def doubt(self) -> None:
        """What was drawn behind the last proven place may be wrong, wherever the machine stands: it is drawn again."""
        self._write("doubtful")

    def complete(self) -> None:
        """All of the part under way is drawn."""
        self._write(f"complete {self.standing.part}")
        self.sync()

    def finish(self) -> None:
        """All parts are complete."""
        self._write("finished")
        self.sync()

    def sync(self) -> None:
        """Wait until everything written is on the disk."""
        if self.certain is self.standing:
            return
        try:
            os.fsync(self._file.fileno())
        except OSError as error:
            raise _cannot("write", self.path, error) from error
        self.certain = self.standing
        self.syncs += 1

    def _write(self, text: str) -> None:
        line = " ".join(text.split()).encode("utf-8", "replace")
        whole = _sum(line) + b" " + line + b"\n"
        try:
            self._file.write(whole)
        except OSError as error:
            raise _cannot("write", self.path, error) from error
        after = _after(self.standing, whole)
        assert after is not None
        self.standing = after

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if error is not None and not self.standing.finished:
                self._write(f"stopped {str(error) or type(error).__name__}")
                self.sync()
        finally:
            self._file.close()

    def close(self) -> None:
        """Let it go without a word."""
        self._file.close()
