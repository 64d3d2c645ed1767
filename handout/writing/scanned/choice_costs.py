"""All that a choice among the glyphs of a scanned hand costs: every term, its weight, and what works it out.

The cost of a sequence of glyphs is the sum of four terms; `choosing` looks for the cheapest.  To add a cost, add its
weight to `ChoiceWeights`, and add it up in one of these:

- `intrinsic_cost` of a glyph, whatever is written: a doubtful reading, no ink of its own, an odd shape (`outlier_cost`)
- `candidate_cost` of a glyph for a letter in its place
- `TransitionCosts.cost` of a glyph after another
- `UsageHistory.cost` of a glyph that was written before

The transitions are measured, not learnt.  The paper learns from a hand's ligatures what those that were not written
would have cost, by a forest of regression trees on what glyphs look like (seed 000, §6.2; Xiong et al. 2012).  On
ligatures of glyphs that it has not seen such a forest tells nothing: on two real pages its guesses correlate by .05 to
.07 with the truth, and err as much as the mean does, whether grown by scikit-learn, by OpenCV or here.  Where a letter
shows no ligature, what counts is that the two look alike.

Source: seed 000, §6.2 (perturb-and-MAP; the cost of writing a glyph again is this project's).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.hand.places import PLACES, Place
from handout.hand.scanned import DOUBTFUL, ScannedGlyph, ScannedHand
from handout.values import Array, Indices
from handout.writing.choice import fading_cost
from handout.writing.scanned.outlier_cost import outlier_cost


@dataclass(frozen=True)
class ChoiceWeights:
    """What each term counts; all are set by eye on texts written with scanned hands, unless said otherwise."""

    # of a glyph
    doubtful: float = 1.0  # just under the bound of doubt; twice that for one that is nowhere near sure
    broken: float = 3.0  # without a body
    # of a glyph for a letter
    elsewhere: float = 0.5  # from another place in its word
    other_case: float = 1.0  # a small letter for a capital
    # of a glyph after another
    fit: float = 32.0  # for each unit that a ligature lies from where it should; less, and joins have humps
    unseen: float = 0.3  # where one of the two was not joined: what does not meet is not seen
    unlike: float = 0.5  # a deviation between two residuals: neighbours then are as like as the author's own
    unmatched: float = 0.4  # each ligature of one glyph, beyond the first, that meets none of the other's
    loose: float = 2.5  # a ligature that meets none, in a word: the pen would have gone on, and lifts
    cut: float = 1.0  # a ligature that is cut for a word to end, or begin, there
    between_words: float = 0.5  # share of the cost that is left between words
    # of a glyph that was written before
    again: float = 5.0  # that was the last one written
    forgotten: float = 400.0  # letters after which it is as good as new
    often: float = 0.3  # for each time that it was written more often than the least written that would do
    # Scale of the perturbation at variation 1.  Measured on three hands of one page each: two texts of one wording have
    # the same glyph in a fifth of all places, in an eighth of those where the hand has 25 glyphs of the letter or more.
    # With 0.8 that is a twentieth, and ligatures lie a quarter further from where they should
    noise: float = 0.3


WEIGHTS = ChoiceWeights()


def intrinsic_cost(hand: ScannedHand, bodies: Sequence[Indices]) -> Array:
    """(n,) float ≥ 0: of writing each glyph at all, given its body, which may be empty."""
    whole = [body if len(body) else glyph.vertices for body, glyph in zip(bodies, hand.glyphs, strict=True)]
    return reading_cost(hand.glyphs, bodies) + outlier_cost(hand, whole)


def reading_cost(glyphs: Sequence[ScannedGlyph], bodies: Sequence[Indices]) -> Array:
    """(n,) float ≥ 0: of glyphs whose reading is doubtful, or that have no body."""
    cost = np.zeros(len(glyphs))
    for i, glyph in enumerate(glyphs):
        if glyph.confidence < DOUBTFUL:
            cost[i] += WEIGHTS.doubtful * (2 - glyph.confidence / DOUBTFUL)
        if not len(bodies[i]):
            cost[i] += WEIGHTS.broken
    return cost


def candidate_cost(intrinsic: Array, places: Indices, place: Place) -> Array:
    """(k,) float ≥ 0: of glyphs from some places (k,), indices in `PLACES`, for a letter in its place."""
    return np.asarray(intrinsic + WEIGHTS.elsewhere * (places != PLACES.index(place)))


class UsageHistory:
    """When each of `count` glyphs was last written, in letters, and how often; one for a text of however many pages."""

    def __init__(self, count: int) -> None:
        self._last = np.full(count, -np.inf)
        self._times = np.zeros(count)
        self._written = 0

    def cost(self, numbers: Indices, ahead: int) -> Array:
        """(k,): of writing glyphs as the letter after `ahead` others."""
        age = self._written + ahead - self._last[numbers]
        often = self._times[numbers] - self._times[numbers].min(initial=np.inf)
        return np.asarray(fading_cost(age, WEIGHTS.again, WEIGHTS.forgotten) + WEIGHTS.often * often)

    def write(self, numbers: Indices) -> None:
        """Note that glyphs (n,) are written, one after the other."""
        self._last[numbers] = self._written + np.arange(len(numbers))
        np.add.at(self._times, numbers, 1)
        self._written += len(numbers)


class TransitionCosts:
    """The costs of all pairs of a hand's glyphs, each worked out when it is first asked for.

    Parameters
    ----------
    exits, entries : (n, k, p, 2) float; residual : (n, 4) float; after : (n,) int: see `glyph_index.GlyphIndex`.
    """

    def __init__(self, exits: Array, entries: Array, residual: Array, after: Indices) -> None:
        self._exits, self._entries = exits, entries
        self._residual, self._after = residual, after
        self._exit_count, self._entry_count = ((~np.isnan(ways[:, :, 0, 0])).sum(axis=1) for ways in (exits, entries))
        self.has_exit, self.has_entry = self._exit_count > 0, self._entry_count > 0
        self._costs = np.full((len(after), len(after)), np.nan, dtype=np.float32)

    def cost(self, first: Indices, second: Indices, parted: bool) -> Array:
        """(k, l) float ≥ 0: of each of `first` (k,) before each of `second` (l,), with or without a space between."""
        costs = self._costs[first[:, None], second]
        if np.isnan(costs).any():
            row, column = np.nonzero(np.isnan(costs))
            costs[row, column] = self._of_pairs(first[row], second[column])
            self._costs[first[:, None], second] = costs
        cost = costs.astype(np.float64)
        if parted:
            return np.asarray(
                WEIGHTS.between_words * cost + self.cut(first)[:, None] + WEIGHTS.cut * self.has_entry[second]
            )
        return np.asarray(cost + WEIGHTS.loose * (self.has_exit[first][:, None] != self.has_entry[second]))

    def cut(self, last: Indices) -> Array:
        """(k,) float ≥ 0: of ending a word with each of some glyphs (k,), whose ligatures then lead nowhere."""
        return np.asarray(WEIGHTS.cut * self.has_exit[last])

    def _of_pairs(self, first: Indices, second: Indices) -> Array:
        """(m,) float: of pairs."""
        joined = self.has_exit[first] & self.has_entry[second]
        cost = np.full(len(first), WEIGHTS.unseen)
        cost[joined] = WEIGHTS.fit * mismatch(self._exits[first[joined]], self._entries[second[joined]])
        cost[joined] += WEIGHTS.unmatched * np.abs(self._exit_count[first[joined]] - self._entry_count[second[joined]])
        cost += WEIGHTS.unlike * np.abs(self._residual[first] - self._residual[second]).mean(axis=1)
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
