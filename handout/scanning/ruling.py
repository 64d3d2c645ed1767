"""Printed rules and squares: where they are on the page, so that the ink's axis can be laid past their colour.

Nothing is removed here: taking lines out of a page cuts the letters that cross them.

Source: handwriting specification §2 (squared or ruled paper).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.scanning.page import Scan

_RUN = 6.0  # mm of straight line: no stroke of a letter is so long and so level
_LEAST = 0.10  # of the contrast of ink: fainter lines need no care
_LINES = 4.0  # ruled lines as long as the page is wide, together


def find_ruling(scan: Scan, colour: NDArray[np.float32], contrast: float) -> NDArray[np.bool_] | None:
    """Where printed lines are, (h, w) bool, or None on plain paper.

    Parameters
    ----------
    scan : Scan
        Evened out.
    colour : (3,) float, the paper's.
    contrast : the distance of ink from paper in colour, 0–√3.
    """
    import cv2

    marked = np.zeros(scan.shape, dtype=np.uint8)
    for start in range(0, scan.shape[0], 512):
        part = scan.rgb[start : start + 512].astype(np.float32) / 255 - colour
        marked[start : start + 512] = np.linalg.norm(part, axis=2) > _LEAST * contrast
    run = max(15, round(scan.pixels(_RUN)))
    found = np.zeros_like(marked)
    for shape in ((run, 1), (1, run)):
        kernel = np.ones(shape[::-1], dtype=np.uint8)
        lines = np.asarray(cv2.morphologyEx(marked, cv2.MORPH_OPEN, kernel), dtype=np.uint8)
        if _spread(lines, axis=1 if shape[0] > 1 else 0):
            found |= lines
    return found.astype(bool) if found.any() else None


def _spread(lines: NDArray[np.uint8], axis: int) -> bool:
    """Whether long runs lie on many rows of the page, as ruling does and a few underlines do not."""
    covered = (lines > 0).mean(axis=axis)
    # thickness does not count: the strongest row of every 2 % of the page stands for it
    blocks = np.array([block.max() for block in np.array_split(covered, 50)])
    return bool(blocks[blocks > 0.25].sum() > _LINES)
