"""What it costs to write one glyph after another.

Source: seed 000, §6.2.
"""

from __future__ import annotations

import numpy as np

from handout.values import Array, Indices
from handout.writing.scanned.learning import Distance, mismatch
from handout.writing.scanned.trees import Forest

_PARTED = 0.5  # share of the cost that is left between words
_FIT = 32.0  # cost of a ligature for each unit that it lies from where it should; less, and joins have humps
_UNSEEN = 4.0  # the same where no ligature is written: what does not meet is not seen
_MORE = 0.4  # cost of each ligature of one glyph, beyond the first, that meets none of the other's
_LOOSE = 2.5  # cost of a ligature that meets none, in a word: the pen would have gone on, and lifts
_CUT = 1.0  # cost of a ligature that is cut for a word to end, or begin, there


class Meetings:
    """The costs of all pairs of a hand's glyphs, each worked out when it is first asked for.

    Parameters
    ----------
    feature : (n, 216) float; exits, entries : (n, k, p, 2) float; density, radius : (n,) float; after : (n,) int:
        see `stock.Stock`.
    learned : what tells the cost of pairs without ligatures towards each other.
    """

    def __init__(
        self,
        feature: Array,
        exits: Array,
        entries: Array,
        density: Array,
        radius: Array,
        after: Indices,
        learned: Forest | Distance,
    ) -> None:
        self._feature = feature.astype(np.float32)
        self._exits, self._entries = exits, entries
        self._density, self._radius, self._after = density, radius, after
        self._leaving, self._coming = ((~np.isnan(ways[:, :, 0, 0])).sum(axis=1) for ways in (exits, entries))
        self.leaves, self.comes = self._leaving > 0, self._coming > 0
        self._learned = learned
        self._known = np.full((len(after), len(after)), np.nan, dtype=np.float32)

    def cost(self, first: Indices, second: Indices, parted: bool) -> Array:
        """(k, l) float ≥ 0: of each of `first` (k,) before each of `second` (l,), with or without a space between."""
        known = self._known[first[:, None], second]
        if np.isnan(known).any():
            row, column = np.nonzero(np.isnan(known))
            known[row, column] = self._own(first[row], second[column])
            self._known[first[:, None], second] = known
        cost = known.astype(np.float64)
        if parted:
            return np.asarray(_PARTED * cost + self.cut(first)[:, None] + _CUT * self.comes[second])
        return np.asarray(cost + _LOOSE * (self.leaves[first][:, None] != self.comes[second]))

    def cut(self, last: Indices) -> Array:
        """(k,) float ≥ 0: of ending a word with each of some glyphs (k,), whose ligatures then lead nowhere."""
        return np.asarray(_CUT * self.leaves[last])

    def _own(self, first: Indices, second: Indices) -> Array:
        """(m,) float: of pairs."""
        joined = self.leaves[first] & self.comes[second]
        cost = np.empty(len(first))
        cost[joined] = _FIT * mismatch(self._exits[first[joined]], self._entries[second[joined]])
        cost[joined] += _MORE * np.abs(self._leaving[first[joined]] - self._coming[second[joined]])
        cost[~joined] = _UNSEEN * self._learned.predict(self._feature[first[~joined]], self._feature[second[~joined]])
        cost += np.abs(self._density[first] - self._density[second])
        cost += np.abs(self._radius[first] - self._radius[second])
        cost[self._after[first] == second] = 0.0
        return cost
