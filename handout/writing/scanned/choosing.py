"""Which glyphs of a scanned hand write a text: the cheapest sequence, perturbed so that no two come out alike.

Without variation the whole text is one chain, solved exactly.  With it each word is, given what was written before:
a glyph is the dearer the less long ago it was written, which no chain could know of itself.

Source: seed 000, §6.2 (perturb-and-MAP; the cost of writing a glyph again is this project's).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from handout.values import Array, Indices
from handout.writing.scanned.pools import Pool, pools_of
from handout.writing.scanned.stock import Stock
from handout.writing.scanned.wanted import Wanted

# Measured on three hands of one page each: two texts of one wording have the same glyph in a fifth of all places, in an
# eighth of those where the hand has 25 glyphs of the letter or more.  With 0.8 that is a twentieth, and ligatures lie a
# quarter further from where they should
NOISE = 0.3  # λ: scale of the perturbation at variation 1
AGAIN = 5.0  # cost of a glyph that was the last one written
FORGOTTEN = 400.0  # letters after which a glyph is as good as new
OFTEN = 0.3  # cost for each time that a glyph was written more often than the least written that would do
_TRIES = 16  # times that a word is solved for having a glyph twice; real words are done after one or two


class Used:
    """When each glyph of a stock was last written, in letters, and how often; one for a text, of however many pages."""

    def __init__(self, stock: Stock) -> None:
        self._last = np.full(len(stock), -np.inf)
        self._times = np.zeros(len(stock))
        self._written = 0

    def cost(self, numbers: Indices, ahead: int) -> Array:
        """(k,): of writing glyphs as the letter after `ahead` others."""
        age = self._written + ahead - self._last[numbers]
        often = self._times[numbers] - self._times[numbers].min(initial=np.inf)
        return np.asarray(AGAIN * np.maximum(0.0, 1.0 - age / FORGOTTEN) + OFTEN * often)

    def write(self, numbers: Indices) -> None:
        """Note that glyphs (n,) are written, one after the other."""
        self._last[numbers] = self._written + np.arange(len(numbers))
        np.add.at(self._times, numbers, 1)
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
    pools = pools_of(stock, wanted, rng if variation > 0 else None)
    parts = [part.numbers for part in solve(stock, wanted, pools, rng, variation, used)]
    return np.concatenate([np.zeros(0, dtype=np.intp), *parts])


@dataclass(frozen=True, eq=False)
class Solved:
    """A part of a text that was solved as one chain.

    first : its first letter's index among those wanted.
    numbers : (m,) int: the glyphs taken.
    noise, again : m of (k,) float: what was added to the costs of each letter's pool.
    """

    first: int
    numbers: Indices
    noise: tuple[Array, ...]
    again: tuple[Array, ...]


def solve(
    stock: Stock,
    wanted: Sequence[Wanted],
    pools: Sequence[Pool],
    rng: np.random.Generator,
    variation: float,
    used: Used | None,
) -> Iterator[Solved]:
    """As `choose`, from `pools`, part by part: the words of the text, or all of it without variation."""
    if not wanted:
        return
    if variation <= 0:
        none = tuple(np.zeros(len(pool.numbers)) for pool in pools)
        steps = _steps(stock, wanted, pools)
        unary = [pool.cost for pool in pools]
        unary[-1] = unary[-1] + stock.meetings.cut(pools[-1].numbers)
        yield Solved(0, _taken(pools, viterbi(unary, steps)), none, none)
        return
    used = Used(stock) if used is None else used
    before: Indices | None = None
    for first, last in _words(wanted):
        own = pools[first:last]
        noise = tuple(variation * NOISE * _noise(rng, len(pool.numbers)) for pool in own)
        again = tuple(used.cost(pool.numbers, i) for i, pool in enumerate(own))
        unary = [pool.cost + chance for pool, chance in zip(own, noise, strict=True)]
        if before is not None:
            unary[0] = unary[0] + stock.meetings.cost(before, own[0].numbers, parted=True)[0]
        unary[-1] = unary[-1] + stock.meetings.cut(own[-1].numbers)
        numbers = _word(own, unary, again, _steps(stock, wanted[first:last], own))
        used.write(numbers)
        before = numbers[-1:]
        yield Solved(first, numbers, noise, again)


def viterbi(unary: Sequence[Array], steps: Sequence[Array]) -> list[int]:
    """The cheapest sequence of states.

    Parameters
    ----------
    unary : n of (kᵢ,) float: costs of the states of each place.
    steps : n − 1 of (kᵢ, kᵢ₊₁) float: costs of going from each state of a place to each of the next.

    Returns
    -------
    n numbers of states; among equals the first.
    """
    best, back = unary[0], list[Indices]()
    for own, step in zip(unary[1:], steps, strict=True):
        total = best[:, None] + step
        origin = total.argmin(axis=0)
        back.append(origin)
        best = total[origin, np.arange(len(own))] + own
    path = [int(best.argmin())]
    for origin in reversed(back):
        path.append(int(origin[path[-1]]))
    return path[::-1]


def _word(pools: Sequence[Pool], unary: Sequence[Array], again: Sequence[Array], steps: Sequence[Array]) -> Indices:
    """The glyphs of one word.

    Where one comes twice, it is made dear in its later places, in `again`, and the word is solved anew.
    """
    for _ in range(_TRIES):
        path = viterbi([own + more for own, more in zip(unary, again, strict=True)], steps)
        numbers = _taken(pools, path)
        twice = np.setdiff1d(np.arange(len(numbers)), np.unique(numbers, return_index=True)[1])
        if not len(twice):
            break
        for i in twice:
            again[i][path[i]] += AGAIN
    return numbers


def _steps(stock: Stock, wanted: Sequence[Wanted], pools: Sequence[Pool]) -> list[Array]:
    return [
        stock.meetings.cost(a.numbers, b.numbers, one.word != other.word)
        for (a, b), (one, other) in zip(pairwise(pools), pairwise(wanted), strict=True)
    ]


def _taken(pools: Sequence[Pool], path: Sequence[int]) -> Indices:
    return np.array([pool.numbers[k] for pool, k in zip(pools, path, strict=True)], dtype=np.intp)


def _words(wanted: Sequence[Wanted]) -> Iterator[tuple[int, int]]:
    """Where each word begins and ends."""
    sizes = [len(list(word)) for _, word in groupby(wanted, lambda one: one.word)]
    return pairwise([0, *np.cumsum(sizes).tolist()])


def _noise(rng: np.random.Generator, count: int) -> Array:
    """(count,) Gumbel noise for a cost that is minimised."""
    return -rng.gumbel(size=count)
