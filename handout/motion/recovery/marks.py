"""Places on the line of a letter where, by how it is usually written, strokes begin, cease or turn back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from handout.motion.recovery.models import Models, frame
from handout.motion.recovery.network import Network
from handout.values import Array, Indices

_LOOKED = 3  # forms that say where strokes may begin and turn
_CLEAR = 7.0  # half widths from a knot to another that is put on a branch
_CUTS = 2


def marks(net: Network, body: Sequence[int], own: Indices, laid: Array, letter: Models) -> list[int]:
    """Vertices on branches where the nearest forms of the letter begin, cease or turn back."""
    xy = net.xy[own]
    middle = xy.mean(axis=0)
    size = float(np.sqrt((xy.std(axis=0) ** 2).sum()))
    marks = np.concatenate(letter.ends[:_LOOKED]) @ frame(xy - middle).T + middle
    gap = np.hypot(xy[:, 0] - marks[:, :1], xy[:, 1] - marks[:, 1:])
    near = gap.argmin(axis=1)
    near = near[gap[np.arange(len(near)), near] <= 0.3 * size]
    place = {v: (b, i) for b in body for i, v in enumerate(net.branches[b].tolist())}
    runs: dict[int, Array] = {}
    found: list[int] = []
    # many marks of different forms are at one vertex
    for mark in dict.fromkeys(own[near].tolist()):
        vertex = _settled(net, mark, place, runs)
        if vertex is not None and vertex not in found and _clear(net, vertex, found, place):
            found.append(vertex)
            if len(found) == _CUTS:
                break
    return found


def _settled(net: Network, vertex: int, place: dict[int, tuple[int, int]], runs: dict[int, Array]) -> int | None:
    """The sharpest bend near a vertex of a branch, if that is far enough from both its knots.

    runs : for branches how far along them their vertices are, half widths; more are added.
    """
    b, i = place[vertex]
    path = net.branches[b]
    if path[0] == path[-1]:
        return vertex if len(path) > 8 else None
    if b not in runs:
        step = net.xy[path[1:]] - net.xy[path[:-1]]
        runs[b] = np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))]) / net.half
    run = runs[b]
    near = np.flatnonzero((np.abs(run - run[i]) < _CLEAR) & (run > _CLEAR) & (run < run[-1] - _CLEAR))
    if not len(near):
        return None
    reach = max(2, round(2 * (len(path) - 1) / max(float(run[-1]), 1e-9)))
    before, after = np.maximum(near - reach, 0), np.minimum(near + reach, len(path) - 1)
    a, c = net.xy[path[near]] - net.xy[path[before]], net.xy[path[after]] - net.xy[path[near]]
    bend = (a * c).sum(axis=1) / np.maximum(np.hypot(*a.T) * np.hypot(*c.T), 1e-12) + 0.02 * np.abs(run[near] - run[i])
    return int(path[near[int(bend.argmin())]])


def _clear(net: Network, vertex: int, found: Sequence[int], place: dict[int, tuple[int, int]]) -> bool:
    b, _ = place[vertex]
    own = [v for v in found if place[v][0] == b]
    return all(float(np.hypot(*(net.xy[v] - net.xy[vertex]))) > 1.5 * _CLEAR * net.half for v in own)
