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
from handout.writing.scanned.sides import LETTERS, WORDS, Side, apart, nearness, side
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
        away[k] -= nearness(glyphs[k].side(of), glyphs[k + 1].side(of))
        for _ in range(_PUSHES if of != WORDS and not own[k] else 0):
            shift = np.array([away[k], y[k + 1] - y[k]])
            short = spacing.least - glyphs[k].apart(glyphs[k + 1], shift)
            if short <= 0:
                break
            away[k] += short
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
        self._sides: dict[int, Side] = {}
        self.shifted = spacing.slant * (y - float(spacing.forms.centre[number, 1]))

    def side(self, kind: int) -> Side:
        """What `sides.Sides` has of a glyph in a pair of this kind, from its centre."""
        if kind not in self._sides:
            xy, radius = (self._body.xy, self._body.radius) if kind == LETTERS else self._whole
            upright = xy[:, 0] - self._slant * xy[:, 1]
            self._sides[kind] = side((upright - radius, upright + radius, xy[:, 1] + self._y), kind)
        return self._sides[kind]

    @property
    def edges(self) -> tuple[float, float]:
        """How far its ink goes to either side, upright, where it begins or ends a word."""
        return self.side(WORDS)[2:]

    def apart(self, other: _Bent, shift: Array) -> float:
        """See `sides.apart`."""
        return apart(self._body, other._body, shift)

    @cached_property
    def _body(self) -> Form:
        return replace(self._form, xy=self._bend(self._form.xy))

    @cached_property
    def _whole(self) -> tuple[Array, Array]:
        xy, radius = self._form.whole
        return self._bend(xy), radius
