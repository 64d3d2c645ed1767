"""Light that a sheet sends back: spectra from 400 to 700 nm, and the colours that they are under D50."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from handout.colour import conversions
from handout.values import Array, readonly

WAVELENGTHS = readonly(np.arange(400, 701, 10), None)  # nm
# three wide bands of light that add up to 1: where one passes into the next, nm, and how softly
_PASSES = ((492.0, 6.0), (582.0, 5.0))


@cache
def observer() -> Array:
    """(31, 3) float: a spectrum of reflectance times this is XYZ under D50, perfect white Y = 1.

    Source: CIE 1931 2° standard observer, CIE illuminant D50, as in colour-science.
    """
    tables = conversions.science().colorimetry
    matching = tables.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"][WAVELENGTHS]
    weights = matching * tables.SDS_ILLUMINANTS["D50"][WAVELENGTHS][:, None]
    return readonly(weights / weights[:, 1].sum(), None, 3)


def xyz(spectra: ArrayLike) -> Array:
    """(…, 3) XYZ, D50, white Y = 1, of spectra (…, 31) of reflectance."""
    return np.asarray(np.asarray(spectra) @ observer())


def lab(colours: ArrayLike) -> Array:
    """(…, 3) CIE L*a*b* of XYZ (…, 3); white is a spectrum of ones."""
    return conversions.lab_of_xyz(colours, observer().sum(axis=0))


def xyz_of_lab(colours: ArrayLike) -> Array:
    """(…, 3) XYZ of L*a*b* (…, 3), the reverse of `lab`."""
    return conversions.xyz_of_lab(colours, observer().sum(axis=0))


def smooth(colours: ArrayLike) -> Array:
    """(n, 31) the spectra of XYZ (n, 3) that are made of three wide bands of light; linear in the colour.

    A measurement that is only a colour is given a spectrum so.  What is more saturated than the bands can be gets
    values a little outside 0–1.
    """
    short = 1 / (1 + np.exp((WAVELENGTHS - _PASSES[0][0]) / _PASSES[0][1]))
    long = 1 / (1 + np.exp((_PASSES[1][0] - WAVELENGTHS) / _PASSES[1][1]))
    bands = np.stack([long, 1 - short - long, short])
    return np.asarray(np.asarray(colours) @ np.linalg.inv(xyz(bands)) @ bands)
