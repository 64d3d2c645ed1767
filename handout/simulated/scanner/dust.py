"""Dust and short hairs on the glass, drawn at any resolution from the same places in mm."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from handout.simulated.scanner.bed import Bed
from handout.simulated.scanner.scanner import Scanner

_HAIRS = 0.2  # of all specks
_FINER = 4  # bits of a pixel's place


def specks(bed: Bed, scanner: Scanner, rng: np.random.Generator) -> NDArray[np.float32] | None:
    """(h, w) float32 in 0–1: light that what lies on the glass lets pass; None where it is clean."""
    import cv2

    area = bed.glass.width * bed.glass.height / 1e4
    count = int(rng.poisson(scanner.dust * area))
    if not count:
        return None
    scale = bed.dpi / 25.4
    clear = np.full(bed.shape, 255, dtype=np.uint8)
    for _ in range(count):
        place = rng.uniform((0.0, 0.0), (bed.glass.width, bed.glass.height)) * scale - 0.5
        grey = round(255 * rng.uniform(0.35, 0.9))
        # most dust is finer than a pen's line
        size = min(0.035 * math.exp(rng.normal(0.0, 0.5)), 0.25) * scale
        if rng.random() < _HAIRS:
            _hair(clear, place, size, grey, scale, rng)
        else:
            middle = tuple(np.rint(place * 2**_FINER).astype(int).tolist())
            cv2.circle(clear, middle, round(size * 2**_FINER), grey, -1, cv2.LINE_AA, _FINER)
    return clear.astype(np.float32) * np.float32(1 / 255)


def _hair(
    clear: NDArray[np.uint8],
    place: NDArray[np.float64],
    size: float,
    grey: int,
    scale: float,
    rng: np.random.Generator,
) -> None:
    """A bent fibre of a millimetre or so."""
    import cv2

    heading = rng.uniform(0, 2 * math.pi) + np.cumsum(rng.normal(0.0, 0.25, 12))
    step = rng.uniform(0.05, 0.2) * scale
    way = place + np.cumsum(step * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    points = np.rint(way * 2**_FINER).astype(np.int32)[:, None]
    cv2.polylines(clear, [points], False, grey, max(1, round(0.7 * size)), cv2.LINE_AA, _FINER)
