"""Written lines on a page image as the measures take them: in pixels, with their words.

They are found as those of a scan are (`handout.scanning.text_lines`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.scanning.baselines import Baseline, find_stroke_extremes
from handout.scanning.text_lines import find_text_lines
from handout.score.pages import DPI
from handout.values import Array

_PIXEL = 25.4 / DPI


@dataclass(frozen=True)
class WrittenLine:
    """One line of writing, in pixels of the page.

    curve : (c0, c1, c2): the baseline is y = c0 + c1 u + c2 u², u = x − middle; y down.
    left, right : x of the first and the last ink near the baseline.
    x_height : of the page's small letters, see `Lines`.
    words : (first, last) x of the ink of each word, along the baseline, the slant taken out.
    """

    curve: tuple[float, float, float]
    left: float
    right: float
    x_height: float
    words: tuple[tuple[float, float], ...] = ()

    @property
    def middle(self) -> float:
        """x of the middle, pixels."""
        return (self.left + self.right) / 2

    @property
    def length(self) -> float:
        """Pixels from the first to the last ink."""
        return self.right - self.left

    @property
    def slope(self) -> float:
        """dy/dx of the baseline in the middle: positive where the line falls."""
        return self.curve[1]

    @property
    def bend(self) -> float:
        """How far the middle hangs below the straight line through both ends, pixels (negative: above)."""
        return -self.curve[2] * (self.length / 2) ** 2

    def base(self, x: Array | float) -> Array:
        """y of the baseline at x, pixels."""
        u = np.asarray(x, dtype=np.float64) - self.middle
        c0, c1, c2 = self.curve
        return np.asarray(c0 + u * (c1 + u * c2))


@dataclass(frozen=True)
class Lines:
    """The lines of a page from top to bottom, without their words.

    x_height : pixels, of a small letter over the outside of the ink: the thickness of the line is part of it.
    slant : rad, of the letters, positive to the right of upright.
    """

    lines: tuple[WrittenLine, ...]
    x_height: float
    slant: float


def find_lines(mask: NDArray[np.bool_]) -> Lines:
    """The lines of a page; none, and 0, where no line can be told.

    Parameters
    ----------
    mask : (h, w) bool, True where there is ink, at about 300 dpi.
    """
    rules = find_text_lines(mask, DPI)
    x_height = rules.x_height / _PIXEL
    lines = tuple(_in_pixels(rule, x_height) for rule in rules.lines)
    return Lines(lines, x_height, float(np.arctan(rules.slant)))


def _in_pixels(rule: Baseline, x_height: float) -> WrittenLine:
    """The same line with its baseline through the middles of the last pixels of ink, not through their lower edges."""
    c0, c1, c2 = rule.curve
    return WrittenLine((c0 / _PIXEL - 1, c1, c2 * _PIXEL), rule.left / _PIXEL, rule.right / _PIXEL, x_height)


def ends_of_strokes(mask: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Lowest and highest points (n, 2) float, (x, y) pixels: runs of ink with no ink beneath, and above."""
    marks = find_stroke_extremes(mask, DPI)
    return marks.foot / _PIXEL - (0.5, 1.0), marks.top / _PIXEL - (0.5, 0.0)


def tops_over(line: WrittenLine, points: Array, reach: float) -> tuple[Array, Array]:
    """x and height over the baseline (m,) of the points (n, 2) that lie on the line, at most `reach` from it."""
    inside = (points[:, 0] >= line.left - 2) & (points[:, 0] <= line.right + 2)
    x = points[inside, 0]
    height = line.base(x) - points[inside, 1]
    near = np.abs(height) < reach
    return x[near], height[near]
