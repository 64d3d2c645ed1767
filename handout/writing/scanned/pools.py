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


def pools_of(stock: Stock, wanted: Sequence[Wanted]) -> list[Pool]:
    """The pool of every letter that is wanted.

    Raises
    ------
    MissingCharacters
        Some letters have none.
    """
    check(stock, wanted)
    kinds = {(one.letter, one.place) for one in wanted}
    made = {kind: _pool(stock, *kind) for kind in kinds}
    return [made[one.letter, one.place] for one in wanted]


def _pool(stock: Stock, letter: str, place: Place) -> Pool:
    own = stand_in(stock, letter)
    numbers = stock.of(own, place)
    if (stock.doubt[numbers] < _ELSEWHERE).sum() < ENOUGH:
        numbers = stock.of(own)
    cost = stock.doubt[numbers] + _ELSEWHERE * (stock.places[numbers] != PLACES.index(place))
    best = np.sort(np.argsort(cost, kind="stable")[:_MOST])
    return Pool(readonly_indices(numbers[best], None), readonly(cost[best] + _SMALL * (own != letter), None))
