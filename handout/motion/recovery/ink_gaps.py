"""Ink gaps: where the pen was down and its ink failed, told from where it was lifted, and bridged.

A pen that fails leaves a short gap, whose sides are loose ends, thinner than the line is elsewhere, and go on in one
another.  Where the pen was lifted the gap is wider, and the line ends as wide as it was.  Between two letters of a hand
that seldom joins them it takes more to believe that the ink failed.  Where a neighbour's line lies across a letter's,
its ink is the neighbour's, and the letter's own line goes on beyond it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from handout.values import Array, Indices, LineGraph


@dataclass(frozen=True)
class GapWeights:
    """Logarithm of the odds that the pen went on over a gap, fitted to 2071 gaps of pages whose true strokes are known.

    Three of the pages were simulated, three recorded.  Whether the directions of the two sides agree adds nothing.
    """

    base: float = 0.2
    far: float = 4.3  # less, for the logarithm of the width in half widths
    near: float = 0.5  # half widths, added to that
    thin: float = 9.0  # for an end that is thinner by the usual width
    within: float = 2.5  # for a gap within a letter
    joined: float = 0.4  # between letters, for the log odds that the hand joins two
    torn: float = 1.0  # a stroke that is torn apart is worse than one that crosses a little way without ink


_WEIGHTS = GapWeights()
_THINNEST, _WIDEST = 0.5, 1.1  # of the usual width, between which it counts
_CHAIN = 10  # vertices from an endpoint that tell its direction
_TAPER = 5  # vertices from an endpoint that tell its width
_MOST = 10.0  # half widths: no wider gap is looked at
_AHEAD = 0.5  # by this share what lies aside of an endpoint counts as farther away
_ACROSS = 5.0  # half widths: so far a line runs on over another that it crosses or touches, as `network.SHORT`
_BESIDE = 2.5  # half widths: a place this near to a loose end is that end


@dataclass(frozen=True, eq=False)
class Endpoint:
    """A loose end of a line.

    vertex : its number; place : (2,); aim : (2,), unit vector outwards.
    width : of the line towards it, over its usual width.
    """

    vertex: int
    place: Array
    aim: Array
    width: float


def endpoints(xy: Array, radius: Array, edges: Indices, half_width: float) -> list[Endpoint]:
    """The loose ends of a line whose usual radius is `half_width`."""
    degree = np.bincount(edges.ravel(), minlength=len(xy))
    ends = np.flatnonzero(degree == 1).tolist()
    # a vertex with two edges leads from either neighbour to the other: what both add up to, less the one
    both = np.bincount(edges.ravel(), edges[:, ::-1].ravel(), minlength=len(xy)).astype(np.intp)
    through, ends_found = degree == 2, []
    for end in ends:
        chain = [end, int(both[end])]
        while len(chain) <= _CHAIN and through[chain[-1]]:
            chain.append(int(both[chain[-1]]) - chain[-2])
        ends_found.append(endpoint_of(xy, radius, chain, half_width))
    return ends_found


def endpoint_of(xy: Array, radius: Array, chain: Indices | list[int], half_width: float) -> Endpoint:
    """The end of a line, given its vertices from there on."""
    aim = xy[chain[0]] - xy[chain[min(len(chain) - 1, _CHAIN)]]
    width = float(radius[chain[:_TAPER]].sum()) / min(len(chain), _TAPER) / half_width
    return Endpoint(int(chain[0]), xy[chain[0]], aim / max(math.hypot(*aim), 1e-9), width)


def log_odds(end: Endpoint, other: Endpoint | Array, half_width: float) -> float:
    """The log odds that the pen went on from an endpoint to another, or to a place (2,) on a line.

    half_width : half the usual width of the line.  `prior_log_odds` is to be added.
    """
    way = (other.place if isinstance(other, Endpoint) else other) - end.place
    far = math.hypot(*way) / half_width
    if far > _MOST:
        return -math.inf
    widths = (end.width, other.width) if isinstance(other, Endpoint) else (end.width,)
    thin = sum(1 - min(max(width, _THINNEST), _WIDEST) for width in widths)
    return _WEIGHTS.base - _WEIGHTS.far * math.log(far + _WEIGHTS.near) + _WEIGHTS.thin * thin


def prior_log_odds(joined_share: float | None = None) -> float:
    """What to add to `log_odds` for two places of one letter, or, in a hand that joins such a share of them, of two.

    Where the sum is above 0 the pen is taken to have gone on.
    """
    if joined_share is None:
        return _WEIGHTS.torn + _WEIGHTS.within
    return _WEIGHTS.torn + _WEIGHTS.joined * math.log(joined_share / (1 - joined_share))


def gap_bridges(
    xy: Array, radius: Array, edges: Indices, half_width: float, owner: Indices, joined_share: float = 0.5
) -> Indices:
    """(m, 2): edges to add to a line, over gaps where its ink is taken to have failed.

    half_width : half the usual width of the line.
    owner : (n,) int: number of the letter that each vertex belongs to in its word, −1 for what is not looked at.
    joined_share : share of letters that are joined to the next.
    """
    piece = _pieces(edges, len(xy))
    if not piece.any():
        return np.zeros((0, 2), dtype=np.intp)
    loose = [end for end in endpoints(xy, radius, edges, half_width) if owner[end.vertex] >= 0]
    priors = prior_log_odds(), prior_log_odds(joined_share)
    added = set[tuple[int, int]]()
    for end in loose:
        v = end.vertex
        near = np.abs(owner - owner[v]) <= 1
        near &= (owner >= 0) & (piece != piece[v]) & (np.abs(xy - end.place).max(axis=1) < _MOST * half_width)
        if not near.any():
            continue
        chances = [(log_odds(end, other, half_width), other.vertex) for other in loose if near[other.vertex]]
        # of the vertices beyond the gap that nearest to the endpoint, best ahead of it; none if a loose end is there
        beyond = np.flatnonzero(near)
        way = xy[beyond] - end.place
        w = int(beyond[((1 + _AHEAD) * np.hypot(*way.T) - _AHEAD * (way @ end.aim)).argmin()])
        beside = (other for other in loose if math.hypot(*(other.place - xy[w])) <= _BESIDE * half_width)
        if not any(other.vertex in beyond for other in beside):
            chances.append((log_odds(end, xy[w], half_width), w))
        best, w = max((chance + priors[int(owner[v] != owner[w])], w) for chance, w in chances)
        if best > 0:
            added.add((min(v, w), max(v, w)))
    return np.array(sorted(added), dtype=np.intp).reshape(-1, 2)


def _pieces(edges: Indices, count: int) -> Indices:
    """(n,): the first vertex of the piece of a graph that each vertex is in; for graphs so small as a word's."""
    lower = list(range(count))  # a vertex of the same piece, none later
    for a, b in zip(edges[:, 0].tolist(), edges[:, 1].tolist(), strict=True):
        while lower[a] != a:
            lower[a] = a = lower[lower[a]]
        while lower[b] != b:
            lower[b] = b = lower[lower[b]]
        if a < b:
            lower[b] = a
        else:
            lower[a] = b
    for vertex, before in enumerate(lower):
        lower[vertex] = lower[before]
    return np.array(lower, dtype=np.intp)


def bridge_gaps(
    xy: Array, radius: Array, edges: Indices, half_width: float, cut: set[int], least: float = 0.0
) -> Indices:
    """(m, 2): the edges of one letter's line, and its `gap_bridges`.

    cut : loose ends where it goes on in another letter.
    least : extent under which a piece is a dot.
    """
    owner = np.zeros(len(xy), dtype=np.intp)
    owner[list(cut)] = -1
    if least:
        piece = _pieces(edges, len(xy))
        dots = [k for k in np.unique(piece) if np.ptp(xy[piece == k], axis=0).max() < least]
        owner[np.isin(piece, dots)] = -1
    return np.concatenate([edges, gap_bridges(xy, radius, edges, half_width, owner)])


def severed_pairs(graph: LineGraph, own: Indices) -> list[tuple[int, int]]:
    """Pairs of a letter's vertices between which its line goes on over a neighbour's that it crosses or touches.

    own : (n,) int, rising: its vertices.  The pairs are as few as join its pieces, the nearest first.
    """
    piece = _pieces(graph.edges_between(own), len(own))
    if not piece.any():
        return []
    ours = np.isin(graph.edges, own)
    met = np.unique(graph.edges[ours & ~ours[:, ::-1]])
    of = piece[np.searchsorted(own, met)]
    far = np.hypot(*(graph.xy[met, None] - graph.xy[met]).transpose(2, 0, 1)) / float(np.median(graph.radius))
    far[of[:, None] == of] = np.inf
    order = np.argsort(far, axis=None, kind="stable")[: int((far <= _ACROSS).sum())]
    pairs = list[tuple[int, int]]()
    for i, j in zip(*(at.tolist() for at in np.unravel_index(order, far.shape)), strict=True):
        if of[i] != of[j]:
            pairs.append((int(met[i]), int(met[j])))
            of = np.where(of == of[j], of[i], of)
    return pairs
