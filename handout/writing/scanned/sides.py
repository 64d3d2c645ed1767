"""The two sides of every glyph, height by height: how near two letters come to each other.

Everything is level and in the upright frame, where the slant of the hand is taken out.

Source: seed 000, §6.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from handout.values import Array, Indices
from handout.writing.scanned.forms import Form, Forms
from handout.writing.scanned.taking import Line

_HEIGHTS = np.arange(-0.48, 1.13, 0.04)  # over the baseline, line space
LETTERS, WORDS, MARKS = range(3)  # kinds of pairs: in a word, across a space, in a word with punctuation
_ZONE = (-0.1, 1.15)  # x-heights over the baseline: where the eye sees the gap between two words
_SEEN = (0.04, 0.12, 0.0)  # ink within this much of a height counts there


Side = tuple[Array, Array, float, float]  # left and right, at every level and over all heights
Outline = tuple[Array, Array, Array]  # left and right side at every vertex, upright, and its height over the baseline


@dataclass(frozen=True, eq=False)
class Sides:
    """Where the ink of the glyphs of a hand ends, from each one's upright centre; line space.

    Everything is there three times.  For letters in one word the bodies count; for words, strokes too that are loose at
    the end of a word because the letter was joined in the source; for punctuation, which stands over or under the
    letters, height does not matter.

    left, right : (3, n, heights) float: ±inf at heights where there is no ink.
    edges : (3, n, 2) float: the same over all heights.
    zone : (n, 2) float: the same, as the end of a word, over the heights of small letters; ±inf where there is no ink.
    """

    left: Array
    right: Array
    edges: Array
    zone: Array

    def clearance(self, first: Indices, second: Indices, kind: Indices) -> Array:
        """(n,): how near pairs of glyphs come at any one height were their centres in one place; mostly negative."""
        near = (self.left[kind, second] - self.right[kind, first]).min(axis=1, initial=np.inf)
        edge = self.edges[kind, second, 0] - self.edges[kind, first, 1]
        return np.asarray(np.where(np.isfinite(near), near, edge))

    def between(self, first: Indices, second: Indices) -> Array:
        """(n,): how far pairs of glyphs, each the end of a word, are apart over all heights were their centres in one
        place; mostly negative."""
        return np.asarray(self.edges[WORDS, second, 0] - self.edges[WORDS, first, 1])

    def across(self, first: Indices, second: Indices) -> Array:
        """(n,): the same over the heights of small letters alone; inf where either has no ink there."""
        return np.asarray(self.zone[second, 0] - self.zone[first, 1])


def sides(forms: Forms, slant: float) -> Sides:
    """The sides of a hand's glyphs; `slant` is dx/dy, upwards."""
    left = np.full((3, len(forms), len(_HEIGHTS)), np.inf)
    right, edges = -left, np.zeros((3, len(forms), 2))
    zone = np.tile([np.inf, -np.inf], (len(forms), 1))
    low_zone, high_zone = np.multiply(_ZONE, 1 / forms.hand.pitch)
    bodies = np.repeat(np.arange(len(forms)), forms.bodies.count), forms.bodies.xy, forms.bodies.radius
    alone, loose = (_outlines(forms, slant, *lines) for lines in (bodies, forms.wholes()))
    for kind, seen in enumerate(_SEEN):
        of, low, high, height = alone if kind == LETTERS else loose
        left[kind], right[kind] = _levels(of, low, high, height, seen, len(forms))
        first = np.searchsorted(of, np.arange(len(forms)))
        edges[kind] = np.column_stack([np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)])
        if kind == WORDS:
            small = (low_zone < height) & (height < high_zone)
            zone[:, 0] = np.minimum.reduceat(np.where(small, low, np.inf), first)
            zone[:, 1] = np.maximum.reduceat(np.where(small, high, -np.inf), first)
    return Sides(left, right, edges, zone)


def side(outline: Outline, kind: int) -> Side:
    """The sides of one outline as they count in a pair of this kind: at every level, and over all heights."""
    left, right = _levels(np.zeros(len(outline[0]), dtype=np.intp), *outline, _SEEN[kind], 1)
    return left[0], right[0], float(outline[0].min()), float(outline[1].max())


def nearness(first: Side, second: Side) -> float:
    """How near two come to each other; see `Sides.clearance`."""
    near = float((second[0] - first[1]).min())
    return near if np.isfinite(near) else second[2] - first[3]


def _levels(of: Indices, low: Array, high: Array, height: Array, seen: float, count: int) -> tuple[Array, Array]:
    """(count, heights): where at every level the ink within `seen` of it begins and ends; the vertices, each `of` one
    glyph, have ink from `low` to `high` at `height`."""
    left = np.full(count * len(_HEIGHTS), np.inf)
    right = -left
    step = _HEIGHTS[1] - _HEIGHTS[0]
    lowest = np.ceil((height - seen - _HEIGHTS[0]) / step).astype(np.intp) - 1
    for level in range(int(2 * seen / step) + 3) if seen else ():
        at = np.clip(lowest + level, 0, len(_HEIGHTS) - 1)
        near = np.abs(height - _HEIGHTS[at]) < seen
        cell = (of * len(_HEIGHTS) + at)[near]
        np.minimum.at(left, cell, low[near])
        np.maximum.at(right, cell, high[near])
    return left.reshape(count, -1), right.reshape(count, -1)


def _outlines(forms: Forms, slant: float, of: Indices, xy: Array, radius: Array) -> tuple[Indices, Array, Array, Array]:
    """Of every vertex of lines: whose it is, its left and right side, upright, and its height over the baseline."""
    upright = xy[:, 0] - slant * xy[:, 1]
    return of, upright - radius, upright + radius, xy[:, 1] + forms.centre[of, 1]


def apart(first: Line | Form, second: Line | Form, shift: Array) -> float:
    """How far the ink of two bodies is apart, the second one's centre shifted (2,) from the first one's; line space."""
    away = cdist(first.xy, second.xy + shift) - first.radius[:, None] - second.radius
    return float(away.min())
