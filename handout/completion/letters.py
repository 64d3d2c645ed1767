"""The forms of a letter that a scanned hand lacks: from its own marks and letters, or from a drawn hand.

Source: own method; what seed 000, §6.2, says of placing letters is followed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from handout.completion.metrics import ScannedHandMetrics
from handout.completion.specimens import Part, Specimen, drawn, mark_strokes, resized, shifted, with_neighbours
from handout.hand.diacritics import BELOW, DOTLESS, NAMES, NOT_ABOVE, OGONEK, STROKE_HEIGHT, THROUGH, decomposed
from handout.hand.letter_classes import SAME_AS_CAPITAL, STEM_AT_LEFT
from handout.hand.scanned import ScannedHand
from handout.values import Array
from handout.writing.lookalikes import PICTURE
from handout.writing.text import LEFT_OUT, Repertoire, borrow, instead

_FORMS = 5  # of a letter that is put together: so that it does not repeat at once
_DOTS = 0.42  # x-heights from one dot of a diaeresis to the other; set by eye
_GAP = (0.12, 0.55)  # x-heights between a letter and its mark, at least and at most; set by eye
# x-heights below a letter's top, and share of its width from the left: where apostrophes and ogoneks go; set by eye
_TOP, _RIGHT = 0.5, 0.45
_NAMES = {mark: name.replace("-", " ") for name, mark in NAMES.items()}


@dataclass(frozen=True)
class Supply:
    """Forms of a letter that a hand lacks; none, and false, if it cannot be had.

    specimens : the forms.
    source : what of, in words.
    own : whether all of it is the author's.
    """

    specimens: Sequence[Specimen] = ()
    source: str = ""
    own: bool = False

    def __bool__(self) -> bool:
        return bool(self.specimens)


class LetterMaker:
    """Makes letters for one hand."""

    def __init__(self, hand: ScannedHand, rng: np.random.Generator) -> None:
        self._hand, self._rng = hand, rng
        self._metrics = ScannedHandMetrics(hand)

    @property
    def repertoire(self) -> Repertoire:
        """All that can be written with whatever is lent."""
        house = self._metrics.house
        letters = frozenset(self._hand.letters) | frozenset(house.glyphs)
        return Repertoire(self._hand.name, letters, frozenset(house.marks) | {DOTLESS})

    def make(self, letter: str, fallback: bool) -> Supply:
        """Forms of a letter; without `fallback` only of what the author wrote."""
        base, marks = decomposed(letter)
        if not marks and fallback:
            return self._lent(letter)
        if len(marks) != 1 or len(base) != 1:
            return Supply()
        if marks[0] == DOTLESS:
            return Supply(self._dotless(letter, base), f"{base} without its dot", True)
        return self._accented(letter, base, marks[0], fallback)

    def instead(self, letter: str) -> Supply:
        """What a similar form of a letter needs beyond what the hand has; its source says which form that is."""
        forms = borrow(letter, self.repertoire, 0)
        if not forms:
            return Supply((), LEFT_OUT if PICTURE.match(letter) else "")
        lacking = [form.base for form in forms if form.base not in self._hand.letters]
        specimens = [specimen for base in lacking for specimen in self._lent(base).specimens]
        return Supply(specimens, instead("".join(form.base for form in forms)))

    def _lent(self, letter: str) -> Supply:
        """A letter made of that of the other case, where both have one shape, or of the drawn hand's."""
        other = letter.swapcase()
        same = letter.lower() in SAME_AS_CAPITAL and other in self._hand.letters
        numbers = [i for i in self._hand.of(other).tolist() if self._metrics.recognised(other, i)] if same else []
        if numbers:
            factor = self._metrics.capital / self._metrics.x_height
            factor = factor if letter.isupper() else 1 / factor
            change = "enlarged" if letter.isupper() else "made smaller"
            return Supply([resized(self._hand, i, letter, factor) for i in numbers[:_FORMS]], f"{other} {change}")
        forms = [self._metrics.drawn(letter, self._rng) for _ in range(_FORMS)]
        specimens = [Specimen(letter, (drawn(strokes, self._metrics.radius),)) for strokes in forms if strokes]
        return Supply(specimens, f"the form of {self._metrics.house.name}" if specimens else "")

    def _accented(self, letter: str, base: str, mark: str, fallback: bool) -> Supply:
        """A letter under a mark: the author's own, or where that is accepted a drawn one."""
        marks, source, own = self._marks(base, mark, fallback)
        if not marks:
            return Supply()
        if base not in self._hand.letters:
            return self._on_lent(letter, base, mark, marks) if fallback else Supply()
        no_vertices = np.zeros(0, dtype=np.intp)
        specimens = [
            with_neighbours(
                self._hand,
                number,
                self._metrics.dot(number) if mark not in NOT_ABOVE else no_vertices,
                letter,
                self._seated(marks[i % len(marks)], self._metrics.stem(number), base, mark),
            )
            for i, number in enumerate(self._metrics.best(base, _FORMS))
        ]
        return Supply(specimens, source, own)

    def _marks(self, base: str, mark: str, fallback: bool) -> tuple[list[list[Part]], str, bool]:
        """Forms of a mark, what the accented letter is made of in words, and whether that is the author's own."""
        name = _NAMES.get(mark, "mark")
        if marks := list(self._metrics.marks(mark)):
            return marks, f"{base} with the author's own {name}", True
        if mark == "\u0308" and (marks := list(self._diaereses())):
            return marks, f"{base} with two of the author's own dots", True
        if mark == "\u0307" and (marks := list(self._single_dots())):
            return marks, f"{base} with the author's own dot", True
        if fallback and mark in self._metrics.house.marks:
            return [self._drawn_mark(mark) for _ in range(_FORMS)], f"{base} with a drawn {name}", False
        return [], "", False

    def _on_lent(self, letter: str, base: str, mark: str, marks: list[list[Part]]) -> Supply:
        """A mark on a letter that is lent itself."""
        lent = self._lent(base)
        specimens = [
            Specimen(letter, (*form.parts, *self._seated(marks[i % len(marks)], form.parts[0].graph.xy, base, mark)))
            for i, form in enumerate(lent.specimens)
        ]
        return Supply(specimens, f"{base}, {lent.source}, with a {_NAMES.get(mark, 'mark')}")

    def _dotless(self, letter: str, base: str) -> list[Specimen]:
        """Forms of ı or ȷ: those of the author's i or j whose dot is known."""
        numbers = [number for number in self._metrics.best(base, 4 * _FORMS) if len(self._metrics.dot(number))]
        return [with_neighbours(self._hand, n, self._metrics.dot(n), letter, ()) for n in numbers[:_FORMS]]

    def _seated(self, mark: list[Part], letter: Array, base: str, kind: str) -> list[Part]:
        """A mark (over 0, its lowest point at the gap that it keeps) moved to a letter (n, 2)."""
        if kind in NOT_ABOVE - BELOW:
            seat = self._within(letter, base, kind)
        elif kind in BELOW:
            low = float(letter[:, 1].min())
            under = letter[letter[:, 1] < low + 0.3 * self._metrics.x_height]
            seat = np.array([0.5 * (under[:, 0].min() + under[:, 0].max()), low])
        else:
            seat = self._over(mark, letter)
        return [Part(shifted(part.graph, seat), part.source, part.role) for part in mark]

    def _over(self, mark: list[Part], letter: Array) -> Array:
        """Where a mark hangs: over the middle of a letter's upper part, along the slant."""
        x_height, slant, high = self._metrics.x_height, self._metrics.slant, float(letter[:, 1].max())
        upper = letter[letter[:, 1] > high - 0.4 * x_height]
        over = min(float(part.graph.xy[:, 1].min()) for part in mark)
        middle = 0.5 * (upper[:, 0].min() + upper[:, 0].max()) - slant * (float(upper[:, 1].mean()) - high)
        return np.array([middle + slant * over, high])

    def _within(self, letter: Array, base: str, kind: str) -> Array:
        """Where the origin of a mark goes that touches its letter, or stands beside its top; see `writing.accents`."""
        x_height, high = self._metrics.x_height, float(letter[:, 1].max())
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

    def _diaereses(self) -> Iterator[list[Part]]:
        """Pairs of the author's dots, side by side."""
        dots = self._metrics.dots()
        for left, right in zip(dots[::2], dots[1::2], strict=False):
            apart = 0.5 * _DOTS * self._metrics.x_height
            level = 0.5 * (left[1] + right[1])
            gap = float(np.clip(level, *(self._metrics.x_height * np.array(_GAP))))
            yield [
                Part(shifted(dot.graph, np.array([side * apart, gap])), dot.source, dot.role)
                for (dot, _), side in ((left, -1), (right, 1))
            ]

    def _single_dots(self) -> Iterator[list[Part]]:
        """The author's dots, each at the gap that it keeps."""
        for dot, over in self._metrics.dots():
            gap = float(np.clip(over, *(self._metrics.x_height * np.array(_GAP))))
            yield [Part(shifted(dot.graph, np.array([0.0, gap])), dot.source, dot.role)]

    def _drawn_mark(self, mark: str) -> list[Part]:
        x_height, slant = self._metrics.x_height, self._metrics.slant
        strokes = [x_height * xy for xy in mark_strokes(self._metrics.house, mark, self._rng)]
        if mark not in NOT_ABOVE:
            strokes = [xy - [0.0, x_height] for xy in strokes]
        low = min(float(xy[:, 1].min()) for xy in strokes)
        leant = [np.column_stack([xy[:, 0] + slant * (xy[:, 1] - low), xy[:, 1]]) for xy in strokes]
        return [drawn(leant, self._metrics.radius)]
