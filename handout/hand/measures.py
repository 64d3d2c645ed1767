"""What a scanned hand measures, one definition each; x-height in mm and pitch are properties of `ScannedHand`.

Lengths are in line space, whose unit is the pitch of the lines, unless said otherwise.  They are medians, so that a
page that was measured wrongly, or a letter that was cut wrongly, does not count.  The two means are of what letters of
all pages, weighed alike, are compared with when a text is written with all of them: their spread and their spaces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.hand.letter_classes import FULL_ASCENDERS
from handout.hand.scanned import NOBODY, ScannedHand

JOINED_SHARE = 0.45  # `Joins.share` from which a hand counts as joined; set by eye on joined and printed pages
_CAPITAL = 1.9  # x-heights: height of a capital where the hand has none to measure
_TALLEST = (1.3, 4.0)  # x-heights: bounds of an ascender's height
_HIGHEST = (1.3, 3.5)  # x-heights: bounds of a capital's height


@dataclass(frozen=True)
class Joins:
    """How often letters are joined: `joined` of `pairs` letters that follow another in one word."""

    joined: int
    pairs: int

    @property
    def share(self) -> float:
        """0–1; 0 for a hand without pairs."""
        return self.joined / max(self.pairs, 1)


def joins(hand: ScannedHand) -> Joins:
    """How often the letters of a hand are joined to the one before them in their word."""
    following = [glyph for glyph in hand.glyphs if glyph.before != NOBODY]
    return Joins(sum(bool(hand.glyphs[glyph.before].ligatures) for glyph in following), len(following))


def x_height(hand: ScannedHand) -> float:
    """Height of a small letter without ascender."""
    return float(np.median([page.x_height / page.pitch for page in hand.pages]))


def slant(hand: ScannedHand) -> float:
    """dx/dy of the letters, upwards."""
    return float(np.median([page.slant for page in hand.pages]))


def mean_x_height(hand: ScannedHand) -> float:
    """Height of a small letter, the mean of the pages."""
    return float(np.mean([page.x_height / page.pitch for page in hand.pages]))


def mean_slant(hand: ScannedHand) -> float:
    """dx/dy of the letters, the mean of the pages."""
    return float(np.mean([page.slant for page in hand.pages]))


def half_width(hand: ScannedHand) -> float:
    """Half the width of the line, mm, along all of the ink."""
    return float(np.median(np.concatenate([page.graph.radius for page in hand.pages])))


def letter_half_width(hand: ScannedHand) -> float:
    """Half the width of the line along the letters alone."""
    pages = [hand.pages[glyph.page] for glyph in hand.glyphs]
    radii = [page.graph.radius[g.vertices] / page.pitch for page, g in zip(pages, hand.glyphs, strict=True)]
    return float(np.median(np.concatenate(radii)))


def x_height_in_half_widths(hand: ScannedHand) -> float:
    """Height of a small letter in half widths of the usual page's line."""
    return x_height(hand) / float(np.median([float(np.median(p.graph.radius)) / p.pitch for p in hand.pages]))


def capital_height(hand: ScannedHand) -> float:
    """Height of a capital; of a hand without capitals, that of most hands."""
    tops = [_top(hand, i) for i, glyph in enumerate(hand.glyphs) if glyph.letter.isupper()]
    return _within(tops, x_height(hand), _HIGHEST) or _CAPITAL * x_height(hand)


def ascender_height(hand: ScannedHand) -> float:
    """Height of a small letter with an ascender; of a hand without any, that of a capital."""
    tops = [_top(hand, i) for i, glyph in enumerate(hand.glyphs) if glyph.letter in FULL_ASCENDERS]
    return _within(tops, x_height(hand), _TALLEST) or capital_height(hand)


def _top(hand: ScannedHand, number: int) -> float:
    return float(hand.outline(number)[:, 1].max())


def _within(tops: list[float], unit: float, bounds: tuple[float, float]) -> float:
    """The median of some heights, within bounds in units; 0 if there are none."""
    return float(np.clip(np.median(tops), bounds[0] * unit, bounds[1] * unit)) if tops else 0.0
