"""What lies on the paper after printing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Page

_CHUNK = 1 << 15  # spectra worked out at a time


@dataclass(frozen=True, eq=False)
class Sheet:
    """A printed sheet.

    coverage : (m, 4) what of cyan, magenta, yellow and black was asked for, each mixture once; the last row is none.
    index : (h, w) int32, which mixture every pixel has.
    spectra : (n, 4) coverage → (n, 31) reflectance.
    dpi : pixels an inch.
    ink : (h, 1) or (h, w) float32, how much of its ink a pixel got; None: all of it everywhere.
    """

    coverage: Array
    index: NDArray[np.int32]
    spectra: Callable[[Array], Array] = field(repr=False)
    dpi: float
    ink: NDArray[np.float32] | None = None

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
        return picture
