"""The reader of pictures that has learnt an author's words, and how oddly single glyphs read to it.

A glyph is read alone, as a word of one letter.  Some letters read badly alone in some hands (an r is a v there), so
what tells is how much worse a glyph reads than others of its letter: its strangeness.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from handout.hand.learnt import learnt
from handout.hand.scanned import ScannedHand
from handout.hand.word_pictures import OwnWord, own_words, picture_of_vertices
from handout.reading import pictures
from handout.reading.adaptation import adapted
from handout.reading.pictures import Reader as Reader
from handout.reading.pictures import log_probabilities
from handout.values import Array

VERSION = 1  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
OWN_WORDS = 100  # of an author that are learnt; half a second
_DIGITS = 4  # of a weight after the point, as it is kept


@dataclass(frozen=True)
class StrangenessSettings:
    """Chosen on three people's pages (csafe w0154 w0076 w0394), a seventh of whose letters was spoilt on purpose.

    most : surprise of a glyph, nats, beyond which it makes no difference.
    kin : glyphs of any letter that count as siblings of each.
    rare : glyphs of a small letter up to which none of them may be read by others; odd : nats beyond which it is not.
        Of 38 such letters of ten people the best glyph of 33 has at most 2.5, of the others (a k like bs, an x like y,
        a z, a q and a j) 3.8 and more.
    """

    most: float = 6.0
    kin: float = 2.0
    rare: int = 2
    odd: float = 3.0


SETTINGS = StrangenessSettings()


def readable(word: str) -> bool:
    """Whether the reader knows all letters of a word."""
    return bool(word) and pictures.known(word)


def readable_words(hand: ScannedHand) -> list[OwnWord]:
    """The words that are learnt of a hand's author."""
    return [word for word in own_words(hand) if readable(word.text)][:OWN_WORDS]


@lru_cache(maxsize=4)
def author_reader(hand: ScannedHand) -> Reader:
    """The reader that knows a hand."""
    weights = learnt(hand, "author's reader", VERSION, None, lambda: _weights(hand))
    return pictures.load().with_last_layer(np.array(weights)) if len(weights) else pictures.load()


def _weights(hand: ScannedHand) -> Array:
    """Of the reader's last layer; none where there is nothing to learn from."""
    reader, words = pictures.load(), readable_words(hand)
    if not words:
        return np.zeros(0)
    seen = reader.features_of([word.picture for word in words])
    weights = np.vstack(adapted(reader, seen, [word.text for word in words]).columns[-1])
    return np.asarray(np.round(weights.ravel().astype(np.float64), _DIGITS))


def reads_alone(letter: str) -> bool:
    """Whether a letter is read alone: marks are not, which look like specks."""
    return letter.isalnum() and readable(letter)


def surprises(reader: Reader, pictures: Sequence[Array], letters: Sequence[str]) -> Array:
    """(n,) nats, at least 0: how little glyphs read as letters that `reads_alone`, given their pictures."""
    if not letters:
        return np.zeros(0)
    return np.clip(-log_probabilities(reader.read_all(pictures), letters), 0.0, SETTINGS.most)


def usual_surprise(surprises: Array, letters: Sequence[str], alone: NDArray[np.bool_]) -> Array:
    """(n,): how surprising other glyphs of each one's letter are; those that are not read `alone` (n,) have none."""
    names, of = np.unique(np.array(letters, dtype=str), return_inverse=True)
    total, count = (np.bincount(of, weights, len(names))[of] for weights in (surprises * alone, alone))
    middle = float(surprises[alone].mean()) if alone.any() else 0.0
    rest = np.maximum(count - 1, 0) + SETTINGS.kin
    return np.where(alone, (total - surprises + SETTINGS.kin * middle) / rest, 0.0)


def strangeness(hand: ScannedHand) -> Array:
    """(n,) nats: how much worse each glyph reads alone than others of its letter; 0 for what is not read alone."""
    reader = author_reader(hand)
    letters = [glyph.letter for glyph in hand.glyphs]
    alone = np.array([reads_alone(letter) for letter in letters], dtype=bool)
    glyphs = [hand.glyphs[number] for number in np.flatnonzero(alone).tolist()]
    seen = [picture_of_vertices(hand.pages[glyph.page], glyph.line, glyph.vertices) for glyph in glyphs]
    strange = np.zeros(len(letters))
    strange[alone] = surprises(reader, seen, [glyph.letter for glyph in glyphs])
    return strange - usual_surprise(strange, letters, alone)


def misread(hand: ScannedHand) -> NDArray[np.bool_]:
    """(n,): glyphs of rare small letters that read as something else to whoever does not know the author."""
    odd = np.zeros(len(hand.glyphs), dtype=bool)
    for letter in hand.letters:
        numbers = hand.of(letter)
        if not (letter.islower() and reads_alone(letter) and len(numbers) <= SETTINGS.rare):
            continue
        glyphs = [hand.glyphs[number] for number in numbers.tolist()]
        seen = [picture_of_vertices(hand.pages[glyph.page], glyph.line, glyph.vertices) for glyph in glyphs]
        odd[numbers] = surprises(pictures.load(), seen, [letter] * len(glyphs)) > SETTINGS.odd
    return odd
