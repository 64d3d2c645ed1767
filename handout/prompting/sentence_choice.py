"""Chooses the sentences of a prompt: greedily those that add most to the letters and pairs of letters chosen so far.

Letters and pairs are counted in every sentence, and weighed by how often they occur in the text that will be wanted.

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

from handout.prompting.coverage import COMMONEST, LEAST
from handout.values import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from handout.hand.scanned import ScannedHand

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
    from scipy.sparse import csr_array

    units = tuple(sorted(frequency))
    column = {unit: i for i, unit in enumerate(units)}
    entries = [(row, column[u], n) for row, count in enumerate(counted) for u, n in count.items() if u in column]
    rows, columns, values = np.array(entries, dtype=np.float64).reshape(-1, 3).T
    place = (rows.astype(np.intp), columns.astype(np.intp))
    matrix = csr_array((values, place), shape=(len(counted), len(units)))
    return CountTable(units, matrix, np.array([frequency[unit] for unit in units], dtype=np.float64))


@dataclass(eq=False)
class SentenceChooser:
    """Sentences, and how much each of them would add to those taken so far.

    Parameters
    ----------
    sentences : sequence of str
        To choose from.
    target : Frequencies
        Of the text that will be wanted.
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

    Parameters
    ----------
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
