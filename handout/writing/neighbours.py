"""Which glyphs stood side by side on the lines of a hand's pages, in a word and between words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array, Indices


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The neighbours of every glyph on its line of the source.

    before, after : (n,) int: number of the glyph on either side, −1 for none.
    parted : (n,) bool: whether a space precedes the glyph.
    """

    before: Indices
    after: Indices
    parted: NDArray[np.bool_]

    def pairs(self, parted: bool) -> Indices:
        """(m, 2) int: all pairs with a space between them, or all without."""
        second = np.flatnonzero((self.before != NOBODY) & (self.parted == parted))
        return np.column_stack([self.before[second], second])

    def closes(self, second: Indices) -> NDArray[np.bool_]:
        """(n,) whether the words that begin with the glyphs `second` (n,) are the last of their lines."""
        last = second.copy()
        for _ in range(len(self.after)):
            following = self.after[last]
            on = (following != NOBODY) & ~self.parted[following]
            if not on.any():
                break
            last = np.where(on, following, last)
        return np.asarray(self.after[last] == NOBODY)


def neighbours(hand: ScannedHand, x: Array) -> Neighbours:
    """The neighbours of a hand's glyphs, whose centres are at `x` (n,) on their lines."""
    before = np.array([glyph.before for glyph in hand.glyphs], dtype=np.intp)
    after = np.array([glyph.after for glyph in hand.glyphs], dtype=np.intp)
    parted = np.zeros(len(before), dtype=bool)
    for first, second in _spaces(hand, x):
        after[first], before[second], parted[second] = second, first, True
    for array in (before, after, parted):
        array.flags.writeable = False
    return Neighbours(before, after, parted)


def _spaces(hand: ScannedHand, x: Array) -> Iterator[tuple[int, int]]:
    """Pairs of the last glyph of a word and the first of the next, where both are on one line of a written page.

    A page of letters that the hand was lent has no transcript, and what lies between those letters is nobody's habit.
    """
    starts: dict[tuple[int, int], list[int]] = {}
    for number, glyph in enumerate(hand.glyphs):
        if glyph.before == NOBODY and glyph.letter and hand.pages[glyph.page].transcript:
            starts.setdefault((glyph.page, glyph.line), []).append(number)
    for heads in starts.values():
        heads.sort(key=lambda number: x[number])
        for head, following in pairwise(heads):
            last = head
            while hand.glyphs[last].after != NOBODY:
                last = hand.glyphs[last].after
            # a word in which a letter was not found is in two pieces without a space between them
            apart = hand.glyphs[head].word != hand.glyphs[following].word or hand.glyphs[head].at < 0
            if apart and x[last] < x[following]:
                yield last, following
