"""Printers made of a formula, and charts printed on them."""

from __future__ import annotations

from functools import cache

import numpy as np

from handout.colour.models import Model, fit
from handout.colour.models.forward import Patches
from handout.colour.table import SIZE, ColourTable, build
from handout.simulated.printer import Inkjet
from handout.values import Array

_MIX = np.array([[0.90, 0.07, 0.03], [0.05, 0.88, 0.07], [0.02, 0.12, 0.86]])


def identical(device: Array) -> Array:
    """(n, 3) scanned RGB of a printer that needs no correction."""
    return np.array(device)


def dull(device: Array) -> Array:
    """(n, 3) scanned RGB of a printer with a short range, mixing inks and a tone curve, on cream paper."""
    return 0.12 + (np.array([0.95, 0.93, 0.86]) - 0.12) * (device @ _MIX.T) ** 1.3


class Dark(Inkjet):
    """A pigment inkjet on photo paper whose black sets in early: dark colours far apart are seen almost alike."""

    def __init__(self) -> None:
        super().__init__("photo", n=3)

    def separate(self, device: Array) -> Array:
        """(n, 4) what the driver asks for."""
        colour = (1 - device) ** 1.2
        black = np.clip((colour.min(axis=1, keepdims=True) - 0.1) / 0.9, 0, 1) ** 1.4
        return np.concatenate([colour * (1 - 0.6 * black), black], axis=1)


def chart(side: int = 6, greys: int = 52) -> Array:
    """(side³ + greys, 3) device RGB, in 8 bits."""
    levels = np.linspace(0, 1, side)
    cube = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    ramp = np.repeat(np.linspace(0, 1, greys)[:, None], 3, axis=1)
    return np.rint(np.concatenate([cube, ramp]) * 255) / 255


def scanned(printer: object, noise: float = 0.0, seed: int = 0, device: Array | None = None) -> Patches:
    """A chart as it was scanned with `noise` (standard deviation of a patch mean, 0–1), which it tells."""
    sent = chart() if device is None else device
    seen = printer(sent)  # type: ignore[operator]
    seen = np.clip(seen + noise * np.random.default_rng(seed).normal(size=seen.shape), 0, 1)
    return Patches(sent, seen, np.full(len(sent), noise))


@cache
def dull_model(method: str = "forward") -> Model:
    """The model of the dull printer's chart, made once for all tests."""
    return fit(scanned(dull), method)


@cache
def dull_table(size: int = SIZE) -> ColourTable:
    """Its table."""
    return build(dull_model(), {"printer": "a formula", "paper": "cream „ä“"}, size)
