"""Ways of a pen over all branches of a network, those first that cost a hand the least.

A walk is built branch by branch: each step covers one more, reached by going on, by retracing what is covered already,
or by lifting the pen.  So all walks of as many steps cover equally much and can be compared, and only so many of
them are followed: the effort is linear in the branches.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf
from operator import itemgetter
from typing import TypeAlias

import numpy as np

from handout.motion.recovery.guide import Guide
from handout.motion.recovery.network import Network
from handout.values import Array

_WIDTH = 32  # walks that are followed
_GUIDED = 4  # where a form is followed
_ALIKE = 3  # of them that have covered the same and stand at the same place
_LIFTS = 6  # places where a lifted pen may land
_DEEP = 4  # branches that are retraced in one go
_AHEAD = 0.5  # cosine: ink that fails leaves a gap along the way
_HABITUAL = np.array([0.5, -0.866])  # direction in which writing costs nothing
_ROUNDED = 1e-9  # costs that differ less may be equal
_TINY = 5.0  # half widths: a branch so short is a crossing drawn out, and may be passed thrice


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
class Walk:
    """A way over all branches of a network.

    strokes : for each pen-down movement the ends by which the pen leaves one knot after the other.
    cost : see `Costs`.
    barred : those of the strokes that are bars.
    """

    strokes: tuple[tuple[int, ...], ...]
    cost: float
    barred: tuple[tuple[int, ...], ...] = ()


@dataclass(frozen=True, eq=False)
class _Prices:
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


def walks(
    net: Network,
    small: float,
    *,
    begin: Sequence[int] = (),
    finish: Sequence[int] = (),
    through: Sequence[int] = (),
    costs: Costs = USUAL,
    most: int = 16,
    width: int = _WIDTH,
) -> list[Walk]:
    """The cheapest walks.

    Parameters
    ----------
    small : height of a small letter, in the unit of the network.
    begin, finish : ends at loose knots where the pen comes from another letter, and where it goes to one.
    through : ends at loose knots where a stroke of another letter comes in, which is written late.
    most : how many walks are given.
    """
    prices = _prices(net, small, begin, finish, through, costs)
    first = [costs.first if (begin and end not in begin) or end in through else 0.0 for end in range(len(net.knot))]
    return [Walk(strokes, cost) for cost, strokes in _search(prices, first, costs, most, width)]


def guided(
    net: Network,
    small: float,
    guides: Iterable[Guide],
    *,
    begin: Sequence[int] = (),
    finish: Sequence[int] = (),
    costs: Costs = USUAL,
    most: int = 1,
    width: int = _GUIDED,
) -> list[Walk]:
    """The walks that follow each of some guides best, with what they cost without a guide; see `walks`."""
    prices = _prices(net, small, begin, finish, (), costs)
    first = [costs.first if begin and end not in begin else 0.0 for end in range(len(net.knot))]
    found = {strokes for guide in guides for _, strokes in _search(_swayed(prices, guide), first, costs, most, width)}
    return [Walk(strokes, _cost(strokes, prices, first, costs)) for strokes in sorted(found)]


def _search(
    prices: _Prices, first: Sequence[float], costs: Costs, most: int, width: int
) -> list[tuple[float, tuple[tuple[int, ...], ...]]]:
    """The cheapest walks and what they cost, the cheapest first; `first`: cost of beginning by each end."""
    states: list[_State] = []
    for end, price in enumerate(first):
        cost = prices.landing[end] + price + prices.passing[end]
        states.append((cost, end, 1 << (end >> 1), 0, 0, None, True))
    for _ in range(len(first) // 2 - 1):
        found: list[_State] = []
        bound, look = inf, 2 * width
        for state in states:
            if len(found) >= look:
                # what costs more than the last that is kept so far is not kept; nor is any of it looked at again
                found = _kept(found, width)
                bound = found[-1][0] + _ROUNDED if len(found) == width else inf
                look = len(found) + width
            _steps(state, prices, costs, found, bound)
        states = _kept(found, width)
    done = [(state[0] + prices.leaving[state[1] ^ 1], state) for state in states]
    done.sort(key=itemgetter(0))
    return [(cost, _strokes(state)) for cost, state in done[:most]]


def _swayed(prices: _Prices, guide: Guide) -> _Prices:
    """What movements cost with a guide."""
    passing, onward, air = guide.passing.tolist(), guide.onward.tolist(), guide.air.tolist()
    return replace(
        prices,
        onward=[[(b, price + onward[a ^ 1][b]) for b, price in some] for a, some in enumerate(prices.onward)],
        passing=[price + more for price, more in zip(prices.passing, passing, strict=True)],
        again=[price + more for price, more in zip(prices.again, passing, strict=True)],
        air=[sorted((price + air[a ^ 1][b], b) for price, b in some) for a, some in enumerate(prices.air)],
    )


def _cost(strokes: Sequence[Sequence[int]], prices: _Prices, first: Sequence[float], costs: Costs) -> float:
    """What a walk costs."""
    total, passed, before = 0.0, dict[int, int](), -1
    for stroke in strokes:
        total += first[stroke[0]] + prices.landing[stroke[0]] if before < 0 else 0.0
        if before >= 0:
            after = costs.after if before ^ 1 in prices.finish else 0.0
            total += costs.lift + after + next(price for price, e in prices.air[before ^ 1] if e == stroke[0])
        for step, end in enumerate(stroke):
            if step:
                total += next(price for e, price in prices.onward[before ^ 1] if e == end)
            often = passed.get(end >> 1, 0)
            total += (prices.again if often else prices.passing)[end] + (costs.third if often > 1 else 0.0)
            passed[end >> 1] = often + 1
            before = end
        total += prices.leaving[before ^ 1]
    return total


# a walk so far: what it cost, the end by which its last step left a knot, bits of the branches that it covered, passed
# twice and passed thrice, the walk before that step, and whether the pen was lifted for it
_State: TypeAlias = "tuple[float, int, int, int, int, _State | None, bool]"


def _steps(state: _State, prices: _Prices, costs: Costs, found: list[_State], bound: float) -> None:
    """Walks that cover one branch more and cost no more than a bound, added to those found."""
    cost, end, covered, twice, thrice, _, _ = state
    if cost > bound:
        return
    _onward(state, prices, costs, found, _DEEP, min(cost + costs.lift + costs.landing + costs.leaving, bound))
    stop = cost + prices.leaving[end ^ 1] + costs.lift + (costs.after if end ^ 1 in prices.finish else 0.0)
    count = 0
    for air, landing in prices.air[end ^ 1]:
        if stop + air > bound:
            break
        bit = 1 << (landing >> 1)
        if not covered & bit:
            found.append((stop + air + prices.passing[landing], landing, covered | bit, twice, thrice, state, True))
            count += 1
            if count == _LIFTS:
                break


def _onward(state: _State, prices: _Prices, costs: Costs, found: list[_State], deep: int, most: float) -> None:
    """Walks that go on to another branch without a lift, over covered ones if need be, as long as a lift costs more."""
    cost, arrived, covered, twice, thrice, _, _ = state
    for end, price in prices.onward[arrived ^ 1]:
        bit = 1 << (end >> 1)
        if not covered & bit:
            found.append((cost + price + prices.passing[end], end, covered | bit, twice, thrice, state, False))
        elif deep:
            after = cost + price + prices.again[end]
            third = bit & twice
            if third:
                after += costs.third
                if third & thrice and not prices.tiny & bit:
                    continue
            if after < most:
                over = (after, end, covered, twice | bit, thrice | third, state, False)
                _onward(over, prices, costs, found, deep - 1, most)


def _kept(states: list[_State], width: int) -> list[_State]:
    """The cheapest, of those in the same situation only a few."""
    kept: list[_State] = []
    often: dict[tuple[int, int, int, int], int] = {}
    states.sort(key=itemgetter(0))
    for state in states:
        key = state[1:5]
        if often.get(key, 0) < _ALIKE:
            often[key] = often.get(key, 0) + 1
            kept.append(state)
            if len(kept) == width:
                break
    return kept


def _strokes(last: _State) -> tuple[tuple[int, ...], ...]:
    strokes: list[tuple[int, ...]] = []
    current: list[int] = []
    state: _State | None = last
    while state is not None:
        _, end, _, _, _, state, lifted = state
        current.append(end)
        if lifted:
            strokes.append(tuple(current[::-1]))
            current = []
    return tuple(strokes[::-1])


def _prices(
    net: Network, small: float, begin: Sequence[int], finish: Sequence[int], through: Sequence[int], costs: Costs
) -> _Prices:
    count = len(net.branches)
    run = net.length * (net.half / small)
    degree = {knot: len(ends) for knot, ends in net.at.items()}
    loose = {*begin, *finish, *through}  # where the letter is cut off, nobody turns
    onward = [
        [
            (b, _turn(net, a, b, degree[knot], costs) + _missed(net, a, b, costs))
            for b in net.at[knot]
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
    tiny = sum(1 << b for b in np.flatnonzero(net.length < _TINY).tolist())
    return _Prices(onward, passing, again, landing, leaving, air, tiny, frozenset(finish))


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


def _turn(net: Network, arrived: int, end: int, degree: int, costs: Costs) -> float:
    """Of arriving by one end and leaving by another of the same knot."""
    if arrived == end:
        return costs.tip if degree == 1 else costs.corner if degree == 2 else costs.turn
    straight = -float(net.leaving[arrived] @ net.leaving[end])  # cosine of the turn
    return float(costs.turn * (max(0.0, 1 - straight) / 2) ** 1.5)


def _missed(net: Network, arrived: int, end: int, costs: Costs) -> float:
    """Of not going straight on where two lines cross."""
    ends = net.at[int(net.knot[arrived])]
    if len(ends) < 4:
        return 0.0
    ahead = max((e for e in ends if e != arrived), key=lambda e: -float(net.leaving[arrived] @ net.leaving[e]))
    back = max((e for e in ends if e != ahead), key=lambda e: -float(net.leaving[ahead] @ net.leaving[e]))
    straight = -float(net.leaving[arrived] @ net.leaving[ahead])
    return costs.cross * max(0.0, straight) if back == arrived and end != ahead else 0.0


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
