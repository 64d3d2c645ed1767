"""The scribe of a drawn hand: words written one after the other, each with the gap before it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, islice

import numpy as np

from handout.values import Hand, Placed
from handout.writing.lining import HOUSE
from handout.writing.marks import DOTLESS
from handout.writing.pieces import Piece
from handout.writing.scribe import ToPage, Unit
from handout.writing.slips import Struck
from handout.writing.text import Repertoire
from handout.writing.variation import USUAL
from handout.writing.words import Word, Writer

_MOST_SPACES = 12


def repertoire(hand: Hand) -> Repertoire:
    """What a drawn hand can write."""
    return Repertoire(hand.name, frozenset(hand.glyphs), frozenset(hand.marks) | {DOTLESS})


class DrawnScribe:
    """Writes one text in a drawn hand; see `scribe.Scribe`.

    Parameters
    ----------
    hand : Hand
    rng : numpy.random.Generator
    jitter : float
        Scale of all variation.
    """

    def __init__(self, hand: Hand, rng: np.random.Generator, jitter: float) -> None:
        self._hand, self._rng, self._jitter = hand, rng, jitter
        self.name, self.pitch, self.repertoire = hand.name, hand.pitch, repertoire(hand)
        self.lining = HOUSE

    def paragraphs(self, pieces: Iterable[Sequence[Piece]]) -> Iterator[tuple[float, Iterator[Unit[Word]]]]:
        """(indent, units) of one paragraph after the other.

        A word is written when it is asked for, once, whatever the lines will be.
        """
        # what is struck out has a stream of its own: all else stays as it is without
        streams = self._rng, self._rng.spawn(1)[0]
        writers = [Writer(self._hand, rng, self._jitter) for rng in streams]
        return (self._paragraph(writers, paragraph) for paragraph in pieces)

    def _paragraph(self, writers: Sequence[Writer], pieces: Sequence[Piece]) -> tuple[float, Iterator[Unit[Word]]]:
        units = self._units(writers, pieces)
        first = list(islice(units, 1))
        return (first[0].gap if first else 0.0), chain(first, units)

    def _units(self, writers: Sequence[Writer], pieces: Sequence[Piece]) -> Iterator[Unit[Word]]:
        spaces = 0
        for piece in pieces:
            if isinstance(piece, int):
                spaces = piece
                continue
            writer = writers[isinstance(piece, Struck)]
            word = writer.word(piece)
            yield Unit(word, self._gap(spaces, writer.rng))
            spaces = 0

    def _gap(self, spaces: int, rng: np.random.Generator) -> float:
        if not spaces:
            return 0.0
        usual = self._hand.word_space
        wide = usual * (1 + 0.75 * (min(spaces, _MOST_SPACES) - 1))
        # a writer has one habit of spacing: neither a closed gap nor one that reads as two
        slack = rng.normal(0.0, USUAL.word_gap * self._jitter)
        return wide + min(max(slack, -0.28 * usual), 0.5 * usual)

    def place(self, words: Sequence[Word], starts: Sequence[float], scale: float, to_page: ToPage) -> Iterator[Placed]:
        """The glyphs of a line, their points on the page."""
        for number, (word, start) in enumerate(zip(words, starts, strict=True)):
            for glyph, strokes, join, at in zip(word.glyphs, word.strokes, word.joins, word.at, strict=True):
                yield Placed(glyph, tuple(to_page(s * scale + (start, 0.0)) for s in strokes), join, number, at)
