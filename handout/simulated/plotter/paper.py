"""The mechanics under a simulated controller: carriage, pen, and a sheet of paper with what is drawn on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from handout.plotting.bed import BedPlacement
from handout.profiles import PenLift, Plotter
from handout.simulated.plotter.planner import Steps
from handout.values import Array, Stroke

_SLIP = 40  # steps lost in a dead stop; set by eye, half a millimetre at 80 steps/mm


class DrawnPaper:
    """Remembers where the carriage was when, and what the pen was told when.

    steps : steps/mm of x, y and z, in which positions are counted.

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
    def place(self) -> Steps:
        """Where the carriage is, in steps from the true zero."""
        return self.trace[-1][1]

    def move_to(self, now: float, believed: Steps) -> None:
        """Record that the controller moved the carriage to where it believes it to be."""
        (x, y, z), shift = believed, self.shift
        self.trace.append((now, (x + shift[0], y + shift[1], z + shift[2])))

    def believe(self, believed: Steps) -> None:
        """Record that the controller takes another place for that where the carriage stands."""
        x, y, z = (is_ - counted for is_, counted in zip(self.place, believed, strict=True))
        self.shift = (x, y, z)

    def slip_steps(self, believed: Steps) -> Steps:
        """Stop the carriage dead: some steps are counted and not made; returns where the controller takes it to be."""
        counted = (believed[0] + _SLIP, believed[1] + _SLIP, believed[2])
        self.believe(counted)
        return counted

    def find_zero(self, now: float) -> None:
        """Record that the carriage is at its true zero."""
        self.trace.append((now, (0, 0, self.place[2])))

    def lift_pen(self, now: float) -> None:
        """Lift the pen at once, as a person does, whatever it was told a moment before."""
        if self.profile.pen.lift == "z":
            self.trace.append((now, (*self.place[:2], round(self.profile.pen.up * self.steps[2]))))
        when = now - self.profile.pen.up_time
        while self.power and self.power[-1][0] > when:
            self.power.pop()
        self.pen(when, self.profile.pen.up)

    def push_to_zero(self, now: float) -> None:
        """A person lifts the pen and pushes the carriage to its true zero, which the controller does not notice."""
        believed = self.place[0] - self.shift[0], self.place[1] - self.shift[1]
        self.lift_pen(now)
        self.find_zero(now)
        self.shift = (-believed[0], -believed[1], self.shift[2])

    def pen(self, now: float, value: float) -> None:
        """Record a command to the pen."""
        self.power.append((now, value))

    def fresh(self, now: float) -> None:
        """Lay a fresh sheet: what was drawn is gone with the last one."""
        self.trace[:] = [(now, self.place)]
        del self.power[:-1]

    @property
    def pen_is_down(self) -> bool:
        """Whether the pen is on the paper, or was last told to go there."""
        pen = self.profile.pen
        if pen.lift == "z":
            height = self.place[2] / self.steps[2]
            return abs(height - pen.down) < abs(height - pen.up)
        return bool(self.power) and _is_down(self.power[-1][1], pen)

    def read_strokes(self, placement: BedPlacement) -> list[Stroke]:
        """Strokes on the page, with the times at which they were executed."""
        return strokes(self.trace, self.power, self.steps, self.profile.pen, placement)


_GRACE = 1e-3  # s; a pen counts as in place so much before its time


def strokes(
    trace: list[tuple[float, Steps]],
    power: list[tuple[float, float]],
    steps: list[float],
    pen: PenLift,
    placement: BedPlacement,
) -> list[Stroke]:
    """Strokes from where the machine was when.

    A servo touches the paper no earlier than the profile's `down_time` after it was told to, and leaves it as late as
    `up_time` after it was told to: a move that does not wait loses its beginning, or drags the pen along.

    trace : time s and position in steps of x, y, z, in order.
    power : time s and value of the spindle output, in order.
    """
    t = np.array([time for time, _ in trace])
    at = np.array([position for _, position in trace], dtype=float).reshape(-1, 3) / np.array(steps)
    down = _by_height(t, at[:, 2], pen) if pen.lift == "z" else _by_power(power, pen)
    if pen.lift == "servo" and power:  # its value stands where a Z axis has its height
        when, value = np.array(power).T
        at[:, 2] = value[np.maximum(np.searchsorted(when, t, side="right") - 1, 0)]
    drawn = (_stroke(t, at, begin, end, placement, pen) for begin, end in down)
    return [stroke for stroke in drawn if stroke is not None]


def _by_height(t: Array, z: Array, pen: PenLift) -> Iterator[tuple[float, float]]:
    share = (z - pen.down) / (pen.up - pen.down)  # of the way from the paper to where the pen is lifted
    low = np.concatenate([[False], share <= 0.1, [False]])
    change = np.flatnonzero(np.diff(low.astype(int)))
    for begin, end in change.reshape(-1, 2):
        yield float(t[begin]), float(t[end - 1])


def _is_down(value: float, pen: PenLift) -> bool:
    """Whether a value brings the pen down; a servo with none is let go, a stepper stands where it is told to."""
    return (value > 0 or pen.lift == "stepper") and abs(value - pen.down) < abs(value - pen.up)


def _by_power(power: list[tuple[float, float]], pen: PenLift) -> Iterator[tuple[float, float]]:
    begin: float | None = None
    for time, value in power:
        down = _is_down(value, pen)
        if down and begin is None:
            begin = time + pen.down_time
        elif not down and begin is not None:
            yield begin - _GRACE, max(begin, time + pen.up_time - _GRACE)
            begin = None
    if begin is not None:
        yield begin - _GRACE, np.inf


def _stroke(t: Array, at: Array, begin: float, end: float, placement: BedPlacement, pen: PenLift) -> Stroke | None:
    """The samples from begin to end without the rests before and after; one sample if the pen did not move."""
    a, b = int(np.searchsorted(t, begin)), int(np.searchsorted(t, end, side="right"))
    if a == b:
        if a == 0:
            return None
        return Stroke(np.array([begin]), placement.to_page(at[a - 1 : a, :2]))
    moved = np.flatnonzero((at[a:b, :2] != at[a, :2]).any(axis=1))
    if len(moved) == 0:
        return Stroke(t[a : a + 1], placement.to_page(at[a : a + 1, :2]))
    under_way = np.flatnonzero((at[a:b, :2] != at[b - 1, :2]).any(axis=1))  # a closed stroke ends where it began
    a, b = a + int(moved[0]) - 1, a + int(under_way[-1]) + 2
    rows = np.arange(a, b)[np.append(True, np.diff(t[a:b]) > 0)]
    pressure = None
    if pen.pressed is not None:
        pressure = np.clip((at[rows, 2] - pen.down) / ((pen.pressed - pen.down) or 1.0), 0.0, 1.0)
    return Stroke(t[rows], placement.to_page(at[rows, :2]), pressure)
