"""Crossbars: strokes that run straight across others, as that of a t does, found before the rest of a letter is traced.

People write them last, whatever else they cross or touch on their way, and often over more than one letter.  Where a
letter ends the tagger cuts them, and what is left in each letter looks like much else; on the line of the whole word a
crossbar is what is straight, level and long.  So `WordCrossbars` finds those of words, and `find_crossbar` that of a
letter alone.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handout.hand.letter_classes import CROSSED
from handout.hand.scanned import NOBODY, ScannedHand
from handout.motion.recovery.ink_gaps import gap_bridges
from handout.motion.recovery.letter_line import has_dots
from handout.motion.recovery.network import SHORT, BranchNetwork, build_network, chain_vertices
from handout.values import Array, Indices

DELAYED = frozenset("t")  # letters whose bar waits in a hand that joins letters; that of an f often joins it
SHARED = 0.8  # of a branch that lies in a bar, at least


@dataclass(frozen=True)
class CrossbarSettings:
    """What a crossbar looks like, in a letter alone and in a word; set by hand, see `benchmarks.order_recovery`."""

    long: float = 0.35  # x-heights, at least
    # of a letter alone
    ahead: float = 0.75  # cosine between a bar so far and how it goes on
    level: float = 0.75  # least cosine of its slope
    aslant: float = 0.25  # sine and cosine, at least, of a stroke aslant
    low: float = 0.4  # of a letter's height, under which no bar of its own is
    bow: float = 0.14  # of its length that a bar leaves the straight line
    # of a word
    word_level: float = 0.85  # least cosine of its slope
    word_low: float = 0.7  # x-heights over the baseline, at least
    jog: float = 1.5  # half widths that it leaves the straight line, at most
    word_bow: float = 0.035  # and of its length
    free_bow: float = 0.06  # the same, if both its ends are loose
    window: float = 8.0  # half widths over which its direction is seen
    turned: float = 0.8  # cosine of that to the whole, at least
    drawn: float = 4.0  # half widths from where it meets another line and is drawn towards it
    most: int = 9  # branches
    hidden: float = 0.4  # of its length that other strokes hide, at most
    least_hidden: float = 2.0  # half widths that they hide, at least
    open: float = 0.4  # x-heights: worth of a loose end
    straight: float = 10.0  # worth of a length, for one that it leaves the straight line on average


_SETTINGS = CrossbarSettings()


def straight_continuation(net: BranchNetwork, end: int) -> list[int]:
    """The ends by which a pen leaves that goes straight on from an end, up to where nothing lies ahead."""
    chain, passed = [end], {end >> 1}
    while True:
        way = _positions(net, chain)
        # where it has come from, a little longer than a letter is thick, tells where it goes
        back = np.hypot(*(way - way[-1]).T) > 2 * SHORT * net.half_width
        start = way[int(np.flatnonzero(back)[-1])] if back.any() else way[0]
        aim = way[-1] - start
        size = float(np.hypot(*aim))
        if size < 1e-9:
            return chain
        onward = _ends_ahead(net, chain[-1] ^ 1, passed)
        best = max(((float(net.leaving[e] @ aim) / size, via, e) for via, e in onward), default=(0.0, (), -1))
        if best[0] < _SETTINGS.ahead:
            return chain
        chain += [*best[1], best[2]]
        passed |= {e >> 1 for e in (*best[1], best[2])}


def _ends_ahead(net: BranchNetwork, arrived: int, passed: set[int]) -> list[tuple[tuple[int, ...], int]]:
    """Ends by which the pen may go on, at the node or over a short branch, which comes first."""
    here = [e for e in net.ends_at[int(net.node[arrived])] if e != arrived and e >> 1 not in passed]
    ends: list[tuple[tuple[int, ...], int]] = []
    ends += [((), e) for e in here if net.length[e >> 1] >= SHORT or net.is_loose(e ^ 1)]
    for short in here:
        if net.length[short >> 1] < SHORT:
            beyond = (e for e in net.ends_at[int(net.node[short ^ 1])] if e >> 1 != short >> 1 and e >> 1 not in passed)
            ends += [((short,), e) for e in beyond]
    return ends


def _positions(net: BranchNetwork, chain: Sequence[int]) -> Array:
    """Places along a chain of ends, each node between two of its branches twice."""
    return np.concatenate([net.xy[net.vertices_from(e)] for e in chain])


def find_crossbar(
    net: BranchNetwork, loose: Sequence[int], x_height: float, *, aslant: bool = False
) -> tuple[int, ...]:
    """The ends along a letter's own crossbar, from left to right, or from above; () if there is none.

    loose : ends at loose nodes where a bar may begin.
    x_height : in the unit of the network.
    aslant : whether it is the stroke that falls to the left in an x.
    """
    heights = np.concatenate([net.xy[path, 1] for path in net.branches])
    low, high = float(heights.min()), float(heights.max())
    longest, best = _SETTINGS.long * x_height, tuple[int, ...]()
    for end in loose:
        chain = straight_continuation(net, end)
        way = _positions(net, chain)
        along = way[-1] - way[0]
        size = float(np.hypot(*along))
        if size <= longest:
            continue
        forth = along if (along[1] < 0 if aslant else along[0] > 0) else -along
        if aslant:
            fits = forth[0] < -_SETTINGS.aslant * size and forth[1] < -_SETTINGS.aslant * size
        else:
            above = low + _SETTINGS.low * (high - low)
            fits = forth[0] >= _SETTINGS.level * size and float(way[:, 1].mean()) >= above
        bow = np.abs((way - way[0]) @ np.array([-along[1], along[0]])).max() / size
        crossed = len(chain) > 1 or not net.is_loose(chain[-1] ^ 1)
        if fits and crossed and bow <= _SETTINGS.bow * size + net.half_width:
            longest, best = size, tuple(chain) if forth is along else tuple(e ^ 1 for e in chain[::-1])
    return best


def branches_beside(net: BranchNetwork, chain: Sequence[int]) -> list[int]:
    """The branches that are left without a crossbar; those that are no more than a crossing stay."""
    gone = {e >> 1 for e in chain if net.length[e >> 1] >= SHORT or net.is_loose(e ^ 1) or net.is_loose(e)}
    return [b for b in range(len(net.branches)) if b not in gone]


def lies_on(path: Indices, vertices: Container[int]) -> bool:
    """Whether most inner vertices of a branch are among some vertices; at its two ends other branches meet it."""
    inner = path[1:-1] if len(path) > 2 else path
    return sum(v in vertices for v in inner.tolist()) >= SHARED * len(inner)


def crossbar_chains(net: BranchNetwork, bar: Indices, entries: Sequence[int]) -> list[tuple[int, ...]]:
    """The ends along a known crossbar, from left to right; a branch by which the pen comes in is no part of it."""
    place = {int(v): i for i, v in enumerate(bar)}
    along: list[tuple[float, int]] = []
    for b, path in enumerate(net.branches):
        if not lies_on(path, place) or {int(path[0]), int(path[-1])} & {*entries}:
            continue
        at = [place[v] for v in path.tolist() if v in place]
        along.append((sum(at) / len(at), 2 * b if at[0] <= at[-1] else 2 * b + 1))
    chains: list[tuple[int, ...]] = []
    for _, end in sorted(along):
        if chains and int(net.node[chains[-1][-1] ^ 1]) == int(net.node[end]):
            chains[-1] = (*chains[-1], end)
        else:
            chains.append((end,))
    return chains


@dataclass(frozen=True, eq=False)
class Crossbar:
    """A crossbar on its page.

    vertices : of the page's graph, from left to right.
    before, after : of what it shares at either end with other strokes, from left to right.
    loose : whether its left and its right end are loose.
    glyph : the one that it belongs to.
    """

    vertices: Indices
    before: Indices
    after: Indices
    loose: tuple[bool, bool]
    glyph: int


class WordCrossbars:
    """The crossbars of the words of a hand, each word's worked out when it is first asked for.

    ligatures : glyph → its ways to the glyph after, as vertices of the graph of its page.
    """

    def __init__(self, hand: ScannedHand, ligatures: Mapping[int, Sequence[Indices]]) -> None:
        self._hand, self._ligatures = hand, ligatures
        self._of_word: dict[int, tuple[Crossbar, ...]] = {}

    def __getitem__(self, number: int) -> tuple[Crossbar, ...]:
        """The crossbars of the word that a glyph is in."""
        glyphs = self._hand.glyphs
        first = number
        while glyphs[first].before != NOBODY:
            first = glyphs[first].before
        bars = self._of_word.get(first)
        if bars is None:
            word = [first]
            while glyphs[word[-1]].after != NOBODY:
                word.append(glyphs[word[-1]].after)
            bars = self._find(word) if any(glyphs[n].letter in CROSSED for n in word) else ()
            self._of_word[first] = bars
        return bars

    def _find(self, word: Sequence[int]) -> tuple[Crossbar, ...]:
        number = self._hand.glyphs[word[0]].page
        page = self._hand.pages[number]
        letter_vertices = [np.concatenate([self._hand.glyphs[n].vertices, *self._ligatures.get(n, ())]) for n in word]
        every = np.unique(np.concatenate(letter_vertices))
        local = page.graph.edges_between(every)
        xy = page.to_line(self._hand.glyphs[word[0]].line, page.graph.uv[every])
        radius, owner = page.graph.radius[every] / page.pitch, np.full(len(every), NOBODY)
        for at, letter in enumerate(self._hand.glyphs[n] for n in word):
            owner[np.searchsorted(every, letter.vertices)] = NOBODY if has_dots(letter.letter) else at
        local = np.concatenate([local, gap_bridges(xy, radius, local, float(np.median(radius)), owner)])
        net = build_network(xy, radius, page.graph.density[every], local)
        chains = list(_level_chains(net, page.x_height / page.pitch))
        bars: list[Crossbar] = []
        for at, (glyph, vertices) in enumerate(zip(word, letter_vertices, strict=True)):
            if self._hand.glyphs[glyph].letter not in CROSSED:
                continue
            theirs = np.searchsorted(every, vertices)
            following = [self._hand.glyphs[n].vertices for n in word[at + 1 :]]
            later = set(np.searchsorted(every, np.concatenate([every[:0], *following])).tolist())
            chain = _best_chain(net, chains, set(theirs.tolist()), later)
            way = every[chain_vertices(net, chain)] if chain else every[:0]
            if chain and not any(np.isin(way, other.vertices).mean() > 0.5 for other in bars):
                loose = (net.is_loose(chain[0]), net.is_loose(chain[-1] ^ 1))
                before, after = _hidden_part(net, chain, right=False), _hidden_part(net, chain, right=True)
                bars.append(Crossbar(way, every[before[::-1]], every[after], loose, glyph))
        return tuple(bars)


def _level_chains(net: BranchNetwork, x_height: float) -> Iterator[tuple[tuple[int, ...], float]]:
    """Level, straight ways over the branches of a word, as ends from left to right, with their worth."""
    rightwards = [end for end in range(2 * len(net.branches)) if _goes_right(net, end, x_height)]
    beyond: dict[int, list[int]] = {}
    for end in rightwards:
        beyond.setdefault(int(net.node[end]), []).append(end)
    chains: list[tuple[int, ...]] = [(end,) for end in rightwards]
    while chains:
        chain = chains.pop()
        worth = _worth(net, chain, x_height)
        if worth is None:
            continue
        if worth > 0:
            yield chain, worth
        if len(chain) < _SETTINGS.most:
            passed = {e >> 1 for e in chain}
            chains += [(*chain, e) for e in beyond.get(int(net.node[chain[-1] ^ 1]), ()) if e >> 1 not in passed]


def _goes_right(net: BranchNetwork, end: int, x_height: float) -> bool:
    """Whether a crossbar may leave a node by an end: to the right, or over a crossing drawn out."""
    xy = net.xy[net.vertices_from(end)]
    along = xy[-1] - xy[0]
    if len(xy) < 2 or not (along[0] > 0.6 * np.hypot(*along) or net.is_crossing(end)):
        return False
    return bool(xy[:, 1].mean() >= 0.6 * x_height)


def _worth(net: BranchNetwork, chain: tuple[int, ...], x_height: float) -> float | None:
    """How good a crossbar a chain makes, in the network's unit; ≤ 0 for none, None where no longer chain makes one."""
    of = _SETTINGS
    way = net.xy[chain_vertices(net, chain)]
    along = way[-1] - way[0]
    size = float(np.hypot(*along))
    if size > of.long * x_height and along[0] < of.word_level * size:
        return None
    if size < of.long * x_height or way[:, 1].mean() < of.word_low * x_height:
        return 0.0
    if net.is_crossing(chain[0]) or net.is_crossing(chain[-1]):
        return 0.0
    loose = (net.is_loose(chain[0]), net.is_loose(chain[-1] ^ 1))
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))]) / net.half_width
    # where it meets another line its own is drawn towards that
    clear = (run >= (0 if loose[0] else of.drawn)) & (run <= run[-1] - (0 if loose[1] else of.drawn))
    if clear.sum() < 3:
        return 0.0
    centred = way[clear] - way[clear].mean(axis=0)
    normal = np.linalg.svd(centred, full_matrices=False)[2][1]
    off = np.abs(centred @ normal)
    if off.max() > of.jog * net.half_width + (of.free_bow if all(loose) else of.word_bow) * size:
        return 0.0
    at = np.arange(run[clear][0], max(run[clear][-1] - of.window, run[clear][0]) + 1e-9, 1.0)
    ends = [np.column_stack([np.interp(at + more, run, axis) for axis in way.T]) for more in (0.0, of.window)]
    local = ends[1] - ends[0]
    if (local @ along < of.turned * size * np.hypot(*local.T)).any():
        return 0.0
    bent = max(0.0, float(np.sqrt((off**2).mean())) - 0.5 * net.half_width)
    return size - of.straight * bent + of.open * x_height * sum(loose)


def _best_chain(
    net: BranchNetwork, chains: Sequence[tuple[tuple[int, ...], float]], letter_vertices: set[int], later: set[int]
) -> tuple[int, ...]:
    """The best crossbar of a letter, given its vertices with those of its ligatures, and those of later letters."""
    most, best = 0.0, tuple[int, ...]()
    for chain, worth in chains:
        if worth <= most or letter_vertices.isdisjoint(chain_vertices(net, chain).tolist()):
            continue
        # what leads from the letter before to the stem is a ligature
        if net.is_loose(chain[0]) or net.is_loose(chain[-1] ^ 1) or int(net.node[chain[-1] ^ 1]) in later:
            most, best = worth, chain
    return best


def _hidden_part(net: BranchNetwork, chain: Sequence[int], *, right: bool) -> Indices:
    """Vertices, outwards, of other strokes over which a crossbar runs straight on at one side; without its node."""
    last = chain[-1] ^ 1 if right else chain[0]
    farthest, hidden = _SETTINGS.least_hidden * net.half_width, np.zeros(0, dtype=np.intp)
    if net.is_loose(last):
        return hidden
    way = net.xy[chain_vertices(net, chain)]
    middle, size = way.mean(axis=0), float(np.hypot(*(way[-1] - way[0])))
    aim = np.linalg.svd(way - middle, full_matrices=False)[2][0]
    aim = aim if (aim[0] > 0) == right else -aim
    for ends in _chains_beyond(net, last, {e >> 1 for e in chain}):
        vertices = chain_vertices(net, ends)[1:]
        away = net.xy[vertices] - net.position(last)
        ahead, aside = away @ aim, np.abs((net.xy[vertices] - middle) @ np.array([-aim[1], aim[0]]))
        fits = aside <= _SETTINGS.jog * net.half_width + _SETTINGS.word_bow * size
        fits &= ahead >= np.maximum.accumulate(ahead) - net.half_width
        fits &= ahead <= _SETTINGS.hidden * size
        count = len(fits) if fits.all() else int(fits.argmin())
        if count and ahead[count - 1] > farthest:
            farthest, hidden = float(ahead[count - 1]), vertices[:count]
    return hidden


def _chains_beyond(net: BranchNetwork, last: int, passed: set[int]) -> list[tuple[int, ...]]:
    """Ends that leave a node over other branches than those passed, alone and with those beyond a crossing."""
    firsts = [e for e in net.ends_at[int(net.node[last])] if e >> 1 not in passed]
    crossings = [e for e in firsts if net.is_crossing(e)]
    beyond = [(f, e) for f in crossings for e in net.ends_at[int(net.node[f ^ 1])] if e != f ^ 1]
    return [*((e,) for e in firsts), *beyond]
