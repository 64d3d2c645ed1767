"""Scanned RGB as CIE colours, and how different two colours look.

A flatbed's RGB is read as sRGB: decoded by its transfer function, taken to XYZ by its primaries, with its white
(D65) as the white of L*a*b*.  The scanner is no colorimeter, so these are colours as this scanner sees them; for the
closed loop of one scanner that is what has to agree.

Source: IEC 61966-2-1 (sRGB), CIE 15 (L*a*b*), Sharma, Wu and Dalal 2005 (CIEDE2000).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from handout.values import Array

_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
_WHITE = _TO_XYZ.sum(axis=1)
_EPSILON, _KAPPA = 216 / 24389, 24389 / 27
_FAR = 25.0**7


def linear(rgb: ArrayLike) -> Array:
    """(…, 3) light of encoded sRGB values; below 0 the straight part of the curve goes on."""
    encoded = np.asarray(rgb, dtype=np.float64)
    curved = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curved)


def xyz(rgb: ArrayLike) -> Array:
    """(…, 3) CIE XYZ of scanned RGB (0–1 encoded), Y of white 1."""
    return np.asarray(linear(rgb) @ _TO_XYZ.T)


def lab(rgb: ArrayLike) -> Array:
    """(…, 3) CIE L*a*b* (D65) of scanned RGB (0–1 encoded)."""
    ratio = xyz(rgb) / _WHITE
    f = np.where(ratio > _EPSILON, np.cbrt(np.maximum(ratio, _EPSILON)), (_KAPPA * ratio + 16) / 116)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def evened(lab: Array) -> Array:
    """(…, 3) of L*a*b*, bent so that distances come near ΔE00: C* becomes ln(1 + 0.045 C*) / 0.045.

    Source: the weight of chroma in CIE 116-1995 (CIE94), integrated.
    """
    chroma = np.hypot(lab[..., 1], lab[..., 2])
    shrink = np.log1p(0.045 * chroma) / (0.045 * np.maximum(chroma, 1e-9))
    return np.stack([lab[..., 0], lab[..., 1] * shrink, lab[..., 2] * shrink], axis=-1)


def delta_e(one: ArrayLike, other: ArrayLike) -> Array:
    """(…,) CIEDE2000 difference of L*a*b* colours (…, 3), all parametric factors 1.

    Source: Sharma, Wu and Dalal 2005, equations 2–22.
    """
    first, second = np.asarray(one, dtype=np.float64), np.asarray(other, dtype=np.float64)
    chroma = (np.hypot(first[..., 1], first[..., 2]) + np.hypot(second[..., 1], second[..., 2])) / 2
    stretch = 1.5 - 0.5 * np.sqrt(chroma**7 / (chroma**7 + _FAR))
    a, b = first[..., 1] * stretch, second[..., 1] * stretch
    c1, c2 = np.hypot(a, first[..., 2]), np.hypot(b, second[..., 2])
    h1 = np.arctan2(first[..., 2], a) % (2 * np.pi)
    h2 = np.arctan2(second[..., 2], b) % (2 * np.pi)
    turn = (h2 - h1 + np.pi) % (2 * np.pi) - np.pi
    hue = np.where(c1 * c2 == 0, h1 + h2, h1 + turn / 2)
    lightness = second[..., 0] - first[..., 0]
    tone = 2 * np.sqrt(c1 * c2) * np.sin(turn / 2)
    return _combined(lightness, c2 - c1, tone, (first[..., 0] + second[..., 0]) / 2, (c1 + c2) / 2, hue)


def _combined(lightness: Array, chroma: Array, tone: Array, middle: Array, c: Array, hue: Array) -> Array:
    """Equations 15–22: differences weighted by where they lie."""
    t = (
        1
        - 0.17 * np.cos(hue - np.pi / 6)
        + 0.24 * np.cos(2 * hue)
        + 0.32 * np.cos(3 * hue + np.pi / 30)
        - 0.20 * np.cos(4 * hue - 63 * np.pi / 180)
    )
    degrees = np.degrees(hue) % 360
    turned = np.radians(60 * np.exp(-(((degrees - 275) / 25) ** 2)))
    rotation = -2 * np.sqrt(c**7 / (c**7 + _FAR)) * np.sin(turned)
    light = lightness / (1 + 0.015 * (middle - 50) ** 2 / np.sqrt(20 + (middle - 50) ** 2))
    strong = chroma / (1 + 0.045 * c)
    toned = tone / (1 + 0.015 * c * t)
    return np.asarray(np.sqrt(np.maximum(light**2 + strong**2 + toned**2 + rotation * strong * toned, 0)))
