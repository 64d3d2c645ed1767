"""Where things lie in an SVG: lengths, transforms and viewports, as maps into mm.

A map is a (2, 3) array: a point p goes to ``m[:, :2] @ p + m[:, 2]``.

Source: SVG 1.1, §7 (coordinate systems, transforms, viewBox, preserveAspectRatio); CSS: 1 px = 1/96 in.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np

from handout.errors import InputError
from handout.pathdata import numbers
from handout.values import Array

PX = 25.4 / 96  # mm
_UNITS = {"": 1.0, "px": 1.0, "mm": 1 / PX, "cm": 10 / PX, "in": 96.0, "pt": 96 / 72, "pc": 16.0, "q": 0.25 / PX}
_LENGTH = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*|%)\s*\Z")
_TRANSFORM = re.compile(r"([a-zA-Z]{1,20})[ ]?\(([^()]*)\)")
_ALIGN = {"xMin": 0.0, "xMid": 0.5, "xMax": 1.0, "YMin": 0.0, "YMid": 0.5, "YMax": 1.0}

IDENTITY: Array = np.eye(2, 3)


def length(text: str | None, whole: float, default: float = 0.0, em: float = 16.0) -> float:
    """A length in px (user units); `whole` is what 100 % means, `em` the size of letters.

    Raises
    ------
    InputError
        Not a length.
    """
    if text is None or not text.strip() or text.strip() == "auto":
        return default
    match = _LENGTH.match(text)
    unit = match.group(2).lower() if match else ""
    units = {**_UNITS, "%": whole / 100, "em": em, "ex": em / 2}
    if match is None or unit not in units:
        raise InputError(f"{text[:30]!r} is not a length")
    value = float(match.group(1)) * units[unit]
    if not math.isfinite(value):
        raise InputError(f"{text[:30]!r} is not a finite length")
    return value


def is_share(text: str | None) -> bool:
    """Whether a length is missing or one of its surroundings, which a file alone does not have."""
    return text is None or text.strip() in ("", "auto") or text.strip().endswith("%")


def compose_maps(outer: Array, inner: Array) -> Array:
    """The map that first does `inner`, then `outer`."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def transform(text: str | None) -> Array:
    """A list of transforms as a map.

    Raises
    ------
    InputError
        One that does not exist, or does not take so many numbers.
    """
    matrix = IDENTITY
    if not text or text.strip() == "none":
        return matrix
    text = " ".join(text.split())
    if _TRANSFORM.sub("", text).strip(" ,"):
        raise InputError(f"the transform {text[:40]!r} cannot be read")
    for name, inside in _TRANSFORM.findall(text):
        try:
            matrix = compose_maps(matrix, _map_of(name, numbers(inside)))
        except (ValueError, TypeError, OverflowError):
            raise InputError(f"the transform {name}({inside[:30]}) cannot be read") from None
    return matrix


def _map_of(name: str, numbers: list[float]) -> Array:
    if name == "matrix":
        a, b, c, d, e, f = numbers
        return np.array([[a, c, e], [b, d, f]])
    if name == "translate":
        return shift(*numbers)
    if name == "scale":
        x, y = numbers * 2 if len(numbers) == 1 else numbers
        return np.array([[x, 0.0, 0.0], [0.0, y, 0.0]])
    if name == "rotate":
        return _rotate(*numbers)
    if name in ("skewX", "skewY"):
        (angle,) = numbers
        tangent = math.tan(math.radians(angle))
        return np.array([[1.0, tangent, 0.0], [0.0, 1.0, 0.0]] if name == "skewX" else [[1, 0, 0], [tangent, 1.0, 0]])
    raise ValueError(name)


def shift(x: float, y: float = 0.0) -> Array:
    """The map that moves everything."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y]])


def _rotate(angle: float, x: float = 0.0, y: float = 0.0) -> Array:
    cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0]])
    return compose_maps(shift(x, y), compose_maps(turn, shift(-x, -y)))


def view_box(text: str | None) -> tuple[float, float, float, float] | None:
    """x, y, width and height of a viewBox; None where there is none that can be used."""
    try:
        x, y, width, height = numbers(text or "")
    except ValueError:
        return None
    return (x, y, width, height) if width > 0 and height > 0 and np.isfinite([x, y, width, height]).all() else None


def viewport(attributes: Mapping[str, str], width: float, height: float) -> Array:
    """From the user units inside an element with a viewBox to those around its upper left corner."""
    box = view_box(attributes.get("viewBox"))
    if box is None or not (width > 0 and height > 0):
        return IDENTITY
    align, _, fit = (attributes.get("preserveAspectRatio") or "xMidYMid").strip().removeprefix("defer ").partition(" ")
    sx, sy = width / box[2], height / box[3]
    if align != "none":
        sx = sy = max(sx, sy) if fit.strip() == "slice" else min(sx, sy)
    left = (width - sx * box[2]) * _ALIGN.get(align[:4], 0.5)
    above = (height - sy * box[3]) * _ALIGN.get(align[4:], 0.5)
    return np.array([[sx, 0.0, left - sx * box[0]], [0.0, sy, above - sy * box[1]]])
