"""What was corrected of a hand and is not in its .hand file yet: a line for each step, on the disk at once.

A .hand file is written whole, which takes longer than a correction may; so steps are appended to a file beside it,
NAME.hand.log, and taken into the .hand file when there is time.  After a break the log tells what had been done.

The first line says which entries of the file's journal the steps follow.  A step is a list of corrections, or the
number of steps that were undone (negative: made again).  A line that was cut off was never answered, and counts for
nothing.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import msgspec

from handout.errors import InputError
from handout.hand import library
from handout.hand.corrections import AnyCorrection, CorrectionJournal

_SUFFIX = ".log"


class _Head(msgspec.Struct, forbid_unknown_fields=True):
    made: int
    format: int = 1


class _Step(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    corrections: tuple[AnyCorrection, ...] = ()
    back: int = 0


class PendingLog:
    """The log of the hand in the file `path`."""

    def __init__(self, path: Path) -> None:
        self.path = path.with_name(path.name + _SUFFIX)

    def exists(self) -> bool:
        """Whether there is one."""
        return self.path.exists()

    def add(self, made: int, corrections: Sequence[AnyCorrection] = (), back: int = 0) -> None:
        """Keep a step; `made` entries of the journal are in force in the .hand file.

        Raises InputError: it cannot be kept; the log is as it was.
        """
        step = msgspec.json.encode(_Step(tuple(corrections), back), enc_hook=float) + b"\n"
        try:
            with self.path.open("ab") as stream:
                before = stream.tell()
                try:
                    head = b"" if before else msgspec.json.encode(_Head(made)) + b"\n"
                    stream.write(head + step)
                    stream.flush()
                    os.fsync(stream.fileno())
                except OSError:
                    os.truncate(self.path, before)
                    raise
        except OSError as error:
            raise InputError(
                f"Cannot keep the correction in {self.path}: {error.strerror or error}; it was not made."
            ) from error

    def read_steps(self, journal: CorrectionJournal) -> list[tuple[AnyCorrection, ...]]:
        """The steps in force that are not among the entries of a file's journal, in their order."""
        if not self.exists():
            return []
        data = self.path.read_bytes()
        whole = data.rfind(b"\n") + 1
        if whole < len(data):
            os.truncate(self.path, whole)
        lines = data[:whole].split(b"\n")[:-1]
        if not lines:
            return []
        try:
            head = msgspec.json.decode(lines[0], type=_Head)
            steps = [msgspec.json.decode(line, type=_Step) for line in lines[1:]]
        except msgspec.MsgspecError as error:
            raise InputError(
                f"{self.path} cannot be read ({error}): it holds corrections that are not in the .hand file yet. "
                "Move it away to go on without them."
            ) from error
        done: list[tuple[AnyCorrection, ...]] = []
        undone: list[tuple[AnyCorrection, ...]] = []
        for step in steps:
            if step.corrections:
                done.append(step.corrections)
                undone = []
            for _ in range(abs(step.back)):
                source, target = (done, undone) if step.back > 0 else (undone, done)
                if source:
                    target.append(source.pop())
        # the journal may have them already, after the entries that it had when they were made
        there = journal.entries[: journal.made][head.made : head.made + len(done)]
        held = len(there) == len(done) and all(a.corrections == b for a, b in zip(there, done, strict=True))
        return done if not held else []

    def forget(self) -> None:
        """Delete it: the .hand file has all that it held."""
        self.path.unlink(missing_ok=True)


def untaken(hand: str) -> tuple[str, ...]:
    """What has to be said of a hand by name or path whose file lacks corrections that its log holds; mostly nothing."""
    path = Path(hand) if hand.endswith(".hand") else library.own_scanned().get(hand)
    if path is None or not (log := PendingLog(path)).exists():
        return ()
    return (
        f"{log.path.name} holds corrections that {path.name} lacks, as after a break: open it with `handout hand tag "
        f"{hand}` to have them taken in.",
    )
