"""Which glyphs of a scanned hand write a text: the cheapest sequence, perturbed so that no two come out alike.

Without variation the whole text is one chain, solved exactly.  With it each word is, given what was written before:
a glyph is the dearer the less long ago it was written, which no chain could know of itself.

Source: seed 000, §6.2 (perturb-and-MAP; the cost of writing a glyph again is this project's).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby, pairwise

import numpy as np

from handout.values import Array, Indices
from handout.writing.scanned.pools import Pool, pools_of
from handout.writing.scanned.stock import Stock
from handout.writing.scanned.wanted import Wanted, check

NOISE = 0.3  # λ: scale of the perturbation at variation 1
AGAIN = 3.0  # cost of a glyph that was the last one written
FORGOTTEN = 200.0  # letters after which a glyph is as good as new
_TRIES = 4  # times that a word is solved again for having a glyph twice

Between = Callable[[int], Array]


class Used:
    """When each glyph of a stock was last written, in letters; one for a text, of however many pages."""

    def __init__(self, stock: Stock) -> None:
        self._last = np.full(len(stock), -np.inf)
        self._written = 0

    def cost(self, numbers: Indices, ahead: int) -> Array:
        """(k,): of writing glyphs as the letter after `ahead` others."""
        age = self._written + ahead - self._last[numbers]
        return np.asarray(AGAIN * np.maximum(0.0, 1.0 - age / FORGOTTEN))

    def write(self, numbers: Indices) -> None:
        """Note that glyphs (n,) are written, one after the other."""
        self._last[numbers] = self._written + np.arange(len(numbers))
        self._written += len(numbers)


def choose(
    stock: Stock,
    wanted: Sequence[Wanted],
    rng: np.random.Generator,
    *,
    variation: float = 1.0,
    used: Used | None = None,
) -> Indices:
    """The glyphs that write a text.

    Parameters
    ----------
    stock : Stock
    wanted : sequence of Wanted
        In the order of the text.
    rng : numpy.random.Generator
        The same generator gives the same glyphs.
    variation : float ≥ 0
        0: the glyphs that go together best, always the same.  1: as the author varies.
    used : Used
        What was written before; what is written now is added.  Without it the text begins afresh.

    Returns
    -------
    (n,) int: numbers of glyphs of the hand.

    Raises
    ------
    MissingCharacters
        The hand has no glyph for some letters.
    """
    check(stock, wanted)
    pools = pools_of(stock, wanted)
    if not wanted:
        return np.zeros(0, dtype=np.intp)
    if variation <= 0:
        unary = [pool.cost for pool in pools]
        best = viterbi(unary, lambda i: _between(stock, wanted, pools, i))
        return np.array([pool.numbers[k] for pool, k in zip(pools, best, strict=True)], dtype=np.intp)
    used = used or Used(stock)
    numbers = np.zeros(len(wanted), dtype=np.intp)
    for first, last in _words(wanted):
        unary = [pools[i].cost + variation * NOISE * _noise(rng, len(pools[i].numbers)) for i in range(first, last)]
        if first:
            before = numbers[first - 1 : first]
            unary[0] = unary[0] + stock.meetings.cost(before, pools[first].numbers, _parted(wanted, first - 1))[0]
        numbers[first:last] = _word(stock, wanted[first:last], pools[first:last], unary, used)
        used.write(numbers[first:last])
    return numbers


def viterbi(unary: Sequence[Array], between: Between) -> list[int]:
    """The cheapest sequence of states.

    Parameters
    ----------
    unary : n of (kᵢ,) float: costs of the states of each place.
    between : gives (kᵢ, kᵢ₊₁) float: costs of the steps from place i.

    Returns
    -------
    n numbers of states; among equals the first.
    """
    best, back = unary[0], list[Indices]()
    for i, own in enumerate(unary[1:]):
        total = best[:, None] + between(i)
        from_ = total.argmin(axis=0)
        back.append(from_)
        best = total[from_, np.arange(len(own))] + own
    path = [int(best.argmin())]
    for from_ in reversed(back):
        path.append(int(from_[path[-1]]))
    return path[::-1]


def _word(stock: Stock, wanted: Sequence[Wanted], pools: Sequence[Pool], unary: Sequence[Array], used: Used) -> Indices:
    """The glyphs of one word; where one comes twice its later places are made dear, and the word solved again."""
    costs = [own + used.cost(pool.numbers, i) for i, (pool, own) in enumerate(zip(pools, unary, strict=True))]
    steps = [_between(stock, wanted, pools, i) for i in range(len(pools) - 1)]
    for _ in range(_TRIES):
        path = viterbi(costs, steps.__getitem__)
        numbers = np.array([pool.numbers[k] for pool, k in zip(pools, path, strict=True)], dtype=np.intp)
        again = np.setdiff1d(np.arange(len(numbers)), np.unique(numbers, return_index=True)[1])
        if not len(again):
            break
        for i in again:
            costs[i][path[i]] += AGAIN
    return numbers


def _between(stock: Stock, wanted: Sequence[Wanted], pools: Sequence[Pool], i: int) -> Array:
    return stock.meetings.cost(pools[i].numbers, pools[i + 1].numbers, _parted(wanted, i))


def _parted(wanted: Sequence[Wanted], i: int) -> bool:
    """Whether there is a space between a letter and the next."""
    return wanted[i].word != wanted[i + 1].word


def _words(wanted: Sequence[Wanted]) -> Iterator[tuple[int, int]]:
    """Where each word begins and ends."""
    sizes = [len(list(word)) for _, word in groupby(wanted, lambda one: one.word)]
    return pairwise([0, *np.cumsum(sizes).tolist()])


def _noise(rng: np.random.Generator, count: int) -> Array:
    """(count,) Gumbel noise for a cost that is minimised."""
    return -rng.gumbel(size=count)
