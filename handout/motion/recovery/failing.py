"""Ink that failed: gaps in a line over which the pen was down all the same.

A pen that fails leaves a short gap, whose sides are loose ends, thinner than the line is elsewhere, and go on in one
another.  Where the pen was lifted the gap is wider, and the line ends as wide as it was.  Between two letters of a hand
that seldom joins them it takes more to believe that it did.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from handout.values import Array, Indices

# logarithm of the odds, fitted to 2071 gaps of pages whose true strokes are known (three simulated, three recorded);
# how the directions of the two sides agree says nothing more
_ODDS, _FAR, _THIN, _WITHIN, _RATE = 0.2, 4.3, 9.0, 2.5, 0.4
_TORN = 1.0  # so much more a movement torn apart costs than a little way over no ink
_LITTLE = 0.5  # half widths
_THINNEST, _WIDEST = 0.5, 1.1  # of the usual width, between which it counts
_CHAIN = 10  # vertices from a tip that tell its direction
_TAPER = 5  # vertices from a tip that tell its width
_MOST = 10.0  # half widths: no wider gap is looked at
_AHEAD = 0.5  # so much farther is what lies aside of a tip
_BESIDE = 2.5  # half widths from a loose end: a place so near it is that end


@dataclass(frozen=True, eq=False)
class Tip:
    """A loose end of a line.

    vertex : its number; place : (2,); aim : (2,), unit vector outwards.
    width : of the line towards it, over its usual width.
    """

    vertex: int
    place: Array
    aim: Array
    width: float


def tips(xy: Array, radius: Array, edges: Indices, half: float) -> list[Tip]:
    """The loose ends of a line whose usual radius is `half`."""
    degree = np.bincount(edges.ravel(), minlength=len(xy))
    ends = np.flatnonzero(degree == 1).tolist()
    # a vertex with two edges leads from either neighbour to the other: what both add up to, less the one
    both = np.bincount(edges.ravel(), edges[:, ::-1].ravel(), minlength=len(xy)).astype(np.intp)
    through, found = degree == 2, []
    for end in ends:
        chain = [end, int(both[end])]
        while len(chain) <= _CHAIN and through[chain[-1]]:
            chain.append(int(both[chain[-1]]) - chain[-2])
        found.append(tip(xy, radius, chain, half))
    return found


def tip(xy: Array, radius: Array, chain: Indices | list[int], half: float) -> Tip:
    """The end of a line, given its vertices from there on."""
    aim = xy[chain[0]] - xy[chain[min(len(chain) - 1, _CHAIN)]]
    width = float(radius[chain[:_TAPER]].sum()) / min(len(chain), _TAPER) / half
    return Tip(int(chain[0]), xy[chain[0]], aim / max(math.hypot(*aim), 1e-9), width)


def odds(one: Tip, other: Tip | Array, half: float) -> float:
    """The logarithm of the odds that the pen went on from a tip to another, or to a place (2,) on a line; see `prior`.

    half : half the usual width of the line.
    """
    way = (other.place if isinstance(other, Tip) else other) - one.place
    far = math.hypot(*way) / half
    if far > _MOST:
        return -math.inf
    widths = (one.width, other.width) if isinstance(other, Tip) else (one.width,)
    thin = sum(1 - min(max(width, _THINNEST), _WIDEST) for width in widths)
    return _ODDS - _FAR * math.log(far + _LITTLE) + _THIN * thin


def prior(rate: float | None = None) -> float:
    """What to add to `odds` for two places of one letter, or, in a hand that joins such a share of them, of two.

    Where the sum is above 0 the pen is taken to have gone on.
    """
    return _TORN + (_WITHIN if rate is None else _RATE * math.log(rate / (1 - rate)))


def bridges(xy: Array, radius: Array, edges: Indices, half: float, owner: Indices, rate: float = 0.5) -> Indices:
    """(m, 2): edges to add to a line, over gaps where its ink is taken to have failed.

    Parameters
    ----------
    half : half the usual width of the line.
    owner : (n,) int: number of the letter that each vertex belongs to in its word, −1 for what is not looked at.
    rate : share of letters that are joined to the next.
    """
    piece = _pieces(edges, len(xy))
    if not piece.any():
        return np.zeros((0, 2), dtype=np.intp)
    loose = [one for one in tips(xy, radius, edges, half) if owner[one.vertex] >= 0]
    chances = prior(), prior(rate)
    added = set[tuple[int, int]]()
    for one in loose:
        v = one.vertex
        near = np.abs(owner - owner[v]) <= 1
        near &= (owner >= 0) & (piece != piece[v]) & (np.abs(xy - one.place).max(axis=1) < _MOST * half)
        if not near.any():
            continue
        found = [(odds(one, other, half), other.vertex) for other in loose if near[other.vertex]]
        found += [(odds(one, xy[w], half), w) for w in _inner(one, xy, np.flatnonzero(near), loose, half)]
        best, w = max((chance + chances[int(owner[v] != owner[w])], w) for chance, w in found)
        if best > 0:
            added.add((min(v, w), max(v, w)))
    return np.array(sorted(added), dtype=np.intp).reshape(-1, 2)


def _pieces(edges: Indices, count: int) -> Indices:
    """(n,): the first vertex of the piece of a graph that each vertex is in; for graphs so small as a word's."""
    lower = list(range(count))  # a vertex of the same piece, none later
    for one, other in zip(edges[:, 0].tolist(), edges[:, 1].tolist(), strict=True):
        while lower[one] != one:
            lower[one] = one = lower[lower[one]]
        while lower[other] != other:
            lower[other] = other = lower[lower[other]]
        if one < other:
            lower[other] = one
        else:
            lower[one] = other
    for vertex, before in enumerate(lower):
        lower[vertex] = lower[before]
    return np.array(lower, dtype=np.intp)


def _inner(one: Tip, xy: Array, beyond: Indices, loose: list[Tip], half: float) -> list[int]:
    """The place nearest to a tip, best ahead of it, of those beyond the gap, if it is none of the loose ends there."""
    way = xy[beyond] - one.place
    nearest = int(beyond[((1 + _AHEAD) * np.hypot(*way.T) - _AHEAD * (way @ one.aim)).argmin()])
    ends = [other for other in loose if math.hypot(*(other.place - xy[nearest])) <= _BESIDE * half]
    return [] if any(other.vertex in beyond for other in ends) else [nearest]


def mended(xy: Array, radius: Array, edges: Indices, half: float, cut: set[int], least: float = 0.0) -> Indices:
    """(m, 2): the edges of one letter's line, and its `bridges`.

    Parameters
    ----------
    cut : loose ends where it goes on in another letter.
    least : extent under which a piece is a dot.
    """
    owner = np.zeros(len(xy), dtype=np.intp)
    owner[list(cut)] = -1
    if least:
        piece = _pieces(edges, len(xy))
        dots = [k for k in np.unique(piece) if np.ptp(xy[piece == k], axis=0).max() < least]
        owner[np.isin(piece, dots)] = -1
    return np.concatenate([edges, bridges(xy, radius, edges, half, owner)])
