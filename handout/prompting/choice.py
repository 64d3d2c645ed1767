"""Which sentences to ask for: greedily those that add most to what the author has written already.

Source: seed 000, §4.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from handout.prompting import counts
from handout.prompting.counts import Frequencies, Table
from handout.values import Array

Score = Literal["gain", "haines-2016"]

_LETTERS = 32.0  # what a letter counts against a pair
_DAMPED = 10  # words below which a sentence is held back


@dataclass(eq=False)
class Chooser:
    """Sentences, and how much each of them would add to those taken so far.

    Parameters
    ----------
    sentences : sequence of str
        To choose from.
    target : Frequencies
        Of the text that will be wanted.
    score : {"gain", "haines-2016"}
        The gain per word, or the cost as it is printed (negated), which prefers the shortest sentences.
    """

    sentences: Sequence[str]
    target: Frequencies
    score: Score = "gain"
    letters: Table = field(init=False)
    pairs: Table = field(init=False)
    words: Array = field(init=False)
    free: NDArray[np.bool_] = field(init=False)
    _letters_taken: Array = field(init=False)
    _pairs_taken: Array = field(init=False)

    def __post_init__(self) -> None:
        self.letters = counts.table([counts.letters(s) for s in self.sentences], self.target.letters)
        self.pairs = counts.table([counts.pairs(s) for s in self.sentences], self.target.pairs)
        self.words = np.array([len(s.split()) for s in self.sentences], dtype=np.float64)
        self.free = np.ones(len(self.sentences), dtype=bool)
        self._letters_taken = np.zeros(len(self.letters.units))
        self._pairs_taken = np.zeros(len(self.pairs.units))

    def scores(self) -> Array:
        """(n,) float: of every sentence, the higher the better; −∞ for those taken."""
        if self.score == "gain":
            found = gain(self.letters, self.pairs, self.words, self._letters_taken, self._pairs_taken)
        else:
            found = -cost_haines_2016(self.letters, self.pairs, self._letters_taken, self._pairs_taken)
        return np.where(self.free, found, -np.inf)

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


def gain(letters: Table, pairs: Table, words: Array, letters_taken: Array, pairs_taken: Array) -> Array:
    """What each sentence adds per word, (n,) float.

    ``[32 Σ n Pr / (1 + F²) + Σ n Pr / (1 + F²)] / words``, over letters and over pairs; sentences under ten words are
    damped by ``(1 + 2 words / 10) / 3``, since the value of a word is easily high in very short ones.

    Source: seed 000, §4.1, as the authors' program has it.
    """
    total = _LETTERS * (letters.counts @ (letters.frequency / (1 + letters_taken**2)))
    total = total + pairs.counts @ (pairs.frequency / (1 + pairs_taken**2))
    damping = np.minimum((1 + 2 * words / _DAMPED) / 3, 1.0)
    return np.asarray(total / words * damping)


def cost_haines_2016(letters: Table, pairs: Table, letters_taken: Array, pairs_taken: Array) -> Array:
    """The cost of each sentence as it is printed, (n,) float: ``Σ (1 + F²) / Pr + ω Σ (1 + F²) / Pr``, ω = 1/32.

    Here a letter that is wanted often costs little and every letter costs something, so the least total belongs to
    the shortest sentence. For comparison only.

    Source: seed 000, §4.1 (Haines, Mac Aodha, Brostow 2016).
    """
    single = letters.counts @ ((1 + letters_taken**2) / letters.frequency)
    return np.asarray(single + pairs.counts @ ((1 + pairs_taken**2) / pairs.frequency) / _LETTERS)


def pangrams(sentences: Sequence[str], alphabet: str = "abcdefghijklmnopqrstuvwxyz") -> list[int]:
    """Indices of the sentences that have every letter of the alphabet, large or small."""
    every = frozenset(alphabet)
    return [i for i, sentence in enumerate(sentences) if every.issubset(sentence.lower())]
