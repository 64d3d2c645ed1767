"""Ligatures: the targets of neighbouring strokes as one sequence, without those that the join makes needless.

Source: seed 003, §4.1 (targets are removed where their angle exceeds a threshold), §4.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from handout.values import Array


def joined(parts: Sequence[Array], turn: float) -> tuple[Array, NDArray[np.bool_]]:
    """Targets of strokes as one sequence; near a join, those on a nearly straight way are left out.

    Parameters
    ----------
    parts : of (m, 2) float arrays
    turn : rad: a target beside a join goes where the angle that it forms with its neighbours is larger.

    Returns
    -------
    points : (n, 2) float
    kept : bool, for each of the targets of all parts: which of them these are.
    """
    points = np.concatenate(parts)
    kept = np.ones(len(points), dtype=bool)
    for join in np.cumsum([len(part) for part in parts])[:-1].tolist():
        for at in (join - 1, join):
            before = at - 1
            while before >= 0 and not kept[before]:
                before -= 1
            if before >= 0 and at < len(points) - 1 and angle(points[before], points[at], points[at + 1]) > turn:
                kept[at] = False
    return points[kept], kept


def angle(before: Array, at: Array, after: Array) -> float:
    """rad, 0 to π: the angle at a target between its neighbours; π on a straight way, or where two coincide."""
    to, on = before - at, after - at
    size = float(np.linalg.norm(to) * np.linalg.norm(on))
    return float(np.pi if size == 0 else np.arccos(np.clip(to @ on / size, -1.0, 1.0)))
