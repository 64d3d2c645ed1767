"""Many small pictures side by side in one, so that what is done to each is done once to all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Cell = tuple[slice, slice]


@dataclass(frozen=True, eq=False)
class Atlas:
    """Where the pictures lie.

    corner : (n, 2) int: x and y of their first pixels.
    size : (n, 2) int: their widths and heights.
    shape : (height, width) of all.
    """

    corner: NDArray[np.intp]
    size: NDArray[np.intp]
    shape: tuple[int, int]

    def cells(self) -> list[Cell]:
        """What to index the whole with for each picture."""
        ends = (self.corner + self.size).tolist()
        return [np.s_[y:b, x:r] for (x, y), (r, b) in zip(self.corner.tolist(), ends, strict=True)]


def pack(size: NDArray[np.intp], gap: int) -> Atlas:
    """Pictures (n, 2), width and height, in rows, high ones first, with a gap around each."""
    whole = size + gap
    width = gap + max(int(whole[:, 0].max()), int(np.sqrt(whole.prod(axis=1).sum())) // gap * gap)
    corner, x, y, end = np.empty_like(size), width, 0, gap
    for k in np.argsort(-size[:, 1], kind="stable").tolist():
        w, h = whole[k].tolist()
        if x + w > width:
            x, y, end = gap, end, end + h
        corner[k] = x, y
        x += w
    return Atlas(corner, size, (end, width))
