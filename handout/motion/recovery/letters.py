"""One letter's line as the strokes that it was written with."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from handout.motion.recovery.bars import BARRED, CROSSED, SHARED, WAITING, beside, onward, own_bar, spans, within
from handout.motion.recovery.failing import mended
from handout.motion.recovery.guide import guides
from handout.motion.recovery.likeness import fitting, unlikeness
from handout.motion.recovery.loops import amiss
from handout.motion.recovery.models import HANDS, Models, along, frame, models
from handout.motion.recovery.network import Network, network, part
from handout.motion.recovery.walks import USUAL, Costs, Walk, guided, walks
from handout.values import Array, Indices

_LIKENESS = 10.0  # costs of a walk for one of unlikeness
_WAYS = 16  # walks that are compared
_SPARED = 2.4  # of a lift that a form has, too
_MARGIN = 7.0  # a walk that costs so much more than the cheapest is not made good by its likeness
_FORMS = 6  # forms that they are compared with
_LOOKED = 3  # forms that say where strokes may begin and turn
_CLEAR = 7.0  # half widths from a knot to another that is put on a branch
_CUTS = 2
_LOOP = 4.0  # cost of a loop that is the wrong way round
_DOT = 0.35  # of a small letter: a piece no longer is a dot
_POINTS = frozenset(".:…")
_DASH = 0.9  # one no longer is, too, that lies over all the rest
_UNDER = 0.1  # of a small letter that it may begin lower


@dataclass(frozen=True, eq=False)
class Line:
    """The line of one letter: its body, and where it is joined the way to its neighbours.

    xy : (n, 2), y up; radius, density : (n,); edges : (m, 2), as in `values.LineGraph`.
    small : height of a small letter, in the unit of `xy`.
    base : y of the line that the letter stands on, None where that is not known.
    begin, finish : vertices at loose ends where the pen comes from the letter before, and goes to the next.
    through : vertices at loose ends where a bar comes in from the letter before.
    either : vertices at loose ends where the pen comes from the letter before, or a bar does.
    across : vertices at loose ends where a bar goes over to the next letter.
    joining : whether it is of a hand that joins letters, if not all.
    bars, others : vertices along the bars that are known from the whole word: the letter's own, and those of others.
    shared : for each of both vertices before and after it that it shares with other strokes.
    """

    xy: Array
    radius: Array
    density: Array
    edges: Indices
    small: float
    begin: tuple[int, ...] = ()
    finish: tuple[int, ...] = ()
    through: tuple[int, ...] = ()
    either: tuple[int, ...] = ()
    across: tuple[int, ...] = ()
    joining: bool = False
    base: float | None = None
    bars: tuple[Indices, ...] = ()
    others: tuple[Indices, ...] = ()
    shared: tuple[tuple[Indices, Indices], ...] = ()

    @property
    def joints(self) -> set[int]:
        """Where it is cut off from what else the pen wrote."""
        return {*self.begin, *self.finish, *self.through, *self.either, *self.across}


@dataclass(frozen=True, eq=False)
class Written:
    """How a letter was written.

    strokes : vertices of its line in order, for each pen-down movement.
    late : for each, whether it is written after the word.
    bars : for each, whether it is a bar, or what else forms of the letter write late, whenever this one was written.
    """

    strokes: tuple[Indices, ...]
    late: tuple[bool, ...]
    bars: tuple[bool, ...] = ()


@dataclass(frozen=True, eq=False)
class Way:
    """A way in which a letter may have been written.

    strokes : as in `Written`.
    cost : what it costs a hand, and how unlike the usual ways of writing the letter it is.
    later : tells which of the strokes are written after the word, and which are bars.
    """

    strokes: tuple[Indices, ...]
    cost: float
    later: Callable[[], tuple[tuple[bool, ...], tuple[bool, ...]]]

    @cached_property
    def written(self) -> Written:
        """The letter written so."""
        return Written(self.strokes, *self.later())


def write(
    line: Line, letter: str, *, hands: tuple[str, ...] = HANDS, costs: Costs = USUAL, weight: float = _LIKENESS
) -> Written:
    """The strokes of a letter, in the order of writing."""
    return ways(line, letter, hands=hands, costs=costs, weight=weight)[0].written


def ways(
    line: Line,
    letter: str,
    *,
    hands: tuple[str, ...] = HANDS,
    costs: Costs = USUAL,
    weight: float = _LIKENESS,
    most: int = 1,
    margin: float = np.inf,
) -> list[Way]:
    """Ways in which a letter may have been written, the cheapest first.

    Parameters
    ----------
    most : how many are given.
    margin : none is given that costs so much more than the cheapest.
    """
    if line.either:
        entered = replace(line, begin=(*line.begin, *line.either), either=())
        crossed = replace(line, through=(*line.through, *line.either), either=())
        found = _ways(entered, letter, hands, costs, weight, most)
        # the lift before the bar is that of the letter which it belongs to
        barred = _ways(crossed, letter, hands, costs, weight, most)
        barred = [replace(way, cost=way.cost - costs.lift) for way in barred]
        found = sorted([*found, *barred], key=lambda way: way.cost)
    else:
        found = _ways(line, letter, hands, costs, weight, most)
    return [way for way in found[:most] if way.cost <= found[0].cost + margin]


def _ways(line: Line, letter: str, hands: tuple[str, ...], costs: Costs, weight: float, most: int) -> list[Way]:
    """Ways to write a letter of which it is known what comes into it."""
    half = float(np.median(line.radius))
    edges = mended(line.xy, line.radius, line.edges, half, line.joints, _DOT * line.small if dotted(letter) else 0.0)
    net = network(line.xy, line.radius, line.density, edges, half)
    points = _points(net) if letter in _POINTS else ()
    if points:
        return [Way(points, 0.0, lambda: ((False,) * len(points),) * 2)]
    dots = _dots(net, line) if dotted(letter) else {}
    last = sorted(dots.values(), key=lambda v: float(line.xy[v, 0].mean()))
    more = (True,) * len(last)
    rest = [b for b in range(len(net.branches)) if b not in dots]
    if not rest:
        return [Way(tuple(last), 0.0, lambda: (more, more))]
    foreign = {int(v) for bar in line.others for v in bar}
    ends = [int(bar[end]) for bar in (*line.bars, *line.others) for end in (0, -1)]
    known, laid, marks = models(letter, bool(line.begin), bool(line.finish), hands), np.zeros((0, 0, 2)), list[int]()
    if known is not None:
        body = [
            b
            for b in rest
            if not {int(net.branches[b][0]), int(net.branches[b][-1])} & line.joints
            and not within(net.branches[b], foreign)
        ]
        own = np.unique(np.concatenate([net.branches[b] for b in body or rest]))
        known, laid = fitting(known, net.xy[own], _FORMS)
        marks = _marks(net, body, own, laid, known) if body else []
        known_bars = {int(v) for bar in line.bars for v in bar}
        marks = [v for v in marks if v not in known_bars]
    net = part(net, rest, [*marks, *ends])
    begin, finish, through = (_ends(net, own) for own in (line.begin, line.finish, line.through))
    others = [chain for bar in line.others for chain in spans(net, bar, line.begin)]
    others += [tuple(onward(net, end)) for end in through if not any(end in chain for chain in others)]
    found = _walks(net, line, letter, begin, finish, through, others, costs)
    least = min(walk.cost for walk in found)
    found = [walk for walk in found if walk.cost <= least + _MARGIN]
    if known is not None and not known.drawn.all() and not others and not line.bars:
        led = np.flatnonzero(~known.drawn)
        there = {walk.strokes for walk in found}
        follow = guided(net, line.small, guides(net, laid[led], known.of[led]), begin=begin, finish=finish, costs=costs)
        found += [walk for walk in follow if walk.strokes not in there]
    # walks have many of their strokes in common
    different = dict.fromkeys(stroke for walk in found for stroke in walk.strokes)
    way_of = {stroke: vertices(net, stroke) for stroke in different}
    paths = [[way_of[stroke] for stroke in walk.strokes] for walk in found]
    total = np.array([walk.cost for walk in found])
    total += _LOOP * np.array([amiss(net, walk.strokes, letter, line.base, line.small) for walk in found])
    nearest = np.zeros(len(found), dtype=np.intp)
    if known is not None:
        places = {stroke: net.xy[way] for stroke, way in way_of.items()}
        parts = [
            [places[stroke] for stroke in walk.strokes if stroke not in others]
            or [places[stroke] for stroke in walk.strokes]
            for walk in found
        ]
        unlike = weight * unlikeness(parts, known, laid, entered=bool(line.begin), left=bool(line.finish)) + known.cost
        lifts = np.array([len(walk.strokes) - 1 for walk in found])
        unlike -= _SPARED * np.minimum(lifts[:, None], known.strokes - 1)
        total += unlike.min(axis=1)
        nearest = np.where(known.drawn, unlike, np.inf).argmin(axis=1)

    def later(way: int) -> tuple[tuple[bool, ...], tuple[bool, ...]]:
        flags: tuple[bool, ...] = (False,) * len(paths[way])
        if known is not None:
            flags = _late([net.xy[v] for v in paths[way]], laid[nearest[way]], known.late[nearest[way]])
        strokes, barred = found[way].strokes, found[way].barred
        bars = tuple(flag or stroke in barred for flag, stroke in zip(flags, strokes, strict=True))
        # a bar waits only where the pen must first go on to the next letter
        waits = bool(line.joints if line.joining else line.finish) or (line.joining and letter in WAITING)
        waiting = (
            stroke in others or (waits and (flag or stroke in barred))
            for flag, stroke in zip(flags, strokes, strict=True)
        )
        return (*waiting, *more), (*bars, *more)

    return [
        Way((*(_whole(path, line) for path in paths[way]), *last), float(total[way]), partial(later, way))
        for way in np.argsort(total, kind="stable")[:most].tolist()
    ]


def _walks(
    net: Network,
    line: Line,
    letter: str,
    begin: list[int],
    finish: list[int],
    through: list[int],
    others: Sequence[tuple[int, ...]],
    costs: Costs,
) -> list[Walk]:
    """Ways over a letter: with its bars followed before anything else, and, where only it may have one, without."""
    own = [chain for bar in line.bars for chain in spans(net, bar, line.begin)]
    found: list[Walk] = []
    if not own and not line.bars and (letter in BARRED or letter in CROSSED):
        passed = {e >> 1 for chain in others for e in chain}
        loose = [e for e, knot in enumerate(net.knot.tolist()) if len(net.at[knot]) == 1]
        tips = [e for e in loose if e >> 1 not in passed and e not in begin]
        bar = own_bar(net, tips, line.small, aslant=letter in CROSSED)
        if bar:
            found += _beside(net, line, [*others, bar], begin, finish, costs)
    if not found:
        found += _beside(net, line, [*others, *own], begin, finish, costs)
    return found or walks(net, line.small, begin=begin, finish=finish, through=through, costs=costs, most=_WAYS)


def _whole(way: Indices, line: Line) -> Indices:
    """A stroke with what it shares at its ends with others, if it is a known bar."""
    for bar, (before, after) in zip((*line.bars, *line.others), line.shared, strict=False):
        if len(way) > 1 and np.isin(way, bar).mean() >= SHARED:
            first = before if way[0] == bar[0] else before[:0]
            return np.concatenate([first, way, after if way[-1] == bar[-1] else after[:0]])
    return way


def _beside(
    net: Network,
    line: Line,
    chains: Sequence[tuple[int, ...]],
    begin: list[int],
    finish: list[int],
    costs: Costs,
) -> list[Walk]:
    """Ways over a letter beside its bars, which come last; none if there is nothing else."""
    if not chains:
        return walks(net, line.small, begin=begin, finish=finish, costs=costs, most=_WAYS)
    kept = beside(net, [e for chain in chains for e in chain])
    if not kept:
        return []
    rest = part(net, kept)
    number = {b: i for i, b in enumerate(kept)}
    there = [[2 * number[e >> 1] + (e & 1) for e in ends if e >> 1 in number] for ends in (begin, finish)]
    found = walks(rest, line.small, begin=there[0], finish=there[1], costs=costs, most=_WAYS)
    return [
        Walk((*(tuple(2 * kept[e >> 1] + (e & 1) for e in s) for s in w.strokes), *chains), w.cost, tuple(chains))
        for w in found
    ]


def dotted(letter: str) -> bool:
    """Whether pieces apart from a letter's line are dots or accents."""
    return letter in ("i", "j") or len(unicodedata.normalize("NFD", letter)) > 1


def _points(net: Network) -> tuple[Indices, ...]:
    """The points of a mark that has nothing else, from above or from left to right; none if it has."""
    if any(len(ends) > 1 for ends in net.at.values()):
        return ()
    middle = np.array([net.xy[path].mean(axis=0) for path in net.branches])
    across = np.ptp(middle, axis=0)
    order = np.argsort(-middle[:, 1] if across[1] > across[0] else middle[:, 0])
    paths = (net.branches[b] for b in order.tolist())
    return tuple(path if net.xy[path[0], 0] <= net.xy[path[-1], 0] else path[::-1] for path in paths)


def _dots(net: Network, line: Line) -> dict[int, Indices]:
    """Branch → vertices, from left to right, of pieces that are dots or accents.

    Where there is nothing else, only what is known to be over the height of small letters is one.
    """
    alone = [
        b
        for b, path in enumerate(net.branches)
        if all(len(net.at[int(net.knot[end])]) == 1 for end in (2 * b, 2 * b + 1)) or len(path) == 1
    ]
    free = [b for b in alone if not {*net.branches[b].tolist()} & line.joints]
    length = net.length * net.half / line.small
    rest = [net.xy[path, 1].max() for b, path in enumerate(net.branches) if b not in free or length[b] >= _DASH]
    top = max(rest, default=np.inf) - _UNDER * line.small
    found = [b for b in free if length[b] < _DOT or (length[b] < _DASH and net.xy[net.branches[b], 1].min() > top)]
    if len(found) == len(net.branches):
        least = np.inf if line.base is None else line.base + line.small
        found = [b for b in found if net.xy[net.branches[b], 1].min() > least]
    paths = {b: net.branches[b] for b in found}
    return {b: path if net.xy[path[0], 0] <= net.xy[path[-1], 0] else path[::-1] for b, path in paths.items()}


def _late(strokes: Sequence[Array], form: Array, late: NDArray[np.bool_]) -> tuple[bool, ...]:
    """Which strokes, all after the first, lie along what a form writes late."""
    found = [False]
    for xy in strokes[1:]:
        places = along([xy], 16)[0]
        away = ((places[:, None] - form[None]) ** 2).sum(axis=-1)
        found.append(bool(late[away.argmin(axis=1)].mean() > 0.5))
    return tuple(found)


def _ends(net: Network, vertices: Sequence[int]) -> list[int]:
    return [end for end, knot in enumerate(net.knot.tolist()) if knot in vertices]


def vertices(net: Network, stroke: Sequence[int]) -> Indices:
    """Vertices of a stroke in order, given the ends by which the pen leaves knots."""
    ways = [net.way(end) for end in stroke]
    joined = [ways[0]]
    for way in ways[1:]:
        joined.append(way[1:] if way[0] == joined[-1][-1] else way)
    return np.concatenate(joined)


def _marks(net: Network, body: Sequence[int], own: Indices, laid: Array, letter: Models) -> list[int]:
    """Vertices on branches where the nearest forms of the letter begin, cease or turn back."""
    xy = net.xy[own]
    middle = xy.mean(axis=0)
    size = float(np.sqrt((xy.std(axis=0) ** 2).sum()))
    marks = np.concatenate(letter.ends[:_LOOKED]) @ frame(xy - middle).T + middle
    gap = np.hypot(xy[:, 0] - marks[:, :1], xy[:, 1] - marks[:, 1:])
    near = gap.argmin(axis=1)
    near = near[gap[np.arange(len(near)), near] <= 0.3 * size]
    place = {v: (b, i) for b in body for i, v in enumerate(net.branches[b].tolist())}
    runs: dict[int, Array] = {}
    found: list[int] = []
    # many marks of different forms are at one vertex
    for mark in dict.fromkeys(own[near].tolist()):
        vertex = _settled(net, mark, place, runs)
        if vertex is not None and vertex not in found and _clear(net, vertex, found, place):
            found.append(vertex)
            if len(found) == _CUTS:
                break
    return found


def _settled(net: Network, vertex: int, place: dict[int, tuple[int, int]], runs: dict[int, Array]) -> int | None:
    """The sharpest bend near a vertex of a branch, if that is far enough from both its knots.

    runs : for branches how far along them their vertices are, half widths; more are added.
    """
    b, i = place[vertex]
    path = net.branches[b]
    if path[0] == path[-1]:
        return vertex if len(path) > 8 else None
    if b not in runs:
        step = net.xy[path[1:]] - net.xy[path[:-1]]
        runs[b] = np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))]) / net.half
    run = runs[b]
    near = np.flatnonzero((np.abs(run - run[i]) < _CLEAR) & (run > _CLEAR) & (run < run[-1] - _CLEAR))
    if not len(near):
        return None
    reach = max(2, round(2 * (len(path) - 1) / max(float(run[-1]), 1e-9)))
    before, after = np.maximum(near - reach, 0), np.minimum(near + reach, len(path) - 1)
    a, c = net.xy[path[near]] - net.xy[path[before]], net.xy[path[after]] - net.xy[path[near]]
    bend = (a * c).sum(axis=1) / np.maximum(np.hypot(*a.T) * np.hypot(*c.T), 1e-12) + 0.02 * np.abs(run[near] - run[i])
    return int(path[near[int(bend.argmin())]])


def _clear(net: Network, vertex: int, found: Sequence[int], place: dict[int, tuple[int, int]]) -> bool:
    b, _ = place[vertex]
    own = [v for v in found if place[v][0] == b]
    return all(float(np.hypot(*(net.xy[v] - net.xy[vertex]))) > 1.5 * _CLEAR * net.half for v in own)
