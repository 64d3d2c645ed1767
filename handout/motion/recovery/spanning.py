"""Bars that run over several letters, found on the line of a whole word before any letter is followed.

Where a letter ends the tagger cuts the bar of a t or f, and what is left of it in each letter looks like much else; on
the word it is what is straight, level and long.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handout.hand.letter_classes import CROSSED
from handout.hand.scanned import NOBODY, ScannedHand
from handout.motion.recovery.network import Network, network
from handout.values import Indices

_TINY = 5.0  # half widths: a branch so short is a crossing drawn out
_LEVEL = 0.85  # least cosine of a bar's slope
_LONG = 0.35  # of a small letter, at least
_LOW = 0.7  # of a small letter: over the baseline, at least
_JOG, _BOW = 1.5, 0.035  # half widths, and of its length, that a bar leaves the straight line at most
_WINDOW, _TURNED = 8.0, 0.8  # half widths over which its direction is seen, and its cosine to the whole, at least
_DRAWN = 4.0  # half widths from where it meets another line
_MOST = 9  # branches
_HIDDEN, _SEEN = 0.4, 2.0  # of its length, at most, and half widths, at least, that other strokes hide of it
_OPEN = 0.4  # of a small letter: worth of a loose end
_STRAIGHT = 10.0  # worth of a length, for one that it leaves the straight line on average


@dataclass(frozen=True, eq=False)
class Bar:
    """A bar on its page.

    vertices : of the page's graph, from left to right.
    before, after : of what it shares at either end with other strokes, from left to right.
    loose : whether its left and its right end are loose.
    letter : the glyph that it belongs to.
    """

    vertices: Indices
    before: Indices
    after: Indices
    loose: tuple[bool, bool]
    letter: int


class Spanning:
    """The bars of the words of a hand, each word's worked out when it is first asked for."""

    def __init__(self, hand: ScannedHand, paths: Mapping[int, Sequence[Indices]]) -> None:
        self._hand, self._paths = hand, paths
        self._first: dict[int, tuple[Indices, Indices]] = {}
        self._known: dict[int, tuple[Bar, ...]] = {}

    def __getitem__(self, number: int) -> tuple[Bar, ...]:
        """The bars of the word that a glyph is in."""
        glyphs = self._hand.glyphs
        first = number
        while glyphs[first].before != NOBODY:
            first = glyphs[first].before
        found = self._known.get(first)
        if found is None:
            word = [first]
            while glyphs[word[-1]].after != NOBODY:
                word.append(glyphs[word[-1]].after)
            found = self._known[first] = self._found(word) if any(glyphs[n].letter in CROSSED for n in word) else ()
        return found

    def _found(self, word: Sequence[int]) -> tuple[Bar, ...]:
        number = self._hand.glyphs[word[0]].page
        page = self._hand.pages[number]
        own = [np.concatenate([self._hand.glyphs[n].vertices, *self._paths.get(n, ())]) for n in word]
        every = np.unique(np.concatenate(own))
        local = np.searchsorted(every, self._between(number, every))
        xy = page.to_line(self._hand.glyphs[word[0]].line, page.graph.uv[every])
        net = network(xy, page.graph.radius[every] / page.pitch, page.graph.density[every], local)
        small = page.x_height / page.pitch
        chains = list(_level(net, small))
        found: list[Bar] = []
        for glyph, vertices in zip(word, own, strict=True):
            if self._hand.glyphs[glyph].letter not in CROSSED:
                continue
            theirs = np.searchsorted(every, vertices)
            following = [self._hand.glyphs[n].vertices for n in word[word.index(glyph) + 1 :]]
            later = set(np.searchsorted(every, np.concatenate([every[:0], *following])).tolist())
            bar = _best(net, chains, set(theirs.tolist()), later)
            if bar:
                way = _places(net, bar)
                loose = (_loose(net, bar[0]), _loose(net, bar[-1] ^ 1))
                if not any(np.isin(every[way], other.vertices).mean() > 0.5 for other in found):
                    before, after = _beyond(net, bar, right=False), _beyond(net, bar, right=True)
                    found.append(Bar(every[way], every[before[::-1]], every[after], loose, glyph))
        return tuple(found)

    def _between(self, page: int, every: Indices) -> Indices:
        """(m, 2): the edges of a page between some of its vertices, which are rising, in the page's order."""
        edges = self._hand.pages[page].graph.edges
        known = self._first.get(page)
        if known is None:
            order = np.argsort(edges[:, 0], kind="stable")
            known = self._first[page] = order, edges[order, 0]
        order, first = known
        start, stop = np.searchsorted(first, every), np.searchsorted(first, every, side="right")
        count = stop - start
        leaving = np.repeat(stop - np.cumsum(count), count) + np.arange(count.sum())
        near = edges[np.sort(order[leaving])]
        at = np.minimum(np.searchsorted(every, near[:, 1]), len(every) - 1)
        return np.asarray(near[every[at] == near[:, 1]])


def _level(net: Network, small: float) -> Iterator[tuple[tuple[int, ...], float]]:
    """Level, straight ways over the branches of a word, as ends from left to right, with their worth."""
    rightwards = [end for end in range(2 * len(net.branches)) if _rightwards(net, end, small)]
    beyond: dict[int, list[int]] = {}
    for end in rightwards:
        beyond.setdefault(int(net.knot[end]), []).append(end)
    ways: list[tuple[int, ...]] = [(end,) for end in rightwards]
    while ways:
        chain = ways.pop()
        worth = _worth(net, chain, small)
        if worth is None:
            continue
        if worth > 0:
            yield chain, worth
        if len(chain) < _MOST:
            passed = {e >> 1 for e in chain}
            ways += [(*chain, e) for e in beyond.get(int(net.knot[chain[-1] ^ 1]), ()) if e >> 1 not in passed]


def _rightwards(net: Network, end: int, small: float) -> bool:
    """Whether a bar may leave a knot by an end: to the right, or over what is no more than a crossing drawn out."""
    xy = net.xy[net.way(end)]
    along = xy[-1] - xy[0]
    if len(xy) < 2 or not (along[0] > 0.6 * np.hypot(*along) or _tiny(net, end)):
        return False
    return bool(xy[:, 1].mean() >= 0.6 * small)


def _worth(net: Network, chain: tuple[int, ...], small: float) -> float | None:
    """How good a bar some ends make, in the network's unit; ≤ 0 for none, None where going on makes none, either."""
    way = net.xy[_places(net, chain)]
    along = way[-1] - way[0]
    size = float(np.hypot(*along))
    if size > _LONG * small and along[0] < _LEVEL * size:
        return None
    if _tiny(net, chain[0]) or _tiny(net, chain[-1]) or size < _LONG * small or way[:, 1].mean() < _LOW * small:
        return 0.0
    loose = (_loose(net, chain[0]), _loose(net, chain[-1] ^ 1))
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))]) / net.half
    # where it meets another line its own is drawn towards that
    clear = (run >= (0 if loose[0] else _DRAWN)) & (run <= run[-1] - (0 if loose[1] else _DRAWN))
    if clear.sum() < 3:
        return 0.0
    kept = way[clear] - way[clear].mean(axis=0)
    normal = np.linalg.svd(kept, full_matrices=False)[2][1]
    off = np.abs(kept @ normal)
    if off.max() > _JOG * net.half + _BOW * size:
        return 0.0
    at = np.arange(run[clear][0], max(run[clear][-1] - _WINDOW, run[clear][0]) + 1e-9, 1.0)
    ends = [np.column_stack([np.interp(at + more, run, axis) for axis in way.T]) for more in (0.0, _WINDOW)]
    local = ends[1] - ends[0]
    if (local @ along < _TURNED * size * np.hypot(*local.T)).any():
        return 0.0
    bent = max(0.0, float(np.sqrt((off**2).mean())) - 0.5 * net.half)
    return size - _STRAIGHT * bent + _OPEN * small * sum(loose)


def _tiny(net: Network, end: int) -> bool:
    """Whether the branch of an end is no more than a crossing drawn out."""
    return bool(net.length[end >> 1] < _TINY) and not _loose(net, end) and not _loose(net, end ^ 1)


def _best(
    net: Network, chains: Sequence[tuple[tuple[int, ...], float]], own: set[int], later: set[int]
) -> tuple[int, ...]:
    """The best bar of a letter, given the vertices of it with its ways, and of those after it."""
    best: tuple[float, tuple[int, ...]] = (0.0, ())
    for chain, worth in chains:
        if worth <= best[0] or own.isdisjoint(_places(net, chain).tolist()):
            continue
        # what leads from the letter before to the stem is a ligature
        if _loose(net, chain[0]) or _loose(net, chain[-1] ^ 1) or int(net.knot[chain[-1] ^ 1]) in later:
            best = worth, chain
    return best[1]


def _beyond(net: Network, chain: Sequence[int], *, right: bool) -> Indices:
    """Vertices that a bar shares with other strokes where it runs on straight over theirs, outwards, knot left out."""
    last = chain[-1] ^ 1 if right else chain[0]
    nothing = np.zeros(0, dtype=np.intp)
    if _loose(net, last):
        return nothing
    way = net.xy[_places(net, chain)]
    middle, size = way.mean(axis=0), float(np.hypot(*(way[-1] - way[0])))
    aim = np.linalg.svd(way - middle, full_matrices=False)[2][0]
    aim = aim if (aim[0] > 0) == right else -aim
    passed = {e >> 1 for e in chain}
    best: tuple[float, Indices] = (_SEEN * net.half, nothing)
    firsts = [(e,) for e in net.at[int(net.knot[last])] if e >> 1 not in passed]
    over = [f[0] for f in firsts if _tiny(net, f[0])]
    ways = firsts + [(f, e) for f in over for e in net.at[int(net.knot[f ^ 1])] if e != f ^ 1]
    for ends in ways:
        vertices = _places(net, ends)[1:]
        away = net.xy[vertices] - net.place(last)
        ahead, aside = away @ aim, np.abs((net.xy[vertices] - middle) @ np.array([-aim[1], aim[0]]))
        fits = (aside <= _JOG * net.half + _BOW * size) & (ahead >= np.maximum.accumulate(ahead) - net.half)
        fits &= ahead <= _HIDDEN * size
        count = len(fits) if fits.all() else int(fits.argmin())
        if count and ahead[count - 1] > best[0]:
            best = float(ahead[count - 1]), vertices[:count]
    return best[1]


def _loose(net: Network, end: int) -> bool:
    """Whether the knot that an end leaves is a loose end."""
    return len(net.at[int(net.knot[end])]) == 1


def _places(net: Network, chain: Sequence[int]) -> Indices:
    ways = [net.way(e) for e in chain]
    return np.concatenate([ways[0], *(way[1:] for way in ways[1:])])
