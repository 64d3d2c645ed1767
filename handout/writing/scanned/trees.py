"""Regression trees over what two glyphs look like, grown and asked all at once.

Source: P. Geurts, D. Ernst, L. Wehenkel, "Extremely randomized trees", 2006.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Indices

_TREES, _DEPTH, _LEAF = 32, 8, 5
_EACH = 4  # of so many pairs a tree grows from one: on held-out pairs of three hands that errs by 1 % more at the most
_TOGETHER = 20_000  # pairs at a time: memory


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


def pair_features(one: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
    """(m, 432) of features (m, 216): sums of near and of far halves, then their absolute differences."""
    return np.concatenate([one + other, np.abs(one - other)], axis=1)


def grow(one: NDArray[np.float32], other: NDArray[np.float32], cost: Array, rng: np.random.Generator) -> Forest:
    """A forest that tells the costs (m,) of pairs with the features one, other : (m, 216); all trees grow together."""
    pairs = pair_features(one, other)
    own = rng.permuted(np.tile(np.arange(len(pairs)), (_TREES, 1)), axis=1)[:, : max(1, len(pairs) // _EACH)]
    level = _Level(own.ravel(), np.repeat(np.arange(_TREES), own.shape[1]))
    grown, offset = list[tuple[NDArray[Any], ...]](), 0
    for depth in range(_DEPTH + 1):
        feature, threshold, parted = level.split(pairs, cost, rng)
        parted &= depth < _DEPTH
        after = offset + len(parted)
        low = np.where(parted, after + 2 * (np.cumsum(parted) - 1), offset + np.arange(len(parted)))
        grown.append((np.where(parted, feature, 0), threshold, low, low + parted, level.means(cost)))
        if not parted.any():
            break
        above = pairs[level.pair, feature[level.node]] > threshold[level.node]
        level, offset = level.next(np.where(parted, low - after, -1), above), after
    features, thresholds, low, high, value = (np.concatenate(each) for each in zip(*grown, strict=True))
    return Forest(np.arange(_TREES), features, thresholds, low, high, value, depth)


@dataclass(frozen=True, eq=False)
class _Level:
    """The nodes at one depth of all trees: which pairs have come to which node, node by node.

    pair, node : (r,) int.
    """

    pair: Indices
    node: Indices

    @cached_property
    def first(self) -> Indices:
        """(nodes,) int: the place of the first pair of every node."""
        return np.flatnonzero(np.diff(self.node, prepend=-1))

    @cached_property
    def size(self) -> Indices:
        """(nodes,) int: pairs of every node."""
        return np.bincount(self.node)

    def means(self, cost: Array) -> Array:
        """(nodes,)"""
        return np.asarray(np.add.reduceat(cost[self.pair], self.first) / self.size)

    def split(
        self, pairs: NDArray[np.float32], cost: Array, rng: np.random.Generator
    ) -> tuple[Indices, NDArray[np.float32], NDArray[np.bool_]]:
        """What each node asks, and whether there is anything to ask: (nodes,) feature, threshold, whether.

        Of some features that are drawn, and for each a threshold between its least and its most in the node, that one
        is taken that leaves the least variance.
        """
        count = len(self.first)
        feature = rng.integers(0, pairs.shape[1], (count, round(pairs.shape[1] ** 0.5)))
        value = pairs[self.pair[:, None], feature[self.node]]
        least, most = np.minimum.reduceat(value, self.first), np.maximum.reduceat(value, self.first)
        threshold = least + rng.random(least.shape, dtype=np.float32) * (most - least)
        above = value > threshold[self.node]
        many = np.add.reduceat(above, self.first, dtype=np.intp)
        own = cost[self.pair]
        total = np.add.reduceat(own, self.first)[:, None]
        high = np.add.reduceat(above * own[:, None], self.first)
        few = self.size[:, None] - many
        gain = np.where(
            np.minimum(many, few) >= _LEAF,
            high**2 / np.maximum(many, 1) + (total - high) ** 2 / np.maximum(few, 1),
            -np.inf,
        )
        best = np.arange(count), gain.argmax(axis=1)
        return feature[best], threshold[best], np.isfinite(gain[best])

    def next(self, low: Indices, above: NDArray[np.bool_]) -> _Level:
        """The level below: `low` (nodes,) is what follows a node for pairs that are not above; −1 for a leaf."""
        kept = low[self.node] >= 0
        node = (low[self.node] + above)[kept]
        order = np.argsort(node, kind="stable")
        return _Level(self.pair[kept][order], node[order])
