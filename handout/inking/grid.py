"""Words that are written as they were in the source, laid on whole pixels of it, so that no pixel changes.

A text is set in millimetres, and where a word comes to lie is a matter of parts of a pixel: ink that is taken half a
pixel beside itself is blurred.  Where the page has the resolution of the scan and all of a word only moves, it goes on
to the nearest whole pixel, by about half of one (0.04 mm at 300 dpi).  Setting levels the line that the author wrote
on; a word that was all but level keeps its slope with its pixels.  Words of which any glyph is bent, turned or scaled
stay where they are: their ink lies between pixels anyway.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from handout.values import Array, Ink, LineGraph

_WHOLE = 0.75  # pixels that any place of a word may be off from one even shift: less than is seen of a slope


def shift(ink: Ink, dpi: float) -> Array:
    """(n, 2) float: how far each vertex goes from its picture to a page of `dpi`, pixels of the page."""
    return ink.graph.xy * (dpi / 25.4) - 0.5 - ink.graph.uv


def settled(word: Sequence[Ink], dpi: float) -> list[Ink]:
    """The inks of a word, on whole pixels where all of it only moves.

    Parameters
    ----------
    word : sequence of Ink
    dpi : float
        Of the page.
    """
    if len({ink.source for ink in word}) != 1:
        return list(word)
    moves = np.concatenate([shift(ink, dpi) for ink in word])
    if not len(moves):
        return list(word)
    middle = np.median(moves, axis=0)
    if np.abs(moves - middle).max() >= _WHOLE:
        return list(word)
    return [replace(ink, graph=_at(ink.graph, np.rint(middle), dpi)) for ink in word]


def _at(graph: LineGraph, whole: Array, dpi: float) -> LineGraph:
    """The graph where its picture lies when it is moved by whole pixels (2,)."""
    return replace(graph, xy=(graph.uv + whole + 0.5) * (25.4 / dpi))
