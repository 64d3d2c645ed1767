"""A simulated inkjet: four inks, papers to choose from, dots that grow and overlap by chance.

Add a paper: its line in `PAPERS`.

Source: Demichel 1924 (shares), Neugebauer 1937 (mean of the overlaps), Yule and Nielsen 1951 (light that spreads in
the paper), Viggiano 1985 (the spectral form).
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from handout.errors import InputError
from handout.simulated import spectra
from handout.simulated.printer.faults import MORE_GAIN
from handout.simulated.printer.press import Press
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
class PrintedPaper:
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
    "white": PrintedPaper((95.0, 0.0, -2.0), 0.17, 0.022),
    "cream": PrintedPaper((92.0, 1.5, 11.0), 0.17, 0.022),
    "recycled": PrintedPaper((84.0, 0.5, 5.0), 0.20, 0.025),
    "photo": PrintedPaper((94.0, 0.5, -4.0), 0.12, 0.004),
}


def find_paper(name: str) -> PrintedPaper:
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


def mix_halftone(coverage: Array, overlaps: Array, n: float) -> Array:
    """(m, k) reflectance of a halftone: R = (Σ w_i R_i^(1/n))^n, w after Demichel.

    Parameters
    ----------
    coverage : (m, 4), 0–1; overlaps : (16, k) reflectance; n : Yule–Nielsen factor, 1 (none) and more.
    """
    return np.asarray((demichel(coverage) @ overlaps ** (1 / n)) ** n)


def grow_dots(coverage: Array, gain: float) -> Array:
    """Coverage after dots have grown: a + 4 g a (1 − a), so that a half becomes a half + g.

    Raises
    ------
    ValueError
        A gain outside 0–0.25.
    """
    if not 0 <= gain <= GREATEST_GAIN:
        raise ValueError(f"a gain of {gain:g} is outside 0 to {GREATEST_GAIN:g}")
    return np.asarray(coverage + 4 * gain * coverage * (1 - coverage))


def separate_inks(device: Array) -> Array:
    """(n, 4) cyan, magenta, yellow and black asked for by device RGB (n, 3) in 0–1.

    Black comes in with the square of the grey that the three have in common, and half of it is taken from each of
    them (grey component replacement): 250 % of ink where RGB is 0.
    """
    colour = 1 - device
    black = colour.min(axis=1, keepdims=True) ** 2
    return np.concatenate([colour - black / 2, black], axis=1)


_N = (1.0, 10.0)  # of the Yule–Nielsen factor: none, and beyond it nothing changes any more


class Inkjet(Press):
    """An inkjet with cyan, magenta, yellow and black, after Yule, Nielsen and Neugebauer.

    Parameters
    ----------
    paper : one of `PAPERS`: "white", "cream", "recycled", "photo".
    gain : how much a half covered tone grows, 0–0.25 of the sheet; None: as the paper makes it (17 % on white).
    n : Yule–Nielsen factor, 1–10: how far light spreads in the paper.
    faults, grain : see `Press`.

    Raises
    ------
    InputError
        An unknown paper or fault, or a number out of its bounds.
    """

    def __init__(
        self,
        paper: str = "white",
        gain: float | None = None,
        n: float = 2.0,
        faults: Iterable[str] = (),
        grain: float = 0.0,
    ) -> None:
        super().__init__(faults, grain)
        self.paper = find_paper(paper)
        self.gain = self.paper.gain if gain is None else gain
        self.n = n
        for name, value, (least, greatest) in (
            ("gain", self.gain, (0.0, GREATEST_GAIN)),
            ("Yule-Nielsen factor", n, _N),
        ):
            if not least <= value <= greatest:
                raise InputError(f"printer: a {name} of {value:g} is outside {least:g} to {greatest:g}.")
        if "wrong-media" in self.faults:
            self.gain = min(self.gain + MORE_GAIN, GREATEST_GAIN)
        self._overlaps = primaries(self.paper.spectrum, self.paper.surface, transmittances())

    def separate(self, device: Array) -> Array:
        """(n, 4) what the driver asks for; see `separate_inks`."""
        return separate_inks(device)

    def spectra(self, coverage: Array) -> Array:
        """(n, 31) reflectance of what was asked for."""
        return mix_halftone(grow_dots(np.asarray(coverage), self.gain), self._overlaps, self.n)
