"""Dots, accents and points: pieces of a letter that are apart from its line."""

from __future__ import annotations

import unicodedata

import numpy as np

from handout.motion.recovery.network import Network
from handout.values import Indices

POINTED = frozenset(".:…")  # marks that are points, and nothing else
DOT = 0.35  # of a small letter: a piece no longer is a dot
_DASH = 0.9  # one no longer is, too, that lies over all the rest
_UNDER = 0.1  # of a small letter that it may begin lower


def dotted(letter: str) -> bool:
    """Whether pieces apart from a letter's line are dots or accents."""
    return letter in ("i", "j") or len(unicodedata.normalize("NFD", letter)) > 1


def points(net: Network) -> tuple[Indices, ...]:
    """The points of a mark that has nothing else, from above or from left to right; none if it has."""
    if any(len(ends) > 1 for ends in net.at.values()):
        return ()
    middle = np.array([net.xy[path].mean(axis=0) for path in net.branches])
    across = np.ptp(middle, axis=0)
    order = np.argsort(-middle[:, 1] if across[1] > across[0] else middle[:, 0])
    paths = (net.branches[b] for b in order.tolist())
    return tuple(path if net.xy[path[0], 0] <= net.xy[path[-1], 0] else path[::-1] for path in paths)


def dots(net: Network, small: float, base: float | None, joints: set[int]) -> dict[int, Indices]:
    """Branch → vertices, from left to right, of pieces that are dots or accents.

    Where there is nothing else, only what is known to be over the height of small letters is one.
    """
    alone = [
        b
        for b, path in enumerate(net.branches)
        if all(len(net.at[int(net.knot[end])]) == 1 for end in (2 * b, 2 * b + 1)) or len(path) == 1
    ]
    free = [b for b in alone if not {*net.branches[b].tolist()} & joints]
    length = net.length * net.half / small
    rest = [net.xy[path, 1].max() for b, path in enumerate(net.branches) if b not in free or length[b] >= _DASH]
    top = max(rest, default=np.inf) - _UNDER * small
    found = [b for b in free if length[b] < DOT or (length[b] < _DASH and net.xy[net.branches[b], 1].min() > top)]
    if len(found) == len(net.branches):
        least = np.inf if base is None else base + small
        found = [b for b in found if net.xy[net.branches[b], 1].min() > least]
    paths = {b: net.branches[b] for b in found}
    return {b: path if net.xy[path[0], 0] <= net.xy[path[-1], 0] else path[::-1] for b, path in paths.items()}
