"""A line graph laid out anew in even steps, with the way back to its own vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from handout.values import Array, Indices, LineGraph


@dataclass(frozen=True, eq=False)
class Steps:
    """A graph whose vertices lie about `step` apart along the line.

    xy : (k, 2) float, in the unit of the graph.
    density : (k,) float.
    edges : (m, 2) int.
    step : length of an edge.
    low, high, part : (n,): the vertex i of the graph lies between `low[i]` and `high[i]`, `part[i]` of the way.
    """

    xy: Array
    density: Array
    edges: Indices
    step: float
    low: Indices
    high: Indices
    part: Array


def even_steps(graph: LineGraph, step: float) -> Steps:
    """Each branch cut in parts of equal length, as near to `step` as goes; junctions and ends stay."""
    paths = [path for path in graph.branches if len(path) > 1]
    flat = np.concatenate([np.zeros(0, dtype=np.intp), *paths])
    first, last = _bounds([len(path) for path in paths])
    closed = flat[first] == flat[last]
    # of a loop without a junction the first vertex becomes a knot
    loops = flat[first[closed & (graph.degree[flat[first]] == 2)]]
    knots = np.concatenate([np.flatnonzero(graph.degree != 2), loops])
    low = np.full(len(graph), -1, dtype=np.intp)
    low[knots] = np.arange(len(knots))
    run = _run(graph.xy[flat], first)
    length = run[last] - run[first]
    # a branch back to its own beginning needs two vertices on the way, or it would vanish
    parts = np.maximum(np.where(closed, 3, 1), np.rint(length / step).astype(np.intp))
    begin, end = _bounds(parts + 1)
    of = np.repeat(np.arange(len(paths)), parts + 1)  # the branch of every node; a knot is a node of each of its own
    nth = np.arange(len(of)) - begin[of]
    inner = (nth > 0) & (nth < parts[of])
    at = run[first[of]] + nth / parts[of] * length[of]
    nodes = np.empty(len(of), dtype=np.intp)
    nodes[begin], nodes[end] = low[flat[first]], low[flat[last]]
    nodes[inner] = len(knots) + np.arange(np.count_nonzero(inner))
    added = [np.interp(at[inner], run, value[flat]) for value in (*graph.xy.T, graph.density)] if len(of) else [at] * 3
    within = np.ones(len(flat), dtype=bool)
    within[first] = within[last] = False
    of, own = np.repeat(np.arange(len(paths)), last - first + 1)[within], flat[within]
    place = (run[within] - run[first[of]]) / np.maximum(length[of], 1e-12) * parts[of]
    left = np.minimum(place.astype(np.intp), parts[of] - 1)
    high, part = low.copy(), np.zeros(len(graph))
    low[own], high[own], part[own] = nodes[begin[of] + left], nodes[begin[of] + left + 1], place - left
    edges = np.delete(np.column_stack([nodes[:-1], nodes[1:]]), end[:-1], axis=0)
    return Steps(
        np.concatenate([graph.xy[knots], np.column_stack(added[:2])]),
        np.concatenate([graph.density[knots], added[2]]),
        np.unique(np.sort(edges, axis=1), axis=0) if len(edges) else edges,
        step,
        low,
        high,
        part,
    )


def _bounds(sizes: ArrayLike) -> tuple[Indices, Indices]:
    """The first and the last place of each of several rows, one behind the other."""
    end = np.cumsum(np.asarray(sizes, dtype=np.intp))
    return end - np.asarray(sizes, dtype=np.intp), end - 1


def _run(xy: Array, first: Indices) -> Array:
    """(n,) how far it is to every place (n, 2) along all rows; each begins, at `first`, where the last one ended."""
    steps = np.concatenate([[0.0], np.linalg.norm(np.diff(xy, axis=0), axis=1)])[: len(xy)]
    steps[first] = 0.0
    return np.cumsum(steps)
