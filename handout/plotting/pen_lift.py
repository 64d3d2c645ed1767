"""How a pen comes down and goes up, for all dialects: by which values, how fast, and how long to wait."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from handout.errors import InputError
from handout.plotting.planning import segments
from handout.profiles import PenLift, Time
from handout.values import Array, Drawing

_STEP = 0.02  # s between two values on the way down; a servo hears of a new one every 20 ms
_MOST = 12  # values on the way down


def way(pen: PenLift, down: bool) -> list[tuple[float, float]]:
    """What the pen is told on its way, in order: a value or a height, and how long to wait after it, s.

    A servo that is to come down slowly is told values between; a Z axis moves as slowly by itself (`lowering_speed`).
    """
    if not down:
        return [(pen.up, float(pen.up_time))]
    count = min(max(math.ceil(pen.ramp / _STEP), 1), _MOST) if pen.lift == "servo" else 1
    values = [round(pen.up + (pen.down - pen.up) * step / count, 3) for step in range(1, count + 1)]
    return [*((value, pen.ramp / count) for value in values[:-1]), (pen.down, float(pen.down_time))]


def lowering_speed(pen: PenLift) -> float:
    """Of a Z axis or a stepper on its way down, mm/s: as slow as the ramp asks for."""
    return min(float(pen.z_speed), abs(pen.up - pen.down) / pen.ramp) if pen.ramp > 0 else float(pen.z_speed)


def wait(pen: PenLift, down: bool, line_time: float) -> float:
    """How long the machine stands while the pen moves, s; a Z axis that moves is not waited for by it."""
    waits = [seconds for _, seconds in way(pen, down)]
    if pen.lift == "stepper":
        waits[-1] += abs(pen.up - pen.down) / (lowering_speed(pen) if down else float(pen.z_speed))
    return sum(waits) + (0.0 if pen.lift == "z" and not any(waits) else len(waits) * line_time)


def lower_to(pen: PenLift, value: float | None) -> PenLift:
    """The pen as one that comes down to a value or a height; None: to its own."""
    return pen if value is None else msgspec.structs.replace(pen, down=value)


def lower_at_once(pen: PenLift, value: float) -> PenLift:
    """The pen as one that comes down to a value or a height, at once.

    Raises InputError: there is nothing to set: the plotter has words for it, or it is moved by lines of the user's own.
    """
    if pen.lift == "own":
        raise InputError("This plotter lifts and lowers its pen by itself (HP-GL): there are no heights to set.")
    if pen.lift == "command":
        raise InputError(
            "The pen of this profile is moved by lines of your own (pen.up_command, pen.down_command): there are no "
            "heights to find; change the lines."
        )
    return msgspec.structs.replace(pen, down=value, pressed=None, ramp=Time(0.0))


def heights_along(drawing: Drawing, clock: Array, pen: PenLift) -> Array | None:
    """(n,) mm: where a Z axis holds the pen at times of a drawing's clock, on which stroke follows stroke (`segments`).

    None: it does not follow the pressure, or there is none to follow.  A stroke without pressure is drawn with half.
    """
    if pen.pressed is None or all(stroke.pressure is None for stroke in drawing.strokes):
        return None
    times = segments.on_one_clock([stroke.t for stroke in drawing.strokes], [stroke.xy for stroke in drawing.strokes]).t
    pressure = [np.full(len(s.t), 0.5) if s.pressure is None else s.pressure for s in drawing.strokes]
    heights = pen.down + (pen.pressed - pen.down) * np.interp(clock, times, np.concatenate(pressure))
    return np.asarray(np.round(heights, 3))
