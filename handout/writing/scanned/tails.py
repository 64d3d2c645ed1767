"""How far a letter goes on where nothing joins it: the tail of a word, and the stroke that leads into one.

A letter that was joined in the source shows, where it now ends a word, a part of its ligature.  How much of it is told
by the letters that did end words: they are as much wider as their tails are long.

Source: seed 000, §6.4.
"""

from __future__ import annotations

import numpy as np

from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array
from handout.writing.scanned.taking import Lines, Strokes, Taken

_ENOUGH = 8  # instances, of letters that there are both joined and free, that the length of tails is told by


def tails(hand: ScannedHand, taken: Taken) -> tuple[float, float]:
    """The shares of the neighbour's half of a ligature that a loose entry and a loose exit still have, 0 to 1."""
    entry = _share(hand, taken.bodies, taken.entries, leaving=False)
    return entry, _share(hand, taken.bodies, taken.exits, leaving=True)


def _share(hand: ScannedHand, bodies: Lines, ways: Strokes, *, leaving: bool) -> float:
    letters = np.array([glyph.letter for glyph in hand.glyphs], dtype=np.str_)
    named = np.array([glyph.letter.isalpha() for glyph in hand.glyphs], dtype=bool)
    alone = np.array([(glyph.after if leaving else glyph.before) == NOBODY for glyph in hand.glyphs], dtype=bool)
    met = np.zeros(len(letters), dtype=bool)
    met[ways.of] = True
    free, joined = named & alone & ~met, named & met
    body, own, whole = _widths(hand, bodies, ways, leaving)
    rows = []
    for letter in np.intersect1d(letters[free], letters[joined]):
        ended, led = (of & (letters == letter) for of in (free, joined))
        count = min(ended.sum(), led.sum())
        rows.append((count, np.median(body[ended]), np.median(own[led]), np.median(whole[led])))
    counts, wanted, short, long = np.array(rows).reshape(-1, 4).T
    if counts.sum() < _ENOUGH:
        return 0.0
    return float(np.clip(counts @ (wanted - short) / max(counts @ (long - short), 1e-9), 0.0, 1.0))


def _widths(hand: ScannedHand, bodies: Lines, ways: Strokes, leaving: bool) -> Array:
    """(3, n) line space, upright: of each body alone, with the glyph's own part of its ways, and with all of them."""
    slant = np.array([hand.pages[glyph.page].slant for glyph in hand.glyphs])
    letter, way = (
        (1 if leaving else -1) * (lines.xy[:, 0] - np.repeat(slant[of], lines.count) * lines.xy[:, 1])
        for lines, of in ((bodies, np.arange(len(slant))), (ways.lines, ways.of))
    )
    begin = bodies.first[:-1]
    ends = np.tile(np.maximum.reduceat(letter, begin), (3, 1))
    of, own = np.repeat(ways.of, ways.lines.count), ways.within(ways.own)
    np.maximum.at(ends[1], of[own], way[own])
    np.maximum.at(ends[2], of, way)
    thick = np.add.reduceat(bodies.radius, begin) / bodies.count
    return np.asarray(ends - np.minimum.reduceat(letter, begin) + 2 * thick)
