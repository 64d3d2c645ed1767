"""What vector outputs share: checked pens, and numbers written short."""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.inking.curves import Curve
from handout.values import Stroke

_HEX = re.compile(r"#(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6})\Z")


def rgb(colour: str) -> tuple[float, float, float]:
    """(r, g, b) in 0–1 of a colour written ``"#1a1a2e"`` or ``"#abc"``.

    Raises
    ------
    InputError
        Anything else.
    """
    if not _HEX.match(colour):
        raise InputError(f'colour: {colour!r} is not a colour; write it as "#rrggbb", such as "#1a1a2e".')
    digits = colour[1:] if len(colour) == 7 else "".join(digit * 2 for digit in colour[1:])
    red, green, blue = (int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4))
    return red, green, blue


def check_width(pen_width: float) -> None:
    """Raise InputError unless `pen_width` is 0.02 to 50 mm."""
    if not 0.02 <= pen_width <= 50:
        raise InputError(f"pen width: {pen_width:g} mm is outside 0.02 to 50 mm.")


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
