"""The glyphs of a word as one line graph, ligatures that two of them have in common kept once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, LineGraph

_ONE = 0.12  # mm within which two lines are one
_LONGEST = 0.4  # mm that a cut line is joined over


def welded(graphs: Sequence[LineGraph]) -> LineGraph:
    """One graph of several in the same frame (mm); where the next shows the line of those before, it is left out.

    A line that is cut by this goes on in the vertex of the others that is nearest to the cut.
    """
    whole = graphs[0]
    for graph in graphs[1:]:
        whole = _pair(whole, graph)
    return whole


def _pair(a: LineGraph, b: LineGraph) -> LineGraph:
    from scipy.spatial import cKDTree

    if not (len(a) and len(b)):
        return a if len(a) else b
    away, at = cKDTree(a.xy).query(b.xy)
    gone = (away < _ONE) & (np.abs(np.sum(directions(a)[at] * directions(b), axis=1)) > np.sqrt(0.75))
    if gone.all():
        return a
    kept = b.take(~gone)
    number = np.cumsum(~gone) - 1
    cut = b.edges[gone[b.edges].sum(axis=1) == 1]
    inner = np.where(gone[cut[:, 0]], cut[:, 1], cut[:, 0])
    lost = np.where(gone[cut[:, 0]], cut[:, 0], cut[:, 1])
    near = away[lost] < _LONGEST
    joins = np.stack([at[lost], number[inner] + len(a)], axis=1)[near]
    edges = np.concatenate([a.edges, kept.edges + len(a), joins])
    xy, radius, density, uv = (
        np.concatenate([getattr(one, name) for one in (a, kept)]) for name in ("xy", "radius", "density", "uv")
    )
    return LineGraph(xy, radius, density, uv, edges)


def directions(graph: LineGraph) -> Array:
    """(n, 2) float: where the line leads at every vertex, one way or the other; 0 at junctions and dots."""
    first, second = np.full(len(graph), -1), np.full(len(graph), -1)
    a, b = np.concatenate([graph.edges, graph.edges[:, ::-1]]).T
    first[a] = b
    second[a[::-1]] = b[::-1]
    known: NDArray[np.bool_] = (graph.degree == 2) | (graph.degree == 1)
    here = np.arange(len(graph))
    first, second = np.where(known, first, here), np.where(known, second, here)
    along = graph.xy[first] - graph.xy[np.where(first == second, here, second)]
    size = np.linalg.norm(along, axis=1, keepdims=True)
    return np.asarray(along / np.maximum(size, 1e-12))
