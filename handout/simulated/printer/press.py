"""What every simulated printer does with a page, whatever its inks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.errors import InputError
from handout.profiles import Margins
from handout.simulated import spectra
from handout.simulated.printer import faults
from handout.simulated.scanner import Flatbed
from handout.simulated.sheet import SimulatedSheet
from handout.values import Array

_CODES = 1 << 24  # colours of 8 bits a channel
_GRAIN_DPI = 300.0  # at which grain is counted
_MOST_GRAIN = 0.5  # of the ink: with more it would often be none


class Press(ABC):
    """A printer that exists only in the computer.

    Parameters
    ----------
    faulty : names of what is wrong with it, see `faults.FAULTS`.
    grain : standard deviation of the ink of a pixel at 300 dpi, as a share of it; of finer pixels more.

    Raises
    ------
    InputError
        An unknown fault, or a grain outside 0–0.5.
    """

    def __init__(self, faulty: Iterable[str] = (), grain: float = 0.0) -> None:
        self.faults = faults.check(faulty)
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

        Parameters
        ----------
        page : (h, w, 3) uint8, device RGB of the whole sheet.
        dpi : its pixels an inch.
        margins : what the printer leaves white at the edges of the sheet, mm; None: it prints to the edge.
        rng : for the grain, where there is any.

        Raises
        ------
        InputError
            Not such a picture.
        """
        if page.ndim != 3 or page.shape[2] != 3 or page.dtype != np.uint8 or page.size == 0:
            raise InputError(f"The simulated printer takes (h, w, 3) uint8, not {page.shape} {page.dtype}.")
        index, colours = _colour_sheet(self._lay_ink(page, dpi, margins))
        coverage = self._coverage(colours / 255)
        if "clogged" in self.faults:
            index[faults.find_blocked_rows(len(page), dpi)] += len(coverage)
            coverage = np.concatenate([coverage, coverage * [0.0, 1.0, 1.0, 1.0]])
        # the last mixture is bare paper
        coverage = np.concatenate([coverage, np.zeros((1, 4))])
        return SimulatedSheet(coverage, index, self.spectra, dpi, self._ink(index.shape, dpi, rng))

    def _coverage(self, device: Array) -> Array:
        asked = self.separate(faults.manage_colour(device) if "managed" in self.faults else device)
        return faults.lay_ink(asked, self.faults)

    def _lay_ink(self, page: NDArray[np.uint8], dpi: float, margins: Margins | None) -> NDArray[np.uint8]:
        """The page as it falls on the sheet."""
        if "mirrored" in self.faults:
            page = page[:, ::-1]
        if "fit-to-page" in self.faults:
            page = faults.shrink_page(page)
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
            ink = faults.weaken_rows(shape[0], dpi)[:, None]
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
