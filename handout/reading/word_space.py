"""Word space: the frame in which words are read as pictures; x-height, baseline and slant are always the same there.

Twelve pixels of x-height are the fewest at which people and networks still tell e from c in a thin pen's writing; a
letter l then stands on 24 rows, and a word of five letters is about 70 columns wide.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.libraries import cv2
from handout.values import Array, Indices

X_HEIGHT = 12  # pixels
ABOVE, BELOW = 27, 13  # rows over and under the baseline: two x-heights and a bit, one and a bit
HEIGHT = ABOVE + BELOW
MARGIN = 8  # columns of paper at both ends of what is read
_INKY = 0.2  # density above which a pixel counts as ink
_LEVEL = 0.75  # quantile of the ink's density that becomes 1: pens are read alike, pale or dark
_FINE = 4  # rows of a drawing a row of the picture that it is reduced to
_SHIFT, _PARTS = 3, 8  # bits, and parts, of a pixel in which lines are drawn
_WIDEST = 4096  # columns of a drawing: more than the longest word, less than fills the memory


def normalised(density: Array) -> NDArray[np.float32]:
    """(HEIGHT, w) float32, 0 paper and 1 ink: a density picture in word space, with the pen's usual density as 1.

    Raises ValueError: the picture has another height.
    """
    picture = np.asarray(density, dtype=np.float32)
    if picture.ndim != 2 or picture.shape[0] != HEIGHT:
        raise ValueError(f"expected ({HEIGHT}, w), got {picture.shape}")
    ink = picture[picture > _INKY]
    level = max(float(np.quantile(ink, _LEVEL)), _INKY) if ink.size else 1.0
    return np.asarray(np.clip(picture / level, 0.0, 1.0), dtype=np.float32)


def drawn(places: Array, radius: Array, edges: Indices) -> Array:
    """(HEIGHT, w): a line graph as a picture, its ink even; what is taller than the picture is pressed into it.

    places : (n, 2) columns from anywhere, and rows over the baseline, pixels of word space.
    radius : (n,) half the width of the line, the same.
    edges : (m, 2) int, pairs of places.
    """
    if not len(places):
        return np.zeros((HEIGHT, 1))
    # heights over the baseline, with ascenders and descenders short enough for the picture
    up, thick = places[:, 1], float(radius.max())
    over, under, high, low = ABOVE - 1 - thick, BELOW - 1 - thick, float(up.max()), -float(up.min())
    if high > over:
        up = np.where(up > X_HEIGHT, X_HEIGHT + (up - X_HEIGHT) * (over - X_HEIGHT) / (high - X_HEIGHT), up)
    up = np.where(up < 0, up * under / low, up) if low > under else up
    left = float((places[:, 0] - radius).min())
    width = min(int(float((places[:, 0] + radius).max()) - left) + 2, _WIDEST)
    fine = np.zeros((HEIGHT * _FINE, width * _FINE), dtype=np.uint8)
    points = np.column_stack([places[:, 0] - left, ABOVE - up]) * (_FINE * _PARTS)
    ends = np.rint(points).astype(np.int32)
    wide = np.maximum(np.rint(2 * _FINE * radius), 1).astype(int)
    of_edge = wide[edges].max(axis=1, initial=1)
    for thickness in np.unique(of_edge).tolist():
        cv2.polylines(fine, list(ends[edges[of_edge == thickness]]), False, 255, thickness, cv2.LINE_8, _SHIFT)
    for dot in np.flatnonzero(np.bincount(edges.ravel(), minlength=len(places)) == 0).tolist():
        cv2.circle(fine, tuple(ends[dot].tolist()), int(wide[dot]) * _PARTS // 2, 255, -1, cv2.LINE_8, _SHIFT)
    return np.asarray(cv2.resize(fine, (width, HEIGHT), interpolation=cv2.INTER_AREA) / 255.0, dtype=np.float64)
