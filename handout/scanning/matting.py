"""Ink on nothing: the scan with its paper taken away, to be laid on any other paper.

The paper under the ink is filled in from around it; of all mixtures of ink and paper that give the scanned colour, the
one with the least ink opacity is taken.  Filled paper is never darker than the scan (never lighter under light ink):
otherwise paper that is a little lighter than its filling becomes opaque white ink, a halo on any other paper.

Source: seed 000, Appendix C, eq. 15–17; the limit of the filled paper and the rounding: own method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.libraries import cv2
from handout.scanning.inks import PageInks
from handout.scanning.mask import Mask
from handout.scanning.scan import Scan
from handout.summary import one_line

_GROW = 0.34  # mm: 4 pixels at 300 dpi, 8 at 600
_EDGE = 0.085  # mm: 1 pixel at 300 dpi, twice the deviation of a flatbed's blur


@dataclass(frozen=True, eq=False)
class Matte:
    """Ink and the paper under it.

    rgba : (h, w, 4) uint8, straight alpha; 0 where there is no ink.
    paper : (h, w, 3) uint8: the page without ink.
    """

    rgba: NDArray[np.uint8]
    paper: NDArray[np.uint8]

    __repr__ = one_line


def find_matte(scan: Scan, mask: Mask, inks: PageInks, *, pale: bool = False) -> Matte:
    """The matte of a scan (as scanned, not evened out).

    pale : the page has marks beside its ink that are none: what lies further from ink than its blurred edge is paper.
    """
    size = 2 * max(1, round(scan.pixels(_GROW))) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    around = np.asarray(cv2.dilate(mask.ink.astype(np.uint8), kernel), dtype=np.uint8)
    paper = fill_smooth(scan.rgb, around)
    inside = around > 0
    light = float(inks.inks[0].colour.sum()) > float(inks.paper.sum())
    limit = np.minimum if light else np.maximum
    paper[inside] = limit(paper[inside], scan.rgb[inside])
    rgba = np.zeros((*scan.shape, 4), dtype=np.uint8)
    rgba[inside] = least_opaque(scan.rgb[inside], paper[inside])
    if pale:
        edge = 2 * max(1, round(scan.pixels(_EDGE))) + 1
        near = cv2.dilate(mask.ink.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (edge, edge)))
        rgba[near == 0] = 0
    return Matte(rgba, paper)


def least_opaque(colour: NDArray[np.uint8], paper: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(n, 4) uint8: ink colour and alpha of pixels (n, 3) on paper (n, 3).

    Alpha is rounded up, so that the ink's colour stays within bounds and the mixture within half a step of the scan.

    Source: seed 000, Appendix C, eq. 17.
    """
    c, p = colour.astype(np.float32), paper.astype(np.float32)
    fall = np.where(c < p, (p - c) / np.maximum(p, 1), 0)
    rise = np.where(c > p, (c - p) / np.maximum(255 - p, 1), 0)
    alpha = np.ceil(np.maximum(fall, rise).max(axis=1) * 255 - 1e-3).clip(0, 255)
    part = np.maximum(alpha, 1)[:, None] / 255
    ink = np.clip(np.rint((c - (1 - part) * p) / part), 0, 255)
    ink[alpha == 0] = 0
    return np.concatenate([ink, alpha[:, None]], axis=1).astype(np.uint8)


def fill_smooth(rgb: NDArray[np.uint8], hole: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The picture with its holes filled from around them, smoothly: known pixels averaged over ever wider cells.

    For paper without a pattern; the time does not depend on the size of the holes.
    """
    levels = [(rgb.astype(np.float32), 1 - hole.astype(np.float32))]
    levels[0][0][hole > 0] = 0
    while min(levels[-1][1].shape) > 2 and levels[-1][1].min() == 0:
        sums, weight = levels[-1]
        size = ((weight.shape[1] + 1) // 2, (weight.shape[0] + 1) // 2)
        small = cv2.resize(weight, size, interpolation=cv2.INTER_AREA)
        colour = cv2.resize(sums, size, interpolation=cv2.INTER_AREA) / np.maximum(small, 1e-6)[:, :, None]
        filled_cells = (small > 0).astype(np.float32)
        levels.append((np.asarray(colour * filled_cells[:, :, None], dtype=np.float32), filled_cells))
    filled, filled_cells = levels.pop()
    if not filled_cells.all():
        mean = filled[filled_cells > 0].mean(axis=0) if filled_cells.any() else np.full(3, 255, dtype=np.float32)
        filled[filled_cells == 0] = mean
    while levels:
        level, filled_cells = levels.pop()
        wide = cv2.resize(filled, filled_cells.shape[::-1], interpolation=cv2.INTER_LINEAR)
        level[filled_cells == 0] = wide[filled_cells == 0]
        filled = level
    return np.asarray(np.rint(filled), dtype=np.uint8)
