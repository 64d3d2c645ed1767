"""Why these glyphs were chosen: what every candidate of every place would have cost, and a picture of it.

Source: seed 000, §6.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.hand.places import Place, places
from handout.hand.report import UNIT, cell_of, lay
from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array, Indices
from handout.writing.choosing import Choice, GlyphChooser, choices
from handout.writing.glyph_index import GlyphIndex
from handout.writing.scanned_words import ScannedHandwriting
from handout.writing.text import paragraphs_of, spelt

_MOST = 9  # candidates of a place that the picture shows
_WIDE, _HIGH, _MARGIN = 150, round(4.4 * UNIT), 20  # pixels of a candidate and of the sheet's edge
_TAKEN, _GREY = (0, 120, 60), (110, 110, 110)  # RGB of the frame of what was taken, and of figures


@dataclass(frozen=True, eq=False)
class Explained:
    """One place of a text and what might have been written there; all arrays are over the candidates, (k,).

    letter, place : what is wanted.
    numbers : the candidates.
    fit : cost of not being quite what is wanted: from another place in its word, doubtful.
    again : cost of having been written not long ago.
    noise : what chance added.
    left, right : costs beside the glyphs taken before and after; 0 where the choice did not know of one.
    choice : index of the one taken.
    """

    letter: str
    place: Place
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


def explain(hand: ScannedHand, text: str, rng: np.random.Generator, variation: float = 1.0) -> list[Explained]:
    """Choose as `compose` does with the same generator, and tell for each letter what there was to choose from.

    Raises InputError, MissingCharacters: nothing to write, or the hand has no glyph for some letters.
    """
    handwriting = ScannedHandwriting(hand, rng.spawn(1)[0], variation)
    choosers = [GlyphChooser(handwriting.stock, stream, min(variation, 1.0)) for stream in (rng, rng)]
    paragraphs = paragraphs_of(text, handwriting.repertoire)
    words = [word for paragraph in choices(paragraphs, choosers) for word in paragraph]
    before = [None, *(int(word.numbers[-1]) for word in words)]
    return [
        place
        for word, last in zip(words, before, strict=False)
        for place in _explain_word(handwriting.stock, word, last)
    ]


def _explain_word(index: GlyphIndex, word: Choice, before: int | None) -> list[Explained]:
    """The places of one word, after the glyph `before` of another."""
    graphemes = [spelt(letter) for letter in word.letters]
    explained = []
    for i, (letter, place) in enumerate(zip(graphemes, places(graphemes), strict=True)):
        numbers, around = word.candidates[i].numbers, word.numbers
        left, right = np.zeros(len(numbers)), index.ending(numbers)
        if i:
            left = index.steps(around[i - 1 : i], numbers, varied=True)[0]
        elif before is not None:
            left = index.between_words(before, numbers, parted=word.spaces > 0)
        if i + 1 < len(around):
            right = index.steps(numbers, around[i + 1 : i + 2], varied=True)[:, 0]
        choice = int(np.flatnonzero(numbers == around[i])[0])
        cost = word.candidates[i].cost
        explained.append(Explained(letter, place, numbers, cost, word.again[i], word.chance[i], left, right, choice))
    return explained


def reasons(hand: ScannedHand, explained: Sequence[Explained]) -> list[str]:
    """One line for each place: the glyph that was taken, its cost, and the reasons for and against it."""
    glyphs = [place.numbers[place.choice] for place in explained]
    lines = []
    for i, place in enumerate(explained):
        number, k = glyphs[i], place.choice
        terms = [f"{place.fit[k]:.2f} for itself"] if place.fit[k] else ["exactly what is wanted"]
        if place.again[k] > 0:
            terms.append(f"{place.again[k]:.2f} for having been written lately")
        beside = hand.glyphs[number].before
        if i and beside != NOBODY and beside == glyphs[i - 1]:
            terms.append("it followed the one before it in the source")
        elif i:
            terms.append(f"{place.left[k]:.2f} beside the one before it")
        rank = int(np.flatnonzero(place.order == k)[0]) + 1
        lines.append(
            f"{place.letter} {place.place}: glyph {number}, {rank} of {len(place.numbers)}, {'; '.join(terms)}"
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
    rows = [_pick_shown(place, most) for place in explained]
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
        draw.text((_MARGIN, y + 2.3 * UNIT), place.letter, fill=(150, 0, 0), font=large_font, anchor="ls")
        draw.text((_MARGIN, y + 2.9 * UNIT), f"{place.place}, {len(place.numbers)}", fill=_GREY, font=small_font)
        for column, k in enumerate(shown):
            x = _MARGIN + _WIDE * (column + 1)
            if k == place.choice:
                draw.rectangle((x + 2, y + 1, x + _WIDE - 2, y + _HIGH - 4), outline=_TAKEN, width=2)
            middle = (x + _WIDE / 2, y + _HIGH - 26)
            colour = _TAKEN if k == place.choice else _GREY
            parts = (place.fit, place.again, place.noise, place.left + place.right)
            costs = f"{100 * place.total[k]:.0f} = " + " ".join(f"{100 * part[k]:+.0f}" for part in parts)
            draw.text(middle, costs, fill=colour, font=small_font, anchor="ma")
    return np.asarray(image)


def _pick_shown(place: Explained, most: int) -> list[int]:
    """The cheapest candidates, the taken one among them."""
    shown = [int(k) for k in place.order[:most]]
    return shown if place.choice in shown else [*shown[: most - 1], place.choice]
