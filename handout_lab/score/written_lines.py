"""Written lines and words of a page image, as the measures take them: in pixels of a grey page at 300 dpi.

The ink of a scan that becomes a hand is found with much more care (`scanning.mask`), by its colour and with a cut that
smooths its edges.  A measure must not: what it says of a page would be what that method does to edges, and figures of
the literature, and those that people's pages were measured with, are of Otsu's threshold.  Lines are found as those of
a scan are (`scanning.text_lines`).  Of words only ink between the baseline and a little over the x-height counts, since
loops and crossings of neighbouring lines hang into the gaps between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.scanning.baselines import LineBaseline, find_stroke_extremes
from handout.scanning.picture_files import read_picture
from handout.scanning.text_lines import find_text_lines
from handout.values import Array

DPI = 300.0  # for which all lengths in pixels of the measures are given
_DUST = 12  # pixels
_THIN = 25  # pixels: no line of writing is that long and that low
_EDGE = 12  # pixels, the outermost millimetre


def read_page(path: Path, dpi: float | None = None) -> NDArray[np.uint8]:
    """The page as (h, w) uint8 at 300 dpi, transparent parts white.

    Parameters
    ----------
    path : Path
        Any image that a scan may be, see `scanning.picture_files`.
    dpi : float, optional
        Resolution; otherwise the file's own, and 300 where it says none.

    Raises
    ------
    InputError
        Not an image, one too large, or several pages in one file.
    """
    from PIL import Image

    picture = read_picture(path)
    grey = Image.fromarray(picture.rgb).convert("L")
    scale = DPI / (dpi or picture.own or DPI)
    if abs(scale - 1) > 0.02:
        size = (max(1, round(grey.width * scale)), max(1, round(grey.height * scale)))
        grey = grey.resize(size, Image.Resampling.LANCZOS)
    return np.asarray(grey, dtype=np.uint8)


def ink(grey: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """(h, w) bool: the ink of a page by Otsu's threshold, without specks and without what a scanner adds.

    Pieces of less than 12 pixels are dust.  A piece longer than a quarter of the page that is also straight and
    thin (a frame, a ruling, the shadow of the paper's edge) is not writing; nor is one that lies in the outermost
    millimetre.  Writing that reaches the edge of the image is kept.

    Parameters
    ----------
    grey : (h, w) uint8, dark ink on light paper, at about 300 dpi.
    """
    import cv2

    if grey.size == 0 or grey.min() == grey.max():
        return np.zeros(grey.shape, dtype=np.bool_)
    _, mask = cv2.threshold(grey, 0, 255, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    x, y, w, h, area = (stats[:, i] for i in range(5))
    height, width = grey.shape
    ruled = (w > width / 4) & (h < _THIN) | (h > height / 4) & (w < _THIN)
    edge = (x + w <= _EDGE) | (y + h <= _EDGE) | (x >= width - _EDGE) | (y >= height - _EDGE)
    keep = (area >= _DUST) & ~ruled & ~(edge if min(height, width) > 20 * _EDGE else False)
    keep[0] = False
    return np.asarray(keep[labels])


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


def _in_pixels(rule: LineBaseline, x_height: float) -> WrittenLine:
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


_ZONE = (-0.1, 1.15)  # x-heights over the baseline
_SMALLEST, _LARGEST = 0.2, 4.0  # x-heights: a smaller gap is roughness, a larger one no wider than this
_LETTER, _ADDED = 0.4, 0.3  # x-heights, and the share of such gaps that is added
_BOUNDS = (0.5, 1.3)  # x-heights, between which the limit of letter gaps and word gaps lies
_LEAST_INK = 0.25  # x-heights, width of a word


def find_words(
    mask: NDArray[np.bool_], lines: Sequence[WrittenLine], x_height: float, slant: float
) -> list[WrittenLine]:
    """The lines with their words; a line without any is left out.

    Parameters
    ----------
    mask : (h, w) bool, True where there is ink.
    x_height : pixels.
    slant : rad, positive to the right.
    """
    filled = [_filled(mask, line, x_height, slant) for line in lines]
    gaps = np.concatenate([b[1:] - e[:-1] for b, e in filled] or [np.zeros(0)])
    limit = gap_limit(gaps / x_height) * x_height
    with_words = []
    for line, (begin, end) in zip(lines, filled, strict=True):
        if not len(begin):
            continue
        cut = np.flatnonzero(begin[1:] - end[:-1] > limit) + 1
        first, last = begin[np.concatenate([[0], cut])], end[np.concatenate([cut, [len(end)]]) - 1]
        words = tuple((float(a), float(b)) for a, b in zip(first, last, strict=True) if b - a > _LEAST_INK * x_height)
        if words:
            with_words.append(replace(line, words=words))
    return with_words


def gap_limit(gaps: Array) -> float:
    """The width that parts gaps between letters from gaps between words best, as Otsu parts grey levels.

    Logarithms are parted.  Some gaps of `_LETTER` are added, since a joined hand has gaps between words alone, and
    those should not be parted.  On 33 pages of known text the words so found are 7 % off their true number.

    Parameters
    ----------
    gaps : (n,) float, x-heights.
    """
    true = np.minimum(gaps[gaps > _SMALLEST], _LARGEST)
    size = np.log(np.sort(np.concatenate([true, np.full(int(_ADDED * len(true)) + 1, _LETTER)])))
    middle = (np.exp(size[1:]) + np.exp(size[:-1])) / 2
    inside = np.flatnonzero((middle > _BOUNDS[0]) & (middle < _BOUNDS[1]))
    if not len(inside):
        return float(np.sqrt(_BOUNDS[0] * _BOUNDS[1]))
    count, total, n = np.arange(1, len(size)), np.cumsum(size)[:-1], len(size)
    apart = count / n * (1 - count / n) * (total / count - (size.sum() - total) / (n - count)) ** 2
    return float(middle[inside[int(np.argmax(apart[inside]))]])


def _filled(mask: NDArray[np.bool_], line: WrittenLine, x_height: float, slant: float) -> tuple[Array, Array]:
    """First and last x of the pieces of ink along the baseline."""
    ends = line.base(np.array([line.left, line.middle, line.right]))
    top = max(0, int(ends.min() - _ZONE[1] * x_height) - 1)
    left = max(0, int(line.left - 2 * x_height))
    part = mask[top : max(top, int(ends.max() - _ZONE[0] * x_height) + 2), left : int(line.right + 2 * x_height)]
    row, column = np.nonzero(part)
    x = column + left
    height = line.base(x.astype(np.float64)) - (row + top)
    near = (height > _ZONE[0] * x_height) & (height < _ZONE[1] * x_height)
    foot = np.rint(x[near] - height[near] * np.tan(slant)).astype(np.intp)
    if not len(foot):
        return np.zeros(0), np.zeros(0)
    low = int(foot.min())
    ink = np.concatenate([[0], np.bincount(foot - low) > 1, [0]]).astype(np.int8)
    change = np.diff(ink)
    begin, end = (np.flatnonzero(change == step).astype(np.float64) + low for step in (1, -1))
    return begin, end
