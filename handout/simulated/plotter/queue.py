"""A simulated controller's queue of moves: entry speeds from junction deviation, looking back and ahead."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

Steps = tuple[int, int, int]
Vector = tuple[float, float, float]

_STRAIGHT = 0.999999  # cosine of a junction that counts as straight, as in GRBL 1.1's planner


@dataclass
class Axes:
    """Settings of the three axes: steps/mm, greatest speed mm/s, acceleration mm/s²; and the junction deviation, mm."""

    steps: list[float]
    speed: list[float]
    acceleration: list[float]
    deviation: float

    def along(self, unit: Vector, limits: list[float]) -> float:
        """The greatest value in a direction that keeps every axis within its limit."""
        return min(limit / abs(part) for limit, part in zip(limits, unit, strict=True) if part != 0.0)


@dataclass(slots=True)
class Line:
    """One move: whole steps from `start`, `count` of them on the longest axis, `mm` long (what is left of it)."""

    start: Steps
    delta: Steps
    count: int
    mm: float
    whole: float
    unit: Vector
    acceleration: float
    nominal: float
    most: float  # square of the greatest entry speed
    entry: float = 0.0  # square of the planned entry speed


class Queue:
    """Moves that have been read and not yet handed to the steppers."""

    def __init__(self, axes: Axes, size: int) -> None:
        self.axes, self.size = axes, size
        self.lines: deque[Line] = deque()
        self.position: Steps = (0, 0, 0)
        self._unit: Vector = (0.0, 0.0, 0.0)
        self._nominal = 0.0

    @property
    def full(self) -> bool:
        """Whether no further move can be taken."""
        return len(self.lines) >= self.size

    def add(self, target: Vector, feed: float) -> bool:
        """Queue a move to the target, mm, at a feed in mm/s (or as fast as the axes can: infinite).

        Returns whether there was anything to move; less than a step is not.
        """
        axes = self.axes
        there = [math.floor(x * s + 0.5) for x, s in zip(target, axes.steps, strict=True)]
        dx, dy, dz = (a - b for a, b in zip(there, self.position, strict=True))
        count = max(abs(dx), abs(dy), abs(dz))
        if count == 0:
            return False
        way = (dx / axes.steps[0], dy / axes.steps[1], dz / axes.steps[2])
        mm = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        unit = (way[0] / mm, way[1] / mm, way[2] / mm)
        nominal = max(min(feed, axes.along(unit, axes.speed)), 1 / 60)
        most = min(self._corner(unit), nominal * nominal, self._nominal**2) if self.lines else 0.0
        acceleration = axes.along(unit, axes.acceleration)
        line = Line(self.position, (dx, dy, dz), count, mm, mm, unit, acceleration, nominal, most)
        self.lines.append(line)
        self._unit, self._nominal = unit, nominal
        self.position = (there[0], there[1], there[2])
        self.plan()
        return True

    def _corner(self, unit: Vector) -> float:
        """Square of the speed at which the corner between the last move and a new direction may be taken."""
        last = self._unit
        cosine = -(last[0] * unit[0] + last[1] * unit[1] + last[2] * unit[2])
        if cosine > _STRAIGHT:
            return 0.0
        if cosine < -_STRAIGHT:
            return math.inf
        x, y, z = unit[0] - last[0], unit[1] - last[1], unit[2] - last[2]
        norm = math.sqrt(x * x + y * y + z * z)
        acceleration = self.axes.along((x / norm, y / norm, z / norm), self.axes.acceleration)
        half = math.sqrt(0.5 * (1.0 - cosine))
        return acceleration * self.axes.deviation * half / (1.0 - half)

    def plan(self) -> None:
        """Set the entry speeds: back from a stop at the end, then forward from the first line.

        The first line's own is left alone: what comes before it has been handed over and cannot be changed any more.
        """
        lines = self.lines
        after = 0.0
        for index in range(len(lines) - 1, 0, -1):
            line = lines[index]
            after = min(line.most, after + 2.0 * line.acceleration * line.mm)
            line.entry = after
        for index in range(len(lines) - 1):
            line, following = lines[index], lines[index + 1]
            reached = line.entry + 2.0 * line.acceleration * line.mm
            if reached < following.entry:
                following.entry = reached

    @property
    def leave(self) -> float:
        """Square of the speed at which the first line ends."""
        return self.lines[1].entry if len(self.lines) > 1 else 0.0

    def clear(self, position: Steps) -> None:
        """Forget all moves; the machine stands at `position`."""
        self.lines.clear()
        self.position, self._nominal = position, 0.0
