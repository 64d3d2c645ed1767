"""Glyphs that are not like the others of their letter: a stroke of the neighbour's in them, or one of their own lost.

Where a line of writing is cut wrongly the reading may still be sure of itself; what gives it away is the size.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from handout.hand.scanned import ScannedHand
from handout.values import Array, Indices

_FEW = 4  # glyphs of a letter, fewer than which have no usual size
_FLOOR = 0.15  # x-heights: spread that any letter may have
_USUAL = 2.0  # spreads from the median that are still usual
_RISE, _MOST = 0.4, 1.5  # cost for each spread more, and the most of it


def oddity(hand: ScannedHand, bodies: Sequence[Indices]) -> Array:
    """(n,) float ≥ 0: cost of glyphs with the given bodies for being wider, higher, lower or longer than usual."""
    sizes = np.array([_size(hand, number, body) for number, body in enumerate(bodies)]).reshape(-1, 4)
    numbers: dict[str, list[int]] = {}
    for number, glyph in enumerate(hand.glyphs):
        numbers.setdefault(glyph.letter, []).append(number)
    cost = np.zeros(len(bodies))
    for own in numbers.values():
        if len(own) >= _FEW:
            away = np.abs(sizes[own] - np.median(sizes[own], axis=0))
            spread = 1.48 * np.median(away, axis=0) + _FLOOR
            cost[own] = np.clip(_RISE * ((away / spread).max(axis=1) - _USUAL), 0.0, _MOST)
    return cost


def _size(hand: ScannedHand, number: int, body: Indices) -> tuple[float, float, float, float]:
    """Width, top, bottom and half the length of the line of a body, x-heights."""
    glyph = hand.glyphs[number]
    page = hand.pages[glyph.page]
    unit = page.pitch / page.x_height
    x, y = page.to_line(glyph.line, page.graph.uv[body]).T * unit
    # a vertex is about a pixel long
    length = len(body) * page.pixel / page.x_height
    return float(np.ptp(x)), float(y.max()), float(y.min()), length / 2
