"""How people write letters: order and direction of strokes, beside those that the built-in hands happen to have.

Each built-in hand is one writer's; the strokes of others come in another order, or the other way round, and most
capitals have several that are equally common.  `ductus.toml` lists them, drawn on a coarse grid.

Source: general knowledge of how handwriting is taught and done in the West.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from handout.tables import loaded
from handout.values import Array

_OTHER, _RARE = 1.3, 1.6  # costs of ways that fewer people have, in the unit of a walk's
_FINE = 8  # places between two points


@dataclass(frozen=True, eq=False)
class Way:
    """One way of writing a letter.

    strokes : (n, 2) float, y up, each letter in a unit of its own: the pen's way, for each stroke.
    cost : more for a rare one.
    """

    strokes: tuple[Array, ...]
    cost: float


@lru_cache(maxsize=512)
def ways(letter: str) -> tuple[Way, ...]:
    """The ways of writing a letter, the usual ones first; none where it is not known."""
    parts = (("usual", 0.0), ("other", _OTHER), ("rare", _RARE))
    return tuple(Way(_strokes(text), cost) for part, cost in parts for text in _table()[part].get(letter, ()))


@lru_cache(maxsize=1)
def _table() -> dict[str, dict[str, list[str]]]:
    return loaded(Path(__file__).with_name("ductus.toml"), "ways of writing letters")


def _strokes(text: str) -> tuple[Array, ...]:
    """The strokes of a way as `ductus.toml` has it."""
    return tuple(_stroke(part.split()) for part in text.split("|"))


def _stroke(points: list[str]) -> Array:
    xy = np.array([[float(point[0]), float(point[1])] for point in points])
    corners = [i for i, point in enumerate(points) if point.endswith("'")]
    bounds = [0, *corners, len(points) - 1]
    parts = [curve(xy[a : b + 1]) for a, b in pairwise(bounds)]
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


def curve(points: Array) -> Array:
    """The way through some points (Catmull and Rom's spline)."""
    if len(points) < 2:
        return points
    padded = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    a, b, c, d = (padded[i : len(padded) - 3 + i, None] for i in range(4))
    t = (np.arange(_FINE) / _FINE)[:, None]
    way = 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
    return np.concatenate([way.reshape(-1, 2), points[-1:]])
