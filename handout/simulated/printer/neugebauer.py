"""Halftone colour: how dots of four inks that overlap by chance look together.

Source: Demichel 1924 (shares), Neugebauer 1937 (mean of the overlaps), Yule and Nielsen 1951 (light that spreads in
the paper), Viggiano 1985 (the spectral form).
"""

from __future__ import annotations

import numpy as np

from handout.values import Array

# (16, 4) which inks lie in an overlap; the first is bare paper
OVERLAPS = np.array([[number >> ink & 1 for ink in range(4)] for number in range(16)], dtype=bool)
GREATEST_GAIN = 0.25  # beyond it more ink would cover less


def demichel(coverage: Array) -> Array:
    """(n, 16) share of the sheet that every overlap of `OVERLAPS` covers; rows sum to 1.

    Parameters
    ----------
    coverage : (n, 4) share of the sheet that each ink covers, 0–1.
    """
    weights = np.ones((len(coverage), 1))
    for ink in coverage.T[:, :, None]:
        # in the order of OVERLAPS: the first ink changes fastest
        weights = np.concatenate([weights * (1 - ink), weights * ink], axis=1)
    return weights


def primaries(paper: Array, surface: float, transmittances: Array) -> Array:
    """(16, 31) reflectance of every overlap.

    Parameters
    ----------
    paper : (31,) reflectance of the sheet; surface : share that never reaches ink.
    transmittances : (4, 31) of the solid inks; what lies over one another multiplies (Beer–Lambert).
    """
    through = np.where(OVERLAPS[:, :, None], transmittances[None], 1.0).prod(axis=1)
    return np.asarray(surface + (paper - surface) * through)


def mixed(coverage: Array, overlaps: Array, n: float) -> Array:
    """(m, k) reflectance of a halftone: R = (Σ w_i R_i^(1/n))^n, w after Demichel.

    Parameters
    ----------
    coverage : (m, 4), 0–1; overlaps : (16, k) reflectance; n : Yule–Nielsen factor, 1 (none) and more.
    """
    return np.asarray((demichel(coverage) @ overlaps ** (1 / n)) ** n)


def gained(coverage: Array, gain: float) -> Array:
    """Coverage after dots have grown: a + 4 g a (1 − a), so that a half becomes a half + g.

    Raises
    ------
    ValueError
        A gain outside 0–0.25.
    """
    if not 0 <= gain <= GREATEST_GAIN:
        raise ValueError(f"a gain of {gain:g} is outside 0 to {GREATEST_GAIN:g}")
    return np.asarray(coverage + 4 * gain * coverage * (1 - coverage))


def separated(device: Array) -> Array:
    """(n, 4) cyan, magenta, yellow and black asked for by device RGB (n, 3) in 0–1.

    Black comes in with the square of the grey that the three have in common, and half of it is taken from each of
    them (grey component replacement): 250 % of ink where RGB is 0.
    """
    colour = 1 - device
    black = colour.min(axis=1, keepdims=True) ** 2
    return np.concatenate([colour - black / 2, black], axis=1)
