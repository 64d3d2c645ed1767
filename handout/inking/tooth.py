"""The tooth of paper: heights of its surface, fixed in mm, so that they look the same at any resolution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_STEP = 0.02  # mm between two heights
_SIDE = 1024  # heights along the side of the tile that is repeated
_BANDS = ((0.035, 0.7), (0.09, 0.6), (0.3, 0.35))  # mm, share: pits between fibres, fibres, flocs


@dataclass(frozen=True, eq=False)
class Tooth:
    """A repeated tile of heights: (n, n) float32, mean 0, standard deviation 1."""

    tile: NDArray[np.float32]

    def at(self, x: NDArray[np.floating[Any]], y: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
        """Heights at places in mm, (n,)."""
        n = len(self.tile)
        row = (y * (1 / _STEP)).astype(np.int64) % n
        column = (x * (1 / _STEP)).astype(np.int64) % n
        return np.asarray(self.tile.reshape(-1)[row * n + column])


def tooth(rng: np.random.Generator) -> Tooth:
    """A new surface; paper is smoother along no direction."""
    noise = np.fft.rfft2(rng.standard_normal((_SIDE, _SIDE), dtype=np.float32))
    down, across = np.fft.fftfreq(_SIDE, _STEP)[:, None], np.fft.rfftfreq(_SIDE, _STEP)
    square = (2 * np.pi) ** 2 * (down**2 + across**2)
    # a Gaussian of deviation σ has the spectrum exp(−σ² ω² / 2), and leaves a share of 1 / (4 π σ²) of the power
    power = sum(4 * np.pi * (share * size) ** 2 * np.exp(-square * size**2) for size, share in _BANDS)
    total = np.fft.irfft2(noise * np.sqrt(power), s=(_SIDE, _SIDE)).astype(np.float32)
    total -= total.mean()
    return Tooth(total / total.std())
