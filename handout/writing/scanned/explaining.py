"""Why these glyphs were chosen: what every candidate of every place would have cost, and a picture of it.

Source: seed 000, §6.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.hand.report import UNIT, cell_of, lay
from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array, Indices
from handout.writing.scanned.candidates import Candidates, TargetLetter, candidates_of
from handout.writing.scanned.choice_costs import UsageHistory
from handout.writing.scanned.choosing import solve
from handout.writing.scanned.glyph_index import GlyphIndex

_MOST = 9  # candidates of a place that the picture shows
_WIDE, _HIGH, _MARGIN = 150, round(4.4 * UNIT), 20  # pixels of a candidate and of the sheet's edge
_TAKEN, _GREY = (0, 120, 60), (110, 110, 110)  # RGB of the frame of what was taken, and of figures


@dataclass(frozen=True, eq=False)
class Explained:
    """One place of a text and what might have been written there; all arrays are over the candidates, (k,).

    target : the letter.
    numbers : the candidates.
    fit : cost of not being quite what is wanted: from another place in its word, of the other case, doubtful.
    again : cost of having been written not long ago.
    noise : what chance added.
    left, right : costs beside the glyphs taken before and after; 0 where the choice did not know of one.
    choice : index of the one taken.
    """

    target: TargetLetter
    numbers: Indices
    fit: Array
    again: Array
    noise: Array
    left: Array
    right: Array
    choice: int

    @property
    def total(self) -> Array:
        """(k,) float: what each would have cost, all else as it is."""
        return np.asarray(self.fit + self.again + self.noise + self.left + self.right)

    @property
    def order(self) -> Indices:
        """(k,) int: the candidates, the cheapest first."""
        return np.argsort(self.total, kind="stable")


def explain(
    index: GlyphIndex,
    targets: Sequence[TargetLetter],
    rng: np.random.Generator,
    *,
    variation: float = 1.0,
    history: UsageHistory | None = None,
) -> list[Explained]:
    """Choose as `choosing.choose` does with the same generator, and tell for each letter what there was to choose from.

    Raises
    ------
    MissingCharacters
        The hand has no glyph for some letters.
    """
    candidates = candidates_of(index, targets, rng if variation > 0 else None)
    solved = list(solve(index, targets, candidates, rng, variation, history))
    numbers = np.concatenate([np.zeros(0, dtype=np.intp), *(part.numbers for part in solved)])
    places = []
    for part in solved:
        for k, (noise, again) in enumerate(zip(part.noise, part.again, strict=True)):
            left, right = _beside(index, targets, candidates, numbers, part.first + k, part.first + len(part.numbers))
            each = candidates[part.first + k]
            choice = int(np.flatnonzero(each.numbers == part.numbers[k])[0])
            place = Explained(targets[part.first + k], each.numbers, each.cost, again, noise, left, right, choice)
            places.append(place)
    return places


def _beside(
    index: GlyphIndex,
    targets: Sequence[TargetLetter],
    candidates: Sequence[Candidates],
    numbers: Indices,
    i: int,
    last: int,
) -> tuple[Array, Array]:
    """Costs of the candidates of place i beside the glyphs taken on both sides, before `last` on the right."""
    choices, cost = candidates[i].numbers, index.transitions.cost
    left = right = np.zeros(len(choices))
    if i:
        left = cost(numbers[i - 1 : i], choices, targets[i - 1].word != targets[i].word)[0]
    if i + 1 < last:
        right = cost(choices, numbers[i + 1 : i + 2], targets[i].word != targets[i + 1].word)[:, 0]
    else:
        right = index.transitions.cut(choices)
    return left, right


def reasons(index: GlyphIndex, explained: Sequence[Explained]) -> list[str]:
    """One line for each place: what was taken, what it cost, and what speaks for it or against it."""
    glyphs = [place.numbers[place.choice] for place in explained]
    lines = []
    for i, place in enumerate(explained):
        number, k = glyphs[i], place.choice
        terms = [f"{place.fit[k]:.2f} for itself"] if place.fit[k] else ["exactly what is wanted"]
        if place.again[k] > 0:
            terms.append(f"{place.again[k]:.2f} for having been written lately")
        beside = index.before[number]
        if i and beside != NOBODY and beside == glyphs[i - 1]:
            terms.append("it followed the one before it in the source")
        elif i:
            terms.append(f"{place.left[k]:.2f} beside the one before it")
        rank = int(np.flatnonzero(place.order == k)[0]) + 1
        lines.append(
            f"{place.target.letter} {place.target.place}: glyph {number}, {rank} of {len(place.numbers)}, "
            f"{'; '.join(terms)}"
        )
    return lines


def choices_sheet(hand: ScannedHand, explained: Sequence[Explained], most: int = _MOST) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: a row a letter, its cheapest candidates from the left, each over its cost; the taken one framed.

    Costs are in hundredths: the whole, and after it what the glyph costs itself, for being written again, by chance,
    and beside its neighbours.
    """
    from PIL import Image, ImageDraw, ImageFont

    size = (2 * _MARGIN + _HIGH * max(1, len(explained)), 2 * _MARGIN + _WIDE * (most + 1), 3)
    picture = np.full(size, 255, dtype=np.uint8)
    rows = [_shown(place, most) for place in explained]
    for row, (place, shown) in enumerate(zip(explained, rows, strict=True)):
        for column, k in enumerate(shown):
            cell, up = cell_of(hand, int(place.numbers[k]))
            x, y = _MARGIN + _WIDE * (column + 1), _MARGIN + _HIGH * row
            cell = cell[: _HIGH - 30, : _WIDE - 10]
            lay(picture, cell, x + (_WIDE - cell.shape[1]) // 2, max(y, y + round(2.3 * UNIT) - up))
    image = Image.fromarray(picture)
    draw, large_font, small_font = ImageDraw.Draw(image), ImageFont.load_default(26.0), ImageFont.load_default(11.0)
    for row, (place, shown) in enumerate(zip(explained, rows, strict=True)):
        y = _MARGIN + _HIGH * row
        draw.text((_MARGIN, y + 2.3 * UNIT), place.target.letter, fill=(150, 0, 0), font=large_font, anchor="ls")
        draw.text((_MARGIN, y + 2.9 * UNIT), f"{place.target.place}, {len(place.numbers)}", fill=_GREY, font=small_font)
        for column, k in enumerate(shown):
            x = _MARGIN + _WIDE * (column + 1)
            if k == place.choice:
                draw.rectangle((x + 2, y + 1, x + _WIDE - 2, y + _HIGH - 4), outline=_TAKEN, width=2)
            middle = (x + _WIDE / 2, y + _HIGH - 26)
            colour = _TAKEN if k == place.choice else _GREY
            draw.text(middle, _costs(place, k), fill=colour, font=small_font, anchor="ma")
    return np.asarray(image)


def _shown(place: Explained, most: int) -> list[int]:
    """The cheapest candidates, the taken one among them."""
    shown = [int(k) for k in place.order[:most]]
    return shown if place.choice in shown else [*shown[: most - 1], place.choice]


def _costs(place: Explained, k: int) -> str:
    parts = (place.fit, place.again, place.noise, place.left + place.right)
    return f"{100 * place.total[k]:.0f} = " + " ".join(f"{100 * part[k]:+.0f}" for part in parts)
