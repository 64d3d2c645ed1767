"""Taking print out of a filled sheet: marks, words and lines are replaced by paper, the ink over them stays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.libraries import cv2
from handout.scanning.matting import fill_smooth
from handout.scanning.paper import find_paper
from handout.scanning.scan import Scan
from handout.values import Array

# printed words and lines take blue light and leave the red; pens take the red (red ones need a plain sheet)
_LESS_BLUE = 0.06  # of the paper's light: how much less blue than red there is where something is printed
_MOST_RED = 0.72  # of the paper's: darker than that is ink, on print or beside it
_LEAST_PAPER = 0.9  # of the paper's light: what has less is not taken as paper to fill with
_OVER_PRINT = 0.3  # mm from what is seen of a printed word within which ink may lie over it: half a printed stem
_BESIDE_PEN = 1.0  # mm from ink: print further away has none
# median deviations of what print alone seems to have of ink: a normal variable is above this once in 40,000
_UNLIKELY = 6.0
_ENOUGH = 200  # pixels from which the colour of print, or of ink, is known
_MOST_DENSE = 4.0  # natural logarithm: darker is not told from black


def take_print_out(
    flat: NDArray[np.uint8], marks: NDArray[np.bool_], ruled: bool, dpi: float
) -> tuple[NDArray[np.uint8], NDArray[np.bool_], NDArray[np.bool_]]:
    """The sheet with paper in place of its marks, words and lines; ink over words keeps its own colour.

    flat : (h, w, 3), marks : (h, w), as `rectify` and `printed_on` give them.
    ruled : whether words and lines are printed where the author writes.

    Also returns where (h, w) something is written, and where something has the colour of the words.
    """
    # of the paper as the light falls there: in a photograph's shadow all is dark
    light = flat.astype(np.float32) / np.maximum(255 * find_paper(Scan(flat, dpi, "")).rows(0, len(flat)), 1)
    # a scanner's colours lie a little apart at the edges of black strokes
    light = np.asarray(cv2.GaussianBlur(light, (0, 0), 0.8))
    red, blue = light[:, :, 0], light[:, :, 2]
    near = words = np.zeros_like(marks)
    if ruled:
        words = (red - blue > _LESS_BLUE) & (red > _MOST_RED) & ~marks
        near = (_grow_mask(words, round(_OVER_PRINT / 25.4 * dpi)) > 0) & ~marks
    # paper is taken from where there is neither print nor ink
    paper = fill_smooth(flat, (marks | near | (_grow_mask(red < _LEAST_PAPER, 3) > 0)).astype(np.uint8))
    pen = (red <= _MOST_RED) & ~marks
    seen = words & ~(_grow_mask(pen, round(_BESIDE_PEN / 25.4 * dpi)) > 0)
    result = np.where(marks[:, :, None], paper, flat)
    result[near] = _ink_alone(flat, paper, (seen, pen & ~near, near))
    written = np.asarray(result[:, :, 0] < _LEAST_PAPER * paper[:, :, 0].astype(np.float32))
    return result, written, words


def _ink_alone(
    flat: NDArray[np.uint8], paper: NDArray[np.uint8], layers: tuple[NDArray[np.bool_], ...]
) -> NDArray[np.uint8]:
    """(n, 3): pixels of print with the ink over it alone, so that the pen has one colour throughout.

    What two layers take of the light is multiplied, so their densities add: each pixel's is parted into that of the
    print and that of the ink, least squares with neither below 0, and the ink's is kept: its colour is the pen's, how
    dark it is its own.  What is no darker than print alone seems to be is paper.
    Source: own method (two layers of Beer and Lambert).

    paper : (h, w, 3), without ink and print.
    layers : (h, w) each: where print is seen, where the pen has written, and the n pixels that may have both.
    """
    seen, pen, both = layers
    if min(np.count_nonzero(seen), np.count_nonzero(pen)) < _ENOUGH:
        return np.where(flat[both][:, :1] < _MOST_RED * paper[both][:, :1], flat[both], paper[both])

    def density(where: NDArray[np.bool_]) -> Array:
        taken = np.log(np.maximum(paper[where], 1.0)) - np.log(np.maximum(flat[where], 1.0))
        return np.asarray(np.clip(taken, 0.0, _MOST_DENSE))

    def of_pen(where: NDArray[np.bool_]) -> Array:
        total = density(where)
        of_print, of_pen = np.linalg.lstsq(colours.T, total.T, rcond=None)[0]
        alone = total @ colours[1] / (colours[1] @ colours[1])
        return np.asarray(np.maximum(np.where(of_print > 0, of_pen, alone), 0.0))

    colours = np.array([np.median(density(seen), axis=0), np.median(density(pen), axis=0)])
    left, none = of_pen(both), of_pen(seen)
    left[left < np.median(none) + _UNLIKELY * np.median(np.abs(none - np.median(none)))] = 0.0
    return np.asarray(np.rint(paper[both] * np.exp(-left[:, None] * colours[1])), dtype=np.uint8)


def _grow_mask(mask: NDArray[np.bool_], by: int) -> NDArray[np.uint8]:
    size = 2 * by + 1
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((size, size), np.uint8)), dtype=np.uint8)
