"""Light that a sheet sends back: spectra from 400 to 700 nm, and the colours that they are under D50."""

from __future__ import annotations

import warnings
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from handout.values import Array, readonly

WAVELENGTHS = readonly(np.arange(400, 701, 10), None)  # nm
# three wide bands of light that add up to 1: where one passes into the next, nm, and how softly
_PASSES = ((492.0, 6.0), (582.0, 5.0))


@cache
def observer() -> Array:
    """(31, 3) float: a spectrum of reflectance times this is XYZ under D50, perfect white Y = 1.

    Source: CIE 1931 2° standard observer, CIE illuminant D50, as in colour-science.
    """
    with warnings.catch_warnings():
        # colour-science tells at import that it cannot draw diagrams
        warnings.simplefilter("ignore")
        from colour.colorimetry import MSDS_CMFS, SDS_ILLUMINANTS

    matching = MSDS_CMFS["CIE 1931 2 Degree Standard Observer"][WAVELENGTHS]
    weights = matching * SDS_ILLUMINANTS["D50"][WAVELENGTHS][:, None]
    return readonly(weights / weights[:, 1].sum(), None, 3)


def xyz(spectra: ArrayLike) -> Array:
    """(…, 3) XYZ, D50, white Y = 1, of spectra (…, 31) of reflectance."""
    return np.asarray(np.asarray(spectra) @ observer())


def lab(colours: ArrayLike) -> Array:
    """(…, 3) CIE L*a*b* of XYZ (…, 3); white is a spectrum of ones.  Source: CIE 15:2004, §8.2.1."""
    t = np.asarray(colours) / observer().sum(axis=0)
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.stack(
        [116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])],
        axis=-1,
    )


def xyz_of_lab(colours: ArrayLike) -> Array:
    """(…, 3) XYZ of L*a*b* (…, 3), the reverse of `lab`."""
    wanted = np.asarray(colours, dtype=np.float64)
    y = (wanted[..., 0] + 16) / 116
    f = np.stack([y + wanted[..., 1] / 500, y, y - wanted[..., 2] / 200], axis=-1)
    t = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    return np.asarray(t * observer().sum(axis=0))


def smooth(colours: ArrayLike) -> Array:
    """(n, 31) the spectra of XYZ (n, 3) that are made of three wide bands of light; linear in the colour.

    A measurement that is only a colour is given a spectrum so.  What is more saturated than the bands can be gets
    values a little outside 0–1.
    """
    short = 1 / (1 + np.exp((WAVELENGTHS - _PASSES[0][0]) / _PASSES[0][1]))
    long = 1 / (1 + np.exp((_PASSES[1][0] - WAVELENGTHS) / _PASSES[1][1]))
    bands = np.stack([long, 1 - short - long, short])
    return np.asarray(np.asarray(colours) @ np.linalg.inv(xyz(bands)) @ bands)
