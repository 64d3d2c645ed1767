"""The line writer of a drawn hand: chooses the forms of each word, sets them side by side and gives them life.

Word space is letter space (x-height 1, baseline 0, y up) with the word's first letter at x = 0, slanted.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice, pairwise

import numpy as np

from handout.hand.diacritics import DOTLESS
from handout.values import Array, Glyph, Hand, Placed
from handout.writing import variation as varying
from handout.writing.accents import accented
from handout.writing.baseline_model import USUAL_BASELINES
from handout.writing.choice import Chooser
from handout.writing.clearance import bound_bars, clear_dots, joined, missing_room
from handout.writing.line_writer import MORE_SPACE, MOST_SPACES, ToPage, Unit
from handout.writing.slips import Struck, intended_word
from handout.writing.text import Letter, Piece, Repertoire, spelt
from handout.writing.variation import USUAL, Drift, Variation, walk, warp

_MOST_SLURRED = 0.3  # beyond it nobody reads the word
_CAPITALS = 0.12  # x-heights between two capitals, besides their widths


@dataclass(frozen=True, eq=False)
class Word:
    """Glyphs with their strokes in word space, which of them are joined to the one before, and the advance.

    at, spelt : index in the text and grapheme of each glyph.
    left, right : horizontal extent of the ink within reach of the neighbouring words, x-heights.
    """

    glyphs: tuple[Glyph, ...]
    strokes: tuple[tuple[Array, ...], ...]
    joins: tuple[bool, ...]
    at: tuple[int, ...]
    spelt: tuple[str, ...]
    advance: float
    left: float
    right: float

    def parts(self, room: float) -> list[Word]:
        """Itself, or, where it is wider than `room`, what is left when it is cut between letters."""
        if max(self.right, self.advance) <= room or len(self.glyphs) == 1:
            return [self]
        starts = [min(float(s[:, 0].min()) for s in strokes) for strokes in self.strokes]
        ends = [max(float(s[:, 0].max()) for s in strokes) for strokes in self.strokes]
        return [self._part(a, b) for a, b in pairwise(cuts(starts, ends, room))]

    def _part(self, a: int, b: int) -> Word:
        x = min(float(s[:, 0].min()) for s in self.strokes[a]) if a else 0.0
        strokes = tuple(tuple(s - (x, 0.0) for s in glyph) for glyph in self.strokes[a:b])
        right = max(float(s[:, 0].max()) for glyph in strokes for s in glyph)
        left = min(float(s[:, 0].min()) for glyph in strokes for s in glyph)
        return replace(
            self,
            glyphs=self.glyphs[a:b],
            strokes=strokes,
            joins=(False, *self.joins[a + 1 : b]),
            at=self.at[a:b],
            spelt=self.spelt[a:b],
            advance=right,
            left=left,
            right=right,
        )


class WordWriter:
    """Writes the words of one text, one after the other; its slant and size drift from word to word."""

    def __init__(self, hand: Hand, rng: np.random.Generator, jitter: float) -> None:
        self._hand, self.rng = hand, rng
        self._vary: Variation = varying.USUAL.scaled(jitter * hand.variation)
        self._chooser = Chooser(hand, rng, min(jitter, 1.0))
        self._slant = Drift(self._vary.slant, varying.SLANT_MEMORY, rng)
        self._slow_slant = Drift(self._vary.slow_slant, varying.SLOW_MEMORY, rng)
        self._slow_breadth = Drift(self._vary.slow_breadth, varying.SLOW_MEMORY, rng)
        self._rise = Drift(self._vary.word_rise, varying.RISE_MEMORY, rng)
        self._size = Drift(self._vary.size, varying.SIZE_MEMORY, rng)

    def word(self, letters: Sequence[Letter]) -> Word:
        """Choose the forms of a word and set them side by side."""
        glyphs = [
            accented(glyph, letter.marks, self._hand, self.rng) if letter.marks else glyph
            for glyph, letter in zip(self._chooser.word(letters), letters, strict=True)
        ]
        flat, width = self._set(glyphs)
        flat += warp(flat, self.rng, self._vary.warp, 1.6, 3.4) + warp(flat, self.rng, self._vary.warp_fine, 0.7, 1.6)
        slant = self._hand.slant + self._slant.next() + self._slow_slant.next()
        size = 1.0 + self._size.next()
        flat = size * (flat + slant * flat[:, 1:] * (1.0, 0.0)) + np.array([0.0, self._rise.next()])
        return Word(
            glyphs=tuple(glyphs),
            strokes=_unflatten(flat, glyphs),
            joins=(False, *(joined(a, b) for a, b in pairwise(glyphs))),
            at=tuple(letter.at for letter in letters),
            spelt=tuple(spelt(letter) for letter in letters),
            advance=size * width,
            left=float(flat[:, 0].min()),
            right=max(float(flat[flat[:, 1] > -0.2, 0].max(initial=0.0)), size * width - 0.2),
        )

    def _set(self, glyphs: Sequence[Glyph]) -> tuple[Array, float]:
        """All points of the glyphs side by side, (n, 2), and the advance of the whole."""
        n, rng, vary = len(glyphs), self.rng, self._vary
        shapes = self._shapes(n)
        widths = _advances(glyphs) * shapes[:, 0, 0] + rng.normal(0.0, vary.gap, n)
        pairs = zip(pairwise(glyphs), widths, shapes[:, 0, 0], strict=False)
        widths[:-1] += [missing_room(a, b, width, breadth) for (a, b), width, breadth in pairs]
        starts = np.column_stack([np.concatenate([[0.0], np.cumsum(widths)[:-1]]), walk(rng, n, vary.rise)])
        points = list[list[Array]]()
        for glyph, shape, start, share in zip(glyphs, shapes, starts, self._slurs(n), strict=True):
            points.append([])
            for stroke, delayed in zip(glyph.strokes, glyph.delayed, strict=True):
                placed = slurred(stroke, share) @ shape
                if delayed:
                    placed = placed + self._flight()
                points[-1].append(placed + start)
        bound_bars(glyphs, points)
        clear_dots(glyphs, points)
        return np.vstack([stroke for strokes in points for stroke in strokes]), float(widths.sum())

    def _flight(self) -> Array:
        """Where a dot, bar or accent lands, away from its place."""
        vary = self._vary
        return self.rng.normal([vary.late_right, 0.0], [vary.late_x, vary.late_y])

    def _slurs(self, n: int) -> Array:
        """(n,): by what share the pen falls short of each letter's points; the first letters are written with care."""
        settled = np.minimum((np.arange(n) + 0.5) / 4, 1.0)
        return np.asarray(np.minimum(np.abs(walk(self.rng, n, self._vary.slur)) * settled, _MOST_SLURRED))

    def _shapes(self, n: int) -> Array:
        """(n, 2, 2): for each letter the matrix that makes it broader or narrower, taller or shorter, and leans it.

        In a hurried hand the letters of a word grow flatter towards its end.
        """
        vary, rng = self._vary, self.rng
        fading = 1.0 - self._hand.fading * np.minimum(np.arange(n) / 6, 1.0)
        shapes = np.zeros((n, 2, 2))
        shapes[:, 0, 0] = np.exp(self._slow_breadth.next() + rng.normal(0.0, vary.breadth, n))
        shapes[:, 1, 1] = np.exp(walk(rng, n, vary.height)) * fading
        shapes[:, 1, 0] = rng.normal(0.0, vary.shear, n)
        return shapes


def slurred(stroke: Array, share: float) -> Array:
    """The points (n, 2) of a stroke, each moved by a share of the way to the middle of its neighbours, both ends kept.

    This is how a hand that turns back before it has arrived falls short: a row of arches becomes a zigzag, a loop
    closes, while a straight way stays what it is.
    """
    if len(stroke) < 3:
        return stroke
    short = stroke.copy()
    short[1:-1] += share * ((stroke[:-2] + stroke[2:]) / 2 - stroke[1:-1])
    return short


def cuts(starts: Sequence[float], ends: Sequence[float], room: float) -> list[int]:
    """Where letters of those extents are cut so that no part is wider than `room`; 0 and their number included."""
    places, first = [0], 0
    for i in range(1, len(starts)):
        if ends[i] - starts[first] > room:
            places.append(i)
            first = i
    return [*places, len(starts)]


def _advances(glyphs: Sequence[Glyph]) -> Array:
    """How far each glyph is from the next; capitals among themselves stand further apart than before small letters."""
    letters = [glyph.letter for glyph in glyphs]
    capitals = [a.isupper() and b.isupper() for a, b in pairwise(letters)] + [False]
    return np.array([glyph.width for glyph in glyphs]) + _CAPITALS * np.array(capitals)


def _unflatten(flat: Array, glyphs: Sequence[Glyph]) -> tuple[tuple[Array, ...], ...]:
    sizes = [len(stroke) for glyph in glyphs for stroke in glyph.strokes]
    pieces = iter(np.split(flat, np.cumsum(sizes)[:-1]))
    return tuple(tuple(next(pieces) for _ in glyph.strokes) for glyph in glyphs)


def repertoire(hand: Hand) -> Repertoire:
    """What a drawn hand can write."""
    return Repertoire(hand.name, frozenset(hand.glyphs), frozenset(hand.marks) | {DOTLESS})


class DrawnLineWriter:
    """Writes one text in a drawn hand; see `line_writer.LineWriter`.

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
        self.baseline_model = USUAL_BASELINES

    def paragraphs(self, pieces: Iterable[Sequence[Piece]]) -> Iterator[tuple[float, Iterator[Unit[Word]]]]:
        """(indent, units) of one paragraph after the other.

        A word is written when it is asked for, once, whatever the lines will be.
        """
        # what is struck out has a stream of its own: all else stays as it is without
        streams = self._rng, self._rng.spawn(1)[0]
        writers = [WordWriter(self._hand, rng, self._jitter) for rng in streams]
        return (self._paragraph(writers, paragraph) for paragraph in pieces)

    def _paragraph(self, writers: Sequence[WordWriter], pieces: Sequence[Piece]) -> tuple[float, Iterator[Unit[Word]]]:
        units = self._units(writers, pieces)
        first = list(islice(units, 1))
        return (first[0].gap if first else 0.0), chain(first, units)

    def _units(self, writers: Sequence[WordWriter], pieces: Sequence[Piece]) -> Iterator[Unit[Word]]:
        spaces = 0
        for piece in pieces:
            if isinstance(piece, int):
                spaces = piece
                continue
            writer = writers[isinstance(piece, Struck)]
            word = writer.word(piece)
            yield Unit(word, self._gap(spaces, writer.rng), intended_word(piece))
            spaces = 0

    def _gap(self, spaces: int, rng: np.random.Generator) -> float:
        if not spaces:
            return 0.0
        usual = self._hand.word_space
        wide = usual * (1 + MORE_SPACE * (min(spaces, MOST_SPACES) - 1))
        # a writer has one habit of spacing: neither a closed gap nor one that reads as two
        slack = rng.normal(0.0, USUAL.word_gap * self._jitter)
        return wide + min(max(slack, -0.28 * usual), 0.5 * usual)

    def place(self, words: Sequence[Word], starts: Sequence[float], scale: float, to_page: ToPage) -> Iterator[Placed]:
        """The glyphs of a line, their points on the page."""
        for number, (word, start) in enumerate(zip(words, starts, strict=True)):
            for glyph, strokes, join, at in zip(word.glyphs, word.strokes, word.joins, word.at, strict=True):
                yield Placed(glyph, tuple(to_page(s * scale + (start, 0.0)) for s in strokes), join, number, at)
