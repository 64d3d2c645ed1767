"""Bars: strokes that run straight across others, as that of a t does, found before the rest of a letter is followed.

People write them last, whatever else they cross or touch on their way, and often over more than one letter.
"""

from __future__ import annotations

from collections.abc import Container, Sequence

import numpy as np

from handout.motion.recovery.network import Network
from handout.values import Array, Indices

WAITING = frozenset("t")  # letters whose bar waits in a hand that joins letters; that of an f often joins it
SHARED = 0.8  # of a branch that lies in a bar, at least
_TINY = 5.0  # half widths: a branch so short is a crossing drawn out
_AHEAD = 0.75  # cosine between a bar so far and how it goes on
_LEVEL = 0.75  # least cosine of its slope
_ASLANT = 0.25  # sine and cosine, at least, of a stroke aslant
_LONG = 0.35  # of a small letter, at least
_LOW = 0.4  # of a letter's height, under which no bar of its own is
_BOW = 0.14  # of its length that a bar leaves the straight line


def onward(net: Network, end: int) -> list[int]:
    """The ends by which a pen leaves that goes straight on from an end, up to where nothing lies ahead."""
    chain, passed = [end], {end >> 1}
    while True:
        way = _places(net, chain)
        # where it has come from, a little longer than a letter is thick, tells where it goes
        back = np.hypot(*(way - way[-1]).T) > 2 * _TINY * net.half
        start = way[int(np.flatnonzero(back)[-1])] if back.any() else way[0]
        aim = way[-1] - start
        size = float(np.hypot(*aim))
        if size < 1e-9:
            return chain
        found = [(float(net.leaving[e] @ aim) / size, via, e) for via, e in _ahead(net, chain[-1] ^ 1, passed)]
        best = max(found, default=(0.0, (), -1))
        if best[0] < _AHEAD:
            return chain
        chain += [*best[1], best[2]]
        passed |= {e >> 1 for e in (*best[1], best[2])}


def _ahead(net: Network, arrived: int, passed: set[int]) -> list[tuple[tuple[int, ...], int]]:
    """Ends by which the pen may go on, at the knot or over a tiny branch, which comes first."""
    here = [e for e in net.at[int(net.knot[arrived])] if e != arrived and e >> 1 not in passed]
    found: list[tuple[tuple[int, ...], int]] = [((), e) for e in here if net.length[e >> 1] >= _TINY or _loose(net, e)]
    for tiny in here:
        if net.length[tiny >> 1] < _TINY:
            beyond = (e for e in net.at[int(net.knot[tiny ^ 1])] if e >> 1 != tiny >> 1 and e >> 1 not in passed)
            found += [((tiny,), e) for e in beyond]
    return found


def _loose(net: Network, end: int) -> bool:
    """Whether the branch that is left for by an end leads to a loose end."""
    return len(net.at[int(net.knot[end ^ 1])]) == 1


def _places(net: Network, chain: Sequence[int]) -> Array:
    return np.concatenate([net.xy[net.way(e)] for e in chain])


def own_bar(net: Network, tips: Sequence[int], small: float, *, aslant: bool = False) -> tuple[int, ...]:
    """The ends along a letter's own bar, from left to right, or from above; () if there is none.

    Parameters
    ----------
    tips : ends at loose knots where a bar may begin.
    small : height of a small letter, in the unit of the network.
    aslant : whether it is the stroke that falls to the left in an x.
    """
    heights = np.concatenate([net.xy[path, 1] for path in net.branches])
    low, high = float(heights.min()), float(heights.max())
    best: tuple[float, tuple[int, ...]] = (_LONG * small, ())
    for tip in tips:
        chain = onward(net, tip)
        way = _places(net, chain)
        along = way[-1] - way[0]
        size = float(np.hypot(*along))
        forth = along if (along[1] < 0 if aslant else along[0] > 0) else -along
        if size <= best[0]:
            continue
        if aslant:
            fits = forth[0] < -_ASLANT * size and forth[1] < -_ASLANT * size
        else:
            fits = forth[0] >= _LEVEL * size and float(way[:, 1].mean()) >= low + _LOW * (high - low)
        bow = np.abs((way - way[0]) @ np.array([-along[1], along[0]])).max() / size
        crossed = len(chain) > 1 or len(net.at[int(net.knot[chain[-1] ^ 1])]) > 1
        if fits and crossed and bow <= _BOW * size + net.half:
            best = (size, tuple(chain) if forth is along else tuple(e ^ 1 for e in chain[::-1]))
    return best[1]


def beside(net: Network, chain: Sequence[int]) -> list[int]:
    """The branches that are left without a bar; those that are no more than a crossing stay."""
    gone = {e >> 1 for e in chain if net.length[e >> 1] >= _TINY or _loose(net, e) or _loose(net, e ^ 1)}
    return [b for b in range(len(net.branches)) if b not in gone]


def within(path: Indices, vertices: Container[int]) -> bool:
    """Whether a branch lies in a line, its ends, where others meet it, left out."""
    inner = path[1:-1] if len(path) > 2 else path
    return sum(v in vertices for v in inner.tolist()) >= SHARED * len(inner)


def spans(net: Network, bar: Indices, begin: Sequence[int]) -> list[tuple[int, ...]]:
    """The ends along a known bar, from left to right; what the pen comes in by is no part of it."""
    place = {int(v): i for i, v in enumerate(bar)}
    along: list[tuple[float, int]] = []
    for b, path in enumerate(net.branches):
        if not within(path, place) or {int(path[0]), int(path[-1])} & {*begin}:
            continue
        at = [place[v] for v in path.tolist() if v in place]
        along.append((sum(at) / len(at), 2 * b if at[0] <= at[-1] else 2 * b + 1))
    found: list[tuple[int, ...]] = []
    for _, end in sorted(along):
        if found and int(net.knot[found[-1][-1] ^ 1]) == int(net.knot[end]):
            found[-1] = (*found[-1], end)
        else:
            found.append((end,))
    return found
