"""A word in a scanned hand: which glyphs it is written with and how far apart they stand, before it has a line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from handout.values import Array, Indices
from handout.writing.scanned.bending import Bend
from handout.writing.words import cuts


@dataclass(frozen=True, eq=False)
class ScannedWord:
    """Glyphs side by side; lengths in x-heights, x from where the body of the first begins.

    numbers : (n,) int, of the glyphs in their hand.
    x : (n,) float: their centres.
    y : (n,) float, line space: how high those stand.
    bends : n: how each is bent.
    extents : (n, 2) float: where the ink of each begins and ends.
    at, spelt : index in the text and grapheme of each.
    advance : where the next word's gap begins.
    glued : whether it goes on with the word before, without a space.
    """

    numbers: Indices
    x: Array
    y: Array
    bends: tuple[Bend, ...]
    extents: Array
    at: tuple[int, ...]
    spelt: tuple[str, ...]
    advance: float
    glued: bool = False

    @property
    def left(self) -> float:
        """Where its ink begins."""
        return float(self.extents[:, 0].min())

    @property
    def right(self) -> float:
        """Where its ink ends."""
        return float(self.extents[:, 1].max())

    def parts(self, room: float) -> Sequence[ScannedWord]:
        """Itself, or, where it is wider than `room`, what is left when it is cut between letters."""
        if max(self.right, self.advance) <= room or len(self.numbers) == 1:
            return [self]
        where = cuts(self.extents[:, 0].tolist(), self.extents[:, 1].tolist(), room)
        return [self._part(a, b) for a, b in pairwise(where)]

    def _part(self, a: int, b: int) -> ScannedWord:
        begin = float(self.extents[a, 0]) if a else 0.0
        extents = self.extents[a:b] - begin
        return replace(
            self,
            numbers=self.numbers[a:b],
            x=self.x[a:b] - begin,
            y=self.y[a:b],
            bends=self.bends[a:b],
            extents=extents,
            at=self.at[a:b],
            spelt=self.spelt[a:b],
            advance=float(np.max(extents[:, 1])),
            glued=self.glued if a == 0 else True,
        )
