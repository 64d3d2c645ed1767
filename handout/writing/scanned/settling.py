"""Letters of a line moved a little, so that they stand as far apart as was meant, now that they are bent.

Distances are drawn for letters as they were written in the source.  A letter that is bent wider, or stands higher,
would come nearer to its neighbours than any two of the author's do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Indices
from handout.writing.scanned.bending import Bend
from handout.writing.scanned.forms import Form
from handout.writing.scanned.sides import LETTERS, WORDS, Outline, apart, nearness
from handout.writing.scanned.spacing import Spacing, hanging, kinds

_PUSHES = 3  # that two letters are moved apart by: one sideways takes them less far apart than it is long


def settled(
    spacing: Spacing, numbers: Indices, new_word: NDArray[np.bool_], apart: Array, y: Array, bends: Sequence[Bend]
) -> Array:
    """How far each glyph's centre stands to the right of the one before it, where they are bent and at their heights.

    Parameters
    ----------
    numbers : (n,) int; new_word : (n,) bool: see `setting.gaps`.
    apart : (n − 1,) float, line space: the same of glyphs that are as they were in the source.
    y : (n,) float, line space: how high the centres stand.
    bends : n, of the glyphs.

    Returns
    -------
    (n − 1,) float, line space.
    """
    if len(numbers) < 2:
        return apart
    first, second = numbers[:-1], numbers[1:]
    kind = kinds(spacing.forms, first, second, new_word[1:])
    own = spacing.sourced(first, second, kind)
    glyphs = [
        _Bent(spacing, int(number), bend, float(height)) for number, bend, height in zip(numbers, bends, y, strict=True)
    ]
    away = apart + spacing.sides.clearance(first, second, kind) + np.diff([glyph.shifted for glyph in glyphs])
    for k, of in enumerate(kind.tolist()):
        away[k] -= nearness(glyphs[k].outline(of), glyphs[k + 1].outline(of), of)
        for _ in range(_PUSHES if of != WORDS and not own[k] else 0):
            shift = np.array([away[k], y[k + 1] - y[k]])
            away[k] += max(spacing.least - glyphs[k].apart(glyphs[k + 1], shift), 0.0)
    for k in np.flatnonzero(~own & (kind == WORDS)).tolist():
        before, after = hanging(new_word, k)
        begin, end = int(before[-1]), int(after[-1]) + 1
        upright = np.concatenate([[0.0], np.cumsum(away[begin : end - 1])]) - spacing.slant * y[begin:end]
        right = max(upright[i - begin] + glyphs[i].edges[1] for i in before)
        left = min(upright[i - begin] + glyphs[i].edges[0] for i in after)
        away[k] += max(spacing.gaps.word - (left - right), 0.0)
    return np.asarray(away)


class _Bent:
    """A glyph bent, at its height on the line.

    shifted : how much further right the slant takes its centre than at its height in the source.
    """

    def __init__(self, spacing: Spacing, number: int, bend: Bend, y: float) -> None:
        self._form, self._bend, self._y, self._slant = spacing.forms[number], bend, y, spacing.slant
        self.shifted = spacing.slant * (y - float(spacing.forms.centre[number, 1]))

    def outline(self, kind: int) -> Outline:
        """What `sides.Sides` sees of a glyph in a pair of this kind, from its centre."""
        xy, radius = (self._form.xy, self._form.radius) if kind == LETTERS else self._form.whole
        x, y = self._bend(xy).T
        upright = x - self._slant * y
        return upright - radius, upright + radius, y + self._y

    @cached_property
    def edges(self) -> tuple[float, float]:
        """How far its ink goes to either side, upright, where it begins or ends a word."""
        low, high, _ = self.outline(WORDS)
        return float(low.min()), float(high.max())

    def apart(self, other: _Bent, shift: Array) -> float:
        """See `sides.apart`."""
        return apart(self._body(), other._body(), shift)

    def _body(self) -> Form:
        return replace(self._form, xy=self._bend(self._form.xy))
