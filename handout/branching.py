"""A graph cut into its pieces, and into its branches: the vertices in order from junction or end to junction or end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]


def number_pieces(edges: Indices, count: int) -> Indices:
    """(count,) int, from 0: number of the connected piece of every vertex; `edges` : (m, 2) int, each pair once."""
    (a, b), here = edges.T, np.arange(count)
    follows = np.zeros(count, dtype=bool)
    follows[b[b == a + 1]] = True
    label = np.maximum.accumulate(np.where(follows, 0, here))  # lines are numbered along them, most of them
    while True:
        # every piece that meets one of a lower number joins it, and what has joined it comes after
        low, high = np.minimum(label[a], label[b]), np.maximum(label[a], label[b])
        if (low == high).all():
            return np.asarray((np.cumsum(label == here) - 1)[label], dtype=np.intp)
        np.minimum.at(label, high, low)
        while ((then := label[label]) < label).any():
            label = then


def branches(edges: Indices, count: int) -> tuple[Indices, ...]:
    """The paths of a graph between the vertices that do not have two edges.

    edges : (m, 2) int, pairs of vertices, each pair once.
    count : number of vertices.

    Returns arrays of vertices in order along each path, both ends included; a loop without a junction begins and ends
    with the same vertex; a vertex without an edge is a path of its own.
    """
    degree = np.bincount(edges.ravel(), minlength=count)
    through = degree == 2
    touching = edges[~(through[edges[:, 0]] & through[edges[:, 1]])]
    # of a vertex with two edges this is the sum of both neighbours: less the one it is the other
    both = np.bincount(edges.ravel(), edges[:, ::-1].ravel(), minlength=count).astype(np.intp).tolist()
    runs = _follow_runs(touching, through, both)
    if sum(map(len, runs)) - 2 * len(runs) < np.count_nonzero(through):
        runs += _loops(runs, edges, through, both)
    runs.sort(key=lambda run: run[0] if through[run[0]] else min(run[1:-1]))
    chains = [np.array(run, dtype=np.intp) for run in runs]
    chains += [np.asarray(pair, dtype=np.intp) for pair in touching if not through[pair].any()]
    chains += [np.array([lone], dtype=np.intp) for lone in np.flatnonzero(degree == 0)]
    return tuple(chains)


def _follow_runs(touching: Indices, through: NDArray[np.bool_], both: list[int]) -> list[list[int]]:
    """The paths over vertices that have two edges, from the one next to an end that comes first."""
    steps = np.concatenate([touching, touching[:, ::-1]])
    steps = steps[through[steps[:, 0]] & ~through[steps[:, 1]]]
    runs, passed, on = list[list[int]](), set[tuple[int, int]](), through.tolist()
    for start, outside in steps[np.argsort(steps[:, 0], kind="stable")].tolist():
        if (start, outside) in passed:
            continue
        run, here = [outside], start
        while on[here]:
            run.append(here)
            here = both[here] - run[-2]
        run.append(here)
        passed.add((run[-2], here))
        runs.append(run)
    return runs


def _loops(runs: list[list[int]], edges: Indices, through: NDArray[np.bool_], both: list[int]) -> list[list[int]]:
    """The paths that come back to where they began without meeting an end, from their first vertex."""
    left = through.copy()
    left[[vertex for run in runs for vertex in run]] = False
    pairs = edges[left[edges].all(axis=1)].tolist()
    # the first of a vertex's edges closes the loop that is begun there
    closing = {a: b for pair in reversed(pairs) for a, b in (pair, pair[::-1])}
    loops = list[list[int]]()
    for first in np.flatnonzero(left).tolist():
        if not left[first]:
            continue
        run, here = [first], both[first] - closing[first]
        while here != first:
            run.append(here)
            here = both[here] - run[-2]
        left[run] = False
        loops.append([*run, first])
    return loops
