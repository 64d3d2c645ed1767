"""What it costs to write one glyph after another.

The paper learns from a hand's ligatures what those that were not written would have cost, by a forest of regression
trees on what glyphs look like (seed 000, §6.2; Xiong et al. 2012).  On ligatures of glyphs that it has not seen such a
forest tells nothing: on two real pages its guesses correlate by .05 to .07 with the truth, and err as much as the mean
does, whether grown by scikit-learn, by OpenCV or here.  Where a letter shows no ligature, what counts is that the
two look alike.

Source: seed 000, §6.2.
"""

from __future__ import annotations

import numpy as np

from handout.values import Array, Indices

_PARTED = 0.5  # share of the cost that is left between words
_FIT = 32.0  # cost of a ligature for each unit that it lies from where it should; less, and joins have humps
_UNSEEN = 0.3  # cost where one of the two was not joined: what does not meet is not seen
_UNLIKE = 0.5  # cost of a deviation between what two glyphs depart by: neighbours then are as like as the author's own
_MORE = 0.4  # cost of each ligature of one glyph, beyond the first, that meets none of the other's
_LOOSE = 2.5  # cost of a ligature that meets none, in a word: the pen would have gone on, and lifts
_CUT = 1.0  # cost of a ligature that is cut for a word to end, or begin, there


class Meetings:
    """The costs of all pairs of a hand's glyphs, each worked out when it is first asked for.

    Parameters
    ----------
    exits, entries : (n, k, p, 2) float; departure : (n, 4) float; after : (n,) int: see `stock.Stock`.
    """

    def __init__(self, exits: Array, entries: Array, departure: Array, after: Indices) -> None:
        self._exits, self._entries = exits, entries
        self._departure, self._after = departure, after
        self._leaving, self._coming = ((~np.isnan(ways[:, :, 0, 0])).sum(axis=1) for ways in (exits, entries))
        self.leaves, self.comes = self._leaving > 0, self._coming > 0
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
        cost = np.full(len(first), _UNSEEN)
        cost[joined] = _FIT * mismatch(self._exits[first[joined]], self._entries[second[joined]])
        cost[joined] += _MORE * np.abs(self._leaving[first[joined]] - self._coming[second[joined]])
        cost += _UNLIKE * np.abs(self._departure[first] - self._departure[second]).mean(axis=1)
        cost[self._after[first] == second] = 0.0
        return cost


def mismatch(exits: Array, entries: Array) -> Array:
    """(…): how far the ligature out of one glyph lies from the one into another; inf where either has none.

    The two may be moved along the line, as the letters will be, but not up or down: both stand on one baseline.  Their
    mean distance is then what the way between the letters must be bent by.  (The paper compares first and last points
    under any shift; a way out of an o, which is high, then meets one into an n that begins low.)  Of several ligatures
    the best two count.

    Parameters
    ----------
    exits, entries : (…, k, p, 2) float, line space: places along ligatures, nan for none.
    """
    away = exits[..., :, None, :, :] - entries[..., None, :, :, :]
    away[..., 0] -= away[..., 0].mean(axis=-1, keepdims=True)
    mean = np.hypot(away[..., 0], away[..., 1]).mean(axis=-1)
    return np.asarray(np.where(np.isnan(mean), np.inf, mean).min(axis=(-2, -1)))
