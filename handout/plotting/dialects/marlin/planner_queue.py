"""What Marlin has worked through but may not yet have executed: the moves in its planner's queue.

Source: Marlin's planner: a command is answered when its move is in the queue, of `queue` moves at most; a move of
fewer than six steps makes no block, and its way is made together with the next.
"""

from __future__ import annotations

import math
import re
from collections import deque
from typing import NamedTuple

_LEAST = 6  # steps of a move that is queued at all (MIN_STEPS_PER_SEGMENT)
_WORD = re.compile(rb"([A-Z])(-?[\d.]+)")
_WAITS = (b"M400", b"G4", b"G28")  # answered when all motion before them is done
_SLOWEST = 0.1  # mm/s assumed of a move without a feed


class _Block(NamedTuple):
    """A move in the queue: the first command that makes its way, and how long it takes at its feed, s."""

    first: int
    seconds: float


class PlannerQueue:
    """Follows the commands that have been worked through, in order; a lower bound of what was executed.

    Parameters
    ----------
    queue : moves the planner can hold.
    steps : steps/mm; at : where the machine stands, mm.
    """

    def __init__(self, queue: int, steps: float, at: tuple[float, float, float] | None = None) -> None:
        self.queue, self.steps = queue, steps
        self._blocks: deque[_Block] = deque()
        # where the last queued move ends, as far as it is known
        self._at: dict[bytes, float] = {} if at is None else dict(zip((b"X", b"Y", b"Z"), at, strict=True))
        self._feed = 0.0  # mm/s
        self._short: int | None = None  # first command whose way is not made yet since it was too short
        self._worked = 0

    def worked(self, data: bytes, command: int) -> None:
        """A command was worked through; `command` have been executed when it and its move have."""
        words = dict(_WORD.findall(data))
        if data.startswith(_WAITS):
            self._blocks.clear()
            self._short = None
            if data.startswith(b"G28"):
                self._at.clear()
        elif data.startswith((b"G1", b"G0")):
            self._move({axis: float(words[axis]) for axis in (b"X", b"Y", b"Z") if axis in words}, words, command)
        elif data.startswith((b"G91", b"G92")):
            self._at.clear()
        self._worked = command

    def _move(self, target: dict[bytes, float], words: dict[bytes, bytes], command: int) -> None:
        self._feed = float(words[b"F"]) / 60 if b"F" in words else self._feed
        way = [to - self._at.get(axis, math.inf) for axis, to in target.items()]
        first = command if self._short is None else self._short
        if not way or max(map(abs, way)) * self.steps < _LEAST - 0.5:
            self._short = first
            return
        known = [part for part in way if math.isfinite(part)]
        self._blocks.append(_Block(first, math.hypot(*known) / max(self._feed, _SLOWEST)))
        self._short = None
        self._at |= target
        self.at_most(self.queue)

    def at_most(self, moves: int) -> None:
        """The queue holds no more than so many moves."""
        while len(self._blocks) > moves:
            self._blocks.popleft()

    @property
    def executed(self) -> int:
        """How many commands have certainly been executed."""
        if self._blocks:
            return self._blocks[0].first - 1
        return self._worked if self._short is None else self._short - 1

    @property
    def seconds(self) -> float:
        """How long the moves in the queue take at the least."""
        return sum(block.seconds for block in self._blocks)
