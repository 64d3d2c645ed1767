"""The forms of a letter that a scanned hand lacks: of the author's own letters, dots and marks, or in his manner.

Lengths are in line space, y up from the baseline.

Source: own method; what seed 000, §6.2, says of placing letters is followed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from handout.completion.drawn_letters import DrawnLetters
from handout.completion.specimens import Specimen, SpecimenPart
from handout.hand.diacritics import BELOW, DOTLESS, NAMES, NOT_ABOVE, OGONEK, STROKE_HEIGHT, THROUGH, decompose_grapheme
from handout.hand.letter_classes import DOTTED, STEM_AT_LEFT
from handout.hand.protocol import Repertoire
from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array, Indices, LineGraph
from handout.writing.text import ALIKE, LEFT_OUT, borrow, instead, may_omit

_FORMS = 5  # of a letter that is put together: so that it does not repeat at once
_DOTS = 0.42  # x-heights from one dot of a diaeresis to the other; set by eye
_GAP = (0.12, 0.55)  # x-heights between a letter and its mark, at least and at most; set by eye
# x-heights below a letter's top, and share of its width from the left: where apostrophes and ogoneks go; set by eye
_TOP, _RIGHT = 0.5, 0.45
_DOT = 0.4  # x-heights: a dot is no larger
_NAMES = {mark: name.replace("-", " ") for name, mark in NAMES.items()}


@dataclass(frozen=True)
class Supply:
    """Forms of a letter that a hand lacks; none, and false, if it cannot be had.

    specimens : the forms.
    source : what of, in words.
    of_author : whether all of it is the author's.
    """

    specimens: Sequence[Specimen] = ()
    source: str = ""
    of_author: bool = False

    def __bool__(self) -> bool:
        return bool(self.specimens)


class LetterMaker:
    """Makes letters for one hand."""

    def __init__(self, hand: ScannedHand, rng: np.random.Generator) -> None:
        self._hand, self._rng = hand, rng
        self._drawn = DrawnLetters(hand)

    @property
    def repertoire(self) -> Repertoire:
        """All that can be written with whatever is lent."""
        house = self._drawn.house
        letters = frozenset(self._hand.letters) | frozenset(house.glyphs)
        return Repertoire(self._hand.name, letters, frozenset(house.marks) | {DOTLESS})

    def make(self, letter: str, fallback: bool) -> Supply:
        """Forms of a letter; without `fallback` only of what the author wrote."""
        base, marks = decompose_grapheme(letter)
        base = next((same for same in (base, *ALIKE.get(base, ())) if same in self._hand.letters), base)
        drawn = letter in self._drawn.house.glyphs and not (base.isalpha() and base in self._hand.letters)
        if fallback and (drawn or not marks):
            return self._lend_letter(letter)
        if len(marks) != 1 or len(base) != 1:
            return Supply()
        if marks[0] == DOTLESS:
            numbers = [number for number in self._best(base, 4 * _FORMS) if len(self._dot(number))]
            forms = [_specimen_of_glyph(self._hand, n, self._dot(n), letter, ()) for n in numbers[:_FORMS]]
            return Supply(forms, f"{base} without its dot", True)
        return self._accent_letter(letter, base, marks[0], fallback)

    def instead(self, letter: str) -> Supply:
        """What a similar form of a letter needs beyond what the hand has; its source says which form that is."""
        forms = borrow(letter, self.repertoire, 0)
        if not forms:
            return Supply((), LEFT_OUT if may_omit(letter) else "")
        lacking = [form.base for form in forms if form.base not in self._hand.letters]
        specimens = [specimen for base in lacking for specimen in self._lend_letter(base).specimens]
        return Supply(specimens, instead("".join(form.base for form in forms)))

    def _lend_letter(self, letter: str) -> Supply:
        """A letter made after the author's others, or of the drawn hand's forms where there are too few of those."""
        if specimens := self._drawn.in_manner(letter, _FORMS, self._rng):
            return Supply(specimens, "made after the author's other letters")
        specimens = self._drawn.forms(letter, _FORMS, self._rng)
        source = f"the form of {self._drawn.house.name}, as too few letters are known"
        return Supply(specimens, source if specimens else "")

    def _accent_letter(self, letter: str, base: str, mark: str, fallback: bool) -> Supply:
        """A letter under a mark: the author's own, or where that is accepted a drawn one."""
        marks, source, of_author = self._marks(base, mark, fallback)
        if not marks:
            return Supply()
        if base not in self._hand.letters:
            return self._on_lent(letter, base, mark, marks) if fallback else Supply()
        no_vertices = np.zeros(0, dtype=np.intp)
        specimens = [
            _specimen_of_glyph(
                self._hand,
                number,
                self._dot(number) if mark not in NOT_ABOVE else no_vertices,
                letter,
                self._seat_mark(marks[i % len(marks)], self._stem(number), base, mark),
            )
            for i, number in enumerate(self._best(base, _FORMS))
        ]
        return Supply(specimens, source, of_author)

    def _marks(self, base: str, mark: str, fallback: bool) -> tuple[list[list[SpecimenPart]], str, bool]:
        """Forms of a mark, what the accented letter is made of in words, and whether that is the author's own."""
        name = _NAMES.get(mark, "mark")
        if marks := list(self._own_marks(mark)):
            return marks, f"{base} with the author's own {name}", True
        if mark == "\u0308" and (marks := list(self._diaereses())):
            return marks, f"{base} with two of the author's own dots", True
        if mark == "\u0307" and (dots := self._dots()):
            gaps = [float(np.clip(over, *(self._drawn.x_height * np.array(_GAP)))) for _, over in dots]
            marks = [[dot.shift_by(np.array([0.0, gap]))] for (dot, _), gap in zip(dots, gaps, strict=True)]
            return marks, f"{base} with the author's own dot", True
        if fallback and mark in self._drawn.house.marks:
            return [self._drawn.mark(mark, self._rng) for _ in range(_FORMS)], f"{base} with a drawn {name}", False
        return [], "", False

    def _on_lent(self, letter: str, base: str, mark: str, marks: list[list[SpecimenPart]]) -> Supply:
        """A mark on a letter that is lent itself."""
        base_forms = self._lend_letter(base)
        specimens = [
            Specimen(letter, (*form.parts, *self._seat_mark(marks[i % len(marks)], form.parts[0].graph.xy, base, mark)))
            for i, form in enumerate(base_forms.specimens)
        ]
        return Supply(specimens, f"{base}, {base_forms.source}, with a {_NAMES.get(mark, 'mark')}")

    def _seat_mark(self, mark: list[SpecimenPart], letter: Array, base: str, kind: str) -> list[SpecimenPart]:
        """A mark (over 0, its lowest point at the gap that it keeps) moved to a letter (n, 2)."""
        if kind in NOT_ABOVE - BELOW:
            seat = self._find_origin(letter, base, kind)
        elif kind in BELOW:
            low = float(letter[:, 1].min())
            under = letter[letter[:, 1] < low + 0.3 * self._drawn.x_height]
            seat = np.array([0.5 * (under[:, 0].min() + under[:, 0].max()), low])
        else:
            # a mark hangs over the middle of a letter's upper part, along the slant
            x_height, slant, high = self._drawn.x_height, self._drawn.slant, float(letter[:, 1].max())
            upper = letter[letter[:, 1] > high - 0.4 * x_height]
            over = min(float(part.graph.xy[:, 1].min()) for part in mark)
            middle = 0.5 * (upper[:, 0].min() + upper[:, 0].max()) - slant * (float(upper[:, 1].mean()) - high)
            seat = np.array([middle + slant * over, high])
        return [part.shift_by(seat) for part in mark]

    def _find_origin(self, letter: Array, base: str, kind: str) -> Array:
        """Where the origin of a mark goes that touches its letter, or stands beside it; see `writing.drawn_forms`."""
        x_height, high = self._drawn.x_height, float(letter[:, 1].max())
        if kind in THROUGH:
            y = STROKE_HEIGHT.get(base, 0.5) * high
            near = letter[np.abs(letter[:, 1] - y) <= max(0.1 * x_height, float(np.abs(letter[:, 1] - y).min()))]
            x = near[:, 0].min() if base in STEM_AT_LEFT else 0.5 * (near[:, 0].min() + near[:, 0].max())
            return np.array([float(x), y])
        if kind == OGONEK:
            right = letter[letter[:, 0] >= letter[:, 0].min() + _RIGHT * np.ptp(letter[:, 0])]
            return np.asarray(right[right[:, 1].argmin()])
        beside = letter[letter[:, 1] > high - _TOP * x_height]
        return np.array([float(beside[:, 0].max()), high])

    def _diaereses(self) -> Iterator[list[SpecimenPart]]:
        """Pairs of the author's dots, side by side."""
        dots = self._dots()
        for left, right in zip(dots[::2], dots[1::2], strict=False):
            apart = 0.5 * _DOTS * self._drawn.x_height
            level = 0.5 * (left[1] + right[1])
            gap = float(np.clip(level, *(self._drawn.x_height * np.array(_GAP))))
            yield [left[0].shift_by(np.array([-apart, gap])), right[0].shift_by(np.array([apart, gap]))]

    def _best(self, letter: str, most: int) -> list[int]:
        """Glyphs of a letter, of every place, those that are surest."""
        glyphs = self._hand.glyphs
        numbers = sorted(self._hand.numbers_of_letter(letter).tolist(), key=lambda i: -glyphs[i].confidence)
        places = {glyphs[i].place for i in numbers}
        each = [[i for i in numbers if glyphs[i].place == place] for place in sorted(places)]
        return [of_place[k] for k in range(len(numbers)) for of_place in each if k < len(of_place)][:most]

    def _dot(self, number: int) -> Indices:
        """The vertices of an i's or j's dot; none of any other letter."""
        glyph = self._hand.glyphs[number]
        parts = _pieces(self._hand, number)
        if glyph.letter not in ("i", "j") or len(parts) < 2:
            return np.zeros(0, dtype=np.intp)
        heights = [_line(self._hand, number, part).xy[:, 1].mean() for part in parts[1:]]
        over = [part for part, y in zip(parts[1:], heights, strict=True) if y > 0.9 * self._drawn.x_height]
        return np.concatenate([np.zeros(0, dtype=np.intp), *over])

    def _stem(self, number: int) -> Array:
        """(n, 2): a glyph's body without its dot."""
        stem = np.setdiff1d(self._hand.body(number), self._dot(number))
        return _line(self._hand, number, stem).xy if len(stem) else np.zeros((1, 2))

    def _dots(self) -> list[tuple[SpecimenPart, float]]:
        """Dots of i and j, each with its lowest point at 0 under its middle, and how far over its letter that was."""
        dots = []
        for letter in sorted(DOTTED):
            for number in self._hand.numbers_of_letter(letter).tolist():
                vertices = self._dot(number)
                if not len(vertices):
                    continue
                graph = _line(self._hand, number, vertices)
                size = np.ptp(graph.xy, axis=0).max()
                low = float(graph.xy[:, 1].min())
                over = low - float(self._stem(number)[:, 1].max())
                if size < _DOT * self._drawn.x_height and over > 0:
                    dots.append((self._part(number, vertices), over))
        return dots

    def _own_marks(self, mark: str) -> Iterator[list[SpecimenPart]]:
        """The author's own marks of one kind, from letters that have it: x = 0 their middle, y over the letter."""
        if mark in NOT_ABOVE - BELOW:
            return  # part of the letter's own line
        for letter in self._hand.letters:
            if decompose_grapheme(letter)[1] != (mark,):
                continue
            for number in self._hand.numbers_of_letter(letter).tolist():
                yield from self._mark_of(number, mark)

    def _mark_of(self, number: int, mark: str) -> Iterator[list[SpecimenPart]]:
        first, *others = _pieces(self._hand, number)
        body = _line(self._hand, number, first).xy
        top = float(body[:, 1].max())
        loose = [(piece, _line(self._hand, number, piece).xy) for piece in others]
        if mark in BELOW:
            pieces = [piece for piece, xy in loose if xy[:, 1].mean() < 0]
            over = 0.0
        else:
            pieces = [piece for piece, xy in loose if xy[:, 1].mean() > max(top, 0.8 * self._drawn.x_height)]
            over = top
        if pieces:
            whole = np.concatenate(pieces)
            xy = _line(self._hand, number, whole).xy
            shift = float(xy[:, 1].min()) - over if mark not in BELOW else float(xy[:, 1].min())
            part = self._part(number, np.sort(whole))
            yield [part.shift_by(np.array([0.0, shift]))]

    def _part(self, number: int, vertices: Indices) -> SpecimenPart:
        """Some of a glyph's vertices, with their lowest point at 0 and their middle over it."""
        graph = _line(self._hand, number, vertices)
        low = graph.xy.min(axis=0)
        middle = low + np.array([0.5 * float(np.ptp(graph.xy[:, 0])), 0.0])
        part = SpecimenPart(graph, self._hand.glyphs[number].page, np.zeros(len(graph), dtype=np.intp))
        return part.shift_by(-middle)


def _pieces(hand: ScannedHand, number: int) -> list[Indices]:
    """The connected pieces of a glyph, vertices of its page's graph, the largest first."""
    glyph = hand.glyphs[number]
    inside = hand.pages[glyph.page].graph.take(glyph.vertices).components
    pieces = [glyph.vertices[inside == k] for k in range(int(inside.max()) + 1)]
    return sorted(pieces, key=lambda vertices: -len(vertices))


def _line(hand: ScannedHand, number: int, vertices: Indices) -> LineGraph:
    """Some vertices of a glyph's page in the line space of its line, as a graph."""
    glyph = hand.glyphs[number]
    page = hand.pages[glyph.page]
    ink = page.graph.take(vertices)
    return LineGraph(page.to_line(glyph.line, ink.uv), ink.radius / page.pitch, ink.density, ink.uv, ink.edges)


def _specimen_of_glyph(
    hand: ScannedHand, number: int, gone: Indices, letter: str, marks: Sequence[SpecimenPart]
) -> Specimen:
    """A glyph without the vertices `gone`, in its surroundings, and with marks."""
    glyph = hand.glyphs[number]
    beside = [(glyph.before, -1), (number, 0), (glyph.after, 1)]
    owners = [(hand.glyphs[i].vertices, role) for i, role in beside if i != NOBODY]
    vertices = np.unique(np.concatenate([glyph_vertices for glyph_vertices, _ in owners]))
    vertices = vertices[~np.isin(vertices, gone)]
    role = np.zeros(len(vertices), dtype=np.intp)
    for glyph_vertices, owner_role in owners[::-1]:
        if owner_role:
            role[np.isin(vertices, glyph_vertices)] = owner_role
    role[np.isin(vertices, glyph.vertices)] = 0
    before = hand.glyphs[glyph.before] if glyph.before != NOBODY else None
    after = hand.glyphs[glyph.after] if glyph.after != NOBODY else None

    def paths(ways: Sequence[Indices]) -> tuple[Indices, ...]:
        return tuple(np.searchsorted(vertices, way) for way in ways if np.isin(way, vertices).all())

    return Specimen(
        letter,
        (SpecimenPart(_line(hand, number, vertices), glyph.page, role), *marks),
        (before.place if before else None, glyph.place, after.place if after else None),
        paths([way.path for way in before.ligatures]) if before else (),
        paths([way.path for way in glyph.ligatures]),
    )
