"""Scanned RGB as CIE colours, and how different two colours look: colour-science with the white of a flatbed.

A flatbed's RGB is read as sRGB: decoded by its transfer function, taken to XYZ by its primaries, with its white
(D65) as the white of L*a*b*.  The scanner is no colorimeter, so these are colours as this scanner sees them; for the
closed loop of one scanner that is what has to agree.

Source: IEC 61966-2-1 (sRGB), CIE 15 (L*a*b*), Sharma, Wu and Dalal 2005 (CIEDE2000), as in colour-science.
"""

from __future__ import annotations

import warnings
from functools import cache
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from handout.values import Array

# linear sRGB to XYZ under D65, and with Bradford adaptation under D50.  B. Lindbloom, "RGB/XYZ matrices": of the
# primaries of IEC 61966-2-1 and the whites of ASTM E308.  The matrix of colour-science is rounded to four digits,
# and the tables of stored calibrations rest on these
_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
_TO_XYZ_D50 = np.array(
    [[0.4360747, 0.3850649, 0.1430804], [0.2225045, 0.7168786, 0.0606169], [0.0139322, 0.0971045, 0.7141733]]
)
_WHITE = _TO_XYZ.sum(axis=1)


@cache
def science() -> ModuleType:
    """colour-science, loaded when the first colour is converted: it takes 0.7 s, and cannot be loaded in parts."""
    with warnings.catch_warnings():
        # it warns at import that it cannot draw diagrams
        warnings.simplefilter("ignore")
        import colour
    return colour


def linear(rgb: ArrayLike) -> Array:
    """(…, 3) light of encoded sRGB values; below 0 the straight part of the curve goes on."""
    return np.asarray(science().models.eotf_sRGB(np.asarray(rgb, dtype=np.float64)))


def xyz(rgb: ArrayLike) -> Array:
    """(…, 3) CIE XYZ of scanned RGB (0–1 encoded), Y of white 1."""
    return np.asarray(linear(rgb) @ _TO_XYZ.T)


def xyz_d50(rgb: ArrayLike) -> Array:
    """(…, 3) CIE XYZ under D50 of scanned RGB (0–1 encoded), Y of white 100, as profiles and CGATS tables have it."""
    return np.asarray(100 * linear(rgb) @ _TO_XYZ_D50.T)


def rgb_of_xyz_d50(colours: Array) -> Array:
    """(n, 3) scanned RGB, not cut to 0–1; the inverse of `xyz_d50`."""
    return np.asarray(science().models.eotf_inverse_sRGB(np.linalg.solve(100 * _TO_XYZ_D50, colours.T).T))


def lab(rgb: ArrayLike) -> Array:
    """(…, 3) CIE L*a*b* (D65) of scanned RGB (0–1 encoded)."""
    return lab_of_xyz(xyz(rgb), _WHITE)


def lab_of_xyz(colours: ArrayLike, white: Array) -> Array:
    """(…, 3) CIE L*a*b* of XYZ (…, 3), with (3,) XYZ as white."""
    models = science().models
    return np.asarray(models.XYZ_to_Lab(np.asarray(colours) / white[1], models.XYZ_to_xy(white)))


def xyz_of_lab(colours: ArrayLike, white: Array) -> Array:
    """(…, 3) XYZ of CIE L*a*b* (…, 3), with (3,) XYZ as white."""
    models = science().models
    return np.asarray(models.Lab_to_XYZ(np.asarray(colours), models.XYZ_to_xy(white)) * white[1])


def delta_e(first: ArrayLike, second: ArrayLike) -> Array:
    """(…,) CIEDE2000 difference of L*a*b* colours (…, 3), all parametric factors 1."""
    return np.asarray(science().difference.delta_E_CIE2000(first, second))


def bend_chroma(lab: Array) -> Array:
    """(…, 3) of L*a*b*, bent so that distances come near ΔE00: C* becomes ln(1 + 0.045 C*) / 0.045.

    Source: the weight of chroma in CIE 116-1995 (CIE94), integrated.
    """
    chroma = np.hypot(lab[..., 1], lab[..., 2])
    shrink = np.log1p(0.045 * chroma) / (0.045 * np.maximum(chroma, 1e-9))
    return np.stack([lab[..., 0], lab[..., 1] * shrink, lab[..., 2] * shrink], axis=-1)
