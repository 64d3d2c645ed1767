"""Chooses the sentences of a prompt: greedily those that add most to the letters and pairs of letters chosen so far.

Letters and pairs are counted in every sentence, and weighed by how often they occur in the text that will be wanted.

What a prompt gives, or a hand has, is told by place in words (`measure_coverage`, `lacks`): a word is there a run of
letters, or of digits, for a comma or a quotation mark does not change how the letter beside it is written.  Every other
character stands alone.

`frequencies_again` says what a hand lacks: letters with few sure glyphs, and common pairs that it has not.

Source: seed 000, §4.1, §6.2.1; what is written again: own method.
"""

from __future__ import annotations

import string
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from handout.libraries import sparse
from handout.values import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from handout.hand.scanned import ScannedHand
from typing import Any

from handout.hand.places import PLACES, Place, graphemes, place, runs
from handout.prompting import corpus

LEAST = 8  # instances that let the choice of glyphs vary
COMMONEST = 200  # pairs that are reported

Instances = Counter[tuple[str, Place]]


def letters_by_place(texts: Iterable[str]) -> Instances:
    """How often each letter (a grapheme) stands in each place."""
    instances: Instances = Counter()
    for run in _runs(texts):
        instances.update(zip(run, _places(len(run), 1), strict=True))
    return instances


def pairs_by_place(texts: Iterable[str]) -> Instances:
    """How often each pair of letters or digits within a word stands in each place."""
    instances: Instances = Counter()
    for run in _runs(texts):
        pairs_of_run = [a + b for a, b in pairwise(run)]
        instances.update(zip(pairs_of_run, _places(len(run), 2), strict=True))
    return instances


def _runs(texts: Iterable[str]) -> Iterable[list[str]]:
    for text in texts:
        units = graphemes(text)
        for run in runs(units):
            yield units[run.start : run.stop]


def _places(length: int, unit: int) -> list[Place]:
    """The places of the units of that size in a run of that length."""
    count = max(length - unit + 1, 0)
    return [place(i, count) for i in range(count)]


@dataclass(frozen=True)
class CoverageRow:
    """A letter or pair: its share of all in the target, and its instances by place."""

    unit: str
    share: float
    start: int
    middle: int
    end: int
    alone: int

    @property
    def total(self) -> int:
        """Instances in all places."""
        return self.start + self.middle + self.end + self.alone


@dataclass(frozen=True)
class Coverage:
    """What a prompt gives: a row for every letter and for the commonest pairs of the target, the commonest first."""

    letters: tuple[CoverageRow, ...]
    pairs: tuple[CoverageRow, ...]
    least: int = LEAST

    @property
    def short_letters(self) -> tuple[CoverageRow, ...]:
        """Letters with fewer instances than `least`."""
        return tuple(row for row in self.letters if row.total < self.least)

    @property
    def short_pairs(self) -> tuple[CoverageRow, ...]:
        """Pairs with fewer instances than `least`."""
        return tuple(row for row in self.pairs if row.total < self.least)

    def as_json(self) -> dict[str, Any]:
        """Plain lists and numbers, for `--json`."""
        return {
            "least": self.least,
            "letters": [_plain(row) for row in self.letters],
            "pairs": [_plain(row) for row in self.pairs],
            "short_letters": [row.unit for row in self.short_letters],
            "short_pairs": [row.unit for row in self.short_pairs],
        }

    def table(self) -> str:
        """The letters and pairs as plain text; * marks what stays below the least number."""
        head = f"{'':2}{'':8}{'share':>7}{'start':>7}{'middle':>7}{'end':>7}{'alone':>7}{'total':>7}"
        lines = ["Letters", head, *(self._line(row) for row in self.letters)]
        lines += ["", f"The {len(self.pairs)} commonest pairs", head, *(self._line(row) for row in self.pairs)]
        return "\n".join(lines)

    def summary(self) -> str:
        """What stays below the least number, in two lines."""
        named = (("letters", self.short_letters, self.letters), ("pairs", self.short_pairs, self.pairs))
        return "\n".join(
            f"{len(short)} of {len(every)} {name} fewer than {self.least} times"
            + (": " + " ".join(f"{row.unit}({row.total})" for row in short) if short else ".")
            for name, short, every in named
        )

    def short(self) -> str:
        """How many letters and pairs stay below the least number, in a few words."""
        letters, pairs = (
            f"{len(self.short_letters)} of {len(self.letters)}",
            f"{len(self.short_pairs)} of {len(self.pairs)}",
        )
        return f"{letters} letters and {pairs} common pairs will be there"

    def _line(self, row: CoverageRow) -> str:
        mark = "*" if row.total < self.least else " "
        counts = "".join(f"{n:7d}" for n in (row.start, row.middle, row.end, row.alone, row.total))
        return f"{mark} {row.unit:<8}{row.share:7.2%}{counts}"


def _plain(row: CoverageRow) -> dict[str, Any]:
    places: dict[str, int] = {place: getattr(row, place) for place in PLACES}
    return {"unit": row.unit, "share": round(row.share, 6), **places, "total": row.total}


def measure_coverage(written: Iterable[str], target: Iterable[str], characters: str = "") -> Coverage:
    """What the texts `written` give towards the texts `target`.

    written, target : what the author copies; what will be wanted later.
    characters : reported even if the target has none of them.
    """
    written, target = list(written), list(target)
    asked_for = {char: 0 for char in characters if not char.isspace()}
    single, double = _shares(letters_by_place(target)), _shares(pairs_by_place(target))
    commonest = dict(sorted(double.items(), key=lambda item: (-item[1], item[0]))[:COMMONEST])
    return Coverage(
        _rows({**asked_for, **single}, letters_by_place(written)), _rows(commonest, pairs_by_place(written))
    )


def _shares(instances: Instances) -> dict[str, float]:
    summed: Counter[str] = Counter()
    for (unit, _), count in instances.items():
        summed[unit] += count
    return {unit: count / summed.total() for unit, count in summed.items()}


def _rows(shares: Mapping[str, float], instances: Instances) -> tuple[CoverageRow, ...]:
    ordered = sorted(shares.items(), key=lambda item: (-item[1], item[0]))
    return tuple(CoverageRow(unit, share, *(instances[unit, place] for place in PLACES)) for unit, share in ordered)


@dataclass(frozen=True)
class Lack:
    """A letter of which a text needs more in some place than there are: needed, there in that place, and in all."""

    letter: str
    place: Place
    needed: int
    here: int
    anywhere: int


def lacks(text: str, have: Mapping[tuple[str, Place], int], *, least: int = LEAST) -> tuple[Lack, ...]:
    """What is missing to write a text: letters that have, in the place where it needs them, too few instances.

    text : what is to be written.
    have : (letter, place) → instances; what `letters_by_place` counts in a prompt, or the glyphs of a hand.
    least : A letter that is needed more rarely than this needs only so many instances.

    Returns those of which there is none at all first, then the most needed.
    """
    needed = letters_by_place([corpus.as_typed(text)])
    every: Counter[str] = Counter()
    for (letter, _), count in have.items():
        every[letter] += count
    short = [
        Lack(letter, place, count, have.get((letter, place), 0), every[letter])
        for (letter, place), count in needed.items()
        if have.get((letter, place), 0) < min(least, count)
    ]
    return tuple(sorted(short, key=lambda lack: (lack.anywhere > 0, lack.here - lack.needed, lack.letter, lack.place)))


_LETTERS = 32.0  # what a letter counts against a pair
_DAMPED = 10  # words below which a sentence is held back


def letter_counts(text: str) -> Counter[str]:
    """Characters of the text, spaces left out."""
    return Counter(char for char in text if not char.isspace())


def pair_counts(text: str) -> Counter[str]:
    """Characters that follow one another within a word."""
    return Counter(a + b for word in text.split() for a, b in pairwise(word))


@dataclass(frozen=True)
class Frequencies:
    """Of letters and of pairs in the text that the author will want written; the commonest of each is 1."""

    letters: Mapping[str, float]
    pairs: Mapping[str, float]


def frequencies(texts: Iterable[str]) -> Frequencies:
    """Frequencies in some texts, scaled so that the commonest letter and the commonest pair are 1."""
    single: Counter[str] = Counter()
    double: Counter[str] = Counter()
    for text in texts:
        single.update(letter_counts(text))
        double.update(pair_counts(text))
    return Frequencies(_scale_counts(single), _scale_counts(double))


def _scale_counts(counts: Counter[str]) -> dict[str, float]:
    most = max(counts.values(), default=1)
    return {key: count / most for key, count in counts.items()}


@dataclass(frozen=True, eq=False)
class CountTable:
    """Counts of every unit (letter or pair) in every sentence.

    units : the letters or pairs that have a frequency in the target, one a column.
    counts : (sentences, units) sparse float.
    frequency : (units,) of the target.
    """

    units: tuple[str, ...]
    counts: csr_array
    frequency: Array


def count_table(counted: Sequence[Counter[str]], frequency: Mapping[str, float]) -> CountTable:
    """The matrix of counts; units that the target lacks are worth nothing and left out."""
    units = tuple(sorted(frequency))
    column = {unit: i for i, unit in enumerate(units)}
    entries = [(row, column[u], n) for row, count in enumerate(counted) for u, n in count.items() if u in column]
    rows, columns, values = np.array(entries, dtype=np.float64).reshape(-1, 3).T
    place = (rows.astype(np.intp), columns.astype(np.intp))
    matrix = sparse.csr_array((values, place), shape=(len(counted), len(units)))
    return CountTable(units, matrix, np.array([frequency[unit] for unit in units], dtype=np.float64))


@dataclass(eq=False)
class SentenceChooser:
    """Sentences, and how much each of them would add to those taken so far.

    sentences : to choose from.
    target : of the text that will be wanted.
    """

    sentences: Sequence[str]
    target: Frequencies
    letters: CountTable = field(init=False)
    pairs: CountTable = field(init=False)
    words: Array = field(init=False)
    free: NDArray[np.bool_] = field(init=False)
    _letters_taken: Array = field(init=False)
    _pairs_taken: Array = field(init=False)

    def __post_init__(self) -> None:
        self.letters = count_table([letter_counts(s) for s in self.sentences], self.target.letters)
        self.pairs = count_table([pair_counts(s) for s in self.sentences], self.target.pairs)
        self.words = np.array([len(s.split()) for s in self.sentences], dtype=np.float64)
        self.free = np.ones(len(self.sentences), dtype=bool)
        self._letters_taken = np.zeros(len(self.letters.units))
        self._pairs_taken = np.zeros(len(self.pairs.units))

    def scores(self) -> Array:
        """(n,) float: of every sentence, the higher the better; −∞ for those taken."""
        scores = gain(self.letters, self.pairs, self.words, self._letters_taken, self._pairs_taken)
        return np.where(self.free, scores, -np.inf)

    def best(self) -> NDArray[np.intp]:
        """Indices of the free sentences, the best first; of equals the earlier one."""
        scores = self.scores()
        order = np.argsort(-scores, kind="stable")
        return order[: int(self.free.sum())]

    def take(self, index: int) -> str:
        """Count the sentence as written, and return it."""
        self.free[index] = False
        self._letters_taken += self.letters.counts[[index]].toarray()[0]
        self._pairs_taken += self.pairs.counts[[index]].toarray()[0]
        return self.sentences[index]


def gain(letters: CountTable, pairs: CountTable, words: Array, letters_taken: Array, pairs_taken: Array) -> Array:
    """What each sentence adds per word, (n,) float.

    ``[32 Σ n Pr / (1 + F²) + Σ n Pr / (1 + F²)] / words``, over letters and over pairs; sentences under ten words are
    damped by ``(1 + 2 words / 10) / 3``, since the value of a word is easily high in very short ones.

    Source: seed 000, §4.1, as the authors' program has it.
    """
    total = _LETTERS * (letters.counts @ (letters.frequency / (1 + letters_taken**2)))
    total = total + pairs.counts @ (pairs.frequency / (1 + pairs_taken**2))
    damping = np.minimum((1 + 2 * words / _DAMPED) / 3, 1.0)
    return np.asarray(total / words * damping)


def pangrams(sentences: Sequence[str]) -> list[int]:
    """Indices of the sentences that have every letter of the alphabet, large or small."""
    every = frozenset(string.ascii_lowercase)
    return [i for i, sentence in enumerate(sentences) if every.issubset(sentence.lower())]


class Closing:
    """Finds few words with all of some characters."""

    def __init__(self, sentences: Sequence[str]) -> None:
        self._held = [(sentence, frozenset(sentence), len(sentence.split())) for sentence in sentences]

    def sentences(self, missing: Collection[str], chosen: Collection[str] = ()) -> list[str]:
        """Sentences that hold every missing character, greedily those with most of them a word.

        What no sentence has stands alone at the end (see `bare`).
        """
        left, choice = set(missing), list[str]()
        while left:
            worth = [
                (len(left & held) / (words + 1), -i)
                for i, (sentence, held, words) in enumerate(self._held)
                if sentence not in chosen and not left.isdisjoint(held)
            ]
            if not worth:
                return choice + self.bare(left)
            sentence, held, _ = self._held[-max(worth)[1]]
            choice.append(sentence)
            left -= held
        return choice

    @staticmethod
    def bare(missing: Collection[str]) -> list[str]:
        """The characters alone, letters twice, so that one of them begins and one ends a word; nothing for none."""
        return [" ".join(char * 2 if char.isalpha() else char for char in sorted(missing))] if missing else []


def letters_again(sure: Mapping[str, int], wished: str) -> dict[str, float]:
    """Letter → share of `LEAST` sure glyphs that it lacks, of those of `wished` that lack any."""
    letters = dict.fromkeys(char for char in wished if not char.isspace())
    return {letter: 1 - sure.get(letter, 0) / LEAST for letter in letters if sure.get(letter, 0) < LEAST}


def frequencies_again(
    hand: ScannedHand, sure: Mapping[str, int], target: Iterable[str], wished: str
) -> tuple[Frequencies, str]:
    """What sentences for a hand should hold, and the letters that they must.

    A letter counts as much as it lacks; so does a pair, weighed by how common it is in the texts `target`.

    sure : letter → how many of its glyphs are sure.
    wished : the characters that the hand should have.
    """
    wanted = frequencies(target)
    # the pairs of letters that stand side by side in the hand's words
    beside = (
        hand.glyphs[glyph.before].letter + glyph.letter for glyph in hand.glyphs if glyph.before >= 0 and glyph.letter
    )
    lacking, found = letters_again(sure, wished), Counter(beside)
    common = sorted(wanted.pairs.items(), key=lambda item: (-item[1], item[0]))[:COMMONEST]
    pairs = {
        pair: share * (1 - found[pair] / LEAST)
        for pair, share in common
        if found[pair] < LEAST and not lacking.keys().isdisjoint(pair)
    }
    # what texts never have is asked for once, among the characters; sentences are chosen for the rest
    letters = {letter: lack for letter, lack in lacking.items() if letter in wanted.letters}
    return Frequencies(letters, pairs), "".join(lacking)
