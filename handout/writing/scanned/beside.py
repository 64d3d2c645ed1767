"""Which glyphs stood side by side on the source's pages, in a word or with a space between them.

Source: seed 000, §6.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array, Indices


@dataclass(frozen=True, eq=False)
class Beside:
    """The neighbours of every glyph on its line of the source.

    before, after : (n,) int: number of the glyph on either side, −1 for none.
    parted : (n,) bool: whether there is a space between a glyph and the one before it.
    """

    before: Indices
    after: Indices
    parted: NDArray[np.bool_]

    def pairs(self, parted: bool) -> Indices:
        """(m, 2) int: all pairs with a space between them, or all without."""
        second = np.flatnonzero((self.before != NOBODY) & (self.parted == parted))
        return np.column_stack([self.before[second], second])

    def closes(self, second: Indices) -> NDArray[np.bool_]:
        """(n,) whether the words that begin with some glyphs (n,) are the last of their lines."""
        last = second.copy()
        for _ in range(len(self.after)):
            following = self.after[last]
            on = (following != NOBODY) & ~self.parted[following]
            if not on.any():
                break
            last = np.where(on, following, last)
        return np.asarray(self.after[last] == NOBODY)


def beside(hand: ScannedHand, x: Array) -> Beside:
    """The neighbours of a hand's glyphs, whose centres are at `x` (n,) on their lines."""
    before = np.array([glyph.before for glyph in hand.glyphs], dtype=np.intp)
    after = np.array([glyph.after for glyph in hand.glyphs], dtype=np.intp)
    parted = np.zeros(len(before), dtype=bool)
    for first, second in _spaces(hand, x):
        after[first], before[second], parted[second] = second, first, True
    for array in (before, after, parted):
        array.flags.writeable = False
    return Beside(before, after, parted)


def _spaces(hand: ScannedHand, x: Array) -> Iterator[tuple[int, int]]:
    """The last glyph of a word and the first of the next, wherever both are on one line."""
    starts: dict[tuple[int, int], list[int]] = {}
    for number, glyph in enumerate(hand.glyphs):
        if glyph.before == NOBODY and glyph.letter:
            starts.setdefault((glyph.page, glyph.line), []).append(number)
    for heads in starts.values():
        heads.sort(key=lambda number: x[number])
        for head, following in pairwise(heads):
            last = head
            while hand.glyphs[last].after != NOBODY:
                last = hand.glyphs[last].after
            # a word that lost a letter is in two pieces: there is no space between those
            apart = hand.glyphs[head].word != hand.glyphs[following].word or hand.glyphs[head].at < 0
            if apart and x[last] < x[following]:
                yield last, following
