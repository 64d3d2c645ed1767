"""What the line around a place looks like: where a random walk along it gets to, as 216 numbers.

A walk leaves a vertex along one of its edges, at each junction takes one of the exits at random, never back, and is
over at the end of a line.  After each step the travelled distance, the change of density and the place relative to the
start are noted, in the frame whose x axis is the way travelled first.  All walks at once, exactly: the probability of
being on each directed edge is handed on by a sparse matrix.

Walks go over a graph of even steps, of a length in mm, so that scans of any resolution give the same numbers.

Source: seed 000, §7.3.  Choices for what it leaves open: centres of δx, δy at −½, 0, ½ of the travelled distance, of
the change of density at −½, 0, ½; a walk that is over adds nothing more.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from handout.scanning.steps import even_steps
from handout.values import Array, Indices, LineGraph

_UNIT = 25.4 / 600  # mm: the paper's pixel
_FARTHEST = 512 * _UNIT
_FORWARD = 12 * _UNIT
_TRAVEL, _RATIO = 8, 1.25
SIZE = _TRAVEL * 27
STEP = _FORWARD  # 0.51 mm
_TOGETHER = 4000  # starts at a time: memory


def line_features(graph: LineGraph, step: float = STEP) -> NDArray[np.float32]:
    """(n, 216) float32 for every vertex of a graph in mm: shares that sum to 1.

    Index: ((travel·3 + density)·3 + x)·3 + y.

    Parameters
    ----------
    graph : LineGraph, in mm.
    step : mm: the features are worked out about so far apart, and in steps of that length, and interpolated between.
    """
    steps = even_steps(graph, step)
    own = walk_features(steps.xy, steps.density, steps.edges, steps.step)
    part = steps.part[:, None]
    return np.asarray(own[steps.low] * (1 - part) + own[steps.high] * part, dtype=np.float32)


def summed_features(graph: LineGraph, owner: Indices, count: int, step: float) -> Array:
    """(count, 216) float: the sums of `line_features` over the vertices of each owner, without making them.

    Parameters
    ----------
    graph, step : as of `line_features`.
    owner : (n,) int: whose each vertex is, 0 to count − 1; no edge leads from one's to another's.
    """
    steps = even_steps(graph, step)
    size = len(steps.xy)
    weight = np.zeros(size)
    np.add.at(weight, steps.low, 1 - steps.part)
    np.add.at(weight, steps.high, steps.part)
    whose = np.zeros(size, dtype=np.intp)
    whose[steps.low] = whose[steps.high] = owner
    walk = _walk(steps.edges, size)
    result = np.zeros((count, SIZE))
    for starts in _parts(size):
        # only those that start here are summed: there are many more rows
        rows, row = np.unique(whose[starts], return_inverse=True)
        result[rows] += _from(starts, row, weight[starts], steps.xy, steps.density, walk, steps.step)
    return result


def walk_features(xy: Array, density: Array, edges: Indices, step: float) -> Array:
    """(n, 216) float: the feature of every vertex of a graph, each edge counted as `step` mm of travel.

    Parameters
    ----------
    xy : (n, 2) float, mm.
    density : (n,) float.
    edges : (m, 2) int.
    step : mm.
    """
    walk = _walk(edges, len(xy))
    result = np.zeros((len(xy), SIZE))
    for starts in _parts(len(xy)):
        result[starts] = _from(starts, np.arange(len(starts)), np.ones(len(starts)), xy, density, walk, step)
    return result


def _parts(count: int) -> Iterator[Indices]:
    return (np.arange(start, min(start + _TOGETHER, count)) for start in range(0, count, _TOGETHER))


@dataclass(frozen=True)
class _Walk:
    """Directed edges (2m), where they lead, and the chances of what follows."""

    origin: Indices
    target: Indices
    onward: csr_matrix


def _walk(edges: Indices, count: int) -> _Walk:
    both = np.concatenate([edges, edges[:, ::-1]])
    order = np.argsort(both[:, 0], kind="stable")
    origin, target = both[order].T
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    back = place[(order + len(edges)) % len(order)] if len(order) else place
    first, exits = np.searchsorted(origin, np.arange(count)), np.bincount(origin, minlength=count)
    # every edge out of the end of an edge may follow, its own way back excepted
    follow = exits[target]
    row = np.repeat(np.arange(len(order)), follow)
    column = np.repeat(first[target] - (np.cumsum(follow) - follow), follow) + np.arange(int(follow.sum()))
    onward = column != back[row]
    row, column = row[onward], column[onward]
    chance = 1.0 / np.maximum(exits[target] - 1, 1)[row]
    return _Walk(origin, target, csr_matrix((chance, (row, column)), shape=(len(order), len(order))))


def _from(starts: Indices, row: Indices, weight: Array, xy: Array, density: Array, walk: _Walk, step: float) -> Array:
    """(rows, 216): the features of the vertices `starts` (k,), each so many times, summed in their rows."""
    ways, chance, owner, frame = _launched(starts, xy, walk, step)
    travel = [_travel_weights(k * step, step) for k in range(1, int(_FARTHEST / step) + 1)]
    whole = np.bincount(owner, chance * _weighed(ways, walk, [own.sum() for own in travel]), len(starts))
    # every feature sums to 1 by itself, whatever becomes of its walks
    chance *= (weight / np.where(whole == 0, 1.0, whole))[owner]
    rows = int(row.max()) + 1
    total = np.zeros((rows, _TRAVEL, 27))
    total[:, 0, 13] = np.bincount(row, weight * (whole == 0), rows)  # a dot goes nowhere
    begun = _Begun(row[owner], xy[starts[owner]], density[starts[owner]], frame)
    on: csr_matrix | None = None
    for k, shares in enumerate(travel, 1):
        if k <= len(ways):
            at = ways[k - 1]
            alive = at >= 0
            on = csr_matrix((chance[alive], (np.flatnonzero(alive), at[alive])), shape=(len(chance), len(walk.target)))
        else:
            assert on is not None
            on = on @ walk.onward
        if on.nnz == 0:
            break
        seen = _seen(on, walk, xy, density, begun, rows, k * step)
        for bin_ in np.flatnonzero(shares):
            total[:, bin_] += shares[bin_] * seen
    return total.reshape(-1, SIZE)


def _weighed(ways: list[Indices], walk: _Walk, weights: list[float]) -> Array:
    """(m,): what the steps of all walks of each beginning weigh together, of a beginning whose chance is 1."""
    total = np.zeros(len(ways[0]))
    for way, weight in zip(ways, weights, strict=False):
        total += weight * (way >= 0)
    alive = np.ones(len(walk.target))
    further = np.zeros(len(walk.target))
    for weight in weights[len(ways) :]:
        alive = walk.onward @ alive
        further += weight * alive
    goes = ways[-1] >= 0
    total[goes] += further[ways[-1][goes]]
    return total


def _launched(starts: Indices, xy: Array, walk: _Walk, step: float) -> tuple[list[Indices], Array, Indices, Array]:
    """All beginnings of walks, until they have gone far enough to have a direction.

    Returns
    -------
    ways : for each step the directed edge (m,) of every beginning, −1 where it was over before.
    chance : (m,) float.
    owner : (m,) int: which start.
    frame : (m, 2) float: unit vector of the direction.
    """
    exits = np.searchsorted(walk.origin, starts, side="right") - np.searchsorted(walk.origin, starts)
    owner = np.repeat(np.arange(len(starts)), exits)
    first = np.searchsorted(walk.origin, starts)
    edge = np.repeat(first - (np.cumsum(exits) - exits), exits) + np.arange(int(exits.sum()))
    chance = 1.0 / np.maximum(exits, 1)[owner]
    ways, last = [edge], edge
    for _ in range(max(1, int(np.ceil(_FORWARD / step - 1e-9))) - 1):
        at = ways[-1]
        follow = np.where(at >= 0, np.diff(walk.onward.indptr)[at], 0)
        copies = np.maximum(follow, 1)  # one that is over stays as it is
        row = np.repeat(np.arange(len(at)), copies)
        slot = np.arange(len(row)) - np.repeat(np.cumsum(copies) - copies, copies)
        goes = follow[row] > 0
        entry = np.where(goes, walk.onward.indptr[at[row]] + slot, 0)
        following = walk.onward.indices[entry] if len(walk.onward.indices) else np.zeros(len(row), dtype=np.intp)
        chance = chance[row] * (np.where(goes, walk.onward.data[entry], 1.0) if len(walk.onward.data) else 1.0)
        ways = [way[row] for way in ways] + [np.where(goes, following, -1).astype(np.intp)]
        owner, last = owner[row], np.where(goes, following, last[row]).astype(np.intp)
    way = xy[walk.target[last]] - xy[starts[owner]]
    size = np.linalg.norm(way, axis=1)
    frame = np.where(size[:, None] > 1e-9, way / np.maximum(size, 1e-9)[:, None], [1.0, 0.0])
    return ways, chance, owner, frame


@dataclass(frozen=True)
class _Begun:
    """Beginnings of walks: the row that each is summed in, where it starts, on what density, and in what direction."""

    row: Indices
    xy: Array
    density: Array
    frame: Array


def _seen(on: csr_matrix, walk: _Walk, xy: Array, density: Array, begun: _Begun, rows: int, travelled: float) -> Array:
    """(rows, 27): where the walks are, in bins of density change, δx and δy."""
    of = np.repeat(np.arange(on.shape[0]), np.diff(on.indptr))
    at = walk.target[on.indices]
    away, frame = (xy[at] - begun.xy[of]) / travelled, begun.frame[of]
    x = away[:, 0] * frame[:, 0] + away[:, 1] * frame[:, 1]
    y = away[:, 1] * frame[:, 0] - away[:, 0] * frame[:, 1]
    planes = [(27 * begun.row[of], on.data)]
    for value, size in ((density[at] - begun.density[of], 9), (x, 3), (y, 1)):
        low, part = _bins(value)
        planes = [
            (cell + size * (low + k), share * taken)
            for cell, share in planes
            for k, taken in ((0, 1 - part), (1, part))
        ]
    found = sum(np.bincount(cell, share, 27 * rows) for cell, share in planes)
    return np.asarray(found).reshape(rows, 27)


def _bins(value: Array) -> tuple[Indices, Array]:
    """Of three overlapping bins with centres −½, 0, ½ the lower one of the two that a value lies in, and its share in
    the other; farther out is the outer one's."""
    place = np.clip(2 * value + 1, 0, 2)
    low = (place >= 1).astype(np.intp)
    return low, place - low


def _travel_weights(travelled: float, step: float) -> Array:
    """(8,) float: shares of a place at this distance in the travel bins, times the density of the prior.

    Bins grow by a quarter each and are equally likely, so that distances in a wide bin are less so.
    """
    widths = _RATIO ** np.arange(_TRAVEL)
    edges = np.concatenate([[0], np.cumsum(widths)]) * _FARTHEST / widths.sum()
    centres = (edges[1:] + edges[:-1]) / 2
    own = min(int(np.searchsorted(edges, travelled, side="left")) - 1, _TRAVEL - 1)
    place = np.interp(travelled, centres, np.arange(_TRAVEL))
    weights = np.maximum(0, 1 - np.abs(np.arange(_TRAVEL) - place))
    return np.asarray(weights * step / (edges[own + 1] - edges[own]))
