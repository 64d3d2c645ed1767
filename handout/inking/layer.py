"""One glyph's ink on the page that is written, before it is laid on the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.values import Array


@dataclass(frozen=True, eq=False)
class Layer:
    """The ink of one glyph.

    rgba : (h, w, 4) float32, premultiplied.
    near : (h, w) int32: number of the nearest vertex, −1 where the line is out of reach.
    corner : (x, y) of its first pixel on the page.
    xy : (n, 2) float, pixels of the page: vertices of the line.
    radius : (n,) float, pixels.
    twice : (n,) complex: direction of the line, its angle doubled; shorter than 1 where there are several.
    loose : (n,) bool: ends of lines.
    """

    rgba: NDArray[np.float32]
    near: NDArray[np.int32]
    corner: tuple[int, int]
    xy: Array
    radius: Array
    twice: NDArray[np.complex128]
    loose: NDArray[np.bool_]

    def view(self, window: tuple[int, int, int, int]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Ink and nearest vertices in a window (left, top, right, bottom) of the page that lies within the layer."""
        left, top, right, bottom = window
        (x, y) = self.corner
        part = np.s_[top - y : bottom - y, left - x : right - x]
        return self.rgba[part], self.near[part]
