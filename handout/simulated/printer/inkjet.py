"""A simulated inkjet: four inks, dots that grow, overlaps that mix by chance, papers to choose from."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from handout.errors import InputError
from handout.simulated.printer import neugebauer, stock
from handout.simulated.printer.faults import MORE_GAIN
from handout.simulated.printer.press import Press
from handout.values import Array

_N = (1.0, 10.0)


class Inkjet(Press):
    """An inkjet with cyan, magenta, yellow and black, after Yule, Nielsen and Neugebauer.

    Parameters
    ----------
    paper : one of `stock.PAPERS`: "white", "cream", "recycled", "photo".
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
        self.paper = stock.paper(paper)
        self.gain = self.paper.gain if gain is None else gain
        self.n = n
        for name, value, (least, greatest) in (
            ("gain", self.gain, (0.0, neugebauer.GREATEST_GAIN)),
            ("Yule-Nielsen factor", n, _N),
        ):
            if not least <= value <= greatest:
                raise InputError(f"printer: a {name} of {value:g} is outside {least:g} to {greatest:g}.")
        if "wrong-media" in self.faults:
            self.gain = min(self.gain + MORE_GAIN, neugebauer.GREATEST_GAIN)
        self._overlaps = neugebauer.primaries(self.paper.spectrum, self.paper.surface, stock.transmittances())

    def separate(self, device: Array) -> Array:
        """(n, 4) what the driver asks for; see `neugebauer.separated`."""
        return neugebauer.separated(device)

    def spectra(self, coverage: Array) -> Array:
        """(n, 31) reflectance of what was asked for."""
        return neugebauer.mixed(neugebauer.gained(np.asarray(coverage), self.gain), self._overlaps, self.n)
