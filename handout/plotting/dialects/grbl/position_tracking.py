"""Where the machine is on its way: which of the commands that were sent its reports of its place belong to.

GRBL has no checksums: a digit that comes over wrong is still a place to go to.  So every report is held against the way
of the commands under way; and since the place lies on the way of the command that is being executed, all before the
first command whose way leads past it have been executed.

Places are told each from the one before, so a command that came over wrong shifts all that follow.  A shift along the
way is not seen as long as that is straight: what was executed is proven when the machine has been seen on two ways
since that lead across each other.
"""

from __future__ import annotations

import math
import re
from collections import deque
from typing import NamedTuple

import numpy as np

from handout.plotting.planning.segments import distance_to_lines

Place = tuple[float, float, float]

_NEAR = 0.03  # mm; what rounding to steps and to three digits makes of a place on the way
FAR = 0.1  # mm from the way at which something is wrong
_ACROSS = 0.5  # sine of the angle between two ways, from which a shift along one of them is seen from the other
_REMEMBERED = 200  # looks
_WORD = re.compile(rb"([GMXYZS])(-?\d*\.?\d+)")


class TrackedMove(NamedTuple):
    """A command: its number, the straight way it leads, and the spindle's value before and after it; and whether it
    certainly takes a place in the machine's queue."""

    number: int
    begin: Place
    end: Place
    power: tuple[float, float]
    moves: bool


class PositionTracking:
    """The ways of the commands that have been sent and not certainly executed.

    Parameters
    ----------
    at : where the machine stands, mm, in the coordinates of the program.
    span : least and greatest value of the spindle other than 0 (``$31``, ``$30``).

    Attributes
    ----------
    proven : how many commands have been executed and found right.
    """

    def __init__(self, at: Place, span: tuple[float, float] = (0.0, 1000.0)) -> None:
        self.at, self._span = at, span
        self._power, self._on, self._relative = 0.0, False, False
        self._ways: deque[TrackedMove] = deque()
        self._power_is_told = False
        self.proven = 0
        self._seen: deque[tuple[int, float, float]] = deque(maxlen=_REMEMBERED)  # commands executed; direction

    def send(self, number: int, line: bytes) -> bool:
        """A command is sent; whether it moves the pen."""
        letters = {match.group(1): float(match.group(2)) for match in _WORD.finditer(line)}
        codes = {match.group(0) for match in _WORD.finditer(line) if match.group(1) in b"GM"}
        before, power = self.at, self._reported_value()
        self._relative = (self._relative or b"G91" in codes) and b"G90" not in codes
        if b"G4" not in codes:
            axes = zip((b"X", b"Y", b"Z"), before, strict=True)
            x, y, z = (letters.get(axis, 0.0 if self._relative else at) + at * self._relative for axis, at in axes)
            self.at = (x, y, z)
        if b"G92" in codes:  # the same place has another name
            before = self.at
        self._on = (self._on or b"M3" in codes) and b"M5" not in codes
        self._power = letters.get(b"S", self._power)
        moves = max(abs(a - b) for a, b in zip(before, self.at, strict=True)) > _NEAR
        self._ways.append(TrackedMove(number, before, self.at, (power, self._reported_value()), moves))
        return power != self._reported_value() or before[2] != self.at[2]

    def _reported_value(self) -> float:
        """The value of the spindle as it is reported."""
        least, greatest = self._span
        return float(round(min(max(self._power, least), greatest))) if self._on and self._power > 0 else 0.0

    def forget(self, executed: int) -> None:
        """Commands before this number have been executed."""
        while self._ways and self._ways[0].number < executed:
            self._ways.popleft()

    def moves(self, first: int, end: int) -> int:
        """How many of the commands from one number to before another move."""
        return sum(way.moves for way in self._ways if first <= way.number < end)

    def _count_executed(self, taken: int, in_hand: int) -> int:
        """How many commands have been executed, if of those taken at most so many moves are still in its hands."""
        moves = 0
        for way in reversed(self._ways):
            if way.number < taken:
                moves += way.moves
                if moves > in_hand:
                    return way.number + 1
        return self._ways[0].number if self._ways else taken

    def certain(self, place: Place, power: float | None, taken: int, in_hand: int) -> int | None:
        """How many commands have been executed for certain, if the machine is at a place.

        in_hand : moves of those taken that may not have been executed yet, at most.

        None: it has strayed from the way of all commands under way, or its spindle has a value none of them gives it.
        """
        if not self._ways:
            return None if math.dist(place, self.at) > FAR else taken
        begin, end = (np.array(ends) for ends in zip(*((way.begin, way.end) for way in self._ways), strict=True))
        off = distance_to_lines(np.array(place), begin, end)
        near = off <= _NEAR
        if off.min() > FAR or self._wrong_power(near, power):
            return None
        if not near.any():  # the beginning of a stray way, perhaps
            return self._ways[0].number
        first = self._ways[int(np.argmax(near))]
        executed = max(first.number, self._count_executed(taken, in_hand))
        self._prove(executed, first)
        return executed

    def _prove(self, executed: int, way: TrackedMove) -> None:
        """It was seen on a way when so many commands were executed."""
        x, y = way.end[0] - way.begin[0], way.end[1] - way.begin[1]
        length = math.hypot(x, y)
        if length <= _NEAR:
            return
        x, y = x / length, y / length
        across = [before for before, a, b in self._seen if abs(a * y - b * x) >= _ACROSS]
        if across:
            self.proven = max(self.proven, across[-1])
            while self._seen and self._seen[0][0] <= self.proven:
                self._seen.popleft()
        self._seen.append((executed, x, y))

    def _wrong_power(self, near: np.ndarray, power: float | None) -> bool:
        """Whether the spindle differs from what it has on every way nearby; only once it has been seen to be told."""
        if power is None or not near.any():
            return False
        powers = {value for way, is_near in zip(self._ways, near, strict=True) if is_near for value in way.power}
        if power in powers:
            self._power_is_told |= power > 0
            return False
        return self._power_is_told
