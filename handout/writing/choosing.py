"""Which glyphs write a text: one search for every kind of hand, perturbed so that no two come out alike.

A `GlyphStock` says which glyphs of a hand may be written for each letter of a word, and what they cost: drawn hands
`drawn_forms`, scanned ones `glyph_index`.  `Chooser` takes the cheapest sequence: what each glyph costs in its place,
what one costs after another, chance, and how lately and how often each was written before.  `Prices` come from
outside: whoever reads what was written makes glyphs and pairs dear that read as something else, and has the text
chosen again; chance then falls as it fell before, so that all other words stay as they are as far as they may.

Source: seed 000, §6.2 (perturb-and-MAP; the cost of writing a glyph again is this project's).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np

from handout.chains import viterbi
from handout.values import Array, Indices
from handout.writing.slips import Struck
from handout.writing.text import Letter, Piece

_TRIES = 16  # times that a word is solved for having a glyph twice; real words are done after one or two
_HELD = 1e4  # cost of any other glyph where one is held: more than all other costs of a word together


def fading_cost(age: Array, weight: float, forgotten: float) -> Array:
    """(k,): of using something again, from `weight` at once evenly down to 0 when `forgotten`: for many instances."""
    return np.asarray(weight * np.maximum(0.0, 1.0 - age / forgotten))


@dataclass(frozen=True, eq=False)
class Candidates:
    """Glyphs that may stand in one place.

    numbers : (k,) int.
    cost : (k,) float.
    """

    numbers: Indices
    cost: Array


@dataclass(frozen=True)
class Prices:
    """What glyphs cost besides, ≥ 0, as a reader of the writing finds; inf forbids where anything else may stand.

    glyphs : (place of a letter in the text, number of a glyph) → cost of that glyph for that letter.
    held : place of a letter → the number of the glyph that writes it, if it is among those that may.
    """

    glyphs: Mapping[tuple[int, int], float] = field(default_factory=dict)
    held: Mapping[int, int] = field(default_factory=dict)


class GlyphStock(Protocol):
    """The glyphs of a hand, told apart by numbers, and what choosing among them costs.

    chance : scale of the perturbation at variation 1.
    twice : cost of a glyph that comes again in one word, by which the word is chosen anew; 0: it may.
    kind : (n,) int: what of each glyph is remembered as written, 0 up to `kinds`.
    """

    @property
    def chance(self) -> float: ...
    @property
    def twice(self) -> float: ...
    @property
    def kind(self) -> Indices: ...
    def candidates(self, letters: Sequence[Letter], rng: np.random.Generator | None) -> list[Candidates]:
        """The glyphs for each letter of a word; where `rng` is None they are always the same."""

    def steps(self, first: Indices, second: Indices, *, varied: bool) -> Array:
        """(k, l): costs of each of `first` right before each of `second`."""

    def between_words(self, last: int, first: Indices, *, parted: bool) -> Array:
        """(k,): costs of beginning a word after the glyph `last`, with or without a space between."""

    def ending(self, last: Indices) -> Array:
        """(k,): costs of ending a word."""

    def repetition(self, age: Array, times: Array) -> Array:
        """(k,): costs of writing what was last written `age` letters ago, and `times` in all."""


@dataclass(frozen=True, eq=False)
class Choice:
    """A word with the glyphs that write it, and what they were chosen from.

    spaces : before it.
    numbers : (n,) int: its glyphs.
    candidates, chance, again : n, of each letter; what chance, and having been written before, added to the costs (k,).
    intended : the word that was to be written, where this one is struck out.
    """

    letters: Sequence[Letter]
    spaces: int
    numbers: Indices
    candidates: Sequence[Candidates]
    chance: Sequence[Array]
    again: Sequence[Array]
    intended: str | None = None


class Chooser:
    """Chooses the glyphs of one text, word by word; remembers what it used.

    Parameters
    ----------
    variation : 0: the glyphs that go together best, always the same.  1: as the author varies.
    """

    def __init__(
        self, stock: GlyphStock, rng: np.random.Generator, variation: float = 1.0, prices: Prices | None = None
    ) -> None:
        self._stock, self._rng, self._variation, self._prices = stock, rng, variation, prices or Prices()
        kinds = int(stock.kind.max(initial=-1)) + 1
        self._last, self._times, self._written = np.full(kinds, -np.inf), np.zeros(kinds), 0
        self._before: int | None = None

    def word(self, letters: Sequence[Letter], spaces: int = 1, intended: str | None = None) -> Choice:
        """The glyphs for the letters of one word (with its punctuation), `spaces` after the one before."""
        stock, rng, varied = self._stock, self._rng, self._variation > 0
        candidates = stock.candidates(letters, rng if varied else None)
        numbers = [each.numbers for each in candidates]
        chance = [np.zeros(len(each)) for each in numbers]
        again = list(chance)
        if varied:
            scale, kinds = self._variation * stock.chance, [stock.kind[each] for each in numbers]
            chance = [scale * np.log(-np.log(rng.uniform(1e-12, 1.0, len(each)))) for each in numbers]
            ages = [self._written + ahead - self._last[kind] for ahead, kind in enumerate(kinds)]
            again = [stock.repetition(age, self._times[kind]) for age, kind in zip(ages, kinds, strict=True)]
        unary = [each.cost + more for each, more in zip(candidates, chance, strict=True)]
        if self._before is not None:
            unary[0] = unary[0] + stock.between_words(self._before, numbers[0], parted=spaces > 0)
        unary[-1] = unary[-1] + stock.ending(numbers[-1])
        steps = [stock.steps(first, second, varied=varied) for first, second in pairwise(numbers)]
        self._add_prices(letters, numbers, unary)
        chosen = self._cheapest(numbers, unary, again, steps)
        self._remember(chosen)
        return Choice(letters, spaces, chosen, candidates, chance, again, intended)

    def _add_prices(self, letters: Sequence[Letter], numbers: Sequence[Indices], unary: list[Array]) -> None:
        """What a reader of the writing finds dear, added to the costs of a word."""
        glyphs, held = self._prices.glyphs, self._prices.held
        for i, (letter, each) in enumerate(zip(letters, numbers, strict=True)) if glyphs or held else ():
            if held.get(letter.at) in each:
                unary[i] = unary[i] + _HELD * (each != held[letter.at])
            else:
                unary[i] = unary[i] + [glyphs.get((letter.at, number), 0.0) for number in each.tolist()]

    def _cheapest(
        self, numbers: Sequence[Indices], unary: list[Array], again: list[Array], steps: Sequence[Array]
    ) -> Indices:
        """The glyphs of a word; one that comes twice is made dear in its later places, in `again`, and all is solved
        anew."""
        for _ in range(_TRIES):
            path = viterbi([costs + more for costs, more in zip(unary, again, strict=True)], steps)
            chosen = np.array([each[k] for each, k in zip(numbers, path, strict=True)], dtype=np.intp)
            repeated = np.setdiff1d(np.arange(len(chosen)), np.unique(chosen, return_index=True)[1])
            if not (len(repeated) and self._variation and self._stock.twice):
                break
            for i in repeated:
                again[i][path[i]] += self._stock.twice
        return chosen

    def _remember(self, numbers: Indices) -> None:
        kind = self._stock.kind[numbers]
        self._last[kind] = self._written + np.arange(len(kind))
        np.add.at(self._times, kind, 1)
        self._written += len(kind)
        self._before = int(numbers[-1])


def choices(paragraphs: Iterable[Sequence[Piece]], choosers: Sequence[Chooser]) -> Iterator[Iterator[Choice]]:
    """The words of a text with their glyphs, paragraph after paragraph, each chosen when it is asked for.

    choosers : that of the text, and that of the words in it that are struck out.
    """
    return (_chosen(pieces, choosers) for pieces in paragraphs)


def _chosen(pieces: Sequence[Piece], choosers: Sequence[Chooser]) -> Iterator[Choice]:
    spaces = 0
    for piece in pieces:
        if isinstance(piece, int):
            spaces = piece
        else:
            intended = piece.intended if isinstance(piece, Struck) else None
            yield choosers[intended is not None].word(piece, spaces, intended)
            spaces = 0
