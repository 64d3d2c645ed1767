"""The forms of a drawn hand: which may write a letter between its neighbours, what that costs, and accents set on them.

Source: seed 000, §6.2 (perturb-and-MAP; the costs are this project's).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from zlib import crc32

import numpy as np

from handout.hand.diacritics import APOSTROPHE, BAR, BELOW, DOTLESS, NOT_ABOVE, OGONEK, STROKE_HEIGHT, THROUGH
from handout.hand.drawn import Hand
from handout.hand.letter_classes import STEM_AT_LEFT
from handout.values import Array, Glyph, Indices, readonly, readonly_indices
from handout.writing.choosing import Candidates
from handout.writing.text import Letter

_EXITS = {"low": 0, "high": 1, "lifted": 2}
_ENTRIES = {"low": 0, "high": 1, "free": 2, "lifted": 3}
# cost of exit (row) meeting entry (column); joined pairs are those of a joining exit with another entry than "lifted"
_MEET = np.array([[0.0, 12.0, 0.0, 0.0], [12.0, 0.0, 0.0, 0.0], [6.0, 7.0, 0.0, 0.0]])
_REUSE = 4.0  # cost of the form just used, falling with the letters written since
_MEMORY = 12.0  # letters after which a use is half forgotten
_HIGH_START = 5.0  # cost of a word that begins with the way in from a high exit
_TWIN = 6.0  # cost of the same form twice running, as in "ll"


class DrawnForms:
    """The glyphs of a drawn hand, of each letter as soon as it is written; a `choosing.GlyphStock`.

    A form that was just written is dear, whichever of its glyphs it was; a letter twice running is hardly ever the same
    form, as in "ll".
    """

    chance, twice = 1.0, 0.0

    def __init__(self, hand: Hand) -> None:
        self._hand = hand
        self._fitting: dict[tuple[str, str, str, str], Candidates] = {}
        self._of: dict[str, tuple[Glyph, ...]] = {}
        self._number_all()

    def _number_all(self) -> None:
        """Number the glyphs of the letters that were written so far."""
        self.glyphs = tuple(glyph for glyphs in self._of.values() for glyph in glyphs)
        self.kind = readonly_indices([crc32(f"{glyph.letter} {glyph.form}".encode()) for glyph in self.glyphs], None)
        self._exits = readonly_indices([_EXITS[glyph.exit] for glyph in self.glyphs], None)
        self._entries = readonly_indices([_ENTRIES[glyph.entry] for glyph in self.glyphs], None)
        self._reluctance = readonly([glyph.reluctance for glyph in self.glyphs], None)
        self._favour = readonly([glyph.favour for glyph in self.glyphs], None)
        self._number = {id(glyph): number for number, glyph in enumerate(self.glyphs)}

    def candidates(self, letters: Sequence[Letter], seed: int | None) -> list[Candidates]:
        """See `GlyphStock`."""
        bases = ["", *(letter.base for letter in letters), ""]
        if new := {base: self._hand.glyphs[base] for base in bases[1:-1] if base not in self._of}:
            self._of |= new
            self._number_all()
        places = runs(letters)
        fitting = [self._candidates(*key) for key in zip(bases[1:], places, bases, bases[2:], strict=False)]
        first = fitting[0]
        high = self._entries[first.numbers] == _ENTRIES["high"]
        fitting[0] = Candidates(first.numbers, first.cost + np.where(high, _HIGH_START, 0.0))
        return fitting

    def _candidates(self, letter: str, place: str, before: str, after: str) -> Candidates:
        key = (letter, place, before, after)
        if key not in self._fitting:
            glyphs = _possible(self._of[letter], letter, place, before, after)
            numbers = readonly_indices([self._number[id(glyph)] for glyph in glyphs], None)
            self._fitting[key] = Candidates(numbers, -self._favour[numbers])
        return self._fitting[key]

    def steps(self, first: Indices, second: Indices, *, varied: bool) -> Array:
        """See `GlyphStock`."""
        cost: Array = _MEET[np.ix_(self._exits[first], self._entries[second])]
        joins = self._exits[first] != _EXITS["lifted"]
        cost = cost + joins[:, None] * self._reluctance[second]
        if varied:
            cost = cost + _TWIN * (self.kind[first][:, None] == self.kind[second])
        return cost

    def between_words(self, last: int, first: Indices, *, parted: bool) -> Array:
        """See `GlyphStock`: the pen is lifted, and nothing remains."""
        return np.zeros(len(first))

    def ending(self, last: Indices) -> Array:
        """See `GlyphStock`."""
        return np.zeros(len(last))

    def repetition(self, age: Array) -> Array:
        """See `GlyphStock`; of few forms the least recent is the best."""
        return np.asarray(_REUSE * 0.5 ** (age / _MEMORY))


@lru_cache(maxsize=8)
def drawn_forms(hand: Hand) -> DrawnForms:
    """The glyphs of a hand; which fit where is remembered from one text to the next."""
    return DrawnForms(hand)


def runs(letters: Sequence[Letter]) -> list[str]:
    """For each letter, its place in its word: "start", "middle", "end" or "alone".

    The place of a small letter is counted among small letters: a capital, a digit or a quotation mark is not
    joined to it, so what follows starts afresh.
    """

    bases = ["", *(letter.base for letter in letters), ""]
    places = []
    for before_it, base, after_it in zip(bases, bases[1:], bases[2:], strict=False):
        same = str.islower if base.islower() else str.isalpha
        before, after = same(before_it) and before_it.isalpha(), same(after_it) and after_it.isalpha()
        places.append("middle" if before and after else "end" if before else "start" if after else "alone")
    return places


def _possible(glyphs: Sequence[Glyph], letter: str, place: str, before: str, after: str) -> list[Glyph]:
    """What may be written here: a small letter after a capital starts afresh or, if the capital joins, goes on."""
    fit = _fitting(glyphs, place, before, after)
    if letter.islower() and before.isupper():
        within = {"start": "middle", "alone": "end"}.get(place, place)
        fit += [g for g in _fitting(glyphs, within, before, after) if g.entry in ("low", "high")]
    if letter.isupper() and not after.islower():
        fit = [glyph for glyph in fit if glyph.exit == "lifted"] or fit
    return fit


def _fitting(glyphs: Sequence[Glyph], place: str, before: str, after: str) -> list[Glyph]:
    """The glyphs for a place and neighbours; of each kind of entry only the most particular."""
    beside = [
        glyph
        for glyph in glyphs
        if (not glyph.after or (before and before in glyph.after))
        and (not glyph.before or (after and after in glyph.before))
    ]
    fit = [glyph for glyph in beside if place in glyph.places] or beside or list(glyphs)
    best: dict[str, int] = {}
    for glyph in fit:
        best[glyph.entry] = max(best.get(glyph.entry, 0), glyph.rank)
    return [glyph for glyph in fit if glyph.rank == best[glyph.entry]]


_DOTTED = frozenset("ijіј")  # Latin and Cyrillic
_TALL = 1.25  # a letter higher than this lifts its accent
_CLEAR = 1.0  # accents are drawn over letters of this height
_STOREY = 0.45  # x-heights from one accent to the next above it
_LOW, _ON_THE_LINE = 0.3, 0.14  # shares of the height, x-heights: where feet are, and ends that are feet
_TOP = 0.5  # x-heights below a letter's top beside which an apostrophe hangs
_DENSE = 12  # places between two points


def accent_glyph(glyph: Glyph, marks: tuple[str, ...], hand: Hand, rng: np.random.Generator) -> Glyph:
    """`glyph` with `marks` set on it; i and j lose their dots to an accent above."""
    strokes, delayed = glyph.part_strokes(glyph.strokes)
    above = [mark for mark in marks if mark not in NOT_ABOVE]
    dotted = glyph.letter in _DOTTED and above
    delayed = [] if dotted else delayed
    beside: list[Array] = []
    for mark in marks:
        if mark == DOTLESS:
            continue
        forms = hand.marks[mark]
        form = forms[int(rng.integers(len(forms)))]
        placed = _place_mark(form.strokes, strokes, glyph, mark)
        if mark in above:
            storey = np.array([0.0, _STOREY * above.index(mark)])
            placed = [stroke + storey for stroke in placed]
        # what takes room beside a letter is written with it, where the pen is lifted anyway
        (beside if mark == APOSTROPHE and glyph.exit == "lifted" else delayed).extend(placed)
    flags = (False,) * (len(strokes) + len(beside)) + (True,) * len(delayed)
    return replace(glyph, strokes=(*strokes, *beside, *delayed), delayed=flags)


def _place_mark(mark: Sequence[Array], letter: Sequence[Array], glyph: Glyph, kind: str) -> list[Array]:
    """The strokes of a mark where they go on a letter."""
    if kind in THROUGH:
        return _crossing(mark, letter, glyph.letter, kind)
    if kind == OGONEK:
        seat = _foot(letter)
    elif kind == APOSTROPHE:
        body = np.vstack(letter)
        top = float(body[:, 1].max())
        seat = np.array([float(body[body[:, 1] > top - _TOP, 0].max()), top])
    else:
        seat = _seat(letter, glyph, kind)
    return [stroke + seat for stroke in mark]


def _seat(strokes: Sequence[Array], glyph: Glyph, mark: str) -> Array:
    """Where the centre of the mark goes, relative to that of an x-height letter at x = 0."""
    body = np.vstack([*strokes[:-1], strokes[-1][:-1] if glyph.exit == "high" else strokes[-1]])
    top = float(body[:, 1].max())
    if mark in BELOW:
        under = body[body[:, 1] < 0.35 * top]
        return np.array([0.5 * (under[:, 0].min() + under[:, 0].max()), 0.0])
    if glyph.letter in _DOTTED:
        centre = float(body[body[:, 1].argmax(), 0]) + 0.02
    else:
        upper = body[body[:, 1] > 0.5 * top]
        centre = 0.5 * float(upper[:, 0].min() + upper[:, 0].max())
    return np.array([centre, top - _CLEAR if top > _TALL else 0.0])


def _foot(strokes: Sequence[Array]) -> Array:
    """The place from which an ogonek hangs: the rightmost foot, where a stroke turns on the line, or else ends there.

    What leaves a foot along the line, as the last stroke of a word does, is no part of it.
    """
    top = max(float(stroke[:, 1].max()) for stroke in strokes)
    feet = [np.vstack(strokes)[np.vstack(strokes)[:, 1].argmin()]]
    for stroke in strokes:
        y = stroke[:, 1]
        turns = np.flatnonzero((y[1:-1] <= y[:-2]) & (y[1:-1] <= y[2:]) & (y[1:-1] < _LOW * top)) + 1
        ends = [end for end in (stroke[0], stroke[-1]) if end[1] < _ON_THE_LINE]
        feet += ends if top > _TALL or not len(turns) else [stroke[turns[-1]]]
        feet += [stroke[i] for i in turns]
    return np.asarray(max(feet, key=lambda foot: float(foot[0])))


def _crossing(mark: Sequence[Array], letter: Sequence[Array], name: str, kind: str) -> list[Array]:
    """A stroke through a letter, as broad as it takes to leave all of its stems; it was drawn through one at x = 0."""
    body = np.vstack(letter)
    low, high = max(0.0, float(body[:, 1].min())), float(body[:, 1].max())
    y = low + STROKE_HEIGHT.get(name, 0.5) * (high - low)
    stems = np.concatenate([_cross_height(stroke, y) for stroke in letter])
    if not len(stems):
        stems = np.array([body[:, 0].min(), body[:, 0].max()])
    left, right = float(stems.min()), float(stems.min() if name in STEM_AT_LEFT else stems.max())
    aside = 0.5 * (right - left) if kind == BAR else 0.0
    return [np.column_stack([s[:, 0] + np.sign(s[:, 0]) * aside + 0.5 * (left + right), s[:, 1] + y]) for s in mark]


def _cross_height(stroke: Array, y: float) -> Array:
    """(n,): where a stroke crosses a height, x."""
    at = np.linspace(0, len(stroke) - 1, _DENSE * len(stroke))
    x, height = (np.interp(at, np.arange(len(stroke)), axis) for axis in stroke.T)
    over = height > y
    return np.asarray(x[1:][over[1:] != over[:-1]])
