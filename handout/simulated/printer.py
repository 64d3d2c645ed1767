"""A simulated inkjet: four inks, papers to choose from, dots that grow and overlap by chance, and faults on demand.

The model of the inks is of the printer's own; nothing that matches colours uses it.  Add a paper: its line in `PAPERS`;
a fault: its line in `FAULTS`.

    sheet = Inkjet(paper="cream", faults=["clogged"]).print_page(page, 300)
    picture = Flatbed(noise=0.01).scan(sheet, 300, np.random.default_rng(0))

Source: Demichel 1924 (shares), Neugebauer 1937 (mean of the overlaps), Yule and Nielsen 1951 (light that spreads in
the paper), Viggiano 1985 (the spectral form).
"""

from __future__ import annotations

import difflib
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.errors import InputError
from handout.libraries import cv2
from handout.profiles import Margins
from handout.simulated import spectra
from handout.simulated.flatbed import SETTINGS, Flatbed
from handout.simulated.spectra import SimulatedSheet
from handout.values import Array

FAULTS = {
    "fit-to-page": "the page is printed at 97 % of its size, in the middle of the sheet",
    "mirrored": "left and right are exchanged, as for a transfer film",
    "managed": "the driver takes the page for sRGB, turns it into Adobe RGB and makes it lighter",
    "wrong-media": "the driver was told another paper: dots grow by 8 % more",
    "weak-cyan": "half of the cyan nozzles print nothing",
    "weak-magenta": "half of the magenta nozzles print nothing",
    "weak-yellow": "half of the yellow nozzles print nothing",
    "no-black": "the black ink is empty",
    "draft": "60 % of the ink",
    "ink-limit": "the driver was told another paper: no more than 120 % of ink anywhere",
    "clogged": "two groups of the cyan nozzles are blocked: two lines without cyan in every pass of the head",
    "banding": "ink gets lighter over each pass of the head, and a pale line lies between passes",
}
FLAWS = {**FAULTS, **dict.fromkeys(SETTINGS, "")}  # those of the scanner too, which are settings
_SHARES = {
    "weak-cyan": (0.5, 1, 1, 1), "weak-magenta": (1, 0.5, 1, 1), "weak-yellow": (1, 1, 0.5, 1),
    "no-black": (1, 1, 1, 0), "draft": (0.6, 0.6, 0.6, 0.6),
}  # fmt: skip
_LIMIT = 1.2  # of the sheet, all inks together
FITTED = 0.97  # of the size
MORE_GAIN = 0.08
_PASS = 25.4 / 3  # mm, height of the print head
_BLOCKED = ((1.9, 2.15), (5.4, 5.55))  # mm from the head's top
_FADING, _JOINT, _PALE = 0.05, 0.13, 0.35  # share of ink; mm; share of ink
_LIGHTER = 0.85  # power
# linear sRGB to linear Adobe RGB (1998), both D65
_TO_ADOBE = np.array([[0.71513, 0.28487, 0.0], [0.0, 1.0, 0.0], [0.0, 0.04117, 0.95883]])
_ADOBE_GAMMA = 563 / 256  # Source: Adobe RGB (1998) Color Image Encoding


def check(names: Iterable[str]) -> frozenset[str]:
    """The faults of those names. Raises InputError: no such fault; the message lists what there is."""
    asked = frozenset(names)
    for name in sorted(asked - set(FAULTS)):
        near = difflib.get_close_matches(name, FLAWS, 1)
        hint = f"; did you mean {near[0]!r}?" if near else "."
        raise InputError(f"The simulated printer has no fault {name!r}{hint} It has: {', '.join(FLAWS)}.")
    return asked


def manage_colour(device: Array) -> Array:
    """(n, 3) what a driver that manages colour makes of device RGB (n, 3), 0–1."""
    linear = np.where(device <= 0.04045, device / 12.92, ((device + 0.055) / 1.055) ** 2.4)
    turned = np.clip(linear @ _TO_ADOBE.T, 0, 1) ** (1 / _ADOBE_GAMMA)
    return np.asarray(turned**_LIGHTER)


def lay_ink(coverage: Array, names: Iterable[str]) -> Array:
    """(n, 4): the ink that a printer with these faults lays down when the driver asks for (n, 4)."""
    amounts = np.array(coverage, dtype=np.float64)
    if "ink-limit" in names:
        amounts *= np.minimum(1, _LIMIT / np.maximum(amounts.sum(axis=1, keepdims=True), _LIMIT))
    for name in names:
        amounts *= np.array(_SHARES.get(name, (1, 1, 1, 1)))
    return amounts


def shrink_page(page: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The page (h, w, 3) made smaller about its middle, white around it."""
    height, width = page.shape[:2]
    matrix = np.array([[FITTED, 0, (1 - FITTED) * (width - 1) / 2], [0, FITTED, (1 - FITTED) * (height - 1) / 2]])
    white = (255, 255, 255)
    return np.asarray(
        cv2.warpAffine(page, matrix, (width, height), flags=cv2.INTER_LINEAR, borderValue=white), dtype=np.uint8
    )


def find_blocked_rows(rows: int, dpi: float) -> NDArray[np.bool_]:
    """(rows,) whether the nozzles that would print the row are blocked."""
    at = _in_pass(rows, dpi)
    return np.asarray(np.logical_or.reduce([(at >= start) & (at < stop) for start, stop in _BLOCKED]))


def weaken_rows(rows: int, dpi: float) -> NDArray[np.float32]:
    """(rows,) how much of its ink every row gets, 0–1."""
    at = _in_pass(rows, dpi)
    ink = 1 - _FADING * at / _PASS
    ink[at < _JOINT] -= _PALE
    return np.asarray(ink, dtype=np.float32)


def _in_pass(rows: int, dpi: float) -> Array:
    """(rows,) mm from the top of the print head."""
    return np.asarray((np.arange(rows) + 0.5) * (25.4 / dpi) % _PASS)


_CODES = 1 << 24  # colours of 8 bits a channel
_GRAIN_DPI = 300.0  # at which grain is counted
_MOST_GRAIN = 0.5  # of the ink: with more it would often be none


class Press(ABC):
    """A printer that exists only in the computer.

    faulty : names of what is wrong with it, see `FAULTS`.
    grain : standard deviation of the ink of a pixel at 300 dpi, as a share of it; of finer pixels more.

    Raises InputError: an unknown fault, or a grain outside 0–0.5.
    """

    def __init__(self, faulty: Iterable[str] = (), grain: float = 0.0) -> None:
        self.faults = check(faulty)
        if not 0 <= grain <= _MOST_GRAIN:
            raise InputError(f"printer: a grain of {grain:g} is outside 0 to {_MOST_GRAIN:g}.")
        self.grain = grain

    @abstractmethod
    def separate(self, device: Array) -> Array:
        """(n, 4) cyan, magenta, yellow and black that the driver asks for, from device RGB (n, 3), 0–1."""

    @abstractmethod
    def spectra(self, coverage: Array) -> Array:
        """(n, 31) reflectance, 400–700 nm, of what (n, 4) coverage was asked for; its dots have grown."""

    def reflectance(self, device: ArrayLike) -> Array:
        """(n, 31) reflectance, 400–700 nm, of even patches of device RGB (n, 3), 0–1.

        Faults that change the colour of a whole patch count; those that change its shape or mark rows do not.
        """
        return self.spectra(self._coverage(np.asarray(device, dtype=np.float64)))

    def patches(self, device: ArrayLike) -> Array:
        """(n, 3) XYZ (D50, white Y = 1) of even patches of device RGB (n, 3), 0–1."""
        return spectra.xyz(self.reflectance(device))

    def scan_patches(self, device: ArrayLike) -> Array:
        """(n, 3) RGB in 0–1, as an ideal flatbed shows even patches of device RGB (n, 3), 0–1; not rounded."""
        return Flatbed.ideal().see(self.reflectance(device))

    def print_page(
        self,
        page: NDArray[np.uint8],
        dpi: float,
        margins: Margins | None = None,
        rng: np.random.Generator | None = None,
    ) -> SimulatedSheet:
        """Print a page.

        page : (h, w, 3) uint8, device RGB of the whole sheet.
        dpi : its pixels an inch.
        margins : what the printer leaves white at the edges of the sheet, mm; None: it prints to the edge.
        rng : for the grain, where there is any.

        Raises InputError: not such a picture.
        """
        if page.ndim != 3 or page.shape[2] != 3 or page.dtype != np.uint8 or page.size == 0:
            raise InputError(f"The simulated printer takes (h, w, 3) uint8, not {page.shape} {page.dtype}.")
        index, colours = _colour_sheet(self._lay_ink(page, dpi, margins))
        coverage = self._coverage(colours / 255)
        if "clogged" in self.faults:
            index[find_blocked_rows(len(page), dpi)] += len(coverage)
            coverage = np.concatenate([coverage, coverage * [0.0, 1.0, 1.0, 1.0]])
        # the last mixture is bare paper
        coverage = np.concatenate([coverage, np.zeros((1, 4))])
        return SimulatedSheet(coverage, index, self.spectra, dpi, self._ink(index.shape, dpi, rng))

    def _coverage(self, device: Array) -> Array:
        asked = self.separate(manage_colour(device) if "managed" in self.faults else device)
        return lay_ink(asked, self.faults)

    def _lay_ink(self, page: NDArray[np.uint8], dpi: float, margins: Margins | None) -> NDArray[np.uint8]:
        """The page as it falls on the sheet."""
        if "mirrored" in self.faults:
            page = page[:, ::-1]
        if "fit-to-page" in self.faults:
            page = shrink_page(page)
        if margins is None:
            return page
        left, top, right, bottom = (
            round(edge * dpi / 25.4) for edge in (margins.left, margins.top, margins.right, margins.bottom)
        )
        clipped = np.full_like(page, 255)
        inside = np.s_[top : max(len(page) - bottom, top), left : max(page.shape[1] - right, left)]
        clipped[inside] = page[inside]
        return clipped

    def _ink(self, shape: tuple[int, ...], dpi: float, rng: np.random.Generator | None) -> NDArray[np.float32] | None:
        ink = None
        if "banding" in self.faults:
            ink = weaken_rows(shape[0], dpi)[:, None]
        if self.grain:
            if rng is None:
                raise ValueError("grain needs a generator")
            specks = rng.standard_normal(shape, dtype=np.float32) * np.float32(self.grain * dpi / _GRAIN_DPI)
            specks += 1
            ink = np.maximum(specks if ink is None else specks * ink, 0)
        return ink


def _colour_sheet(page: NDArray[np.uint8]) -> tuple[NDArray[np.int32], Array]:
    """(h, w) int32 number of every pixel's colour, and the (m, 3) colours that there are, 0–255."""
    code = page[..., 0].astype(np.int32)
    for channel in (1, 2):
        code <<= 8
        code |= page[..., channel]
    there = np.zeros(_CODES, dtype=bool)
    there[code.ravel()] = True
    codes = np.flatnonzero(there).astype(np.int32)
    number = np.empty(_CODES, dtype=np.int32)
    number[codes] = np.arange(len(codes), dtype=np.int32)
    colours = np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=1)
    return number[code], colours.astype(np.float64)


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
    """The paper of that name. Raises InputError: no such paper; the message lists what there is."""
    if name not in PAPERS:
        near = difflib.get_close_matches(name, PAPERS, 1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        raise InputError(f"The simulated printer has no paper {name!r}{hint}; it has: {', '.join(PAPERS)}.")
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

    coverage : (n, 4) share of the sheet that each ink covers, 0–1.
    """
    weights = np.ones((len(coverage), 1))
    for ink in coverage.T[:, :, None]:
        # in the order of OVERLAPS: the first ink changes fastest
        weights = np.concatenate([weights * (1 - ink), weights * ink], axis=1)
    return weights


def primaries(paper: Array, surface: float, transmittances: Array) -> Array:
    """(16, 31) reflectance of every overlap.

    paper : (31,) reflectance of the sheet; surface : share that never reaches ink.
    transmittances : (4, 31) of the solid inks; what lies over one another multiplies (Beer–Lambert).
    """
    through = np.where(OVERLAPS[:, :, None], transmittances[None], 1.0).prod(axis=1)
    return np.asarray(surface + (paper - surface) * through)


def mix_halftone(coverage: Array, overlaps: Array, n: float) -> Array:
    """(m, k) reflectance of a halftone: R = (Σ w_i R_i^(1/n))^n, w after Demichel.

    coverage : (m, 4), 0–1; overlaps : (16, k) reflectance; n : Yule–Nielsen factor, 1 (none) and more.
    """
    return np.asarray((demichel(coverage) @ overlaps ** (1 / n)) ** n)


def grow_dots(coverage: Array, gain: float) -> Array:
    """Coverage after dots have grown: a + 4 g a (1 − a), so that a half becomes a half + g.

    Raises ValueError: a gain outside 0–0.25.
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

    paper : one of `PAPERS`: "white", "cream", "recycled", "photo".
    gain : how much a half covered tone grows, 0–0.25 of the sheet; None: as the paper makes it (17 % on white).
    n : Yule–Nielsen factor, 1–10: how far light spreads in the paper.
    faults, grain : see `Press`.

    Raises InputError: an unknown paper or fault, or a number out of its bounds.
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
