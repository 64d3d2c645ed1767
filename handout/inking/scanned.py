"""A page written in a scanned hand as a drawing: the ink of its glyphs, and no strokes."""

from __future__ import annotations

from functools import partial

from handout.hand.scanned import ScannedHand
from handout.inking.texture import texture
from handout.values import Drawing, Manuscript


def drawn(manuscript: Manuscript, hand: ScannedHand) -> Drawing:
    """The drawing whose ink is that of the manuscript's glyphs, pixels being made when they are asked for."""
    return Drawing((), manuscript.page, {"hand": hand.name, **manuscript.about}, partial(texture, manuscript, hand))
