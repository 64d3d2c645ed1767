"""A page written in a scanned hand as a drawing: the ink of its glyphs, and no strokes."""

from __future__ import annotations

from functools import partial

import numpy as np

from handout.hand.scanned import ScannedHand
from handout.inking.replacing import replace_pen
from handout.inking.striking import with_strokes
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
    letters = manuscript
    if pen is not None:
        letters = replace_pen(manuscript, pen)
        about["pen"] = pen.name
    written = with_strokes(letters, manuscript, pen or hand)
    return Drawing((), manuscript.page, about, partial(texture, written, pen or hand), _bounds(written))


def _bounds(manuscript: Manuscript) -> tuple[float, float, float, float] | None:
    """Where the ink of a page lies, mm."""
    inks = [placed.ink.graph for line in manuscript.lines for placed in line.placed if placed.ink is not None]
    if not inks:
        return None
    xy = np.concatenate([graph.xy for graph in inks])
    radius = np.concatenate([graph.radius for graph in inks])[:, None]
    return (*(xy - radius).min(axis=0).tolist(), *(xy + radius).max(axis=0).tolist())
