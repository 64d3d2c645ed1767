"""How glyphs of a scanned hand stand in their words: their distances and heights, how each is bent, and their ink.

Source: seed 000, §6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from weakref import ref

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import ScannedHand
from handout.values import Array, Indices, LineGraph
from handout.writing.bending import Bend, InstanceSpread, bend, measure_spread
from handout.writing.forms import Forms, GlyphLine
from handout.writing.joining import set_line
from handout.writing.joints import Joint
from handout.writing.neighbours import Neighbours, neighbours
from handout.writing.spacing import HeightModel, SpacingModel, height_model, resolve_collisions, spacing_model
from handout.writing.variation import Chances, correlate_values

# decimals of the heights of glyphs, line space, and of how their size and slant drift: a thousandth of a millimetre is
# seen by nobody, and letters that come 30 after a letter, which move it by less, leave it as it was
_FINE = 4


@dataclass(frozen=True, eq=False)
class LayoutModel:
    """Forms of a hand's glyphs, and how it places and varies them."""

    forms: Forms
    neighbours: Neighbours
    spacing: SpacingModel
    heights: HeightModel
    spread: InstanceSpread

    def reach(self, numbers: Indices, bends: Sequence[Bend]) -> Array:
        """(n, 2) float, line space: how far the ink of bent glyphs goes left (negative) and right of their centres.

        Strokes count that are its own part of a ligature: where it is joined, the next letter has more of it.
        """
        reaches = [_reach(self.forms[int(number)], bend) for number, bend in zip(numbers, bends, strict=True)]
        return np.array(reaches).reshape(-1, 2)

    def place_glyphs(
        self, numbers: Indices, starts: NDArray[np.bool_], chances: Chances, variation: float = 1.0
    ) -> tuple[Array, Array, list[Bend]]:
        """(n − 1,) distances of glyphs (n,), (n,) their heights, both line space, and how each is bent.

        starts : (n,) whether there is a space before each.
        """
        apart = self.spacing.between(numbers, starts, chances, variation)
        y = self.heights.heights_of(numbers, starts, chances, variation).round(_FINE)
        bends = self.bends(numbers, chances, variation)
        return resolve_collisions(self.spacing, numbers, starts, apart, y, bends), y, bends

    def lay_word(
        self, numbers: Sequence[int], x: Array, y: Sequence[float] | Array, bends: Sequence[Bend]
    ) -> list[LineGraph]:
        """The ink of glyphs without a space between, whose centres stand at `x` and `y`, line space."""
        joints = self.joints(numbers, [False] * len(numbers))
        forms = [self.forms[number] for number in numbers]
        return set_line(forms, bends, np.column_stack([x, y]), joints, self.spread.x_height)

    def joints(self, numbers: Sequence[int], apart: Sequence[bool]) -> list[tuple[Joint, ...]]:
        """The ligatures from each of some glyphs to the next; `apart` says before which there is a space."""
        between = self.spacing.joints.joints_between
        return [() if space else between(*pair) for pair, space in zip(pairwise(numbers), apart[1:], strict=True)]

    def bends(self, numbers: Indices, chances: Chances, variation: float = 1.0) -> list[Bend]:
        """How each of some glyphs (n,) is bent, never further than the author's own letters vary.

        variation : 0 not at all, 1 as much as is usual.
        """
        # size and slant drift, as people's do; a generator a glyph, so that another in its place changes no others
        drifts = correlate_values(chances.walk).round(_FINE)
        return [
            _bent(ref(self), number, tuple(drift), seed, variation)
            for number, drift, seed in zip(numbers.tolist(), drifts.tolist(), chances.seed.tolist(), strict=True)
        ]


@lru_cache(maxsize=4096)  # glyphs: 900 words, which are set several times when some of them read as others
def _bent(of: ref[LayoutModel], number: int, drift: tuple[float, ...], seed: int, variation: float) -> Bend:
    """How a glyph is bent: as it was, where the same place is written with it again."""
    model = of()  # which leads to the pictures of the hand's pages: a bend does not keep them
    assert model is not None, "who asks holds it"
    height, rng = float(model.heights.height[number]), np.random.default_rng(seed)
    return bend(model.forms[number], number, model.spread, height, np.array(drift), rng, variation)


def layout_model(hand: ScannedHand) -> LayoutModel:
    """The layout_model of a hand; takes about a third of a second for a page of a thousand letters."""
    forms = Forms(hand)
    near = neighbours(hand, forms.centre[:, 0])
    return LayoutModel(forms, near, spacing_model(forms, near), height_model(forms, near), measure_spread(forms))


def _reach(form: GlyphLine, bend: Bend) -> tuple[float, float]:
    xy, radius = form.whole
    xy = bend.of_form(xy)
    return float((xy[:, 0] - radius).min()), float((xy[:, 0] + radius).max())
