"""A line graph laid out anew in even steps, with the way back to its own vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
    knots = np.flatnonzero(graph.degree != 2)
    number = np.full(len(graph), -1, dtype=np.intp)
    number[knots] = np.arange(len(knots))
    places, inks, pairs = [graph.xy[knots]], [graph.density[knots]], []
    low, high = np.zeros(len(graph), dtype=np.intp), np.zeros(len(graph), dtype=np.intp)
    part = np.zeros(len(graph))
    low[knots] = high[knots] = number[knots]
    count = len(knots)
    for path in graph.branches:
        if len(path) < 2:
            continue
        if number[path[0]] < 0:  # a loop without a junction: its first vertex becomes a knot
            number[path[0]] = low[path[0]] = high[path[0]] = count
            places.append(graph.xy[path[:1]])
            inks.append(graph.density[path[:1]])
            count += 1
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(graph.xy[path], axis=0), axis=1))])
        # a branch back to its own beginning needs two vertices on the way, or it would vanish
        parts = max(3 if path[0] == path[-1] else 1, round(along[-1] / step))
        at = np.linspace(0, along[-1], parts + 1)[1:-1]
        places.append(np.stack([np.interp(at, along, graph.xy[path, k]) for k in (0, 1)], axis=1))
        inks.append(np.interp(at, along, graph.density[path]))
        row = np.concatenate([[number[path[0]]], np.arange(count, count + parts - 1), [number[path[-1]]]])
        count += parts - 1
        pairs.append(np.stack([row[:-1], row[1:]], axis=1))
        place = along[1:-1] / max(along[-1], 1e-12) * parts
        left = np.minimum(place.astype(np.intp), parts - 1)
        low[path[1:-1]], high[path[1:-1]], part[path[1:-1]] = row[left], row[left + 1], place - left
    edges = np.concatenate(pairs) if pairs else np.zeros((0, 2), dtype=np.intp)
    edges = np.unique(np.sort(edges, axis=1), axis=0) if len(edges) else edges
    return Steps(np.concatenate(places), np.concatenate(inks), edges, step, low, high, part)
