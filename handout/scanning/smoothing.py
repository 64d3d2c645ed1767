"""Smoothing the edge of the ink along the line: rough pencil and wide pens, not thin ballpoint.

Source: seed 000, Appendix B; with the sign of eq. 14 corrected: a neighbour at offset n̄ stands n̂·n̄ *higher* in the
field, so that its estimate of this pixel is s_j − n̂·n̄.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LEAST_WIDTH = 6.0  # pixels: thinner lines are broken, not smoothed
_DX = np.array([-1, 0, 1, 1, 1, 0, -1, -1], dtype=np.int32)  # around the pixel, each adjacent to the next
_DY = np.array([-1, -1, -1, 0, 1, 1, 1, 0], dtype=np.int32)
_UNIT = (np.stack([_DX, _DY], axis=1) / np.hypot(_DX, _DY)[:, None]).astype(np.float32)
# Batcher's odd-even merge sort of eight
_NETWORK = (
    (0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (1, 2), (5, 6),
    (0, 4), (1, 5), (2, 6), (3, 7), (2, 4), (3, 5), (1, 2), (3, 4), (5, 6),
)  # fmt: skip
_BAND = 2.5  # pixels from the edge


def smooth(mask: NDArray[np.bool_], passes: int = 2) -> NDArray[np.bool_]:
    """The mask (h, w) with its edges smoothed along the line.

    Only for lines at least `LEAST_WIDTH` wide; the caller decides.
    """
    field = np.pad(signed_distance(mask), 1, mode="edge")
    near = np.abs(field) < _BAND
    near[[0, -1]] = near[:, [0, -1]] = False
    where = np.flatnonzero(near)
    flat = field.ravel()
    for _ in range(passes):
        new = flat.copy()
        for start in range(0, len(where), 200_000):
            part = where[start : start + 200_000]
            new[part] = _estimate(flat, part, field.shape[1])
        flat = new
    return np.asarray(flat.reshape(field.shape)[1:-1, 1:-1] <= 0)


def signed_distance(mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """(h, w) float32: distance from the edge of the ink, pixels, negative inside."""
    import cv2

    ink = mask.astype(np.uint8)
    inside = cv2.distanceTransform(ink, cv2.DIST_L2, 5)
    outside = cv2.distanceTransform(1 - ink, cv2.DIST_L2, 5)
    return np.where(mask, 0.5 - inside, outside - 0.5).astype(np.float32)


def _estimate(flat: NDArray[np.float32], where: NDArray[np.intp], width: int) -> NDArray[np.float32]:
    """New values (n,) at `where`: by the direction, of eight, on which the neighbours agree best."""
    around = np.stack([flat[where + step] for step in _DY * width + _DX])
    rise = (around - flat[where]) / np.hypot(_DX, _DY).astype(np.float32)[:, None]
    best = np.full(len(where), np.inf, dtype=np.float32)
    value = flat[where].copy()
    for k in range(8):
        pair = rise[[k, k - 7]]
        size = [_UNIT[[k, k - 7], axis] @ pair for axis in (0, 1)]
        length = np.hypot(*size)
        steep = length > 1e-3
        x, y = (part / np.maximum(length, 1e-3) for part in size)
        guess = [around[j] - (x * np.float32(_DX[j]) + y * np.float32(_DY[j])) for j in range(8)]
        middle = _median_of_eight(guess)
        disagree = _median_of_eight([np.abs(one - middle) for one in guess])
        better = steep & (disagree < best)
        best[better], value[better] = disagree[better], middle[better]
    return value


def _median_of_eight(values: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Median of eight arrays, element by element: a sorting network is ten times as fast as sorting."""
    row = list(values)
    for i, j in _NETWORK:
        row[i], row[j] = np.minimum(row[i], row[j]), np.maximum(row[i], row[j])
    return np.asarray((row[3] + row[4]) * np.float32(0.5))
