"""Letters that the edge of a picture cuts off: they are written on, but doubted, and named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import ScannedGlyph
from handout.values import LineGraph

_NAMED = 12


def cropped(graph: LineGraph, shape: tuple[int, int], pixel: float) -> NDArray[np.bool_]:
    """(n,): whether the line of each vertex reaches the edge of its picture.

    Parameters
    ----------
    graph : of a page, with `uv` in pixels of that picture and radii in mm.
    shape : (height, width), pixels.
    pixel : mm, its side.
    """
    room = np.minimum(graph.uv + 0.5, np.array(shape[::-1]) - 0.5 - graph.uv).min(axis=1)
    return np.asarray(room < np.maximum(graph.radius / pixel - 0.5, 0.5))


def doubted(
    glyphs: Sequence[ScannedGlyph], at_edge: NDArray[np.bool_], source: str
) -> tuple[tuple[ScannedGlyph, ...], list[str]]:
    """The glyphs, with those doubted whose ink reaches the edge, and the sentence that names these."""
    cut = [bool(at_edge[glyph.vertices].any()) for glyph in glyphs]
    named = [f"{glyph.letter} (line {glyph.line + 1})" for glyph, own in zip(glyphs, cut, strict=True) if own]
    made = tuple(replace(glyph, confidence=0.0) if own else glyph for glyph, own in zip(glyphs, cut, strict=True))
    if not named:
        return made, []
    more = f" and {len(named) - _NAMED} more" if len(named) > _NAMED else ""
    return made, [
        f"{source}: the edge of the picture cuts {', '.join(named[:_NAMED])}{more}; kept as doubtful. Scan the whole "
        "page, if there is more of it."
    ]
