"""What lies on the paper after printing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Page

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

        Parameters
        ----------
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
