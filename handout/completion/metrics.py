"""What there is to know of an author that letters are put together for: sizes, slant, dots, marks, a drawn hand.

Lengths are in line space, y up from the baseline.

Source: seed 000, §6.2 (this project's).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from handout.completion.specimens import Part, line, pieces, shifted
from handout.hand import measures
from handout.hand.diacritics import BELOW, NOT_ABOVE, decomposed
from handout.hand.letter_classes import DOTTED, X_HEIGHT
from handout.hand.library import load
from handout.hand.scanned import ScannedHand
from handout.motion.trace import trace
from handout.values import Array, Hand, Indices
from handout.writing.specimen import single_letter

_HASTY = 0.85  # of a quick one's
_DOT = 0.4  # x-heights: a dot is no larger
_WIDER = (0.7, 1.45)
_LIKE = 0.11  # of the box around a letter: how far its line lies from that of the drawn one on the average


class ScannedHandMetrics:
    """What is measured of a scanned hand so that letters can be added to it, each when it is first asked for.

    radius : half the width of the line; slant : dx/dy; x_height : of a small letter.  All in line space.
    """

    def __init__(self, hand: ScannedHand) -> None:
        self.hand = hand
        self.radius = measures.letter_half_width(hand)
        self.slant = measures.slant(hand)
        self.x_height = measures.x_height(hand)

    @cached_property
    def house(self) -> Hand:
        """The drawn hand that is most like it."""
        share = measures.joins(self.hand).share
        if share < measures.JOINED_SHARE:
            return load("house-print")
        return load("house-quick" if share > _HASTY else "house-joined")

    @cached_property
    def capital(self) -> float:
        """Height of a capital."""
        return measures.capital_height(self.hand)

    @cached_property
    def tall(self) -> float:
        """Height of a small letter with an ascender."""
        return measures.ascender_height(self.hand)

    def best(self, letter: str, most: int) -> list[int]:
        """Glyphs of a letter, of every place, those that are surest."""
        glyphs = self.hand.glyphs
        numbers = sorted(self.hand.of(letter).tolist(), key=lambda i: -glyphs[i].confidence)
        places = {glyphs[i].place for i in numbers}
        each = [[i for i in numbers if glyphs[i].place == place] for place in sorted(places)]
        turns = [own[k] for k in range(len(numbers)) for own in each if k < len(own)]
        return turns[:most]

    def dot(self, number: int) -> Indices:
        """The vertices of an i's or j's dot; none of any other letter."""
        glyph = self.hand.glyphs[number]
        parts = pieces(self.hand, number)
        if glyph.letter not in ("i", "j") or len(parts) < 2:
            return np.zeros(0, dtype=np.intp)
        heights = [line(self.hand, number, part).xy[:, 1].mean() for part in parts[1:]]
        over = [part for part, y in zip(parts[1:], heights, strict=True) if y > 0.9 * self.x_height]
        return np.concatenate([np.zeros(0, dtype=np.intp), *over])

    def stem(self, number: int) -> Array:
        """(n, 2): a glyph's body without its dot."""
        kept = np.setdiff1d(self.hand.body(number), self.dot(number))
        return self._clean(line(self.hand, number, kept).xy)

    def _clean(self, xy: Array) -> Array:
        return xy if len(xy) else np.zeros((1, 2))

    def dots(self) -> list[tuple[Part, float]]:
        """Dots of i and j, each with its lowest point at 0 under its middle, and how far over its letter that was."""
        found = []
        for letter in sorted(DOTTED):
            for number in self.hand.of(letter).tolist():
                own = self.dot(number)
                if not len(own):
                    continue
                graph = line(self.hand, number, own)
                size = np.ptp(graph.xy, axis=0).max()
                low = float(graph.xy[:, 1].min())
                over = low - float(self.stem(number)[:, 1].max())
                if size < _DOT * self.x_height and over > 0:
                    found.append((self._part(number, own), over))
        return found

    def marks(self, mark: str) -> Iterator[list[Part]]:
        """The author's own marks of one kind, from letters that have it: x = 0 their middle, y over the letter."""
        if mark in NOT_ABOVE - BELOW:
            return  # part of the letter's own line
        for letter in self.hand.letters:
            if decomposed(letter)[1] != (mark,):
                continue
            for number in self.hand.of(letter).tolist():
                yield from self._mark_of(number, mark)

    def _mark_of(self, number: int, mark: str) -> Iterator[list[Part]]:
        first, *others = pieces(self.hand, number)
        body = line(self.hand, number, first).xy
        top = float(body[:, 1].max())
        loose = [(part, line(self.hand, number, part).xy) for part in others]
        if mark in BELOW:
            kept = [part for part, xy in loose if xy[:, 1].mean() < 0]
            over = 0.0
        else:
            kept = [part for part, xy in loose if xy[:, 1].mean() > max(top, 0.8 * self.x_height)]
            over = top
        if kept:
            whole = np.concatenate(kept)
            xy = line(self.hand, number, whole).xy
            shift = float(xy[:, 1].min()) - over if mark not in BELOW else float(xy[:, 1].min())
            part = self._part(number, np.sort(whole))
            yield [Part(shifted(part.graph, np.array([0.0, shift])), part.source, part.role)]

    def _part(self, number: int, vertices: Indices) -> Part:
        """Some of a glyph's vertices, with their lowest point at 0 and their middle over it."""
        graph = line(self.hand, number, vertices)
        low = graph.xy.min(axis=0)
        middle = low + np.array([0.5 * float(np.ptp(graph.xy[:, 0])), 0.0])
        return Part(shifted(graph, -middle), self.hand.glyphs[number].page, np.zeros(len(graph), dtype=np.intp))

    def drawn(self, letter: str, rng: np.random.Generator) -> list[Array]:
        """Strokes of the drawn hand's letter, as high, wide and slanting as the author writes; [] if it has none."""
        if letter not in self.house.glyphs:
            return []
        strokes = _traced(letter, self.house, rng)
        top = max(self._usual_tall, *(float(xy[:, 1].max()) for xy in strokes))
        rise = ((self.tall if letter.islower() else self.capital) - self.x_height) / (top - 1)
        return [self._leant(xy, rise) for xy in strokes]

    def _leant(self, upright: Array, rise: float) -> Array:
        """Upright x-heights to line space; what is over small letters is `rise` an x-height."""
        x, y = upright.T * self.x_height
        over = np.maximum(upright[:, 1] - 1, 0)
        high = np.minimum(y, self.x_height) + rise * over
        return np.column_stack([x * self._wider + self.slant * high, high])

    def recognised(self, letter: str, number: int) -> bool:
        """Whether a glyph's body has the shape of a letter as the drawn hand writes it; letters cut amiss have not."""
        from scipy.spatial import cKDTree

        own = self.hand.outline(number)[np.isin(self.hand.glyphs[number].vertices, self.hand.body(number))]
        theirs = np.concatenate(self.drawn(letter, np.random.default_rng(0)))
        boxes = [(xy - xy.min(axis=0)) / np.maximum(np.ptp(xy, axis=0), 1e-9) for xy in (own, theirs)]
        width, other = (max(self._upright_width(xy, self.slant), 1e-9) for xy in (own, theirs))
        away = [cKDTree(a).query(b)[0] for a, b in (boxes, boxes[::-1])]
        return bool(0.55 < width / other < 1.8 and max(float(np.mean(some)) for some in away) < _LIKE)

    @cached_property
    def _usual_tall(self) -> float:
        rng = np.random.default_rng(0)
        return float(np.median([max(xy[:, 1].max() for xy in _traced(x, self.house, rng)) for x in "bhl"]))

    @cached_property
    def _wider(self) -> float:
        """Widths of the author's small letters by those of the drawn hand."""
        rng, ratios = np.random.default_rng(0), []
        for letter in sorted(X_HEIGHT):
            numbers = self.hand.of(letter)[:7]
            if len(numbers) < 2:
                continue
            own = [self._upright_width(self.hand.outline(int(i))[:, :2], self.slant) for i in numbers]
            theirs = np.ptp(np.concatenate(_traced(letter, self.house, rng))[:, 0]) * self.x_height
            ratios.append(float(np.median(own)) / max(float(theirs), 1e-6))
        return float(np.clip(np.median(ratios), *_WIDER)) if ratios else 1.0

    @staticmethod
    def _upright_width(xy: Array, slant: float) -> float:
        return float(np.ptp(xy[:, 0] - slant * xy[:, 1]))


def _traced(letter: str, house: Hand, rng: np.random.Generator) -> list[Array]:
    """Strokes of a letter as a drawn hand writes it: x-heights, upright, the baseline at y = 0."""
    size = 10.0  # mm: large, so that what depends on mm is small in x-heights
    sheet = single_letter(letter, house, rng, size)
    baseline = sheet.lines[0].baseline
    strokes = []
    for stroke in trace(sheet, house, rng).strokes:
        x, y = stroke.xy[:, 0] / size, (baseline - stroke.xy[:, 1]) / size
        strokes.append(np.column_stack([x - house.slant * y, y]))
    return strokes
