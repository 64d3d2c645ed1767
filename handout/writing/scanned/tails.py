"""How far a letter goes on where nothing joins it: the tail of a word, and the stroke that leads into one.

A letter that was joined in the source shows, where it now ends a word, a part of its ligature.  How much of it is told
by the letters that did end words: they are as much wider as their tails are long.

Source: seed 000, §6.4.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand
from handout.values import Array, Indices

_ENOUGH = 8  # instances, of letters that there are both joined and free, that the length of tails is told by

Ways = Mapping[int, tuple[Indices, ...]]


def tails(hand: ScannedHand, exits: Ways, bodies: list[Indices]) -> tuple[float, float]:
    """The shares of the neighbour's half of a ligature that a loose entry and a loose exit still have, 0 to 1.

    Parameters
    ----------
    exits : glyph → the paths of its ligatures to the next.
    bodies : n of (m,) int: the vertices of each glyph that are on the way to no other.
    """
    return _share(hand, exits, bodies, leaving=False), _share(hand, exits, bodies, leaving=True)


def _share(hand: ScannedHand, exits: Ways, bodies: list[Indices], *, leaving: bool) -> float:
    free, joined = defaultdict[str, list[float]](list), defaultdict[str, list[Array]](list)
    for number, glyph in enumerate(hand.glyphs):
        if not glyph.letter.isalpha():
            continue
        paths = exits.get(number if leaving else glyph.before, ())
        if paths:
            joined[glyph.letter].append(_widths(hand, glyph, bodies[number], np.concatenate(paths), leaving))
        elif (glyph.after if leaving else glyph.before) == NOBODY:
            free[glyph.letter].append(float(_widths(hand, glyph, bodies[number], bodies[number], leaving)[0]))
    both = [letter for letter in free if letter in joined]
    count = np.array([min(len(free[letter]), len(joined[letter])) for letter in both])
    if count.sum() < _ENOUGH:
        return 0.0
    own, whole = np.transpose([np.median(joined[letter], axis=0) for letter in both])
    wanted = np.array([np.median(free[letter]) for letter in both])
    return float(np.clip(count @ (wanted - own) / max(count @ (whole - own), 1e-9), 0.0, 1.0))


def _widths(hand: ScannedHand, glyph: ScannedGlyph, body: Indices, path: Indices, leaving: bool) -> Array:
    """(2,) line space, upright: of a body with the glyph's own part of a way, and with all of it."""
    page = hand.pages[glyph.page]
    way = _upright(hand, glyph, path) * (1 if leaving else -1)
    own: NDArray[np.bool_] = np.isin(path, glyph.vertices)
    letter = _upright(hand, glyph, body) * (1 if leaving else -1)
    thick = page.graph.radius[body].mean() / page.pitch
    ends = np.array([way[own].max(initial=-np.inf), way.max()])
    return np.asarray(np.maximum(ends, letter.max()) - letter.min() + 2 * thick)


def _upright(hand: ScannedHand, glyph: ScannedGlyph, vertices: Indices) -> Array:
    page = hand.pages[glyph.page]
    x, y = page.to_line(glyph.line, page.graph.uv[vertices]).T
    return np.asarray(x - page.slant * y)
