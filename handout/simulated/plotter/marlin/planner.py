"""The simulated Marlin's planner: blocks, the speeds between them, and what it does when few of them are left.

Source: Marlin's planner, read for facts: acceleration of travel moves along the path, junction deviation with a limit
for the curves that short segments make, or classic jerk; a block under way is not planned anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from handout.simulated.plotter.queue import Axes, MoveQueue, StepLine, Steps, Vector

_STRAIGHT = 0.999999  # cosine of a junction that counts as straight
_OCTAGON = -math.sqrt(0.5)  # cosine of the junction from which on short segments are taken for a curve
_SHORT = 1.0  # mm


@dataclass
class MarlinAxes(Axes):
    """Settings besides: acceleration along the path, mm/s²; jerk, mm/s (0: junction deviation); least time, s."""

    travel: float
    jerk: float
    least_time: float = 0.02


class Planner(MoveQueue):
    """Blocks that have been read and not yet been run; a move of a few steps waits for the next one."""

    least = 6

    def __init__(self, axes: MarlinAxes, size: int) -> None:
        super().__init__(axes, size)
        self.settings = axes
        self._running: StepLine | None = None

    @property
    def waiting(self) -> int:
        """Blocks that are not under way."""
        return len(self.lines) - bool(self.lines and self.lines[0] is self._running)

    def limit(self, line: StepLine, feed: float) -> None:
        """Longer if few blocks are left in the queue; no slower at its beginning than half its first step allows."""
        axes, mm, time = self.settings, line.mm, line.mm / max(feed, 0.01)
        missing = axes.least_time - time
        if missing > 0 and 2 <= self.waiting <= (self.size + 1) // 2 - 1:
            time += 2.0 * missing / self.waiting
        line.nominal = min(mm / time, axes.limit_along(line.unit, axes.speed))
        line.acceleration = min(axes.travel, axes.limit_along(line.unit, axes.acceleration))
        line.entry = min(0.5 * line.acceleration * mm / line.count, line.nominal * line.nominal)
        line.most = max(min(self._begin(line), line.nominal * line.nominal), line.entry)

    def _begin(self, line: StepLine) -> float:
        """Square of the greatest speed at the beginning of a block."""
        alone, unit, nominal = not self.waiting, line.unit, line.nominal
        if self.settings.jerk:
            before = (0.0, 0.0, 0.0) if alone else self._unit
            change = max(abs(a - b) for a, b in zip(unit, before, strict=True))
            slower = nominal if alone else min(nominal, self._nominal)
            return min(slower, self.settings.jerk / change if change else math.inf) ** 2
        if alone:
            return 0.0
        last = self._unit
        cosine = -(last[0] * unit[0] + last[1] * unit[1] + last[2] * unit[2])
        if cosine > _STRAIGHT:
            return 0.0
        return min(self._round(cosine, last, unit, line.mm, line.acceleration), self._nominal**2)

    def _round(self, cosine: float, last: Vector, unit: Vector, mm: float, acceleration: float) -> float:
        """Junction deviation; and for short segments the speed of the curve of which they are chords."""
        x, y, z = unit[0] - last[0], unit[1] - last[1], unit[2] - last[2]
        norm = math.sqrt(x * x + y * y + z * z)
        if norm == 0.0:
            return math.inf
        across = min(acceleration, self.axes.limit_along((x / norm, y / norm, z / norm), self.axes.acceleration))
        half = math.sqrt(0.5 * (1.0 - max(cosine, -_STRAIGHT)))
        speed2 = across * self.axes.deviation * half / (1.0 - half)
        if mm < _SHORT and cosine < _OCTAGON:
            turn = max(math.acos(min(-cosine, 1.0)), 0.033)  # where Marlin's own arc cosine ends
            speed2 = min(speed2, mm * across / turn)
        return speed2

    def plan(self, settled: int = 1) -> None:
        """Set the speeds between blocks that are not settled."""
        super().plan(2 if self.lines and self.lines[0] is self._running else settled)

    @property
    def leave(self) -> float:
        """Square of the speed at which the first block ends; settled once the stepper has asked, as it begins it."""
        self._running = self.lines[0]
        return super().leave

    def clear(self, position: Steps) -> None:
        """Forget all blocks; the machine stands at `position`."""
        super().clear(position)
        self._running = None
