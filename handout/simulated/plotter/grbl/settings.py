"""The simulated GRBL's own settings (``$$``): what the profile says, unless an option says otherwise."""

from __future__ import annotations

from handout.profiles import Plotter
from handout.simulated.plotter.grbl.parser import Refused
from handout.simulated.plotter.options import Options
from handout.simulated.plotter.queue import Axes

_Z_STEPS = 250.0


class Settings:
    """A table of numbers, and what follows from it.

    table : number → value as it is told.
    axes : what the planner goes by.
    """

    def __init__(self, profile: Plotter, options: Options) -> None:
        self.table = _table(profile, options) | {number: f"{value:.3f}" for number, value in options.settings}
        self.axes = Axes([1.0] * 3, [1.0] * 3, [1.0] * 3, 0.0)
        self._obey()

    def value(self, number: int) -> float:
        """One setting."""
        return float(self.table[number])

    def change(self, number: int, value: float) -> None:
        """Take a new value; Refused if there is no such setting, or it needs another first."""
        if number not in self.table:
            raise Refused(3)
        if number == 20 and value and not self.homes:
            raise Refused(10)
        self.table[number] = f"{value:.3f}"
        self._obey()

    @property
    def homes(self) -> bool:
        """Whether it can find its zero, and is locked until it has."""
        return self.value(22) % 2 == 1

    @property
    def limited(self) -> bool:
        """Whether targets beyond its travel are refused."""
        return self.value(20) > 0

    @property
    def report(self) -> int:
        """What it answers to ``?``: bit 0 machine coordinates, bit 1 its buffers."""
        return int(self.value(10))

    @property
    def power(self) -> tuple[float, float]:
        """Least and greatest value of the spindle output other than 0."""
        return self.value(31), self.value(30)

    def _obey(self) -> None:
        axes = self.axes
        axes.deviation, axes.steps[:] = self.value(11), [self.value(100 + axis) for axis in range(3)]
        axes.speed[:] = [self.value(110 + axis) / 60 for axis in range(3)]
        axes.acceleration[:] = [self.value(120 + axis) for axis in range(3)]


def _table(profile: Plotter, options: Options) -> dict[int, str]:
    limits, pen, bed = profile.limits, profile.pen, profile.bed
    fastest = options.speed or max(limits.draw_speed, limits.travel_speed)
    acceleration = options.acceleration or limits.acceleration
    table = {10: "3", 11: f"{limits.junction_deviation:.3f}", 13: "0", 20: "0", 21: "1", 22: f"{profile.homing:d}"}
    table |= {23: "0", 30: "1000", 31: "0", 32: "0"}
    rows = (
        (100, [limits.steps_per_mm, limits.steps_per_mm, _Z_STEPS]),
        (110, [fastest * 60, fastest * 60, pen.z_speed * 60]),
        (120, [acceleration, acceleration, pen.z_acceleration]),
        (130, [bed.width, bed.height, 50.0]),
    )
    return table | {first + axis: f"{value:.3f}" for first, values in rows for axis, value in enumerate(values)}
