"""What vector outputs share: widths, and numbers written short."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from handout.inking.curves import Curve
from handout.values import Stroke


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


def joined(thousandths: list[int]) -> str:
    """Numbers of three decimals side by side; a minus sign serves as the separator where there is one."""
    return " ".join(map(short, thousandths)).replace(" -", "-")
