"""What pictures of strokes share: widths, numbers written short, and the moves of a lifted pen."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.inking.curves import Curve
from handout.libraries import cv2
from handout.values import Array, Drawing, Stroke

TRAVEL_COLOUR = "#c8503c"
TRAVEL_WIDTH = 0.15  # mm


def stroke_width(stroke: Stroke, pen_width: float) -> float:
    """mm: the stroke's mean width, or that of the pen where it has none of its own."""
    return pen_width if stroke.width is None else max(float(stroke.width.mean()), 0.02)


def microns(curve: Curve) -> NDArray[np.int64]:
    """(3 k − 2, 2) control points in whole µm: the precision at which vector outputs are written."""
    return np.rint(curve.points * 1000).astype(np.int64)


@lru_cache(maxsize=1 << 16)
def short(thousandths: int) -> str:
    """``-1.25`` for −1250, ``.5`` for 500: a number of three decimals in as few characters as there can be."""
    whole, part = divmod(abs(thousandths), 1000)
    digits = f"{whole or ''}.{part:03d}".rstrip("0").rstrip(".") if part else str(whole)
    return f"-{digits}" if thousandths < 0 else digits


def join_numbers(thousandths: list[int]) -> str:
    """Numbers of three decimals side by side; a minus sign serves as the separator where there is one."""
    return " ".join(map(short, thousandths)).replace(" -", "-")


def travel_moves(drawing: Drawing) -> list[Array]:
    """(n, 2) float, mm, for each: from the end of a stroke to the beginning of the next.

    Where a plotter does something in between, ``about["hooks"]`` has its way, as `plotting` writes it: the stroke that
    comes after it, its places.  Ways before the first stroke and after the last come last.
    """
    moves = [np.stack([a.xy[-1], b.xy[0]]) for a, b in pairwise(plotted_strokes(drawing))]
    around: list[Array] = []
    for way in hook_ways(drawing):
        if 0 < way["stroke"] <= len(moves):
            moves[way["stroke"] - 1] = np.array(way["way"], dtype=float)
        elif len(way["way"]) > 1:
            around.append(np.array(way["way"], dtype=float))
    return moves + around


def plotted_strokes(drawing: Drawing) -> Sequence[Stroke]:
    """The strokes that are drawn: all, or those from and to before the two that ``about["part"]`` says."""
    first, stop, *_ = drawing.about.get("part") or (0, len(drawing.strokes))
    return drawing.strokes[first:stop]


def hook_ways(drawing: Drawing) -> list[dict[str, Any]]:
    """What a plotter does besides drawing: name, the stroke that comes after it, and its way, mm on the page."""
    return list(drawing.about.get("hooks") or [])


def travel_over(picture: NDArray[np.uint8], drawing: Drawing, dpi: float) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: a picture of the whole page with the moves drawn over it."""
    from handout.inking.pen import rgb

    scale, shift = dpi / 25.4, 4  # fractions of pixels that cv2 knows, as a power of two
    colour = tuple(round(255 * part) for part in rgb(TRAVEL_COLOUR))
    width = max(round(TRAVEL_WIDTH * scale), 1)
    page = np.ascontiguousarray(picture)
    for move in travel_moves(drawing):
        points = np.rint((move * scale - 0.5) * (1 << shift)).astype(np.int32)
        cv2.polylines(page, [points], False, colour, width, cv2.LINE_AA, shift)
    return page
