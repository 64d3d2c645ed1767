"""The scribe of a scanned hand: glyphs chosen for a whole text, set side by side, and laid on their lines as ink.

Source: seed 000, §6.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from handout.hand.places import places
from handout.hand.scanned import ScannedHand
from handout.values import Glyph, Indices, Ink, LineGraph, Placed
from handout.writing.pieces import Piece, paragraphs_of
from handout.writing.scanned.choosing import choose
from handout.writing.scanned.explaining import Explained, explain
from handout.writing.scanned.lining import lining
from handout.writing.scanned.manner import Manner, manner
from handout.writing.scanned.setting import bent, gaps, heights, set_line
from handout.writing.scanned.settling import settled
from handout.writing.scanned.stock import Stock, stock
from handout.writing.scanned.wanted import Wanted
from handout.writing.scanned.word import ScannedWord
from handout.writing.scribe import ToPage, Unit
from handout.writing.text import Letter, Repertoire, normalise, spell, spelt

_MORE_SPACE = 0.75  # of a space, for every further one
_MOST_SPACES = 12


@lru_cache(maxsize=4)
def _known(hand: ScannedHand) -> tuple[Stock, Manner]:
    """What is worked out once for a hand, however many texts are written in it."""
    return stock(hand), manner(hand)


class ScannedScribe:
    """Writes one text in a scanned hand; see `scribe.Scribe`.

    Parameters
    ----------
    hand : ScannedHand
    rng : numpy.random.Generator
    variation : float
        0: the best glyphs where they fit best; 1: as the author varies.
    """

    def __init__(self, hand: ScannedHand, rng: np.random.Generator, variation: float) -> None:
        self._hand, self._rng, self._variation = hand, rng, variation
        self.stock, self._manner = _known(hand)
        self.name, self.pitch, self.lining = hand.name, hand.pitch, lining(hand)
        self.repertoire = Repertoire(hand.name, frozenset(hand.letters), frozenset())

    def paragraphs(self, pieces: Iterable[Sequence[Piece]]) -> Iterator[tuple[float, Iterator[Unit[ScannedWord]]]]:
        """(indent, units) of one paragraph after the other; the glyphs of the whole text are chosen together."""
        known = list(pieces)
        numbers = choose(self.stock, _wanted(known), self._rng, variation=self._variation)
        count = 0
        for paragraph in known:
            length = sum(len(piece) for piece in paragraph if not isinstance(piece, int))
            indent, units = self._paragraph(paragraph, numbers[count : count + length])
            yield indent, iter(units)
            count += length

    def explained(self, text: str) -> list[Explained]:
        """Which glyphs would write a text, and what else might have."""
        wanted = _wanted(list(paragraphs_of(spell(normalise(text), self.repertoire))))
        return explain(self.stock, wanted, self._rng, variation=self._variation)

    def _paragraph(self, pieces: Sequence[Piece], numbers: Indices) -> tuple[float, list[Unit[ScannedWord]]]:
        words = [(spaces, letters) for spaces, letters in _spaced(pieces) if letters]
        if not words:
            return 0.0, []
        first = np.concatenate([[0], np.cumsum([len(letters) for _, letters in words])])
        starts = np.zeros(len(numbers), dtype=bool)
        starts[first[:-1]] = [spaces > 0 for spaces, _ in words]
        apart = gaps(self._manner, numbers, starts, self._rng, self._variation)
        y = heights(self._manner, numbers, starts, self._rng, self._variation)
        bends = bent(self._manner, numbers, self._rng, self._variation)
        apart = settled(self._manner.spacing, numbers, starts, apart, y, bends) * self.pitch
        x = np.concatenate([[0.0], np.cumsum(apart)])
        extents = x[:, None] + self._manner.reach(numbers, bends) * self.pitch
        usual = self._space()
        units: list[Unit[ScannedWord]] = []
        for (spaces, letters), a, b in zip(words, first, first[1:], strict=False):
            begin = extents[a, 0]
            after = extents[b, 0] - begin if b < len(x) and not starts[b] else float(extents[b - 1, 1] - begin)
            gap = begin - extents[a - 1, 1] if a and spaces else 0.0
            # several spaces are wider than one; a gap of nothing would mean that there is none
            gap = max(gap, 1e-3) + _MORE_SPACE * usual * (min(spaces, _MOST_SPACES) - 1) if spaces else 0.0
            units.append(
                Unit(
                    ScannedWord(
                        numbers[a:b],
                        x[a:b] - begin,
                        y[a:b],
                        tuple(bends[a:b]),
                        extents[a:b] - begin,
                        tuple(letter.at for letter in letters),
                        tuple(spelt(letter) for letter in letters),
                        float(after),
                        glued=bool(a) and not starts[a],
                    ),
                    float(gap),
                )
            )
        indent = _MORE_SPACE * usual * words[0][0] if words[0][0] else 0.0
        return indent, units

    def _space(self) -> float:
        """The usual gap between words, x-heights."""
        return float(self._manner.spacing.gaps.mean[1]) * self.pitch

    def place(
        self, words: Sequence[ScannedWord], starts: Sequence[float], scale: float, to_page: ToPage
    ) -> Iterator[Placed]:
        """The glyphs of a line, their ink on the page."""
        unit = self.pitch * scale  # mm of one unit of line space
        numbers = np.concatenate([word.numbers for word in words])
        x = np.concatenate([start + word.x * scale for word, start in zip(words, starts, strict=True)]) / unit
        parted = _parted(words)
        y, bends = np.concatenate([word.y for word in words]), [bend for word in words for bend in word.bends]
        graphs = set_line(self._manner, numbers, x, y, parted, bends)
        of = [(i, at, letter) for i, word in enumerate(words) for at, letter in zip(word.at, word.spelt, strict=True)]
        for number, graph, (word, at, letter) in zip(numbers, graphs, of, strict=True):
            source = self._hand.glyphs[int(number)]
            ink = Ink(_laid(graph, unit, to_page), source.page, int(number))
            yield Placed(Glyph(letter, (), (), 0.0), (), bool(source.before >= 0), word, at, ink)


def _laid(graph: LineGraph, unit: float, to_page: ToPage) -> LineGraph:
    """A graph in line space, taken to the page."""
    return LineGraph(to_page(graph.xy * unit), graph.radius * unit, graph.density, graph.uv, graph.edges)


def _parted(words: Sequence[ScannedWord]) -> NDArray[np.bool_]:
    """(n,) whether there is a space before each glyph of a line."""
    parted = np.zeros(sum(len(word.numbers) for word in words), dtype=bool)
    first = np.concatenate([[0], np.cumsum([len(word.numbers) for word in words])[:-1]])
    parted[first.astype(np.intp)] = [not word.glued for word in words]
    return parted


def _spaced(pieces: Sequence[Piece]) -> Iterator[tuple[int, Sequence[Letter]]]:
    """The letters of a paragraph, each word with the number of spaces before it."""
    spaces = 0
    for piece in pieces:
        if isinstance(piece, int):
            spaces = piece
            continue
        yield spaces, piece
        spaces = 0


def _wanted(pieces: Sequence[Sequence[Piece]]) -> list[Wanted]:
    """The letters of a text as glyphs are chosen for them."""
    wanted: list[Wanted] = []
    word = -1
    for paragraph in pieces:
        spaced = list(_spaced(paragraph))
        units = [unit for spaces, letters in spaced for unit in (*" " * min(spaces, 1), *map(spelt, letters))]
        where = iter(place for unit, place in zip(units, places(units), strict=True) if not unit.isspace())
        for number, (spaces, letters) in enumerate(spaced):
            word += 1 if spaces or not number else 0
            wanted += [Wanted(spelt(letter), next(where), word, letter.at) for letter in letters]
    return wanted
