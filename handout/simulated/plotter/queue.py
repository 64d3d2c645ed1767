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

    def limit_along(self, unit: Vector, limits: list[float]) -> float:
        """The greatest value in a direction that keeps every axis within its limit."""
        return min(limit / abs(part) for limit, part in zip(limits, unit, strict=True) if part != 0.0)


@dataclass(slots=True)
class StepLine:
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


class MoveQueue:
    """Moves that have been read and not yet handed to the steppers."""

    least = 1  # steps of a move that is queued

    def __init__(self, axes: Axes, size: int) -> None:
        self.axes, self.size = axes, size
        self.lines: deque[StepLine] = deque()
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
        steps = self.axes.steps
        there = [math.floor(x * s + 0.5) for x, s in zip(target, steps, strict=True)]
        dx, dy, dz = (a - b for a, b in zip(there, self.position, strict=True))
        count = max(abs(dx), abs(dy), abs(dz))
        if count < self.least:
            return False
        way = (dx / steps[0], dy / steps[1], dz / steps[2])
        mm = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        unit = (way[0] / mm, way[1] / mm, way[2] / mm)
        line = StepLine(self.position, (dx, dy, dz), count, mm, mm, unit, 0.0, 0.0, 0.0)
        self.limit(line, feed)
        self.lines.append(line)
        self._unit, self._nominal = unit, line.nominal
        self.position = (there[0], there[1], there[2])
        self.plan()
        return True

    def limit(self, line: StepLine, feed: float) -> None:
        """Set how fast a new line may be run at a feed, how fast begun, and its acceleration."""
        axes = self.axes
        line.nominal = max(min(feed, axes.limit_along(line.unit, axes.speed)), 1 / 60)
        line.most = min(self._corner(line.unit), line.nominal * line.nominal, self._nominal**2) if self.lines else 0.0
        line.acceleration = axes.limit_along(line.unit, axes.acceleration)

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
        acceleration = self.axes.limit_along((x / norm, y / norm, z / norm), self.axes.acceleration)
        half = math.sqrt(0.5 * (1.0 - cosine))
        return acceleration * self.axes.deviation * half / (1.0 - half)

    def plan(self, settled: int = 1) -> None:
        """Set the entry speeds: back from a stop at the end, then forward from the last line that is settled.

        The first line's own is left alone: what comes before it has been handed over and cannot be changed any more.
        """
        lines = self.lines
        after = 0.0
        for index in range(len(lines) - 1, settled - 1, -1):
            line = lines[index]
            after = min(line.most, after + 2.0 * line.acceleration * line.mm)
            line.entry = after
        for index in range(settled - 1, len(lines) - 1):
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
