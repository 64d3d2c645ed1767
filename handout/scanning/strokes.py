"""Marks of strokes on a mask that tell where lines are: left edges, feet, tops; and how strokes slant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from handout.values import Array

_SLANTS = np.arange(-0.5, 1.5001, 0.05)
_USUAL, _UNUSUAL = 0.2, 1.2  # slants of people
_ROWS = 0.1  # mm between rows of left edges: at 600 dpi every row would only cost time
_UNDERLINE = 12.0  # mm: longer runs of ink are underlines


class _Baseline(Protocol):
    """What is asked of a line here."""

    @property
    def left(self) -> float:
        """x of its first ink, mm."""

    @property
    def right(self) -> float:
        """x of its last ink, mm."""

    def baseline(self, x: Array | float) -> Array:
        """y at x, mm."""


@dataclass(frozen=True, eq=False)
class Marks:
    """Places (n, 2), mm: where runs of ink begin, strokes have no ink right beneath, and none right above.

    over : (n,) mm: how far the next ink above each of `top` is.
    """

    left: Array
    foot: Array
    top: Array
    over: Array


def find_marks(mask: NDArray[np.bool_], dpi: float) -> Marks:
    """The marks of a mask (h, w)."""
    pixel = 25.4 / dpi
    row, begin, end = spans(mask)
    short = (end - begin) * pixel < _UNDERLINE
    every = max(1, int(_ROWS / pixel))
    own = short & (row % every == 0)
    left = np.stack([begin[own], row[own]], axis=1) * pixel
    foot = _ends(mask, row[short], begin[short], end[short], 1)
    top = _ends(mask, row[short], begin[short], end[short], -1)
    return Marks(left, foot * pixel, top * pixel, _free_above(mask, top) * pixel)


def _free_above(mask: NDArray[np.bool_], top: Array) -> Array:
    """(n,) pixels: from each place to the next ink above it, or to the edge."""
    number = np.arange(1, mask.shape[0] + 1, dtype=np.int32)[:, None]
    last = np.maximum.accumulate(np.where(mask, number, 0), axis=0)
    y, x = top[:, 1].astype(np.intp), top[:, 0].astype(np.intp)
    return np.asarray(np.where(y > 0, y - last[np.maximum(y - 1, 0), x], y), dtype=np.float64)


def spans(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Row, first column and the column after the last of every run of ink (h, w), row by row."""
    padded = np.zeros((mask.shape[0], mask.shape[1] + 2), dtype=np.int8)
    padded[:, 1:-1] = mask
    change = np.diff(padded, axis=1)
    row, begin = np.nonzero(change == 1)
    return row, begin, np.nonzero(change == -1)[1]


def _ends(
    mask: NDArray[np.bool_], row: NDArray[np.intp], begin: NDArray[np.intp], end: NDArray[np.intp], way: int
) -> Array:
    """Middles (n, 2), pixels, of the runs without ink in the next row: below for `way` 1, above for −1."""
    height, width = mask.shape
    counts = np.zeros((height + 2, width + 1), dtype=np.int32)
    np.cumsum(mask, axis=1, out=counts[1:-1, 1:])
    beside = counts[row + 1 + way, np.minimum(end + 1, width)] - counts[row + 1 + way, np.maximum(begin - 1, 0)]
    free = beside == 0
    # the run's own outer edge: the foot of a stroke is where its ink ends
    return np.stack([(begin + end)[free] / 2, row[free] + (1.0 if way > 0 else 0.0)], axis=1)


def slant_of(mask: NDArray[np.bool_], dpi: float, lines: Sequence[_Baseline], x_height: float) -> float:
    """dx/dy of the letters, upwards: the shear under which the columns of a line hold ink most unevenly.

    All lines vote together, each as much as the other, and for the whole letters and their ascenders alike: upstrokes
    that join letters slant more than stems, and in a short line may be more.

    Source: alignment specification, recipe 4.
    """
    pixel = 25.4 / dpi
    coarse = max(x_height / 14, pixel)
    votes = np.zeros(len(_SLANTS))
    for line in lines:
        x, height = _above(mask, pixel, line, x_height)
        for own in (height > -np.inf, height > 0.8 * x_height):
            if own.sum() < 100:
                continue
            held = [float(np.square(_columns((x - s * height)[own], coarse)).sum()) for s in _SLANTS]
            votes += np.array(held) / max(held)
    if not votes.any():
        return 0.0
    votes *= np.exp(-0.5 * ((_SLANTS - _USUAL) / _UNUSUAL) ** 2)
    k = int(np.argmax(votes))
    return float(_SLANTS[k]) + 0.05 * _peak_offset(votes, k)


def _above(mask: NDArray[np.bool_], pixel: float, line: _Baseline, x_height: float) -> tuple[Array, Array]:
    """x and height over the baseline, mm, of the ink of a line, from its feet to its ascenders."""
    x0, x1 = max(0, int(line.left / pixel)), min(mask.shape[1], int(line.right / pixel) + 1)
    ends = line.baseline(np.linspace(line.left, line.right, 3))
    y0 = max(0, int((ends.min() - 2.2 * x_height) / pixel))
    y1 = min(mask.shape[0], int((ends.max() + 0.3 * x_height) / pixel) + 1)
    y, x = np.nonzero(mask[y0:y1, x0:x1])
    place = np.asarray((x + x0 + 0.5) * pixel, dtype=np.float64)
    height = line.baseline(place) - (y + y0 + 0.5) * pixel
    own = (height > -0.2 * x_height) & (height < 2.0 * x_height)
    # pixels stand in columns: spread over their width, or an upright page would look the evenest
    spread = (np.arange(len(place)) * 0.618034 % 1 - 0.5) * pixel
    return (place + spread)[own], height[own]


def _columns(x: Array, width: float) -> Array:
    return np.bincount(((x - x.min()) / width).astype(np.intp)).astype(np.float64)


def _peak_offset(held: Array, k: int) -> float:
    """Where the parabola through a peak and its neighbours is highest, in steps from the peak."""
    if not 0 < k < len(held) - 1:
        return 0.0
    a, b, c = held[k - 1 : k + 2]
    bow = a - 2 * b + c
    return float(np.clip(0.5 * (a - c) / bow, -0.5, 0.5)) if bow < 0 else 0.0
