"""Ligatures: the targets of neighbouring strokes as one sequence, without those that the join makes needless.

Source: seed 003, §4.1 (targets are removed where their angle exceeds a threshold), §4.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.values import Array


def joined(first: Array, second: Array, turn: float) -> tuple[Array, NDArray[np.bool_]]:
    """Targets of two strokes as one sequence; near the join, those on a nearly straight way are left out.

    Parameters
    ----------
    first, second : (m, 2), (k, 2) float
    turn : rad: a target goes where the angle that it forms with the one before and the one after is larger.

    Returns
    -------
    points : (n, 2) float
    kept : (m + k,) bool: which of the targets these are.
    """
    points = np.concatenate([first, second])
    kept = np.ones(len(points), dtype=bool)
    for at in (len(first) - 1, len(first)):
        if 0 < at < len(points) - 1:
            before = points[: at][kept[:at]][-1]
            if angle(before, points[at], points[at + 1]) > turn:
                kept[at] = False
    return points[kept], kept


def angle(before: Array, at: Array, after: Array) -> float:
    """rad, 0 to π: the angle at a target between its neighbours; π on a straight way, or where two coincide."""
    to, on = before - at, after - at
    size = float(np.linalg.norm(to) * np.linalg.norm(on))
    return float(np.pi if size == 0 else np.arccos(np.clip(to @ on / size, -1.0, 1.0)))
