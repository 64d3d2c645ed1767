"""The simulated Marlin's planner: blocks, the speeds between them, and what it does when few of them are left.

Source: Marlin's planner, read for facts: acceleration of travel moves along the path, junction deviation with a limit
for the curves that short segments make, or classic jerk; a block under way is not planned anew.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from handout.simulated.plotter.queue import Line, Steps, Vector

_LEAST = 6  # steps of a block
_STRAIGHT = 0.999999
_OCTAGON = -math.sqrt(0.5)  # cosine of the junction from which on short segments are taken for a curve
_SHORT = 1.0  # mm


@dataclass
class Axes:
    """Settings: of x, y and z steps/mm, mm/s, mm/s²; along the path mm/s²; mm; mm/s (0: junction deviation); s."""

    steps: list[float]
    speed: list[float]
    acceleration: list[float]
    travel: float
    deviation: float
    jerk: float
    least_time: float = 0.02


class Planner:
    """Blocks that have been read and not yet been run; `lines`, `leave` and `position` are for the stepper."""

    def __init__(self, axes: Axes, size: int) -> None:
        self.axes, self.size = axes, size
        self.lines: deque[Line] = deque()
        self.position: Steps = (0, 0, 0)
        self._unit: Vector = (0.0, 0.0, 0.0)
        self._nominal = 0.0
        self._running: Line | None = None

    @property
    def full(self) -> bool:
        """Whether no further block can be taken."""
        return len(self.lines) >= self.size

    @property
    def waiting(self) -> int:
        """Blocks that are not under way."""
        return len(self.lines) - bool(self.lines and self.lines[0] is self._running)

    def add(self, target: Vector, feed: float) -> bool:
        """Queue a move to the target, mm, at a feed in mm/s; a move of a few steps waits for the next one."""
        axes = self.axes
        there = [math.floor(x * s + 0.5) for x, s in zip(target, axes.steps, strict=True)]
        dx, dy, dz = (a - b for a, b in zip(there, self.position, strict=True))
        count = max(abs(dx), abs(dy), abs(dz))
        if count < _LEAST:
            return False
        way = (dx / axes.steps[0], dy / axes.steps[1], dz / axes.steps[2])
        mm = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        unit = (way[0] / mm, way[1] / mm, way[2] / mm)
        nominal = _along(unit, axes.speed, mm / self._slowed(mm / max(feed, 0.01)))
        acceleration = _along(unit, axes.acceleration, axes.travel)
        least = min(0.5 * acceleration * mm / count, nominal * nominal)
        most = self._corner(unit, mm, nominal, acceleration)
        most = max(min(most, nominal * nominal), least)
        line = Line(self.position, (dx, dy, dz), count, mm, mm, unit, acceleration, nominal, most, least)
        self.lines.append(line)
        self._unit, self._nominal = unit, nominal
        self.position = (there[0], there[1], there[2])
        self.plan()
        return True

    def _slowed(self, time: float) -> float:
        """Time of a segment, longer if few are left in the queue."""
        missing = self.axes.least_time - time
        if missing <= 0 or not 2 <= self.waiting <= (self.size + 1) // 2 - 1:
            return time
        return time + 2.0 * missing / self.waiting

    def _corner(self, unit: Vector, mm: float, nominal: float, acceleration: float) -> float:
        """Square of the greatest speed at the beginning of a block."""
        alone = not self.waiting
        if self.axes.jerk:
            before = (0.0, 0.0, 0.0) if alone else self._unit
            change = max(abs(a - b) for a, b in zip(unit, before, strict=True))
            slower = nominal if alone else min(nominal, self._nominal)
            return min(slower, self.axes.jerk / change if change else math.inf) ** 2
        if alone:
            return 0.0
        last = self._unit
        cosine = -(last[0] * unit[0] + last[1] * unit[1] + last[2] * unit[2])
        if cosine > _STRAIGHT:
            return 0.0
        return min(self._round(cosine, last, unit, mm, acceleration), self._nominal**2)

    def _round(self, cosine: float, last: Vector, unit: Vector, mm: float, acceleration: float) -> float:
        """Junction deviation; and for short segments the speed of the curve of which they are chords."""
        x, y, z = unit[0] - last[0], unit[1] - last[1], unit[2] - last[2]
        norm = math.sqrt(x * x + y * y + z * z)
        if norm == 0.0:
            return math.inf
        across = _along((x / norm, y / norm, z / norm), self.axes.acceleration, acceleration)
        half = math.sqrt(0.5 * (1.0 - max(cosine, -_STRAIGHT)))
        speed2 = across * self.axes.deviation * half / (1.0 - half)
        if mm < _SHORT and cosine < _OCTAGON:
            turn = max(math.acos(min(-cosine, 1.0)), 0.033)  # where Marlin's own arc cosine ends
            speed2 = min(speed2, mm * across / turn)
        return speed2

    def plan(self) -> None:
        """Set the speeds between blocks that are not settled: back from a stop at the end, then forward."""
        lines = self.lines
        settled = 2 if lines and lines[0] is self._running else 1
        after = 0.0
        for index in range(len(lines) - 1, settled - 1, -1):
            line = lines[index]
            after = min(line.most, after + 2.0 * line.acceleration * line.mm)
            line.entry = after
        for index in range(settled - 1, len(lines) - 1):
            line, following = lines[index], lines[index + 1]
            following.entry = min(following.entry, line.entry + 2.0 * line.acceleration * line.mm)

    @property
    def leave(self) -> float:
        """Square of the speed at which the first block ends; settled once the stepper has asked, as it begins it."""
        self._running = self.lines[0]
        return self.lines[1].entry if len(self.lines) > 1 else 0.0

    def clear(self, position: Steps) -> None:
        """Forget all blocks; the machine stands at `position`."""
        self.lines.clear()
        self.position, self._nominal, self._running = position, 0.0, None


def _along(unit: Vector, limits: list[float], most: float) -> float:
    """The greatest value in a direction, at most `most`, that keeps every axis within its limit."""
    return min(most, *(limit / abs(part) if part else math.inf for limit, part in zip(limits, unit, strict=True)))
