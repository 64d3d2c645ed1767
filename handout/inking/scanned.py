"""A page written in a scanned hand as a drawing: the ink of its glyphs, and no strokes."""

from __future__ import annotations

from functools import partial

from handout.hand.scanned import ScannedHand
from handout.inking.replacing import replace_pen
from handout.inking.texture import texture
from handout.values import Drawing, Manuscript


def drawn(manuscript: Manuscript, hand: ScannedHand, pen: ScannedHand | None = None) -> Drawing:
    """The drawing whose ink is that of the manuscript's glyphs; pixels are made when they are asked for.

    Parameters
    ----------
    manuscript : Manuscript
        Of glyphs of `hand`.
    hand : ScannedHand
    pen : ScannedHand, optional
        Whose ink is taken instead of the hand's own; its letters need not be known.

    Raises
    ------
    InputError
        A pen of which there is too little.
    """
    about = {"hand": hand.name, **manuscript.about}
    if pen is None:
        return Drawing((), manuscript.page, about, partial(texture, manuscript, hand))
    return Drawing((), manuscript.page, {**about, "pen": pen.name}, partial(texture, replace_pen(manuscript, pen), pen))
