"""Square marks in a picture: found in it reduced as far as is good enough, then measured in it in full."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.libraries import cv2
from handout.values import Array

_LARGE = 2400  # pixels; marks are looked for in a picture reduced to this long side, then in larger ones
_CELL = 5.0  # pixels of a cell below which corners are measured in a picture enlarged


def find(
    grey: NDArray[np.uint8],
    dictionary: Any,
    ours: Callable[[int], bool],
    enough: int,
    large: float = _LARGE,
    every: int | None = None,
) -> list[tuple[int, Array]]:
    """Number and corners of every mark of a dictionary.

    grey : (h, w) uint8
    ours : whether a mark of that number counts.
    enough : so many are enough; with fewer a larger picture is searched.
    large : long side in pixels at which the search begins; a picture smaller than half of it is searched enlarged too.
    every : how many marks there are; a first, quick search is made, and is enough if it finds so many.

    Returns ids, each with its (4, 2) corners clockwise from the mark's top left, pixels; pixel (0, 0) has its middle
    at 0, 0.
    """
    thorough = cv2.aruco.DetectorParameters()
    scale = min(1.0, large / max(grey.shape))
    last = max(1.0, min(3.0, round(large / max(grey.shape))))
    best: list[tuple[int, Array]] = []
    if every is not None:
        quick = cv2.aruco.DetectorParameters()
        quick.adaptiveThreshWinSizeMin = quick.adaptiveThreshWinSizeMax
        best = [mark for mark in _detect_marks(grey, scale, dictionary, quick) if ours(mark[0])]
        if len(best) >= every:
            return best
    while True:
        best = max(best, [mark for mark in _detect_marks(grey, scale, dictionary, thorough) if ours(mark[0])], key=len)
        if len(best) >= enough or scale >= last:
            return best
        scale = min(1.0, 2 * scale) if scale < 1.0 else last


def _detect_marks(grey: NDArray[np.uint8], scale: float, dictionary: Any, parameters: Any) -> list[tuple[int, Array]]:
    """Marks of the picture at a scale, their corners in the picture as it is."""
    how = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
    resized = grey if scale == 1.0 else cv2.resize(grey, None, fx=scale, fy=scale, interpolation=how)
    corners, numbers, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(resized)
    # the middle of pixel 0 is at 0, in the resized picture as in the other
    return [
        (int(number), (np.asarray(corner, dtype=np.float64).reshape(4, 2) + 0.5) / scale - 0.5)
        for number, corner in zip(np.ravel(numbers) if numbers is not None else (), corners, strict=True)
    ]


def refine_corners(grey: NDArray[np.uint8], corners: Array, cells: int) -> Array:
    """Corners of marks to a fraction of a pixel.

    grey : (h, w) uint8
    corners : (n, 2) float, pixels: as `find` gives them, the four of a mark after each other.
    cells : along a side of a mark.

    Returns (n, 2) float, pixels; a corner that would stray by more than a cell stays where it was.
    """
    cell = float(np.linalg.norm(corners[1] - corners[0])) / cells
    # where a cell has few pixels, the next edges would be in every window: the picture is enlarged
    larger = max(1, math.ceil(_CELL / cell))
    if larger > 1:
        grey = np.asarray(cv2.resize(grey, None, fx=larger, fy=larger, interpolation=cv2.INTER_CUBIC), dtype=np.uint8)
    reach = max(2, round(0.45 * cell * larger))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 0.01)
    start = ((corners + 0.5) * larger - 0.5).astype(np.float32).reshape(-1, 1, 2)
    moved = cv2.cornerSubPix(grey, start.copy(), (reach, reach), (-1, -1), stop).reshape(-1, 2).astype(np.float64)
    moved = (moved + 0.5) / larger - 0.5
    strayed = np.linalg.norm(moved - corners, axis=1) > cell
    return np.where(strayed[:, None], corners, moved)


def project(matrix: NDArray[Any], points: Array) -> Array:
    """Points (n, 2) under a homography (3, 3)."""
    whole = np.asarray(points, dtype=np.float64) @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(whole[:, :2] / whole[:, 2:])
