"""The candidates for every letter and place, and what each costs for not being quite what is wanted.

Source: seed 000, §6.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.hand.places import PLACES, Place
from handout.values import Array, Indices, readonly, readonly_indices
from handout.writing.scanned.stock import Stock
from handout.writing.scanned.wanted import Wanted, check, stand_in

ENOUGH = 8  # exact matches from which on no others are asked
_MOST = 64  # candidates of a place: time
_DRAWN = 24  # the same where a hand has more good ones than that: other ones each time, or the same few would be taken
_ELSEWHERE = 0.5  # cost of a glyph from another place in its word
_SMALL = 1.0  # cost of a small letter for a capital


@dataclass(frozen=True, eq=False)
class Pool:
    """Glyphs that may stand in one place.

    numbers : (k,) int.
    cost : (k,) float ≥ 0.
    """

    numbers: Indices
    cost: Array


def pools_of(stock: Stock, wanted: Sequence[Wanted], rng: np.random.Generator | None = None) -> list[Pool]:
    """The pool of every letter that is wanted.

    Parameters
    ----------
    rng : numpy.random.Generator, optional
        Draws the candidates where there are many; without it they are the best, always the same.

    Raises
    ------
    MissingCharacters
        Some letters have none.
    """
    check(stock, wanted)
    kinds = {(one.letter, one.place) for one in wanted}
    every = {kind: _pool(stock, *kind) for kind in kinds}
    if rng is None:
        few = {kind: _part(pool, np.arange(min(len(pool.numbers), _MOST))) for kind, pool in every.items()}
        return [few[one.letter, one.place] for one in wanted]
    return [_drawn(every[one.letter, one.place], rng) for one in wanted]


def _pool(stock: Stock, letter: str, place: Place) -> Pool:
    """All glyphs that might do, the best first."""
    own = stand_in(stock, letter)
    numbers = stock.of(own, place)
    if (stock.doubt[numbers] < _ELSEWHERE).sum() < ENOUGH:
        numbers = stock.of(own)
    cost = stock.doubt[numbers] + _ELSEWHERE * (stock.places[numbers] != PLACES.index(place))
    order = np.argsort(cost, kind="stable")
    return Pool(readonly_indices(numbers[order], None), readonly(cost[order] + _SMALL * (own != letter), None))


def _drawn(pool: Pool, rng: np.random.Generator) -> Pool:
    good = int(np.searchsorted(pool.cost, pool.cost[0] + _ELSEWHERE))
    if good <= _MOST:
        return _part(pool, np.arange(min(len(pool.numbers), _MOST)))
    return _part(pool, rng.choice(good, _DRAWN, replace=False))


def _part(pool: Pool, which: Indices) -> Pool:
    rising = which[np.argsort(pool.numbers[which])]
    return Pool(readonly_indices(pool.numbers[rising], None), readonly(pool.cost[rising], None))
