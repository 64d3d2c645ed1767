"""Inks and papers of the simulated printer."""

from __future__ import annotations

import difflib
from dataclasses import dataclass

import numpy as np

from handout.errors import InputError
from handout.simulated import spectra
from handout.values import Array

# cyan, magenta, yellow, black: lobes of optical density as (middle nm, width nm to shorter, to longer waves, height).
# Chosen so that solids on white paper have the colours of a dye inkjet on plain paper; black is never quite neutral.
_LOBES: tuple[tuple[tuple[float, float, float, float], ...], ...] = (
    ((638.0, 62.0, 75.0, 1.45), (385.0, 40.0, 45.0, 0.16)),
    ((546.0, 38.0, 30.0, 1.40), (415.0, 60.0, 55.0, 0.50)),
    ((430.0, 60.0, 42.0, 1.25),),
    ((520.0, 400.0, 400.0, 1.55), (450.0, 60.0, 80.0, 0.08)),
)


@dataclass(frozen=True)
class Paper:
    """What is printed on.

    lab : L*a*b* of the bare sheet under D50.
    gain : how much more of the sheet dots cover than was asked for, where half of it was asked for; 0–0.25.
    surface : share of light that the surface sends back before it reaches any ink, 0–0.1: it decides how dark
        black can be.
    """

    lab: tuple[float, float, float]
    gain: float
    surface: float

    @property
    def spectrum(self) -> Array:
        """(31,) reflectance of the bare sheet."""
        return np.asarray(spectra.smooth(spectra.xyz_of_lab(self.lab)))


PAPERS = {
    "white": Paper((95.0, 0.0, -2.0), 0.17, 0.022),
    "cream": Paper((92.0, 1.5, 11.0), 0.17, 0.022),
    "recycled": Paper((84.0, 0.5, 5.0), 0.20, 0.025),
    "photo": Paper((94.0, 0.5, -4.0), 0.12, 0.004),
}


def paper(name: str) -> Paper:
    """The paper of that name.

    Raises
    ------
    InputError
        No such paper; the message lists what there is.
    """
    if name not in PAPERS:
        near = difflib.get_close_matches(name, PAPERS, 1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(f"The simulated printer has no paper {name!r}{hint} It has: {', '.join(PAPERS)}.")
    return PAPERS[name]


def transmittances() -> Array:
    """(4, 31) share of light that cyan, magenta, yellow and black let pass, through and back, where they are solid."""
    density = np.zeros((len(_LOBES), len(spectra.WAVELENGTHS)))
    for ink, lobes in enumerate(_LOBES):
        for middle, shorter, longer, height in lobes:
            away = spectra.WAVELENGTHS - middle
            density[ink] += height * np.exp(-0.5 * (away / np.where(away < 0, shorter, longer)) ** 2)
    return np.asarray(10**-density)
