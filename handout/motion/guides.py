"""Guides of the velocity: directions in which a movement is drawn, or which it avoids.

A guide damps the velocity across its direction ("along": the pen is led along it) or in its direction ("avoid").  Its
strength is a time: with the strength g the velocity in the damped direction is smoothed away over g intervals.

Source: seed 003, §3.4, eq. 18–21.  Taken as printed, the precision v vᵀ damps the movement along v, which is what
"avoid" does; the text describes the opposite, "along", whose precision is (v vᵀ + ε I)⁻¹ but for a factor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from handout.values import Array

# what remains of the damping in the direction that a guide leads along; it keeps the inverse of eq. 21 finite
_EASE = 0.0025


@dataclass(frozen=True, eq=False)
class Guide:
    """What the velocity is held to, besides the targets.

    direction : (2,) or (m, 2) float: unit vectors, for all or for each target's interval.
    strength : smoothing time over the interval, 0 or more; .3 is felt, 2 rules.
    mode : "along" damps the velocity across `direction`, "avoid" that along it.
    wanted : (2,) or (m, 2) float, length an interval, optional: the velocity that is wanted instead of none.
    """

    direction: Array
    strength: float
    mode: Literal["along", "avoid"] = "along"
    wanted: Array | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.strength <= 100:
            raise ValueError(f"strength = {self.strength:g} is outside 0 to 100")
        size = np.linalg.norm(self.direction, axis=-1)
        if not np.allclose(size, 1.0, atol=1e-6):
            raise ValueError("a guide's directions must be unit vectors")

    def precisions(self, targets: int, grid: int) -> Array:
        """(N − 1, 2, 2): precision of every step of N = targets · grid samples."""
        along = np.broadcast_to(np.asarray(self.direction, dtype=np.float64), (targets, 2))
        held = along[:, :, None] * along[:, None, :]
        if self.mode == "along":
            held = np.eye(2) - (1 - _EASE) * held
        return np.asarray((self.strength * grid) ** 2 * _of_steps(held, grid))

    def force(self, precisions: Array, grid: int) -> Array | float:
        """(N, 2): what the wanted velocity pushes the samples with; 0 where none is wanted."""
        if self.wanted is None:
            return 0.0
        targets = (len(precisions) + 1) // grid
        step = _of_steps(np.broadcast_to(self.wanted, (targets, 2)) / grid, grid)
        push = np.einsum("tij,tj->ti", precisions, step)
        force = np.zeros((len(precisions) + 1, 2))
        force[1:] += push
        force[:-1] -= push
        return force


def _of_steps(values: Array, grid: int) -> Array:
    """Values (m, …) of intervals from one target's centre to the next, for each step of m · grid samples."""
    interval = np.clip((np.arange(len(values) * grid - 1) + 1 - grid // 2) // grid, 0, len(values) - 1)
    return np.asarray(values[interval])
