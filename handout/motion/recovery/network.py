"""A line graph as what a pen can do on it: branches between knots, and how it turns from one into another.

Every branch has two ends: end 2 b is where branch b begins, end 2 b + 1 where it ceases.  A pen that leaves a knot by
an end arrives at the next by that end's other one, `end ^ 1`.  Lengths are in half widths of the line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from handout.branching import branches
from handout.values import Array, Indices

_NEAR, _FAR = 2.0, 8.0  # half widths from a knot between which a branch shows its direction
_BENT = 0.5  # how far the turn of the branch beyond is carried on into the knot
_MOST_BENT = 0.6  # rad


@dataclass(frozen=True, eq=False)
class Network:
    """Branches between knots.

    xy : (n, 2) float, vertices, y up, in any unit.
    radius, density : (n,) float.
    half : half the usual width of the line, in that unit.
    branches : vertices in order along each, both knots included; a dot is a branch of one vertex.
    knot : (2 b,) int: the knot at each end.
    length : (b,) float, half widths.
    leaving : (2 b, 2) float: unit vector in which the pen leaves the knot by each end.
    """

    xy: Array
    radius: Array
    density: Array
    half: float
    branches: tuple[Indices, ...]
    knot: Indices
    length: Array
    leaving: Array

    @cached_property
    def at(self) -> dict[int, list[int]]:
        """Knot → ends that meet there."""
        found: dict[int, list[int]] = {}
        for end, knot in enumerate(self.knot.tolist()):
            found.setdefault(knot, []).append(end)
        return found

    def way(self, end: int) -> Indices:
        """Vertices of a branch in the order in which the pen passes them that leaves by an end."""
        vertices = self.branches[end >> 1]
        return vertices[::-1] if end & 1 else vertices

    def place(self, end: int) -> Array:
        """(2,): where an end is."""
        return np.asarray(self.xy[self.branches[end >> 1][-1 if end & 1 else 0]])


def network(
    xy: Array, radius: Array, density: Array, edges: Indices, cuts: Sequence[int] = (), half: float | None = None
) -> Network:
    """The branches of a line graph.

    Parameters
    ----------
    xy, radius, density, edges : as in `values.LineGraph`, y up.
    cuts : vertices that are knots whatever meets there.
    half : half the usual width of the line; default: the median radius.
    """
    degree = np.bincount(edges.ravel(), minlength=len(xy))
    found = [part for path in branches(edges, len(xy)) for part in _cut(path, cuts, bool(degree[path[0]] == 2))]
    wide = half if half is not None else float(np.median(radius))
    runs = [_run(xy[path]) for path in found]
    knots = np.array([path[side] for path in found for side in (0, -1)], dtype=np.intp)
    directions = [
        _direction(xy[path][::side], run if side > 0 else run[-1] - run[::-1], wide)
        for path, run in zip(found, runs, strict=True)
        for side in (1, -1)
    ]
    length = np.array([run[-1] for run in runs]) / wide
    return Network(xy, radius, density, wide, tuple(found), knots, length, np.array(directions).reshape(-1, 2))


def _cut(path: Indices, cuts: Sequence[int], closed: bool) -> list[Indices]:
    """A path in parts, cut at some of its vertices; a closed one, which has no knot of its own, is opened there."""
    inside = [i for i in range(1, len(path) - 1) if path[i] in cuts]
    if not inside:
        return [path]
    if closed and path[0] not in cuts:
        opened = np.concatenate([path[inside[0] : -1], path[: inside[0] + 1]])
        return _cut(opened, cuts, closed=False)
    bounds = [0, *inside, len(path) - 1]
    return [path[a : b + 1] for a, b in zip(bounds[:-1], bounds[1:], strict=True)]


def _run(xy: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])


def _direction(xy: Array, run: Array, half: float) -> Array:
    """(2,) in which a way leaves its first vertex, beyond the ink that it shares there with others."""
    if run[-1] < 1e-9:
        return np.zeros(2)
    places = np.minimum(np.array([_NEAR, _FAR, 2 * _FAR - _NEAR]) * half, run[-1] * np.array([0.3, 0.7, 1.0]))
    x, y = np.interp(places, run, xy[:, 0]), np.interp(places, run, xy[:, 1])
    near, far = np.arctan2(np.diff(y), np.diff(x))
    turn = (near - far + np.pi) % (2 * np.pi) - np.pi
    angle = near + float(np.clip(_BENT * turn, -_MOST_BENT, _MOST_BENT))
    return np.array([np.cos(angle), np.sin(angle)])
