"""The mechanics under a simulated controller: where the carriage stands, the pen, and a sheet of paper."""

from __future__ import annotations

from handout.plotting.bed import Placement
from handout.profiles import Plotter
from handout.simulated.plotter.queue import Steps
from handout.simulated.plotter.trace import strokes
from handout.values import Stroke

_SLIP = 40  # steps


class Paper:
    """Remembers where the carriage was when, and what the pen was told when.

    Parameters
    ----------
    steps : steps/mm of x, y and z, in which positions are counted.

    Attributes
    ----------
    trace : when, s, and where the carriage came to, in steps from the machine's true zero.
    power : when the pen was told what: a value of the profile's `pen.up` and `pen.down`, 0 if it was let go.
    shift : steps from where the controller believes the carriage to where it is.
    """

    def __init__(self, profile: Plotter, steps: list[float]) -> None:
        self.profile, self.steps = profile, steps
        height = profile.pen.up if profile.pen.lift == "z" else 0.0
        self.shift: Steps = (0, 0, 0)
        self.trace: list[tuple[float, Steps]] = [(0.0, (0, 0, round(height * steps[2])))]
        self.power: list[tuple[float, float]] = []

    @property
    def at(self) -> Steps:
        """Where the carriage is, in steps from the true zero."""
        return self.trace[-1][1]

    def moved(self, now: float, believed: Steps) -> None:
        """The controller has moved the carriage to where it believes it to be."""
        (x, y, z), shift = believed, self.shift
        self.trace.append((now, (x + shift[0], y + shift[1], z + shift[2])))

    def believe(self, believed: Steps) -> None:
        """The carriage stands still, and the controller changes its mind about where that is."""
        x, y, z = (is_ - said for is_, said in zip(self.at, believed, strict=True))
        self.shift = (x, y, z)

    def slipped(self, believed: Steps) -> Steps:
        """The carriage is stopped dead: some steps are counted and not made; where the controller believes it."""
        counted = (believed[0] + _SLIP, believed[1] + _SLIP, believed[2])
        self.believe(counted)
        return counted

    def homed(self, now: float) -> None:
        """The carriage has found its true zero."""
        self.trace.append((now, (0, 0, self.at[2])))

    def lifted(self, now: float) -> None:
        """A person lifts the pen, at once, whatever it was told a moment before."""
        if self.profile.pen.lift == "z":
            self.trace.append((now, (*self.at[:2], round(self.profile.pen.up * self.steps[2]))))
        told = now - self.profile.pen.up_time
        while self.power and self.power[-1][0] > told:
            self.power.pop()
        self.pen(told, self.profile.pen.up)

    def push_to_zero(self, now: float) -> None:
        """A person lifts the pen and pushes the carriage to its true zero, which the controller does not notice."""
        believed = self.at[0] - self.shift[0], self.at[1] - self.shift[1]
        self.lifted(now)
        self.homed(now)
        self.shift = (-believed[0], -believed[1], self.shift[2])

    def pen(self, now: float, value: float) -> None:
        """The pen is told to go somewhere."""
        self.power.append((now, value))

    def fresh(self, now: float) -> None:
        """A fresh sheet: what was drawn is gone with the last one."""
        self.trace[:] = [(now, self.at)]
        del self.power[:-1]

    @property
    def pen_is_down(self) -> bool:
        """Whether the pen is on the paper, or was last told to go there."""
        pen = self.profile.pen
        if pen.lift == "z":
            height = self.at[2] / self.steps[2]
            return abs(height - pen.down) < abs(height - pen.up)
        power = self.power[-1][1] if self.power else 0.0
        return power > 0 and abs(power - pen.down) < abs(power - pen.up)

    def drawn(self, placement: Placement) -> list[Stroke]:
        """Strokes on the page, with the times at which they were executed."""
        return strokes(self.trace, self.power, self.steps, self.profile.pen, placement)
