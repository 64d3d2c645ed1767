"""Letters for a scanned hand that lacks them: from its own marks and letters, and, where accepted, from a drawn hand.

An accented letter is the author's own letter under the author's own mark.  What the author never wrote is lent: a
letter from the other case, or one that a drawn hand has, as slanting, wide and high as the author writes, in the
author's ink.

Source: seed 000, §6.2 (all of this is this project's).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from handout.errors import InputError
from handout.hand.drawn import MARKS
from handout.hand.letter_classes import SAME_AS_CAPITAL, STEM_AT_LEFT
from handout.hand.scanned import ScannedHand
from handout.inking.author import Author
from handout.inking.specimen_sheet import with_sheet
from handout.inking.specimens import Part, Specimen, drawn, mark_strokes, moved, resized, with_neighbours
from handout.values import Array
from handout.writing.lookalikes import PICTURE
from handout.writing.marks import BELOW, CROSSED, DOTLESS, NOT_ABOVE, OGONEK, THROUGH, decomposed
from handout.writing.text import LEFT_OUT, Borrowed, Repertoire, borrow, instead, lacking, normalise, spell

_FORMS = 5  # of a letter that is put together: so that it does not repeat at once
_DOTS = 0.42  # x-heights from one dot of a diaeresis to the other
_GAP = (0.12, 0.55)  # x-heights between a letter and its mark
_NAMES = {mark: name.replace("-", " ") for name, mark in MARKS.items()}
_TOP, _RIGHT = 0.5, 0.45  # x-heights below a letter's top, share of its width: where apostrophes and ogoneks go


@dataclass(frozen=True)
class Supplied:
    """A letter that a hand was given.

    letter : what is written; source : what of, in words; own : whether all of it is the author's.
    """

    letter: str
    source: str
    own: bool


def lend(hand: ScannedHand, text: str, *, fallback: bool = False, seed: int = 0) -> tuple[ScannedHand, list[Borrowed]]:
    """The hand with what a text needs and it lacks, and what that is.

    Parameters
    ----------
    hand : ScannedHand
        Returned as it is where it lacks nothing.
    text : str
    fallback : bool
        Lend what the author never wrote; without it only accented letters are put together, of the author's own.
    seed : int
        Of the variation of what is drawn.

    Raises
    ------
    InputError
        The hand holds no letters, or too little clear line to draw others with.
    MissingCharacters
        Some letters are missing still; the message lists them with their places and says what `fallback` would supply.
    """
    if not hand.letters:
        raise InputError(
            f"{hand.name} holds ink without letters: it is a pen to write with, not a hand; give it as --pen, and a "
            "hand with letters as --hand."
        )
    text = normalise(text)
    own = Repertoire(hand.name, frozenset(hand.letters), frozenset())
    needed = lacking(text, own)
    if not needed:
        return hand, []
    lent, supplied = _lent(hand, tuple(sorted(needed)), fallback, seed)
    found = Repertoire(hand.name, frozenset(lent.letters), frozenset(), _lendable(hand, tuple(sorted(needed))))
    spell(text, found, fallback=fallback)
    return lent, [Borrowed(one.letter, one.source, one.own, tuple(needed[one.letter])) for one in supplied]


@dataclass(frozen=True)
class Outlook:
    """How a letter that a hand lacks can be written: "composed" of what the author wrote, only "lent", or not at all.

    letter : what is wanted; how : "composed", "lent" or "missing"; source : what of, in words.
    """

    letter: str
    how: str
    source: str = ""


def outlook(hand: ScannedHand, text: str) -> tuple[Outlook, ...]:
    """How each letter of a text is had that a hand lacks, as `lend` would have it; in the order of the text."""
    needed = lacking(normalise(text), Repertoire(hand.name, frozenset(hand.letters), frozenset()))
    if not needed or not hand.letters:
        return tuple(Outlook(letter, "missing") for letter in needed)
    workshop, lendable = _Workshop(hand, np.random.default_rng(0)), _lendable(hand, tuple(sorted(needed)))
    found = list[Outlook]()
    for letter in needed:
        made, source, _ = workshop.make(letter, fallback=False)
        if made:
            found.append(Outlook(letter, "composed", source))
            continue
        made, source, _ = workshop.make(letter, fallback=True)
        source = source if made else workshop.instead(letter)[1]
        found.append(Outlook(letter, "lent" if source and letter in lendable else "missing", source))
    return tuple(found)


@lru_cache(maxsize=8)
def _lent(
    hand: ScannedHand, needed: tuple[str, ...], fallback: bool, seed: int
) -> tuple[ScannedHand, tuple[Supplied, ...]]:
    """The hand with a sheet of what can be supplied; the same one for every text that needs the same."""
    workshop = _Workshop(hand, np.random.default_rng(seed))
    specimens, supplied = list[Specimen](), list[Supplied]()
    for letter in needed:
        made, source, own = workshop.make(letter, fallback)
        if made:
            supplied.append(Supplied(letter, source, own))
            specimens += made
        elif fallback:
            more, source = workshop.instead(letter)
            specimens += [one for one in more if one.letter not in {have.letter for have in specimens}]
            supplied += [Supplied(letter, source, False)] if source else []
    return (with_sheet(hand, specimens) if specimens else hand), tuple(supplied)


def _lendable(hand: ScannedHand, needed: tuple[str, ...]) -> frozenset[str]:
    """Which of some letters could be lent."""
    workshop = _Workshop(hand, np.random.default_rng(0))
    known = workshop.known
    return frozenset(x for x in needed if lacking(x, known) == {} or borrow(x, known, 0))


class _Workshop:
    """Puts letters together for one hand."""

    def __init__(self, hand: ScannedHand, rng: np.random.Generator) -> None:
        self._hand, self._rng = hand, rng
        self._author = Author(hand)

    @property
    def known(self) -> Repertoire:
        """All that can be written with whatever is lent."""
        house = self._author.house
        letters = frozenset(self._hand.letters) | frozenset(house.glyphs)
        return Repertoire(self._hand.name, letters, frozenset(house.marks) | {DOTLESS})

    def make(self, letter: str, fallback: bool) -> tuple[list[Specimen], str, bool]:
        """Forms of a letter, in words what of, and whether all of it is the author's; none if it cannot be had."""
        base, marks = decomposed(letter)
        if not marks and fallback:
            made, source = self._lent(letter)
            return made, source, False
        if len(marks) != 1 or len(base) != 1:
            return [], "", False
        if marks[0] == DOTLESS:
            return self._dotless(letter, base), f"{base} without its dot", True
        return self._accented(letter, base, marks[0], fallback)

    def instead(self, letter: str) -> tuple[list[Specimen], str]:
        """What a similar form of a letter needs beyond what the hand has, and which that is."""
        forms = borrow(letter, self.known, 0)
        if not forms:
            return [], LEFT_OUT if PICTURE.match(letter) else ""
        more = [made for form in forms if form.base not in self._hand.letters for made in self._lent(form.base)[0]]
        return more, instead("".join(form.base for form in forms))

    def _lent(self, letter: str) -> tuple[list[Specimen], str]:
        other = letter.swapcase()
        alike = letter.lower() in SAME_AS_CAPITAL and other in self._hand.letters
        numbers = [i for i in self._hand.of(other).tolist() if self._author.recognised(other, i)] if alike else []
        if numbers:
            factor = self._author.capital / self._author.small
            factor = factor if letter.isupper() else 1 / factor
            changed = "enlarged" if letter.isupper() else "made smaller"
            return [resized(self._hand, i, letter, factor) for i in numbers[:_FORMS]], f"{other} {changed}"
        strokes = [self._author.drawn(letter, self._rng) for _ in range(_FORMS)]
        made = [Specimen(letter, (drawn(some, self._author.radius),)) for some in strokes if some]
        return made, f"the form of {self._author.house.name}" if made else ""

    def _accented(self, letter: str, base: str, mark: str, fallback: bool) -> tuple[list[Specimen], str, bool]:
        marks = list(self._author.marks(mark))
        source, own = f"{base} with the author's own {_NAMES.get(mark, 'mark')}", bool(marks)
        if not marks and mark == "\u0308":
            marks = list(self._diaereses())
            source, own = f"{base} with two of the author's own dots", bool(marks)
        elif not marks and mark == "\u0307":
            marks = list(self._single_dots())
            source, own = f"{base} with the author's own dot", bool(marks)
        if not marks and fallback and mark in self._author.house.marks:
            marks = [self._drawn_mark(mark) for _ in range(_FORMS)]
            source = f"{base} with a drawn {_NAMES.get(mark, 'mark')}"
        if not marks:
            return [], "", False
        if base not in self._hand.letters:
            return self._on_lent(letter, base, mark, marks) if fallback else ([], "", False)
        numbers = self._author.best(base, _FORMS)
        made = [
            with_neighbours(
                self._hand,
                number,
                self._author.dot(number) if mark not in NOT_ABOVE else np.zeros(0, dtype=np.intp),
                letter,
                self._seated(marks[i % len(marks)], self._author.stem(number), base, mark),
            )
            for i, number in enumerate(numbers)
        ]
        return made, source, own

    def _on_lent(self, letter: str, base: str, mark: str, marks: list[list[Part]]) -> tuple[list[Specimen], str, bool]:
        """A mark on a letter that is lent itself."""
        bases, source = self._lent(base)
        made = [
            Specimen(letter, (*one.parts, *self._seated(marks[i % len(marks)], one.parts[0].graph.xy, base, mark)))
            for i, one in enumerate(bases)
        ]
        return made, f"{base}, {source}, with a {_NAMES.get(mark, 'mark')}", False

    def _dotless(self, letter: str, base: str) -> list[Specimen]:
        """Forms of ı or ȷ: those of the author's i or j whose dot is known."""
        numbers = [number for number in self._author.best(base, 4 * _FORMS) if len(self._author.dot(number))]
        return [with_neighbours(self._hand, n, self._author.dot(n), letter, ()) for n in numbers[:_FORMS]]

    def _seated(self, mark: list[Part], letter: Array, base: str, kind: str) -> list[Part]:
        """A mark (over 0, its lowest point at the gap that it keeps) moved to a letter (n, 2)."""
        if kind in NOT_ABOVE - BELOW:
            seat = self._within(letter, base, kind)
        elif kind in BELOW:
            low = float(letter[:, 1].min())
            under = letter[letter[:, 1] < low + 0.3 * self._author.small]
            seat = np.array([0.5 * (under[:, 0].min() + under[:, 0].max()), low])
        else:
            seat = self._over(mark, letter)
        return [Part(moved(part.graph, seat), part.source, part.role) for part in mark]

    def _over(self, mark: list[Part], letter: Array) -> Array:
        """Where a mark hangs: over the middle of a letter's upper part, along the slant."""
        small, slant, high = self._author.small, self._author.slant, float(letter[:, 1].max())
        upper = letter[letter[:, 1] > high - 0.4 * small]
        over = min(float(part.graph.xy[:, 1].min()) for part in mark)
        middle = 0.5 * (upper[:, 0].min() + upper[:, 0].max()) - slant * (float(upper[:, 1].mean()) - high)
        return np.array([middle + slant * over, high])

    def _within(self, letter: Array, base: str, kind: str) -> Array:
        """Where the origin of a mark goes that touches its letter, or stands beside its top; see `writing.accents`."""
        small, high = self._author.small, float(letter[:, 1].max())
        if kind in THROUGH:
            y = CROSSED.get(base, 0.5) * high
            near = letter[np.abs(letter[:, 1] - y) <= max(0.1 * small, float(np.abs(letter[:, 1] - y).min()))]
            x = near[:, 0].min() if base in STEM_AT_LEFT else 0.5 * (near[:, 0].min() + near[:, 0].max())
            return np.array([float(x), y])
        if kind == OGONEK:
            right = letter[letter[:, 0] >= letter[:, 0].min() + _RIGHT * np.ptp(letter[:, 0])]
            return np.asarray(right[right[:, 1].argmin()])
        beside = letter[letter[:, 1] > high - _TOP * small]
        return np.array([float(beside[:, 0].max()), high])

    def _diaereses(self) -> Iterator[list[Part]]:
        """Pairs of the author's dots, side by side."""
        dots = self._author.dots()
        for one, other in zip(dots[::2], dots[1::2], strict=False):
            apart = 0.5 * _DOTS * self._author.small
            level = 0.5 * (one[1] + other[1])
            gap = float(np.clip(level, *(self._author.small * np.array(_GAP))))
            yield [
                Part(moved(dot.graph, np.array([side * apart, gap])), dot.source, dot.role)
                for (dot, _), side in ((one, -1), (other, 1))
            ]

    def _single_dots(self) -> Iterator[list[Part]]:
        """The author's dots, each at the gap that it keeps."""
        for dot, over in self._author.dots():
            gap = float(np.clip(over, *(self._author.small * np.array(_GAP))))
            yield [Part(moved(dot.graph, np.array([0.0, gap])), dot.source, dot.role)]

    def _drawn_mark(self, mark: str) -> list[Part]:
        small, slant = self._author.small, self._author.slant
        strokes = [small * xy for xy in mark_strokes(self._author.house, mark, self._rng)]
        if mark not in NOT_ABOVE:
            strokes = [xy - [0.0, small] for xy in strokes]
        low = min(float(xy[:, 1].min()) for xy in strokes)
        leant = [np.column_stack([xy[:, 0] + slant * (xy[:, 1] - low), xy[:, 1]]) for xy in strokes]
        return [drawn(leant, self._author.radius)]
