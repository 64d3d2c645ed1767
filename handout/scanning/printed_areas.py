"""What is printed or punched on a sheet that is to be written on, besides its lines: headings, signs, holes; and where
there is room left.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.scanning.printed_lines import PrintedLine, PrintedSheet

Area = tuple[float, float, float, float]  # left, top, right, bottom, mm


@dataclass(frozen=True)
class AreaSearch:
    """What counts as print; set by eye on letterheads, forms and punched sheets, scanned and photographed."""

    scale: float = 4.0  # pixels a mm at which print is looked for
    coarse: float = 1.0  # pixels a mm at which the paper is
    grain: float = 7.0  # mm: print that is narrower hides no paper
    paper: float = 61.0  # mm whose median is the paper around a place: wider than any sign
    dark: float = 0.14  # share of light, in any channel, that print or a hole takes
    bright: float = 0.3  # share by which a hole over something white is brighter than tinted paper
    rim: float = 1.5  # mm along the edges of the sheet, where shadows and the ground lie
    beside_line: float = 0.5  # mm on either side of a line that is to be written on
    apart: float = 3.0  # mm: what is closer is one area
    least: float = 2.5  # mm, of an area's longer side: less is a speck
    least_ink: float = 2.0  # mm² of ink in it
    stray: tuple[float, float] = (3.0, 1.2)  # mm: length at least and width at most of what is left of a sheet's lines
    beside: int = 3  # mm left free beside print
    above: int = 2  # mm left free above and below it
    room: float = 0.2  # of the sheet inside its margins that has to be left; else it is printed all over


_SEARCH = AreaSearch()


def find_print(
    rgb: NDArray[np.uint8], width: float, height: float, lines: PrintedSheet | None = None
) -> NDArray[np.bool_]:
    """(height, width), a cell a mm: where a sheet is printed on, or punched; `lines` of it are to be written on."""
    import cv2

    size = (max(8, round(width * _SEARCH.scale)), max(8, round(height * _SEARCH.scale)))
    small = np.asarray(cv2.resize(rgb, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    # (h, w, 3): the bare sheet, as it is lit
    coarse = (max(8, round(width * _SEARCH.coarse)), max(8, round(height * _SEARCH.coarse)))
    image = cv2.resize(rgb, coarse, interpolation=cv2.INTER_AREA)
    grain = 2 * round(_SEARCH.grain * _SEARCH.coarse / 2) + 1
    bare = cv2.morphologyEx(image, cv2.MORPH_CLOSE, np.ones((grain, grain), np.uint8))
    window = 2 * round(_SEARCH.paper * _SEARCH.coarse / 2) + 1
    bare = cv2.medianBlur(np.asarray(bare, dtype=np.uint8), window)
    light = small / np.maximum(np.asarray(cv2.resize(bare, size, interpolation=cv2.INTER_LINEAR), dtype=np.float32), 16)
    ink = (light.min(axis=2) < 1 - _SEARCH.dark) | (light.min(axis=2) > 1 + _SEARCH.bright)
    if lines is not None:
        # (h, w): where the lines of the sheet are
        on = np.zeros(size[::-1], dtype=bool)
        _mark(on, lines.across)
        _mark(on.T, lines.down)
        ink &= ~(on | _stray_lines(ink))
    rim = round(_SEARCH.rim * _SEARCH.scale)
    ink[:rim] = ink[-rim:] = False
    ink[:, :rim] = ink[:, -rim:] = False
    reach = 2 * round(_SEARCH.apart * _SEARCH.scale / 2) + 1
    joined = cv2.morphologyEx(ink.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((reach, reach), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(np.asarray(joined), connectivity=8)
    inked = np.bincount(labels[ink], minlength=count) / _SEARCH.scale**2
    found = (inked > _SEARCH.least_ink) & (stats[:, 2:4].max(axis=1) > _SEARCH.least * _SEARCH.scale)
    found[0] = False
    cells = (max(1, round(width)), max(1, round(height)))
    printed = cv2.resize(found[labels].astype(np.float32), cells, interpolation=cv2.INTER_AREA)
    return np.asarray(printed > 0)


def _stray_lines(ink: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(h, w): thin level and upright lines, such as are left of squares that bend with their sheet."""
    import cv2

    long, thick = (2 * round(side * _SEARCH.scale / 2) + 1 for side in _SEARCH.stray)
    pixels = ink.astype(np.uint8)

    def open_mask(shape: tuple[int, int]) -> NDArray[np.bool_]:
        return np.asarray(cv2.morphologyEx(pixels, cv2.MORPH_OPEN, np.ones(shape, np.uint8)) > 0)

    return (open_mask((1, long)) | open_mask((long, 1))) & ~open_mask((thick, thick))


def _mark(on: NDArray[np.bool_], lines: Sequence[PrintedLine]) -> None:
    """Mark lines that run along the second axis."""
    along = (np.arange(on.shape[1]) + 0.5) / _SEARCH.scale
    rows = (np.arange(on.shape[0])[:, None] + 0.5) / _SEARCH.scale
    for line in lines:
        at = line.at + line.slope * (along - 0.5 * on.shape[1] / _SEARCH.scale)
        reach = _SEARCH.beside_line + line.bend
        first, last = (round(float(side) * _SEARCH.scale) for side in (at.min() - reach - 1, at.max() + reach + 1))
        part = slice(max(first, 0), max(last, 0))
        on[part] |= np.abs(rows[part] - at) < reach


def free_area(printed: NDArray[np.bool_], within: Area) -> Area | None:
    """The rectangle within another that keeps clear of print and has most room; None where hardly any is left.

    Of two as large the wider has more room: its height times the square of its width is compared.

    Parameters
    ----------
    printed : as `find_print` gives it.

    Rectangles of ones are found from the heights of the columns of ones over each row: on a stack of rising
    heights every rectangle that cannot be widened is met once.
    """
    import cv2

    left, top, right, bottom = within
    clear = np.ones((2 * _SEARCH.above + 1, 2 * _SEARCH.beside + 1), np.uint8)
    free = cv2.dilate(printed.astype(np.uint8), clear)[round(top) : round(bottom), round(left) : round(right)] == 0
    if free.all():
        return within
    best, answer = 0.0, None
    heights = np.zeros(free.shape[1], dtype=np.int64)
    for row, cells in enumerate(free):
        heights = np.where(cells, heights + 1, 0)
        stack: list[tuple[int, int]] = []  # where a column of at least some height begins, and the height
        for column, height in enumerate([*heights.tolist(), 0]):
            begin = column
            while stack and stack[-1][1] >= height:
                begin, tall = stack.pop()
                if tall * (column - begin) ** 2 > best and tall * (column - begin) > _SEARCH.room * free.size:
                    best = tall * (column - begin) ** 2
                    answer = (left + begin, top + row + 1 - tall, left + column, top + row + 1)
            stack.append((begin, height))
    return answer
