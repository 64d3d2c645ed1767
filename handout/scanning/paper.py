"""The paper under the writing: what of the scan is paper, how light falls on it, and its stains.

The estimate is coarse on purpose: a letter is narrower than the closing that hides it, a shadow or a stain is not.

Source: own method, grey closing and then a wide median.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.libraries import cv2
from handout.scanning.scan import Scan


@dataclass(frozen=True)
class PaperSettings:
    """How the paper is told from what lies on it; set by eye on real pages."""

    dpi: float = 50.0  # dpi of the estimate
    stroke: float = 2.4  # mm: nothing written is wider in both directions
    wide: float = 25.0  # mm: what stays dark over that is no stain but a picture or a filled area
    deepest: float = 0.6  # a stain is at least this part of the paper around it
    even: float = 0.02  # paper that varies less is left as it is
    border: float = 0.12  # of the page's side: how far in its edge may lie
    other_colour: float = 0.13  # how far a border's colour is from the paper's
    step: float = 0.1  # how far it is over so many pixels of the coarse picture to either side: a shadow's is less
    step_reach: int = 4  # pixels


_PAPER = PaperSettings()


@dataclass(frozen=True, eq=False)
class BarePaper:
    """What the sheet would look like without ink, in coarse.

    coarse : (h', w', 3) float32, 0–1.
    shape : height and width of the scan, pixels.
    colour : (3,) float32: the paper's usual colour.
    even : whether light and paper are so even that nothing needs to be evened out.
    """

    coarse: NDArray[np.float32]
    shape: tuple[int, int]
    colour: NDArray[np.float32]
    even: bool

    def rows(self, start: int, stop: int) -> NDArray[np.float32]:
        """(stop − start, w, 3) float32: the paper under these rows of the scan."""
        height, width = self.shape
        scale = self.coarse.shape[0] / height, self.coarse.shape[1] / width
        y = ((np.arange(start, stop) + 0.5) * scale[0] - 0.5).astype(np.float32)
        x = ((np.arange(width) + 0.5) * scale[1] - 0.5).astype(np.float32)
        at_x, at_y = np.meshgrid(x, y)
        return np.asarray(cv2.remap(self.coarse, at_x, at_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))


def find_paper(scan: Scan) -> BarePaper:
    """The paper of a scan, with the ink taken off."""
    small, dpi = _small(scan)
    size = _odd(_PAPER.stroke * dpi / 25.4)
    closed = np.asarray(cv2.morphologyEx(small, cv2.MORPH_CLOSE, np.ones((size, size), np.uint8)), dtype=np.uint8)
    # median over `_PAPER.wide` mm, taken at a fifth of the size
    height, width = closed.shape[:2]
    tiny = cv2.resize(closed, (max(1, width // 5), max(1, height // 5)), interpolation=cv2.INTER_AREA)
    tiny = cv2.medianBlur(tiny, min(_odd(_PAPER.wide * dpi / 25.4 / 5), 255))
    wide = np.asarray(cv2.resize(tiny, (width, height), interpolation=cv2.INTER_LINEAR), dtype=np.float32)
    calm = cv2.medianBlur(closed, min(_odd(3.5 * _PAPER.stroke * dpi / 25.4), 255))
    calm = np.maximum(calm, (wide * _PAPER.deepest).astype(np.uint8))
    smooth = np.asarray(cv2.GaussianBlur(calm.astype(np.float32) / 255, (0, 0), 0.5 * size), dtype=np.float32)
    colour = np.median(smooth.reshape(-1, 3), axis=0).astype(np.float32)
    spread = np.percentile(smooth.reshape(-1, 3), [1, 99], axis=0)
    return BarePaper(smooth, scan.shape, colour, bool(np.ptp(spread, axis=0).max() < _PAPER.even))


def flatten(scan: Scan, paper: BarePaper) -> Scan:
    """The scan as it would be on paper of one colour under even light.

    What the paper transmits is divided out, so that ink keeps its share of the light: c · colour / paper.
    """
    if paper.even:
        return scan
    rgb = np.empty_like(scan.rgb)
    for start in range(0, rgb.shape[0], 256):
        rows = slice(start, min(start + 256, rgb.shape[0]))
        under = np.maximum(paper.rows(rows.start, rows.stop), 1 / 255)
        rgb[rows] = np.clip(scan.rgb[rows] * (paper.colour / under) + 0.5, 0, 255)
    return Scan(rgb, scan.dpi, scan.source, scan.told, scan.origin)


def crop(scan: Scan) -> Scan:
    """The scan without the borders that are not paper: a scanner's lid, a neighbouring page, the shadow of a fold.

    A side is cut where, in its outer part, most of a row or column (thin lines do not count) has another colour than
    the paper, and it changes there as an edge does: a shadow falls off slowly, and there may be writing in it.  Nothing
    is cut where the paper reaches the edge.
    """
    small, dpi = _small(scan)
    size = _odd(1.2 * dpi / 25.4)
    kernel = np.ones((size, size), dtype=np.uint8)
    plain = cv2.morphologyEx(small, cv2.MORPH_CLOSE, kernel).astype(np.float32) / 255
    colour = np.median(plain[plain.shape[0] // 4 : -(plain.shape[0] // 4) or None].reshape(-1, 3), axis=0)
    other = np.abs(plain - colour).max(axis=2) > _PAPER.other_colour
    top, bottom = _edges(other.mean(axis=1) > 0.5, np.median(plain, axis=1))
    left, right = _edges(other[top:bottom].mean(axis=0) > 0.5, np.median(plain[top:bottom], axis=0))
    scale = scan.shape[0] / small.shape[0], scan.shape[1] / small.shape[1]
    y0, y1 = round(top * scale[0]), round(bottom * scale[0])
    x0, x1 = round(left * scale[1]), round(right * scale[1])
    if (y0, x0, y1, x1) == (0, 0, *scan.shape):
        return scan
    origin = (scan.origin[0] + x0, scan.origin[1] + y0)
    return Scan(np.ascontiguousarray(scan.rgb[y0:y1, x0:x1]), scan.dpi, scan.source, scan.told, origin)


def _edges(other: NDArray[np.bool_], usual: NDArray[np.float32]) -> tuple[int, int]:
    """First and last (exclusive) of the rows or columns that are paper; `usual` (n, 3) are their colours."""
    count = len(other)
    reach = int(_PAPER.border * count)
    low, high = np.flatnonzero(other[:reach]), np.flatnonzero(other[count - reach :])
    first = int(low[-1]) + 1 if len(low) else 0
    last = count - reach + int(high[0]) if len(high) else count
    return _sharp(first, usual), count - _sharp(count - last, usual[::-1])


def _sharp(first: int, usual: NDArray[np.float32]) -> int:
    """The innermost place up to `first` at which colours (n, 3) change within a few mm; 0 if they nowhere do."""
    for at in range(first, 0, -1):
        inner, outer = usual[min(at + _PAPER.step_reach, len(usual) - 1)], usual[max(at - 1 - _PAPER.step_reach, 0)]
        if float(np.abs(inner - outer).max()) > _PAPER.step:
            # the fold of a book darkens over some mm: all of that goes
            if first - at <= 2 * _PAPER.step_reach:
                return first
            low = max(1, at - _PAPER.step_reach)  # just past the greatest change from there
            steps = np.abs(np.diff(usual[low - 1 : at + 1], axis=0)).max(axis=1)
            return min(low + int(np.argmax(steps)) + 1, at)
    return 0


def _small(scan: Scan) -> tuple[NDArray[np.uint8], float]:
    """The scan at about 50 dpi, and its resolution there."""
    factor = max(1.0, scan.dpi / _PAPER.dpi)
    size = (max(1, round(scan.shape[1] / factor)), max(1, round(scan.shape[0] / factor)))
    return np.asarray(cv2.resize(scan.rgb, size, interpolation=cv2.INTER_AREA)), scan.dpi / factor


def _odd(length: float) -> int:
    return max(3, 2 * round(length / 2) + 1)
