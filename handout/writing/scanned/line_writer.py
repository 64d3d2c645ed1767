"""The line writer of a scanned hand: glyphs chosen for a whole text, set side by side, and laid on their lines as ink.

Source: seed 000, §6.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.hand.places import places
from handout.hand.scanned import ScannedHand
from handout.values import Array, Glyph, Indices, Ink, LineGraph, Placed
from handout.writing.drawn_line_writer import cuts
from handout.writing.line_writer import MORE_SPACE, MOST_SPACES, ToPage, Unit
from handout.writing.scanned.baseline_model import baseline_model
from handout.writing.scanned.bending import Bend
from handout.writing.scanned.candidates import TargetLetter
from handout.writing.scanned.choosing import choose
from handout.writing.scanned.explaining import Explained, explain
from handout.writing.scanned.glyph_index import GlyphIndex, index_glyphs
from handout.writing.scanned.layout_model import (
    LayoutModel,
    bent,
    gaps,
    heights,
    layout_model,
    resolve_collisions,
    set_line,
)
from handout.writing.slips import intended_word
from handout.writing.text import Letter, Piece, Repertoire, paragraphs_of, spelt


@dataclass(frozen=True, eq=False)
class ScannedWord:
    """Glyphs side by side; lengths in x-heights, x from where the body of the first begins.

    numbers : (n,) int, of the glyphs in their hand.
    x : (n,) float: their centres.
    y : (n,) float, line space: how high those stand.
    bends : n: how each is bent.
    extents : (n, 2) float: where the ink of each begins and ends.
    at, spelt : index in the text and grapheme of each.
    advance : where the next word's gap begins.
    glued : whether it goes on with the word before, without a space.
    """

    numbers: Indices
    x: Array
    y: Array
    bends: tuple[Bend, ...]
    extents: Array
    at: tuple[int, ...]
    spelt: tuple[str, ...]
    advance: float
    glued: bool = False

    @property
    def left(self) -> float:
        """Where its ink begins."""
        return float(self.extents[:, 0].min())

    @property
    def right(self) -> float:
        """Where its ink ends."""
        return float(self.extents[:, 1].max())

    def parts(self, room: float) -> Sequence[ScannedWord]:
        """Itself, or, where it is wider than `room`, what is left when it is cut between letters."""
        if max(self.right, self.advance) <= room or len(self.numbers) == 1:
            return [self]
        where = cuts(self.extents[:, 0].tolist(), self.extents[:, 1].tolist(), room)
        return [self._part(a, b) for a, b in pairwise(where)]

    def _part(self, a: int, b: int) -> ScannedWord:
        begin = float(self.extents[a, 0]) if a else 0.0
        extents = self.extents[a:b] - begin
        return replace(
            self,
            numbers=self.numbers[a:b],
            x=self.x[a:b] - begin,
            y=self.y[a:b],
            bends=self.bends[a:b],
            extents=extents,
            at=self.at[a:b],
            spelt=self.spelt[a:b],
            advance=float(np.max(extents[:, 1])),
            glued=self.glued if a == 0 else True,
        )


@lru_cache(maxsize=4)
def _learnt(hand: ScannedHand) -> tuple[GlyphIndex, LayoutModel]:
    """What is worked out once for a hand, however many texts are written in it."""
    return index_glyphs(hand), layout_model(hand)


class ScannedLineWriter:
    """Writes one text in a scanned hand; see `line_writer.LineWriter`.

    Parameters
    ----------
    hand : ScannedHand
    rng : numpy.random.Generator
    variation : float
        0: the best glyphs where they fit best; 1: as the author varies.
    """

    def __init__(self, hand: ScannedHand, rng: np.random.Generator, variation: float) -> None:
        self._hand, self._rng, self._variation = hand, rng, variation
        self.index, self._model = _learnt(hand)
        self.name, self.pitch, self.baseline_model = hand.name, hand.pitch, baseline_model(hand)
        self.repertoire = Repertoire(hand.name, frozenset(hand.letters), frozenset())

    def paragraphs(self, pieces: Iterable[Sequence[Piece]]) -> Iterator[tuple[float, Iterator[Unit[ScannedWord]]]]:
        """(indent, units) of one paragraph after the other; the glyphs of the whole text are chosen together."""
        paragraphs = list(pieces)
        numbers = choose(self.index, _target_letters(paragraphs), self._rng, variation=self._variation)
        count = 0
        for paragraph in paragraphs:
            length = sum(len(piece) for piece in paragraph if not isinstance(piece, int))
            indent, units = self._paragraph(paragraph, numbers[count : count + length])
            yield indent, iter(units)
            count += length

    def explained(self, text: str) -> list[Explained]:
        """Which glyphs would write a text, and what else might have."""
        targets = _target_letters(paragraphs_of(text, self.repertoire))
        return explain(self.index, targets, self._rng, variation=self._variation)

    def _paragraph(self, pieces: Sequence[Piece], numbers: Indices) -> tuple[float, list[Unit[ScannedWord]]]:
        words = [(spaces, letters) for spaces, letters in _spaced(pieces) if letters]
        if not words:
            return 0.0, []
        first = np.concatenate([[0], np.cumsum([len(letters) for _, letters in words])])
        starts = np.zeros(len(numbers), dtype=bool)
        starts[first[:-1]] = [spaces > 0 for spaces, _ in words]
        apart = gaps(self._model, numbers, starts, self._rng, self._variation)
        y = heights(self._model, numbers, starts, self._rng, self._variation)
        bends = bent(self._model, numbers, self._rng, self._variation)
        apart = resolve_collisions(self._model.spacing, numbers, starts, apart, y, bends) * self.pitch
        x = np.concatenate([[0.0], np.cumsum(apart)])
        extents = x[:, None] + self._model.reach(numbers, bends) * self.pitch
        usual = self._space()
        units = []
        for (spaces, letters), a, b in zip(words, first, first[1:], strict=False):
            begin = extents[a, 0]
            followed = b < len(x) and not starts[b]
            word = ScannedWord(
                numbers=numbers[a:b],
                x=x[a:b] - begin,
                y=y[a:b],
                bends=tuple(bends[a:b]),
                extents=extents[a:b] - begin,
                at=tuple(letter.at for letter in letters),
                spelt=tuple(spelt(letter) for letter in letters),
                advance=float(extents[b, 0] - begin if followed else extents[b - 1, 1] - begin),
                glued=bool(a) and not starts[a],
            )
            gap = _gap(float(begin - extents[a - 1, 1]) if a else 0.0, spaces, usual)
            units.append(Unit(word, gap, intended_word(letters)))
        return MORE_SPACE * usual * words[0][0], units

    def _space(self) -> float:
        """The usual gap between words, x-heights."""
        return float(self._model.spacing.gaps.mean[1]) * self.pitch

    def place(
        self, words: Sequence[ScannedWord], starts: Sequence[float], scale: float, to_page: ToPage
    ) -> Iterator[Placed]:
        """The glyphs of a line, their ink on the page."""
        unit = self.pitch * scale  # mm of one unit of line space
        numbers = np.concatenate([word.numbers for word in words])
        x = np.concatenate([start + word.x * scale for word, start in zip(words, starts, strict=True)]) / unit
        parted = _parted(words)
        y, bends = np.concatenate([word.y for word in words]), [bend for word in words for bend in word.bends]
        graphs = set_line(self._model, numbers, x, y, parted, bends)
        of = [(i, at, letter) for i, word in enumerate(words) for at, letter in zip(word.at, word.spelt, strict=True)]
        for number, graph, (word, at, letter) in zip(numbers, graphs, of, strict=True):
            source = self._hand.glyphs[int(number)]
            ink = Ink(_laid(graph, unit, to_page), source.page, int(number))
            yield Placed(Glyph(letter, (), (), 0.0), (), bool(source.before >= 0), word, at, ink)


def _gap(drawn: float, spaces: int, usual: float) -> float:
    """The gap before a word: several spaces are wider than one; a gap of nothing would mean that there is none."""
    return max(drawn, 1e-3) + MORE_SPACE * usual * (min(spaces, MOST_SPACES) - 1) if spaces else 0.0


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


def _target_letters(pieces: Sequence[Sequence[Piece]]) -> list[TargetLetter]:
    """The letters of a text as glyphs are chosen for them."""
    targets: list[TargetLetter] = []
    word = -1
    for paragraph in pieces:
        spaced = list(_spaced(paragraph))
        units = [unit for spaces, letters in spaced for unit in (*" " * min(spaces, 1), *map(spelt, letters))]
        where = iter(place for unit, place in zip(units, places(units), strict=True) if not unit.isspace())
        for number, (spaces, letters) in enumerate(spaced):
            word += 1 if spaces or not number else 0
            targets += [TargetLetter(spelt(letter), next(where), word, letter.at) for letter in letters]
    return targets
