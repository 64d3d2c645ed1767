"""The empty band between two columns of writing that lie side by side in one scan: an open book, two pages at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.scanning.rules import find_rules

_CELL = 1.0  # mm
_LEAST = 8.0  # mm: wider than any space between words
_MIDDLE = (0.2, 0.8)  # of the ink's width: where the band may lie
_STRAYS = 0.02  # of the rows with ink: so few may cross the band
_LEANS = np.tan(np.radians(np.arange(-3.0, 3.01, 0.5)))  # of the page on the scanner
_LINES = 3  # on either side


@dataclass(frozen=True)
class Gutter:
    """A band without ink between two columns.

    at : x of its middle, half-way down the page, mm.
    width : mm.
    lines : how many lines of writing there are left and right of it.
    """

    at: float
    width: float
    lines: tuple[int, int]


def find_gutter(ink: NDArray[np.bool_], dpi: float) -> Gutter | None:
    """The band between two columns of writing, or None if there is one column.

    Parameters
    ----------
    ink : (h, w) bool
    dpi : pixels per inch.
    """
    cells = _cells(ink, dpi)
    rows = np.flatnonzero(cells.any(axis=1))
    if not len(rows):
        return None
    part = cells[rows[0] : rows[-1] + 1]
    width, at = max(_band(_leaning(part, lean)) for lean in _LEANS.tolist())
    if width * _CELL < _LEAST:
        return None
    cut = round(at * _CELL / 25.4 * dpi)
    sides = tuple(len(find_rules(np.ascontiguousarray(side), dpi).lines) for side in (ink[:, :cut], ink[:, cut:]))
    if min(sides) < _LINES:
        return None
    return Gutter(at * _CELL, width * _CELL, (sides[0], sides[1]))


def _cells(ink: NDArray[np.bool_], dpi: float) -> NDArray[np.bool_]:
    """Whether there is ink in each square millimetre."""
    side = _CELL / 25.4 * dpi
    y, x = np.nonzero(ink)
    cells = np.zeros((int(ink.shape[0] / side) + 1, int(ink.shape[1] / side) + 1), dtype=bool)
    cells[(y / side).astype(np.intp), (x / side).astype(np.intp)] = True
    return cells


def _leaning(cells: NDArray[np.bool_], lean: float) -> NDArray[np.bool_]:
    """The cells with their rows moved, so that a band that leans stands upright."""
    middle = len(cells) / 2
    return np.stack([np.roll(row, round(lean * (i - middle))) for i, row in enumerate(cells)])


def _band(cells: NDArray[np.bool_]) -> tuple[int, float]:
    """Width of the widest empty band inside the ink, and its middle, in cells."""
    held = cells.sum(axis=0)
    inky = np.flatnonzero(held > _STRAYS * len(cells))
    if len(inky) < 2:
        return 0, 0.0
    low, high = (inky[0] + share * (inky[-1] - inky[0]) for share in _MIDDLE)
    gaps, left = np.diff(inky) - 1, inky[:-1] + 1
    middle = left + gaps / 2
    inside = np.flatnonzero((middle > low) & (middle < high))
    if not len(inside):
        return 0, 0.0
    k = int(inside[np.argmax(gaps[inside])])
    return int(gaps[k]), float(middle[k])
