"""Chains: the cheapest sequence of states, one for each place of a row, where neighbours cost something together.

Every choice along a row is solved here: glyphs of a word, samples of a pose library along a stroke, columns of a seam.

Source: Viterbi 1967, Error bounds for convolutional codes and an asymptotically optimum decoding algorithm.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from handout.values import Array


class ChainStep(Protocol):
    """What going from the states of one place to those of the next costs, where a table of all pairs would be large."""

    def totals(self, costs: Array) -> Array:
        """(l,): the cheapest way into each next state, where being in the states (k,) before costs `costs`."""

    def origin(self, costs: Array, state: int) -> int:
        """The state before, on the cheapest way into the next state `state`; among equals the first."""


class _PairCosts:
    """Costs (k, l) of all pairs."""

    def __init__(self, pairs: Array) -> None:
        self._pairs = pairs

    def totals(self, costs: Array) -> Array:
        return np.asarray((costs[:, None] + self._pairs).min(axis=0))

    def origin(self, costs: Array, state: int) -> int:
        return int((costs + self._pairs[:, state]).argmin())


def viterbi(unary: Sequence[Array], steps: Sequence[Array | ChainStep]) -> list[int]:
    """The cheapest sequence of states.

    unary : n of (kᵢ,) float: costs of the states of each place.
    steps : n − 1 costs of going from each state of a place to each of the next: (kᵢ, kᵢ₊₁) float, or a `ChainStep`.

    Returns the numbers of the n states; among equals the first.
    """
    tables = [_PairCosts(step) if isinstance(step, np.ndarray) else step for step in steps]
    reached = [unary[0]]
    for costs, step in zip(unary[1:], tables, strict=True):
        reached.append(step.totals(reached[-1]) + costs)
    path = [int(reached.pop().argmin())]
    for costs, step in zip(reversed(reached), reversed(tables), strict=True):
        path.append(step.origin(costs, path[-1]))
    return path[::-1]
