"""Flat nibs: an edge that is moved without turning against the page, so that the mark's width follows its direction."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from handout.values import NIB_THICKNESS, Array, Drawing, Stroke

_APART = 0.3  # of the thickness: distance of the points that stand for an edge
_THINNEST = 1.5  # pixels of the thickness
_MOST = 400  # points


def edge(stroke: Stroke) -> Array:
    """(n, 2) float, mm: from the middle of a flat nib to the end of its edge, at each sample."""
    assert stroke.rotation is not None
    half = 0.5 * (1 - NIB_THICKNESS) * stroke.nib
    return half * np.column_stack([np.cos(stroke.rotation), np.sin(stroke.rotation)])


def as_round(drawing: Drawing, scale: float) -> Drawing:
    """The drawing with every stroke of a flat nib as many of a round point, side by side, at `scale` pixels a mm."""
    if not any(stroke.nib > 0 for stroke in drawing.strokes):
        return drawing
    return replace(drawing, strokes=tuple(part for stroke in drawing.strokes for part in _points(stroke, scale)))


def _points(stroke: Stroke, scale: float) -> Iterator[Stroke]:
    if not stroke.nib > 0:
        yield stroke
        return
    thick = max(NIB_THICKNESS * stroke.nib, _THINNEST / scale)
    count = min(max(math.ceil(stroke.nib / (_APART * thick)), 2), _MOST)
    reach = edge(stroke)
    for share in np.linspace(-1, 1, count):
        yield replace(stroke, xy=stroke.xy + share * reach, width=np.full(len(stroke.t), thick), nib=0.0)
