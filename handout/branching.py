"""Ordering the vertices of a graph along its paths, without walking it vertex by vertex."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]


def branches(edges: Indices, count: int) -> tuple[Indices, ...]:
    """The paths of a graph between the vertices that do not have two edges.

    Parameters
    ----------
    edges : (m, 2) int, pairs of vertices, each pair once.
    count : number of vertices.

    Returns
    -------
    Arrays of vertices in order along each path, both ends included; a loop without a junction begins and ends with
    the same vertex; a vertex without an edge is a path of its own.
    """
    degree = np.bincount(edges.ravel(), minlength=count)
    through = degree == 2
    inner = through[edges].all(axis=1)
    touching = edges[~inner]
    label, order = _ordered(edges[inner], through)
    runs = np.split(order, np.flatnonzero(np.diff(label[order])) + 1) if len(order) else []
    found = _with_ends(runs, touching, through)
    found += [pair for pair in touching if not through[pair].any()]
    found += [np.array([lone]) for lone in np.flatnonzero(degree == 0)]
    return tuple(np.asarray(path, dtype=np.intp) for path in found)


def _ordered(edges: Indices, through: NDArray[np.bool_]) -> tuple[Indices, Indices]:
    """Label of the run of every vertex that has two edges, and those vertices sorted by run and along it."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = len(through)
    joined = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
    label = connected_components(joined, directed=False)[1].astype(np.intp)
    vertices = np.flatnonzero(through)
    if not len(vertices):
        return label, vertices
    ends = np.bincount(edges.ravel(), minlength=count) < 2
    # the first vertex of each run, an end where it has one (a closed loop has none)
    by_run = vertices[np.lexsort((~ends[vertices], label[vertices]))]
    first = by_run[np.unique(label[by_run], return_index=True)[1]]
    away = _steps_from(first, edges, joined, ends)
    return label, vertices[np.lexsort((away[vertices], label[vertices]))]


def _steps_from(first: Indices, edges: Indices, joined: object, ends: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Steps of every vertex along its run from the run's first vertex; a loop is opened beside it."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    closed = first[~ends[first]]
    if len(closed):
        # one of the two edges of the first vertex goes, so that the loop has an order
        starts = np.zeros(len(ends), dtype=bool)
        starts[closed] = True
        hit = np.flatnonzero(starts[edges].any(axis=1))
        owner = np.where(starts[edges[hit, 0]], edges[hit, 0], edges[hit, 1])
        gone = hit[np.unique(owner, return_index=True)[1]]
        edges = np.delete(edges, gone, axis=0)
        joined = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(ends), len(ends))).tocsr()
    away = dijkstra(joined, directed=False, indices=first, unweighted=True, min_only=True)
    return np.asarray(away)


def _with_ends(runs: list[Indices], touching: Indices, through: NDArray[np.bool_]) -> list[Indices]:
    """Each run with the junction or line end that it meets at either side."""
    both = np.concatenate([touching, touching[:, ::-1]])
    both = both[through[both[:, 0]] & ~through[both[:, 1]]]
    both = both[np.argsort(both[:, 0], kind="stable")]
    low = np.searchsorted(both[:, 0], [run[0] for run in runs], side="left") if runs else np.zeros(0, dtype=np.intp)
    high = np.searchsorted(both[:, 0], [run[-1] for run in runs], side="right") if runs else low
    found = []
    for run, i, j in zip(runs, low, high, strict=True):
        if i < len(both) and both[i, 0] == run[0]:
            found.append(np.concatenate([both[i : i + 1, 1], run, both[j - 1 : j, 1]]))
        else:
            found.append(np.concatenate([run, run[:1]]))
    return found
