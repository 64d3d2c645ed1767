"""Light that a sheet sends back: spectra from 400 to 700 nm, their colours under D50, and a printed sheet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.colour import conversions
from handout.values import Array, Page, readonly

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


_LEVELS = 256  # amounts of a pen's ink of which the spectrum is worked out
_CHUNK = 1 << 15  # spectra worked out at a time


@dataclass(frozen=True, eq=False)
class WrittenSheet:
    """What a pen wrote on bare paper.

    corner : (row, column) of its first pixel on the sheet; amount : (h, w) float32, how much ink, 1 where it is usual.
    density : (31,) of the ink where its amount is 1, decadic, over the wavelengths.
    """

    corner: tuple[int, int]
    amount: NDArray[np.float32]
    density: Array

    def onto(self, picture: NDArray[np.float32], paper: Array, bands: Array) -> None:
        """Write it on a sheet's reflectance (h, w, k) in k bands of light, on paper of spectrum (31,)."""
        levels = np.linspace(0.0, max(1e-3, float(self.amount.max())), _LEVELS)
        colours = (paper * 10 ** (-self.density * levels[:, None])) @ bands
        row, column = self.corner
        part = picture[row : row + self.amount.shape[0], column : column + self.amount.shape[1]]
        amount = self.amount[: part.shape[0], : part.shape[1]]
        for k in range(part.shape[2]):
            shown = np.interp(amount, levels, colours[:, k]).astype(np.float32)
            # what is printed there stays, and the pen goes over it
            part[..., k] *= shown / np.float32(colours[0, k])


@dataclass(frozen=True, eq=False)
class SimulatedSheet:
    """A printed sheet.

    coverage : (m, 4) what of cyan, magenta, yellow and black was asked for, each mixture once; the last row is none.
    index : (h, w) int32, which mixture every pixel has.
    spectra : (n, 4) coverage → (n, 31) reflectance.
    dpi : pixels an inch.
    written : what a pen wrote on it afterwards, in the order in which it was written.
    ink : (h, 1) or (h, w) float32, how much of its ink a pixel got; None: all of it everywhere.
    """

    coverage: Array
    index: NDArray[np.int32]
    spectra: Callable[[Array], Array] = field(repr=False)
    dpi: float
    ink: NDArray[np.float32] | None = None
    written: tuple[WrittenSheet, ...] = ()

    @property
    def page(self) -> Page:
        """Its size, mm."""
        height, width = self.index.shape
        return Page(width * 25.4 / self.dpi, height * 25.4 / self.dpi)

    def reflectance(self, bands: Array) -> NDArray[np.float32]:
        """(h, w, k) float32: what every pixel sends back in each of k bands of light.

        bands : (31, k) how much each wavelength counts; `light.observer()` gives XYZ.
        """
        pieces = range(0, len(self.coverage), _CHUNK)
        table = np.concatenate([self.spectra(self.coverage[i : i + _CHUNK]) @ bands for i in pieces])
        table = table.astype(np.float32)
        picture = np.take(table, self.index, axis=0)
        if self.ink is not None:
            bare = table[-1]
            picture -= bare
            picture *= self.ink[:, :, None]
            picture += bare
        for writing in self.written:
            writing.onto(picture, self.spectra(self.coverage[-1:])[0], bands)
        return picture
