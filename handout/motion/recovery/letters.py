"""One letter's line as the strokes that it was written with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from handout.hand.letter_classes import CROSSED, CROSSED_ASLANT
from handout.motion.recovery import dots
from handout.motion.recovery.bars import SHARED, WAITING, beside, onward, own_bar, spans, within
from handout.motion.recovery.failing import mended
from handout.motion.recovery.guide import guides
from handout.motion.recovery.likeness import fitting, unlikeness
from handout.motion.recovery.lines import Line, Way, Written
from handout.motion.recovery.loops import amiss
from handout.motion.recovery.marks import marks
from handout.motion.recovery.models import HANDS, Models, along, models
from handout.motion.recovery.network import Network, network, part
from handout.motion.recovery.prices import USUAL, Costs
from handout.motion.recovery.walks import Walk, guided, walks
from handout.values import Array, Indices

_LIKENESS = 10.0  # costs of a walk for one of unlikeness
_WAYS = 16  # walks that are compared
_SPARED = 2.4  # of a lift that a form has, too
_MARGIN = 7.0  # a walk that costs so much more than the cheapest is not made good by its likeness
_FORMS = 6  # forms that they are compared with
_LOOP = 4.0  # cost of a loop that is the wrong way round


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
    least = dots.DOT * line.small if dots.dotted(letter) else 0.0
    net = network(
        line.xy, line.radius, line.density, mended(line.xy, line.radius, line.edges, half, line.joints, least), half
    )
    points = dots.points(net) if letter in dots.POINTED else ()
    if points:
        return [Way(points, 0.0, lambda: ((False,) * len(points),) * 2)]
    apart = dots.dots(net, line.small, line.base, line.joints) if dots.dotted(letter) else {}
    last = sorted(apart.values(), key=lambda v: float(line.xy[v, 0].mean()))
    more = (True,) * len(last)
    rest = [b for b in range(len(net.branches)) if b not in apart]
    if not rest:
        return [Way(tuple(last), 0.0, lambda: (more, more))]
    known, cuts = _known(net, rest, line, letter, hands)
    net = part(net, rest, cuts)
    found, others = _found(net, line, letter, known, costs)
    # walks have many of their strokes in common
    way_of = {s: vertices(net, s) for s in dict.fromkeys(stroke for walk in found for stroke in walk.strokes)}
    total = np.array([walk.cost for walk in found])
    total += _LOOP * np.array([amiss(net, walk.strokes, letter, line.base, line.small) for walk in found])
    nearest: Indices | None = None
    if known is not None:
        unlike, nearest = _compared(net, found, others, way_of, known, line, weight)
        total += unlike

    def later(number: int) -> tuple[tuple[bool, ...], tuple[bool, ...]]:
        walk = found[number]
        flags: tuple[bool, ...] = (False,) * len(walk.strokes)
        if known is not None and nearest is not None:
            form, (forms, laid) = nearest[number], known
            flags = _late([net.xy[way_of[stroke]] for stroke in walk.strokes], laid[form], forms.late[form])
        waiting, bars = _waiting(walk, flags, others, line, letter)
        return (*waiting, *more), (*bars, *more)

    return [
        Way((*(_whole(way_of[s], line) for s in found[k].strokes), *last), float(total[k]), partial(later, k))
        for k in np.argsort(total, kind="stable")[:most].tolist()
    ]


def _known(
    net: Network, rest: Sequence[int], line: Line, letter: str, hands: tuple[str, ...]
) -> tuple[tuple[Models, Array] | None, list[int]]:
    """The forms that lie nearest to a letter, laid over it; and vertices where its branches are to be cut."""
    ends = [int(bar[end]) for bar in (*line.bars, *line.others) for end in (0, -1)]
    every = models(letter, bool(line.begin), bool(line.finish), hands)
    if every is None:
        return None, ends
    foreign = {int(v) for bar in line.others for v in bar}
    body = [
        b
        for b in rest
        if not {int(net.branches[b][0]), int(net.branches[b][-1])} & line.joints
        and not within(net.branches[b], foreign)
    ]
    own = np.unique(np.concatenate([net.branches[b] for b in body or rest]))
    known, laid = fitting(every, net.xy[own], _FORMS)
    barred = {int(v) for bar in line.bars for v in bar}
    found = [v for v in marks(net, body, own, laid, known) if v not in barred] if body else []
    return (known, laid), [*found, *ends]


def _found(
    net: Network, line: Line, letter: str, known: tuple[Models, Array] | None, costs: Costs
) -> tuple[list[Walk], list[tuple[int, ...]]]:
    """Ways over a letter that cost little, those that its forms would take among them; and bars of other letters."""
    begin, finish, through = (_ends(net, own) for own in (line.begin, line.finish, line.through))
    others = [chain for bar in line.others for chain in spans(net, bar, line.begin)]
    others += [tuple(onward(net, end)) for end in through if not any(end in chain for chain in others)]
    found = _walks(net, line, letter, begin, finish, through, others, costs)
    least = min(walk.cost for walk in found)
    found = [walk for walk in found if walk.cost <= least + _MARGIN]
    if known is not None and not known[0].drawn.all() and not others and not line.bars:
        forms, laid = known
        led = np.flatnonzero(~forms.drawn)
        there = {walk.strokes for walk in found}
        lines = guides(net, laid[led], forms.of[led])
        follow = guided(net, line.small, lines, begin=begin, finish=finish, costs=costs)
        found += [walk for walk in follow if walk.strokes not in there]
    return found, others


def _compared(
    net: Network,
    found: Sequence[Walk],
    others: Sequence[tuple[int, ...]],
    way_of: Mapping[tuple[int, ...], Indices],
    known: tuple[Models, Array],
    line: Line,
    weight: float,
) -> tuple[Array, Indices]:
    """How much walks cost for being unlike the forms of a letter, and the drawn form that each is most like."""
    forms, laid = known
    places = {stroke: net.xy[way] for stroke, way in way_of.items()}
    parts = [
        [places[stroke] for stroke in walk.strokes if stroke not in others] or [places[s] for s in walk.strokes]
        for walk in found
    ]
    unlike = weight * unlikeness(parts, forms, laid, entered=bool(line.begin), left=bool(line.finish)) + forms.cost
    lifts = np.array([len(walk.strokes) - 1 for walk in found])
    unlike -= _SPARED * np.minimum(lifts[:, None], forms.strokes - 1)
    return unlike.min(axis=1), np.where(forms.drawn, unlike, np.inf).argmin(axis=1)


def _waiting(
    walk: Walk, flags: Sequence[bool], others: Sequence[tuple[int, ...]], line: Line, letter: str
) -> tuple[tuple[bool, ...], tuple[bool, ...]]:
    """Which strokes of a walk wait for the end of the word, and which are bars; `flags`: which a form writes late."""
    bars = tuple(flag or stroke in walk.barred for flag, stroke in zip(flags, walk.strokes, strict=True))
    # a bar waits only where the pen must first go on to the next letter
    waits = bool(line.joints if line.joining else line.finish) or (line.joining and letter in WAITING)
    return tuple(stroke in others or (waits and bar) for bar, stroke in zip(bars, walk.strokes, strict=True)), bars


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
    if not own and not line.bars and (letter in CROSSED or letter in CROSSED_ASLANT):
        passed = {e >> 1 for chain in others for e in chain}
        loose = [e for e, knot in enumerate(net.knot.tolist()) if len(net.at[knot]) == 1]
        tips = [e for e in loose if e >> 1 not in passed and e not in begin]
        bar = own_bar(net, tips, line.small, aslant=letter in CROSSED_ASLANT)
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
