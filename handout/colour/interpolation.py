"""Looking colours up in a 3-D table: each cell is cut into six tetrahedra that share its grey diagonal.

Source: Kasson, Plouffe and Nin 1993, §3 (tetrahedral interpolation).
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from handout.values import Array

_CHUNK = 16384  # colours at a time, so that what is in between stays in the cache

Nodes = NDArray[np.float32]
_Float = TypeVar("_Float", np.float32, np.float64)


def look_up(nodes: Nodes, colours: Array | NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, k) float32 values of an even (s, s, s, k) table over the cube at (n, 3) `colours`.

    Colours outside 0–1 take the value of the nearest point of the cube.
    """
    side, width = nodes.shape[0], nodes.shape[3]
    flat = np.ascontiguousarray(nodes.reshape(-1, width))
    out = np.empty((len(colours), width), dtype=np.float32)
    for begin in range(0, len(colours), _CHUNK):
        part = slice(begin, begin + _CHUNK)
        corners, shares = parts(side, np.ascontiguousarray(np.asarray(colours[part], dtype=np.float32).T))
        value = flat[corners[0]] * shares[0][:, None]
        for corner, share in zip(corners[1:], shares[1:], strict=True):
            value += flat[corner] * share[:, None]
        out[part] = value
    return out


def parts(side: int, colours: NDArray[_Float]) -> tuple[list[NDArray[np.int32]], list[NDArray[_Float]]]:
    """Of (3, n) colours: the numbers of the four nodes between which each lies, and the share of each node.

    The nodes are met on the way from the cell's dark corner to its light one along the channels, that with the
    largest part of the cell first.
    """
    scaled = np.clip(colours, 0, 1) * colours.dtype.type(side - 1)
    cell = np.minimum(scaled.astype(np.int32), side - 2)
    x, y, z = (scaled - cell).astype(colours.dtype)
    strides = np.array([side * side, side, 1], dtype=np.int32)
    opposite = np.int32(strides.sum())
    corner = (cell[0] * side + cell[1]) * side + cell[2]
    largest, least = np.maximum(np.maximum(x, y), z), np.minimum(np.minimum(x, y), z)
    middle = x + y + z - largest - least
    first = strides[np.where(x == largest, 0, np.where(y == largest, 1, 2))]
    last = strides[np.where(z == least, 2, np.where(y == least, 1, 0))]
    corners = [corner, corner + first, corner + (opposite - last), corner + opposite]
    return corners, [1 - largest, largest - middle, middle - least, least]
