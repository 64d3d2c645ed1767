"""How probably a person misreads each letter of a word that was written, by what readers of pictures see there.

A reader that learnt what writers meant forgives more than a person who spells a word letter by letter.  So words that
were made in the hands of several writers were read by strangers, and a logistic regression says what three figures mean
of a letter: how often its glyph is taken for another in other words, how often glyphs of its letter are in this hand,
and how probably it is another here.  A word is misread where one of its letters is.

Source: own method; the weights are those that `handout_lab.training.misread_words` finds.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import msgspec
import numpy as np

from handout.reading.pictures import PictureReading, letter_shares
from handout.values import Array

WEIGHTS = Path(__file__).parent / "networks" / "misreading.toml"
_LEAST = 0.01  # share of misreadings: a few words do not tell one in a hundred from none


class MisreadWeights(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What log odds count: of the glyph in other words, of its letter, and of the place, as each reader sees it.

    told : probability above which a word is told of: 2 of 100 that were read right had more.
    again : above which it is written again: a tenth had more.
    """

    constant: float
    glyph: float
    letter: float
    seen: tuple[float, ...]
    told: float
    again: float

    def before(self, of_glyph: Array, of_letter: Array) -> Array:
        """(n,) log odds that letters are misread, before they are read in their places, by shares of misreadings."""
        return self.constant + self.glyph * odds(of_glyph) + self.letter * odds(of_letter)

    def misread(self, before: Array, seen: Array) -> Array:
        """(n,) 0–1: how probably letters are misread, after that, by what each reader saw (readers, n)."""
        return np.asarray(1 / (1 + np.exp(-before - np.array(self.seen) @ odds(seen))))


@lru_cache(maxsize=2)
def load(readers: int) -> MisreadWeights:
    """The weights for so many readers, one or two."""
    return msgspec.toml.decode(WEIGHTS.read_bytes(), type=dict[str, MisreadWeights])["one" if readers == 1 else "two"]


def odds(shares: Array) -> Array:
    """Log odds of shares, none of which is taken for never or always."""
    kept = np.clip(shares, _LEAST, 1 - _LEAST)
    return np.asarray(np.log(kept / (1 - kept)))


def shares_seen(readings: Sequence[PictureReading], words: Sequence[str]) -> list[Array]:
    """(letters,) 0–1 of each word: how probably each of its letters is another, by what a reader sees.

    Of a picture that is too narrow for its word, which is not read letter by letter, all are an even chance.
    """
    labels = [reading.labels(word) for reading, word in zip(readings, words, strict=True)]
    shares = letter_shares(readings, labels)
    right = [share[np.arange(len(own)), own] for share, own in zip(shares, labels, strict=True)]
    return [np.where(np.isnan(share), 0.5, 1.0 - share) for share in right]
