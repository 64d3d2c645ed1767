"""Inks told apart by the direction in which their colours lie from the paper's.

How dark ink is tells little: a line is paler where it is thin.

Source: own method.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_APART = np.cos(np.radians(28))  # of the directions of two inks
_MOST = 4  # inks: a bound for the search; further colours on a page are given to the nearest of these


def kinds(directions: NDArray[np.float64], share: float) -> NDArray[np.intp]:
    """Number of the ink of every direction (n, 3), unit vectors, in which a colour lies from the paper.

    share : of all directions; the search ends when no more than these are left without an ink.
    """
    centres: list[NDArray[np.float64]] = []
    rest = np.ones(len(directions), dtype=bool)
    while len(centres) < _MOST and rest.sum() > share * len(directions):
        centre = np.median(directions[rest], axis=0)
        for _ in range(10):
            centre = centre / np.linalg.norm(centre)
            near = rest & (directions @ centre > _APART)
            if not near.any():
                # the middle of two inks is neither: begin at one of them
                centre = directions[rest][0]
                near = rest & (directions @ centre > _APART)
            centre = np.mean(directions[near], axis=0)
        centres.append(centre / np.linalg.norm(centre))
        rest &= directions @ centres[-1] <= _APART
    return np.asarray(np.argmax(directions @ np.stack(centres, axis=1), axis=1), dtype=np.intp)
