"""The cheapest way to part pixels into ink and paper: minimum cut on the grid of four neighbours.

Pixels that cannot be ink are no part of the graph, and pieces that do not touch are cut apart from each other, several
to a call.

Source: seed 000, Appendix A; capacities are whole numbers of 1/256.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.libraries import csgraph, ndimage, sparse
from handout.values import Array, Indices

_FINE = 256  # capacities are whole numbers of 1/256: of 1/16 they mislabel
_TOGETHER = 150_000  # pixels a call
_LARGEST = 2**31 - 1
_APART = 512  # nodes that are cut at once, unless more are tied together


@dataclass(frozen=True)
class Weights:
    """Costs of the random field.

    paper : cost of ink where there is no density.
    ink : gain of ink a unit of density (at most 1 counts).
    edge : cost of an edge between ink and paper of the same colour.
    half : square of the difference in colour (0–255) at which an edge costs half.
    """

    paper: float
    ink: float
    edge: float
    half: float


def unary(density: NDArray[np.float32], weights: Weights) -> NDArray[np.float32]:
    """Cost of calling a pixel ink rather than paper."""
    return np.where(density > 0, -weights.ink * np.minimum(density, 1), np.float32(weights.paper))


def pairwise(first: NDArray[np.uint8], second: NDArray[np.uint8], weights: Weights) -> Array:
    """Cost (n,) of parting neighbours of the colours (n, 3): γλ / (λ + ‖Δc‖²), Δc in 0–255.

    As printed in the paper (the distance itself, of colours in 0–1) the term is so dear that no thin line survives.
    """
    square = ((first.astype(np.float32) - second.astype(np.float32)) ** 2).sum(axis=1)
    return np.asarray(weights.edge * weights.half / (weights.half + square), dtype=np.float64)


def least_cut(
    rgb: NDArray[np.uint8], density: NDArray[np.float32], domain: NDArray[np.bool_], weights: Weights
) -> NDArray[np.bool_]:
    """Ink mask (h, w) of least cost; outside `domain` all is paper.

    rgb : (h, w, 3) uint8
    density : (h, w) float32
    domain : (h, w) bool: where ink is looked for.
    """
    return _cut_graph(rgb, lambda pixels: unary(density.ravel()[pixels], weights), domain, weights, None)


def field_cut(
    rgb: NDArray[np.uint8],
    cost: NDArray[np.float32],
    domain: NDArray[np.bool_],
    weights: Weights,
    paint: NDArray[np.int8],
) -> NDArray[np.bool_]:
    """The same where each pixel has a cost (h, w) of its own of being ink rather than paper, at most `weights.ink`.

    paint : (h, w) int8: 1 where the user says ink (only within the domain), −1 paper, 0 nothing.
    """
    return _cut_graph(rgb, lambda pixels: cost.ravel()[pixels], domain, weights, paint)


def _cut_graph(
    rgb: NDArray[np.uint8],
    cost: Callable[[Indices], NDArray[np.float32]],
    domain: NDArray[np.bool_],
    weights: Weights,
    paint: NDArray[np.int8] | None,
) -> NDArray[np.bool_]:
    height, width = domain.shape
    pieces, count = ndimage.label(domain)
    inside = np.flatnonzero(domain)
    piece = pieces.ravel()[inside]
    inside = inside[np.argsort(piece, kind="stable")]
    ends = np.cumsum(np.bincount(piece, minlength=count + 1)[1:])
    del pieces, piece
    number = np.full(height * width, -1, dtype=np.int32)
    mask = np.zeros(height * width, dtype=bool)
    start = 0
    while start < len(inside):
        stop = max(int(ends[np.searchsorted(ends, start, side="right")]), start)
        more = int(np.searchsorted(ends, start + _TOGETHER, side="right"))
        stop = max(stop, int(ends[more - 1]) if more else 0)
        pixels = np.sort(inside[start:stop])
        mask[pixels] = _cut_pieces(rgb, cost(pixels), pixels, number, weights, paint)
        start = stop
    return mask.reshape(height, width)


def _cut_pieces(
    rgb: NDArray[np.uint8],
    costs: NDArray[np.float32],
    pixels: Indices,
    number: NDArray[np.int32],
    weights: Weights,
    paint: NDArray[np.int8] | None,
) -> NDArray[np.bool_]:
    """Ink (n,) among the pixels `pixels`, of costs (n,), which no other pixel of the domain touches."""
    width = rgb.shape[1]
    cost = costs.astype(np.float64)
    number[pixels] = np.arange(len(pixels))
    flat = rgb.reshape(-1, rgb.shape[2])
    ends: list[tuple[Indices, Indices, Array]] = []
    for step, last in ((1, pixels % width == width - 1), (width, pixels >= rgb.shape[0] * width - width)):
        for sign, edge in ((1, last), (-1, pixels % width == 0 if step == 1 else pixels < width)):
            has = ~edge
            other = pixels[has] + sign * step
            price = pairwise(flat[pixels[has]], flat[other], weights)
            to = number[other]
            out = to < 0
            cost[np.flatnonzero(has)[out]] += price[out]  # its neighbour is paper for certain
            if sign == 1:
                ends.append((np.flatnonzero(has)[~out], to[~out].astype(np.intp), price[~out]))
    number[pixels] = -1
    if paint is not None:
        sure = 4 * weights.edge + weights.paper + weights.ink + 1
        cost = np.where(paint.ravel()[pixels] > 0, -sure, np.where(paint.ravel()[pixels] < 0, sure, cost))
    a, b, price = (np.concatenate(part) for part in zip(*ends, strict=True))
    return minimum_cut(cost, a, b, price)


def minimum_cut(cost: Array, a: Indices, b: Indices, price: Array) -> NDArray[np.bool_]:
    """The labels (n,) bool that minimise Σ cost[i]·label[i] + Σ price[e]·(label[a] ≠ label[b]), exactly.

    cost : (n,) float: what True costs more than False.
    a, b : (m,) int: pairs of nodes, each once.
    price : (m,) float, not negative.
    """
    fine = min(float(_FINE), _LARGEST / 2 / max(float(np.abs(cost).sum()), 1.0))
    whole, walls = np.rint(cost * fine).astype(np.int64), np.rint(price * fine).astype(np.int64)
    labels = whole < 0  # of nodes that cost more than all their walls, and of those that nothing ties to others
    free = np.abs(whole) <= np.bincount(a, walls, len(cost)) + np.bincount(b, walls, len(cost))
    for settled, other in ((a, b), (b, a)):  # a wall to a settled node is a cost of the other
        edge = ~free[settled]
        pull = np.where(labels[settled[edge]], -walls[edge], walls[edge])
        whole += np.bincount(other[edge], pull, len(cost)).astype(np.int64)
    wall = free[a] & free[b] & (walls > 0)
    a, b, walls = a[wall], b[wall], walls[wall]
    labels[free] = whole[free] < 0
    tied = np.zeros(len(cost), dtype=bool)
    tied[a] = tied[b] = True
    number = np.cumsum(tied) - 1
    labels[tied] = _cut_tied(whole[tied].astype(np.int32), number[a], number[b], walls.astype(np.int32))
    return labels


def _cut_tied(whole: NDArray[np.int32], a: Indices, b: Indices, walls: NDArray[np.int32]) -> NDArray[np.bool_]:
    """`minimum_cut` in whole numbers, what nothing ties together apart: flows take longer than their sum where several
    are sought at once."""
    shape = len(whole), len(whole)
    piece = csgraph.connected_components(sparse.csr_matrix((walls, (a, b)), shape=shape), directed=False)[1]
    size = np.bincount(piece)
    part = np.unique(((np.cumsum(size) - size) // _APART)[piece], return_inverse=True)[1]
    # the nodes of a part are followed by its source and its sink; the last leads to all sources
    count, gain, loss = np.bincount(part), np.flatnonzero(whole < 0), np.flatnonzero(whole > 0)
    sources, order = np.cumsum(count) + 2 * np.arange(len(count)), np.argsort(part, kind="stable")
    place, last = np.empty(len(whole), dtype=np.intp), len(whole) + 2 * len(count)
    place[order] = np.arange(len(whole)) + 2 * part[order]
    # every edge with one that leads back, so that what flows has the edges of the graph in its order
    first = np.concatenate([place[a], sources[part[gain]], place[loss]])
    second = np.concatenate([place[b], place[gain], sources[part[loss]] + 1])
    back = np.concatenate([walls, np.zeros(len(gain) + len(loss), np.int32), np.ones(len(count), np.int32)])
    capacity = np.concatenate([walls, -whole[gain], whole[loss], back])
    ends = np.concatenate([first, second, np.full(len(count), last)]), np.concatenate([second, first, sources])
    left = sparse.csr_matrix((capacity, ends), shape=(last + 1, last + 1))
    for start, source in zip((sources - count).tolist(), sources.tolist(), strict=True):
        at, edges = left.indptr[start : source + 3], slice(left.indptr[start], left.indptr[source + 2])
        nodes = source + 2 - start
        one = sparse.csr_matrix((left.data[edges], left.indices[edges] - start, at - at[0]), shape=(nodes, nodes))
        left.data[edges] -= csgraph.maximum_flow(one, nodes - 2, nodes - 1).flow.data
    left.eliminate_zeros()
    reached = np.zeros(last + 1, dtype=bool)
    reached[csgraph.breadth_first_order(left, last, return_predecessors=False)] = True
    return reached[place]
