"""How far each glyph departs from what is usual of its letter: in height, slant, width of the line and darkness.

People drift: letters side by side are taller, steeper, thicker or fainter together (on five real pages the departures
of neighbours correlate by .06 to .27, 0 to .23, .10 to .48 and .16 to .38), and a letter that departs alone is seen.

Source: none of the seeds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from handout.hand.scanned import ScannedHand
from handout.values import Array, Indices, readonly
from handout.writing.scanned.bending import measures

_FEW = 4  # glyphs of a letter, fewer than which have nothing usual
_MOST = 2.5  # deviations: what is further off was read wrongly


def departures(hand: ScannedHand, bodies: Sequence[Indices]) -> Array:
    """(n, 4) float: departures of glyphs with the given bodies, in deviations; 0 for letters of which there are few."""
    if not bodies:
        return readonly(np.zeros((0, 4)), 0, 4)
    size = np.array([len(body) for body in bodies])
    of, first = np.repeat(np.arange(len(size)), size), np.concatenate([[0], np.cumsum(size)])
    vertices = np.concatenate(list(bodies))
    graphs = [(hand.pages[glyph.page].graph, hand.pages[glyph.page].pitch) for glyph in hand.glyphs]
    both = list(zip(bodies, graphs, strict=True))
    radius = np.concatenate([graph.radius[body] / pitch for body, (graph, pitch) in both])
    density = np.concatenate([graph.density[body] for body, (graph, _) in both])
    _, height, _, slant = measures(hand.placed(of, vertices), radius, first, 1 / hand.pitch).T
    begin = first[:-1]
    thick, dark = np.add.reduceat(radius, begin) / size, np.add.reduceat(density, begin) / size
    found = np.stack([height, slant, np.log(thick), dark], axis=1)
    made = np.zeros_like(found)
    for letter in hand.letters:
        own = hand.of(letter)
        if len(own) >= _FEW:
            made[own] = found[own] - np.median(found[own], axis=0)
    known = made[np.abs(made).sum(axis=1) > 0]
    usual = 1.4826 * np.median(np.abs(known), axis=0) + 1e-9 if len(known) else np.ones(4)
    return readonly(np.clip(made / usual, -_MOST, _MOST), len(size), 4)
