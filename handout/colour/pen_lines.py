"""Lines of a pen in a picture, sorted by how far a pixel lies from the edge of its line.

How dark a pixel is depends on the scanner's settings.  How far it lies from the edge of its line does not, and neither
does which pixels are the darker ones among those that lie equally far.  So lines of one pen in two scans can be
compared though the tones of the scans differ, and though one of them was written with more pressure and is wider.

Source: own method.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, readonly

_DENSEST = 3.0  # density of what shows as 0, of which nothing is known but that it is dark
_SOFT = 0.06  # mm, standard deviation of the smoothing before lines are looked for
_HALF = 0.5  # of the core's density: there a line ends
_NOISE = 4.0  # standard deviations of bare paper by which ink is denser
_FAINTEST = 0.05  # density under which nothing is taken for ink
_RING = 0.085  # mm, a pixel of 300 dpi
_ENDS = (-1.5, -0.5, 0.5, 1.5, 2.5)  # where rings about the edge end, in units of their width
_THICK = 0.6  # mm from its edge: no line has that, but what was filled in
LEAST = 40  # pixels of a ring; fewer tell nothing

Density = NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False)
class LineDensities:
    """Densities, −ln(pixel / paper), in and about lines of ink.

    rings : of each ring about the edges of lines, from the core outwards, (n, 3); n differs.
    length : of all lines, mm, about.
    """

    rings: tuple[Array, ...]
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "rings", tuple(readonly(ring, None, 3) for ring in self.rings))

    @property
    def densest(self) -> Array:
        """(3,) density of the lines' cores, nearly all of which are paler."""
        return np.asarray(np.quantile(np.concatenate(self.rings[:2]), 0.9, axis=0))


def density_of(picture: NDArray[Any], paper: Array) -> NDArray[np.float32]:
    """(…, 3) densities of a picture (…, 3), 0–1, on bare paper (3,) or (…, 3)."""
    ratio = np.asarray(picture, dtype=np.float32) / np.maximum(np.asarray(paper, dtype=np.float32), 1e-3)
    return np.asarray(-np.log(np.maximum(ratio, math.exp(-_DENSEST))), dtype=np.float32)


def strokes_in(density: Density, dpi: float, tone: Callable[[Density], Density] | None = None) -> LineDensities | None:
    """The lines in a picture of writing; None where there is no ink.

    Parameters
    ----------
    density : (h, w, 3), of its pixels.
    dpi : pixels an inch.
    tone : (n, 3) → (n, 3), optional
        Densities as another scan shows them: edges are looked for in that.
    """
    import cv2

    pixel = 25.4 / dpi
    shown = density if tone is None else tone(density.reshape(-1, 3)).reshape(density.shape)
    dark = cv2.GaussianBlur(shown.mean(axis=2).astype(np.float32), (0, 0), max(0.4, _SOFT / pixel))
    core = _core_density(np.asarray(dark))
    if core is None:
        return None
    lines = (dark > _HALF * core).astype(np.uint8)
    depth = np.asarray(cv2.distanceTransform(lines, cv2.DIST_L2, 5)) * pixel
    away = np.asarray(cv2.distanceTransform(1 - lines, cv2.DIST_L2, 5)) * pixel
    beyond = np.where(lines > 0, pixel / 2 - depth, away - pixel / 2)
    # where something was filled in that is no line, with its edges
    reach = 2 * math.ceil(_THICK / pixel) + 5
    beyond[cv2.dilate((depth > _THICK).astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0] = np.inf
    bounds = (-np.inf, *(max(_RING, pixel) * end for end in _ENDS))
    rings = tuple(density[(beyond > low) & (beyond <= high)].astype(np.float64) for low, high in pairwise(bounds))
    if not (beyond <= 0).any() or sum(map(len, rings[:2])) < LEAST:
        return None
    width = 2 * max(float(np.quantile(depth[beyond <= 0], 0.9)), pixel)
    return LineDensities(rings, float((beyond <= 0).sum()) * pixel**2 / width)


def _core_density(dark: NDArray[Any]) -> float | None:
    """Density of the middle of lines; None where nothing is denser than paper is uneven."""
    middle = float(np.median(dark))
    bare = dark[dark <= middle]
    noise = 1.4826 * float(np.median(np.abs(bare - np.median(bare))))
    inked = dark[dark > middle + max(_NOISE * noise, _FAINTEST)]
    if len(inked) < LEAST:
        return None
    # most of what is inked at all is edge: the core is found among the denser half
    return float(np.median(inked[inked > _HALF * np.quantile(inked, 0.95)]))
