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
    for kind, seen in enumerate(_SEEN):
        for number in range(len(forms)):
            low, high, height = _outline(forms, number, slant, loose=kind != LETTERS)
            left[kind, number], right[kind, number] = _levels(low, high, height, seen)
            edges[kind, number] = low.min(), high.max()
            small = (low_zone < height) & (height < high_zone)
            if kind == WORDS:
                zone[number] = low[small].min(initial=np.inf), high[small].max(initial=-np.inf)
    return Sides(left, right, edges, zone)


def _levels(low: Array, high: Array, height: Array, seen: float) -> tuple[Array, Array]:
    """Where ink that goes from `low` to `high` at each of some heights begins and ends at every level."""
    near = np.abs(height[:, None] - _HEIGHTS) < seen
    left = np.where(near, low[:, None], np.inf).min(axis=0)
    return left, np.where(near, high[:, None], -np.inf).max(axis=0)


def side(outline: Outline, kind: int) -> Side:
    """The sides of one outline as they count in a pair of this kind: at every level, and over all heights."""
    return *_levels(*outline, _SEEN[kind]), float(outline[0].min()), float(outline[1].max())


def nearness(first: Side, second: Side) -> float:
    """How near two come to each other; see `Sides.clearance`."""
    near = float((second[0] - first[1]).min())
    return near if np.isfinite(near) else second[2] - first[3]


def _outline(forms: Forms, number: int, slant: float, *, loose: bool = False) -> Outline:
    """Left and right side of a glyph's line at every vertex, upright, and its height over the baseline."""
    form = forms[number]
    xy, radius = form.whole if loose else (form.xy, form.radius)
    upright = xy[:, 0] - slant * xy[:, 1]
    return upright - radius, upright + radius, xy[:, 1] + forms.centre[number, 1]


def apart(first: Form, second: Form, shift: Array) -> float:
    """How far the ink of two bodies is apart, the second one's centre shifted (2,) from the first one's; line space."""
    away = cdist(first.xy, second.xy + shift) - first.radius[:, None] - second.radius
    return float(away.min())
