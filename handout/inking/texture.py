"""Scanned ink on a page: every glyph's own ink where the glyph is written.

Ink is averaged and laid on in device RGB, not in linear light: the matte was found there, as what makes the scan again
when the ink is laid on its paper.

A text is set in millimetres, and where a word comes to lie is a matter of parts of a pixel: ink that is taken half a
pixel beside itself is blurred.  Where the page has the resolution of the scan and all of a word only moves, it goes on
to the nearest whole pixel, by about half of one (0.04 mm at 300 dpi).  Setting levels the line that the author wrote
on; a word that was all but level keeps its slope with its pixels.  Words of which any glyph is bent, turned or scaled
stay where they are: their ink lies between pixels anyway.

Source: seed 000, §6.5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from hashlib import blake2b
from itertools import groupby
from typing import Any
from weakref import ref

import numpy as np

from handout.errors import InputError
from handout.hand.scanned import ScannedHand
from handout.inking.layers import GlyphLayer, part_layers
from handout.inking.source import InkSource, source_of
from handout.inking.warping import MARGIN, warp
from handout.values import Array, Ink, Manuscript, Raster

_WHOLE = 0.75  # pixels that any place of a word may be off from one even shift: less than is seen of a slope


def shift(ink: Ink, dpi: float) -> Array:
    """(n, 2) float: how far each vertex goes from its picture to a page of `dpi`, pixels of the page."""
    return ink.graph.xy * (dpi / 25.4) - 0.5 - ink.graph.uv


def snap_to_pixels(word: Sequence[Ink], dpi: float) -> list[Ink]:
    """The inks of a word, on whole pixels where all of it only moves; `dpi` : of the page."""
    if len({ink.source for ink in word}) != 1:
        return list(word)
    moves = np.concatenate([shift(ink, dpi) for ink in word])
    if not len(moves):
        return list(word)
    middle = np.median(moves, axis=0)
    if np.abs(moves - middle).max() >= _WHOLE:
        return list(word)
    places = ((ink.graph.uv + np.rint(middle) + 0.5) * (25.4 / dpi) for ink in word)
    return [replace(ink, graph=replace(ink.graph, xy=xy)) for ink, xy in zip(word, places, strict=True)]


_MOST = 4e9  # pixels of a page
# glyphs whose ink is kept, so that of a page that is made again only what changed is drawn: that of a page of A4 as
# screens show it, about 50 MB; at resolutions of printers it would take sixteen times as much, and pages come once
_KEPT, _KEPT_LINES, _SCREEN = 2048, 64, 200.0
_kept: dict[Any, GlyphLayer | None] = {}  # those used last at the end
_NEW: Any = object()


def texture(manuscript: Manuscript, hand: ScannedHand, dpi: float, *, margin: float = MARGIN) -> Raster:
    """The ink of a page on a transparent sheet.

    manuscript : its glyphs carry `ink`; those that do not are left out.
    hand : whose pictures the ink is about.
    dpi : 20 to 4800.
    margin : mm around the line within which ink is taken along.

    Returns the whole page, (h, w, 4), straight alpha, device RGB; pixels without ink are zero in all channels, and take
    memory only near ink.

    Raises InputError: a resolution out of its bounds, a page of more than 4 gigapixels, or ink of a page that the hand
    does not have.

    Source: seed 000, §6.5.
    """
    height, width = _shape(manuscript, dpi)
    page = np.zeros((height, width, 4), dtype=np.uint8)
    sources = {number: source_of(page) for number, page in enumerate(hand.pages)}
    first, end = height, 0
    for line in manuscript.lines:
        words = groupby((placed for placed in line.placed if placed.ink is not None), key=lambda placed: placed.word)
        inks = [ink for _, word in words for ink in snap_to_pixels([placed.ink for placed in word if placed.ink], dpi)]
        for layer in _layers(inks, sources, dpi, (height, width), margin):
            # where there is some ink already, that which covers more is seen
            (x, y), (h, w) = layer.corner, layer.near.shape
            under = page[y : y + h, x : x + w].view("<u4")
            over = np.ascontiguousarray(layer.rgba).view("<u4")
            np.copyto(under, over, where=over >> 24 > under >> 24)
            first, end = min(first, y), max(end, y + h)
    return Raster(page, dpi, rows=(min(first, end), end))


def _shape(manuscript: Manuscript, dpi: float) -> tuple[int, int]:
    if not 20 <= dpi <= 4800:
        raise InputError(f"resolution (dpi): {dpi:g} is outside 20 to 4800.")
    page, scale = manuscript.page, dpi / 25.4
    if page.width * page.height * scale**2 > _MOST:
        raise InputError(
            f"A page of {page.width:g} x {page.height:g} mm at {dpi:g} dpi has more than {_MOST / 1e9:g} gigapixels: "
            "use a lower resolution."
        )
    return max(1, round(page.height * scale)), max(1, round(page.width * scale))


def _layers(
    inks: list[Ink], sources: Mapping[int, InkSource], dpi: float, shape: tuple[int, int], margin: float
) -> Sequence[GlyphLayer]:
    """The ink of a line, each glyph's parted from that before where both show one line."""
    for ink in inks:
        if ink.source not in sources:
            raise InputError(f"A glyph is written with ink of page {ink.source} of a hand of {len(sources)} pages.")
    if dpi > _SCREEN:
        return part_layers([layer for layer in warp(inks, sources, dpi, shape, margin=margin) if layer is not None])
    # the source is large: the ink that is kept does not keep it
    keys = [(_digest(ink), ref(sources[ink.source]), dpi, shape, margin) for ink in inks]
    layers = {key: _kept.pop(key, _NEW) for key in keys}
    new = {key: ink for key, ink in zip(keys, inks, strict=True) if layers[key] is _NEW}
    layers.update(zip(new, warp(list(new.values()), sources, dpi, shape, margin=margin), strict=True))
    _kept.update(layers)
    for key in list(_kept)[: max(len(_kept) - _KEPT, 0)]:
        _kept.pop(key, None)
    return _part_kept(tuple(layer for key in keys if (layer := layers[key]) is not None))


def _digest(ink: Ink) -> bytes:
    """Ink is told from other ink by all that says how it looks."""
    graph, digest = ink.graph, blake2b(bytes([ink.number < 0]))
    for values in (graph.xy, graph.radius, graph.density, graph.uv, graph.edges):
        digest.update(values.tobytes())
    return digest.digest()


_part_kept = lru_cache(maxsize=_KEPT_LINES)(part_layers)
