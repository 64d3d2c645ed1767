"""A line graph as what a pen can do on it: branches between knots, and how it turns from one into another.

Every branch has two ends: end 2 b is where branch b begins, end 2 b + 1 where it ceases.  A pen that leaves a knot by
an end arrives at the next by that end's other one, `end ^ 1`.  Lengths are in half widths of the line.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from handout.branching import branches
from handout.values import Array, Indices

Complexes: TypeAlias = NDArray[np.complex128]

_NEAR, _FAR = 1.4, 8.0  # half widths from a knot between which a branch shows its direction
_BENT = 0.51  # how far the turn of the branch beyond is carried on into the knot
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

    @cached_property
    def _extents(self) -> list[tuple[float, float, float]]:
        found = []
        for path in self.branches:
            x, y = self.xy[path].T
            low, high, twice = float(y.min()), float(y.max()), float(x[:-1] @ y[1:] - x[1:] @ y[:-1])
            found += [(low, high, twice), (low, high, -twice)]
        return found

    def extent(self, end: int) -> tuple[float, float, float]:
        """Lowest and highest place of a branch, and twice the area that it sweeps seen from (0, 0), left by an end."""
        return self._extents[end]

    def place(self, end: int) -> Array:
        """(2,): where an end is."""
        return np.asarray(self.xy[self.branches[end >> 1][-1 if end & 1 else 0]])


def network(xy: Array, radius: Array, density: Array, edges: Indices, half: float | None = None) -> Network:
    """The branches of a line graph.

    Parameters
    ----------
    xy, radius, density, edges : as in `values.LineGraph`, y up.
    half : half the usual width of the line; default: the median radius.
    """
    wide = half if half is not None else float(np.median(radius))
    paths = branches(edges, len(xy))
    places = complexes(xy)
    return _made(xy, radius, density, wide, paths, [_measured(places[path], wide) for path in paths])


def part(net: Network, keep: Sequence[int], cuts: Sequence[int] = ()) -> Network:
    """Some branches of a network, with knots at some more of their vertices."""
    if not cuts:
        ends = np.array([e for b in keep for e in (2 * b, 2 * b + 1)], dtype=np.intp)
        kept = tuple(net.branches[b] for b in keep)
        rows = list(keep)
        return Network(
            net.xy, net.radius, net.density, net.half, kept, net.knot[ends], net.length[rows], net.leaving[ends]
        )
    places, found, measured = complexes(net.xy), list[Indices](), list[tuple[float, Array]]()
    for b in keep:
        path = net.branches[b]
        closed = len(path) > 1 and path[0] == path[-1] and len(net.at[int(path[0])]) == 2
        parts = _cut(path, cuts, closed)
        found += parts
        if len(parts) == 1 and parts[0] is path:
            measured.append((float(net.length[b]), net.leaving[2 * b : 2 * b + 2]))
        else:
            measured += [_measured(places[own], net.half) for own in parts]
    return _made(net.xy, net.radius, net.density, net.half, found, measured)


def _made(
    xy: Array,
    radius: Array,
    density: Array,
    half: float,
    found: Sequence[Indices],
    measured: Sequence[tuple[float, Array]],
) -> Network:
    knots = np.array([path[side] for path in found for side in (0, -1)], dtype=np.intp)
    length = np.array([length for length, _ in measured])
    leaving = np.concatenate([np.zeros((0, 2)), *(directions for _, directions in measured)])
    return Network(xy, radius, density, half, tuple(found), knots, length, leaving)


def complexes(xy: Array) -> Complexes:
    """(n,) complex, of places (n, 2)."""
    return np.ascontiguousarray(xy, dtype=np.float64).view(np.complex128)[:, 0]


def _measured(places: Complexes, half: float) -> tuple[float, Array]:
    """Length of a branch, half widths, and (2, 2) the directions in which the pen leaves by its two ends."""
    step = places[1:] - places[:-1]
    run = np.zeros(len(places))
    np.hypot(step.real, step.imag).cumsum(out=run[1:])
    whole = float(run[-1])
    return whole / half, np.array([_direction(places, run, half), _direction(places[::-1], whole - run[::-1], half)])


def _cut(path: Indices, cuts: Sequence[int], closed: bool) -> list[Indices]:
    """A path in parts, cut at some of its vertices; a closed one, which has no knot of its own, is opened there."""
    inside = [i for i in range(1, len(path) - 1) if path[i] in cuts]
    if not inside:
        return [path]
    if closed and path[0] not in cuts:
        opened = np.concatenate([path[inside[0] : -1], path[: inside[0] + 1]])
        return _cut(opened, cuts, closed=False)
    bounds = [0, *inside, len(path) - 1]
    return [path[a : b + 1] for a, b in pairwise(bounds)]


def _direction(places: Complexes, run: Array, half: float) -> tuple[float, float]:
    """In which a way leaves its first vertex, beyond the ink that it shares there with others."""
    whole = float(run[-1])
    if whole < 1e-9:
        return 0.0, 0.0
    far = (min(_NEAR * half, 0.3 * whole), min(_FAR * half, 0.7 * whole), min((2 * _FAR - _NEAR) * half, whole))
    a, b, c = np.interp(far, run, places).tolist()
    near, beyond = cmath.phase(b - a), cmath.phase(c - b)
    turn = (near - beyond + math.pi) % (2 * math.pi) - math.pi
    angle = near + min(max(_BENT * turn, -_MOST_BENT), _MOST_BENT)
    return math.cos(angle), math.sin(angle)
