"""A part of the test sheet: lines of its own, and words beside them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from handout.values import Array, Stroke


@dataclass(frozen=True)
class Caption:
    """Words on the sheet: x where they begin, y the line they stand on, mm; x_height: of the letters, mm."""

    text: str
    x: float
    y: float
    x_height: float


@dataclass(frozen=True, eq=False)
class Panel:
    """Lines in the order in which they have to be drawn, with words beside them; all in mm from its upper left corner.

    lines : each with a clock of its own.
    """

    name: str
    width: float
    height: float
    lines: tuple[Stroke, ...]
    captions: tuple[Caption, ...]


def line(points: Iterable[tuple[float, float]] | Array, speed: float, rest: float = 0.0) -> Stroke:
    """A line at a steady speed, mm/s; the pen rests so long on the paper, s, before it goes."""
    xy = np.asarray(list(points) if not isinstance(points, np.ndarray) else points, dtype=float)
    t = np.append(0.0, np.cumsum(np.hypot(*np.diff(xy, axis=0).T))) / speed
    if rest > 0:
        t, xy = np.append(0.0, t + rest), np.concatenate([xy[:1], xy])
    return Stroke(t, xy)


def dot(x: float, y: float, rest: float) -> Stroke:
    """The pen comes down, stays so long, s, and goes up."""
    return Stroke(np.array([0.0, max(rest, 1e-3)]), np.array([[x, y], [x, y]]))
