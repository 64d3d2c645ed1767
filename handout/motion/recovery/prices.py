"""What movements over a network cost a hand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from handout.motion.recovery.network import Network
from handout.values import Array

TINY = 5.0  # half widths: a branch so short is a crossing drawn out, and may be passed thrice
_AHEAD = 0.5  # cosine: ink that fails leaves a gap along the way
_HABITUAL = np.array([0.5, -0.866])  # direction in which writing costs nothing


@dataclass(frozen=True)
class Costs:
    """What movements cost a hand; a right angle turned at a knot costs about half of `turn`.

    turn, corner, tip : of turning back on the way: at a knot, in a bend where forms of the letter turn, at a loose end.
    cross : more, of not going straight on where two lines cross.
    retrace, retraced : of passing a branch once more: for each, and for each height of a small letter; third : more,
        of passing it a third time.
    lift : of lifting the pen; after : more, where it has left for the next letter.
    landing, leaving : of doing so where other strokes pass; passing : in the middle of a branch.
    jump : for each height of a small letter that the pen goes in the air.
    against : for each height of a small letter that is written against the habit, up and to the left.
    first : of beginning elsewhere than where the pen comes from the letter before, or of going back to that.
    gap : of going on over a gap in the ink of `gap_far` half widths, the widest.

    The figures were found by random search on pages of the simulated author and on recorded letters: shares of strokes
    found and right, and of words all right, were to be greatest.  `benchmarks.order_search` searches anew.
    """

    turn: float = 1.6
    corner: float = 0.8
    tip: float = 0.71
    cross: float = 1.0
    retrace: float = 0.18
    retraced: float = 0.28
    third: float = 0.4
    lift: float = 4.2
    after: float = 2.0
    landing: float = 0.59
    leaving: float = 0.9
    passing: float = 0.92
    jump: float = 0.25
    against: float = 0.46
    first: float = 1.97
    gap: float = 1.5
    gap_far: float = 9.4


USUAL = Costs()


@dataclass(frozen=True, eq=False)
class Prices:
    """Costs of a network's ends.

    onward : for each that is arrived at, those by which the pen may go on, and what turning there costs.
    passing, again : of the branch passed from each, first and once more.
    landing, leaving : of beginning and of ending a stroke.
    air : for each where a stroke ends, the others with the cost of going there in the air and landing, cheapest first.
    tiny : bits of the branches that are no more than a crossing drawn out.
    finish : ends where the pen goes to the next letter.
    """

    onward: list[list[tuple[int, float]]]
    passing: list[float]
    again: list[float]
    landing: list[float]
    leaving: list[float]
    air: list[list[tuple[float, int]]]
    tiny: int
    finish: frozenset[int]


def prices(
    net: Network, small: float, begin: Sequence[int], finish: Sequence[int], through: Sequence[int], costs: Costs
) -> Prices:
    """What movements over a network cost, see `walks.walks`."""
    count = len(net.branches)
    run = net.length * (net.half / small)
    degree = {knot: len(ends) for knot, ends in net.at.items()}
    loose = {*begin, *finish, *through}  # where the letter is cut off, nobody turns
    # cosines of the turns from each end to each other
    straight = np.negative(net.leaving @ np.ascontiguousarray(net.leaving.T)).tolist()
    onward = [
        [
            (b, _turn(straight, a, b, degree[knot], costs) + missed)
            for b, missed in zip(net.at[knot], _missed(straight, a, net.at[knot], costs), strict=True)
            if a != b or a not in loose
        ]
        for a, knot in enumerate(net.knot.tolist())
    ]
    for a, b, price in _gaps(
        net, [e for e in range(2 * count) if degree[int(net.knot[e])] == 1 and e not in loose], costs
    ):
        onward[a].append((b, price))
    passing = _against(net, small, costs)
    again = [costs.retrace + costs.retraced * float(run[e >> 1]) + passing[e] for e in range(2 * count)]
    at = [degree[knot] for knot in net.knot.tolist()]
    loops = [int(net.knot[e]) == int(net.knot[e ^ 1]) for e in range(2 * count)]
    landing = [
        0.0 if n == 1 else costs.passing if n == 2 and not loop else costs.landing
        for n, loop in zip(at, loops, strict=True)
    ]
    leaving = [
        0.0 if n == 1 else costs.passing if n == 2 and not loop else costs.leaving
        for n, loop in zip(at, loops, strict=True)
    ]
    for end in finish:
        landing[end] += costs.first
    for end in (*begin, *through):
        leaving[end] += costs.first
    places = net.xy[net.knot]
    away = places[None] - places[:, None]
    # back to the left a pen goes only for what it has left out
    jump = costs.jump * (np.hypot(away[..., 0], away[..., 1]) + np.maximum(-away[..., 0], 0)) / small
    jump += np.array(landing)
    order = np.argsort(jump, axis=1, kind="stable")
    ranked = zip(np.take_along_axis(jump, order, axis=1).tolist(), order.tolist(), strict=True)
    air = [list(zip(row, ends, strict=True)) for row, ends in ranked]
    tiny = sum(1 << b for b in np.flatnonzero(net.length < TINY).tolist())
    return Prices(onward, passing, again, landing, leaving, air, tiny, frozenset(finish))


def _gaps(net: Network, tips: Sequence[int], costs: Costs) -> Iterator[tuple[int, int, float]]:
    """Tips that a pen may go on between though it left no ink there: (arrived, end, price), either way."""
    for a in tips:
        for b in tips:
            if a == b:
                continue
            way = net.place(b) - net.place(a)
            far = float(np.hypot(*way)) / net.half
            if far > costs.gap_far or far < 1e-9:
                continue
            aim = way / (far * net.half)
            straight = min(-float(net.leaving[a] @ aim), float(net.leaving[b] @ aim))
            if straight > _AHEAD or far < 2.5:
                yield a, b, costs.gap * far / costs.gap_far + costs.turn * (max(0.0, 1 - straight) / 2) ** 1.5


def _turn(straight: Sequence[Sequence[float]], arrived: int, end: int, degree: int, costs: Costs) -> float:
    """Of arriving by one end and leaving by another of the same knot."""
    if arrived == end:
        return costs.tip if degree == 1 else costs.corner if degree == 2 else costs.turn
    return float(costs.turn * (max(0.0, 1 - straight[arrived][end]) / 2) ** 1.5)


def _missed(straight: Sequence[Sequence[float]], arrived: int, ends: Sequence[int], costs: Costs) -> list[float]:
    """Of leaving by each end of a knot, and not going straight on where two lines cross there."""
    none = [0.0] * len(ends)
    if len(ends) < 4:
        return none
    ahead = max((e for e in ends if e != arrived), key=straight[arrived].__getitem__)
    back = max((e for e in ends if e != ahead), key=straight[ahead].__getitem__)
    if back != arrived:
        return none
    price = costs.cross * max(0.0, straight[arrived][ahead])
    return [0.0 if end == ahead else price for end in ends]


def _against(net: Network, small: float, costs: Costs) -> list[float]:
    """Of passing each branch, left by each of its ends, in a direction that is not the habitual one."""
    found: list[float] = []
    for path in net.branches:
        way: Array = net.xy[path]
        if len(way) < 2:
            found += [0.0, 0.0]
            continue
        step = way[1:] - way[:-1]
        size = np.hypot(step[:, 0], step[:, 1])
        # down and to the right costs nothing
        along = (step @ _HABITUAL) / np.maximum(size, 1e-12)
        there, back = size * (1 - along) / 2, size * (1 + along) / 2
        found += [float(costs.against * sums / small) for sums in (there.sum(), back[::-1].copy().sum())]
    return found
