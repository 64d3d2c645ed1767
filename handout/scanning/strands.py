"""Junctions of a skeleton as the pen made them: strokes that run into one another taken apart, crossings made whole.

The skeleton of a mask parts two strokes only where paper lies between them, by a hook at right angles to both, and
draws a crossing as two forks with a bridge.  Neither is a way that a pen goes.

Source: handwriting specification §5 (junctions); the way apart follows from the width of the line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.branching import branches
from handout.scanning.skeleton import unique_edges
from handout.values import Array, Indices

_WIDE = 1.2  # times the usual half width: more is two strokes
_ACUTE = 0.17  # cosine; strokes that part at a wider angle do not run along each other
_FARTHEST = 10.0  # half widths that two strokes are followed
_BRIDGE = 1.5  # half widths: a shorter one is a crossing


@dataclass
class _Web:
    """A graph as paths between its knots, whose vertices can be moved and added.

    xy : places; inside : distance from the edge of the ink there.
    paths : vertices from knot to knot; None where a path is gone.
    at : for every knot the paths that end there, and at which end (0 or −1).
    """

    xy: list[Array]
    inside: list[float]
    paths: list[list[int] | None]
    at: dict[int, list[tuple[int, int]]]

    def outward(self, path: int, end: int) -> list[int]:
        """Vertices of a path, from the end that is given."""
        found = self.paths[path]
        assert found is not None
        return found if end == 0 else found[::-1]

    def put(self, path: int, end: int, vertices: list[int]) -> None:
        """The path made anew from that end on."""
        self.paths[path] = vertices if end == 0 else vertices[::-1]

    def add(self, place: Array, inside: float) -> int:
        """A new vertex."""
        self.xy.append(place)
        self.inside.append(inside)
        return len(self.xy) - 1


def apart(xy: Array, edges: Indices, inside: Array, half: float) -> tuple[Array, Indices]:
    """The skeleton with strokes taken apart where they share ink, and with whole crossings.

    Parameters
    ----------
    xy : (n, 2) float, pixels; edges : (m, 2) int.
    inside : (n,) float, pixels, distance from the edge of the ink.
    half : half the usual width of a line, pixels.
    """
    web = _web(xy, edges, inside)
    for knot in [k for k, ends in web.at.items() if len(ends) == 3]:
        if len(web.at.get(knot, ())) == 3 and web.inside[knot] > _WIDE * half:
            _unzip(web, knot, half)
    for number, path in enumerate(web.paths):
        if path is not None and len(path) <= _BRIDGE * half + 1:
            _join(web, number)
    return _graph(web)


def _web(xy: Array, edges: Indices, inside: Array) -> _Web:
    paths: list[list[int] | None] = [path.tolist() for path in branches(edges, len(xy))]
    at: dict[int, list[tuple[int, int]]] = {}
    for number, path in enumerate(paths):
        assert path is not None
        if len(path) > 1:
            at.setdefault(path[0], []).append((number, 0))
            at.setdefault(path[-1], []).append((number, -1))
    return _Web(list(xy), inside.tolist(), paths, at)


def _graph(web: _Web) -> tuple[Array, Indices]:
    """Vertices that any path still has, and edges."""
    kept = [np.array(path, dtype=np.intp) for path in web.paths if path is not None]
    if not kept:
        return np.zeros((0, 2)), np.zeros((0, 2), dtype=np.intp)
    used, number = np.unique(np.concatenate(kept), return_inverse=True)
    runs = np.split(number.astype(np.intp), np.cumsum([len(path) for path in kept])[:-1])
    edges = np.concatenate([np.stack([run[:-1], run[1:]], axis=1) for run in runs])
    return np.array(web.xy)[used], unique_edges(edges)


def _leaving(web: _Web, path: list[int], half: float) -> Array:
    """(2,) the direction in which a path leaves its first vertex, beyond the ink that it shares there."""
    first = min(int(1.2 * web.inside[path[0]]) + 1, (len(path) - 1) // 2)
    last = min(first + int(2 * half) + 1, len(path) - 1)
    way = web.xy[path[last]] - web.xy[path[first]]
    return np.asarray(way / max(float(np.hypot(*way)), 1e-9))


def _unzip(web: _Web, knot: int, half: float) -> None:
    """Two strokes that part at a knot taken apart along the third path, as far as that is wider than a line."""
    ends = web.at[knot]
    ways = [web.outward(*end) for end in ends]
    to = [_leaving(web, way, half) for way in ways]
    pairs = [(float(to[i] @ to[j]), i, j) for i, j in ((0, 1), (0, 2), (1, 2))]
    cosine, i, j = max(pairs)
    k = 3 - i - j
    if cosine < _ACUTE or to[k] @ (to[i] + to[j]) > 0 or ends[k][0] in (ends[i][0], ends[j][0]):
        return
    shared = _shared(web, ways[k], half)
    if shared < 1:
        return
    zone = ways[k][: shared + 1]
    along = web.xy[zone[-1]] - web.xy[zone[0]]
    sides = [np.sign(along[0] * to[s][1] - along[1] * to[s][0]) for s in (i, j)]
    if sides[0] * sides[1] >= 0:
        # both on one side of the shared stroke as far as can be told: which is which is told by the two
        turn = np.sign(to[i][0] * to[j][1] - to[i][1] * to[j][0])
        sides = [turn, -turn] if turn else [1.0, -1.0]
    reach = round(web.inside[knot])
    strands = [_strand(web, zone, float(side), half) for side in sides]
    loop = ends[i][0] == ends[j][0]
    for end, strand in zip((ends[i], ends[j]), strands, strict=True):
        way = web.outward(*end)
        keep = min(reach, (len(way) - 1) // (3 if loop else 1))
        web.put(*end, [zone[-1], *strand[::-1], *_straight(web, strand, way, keep)])
    _move(web, knot, zone[-1], ends[k], ways[k][shared:], [ends[i], ends[j]])


def _shared(web: _Web, way: list[int], half: float) -> int:
    """How many steps along a path the ink is wider than one line's."""
    most = min(len(way) - 1, int(_FARTHEST * half))
    for step in range(most + 1):
        if web.inside[way[step]] < _WIDE * half:
            return step
    return most


def _strand(web: _Web, zone: list[int], side: float, half: float) -> list[int]:
    """New vertices beside those of the zone, all but the last: a half width from its edge on one side."""
    places = np.array([web.xy[v] for v in zone])
    at = np.arange(len(zone))
    along = places[np.minimum(at + 2, len(zone) - 1)] - places[np.maximum(at - 2, 0)]
    along /= np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    # y runs down: to the right of the way is where the cross product is positive
    aside = side * np.maximum([web.inside[v] - half for v in zone], 0.0)
    beside = places + aside[:, None] * np.stack([-along[:, 1], along[:, 0]], axis=1)
    return [web.add(place, half) for place in beside[:-1]]


def _straight(web: _Web, strand: list[int], way: list[int], reach: int) -> list[int]:
    """A path without its hook: new vertices straight from the strand to where the path has left the shared ink."""
    reach = max(1, min(reach, len(way) - 1))
    a, b = web.xy[strand[0]], web.xy[way[reach]]
    parts = max(1, round(float(np.hypot(*(b - a)))))
    between = [web.add(a + (b - a) * (n / parts), web.inside[way[reach]]) for n in range(1, parts)]
    return between + way[reach:]


def _move(web: _Web, knot: int, to: int, stem: tuple[int, int], rest: list[int], others: list[tuple[int, int]]) -> None:
    """The knot is now at the vertex `to`, `rest` what is left of its stem."""
    del web.at[knot]
    if len(rest) > 1:
        web.put(*stem, rest)
        web.at[to] = [*others, stem]
        return
    web.paths[stem[0]] = None
    far = [end for end in web.at.get(to, []) if end[0] != stem[0]]
    web.at[to] = far + others


def _join(web: _Web, number: int) -> None:
    """A short bridge between two forks made one crossing, half way."""
    path = web.paths[number]
    assert path is not None
    a, b = path[0], path[-1]
    if a == b or len(web.at.get(a, ())) != 3 or len(web.at.get(b, ())) != 3:
        return
    web.xy[a] = (web.xy[a] + web.xy[b]) / 2
    for end in web.at[b]:
        if end[0] != number:
            way = web.outward(*end)
            web.put(*end, [a, *way[1:]])
    web.at[a] = [end for end in web.at[a] + web.at[b] if end[0] != number]
    del web.at[b]
    web.paths[number] = None
