"""The strokes of letters whose pen was recorded: their vertices are numbered in the order of writing."""

from __future__ import annotations

import numpy as np

from handout.hand.scanned import NOBODY, ScannedHand
from handout.motion.recovery.lines import Line, Written
from handout.values import POSE, Array, Indices, LineGraph
from handout.writing.scanned.forms import Forms


def recorded(hand: ScannedHand, forms: Forms, number: int, line: Line) -> Written:
    """How a glyph of a recorded page was written.

    Parameters
    ----------
    line : its body, whose vertices are in the order of writing, and after it its ways.
    """
    body = forms.vertices(number)
    graph = LineGraph(line.xy, line.radius, line.density, np.zeros((len(line.xy), 2)), line.edges)
    strokes = sorted((_forwards(path, line, len(body)) for path in graph.branches), key=lambda path: _first(path, body))
    beside = hand.glyphs[number].after
    onward = forms.vertices(beside).min() if beside != NOBODY else np.inf
    return Written(tuple(strokes), tuple(bool(body[_first(path, body)] > onward) for path in strokes))


def _first(path: Indices, body: Indices) -> int:
    """The place in the body of what of a path was written first; one that is all way has the last."""
    return int(min(path[path < len(body)], default=len(body) - 1))


def _forwards(path: Indices, line: Line, count: int) -> Indices:
    """A path from where the pen began."""
    own = path[path < count]
    if len(own) > 1:
        return path if own[0] < own[-1] else path[::-1]
    return path[::-1] if path[-1] in line.begin or path[0] in line.finish else path


def clocks(hand: ScannedHand, forms: Forms, number: int) -> tuple[Array, Array] | None:
    """(n,) s and (n, 4): when the pen was at each vertex of a glyph's body and how it was held (channels as in
    `POSE`), nan where that is not known; None for one that was not recorded.
    """
    glyph = hand.glyphs[number]
    moments = hand.pages[glyph.page].moments
    if moments is None:
        return None
    own = forms.vertices(number)
    times, *pose = (
        np.full(len(own), np.nan) if known is None else known[own]
        for known in (getattr(moments, name) for name in ("times", *POSE))
    )
    return times, np.column_stack(pose)
