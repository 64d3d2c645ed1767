"""Strokes on a page of scanned ink, such as those that strike a word out, in the same ink as its letters."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from handout.hand.measures import half_width
from handout.hand.scanned import NOBODY, ScannedHand
from handout.inking.replacing import replace_pen
from handout.inking.specimens import DRAWN
from handout.motion.optimal_control import follow
from handout.values import ActionPlan, Array, Glyph, Ink, LineGraph, Manuscript, Placed

_SMOOTH = 0.28  # of the movement, see ActionPlan: a stroke that is not aimed rounds its turns
_LEAST, _MOST = 0.05, 10.0  # mm, of a line


def with_strokes(page: Manuscript, written: Manuscript, sample: ScannedHand) -> Manuscript:
    """A page with the strokes of what was written on it, inked, after the letters of their lines.

    Parameters
    ----------
    page : Manuscript
        Of ink of `sample`.
    written : Manuscript
        The same lines, in which the strokes are; its ink is not looked at.
    sample : ScannedHand
        Whose ink the strokes are written with, as wide as the letters of the page.

    Raises
    ------
    InputError
        There are strokes, and too few clear pieces of line to write them with.
    """
    lines = [replace(x, placed=tuple(_lined(p, sample) for p in x.placed if p.strokes)) for x in written.lines]
    if not any(line.placed for line in lines):
        return page
    radii = [p.ink.graph.radius for line in page.lines for p in line.placed if p.ink is not None]
    width = float(np.clip(2 * np.median(np.concatenate(radii)), _LEAST, _MOST)) if radii else None
    inked = replace_pen(replace(written, lines=tuple(lines)), sample, width=width)
    both = [replace(a, placed=a.placed + b.placed) for a, b in zip(page.lines, inked.lines, strict=True)]
    return replace(page, lines=tuple(both))


def _lined(placed: Placed, sample: ScannedHand) -> Placed:
    """Strokes as a line without ink."""
    ways = [_way(stroke) for stroke in placed.strokes]
    first = np.cumsum([0, *map(len, ways)])
    edges = [np.column_stack([np.arange(a, b - 1), np.arange(a + 1, b)]) for a, b in pairwise(first.tolist())]
    count = int(first[-1])
    radius = np.full(count, half_width(sample))
    graph = LineGraph(np.concatenate(ways), radius, np.ones(count), np.zeros((count, 2)), np.concatenate(edges))
    return Placed(Glyph("", (), (), 0.0), (), False, placed.word, placed.at, Ink(graph, DRAWN, NOBODY))


def _way(points: Array) -> Array:
    """The way of the pen through some points, as a hand goes it."""
    _, xy = follow(ActionPlan(points, 1.0, _SMOOTH), baked_at=_SMOOTH)
    moved = np.concatenate([[True], (np.abs(np.diff(xy, axis=0)) > 1e-9).any(axis=1)])
    return np.asarray(xy[moved])
