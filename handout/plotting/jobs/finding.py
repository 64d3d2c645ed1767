"""Where on a drawing a machine stands: its own word for its position, as a place on what it was drawing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from handout.plotting.places import Place
from handout.plotting.remaining import remaining
from handout.values import Array, Drawing

_NEAR = (
    0.15  # mm that a machine may stand beside what it was told to draw: segments, steps, a bed that is not quite 1:1
)
_CLEARLY = 0.03  # mm by which it must be nearer to a later place, for way and line may lead along each other
_PAST = 0.03  # mm by which the line has left a place when that is behind it


def found(drawing: Drawing, certain: Place, at: Array, reach: float, zero: Array | None = None) -> Place | None:
    """The place at which a machine has stopped that stands at `at`; None if it stands nowhere on its way.

    Parameters
    ----------
    certain : what is certainly drawn.
    at : (2,) float, mm on the page.
    reach : mm of ink that it can have drawn behind that.
    zero : (2,) float, mm on the page, from where it may have come to begin behind that place.

    Notes
    -----
    Where its line comes by several times it is the first: the others might leave a gap.
    """
    best, nearest, draws = None, _NEAR, False
    for place, a, b, until in _ways(drawing, certain, reach, zero):
        along = b - a
        length2 = float(along @ along)
        share = float(np.clip((at - a) @ along / length2, 0.0, 1.0)) if length2 > 0 else 0.0
        off = float(np.hypot(*(a + share * along - at)))
        if off < (nearest if best is None else nearest - _CLEARLY):
            draws = bool(np.isfinite(until))
            best, nearest = Place(place.stroke, place.time + share * (until - place.time) if draws else place.time), off
        elif draws and off > nearest + _PAST:
            break
    return best


def _ways(
    drawing: Drawing, certain: Place, reach: float, zero: Array | None
) -> Iterator[tuple[Place, Array, Array, float]]:
    """The straight pieces the pen takes from a place on: the place before each, its ends, the time at its end.

    Travels have an infinite time: wherever the pen stands on one, the next stroke has not begun.
    """
    left = remaining(drawing, certain)
    skipped = len(drawing.strokes) - len(left.strokes)
    before: Array | None = None
    for start in _starts(drawing, certain, zero) if left.strokes else ():
        yield certain, start, left.strokes[0].xy[0], np.inf
    for number, stroke in enumerate(left.strokes, skipped):
        if before is not None:
            yield Place(number), before, stroke.xy[0], np.inf
        for at in range(len(stroke.t) - 1):
            yield Place(number, float(stroke.t[at])), stroke.xy[at], stroke.xy[at + 1], float(stroke.t[at + 1])
            reach -= float(np.hypot(*(stroke.xy[at + 1] - stroke.xy[at])))
            if reach < 0:
                return
        if len(stroke.t) == 1:
            yield Place(number), stroke.xy[0], stroke.xy[0], np.inf
        before = stroke.xy[-1]


def _starts(drawing: Drawing, certain: Place, zero: Array | None) -> Iterator[Array]:
    """Where the way to a place begins, with the pen lifted: in zero, or at the end of the stroke before."""
    if zero is not None:
        yield zero
    if 0 < certain.stroke < len(drawing.strokes) and certain.time <= drawing.strokes[certain.stroke].t[0]:
        yield drawing.strokes[certain.stroke - 1].xy[-1]
