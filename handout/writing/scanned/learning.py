"""How well two glyphs would join, learned from those that do, for pairs that show no ligature towards each other.

A forest of regression trees over what the two look like, kept as arrays.  It is learned from the hand's own ligatures:
what each would differ from that of its right neighbour in the source, which is not at all, and from those of others.

Source: seed 000, §6.2; C. Xiong, D. Johnson, R. Xu, J. Corso, "Random forests for metric learning with implicit
pairwise position dependence", 2012.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.values import Array
from handout.writing.scanned.trees import Forest, grow

_PAIRS = 3000  # pairs of strangers to learn from
_FEW = 12  # hands with fewer ligatures teach nothing about them
_USUAL = 0.08  # mean cost of a pair of strangers in a hand without ligatures, as in hands with them


@dataclass(frozen=True)
class Distance:
    """For hands that never join letters: how much two glyphs differ, times `scale`."""

    scale: float

    def predict(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> Array:
        """(m,): of pairs with the features one, other : (m, 216)."""
        return np.asarray(np.abs(one - other).sum(axis=1, dtype=np.float64) * self.scale)


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


def learn(feature: Array, exits: Array, entries: Array) -> Forest | Distance:
    """Learn what the ligatures of two glyphs would cost from what the glyphs look like.

    Parameters
    ----------
    feature : (n, 216) float.
    exits, entries : (n, k, p, 2) float: see `stock.Stock`.
    """
    leaving = np.flatnonzero(~np.isnan(exits[:, 0, 0, 0]))
    coming = np.flatnonzero(~np.isnan(entries[:, 0, 0, 0]))
    own = feature.astype(np.float32)
    rng = np.random.default_rng(0)  # the same hand teaches the same
    if len(leaving) < _FEW:
        one, other = rng.integers(0, len(own), (2, _PAIRS)) if len(own) else np.zeros((2, 0), dtype=np.intp)
        usual = float(Distance(1.0).predict(own[one], own[other]).mean()) if len(own) > 1 else 0.0
        return Distance(_USUAL / usual if usual > 0 else 0.0)
    one, other = rng.choice(leaving, _PAIRS), rng.choice(coming, _PAIRS)
    return grow(own[one], own[other], mismatch(exits[one], entries[other]), rng)
