"""From a mask to a graph of its middle line, in whole pixels: junctions merged, spurs taken off.

Source: seed 000, §5.1.2; handwriting specification §5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.branching import branches
from handout.values import Array, Indices

_ROUNDS = 3  # a spur taken off can bare another
_HOLE = 4.0  # pixels at 300 dpi


def fill_holes(ink: NDArray[np.bool_], dpi: float) -> NDArray[np.bool_]:
    """The mask without pinholes, which would become loops."""
    import cv2

    least = max(1, round(_HOLE * (dpi / 300) ** 2))
    count, labels, stats, _ = cv2.connectedComponentsWithStats((~ink).astype(np.uint8), connectivity=4)
    small = stats[:count, cv2.CC_STAT_AREA] <= least
    small[0] = False
    return np.asarray(ink | small[labels])


def skeleton_graph(ink: NDArray[np.bool_], inside: NDArray[np.float32]) -> tuple[Array, Indices]:
    """Middle line of a mask without spurs.

    Parameters
    ----------
    ink : (h, w) bool
    inside : (h, w) float32: distance from the edge of the ink, for the length of spurs.

    Returns
    -------
    xy : (n, 2) float, pixels, x to the right.
    edges : (m, 2) int, pairs of vertices, each once.
    """
    return without_spurs(*skeleton(ink), inside)


def skeleton(ink: NDArray[np.bool_]) -> tuple[Array, Indices]:
    """Middle line of a mask (h, w) as it comes, with spurs: places (n, 2) and pairs of them, as `skeleton_graph`."""
    from skimage.morphology import skeletonize

    y, x = np.nonzero(skeletonize(ink))  # type: ignore[no-untyped-call]
    xy = np.stack([x, y], axis=1).astype(np.float64)
    return _merge_junctions(xy, _neighbours(y, x, ink.shape))


def without_spurs(xy: Array, edges: Indices, inside: NDArray[np.float32]) -> tuple[Array, Indices]:
    """The graph without branches that end free and are no longer than the line is wide."""
    for _ in range(_ROUNDS):
        spurs = _spurs(xy, edges, inside)
        if not spurs.any():
            break
        xy, edges = _kept(xy, edges, ~spurs)
    return xy, edges


def _neighbours(y: Indices, x: Indices, shape: tuple[int, int]) -> Indices:
    """Pairs of pixels that touch; by a corner only where they have no common side neighbour."""
    number = np.full((shape[0] + 2, shape[1] + 2), -1, dtype=np.int32)
    number[y + 1, x + 1] = np.arange(len(y))

    def at(dy: int, dx: int) -> Indices:
        return np.asarray(number[y + 1 + dy, x + 1 + dx], dtype=np.intp)

    pairs = []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        other = at(dy, dx)
        touch = other >= 0
        if dy and dx:
            touch &= (at(0, dx) < 0) & (at(dy, 0) < 0)
        pairs.append(np.stack([np.flatnonzero(touch), other[touch]], axis=1))
    return np.concatenate(pairs)


def _merge_junctions(xy: Array, edges: Indices) -> tuple[Array, Indices]:
    """Every cluster of touching pixels with three or more neighbours made one vertex, at its centre."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = len(xy)
    degree = np.bincount(edges.ravel(), minlength=count)
    within = edges[(degree[edges] >= 3).all(axis=1)]
    joined = coo_matrix((np.ones(len(within), dtype=np.int8), tuple(within.T)), shape=(count, count))
    total, group = connected_components(joined, directed=False)
    size = np.bincount(group, minlength=total)
    centre = np.stack([np.bincount(group, xy[:, k], minlength=total) / size for k in (0, 1)], axis=1)
    return centre, unique_edges(group[edges].astype(np.intp))


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
    gone = np.zeros(len(xy), dtype=bool)
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
    for _, root, body in sorted(candidates, key=lambda one: one[0]):
        if open_at[root] > 1:
            open_at[root] -= 1
            gone[body] = True
    return gone


def _kept(xy: Array, edges: Indices, keep: NDArray[np.bool_]) -> tuple[Array, Indices]:
    number = np.cumsum(keep) - 1
    return xy[keep], number[edges[keep[edges].all(axis=1)]]
