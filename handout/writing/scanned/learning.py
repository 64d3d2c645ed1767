"""How well two glyphs would join, learned from those that do, for pairs that show no ligature towards each other.

A forest of regression trees over what the two look like, kept as arrays.  It is learned from the hand's own ligatures:
what each would differ from that of its right neighbour in the source, which is not at all, and from those of others.

Source: seed 000, §6.2; C. Xiong, D. Johnson, R. Xu, J. Corso, "Random forests for metric learning with implicit
pairwise position dependence", 2012.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Indices

_TREES, _DEPTH, _LEAF = 32, 8, 5
_PAIRS = 3000  # pairs of strangers to learn from
_FEW = 12  # hands with fewer ligatures teach nothing about them
_TOGETHER = 20_000  # pairs at a time: memory
_USUAL = 0.08  # mean cost of a pair of strangers in a hand without ligatures, as in hands with them


@dataclass(frozen=True, eq=False)
class Forest:
    """Regression trees, one after the other in each array.

    first : (trees,) int: root of every tree.
    feature : (nodes,) int: what is asked: k < 216 the sum, above it the absolute difference, of the two glyphs' kth.
    threshold : (nodes,) float: `low` follows for what is not above it, `high` otherwise.
    low, high : (nodes,) int; a leaf follows itself.
    value : (nodes,) float.
    depth : the most steps from a root to a leaf.
    """

    first: Indices
    feature: Indices
    threshold: NDArray[np.float32]
    low: Indices
    high: Indices
    value: Array
    depth: int

    def predict(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> Array:
        """(m,): what is expected of pairs with the features one, other : (m, 216)."""
        parts = range(0, len(one), _TOGETHER)
        found = [self._part(one[at : at + _TOGETHER], other[at : at + _TOGETHER]) for at in parts]
        return np.concatenate([np.zeros(0), *found])

    def _part(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> Array:
        pairs = pair_features(one, other)
        row = np.arange(len(pairs))
        total = np.zeros(len(pairs))
        for root in self.first:
            node = np.full(len(pairs), root, dtype=np.intp)
            for _ in range(self.depth):
                above = pairs[row, self.feature[node]] > self.threshold[node]
                node = np.where(above, self.high[node], self.low[node])
            total += self.value[node]
        return total / len(self.first)


@dataclass(frozen=True)
class Distance:
    """For hands that never join letters: how much two glyphs differ, times `scale`."""

    scale: float

    def predict(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> Array:
        """(m,): of pairs with the features one, other : (m, 216)."""
        return np.asarray(np.abs(one - other).sum(axis=1, dtype=np.float64) * self.scale)


def pair_features(one: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
    """(m, 432) of features (m, 216): sums of near and of far halves, then their absolute differences."""
    return np.concatenate([one + other, np.abs(one - other)], axis=1)


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
    return _grown(pair_features(own[one], own[other]), mismatch(exits[one], entries[other]))


def _grown(pairs: NDArray[np.float32], cost: Array) -> Forest:
    from sklearn.ensemble import ExtraTreesRegressor

    made = ExtraTreesRegressor(
        _TREES, max_depth=_DEPTH, min_samples_leaf=_LEAF, max_features="sqrt", random_state=0, n_jobs=1
    )
    made.fit(pairs, cost)
    return as_arrays([tree.tree_ for tree in made.estimators_])


def as_arrays(trees: list[Any]) -> Forest:
    """The forest of scikit-learn's `trees`."""
    counts = np.array([tree.node_count for tree in trees])
    first = np.cumsum(counts) - counts
    low, high, feature = [], [], []
    for start, tree in zip(first, trees, strict=True):
        leaf = tree.children_left < 0
        itself = np.arange(tree.node_count)
        low.append(np.where(leaf, itself, tree.children_left) + start)
        high.append(np.where(leaf, itself, tree.children_right) + start)
        feature.append(np.where(leaf, 0, tree.feature))
    return Forest(
        first.astype(np.intp),
        np.concatenate(feature).astype(np.intp),
        np.concatenate([tree.threshold for tree in trees]).astype(np.float32),
        np.concatenate(low).astype(np.intp),
        np.concatenate(high).astype(np.intp),
        np.concatenate([tree.value[:, 0, 0] for tree in trees]),
        max(int(tree.max_depth) for tree in trees),
    )
