"""Pages of ink drawn for the tests: known lines, known colours."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from handout.scanning.scan import Scan

BLUE = (0.25, 0.30, 0.60)


def scribble(seed: int, x0: float, x1: float, baseline: float, height: float) -> list[NDArray[np.float64]]:
    """Strokes like joined letters, mm: words of arches with ascenders between them."""
    rng = np.random.default_rng(seed)
    strokes, x = [], x0
    while x < x1 - 6 * height:
        letters = int(rng.integers(3, 7))
        t = np.linspace(0, letters, 60 * letters)
        tall = 1 + 1.0 * (rng.random(letters)[np.minimum(t.astype(int), letters - 1)] < 0.2)
        y = baseline - height * tall * 0.5 * (1 - np.cos(2 * np.pi * t))
        strokes.append(np.stack([x + 0.9 * height * t, y], axis=1))
        x += 0.9 * height * letters + 1.2 * height
    return strokes


def lines_of(
    count: int, width: float, pitch: float = 9.0, height: float = 2.4, fall: float = 0.0
) -> list[NDArray[np.float64]]:
    """Strokes of a page of so many lines, mm; the first baseline lies at 12 mm."""
    strokes = []
    for k in range(count):
        for stroke in scribble(k, 8.0, width - 8.0, 12.0 + k * pitch, height):
            x, y = stroke.T
            strokes += [np.stack([x, y + fall * (x - width / 2)], axis=1)]
    return strokes


def coverage(
    strokes: list[NDArray[np.float64]], width: float, height: float, dpi: float, pen: float = 0.45
) -> NDArray[np.float32]:
    """(h, w) float32 in 0–1: how much of each pixel a pen `pen` mm wide covers."""
    times = 4
    scale = dpi / 25.4 * times
    big = np.zeros((round(height * dpi / 25.4) * times, round(width * dpi / 25.4) * times), dtype=np.uint8)
    for stroke in strokes:
        points = np.rint((stroke * scale - 0.5) * 16).astype(np.int32)  # 0 is the middle of a pixel there
        cv2.polylines(big, [points], False, 255, max(1, round(pen * scale)), cv2.LINE_AA, 4)
    small = cv2.resize(big, None, fx=1 / times, fy=1 / times, interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(small, (0, 0), 0.6 * dpi / 300).astype(np.float32) / 255


def scan_of(
    ink: NDArray[np.float32],
    dpi: float = 300.0,
    colour: tuple[float, float, float] = BLUE,
    paper: float | NDArray[np.float64] = 0.97,
    noise: float = 0.006,
    seed: int = 1,
) -> Scan:
    """A scan of ink on paper (a level, or (h, w, 3)), with grain."""
    ground = np.broadcast_to(np.asarray(paper, dtype=np.float64), (*ink.shape, 3))
    mixed = ground * (1 - ink[:, :, None] * (1 - np.asarray(colour)))
    mixed = mixed + np.random.default_rng(seed).normal(0, noise, mixed.shape)
    return Scan(np.clip(np.rint(mixed * 255), 0, 255).astype(np.uint8), dpi)


def page(count: int = 4, dpi: float = 300.0, **options: object) -> Scan:
    """A scan of `count` lines of writing, 100 mm wide."""
    return scan_of(coverage(lines_of(count, 100.0), 100.0, 12.0 + 9.0 * count, dpi), dpi, **options)  # type: ignore[arg-type]
