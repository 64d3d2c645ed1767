"""Several drawings on one sheet: address and sender on an envelope, cards side by side on the bed of a plotter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handout import units
from handout.errors import InputError
from handout.values import Drawing, Page, Raster, Stroke

_PAUSE = 0.5  # s between one drawing and the next on the clock of the sheet
_MOST_CARDS = 20  # of a row or a column; set by eye, against a slip of the keyboard


def overlay_drawings(drawings: Sequence[Drawing], page: Page, corners: Sequence[tuple[float, float]] = ()) -> Drawing:
    """The drawings on one page, drawn one after the other.

    corners : mm, where the upper left corner of each lies on the page; all in the page's own, if empty.
    """
    corners = corners or [(0.0, 0.0)] * len(drawings)
    strokes, words, lines, clock = list[Stroke](), list[str](), list[int](), 0.0
    for drawing, corner in zip(drawings, corners, strict=True):
        later = clock - float(drawing.strokes[0].t[0]) if drawing.strokes else 0.0
        for stroke in drawing.strokes:
            word = stroke.word + len(words) if stroke.word >= 0 else -1
            strokes.append(replace(stroke, t=stroke.t + later, xy=stroke.xy + corner, word=word))
        lines += [first + len(words) for first in drawing.about.get("lines", [])]
        words += _list_words(drawing)
        clock = float(strokes[-1].t[-1]) + _PAUSE if strokes else 0.0
    inked = [(drawing, corner) for drawing, corner in zip(drawings, corners, strict=True) if drawing.ink is not None]
    boxes = [np.add(drawing.inked, (*corner, *corner)) for drawing, corner in inked if drawing.inked is not None]
    bounds = (*np.min(boxes, axis=0)[:2], *np.max(boxes, axis=0)[2:]) if boxes else None
    about = {**drawings[0].about, **({"words": words, "lines": lines} if any(words) else {})}
    return Drawing(tuple(strokes), page, about, _paste_inks(inked) if inked else None, bounds)


def _list_words(drawing: Drawing) -> list[str]:
    """Of a drawing, as far as its strokes' numbers go; "" for those that it does not tell."""
    told = list(drawing.about.get("words", []))
    count = max([len(told), *(stroke.word + 1 for stroke in drawing.strokes)])
    return [*told, *[""] * (count - len(told))]


def _paste_inks(inked: Sequence[tuple[Drawing, tuple[float, float]]]) -> Callable[[float], Raster]:
    """The ink of several drawings that do not touch, as one picture."""

    def ink(dpi: float) -> Raster:
        scale = dpi / 25.4
        rasters = [(drawing.ink(dpi), corner) for drawing, corner in inked if drawing.ink is not None]
        places = [
            (round((raster.origin[0] + x) * scale), round((raster.origin[1] + y) * scale)) for raster, (x, y) in rasters
        ]
        left, top = min(x for x, _ in places), min(y for _, y in places)
        sizes = [raster.rgba.shape[:2] for raster, _ in rasters]
        width = max(x + w for (x, _), (_, w) in zip(places, sizes, strict=True)) - left
        height = max(y + h for (_, y), (h, _) in zip(places, sizes, strict=True)) - top
        rgba = np.zeros((height, width, 4), dtype=np.uint8)
        for (x, y), (raster, _) in zip(places, rasters, strict=True):
            there = rgba[y - top : y - top + raster.rgba.shape[0], x - left : x - left + raster.rgba.shape[1]]
            np.copyto(there, raster.rgba, where=raster.rgba[..., 3:] > there[..., 3:])
        return Raster(rgba, dpi, (left / scale, top / scale))

    return ink


@dataclass(frozen=True)
class Grid:
    """Cards side by side on one sheet: so many across and down, and the gap between them, mm."""

    across: int = 1
    down: int = 1
    gap: float = 0.0

    @property
    def cards(self) -> int:
        """On a sheet."""
        return self.across * self.down

    def sheet(self, card: Page) -> Page:
        """The sheet, or bed, that they fill."""
        if self.cards == 1:
            return card
        width = self.across * card.width + (self.across - 1) * self.gap
        return Page(width, self.down * card.height + (self.down - 1) * self.gap)

    def corner(self, number: int, card: Page) -> tuple[float, float]:
        """Where the upper left corner of a card, by its number from 0, lies on the sheet, mm."""
        return number % self.across * (card.width + self.gap), number // self.across * (card.height + self.gap)

    def lay_cards(self, cards: Sequence[Drawing]) -> Drawing:
        """The cards, at most `cards` of one size, on their sheet: row by row from the upper left."""
        card = cards[0].page
        if self.cards == 1:
            return cards[0]
        return overlay_drawings(cards, self.sheet(card), [self.corner(number, card) for number in range(len(cards))])


def grid(text: str, gap: str | float = 0.0) -> Grid:
    """The grid that ``"2x3"`` means: two across, three down; "" for one card a sheet.

    Raises InputError: no such grid, or a gap below 0.
    """
    parts = text.lower().replace("×", "x").split("x") if text else ["1", "1"]
    distance = units.length(str(gap), "gap") if gap else 0.0
    if len(parts) != 2 or not all(part.strip().isdecimal() and 1 <= int(part) <= _MOST_CARDS for part in parts):
        raise InputError(
            f"grid: {text!r} is not a grid such as 2x3, two cards across and three down, {_MOST_CARDS} at most."
        )
    if distance < 0:
        raise InputError(f"gap: {gap} is below 0: cards would lie on each other.")
    return Grid(int(parts[0]), int(parts[1]), distance)
