"""From a mask to a graph of its middle line, in whole pixels, with junctions as the pen made them.

The skeleton of a mask parts two strokes only where paper lies between them, by a hook at right angles to both, and
draws a crossing as two forks with a bridge.  No pen goes that way: so strokes that have run into one another are taken
apart (`separate_strokes`), crossings are made one vertex, and spurs are taken off.

Source: seed 000, §5.1.2; taking strokes apart: own method, from the width of the line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.branching import branches, number_pieces
from handout.libraries import cv2
from handout.values import Array, Indices

_ROUNDS = 3  # taking off a spur can expose another
_HOLE = 4.0  # pixels at 300 dpi: smaller holes are noise, not loops of letters
_WIDE = 1.2  # times the usual half width: more is two strokes
_ACUTE = 0.17  # cosine; strokes that part at a wider angle do not run along each other
_FARTHEST = 10.0  # half widths that two strokes are followed
_BRIDGE = 1.5  # half widths: a shorter one is a crossing


def fill_holes(ink: NDArray[np.bool_], dpi: float) -> NDArray[np.bool_]:
    """The mask without pinholes, which would become loops."""
    least = max(1, round(_HOLE * (dpi / 300) ** 2))
    count, labels, stats, _ = cv2.connectedComponentsWithStats((~ink).astype(np.uint8), connectivity=4)
    small = stats[:count, cv2.CC_STAT_AREA] <= least
    small[0] = False
    return np.asarray(ink | small[labels])


def skeleton(ink: NDArray[np.bool_]) -> tuple[Array, Indices]:
    """Middle line of a mask (h, w) as it comes, with spurs.

    Returns xy : (n, 2) float, pixels, x to the right.
        edges : (m, 2) int, pairs of vertices, each once.
    """
    from skimage.morphology import skeletonize

    y, x = np.nonzero(skeletonize(ink))  # type: ignore[no-untyped-call]
    xy = np.stack([x, y], axis=1).astype(np.float64)
    # the graph with each cluster of touching pixels that have three or more neighbours merged to one vertex
    edges = _neighbours(y, x, ink.shape)
    degree = np.bincount(edges.ravel(), minlength=len(xy))
    group = number_pieces(edges[(degree[edges] >= 3).all(axis=1)], len(xy))
    centre = np.stack([np.bincount(group, xy[:, k]) / np.bincount(group) for k in (0, 1)], axis=1)
    return centre, unique_edges(group[edges])


def without_spurs(xy: Array, edges: Indices, inside: NDArray[np.float32]) -> tuple[Array, Indices]:
    """The graph without branches that end free and are no longer than the line is wide.

    inside : (h, w) float32: distance from the edge of the ink, for the length of spurs.
    """
    for _ in range(_ROUNDS):
        spurs = _spurs(xy, edges, inside)
        if not spurs.any():
            break
        keep = ~spurs
        number = np.cumsum(keep) - 1
        xy, edges = (xy[keep], number[edges[keep[edges].all(axis=1)]])
    return xy, edges


def _neighbours(y: Indices, x: Indices, shape: tuple[int, int]) -> Indices:
    """Pairs of pixels that touch; by a corner only where they have no common side neighbour."""
    number = np.full((shape[0] + 2, shape[1] + 2), -1, dtype=np.int32)
    number[y + 1, x + 1] = np.arange(len(y))

    def look_at(dy: int, dx: int) -> Indices:
        return np.asarray(number[y + 1 + dy, x + 1 + dx], dtype=np.intp)

    pairs = []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        other = look_at(dy, dx)
        touching = other >= 0
        if dy and dx:
            touching &= (look_at(0, dx) < 0) & (look_at(dy, 0) < 0)
        pairs.append(np.stack([np.flatnonzero(touching), other[touching]], axis=1))
    return np.concatenate(pairs)


def unique_edges(edges: Indices) -> Indices:
    """Pairs of different vertices, each pair once."""
    edges = np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1)
    return np.unique(edges, axis=0) if len(edges) else edges.reshape(0, 2)


def _spurs(xy: Array, edges: Indices, inside: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Vertices (n,) of branches that end free and are no longer than the line is wide at their root.

    A branch that ends free at both sides is a stroke and stays; where every branch of a junction would go, the
    longest stays.
    """
    degree = np.bincount(edges.ravel(), minlength=len(xy))
    spur = np.zeros(len(xy), dtype=bool)
    candidates: list[tuple[float, int, Indices]] = []
    open_at = degree.copy()
    for path in branches(edges, len(xy)):
        first, last = int(path[0]), int(path[-1])
        if first == last or (degree[first] == 1) == (degree[last] == 1):
            continue
        root, body = (last, path[:-1]) if degree[first] == 1 else (first, path[1:])
        length = float(np.linalg.norm(np.diff(xy[path], axis=0), axis=1).sum())
        x, y = np.rint(xy[root]).astype(int)
        if length < inside[y, x] + 1:
            candidates.append((length, root, body))
    for _, root, body in sorted(candidates, key=lambda candidate: candidate[0]):
        if open_at[root] > 1:
            open_at[root] -= 1
            spur[body] = True
    return spur


@dataclass
class _PathGraph:
    """A graph as paths between its junctions, whose vertices can be moved and added.

    xy : places; inside : distance from the edge of the ink there.
    paths : vertices from junction to junction; None where a path is gone.
    at : for every junction the paths that end there, and at which end (0 or −1).
    """

    xy: list[Array]
    inside: list[float]
    paths: list[list[int] | None]
    at: dict[int, list[tuple[int, int]]]

    def outward(self, path: int, end: int) -> list[int]:
        """Vertices of a path, beginning at one of its ends."""
        vertices = self.paths[path]
        assert vertices is not None
        return vertices if end == 0 else vertices[::-1]

    def replace_vertices(self, path: int, end: int, vertices: list[int]) -> None:
        """Replace the vertices of a path, given from one of its ends on."""
        self.paths[path] = vertices if end == 0 else vertices[::-1]

    def add(self, place: Array, inside: float) -> int:
        """A new vertex."""
        self.xy.append(place)
        self.inside.append(inside)
        return len(self.xy) - 1


def separate_strokes(xy: Array, edges: Indices, inside: Array, half: float) -> tuple[Array, Indices]:
    """The skeleton with strokes taken apart where they share ink, and with whole crossings.

    xy : (n, 2) float, pixels; edges : (m, 2) int.
    inside : (n,) float, pixels, distance from the edge of the ink.
    half : half the usual width of a line, pixels.
    """
    web = _path_graph(xy, edges, inside)
    for junction in [k for k, ends in web.at.items() if len(ends) == 3]:
        if len(web.at.get(junction, ())) == 3 and web.inside[junction] > _WIDE * half:
            _separate(web, junction, half)
    for number, path in enumerate(web.paths):
        if path is not None and len(path) <= _BRIDGE * half + 1:
            _merge_bridge(web, number)
    return _graph(web)


def _path_graph(xy: Array, edges: Indices, inside: Array) -> _PathGraph:
    paths: list[list[int] | None] = [path.tolist() for path in branches(edges, len(xy))]
    at: dict[int, list[tuple[int, int]]] = {}
    for number, path in enumerate(paths):
        assert path is not None
        if len(path) > 1:
            at.setdefault(path[0], []).append((number, 0))
            at.setdefault(path[-1], []).append((number, -1))
    return _PathGraph(list(xy), inside.tolist(), paths, at)


def _graph(web: _PathGraph) -> tuple[Array, Indices]:
    """Vertices that any path still has, and edges."""
    paths = [np.array(path, dtype=np.intp) for path in web.paths if path is not None]
    if not paths:
        return np.zeros((0, 2)), np.zeros((0, 2), dtype=np.intp)
    vertices, number = np.unique(np.concatenate(paths), return_inverse=True)
    runs = np.split(number.astype(np.intp), np.cumsum([len(path) for path in paths])[:-1])
    edges = np.concatenate([np.stack([run[:-1], run[1:]], axis=1) for run in runs])
    return np.array(web.xy)[vertices], unique_edges(edges)


def _direction(web: _PathGraph, path: list[int], half: float) -> Array:
    """(2,) the direction in which a path leaves its first vertex, beyond the ink that it shares there."""
    first = min(int(1.2 * web.inside[path[0]]) + 1, (len(path) - 1) // 2)
    last = min(first + int(2 * half) + 1, len(path) - 1)
    chord = web.xy[path[last]] - web.xy[path[first]]
    return np.asarray(chord / max(float(np.hypot(*chord)), 1e-9))


def _separate(web: _PathGraph, junction: int, half: float) -> None:
    """Two strokes that part at a junction taken apart along the third path, as far as that is wider than a line."""
    ends = web.at[junction]
    outward = [web.outward(*end) for end in ends]
    directions = [_direction(web, way, half) for way in outward]
    pairs = [(float(directions[i] @ directions[j]), i, j) for i, j in ((0, 1), (0, 2), (1, 2))]
    cosine, i, j = max(pairs)
    k = 3 - i - j
    if cosine < _ACUTE or directions[k] @ (directions[i] + directions[j]) > 0 or ends[k][0] in (ends[i][0], ends[j][0]):
        return
    shared = _shared_length(web, outward[k], half)
    if shared < 1:
        return
    zone = outward[k][: shared + 1]
    along = web.xy[zone[-1]] - web.xy[zone[0]]
    sides = [np.sign(along[0] * directions[s][1] - along[1] * directions[s][0]) for s in (i, j)]
    if sides[0] * sides[1] >= 0:
        # both on one side of the shared stroke as far as can be told: which is which is told by the two
        turn = np.sign(directions[i][0] * directions[j][1] - directions[i][1] * directions[j][0])
        sides = [turn, -turn] if turn else [1.0, -1.0]
    reach = round(web.inside[junction])
    strands = [_offset_strand(web, zone, float(side), half) for side in sides]
    loop = ends[i][0] == ends[j][0]
    for end, strand in zip((ends[i], ends[j]), strands, strict=True):
        way = web.outward(*end)
        keep = min(reach, (len(way) - 1) // (3 if loop else 1))
        web.replace_vertices(*end, [zone[-1], *strand[::-1], *_straighten_path(web, strand, way, keep)])
    _move_junction(web, junction, zone[-1], ends[k], outward[k][shared:], [ends[i], ends[j]])


def _shared_length(web: _PathGraph, way: list[int], half: float) -> int:
    """How many steps along a path the ink is wider than one line's."""
    limit = min(len(way) - 1, int(_FARTHEST * half))
    for step in range(limit + 1):
        if web.inside[way[step]] < _WIDE * half:
            return step
    return limit


def _offset_strand(web: _PathGraph, zone: list[int], side: float, half: float) -> list[int]:
    """New vertices beside those of the zone, all but the last: a half width from its edge on one side."""
    places = np.array([web.xy[v] for v in zone])
    at = np.arange(len(zone))
    along = places[np.minimum(at + 2, len(zone) - 1)] - places[np.maximum(at - 2, 0)]
    along /= np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    # y runs down: to the right of the way is where the cross product is positive
    aside = side * np.maximum([web.inside[v] - half for v in zone], 0.0)
    beside = places + aside[:, None] * np.stack([-along[:, 1], along[:, 0]], axis=1)
    return [web.add(place, half) for place in beside[:-1]]


def _straighten_path(web: _PathGraph, strand: list[int], way: list[int], reach: int) -> list[int]:
    """A path without its hook: new vertices straight from the strand to where the path has left the shared ink."""
    reach = max(1, min(reach, len(way) - 1))
    a, b = web.xy[strand[0]], web.xy[way[reach]]
    parts = max(1, round(float(np.hypot(*(b - a)))))
    between = [web.add(a + (b - a) * (n / parts), web.inside[way[reach]]) for n in range(1, parts)]
    return between + way[reach:]


def _move_junction(
    web: _PathGraph, junction: int, to: int, stem: tuple[int, int], rest: list[int], others: list[tuple[int, int]]
) -> None:
    """Move a junction to the vertex `to` of its stem, of which `rest` is left."""
    del web.at[junction]
    if len(rest) > 1:
        web.replace_vertices(*stem, rest)
        web.at[to] = [*others, stem]
        return
    web.paths[stem[0]] = None
    remaining = [end for end in web.at.get(to, []) if end[0] != stem[0]]
    web.at[to] = remaining + others


def _merge_bridge(web: _PathGraph, number: int) -> None:
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
            web.replace_vertices(*end, [a, *way[1:]])
    web.at[a] = [end for end in web.at[a] + web.at[b] if end[0] != number]
    del web.at[b]
    web.paths[number] = None
