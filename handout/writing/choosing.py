"""Which glyphs write a text: one search for every kind of hand, perturbed so that no two come out alike.

A `GlyphStock` says which glyphs of a hand may be written for each letter of a word, and what they cost: drawn hands
`drawn_forms`, scanned ones `glyph_index`.  `GlyphChooser` takes the cheapest sequence: what each glyph costs in its
place, what one costs after another, chance, and how lately each was written before.  Whoever reads what was written
prices glyphs that read as something else, and has their word chosen again (`GlyphChooser.again`): chance falls as it
fell before, and all other words stay as they are.

A chance belongs to a glyph, a letter and a word, told by the word before it (`Choice.key`), and not to how many glyphs
there are: where a glyph is taken away, or a word comes in, few words are written otherwise.  Memory is short for that,
too, since each word that changes changes what comes after it, and how often glyphs are written is evened out by prices
that no text changes (`glyph_prices`).  In hands of one page (csafe w0182 w0277, cvl 0027) a new word has 15 to 18 of
100 behind it written otherwise, and a glyph less, which 6 had, 16 to 21; with chances of as many as there are, and a
memory of 400 letters and of all times, 58 to 72, and 62 to 69.

Source: seed 000, §6.2 (perturb-and-MAP; the cost of writing a glyph again is this project's); common random numbers.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Protocol

import numpy as np

from handout.chains import viterbi
from handout.values import Array, Indices
from handout.writing.slips import StruckLetters
from handout.writing.text import FormulaLetters, Letter, Piece

_TRIES = 16  # times that a word is solved for having a glyph twice; real words are done after one or two
_REMEMBERED = 100  # letters: what was written before that costs nothing, or next to it
_TAKEN = 3.0  # times the scale of chance: 95 of 100 differences of two chances are smaller
# (place of a letter in the text, number of a glyph) → cost ≥ 0 of that glyph for that letter, as a reader of the
# writing finds; inf forbids it where anything else may stand
Prices = Mapping[tuple[int, int], float]
_FREE: Prices = {}


def fading_cost(age: Array, weight: float, forgotten: float) -> Array:
    """(k,): of using something again, from `weight` at once evenly down to 0 when `forgotten`: for many instances."""
    return np.asarray(weight * np.maximum(0.0, 1.0 - age / forgotten))


def word_stream(seed: Sequence[int], key: Sequence[int]) -> np.random.Generator:
    """By which one word of a text varies, told by its letters, the word before it, and how many such pairs were before.

    So a text that is changed in one place is varied as it was in all others.  Source: own method.

    seed : of what varies, drawn from the generator of the text; key : see `Choice`.
    """
    return np.random.default_rng([*seed, *key])


def glyph_chances(seed: int, place: int, kind: Indices) -> Array:
    """(k,) uniform from 0 to 1: the chances of some kinds of glyphs for one letter of a word, each by itself.

    seed : of the word, 64 bits.

    Source: the finalizer of SplitMix64 (Steele, Lea & Flood 2014, Fast splittable pseudorandom number generators).
    """
    word, letter = np.array([[seed], [place]], dtype=np.uint64)
    bits = word + kind.astype(np.uint64) * _ODD[0] + letter * _ODD[1]
    for shift, factor in zip((30, 27), _FACTORS, strict=True):
        bits = (bits ^ (bits >> np.uint64(shift))) * factor
    return np.asarray(((bits ^ (bits >> np.uint64(31))).astype(np.float64) + 0.5) / 2.0**64)


# 2^64 / golden ratio, as there, and 2^64 / plastic number, which part glyphs and places; then the factors of there
_ODD = np.array([0x9E3779B97F4A7C15, 0xC13FA9A902A6328F], dtype=np.uint64)
_FACTORS = np.array([0xBF58476D1CE4E5B9, 0x94D049BB133111EB], dtype=np.uint64)


@dataclass(frozen=True)
class Rewrites:
    """Words of a text that are written again while all others stay as they are.

    times : (place of its first letter in the text, how many times), each word once.
    """

    times: tuple[tuple[int, int], ...] = ()

    def of(self, at: int) -> int:
        """How many times the word that begins there is written again."""
        return dict(self.times).get(at, 0)


NO_REWRITES = Rewrites()


@dataclass(frozen=True, eq=False)
class Candidates:
    """Glyphs that may stand in one place.

    numbers : (k,) int.
    cost : (k,) float.
    """

    numbers: Indices
    cost: Array


class GlyphStock(Protocol):
    """The glyphs of a hand, told apart by numbers, and what choosing among them costs.

    chance : scale of the perturbation at variation 1.
    twice : cost of a glyph that comes again in one word, by which the word is chosen anew; 0: it may.
    kind : (n,) int: as what each glyph is remembered and has its chance, in every text the same; `candidates` may add
        glyphs behind.
    """

    @property
    def chance(self) -> float: ...
    @property
    def twice(self) -> float: ...
    @property
    def kind(self) -> Indices: ...
    def candidates(self, letters: Sequence[Letter], seed: int | None) -> list[Candidates]:
        """The glyphs for each letter of a word, by `glyph_chances` of a seed; where it is None always the same."""

    def steps(self, first: Indices, second: Indices, *, varied: bool) -> Array:
        """(k, l): costs of each of `first` right before each of `second`."""

    def between_words(self, last: int, first: Indices, *, parted: bool) -> Array:
        """(k,): costs of beginning a word after the glyph `last`, with or without a space between."""

    def ending(self, last: Indices) -> Array:
        """(k,): costs of ending a word."""

    def repetition(self, age: Array) -> Array:
        """(k,): costs of writing what was last written `age` letters ago, inf: long ago or never."""


@dataclass(frozen=True, eq=False)
class Choice:
    """A word with the glyphs that write it, and what they were chosen from.

    spaces : before it.
    first : how many glyphs its chooser had written before it.
    key : by which it varies: the word before it and its letters, and how many such pairs its chooser had written.
    numbers : (n,) int: its glyphs.
    candidates, chance, again : n, of each letter; what chance, and having been written before, added to the costs (k,).
    intended : the word that was to be written, where this one is struck out.
    formula : of which it is a leaf.
    """

    letters: Sequence[Letter]
    spaces: int
    first: int
    key: tuple[int, ...]
    numbers: Indices
    candidates: Sequence[Candidates]
    chance: Sequence[Array]
    again: Sequence[Array]
    intended: str | None = None
    formula: FormulaLetters | None = None


class GlyphChooser:
    """Chooses the glyphs of one text, word by word; remembers what it used.

    variation : 0: the glyphs that go together best, always the same.  1: as the author varies.
    """

    def __init__(self, stock: GlyphStock, rng: np.random.Generator, variation: float = 1.0) -> None:
        self._stock, self._variation = stock, variation
        self._seeds = rng.integers(2**63, size=(2, 2)).tolist()
        self._words, self._known, self._written = [""], Counter[tuple[str, str]](), array("q")

    def state(self) -> tuple[GlyphChooser, int, int]:
        """See `kept_text.Resumable`; the next word only adds to what is written."""
        return self, len(self._words), len(self._written)

    def resume(self, state: tuple[GlyphChooser, int, int]) -> None:
        """See there."""
        other, words, glyphs = state
        self._words, self._written = other._words[:words], other._written[:glyphs]
        self._known = Counter(pairwise(self._words))

    def word(self, letters: Sequence[Letter], spaces: int = 1, intended: str | None = None) -> Choice:
        """The glyphs for the letters of one word (with its punctuation), `spaces` after the one before."""
        stock, first, varied = self._stock, len(self._written), self._variation > 0
        pair = self._words[-1], "".join(part for letter in letters for part in (letter.base, *letter.marks))
        key = (self._known[pair], *" ".join(pair).encode())
        self._known[pair] += 1
        self._words.append(pair[1])
        seed = int(word_stream(self._seeds[0], key).integers(2**63))
        candidates = stock.candidates(letters, seed if varied else None)
        numbers = [each.numbers for each in candidates]
        again = [np.zeros(len(each)) for each in numbers]
        if varied:
            written = stock.kind[np.array(self._written[-_REMEMBERED:], dtype=np.intp)]
            for i, each in enumerate(numbers):
                ages = np.where(stock.kind[each][:, None] == written, np.arange(len(written), 0, -1) + i, np.inf)
                again[i] = stock.repetition(ages.min(axis=1, initial=np.inf))
        chance = self._chance(seed, candidates)
        choice = Choice(letters, spaces, first, key, np.zeros(0, dtype=np.intp), candidates, chance, again, intended)
        choice = self._chosen(choice)
        self._written.extend(choice.numbers.tolist())
        return choice

    def again(self, choice: Choice, prices: Prices) -> Choice:
        """Other glyphs for a word, at some prices; what was written behind it is not looked at."""
        return self._chosen(choice, prices)

    def other(self, choice: Choice, times: int) -> Choice:
        """Other glyphs for a word by other chances, so many times over; what was written is not told of it.

        A glyph that was taken before has to be better than the others by more than chance often makes out.
        """
        prices, price = dict[tuple[int, int], float](), _TAKEN * self._stock.chance
        rng = word_stream(self._seeds[1], choice.key)
        for _ in range(times):
            prices |= {
                (letter.at, number): price
                for letter, number in zip(choice.letters, choice.numbers.tolist(), strict=True)
            }
            chance = self._chance(int(rng.integers(2**63)), choice.candidates)
            choice = self.again(replace(choice, chance=chance), prices)
        return choice

    def keep(self, choice: Choice) -> None:
        """Write a word with the glyphs that `again` found for it."""
        self._written[choice.first : choice.first + len(choice.numbers)] = array("q", choice.numbers.tolist())

    def _chance(self, seed: int, candidates: Sequence[Candidates]) -> list[Array]:
        """What chance adds to the costs of each letter's glyphs: less a Gumbel variable, times its scale."""
        scale, kind = self._variation * self._stock.chance, self._stock.kind
        return [
            scale * np.log(-np.log(glyph_chances(seed, place, kind[each.numbers])))
            for place, each in enumerate(candidates)
        ]

    def _chosen(self, choice: Choice, prices: Prices = _FREE) -> Choice:
        """A word with the glyphs that are cheapest by all that it was told."""
        stock, numbers = self._stock, [each.numbers for each in choice.candidates]
        unary = [each.cost + more for each, more in zip(choice.candidates, choice.chance, strict=True)]
        if choice.first:
            before = self._written[choice.first - 1]
            unary[0] = unary[0] + stock.between_words(before, numbers[0], parted=choice.spaces > 0)
        unary[-1] = unary[-1] + stock.ending(numbers[-1])
        for i, letter in enumerate(choice.letters if prices else ()):
            unary[i] = unary[i] + [prices.get((letter.at, number), 0.0) for number in numbers[i].tolist()]
        steps = [stock.steps(one, other, varied=self._variation > 0) for one, other in pairwise(numbers)]
        again = [+each for each in choice.again]
        return replace(choice, numbers=self._cheapest(numbers, unary, again, steps), again=again)

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


def choices(paragraphs: Iterable[Sequence[Piece]], choosers: Sequence[GlyphChooser]) -> Iterator[Iterator[Choice]]:
    """The words of a text with their glyphs, paragraph after paragraph, each chosen when it is asked for.

    choosers : that of the text, and that of the words in it that are struck out.
    """
    return (choose_words(pieces, choosers) for pieces in paragraphs)


def choose_words(pieces: Sequence[Piece], choosers: Sequence[GlyphChooser]) -> Iterator[Choice]:
    """The words of a paragraph, or of a part of it, with their glyphs, each chosen when it is asked for."""
    spaces = 0
    for piece in pieces:
        if isinstance(piece, int):
            spaces = piece
        elif isinstance(piece, FormulaLetters):
            for word in piece.words:  # each by itself: what stands beside it there is not decided yet
                yield replace(choosers[0].word(word, spaces), formula=piece)
                spaces = 1
            spaces = 0
        else:
            intended = piece.intended if isinstance(piece, StruckLetters) else None
            yield choosers[intended is not None].word(piece, spaces, intended)
            spaces = 0
