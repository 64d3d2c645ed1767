"""What the pen of the simulated plotter drew: from times and steps to strokes on the page."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from handout.plotting.bed import Placement
from handout.profiles import Pen
from handout.simulated.plotter.queue import Steps
from handout.values import Array, Stroke

_GRACE = 1e-3  # s; a pen counts as in place so much before its time


def strokes(
    trace: list[tuple[float, Steps]],
    power: list[tuple[float, float]],
    steps: list[float],
    pen: Pen,
    placement: Placement,
) -> list[Stroke]:
    """Strokes from where the machine was when.

    A servo touches the paper no earlier than the profile's `down_time` after it was told to, and leaves it as late as
    `up_time` after it was told to: a move that does not wait loses its beginning, or drags the pen along.

    Parameters
    ----------
    trace : time s and position in steps of x, y, z, in order.
    power : time s and value of the spindle output, in order.
    """
    t = np.array([time for time, _ in trace])
    at = np.array([position for _, position in trace], dtype=float).reshape(-1, 3) / np.array(steps)
    down = _by_height(t, at[:, 2], pen) if pen.lift == "z" else _by_power(power, pen)
    drawn = (_stroke(t, at, begin, end, placement, pen) for begin, end in down)
    return [stroke for stroke in drawn if stroke is not None]


def _by_height(t: Array, z: Array, pen: Pen) -> Iterator[tuple[float, float]]:
    share = (z - pen.down) / (pen.up - pen.down)  # of the way from the paper to where the pen is lifted
    low = np.concatenate([[False], share <= 0.1, [False]])
    change = np.flatnonzero(np.diff(low.astype(int)))
    for begin, end in change.reshape(-1, 2):
        yield float(t[begin]), float(t[end - 1])


def _by_power(power: list[tuple[float, float]], pen: Pen) -> Iterator[tuple[float, float]]:
    begin: float | None = None
    for time, value in power:
        down = value > 0 and abs(value - pen.down) < abs(value - pen.up)
        if down and begin is None:
            begin = time + pen.down_time
        elif not down and begin is not None:
            yield begin - _GRACE, max(begin, time + pen.up_time - _GRACE)
            begin = None
    if begin is not None:
        yield begin - _GRACE, np.inf


def _stroke(t: Array, at: Array, begin: float, end: float, placement: Placement, pen: Pen) -> Stroke | None:
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
