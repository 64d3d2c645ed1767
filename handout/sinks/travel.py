"""The moves of a lifted pen between strokes, as pictures show them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Drawing

COLOUR = "#c8503c"
WIDTH = 0.15  # mm


def moves(drawing: Drawing) -> list[Array]:
    """(2, 2) float, mm, for each: from the end of a stroke to the beginning of the next."""
    return [np.stack([a.xy[-1], b.xy[0]]) for a, b in pairwise(drawing.strokes)]


def over(picture: NDArray[np.uint8], drawing: Drawing, dpi: float) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: a picture of the whole page with the moves drawn over it."""
    import cv2

    from handout.inking.pen import rgb

    scale, shift = dpi / 25.4, 4  # fractions of pixels that cv2 knows, as a power of two
    colour = tuple(round(255 * part) for part in rgb(COLOUR))
    width = max(round(WIDTH * scale), 1)
    page = np.ascontiguousarray(picture)
    for move in moves(drawing):
        (ax, ay), (bx, by) = np.rint((move * scale - 0.5) * (1 << shift)).astype(int).tolist()
        cv2.line(page, (ax, ay), (bx, by), colour, width, cv2.LINE_AA, shift)
    return page
