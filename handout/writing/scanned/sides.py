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
_SEEN = (0.04, 0.12)  # ink within this much of a height counts there: in words, and between words


@dataclass(frozen=True, eq=False)
class Sides:
    """Where the ink of the glyphs of a hand ends, from each one's upright centre; line space.

    Everything is twice there: for letters in one word (0), where the bodies count, and for words (1), where strokes
    count too that are loose at the end of a word because the letter was joined in the source.

    left, right : (2, n, heights) float: ±inf at heights where there is no ink.
    edges : (2, n, 2) float: the same over all heights.
    """

    left: Array
    right: Array
    edges: Array

    def clearance(self, first: Indices, second: Indices, parted: Indices) -> Array:
        """(n,): how near pairs of glyphs come at any one height were their centres in one place; mostly negative."""
        near = (self.left[parted, second] - self.right[parted, first]).min(axis=1, initial=np.inf)
        edge = self.edges[parted, second, 0] - self.edges[parted, first, 1]
        return np.asarray(np.where(np.isfinite(near), near, edge))


def sides(forms: Forms, slant: float) -> Sides:
    """The sides of a hand's glyphs; `slant` is dx/dy, upwards."""
    left = np.full((2, len(forms), len(_HEIGHTS)), np.inf)
    right, edges = -left, np.zeros((2, len(forms), 2))
    for parted, seen in enumerate(_SEEN):
        for number in range(len(forms)):
            low, high, height = _outline(forms, number, slant, loose=parted == 1)
            near = np.abs(height[:, None] - _HEIGHTS) < seen
            left[parted, number] = np.where(near, low[:, None], np.inf).min(axis=0)
            right[parted, number] = np.where(near, high[:, None], -np.inf).max(axis=0)
            edges[parted, number] = low.min(), high.max()
    return Sides(left, right, edges)


def _outline(forms: Forms, number: int, slant: float, *, loose: bool = False) -> tuple[Array, Array, Array]:
    """Left and right side of a glyph's line at every vertex, upright, and its height over the baseline."""
    form = forms[number]
    parts = [(form.xy, form.radius)]
    if loose:
        parts += [(way.xy[: way.own], way.radius[: way.own]) for way in form.exits]
        parts += [(way.xy[-way.own :], way.radius[-way.own :]) for way in form.entries]
    xy, radius = (np.concatenate(values) for values in zip(*parts, strict=True))
    upright = xy[:, 0] - slant * xy[:, 1]
    return upright - radius, upright + radius, xy[:, 1] + forms.centre[number, 1]


def apart(first: Form, second: Form, shift: Array) -> float:
    """How far the ink of two bodies is apart, the second one's centre shifted (2,) from the first one's; line space."""
    away = cdist(first.xy, second.xy + shift) - first.radius[:, None] - second.radius
    return float(away.min())
