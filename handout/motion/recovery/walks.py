"""Ways of a pen over all branches of a network, those first that cost a hand the least.

A walk is built branch by branch: each step covers one more, reached by going on, by retracing what is covered already,
or by lifting the pen.  So all walks of as many steps cover equally much and can be compared, and only so many of
them are followed: the effort is linear in the branches.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import nsmallest

import numpy as np

from handout.motion.recovery.network import Network
from handout.values import Array

_WIDTH = 48  # walks that are followed
_ALIKE = 3  # of them that have covered the same and stand at the same place
_LIFTS = 6  # places where a lifted pen may land
_DEEP = 4  # branches that are retraced in one go
_AHEAD = 0.5  # cosine: ink that fails leaves a gap along the way
_TINY = 5.0  # half widths: a branch so short is a crossing drawn out, and may be passed thrice


@dataclass(frozen=True)
class Costs:
    """What movements cost a hand; a right angle turned at a knot costs about one.

    turn : of turning back on the way at a knot.
    tip : of turning back where the line ends.
    retrace, retraced : of passing a branch once more: for each, and for each height of a small letter.
    lift : of lifting the pen; landing, leaving : of doing so where other strokes pass.
    jump : for each height of a small letter that the pen goes in the air.
    against : for each height of a small letter that is written against the habit, up and to the left.
    """

    turn: float = 1.6
    tip: float = 0.5
    retrace: float = 0.2
    retraced: float = 0.5
    lift: float = 2.4
    landing: float = 0.7
    leaving: float = 0.7
    jump: float = 0.25
    against: float = 0.6
    first: float = 3.0
    passing: float = 1.2
    corner: float = 1.2
    third: float = 0.4
    cross: float = 1.0
    gap: float = 1.5
    gap_far: float = 9.0


USUAL = Costs()


@dataclass(frozen=True, eq=False)
class Walk:
    """A way over all branches of a network.

    strokes : for each pen-down movement the ends by which the pen leaves one knot after the other.
    cost : see `Costs`.
    """

    strokes: tuple[tuple[int, ...], ...]
    cost: float


@dataclass(frozen=True, eq=False)
class _Prices:
    """Costs of a network's ends: of going on by others, passing, landing, leaving, and of air between them."""

    onward: list[list[tuple[int, float]]]
    passing: list[float]
    again: list[float]
    landing: list[float]
    leaving: list[float]
    air: list[list[float]]


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
    count = len(net.branches)
    whole = (1 << count) - 1
    states = [_State(prices.landing[e] + (costs.first if (begin and e not in begin) or e in through else 0.0), e, 0, 0, 0, None, True)
              for e in range(2 * count)]
    states = [_covered(state, prices) for state in states]
    for _ in range(count - 1):
        states = _kept((after for state in states for after in _steps(net, state, prices, whole, costs)), width)
    done = [(state.cost + prices.leaving[state.arrived], state) for state in states]
    best = nsmallest(most, done, key=lambda one: one[0])
    return [Walk(_strokes(state), cost) for cost, state in best]


@dataclass(frozen=True, eq=False)
class _State:
    """A walk so far: its last step left a knot by `end`, after a lift or without one."""

    cost: float
    end: int
    covered: int
    twice: int
    thrice: int
    before: _State | None
    lifted: bool

    @property
    def arrived(self) -> int:
        return self.end ^ 1


def _covered(state: _State, prices: _Prices) -> _State:
    bit = 1 << (state.end >> 1)
    return _State(
        state.cost + prices.passing[state.end], state.end, state.covered | bit, state.twice, state.thrice, state.before, state.lifted
    )


def _steps(net: Network, state: _State, prices: _Prices, whole: int, costs: Costs) -> Iterator[_State]:
    """Walks that cover one branch more."""
    yield from _onward(net, state, prices, costs, _DEEP)
    left = whole & ~state.covered
    stop = state.cost + prices.leaving[state.arrived] + costs.lift
    air = prices.air[state.arrived]
    landings = []
    branch = 0
    while left:
        if left & 1:
            for end in (2 * branch, 2 * branch + 1):
                landings.append((stop + air[end] + prices.landing[end], end))
        left >>= 1
        branch += 1
    for cost, end in nsmallest(_LIFTS, landings):
        yield _covered(_State(cost, end, state.covered, state.twice, state.thrice, state, True), prices)


def _onward(net: Network, state: _State, prices: _Prices, costs: Costs, deep: int) -> Iterator[_State]:
    """Walks that go on to another branch without a lift, over covered ones if need be."""
    arrived = state.arrived
    for end, price in prices.onward[arrived]:
        bit = 1 << (end >> 1)
        if not state.covered & bit:
            yield _covered(_State(state.cost + price, end, state.covered, state.twice, state.thrice, state, False), prices)
        elif deep and not (state.thrice & bit and net.length[end >> 1] > _TINY):
            third = bit if state.twice & bit else 0
            cost = state.cost + price + prices.again[end] + (costs.third if third else 0.0)
            over = _State(cost, end, state.covered, state.twice | bit, state.thrice | third, state, False)
            yield from _onward(net, over, prices, costs, deep - 1)


def _kept(states: Iterator[_State], width: int) -> list[_State]:
    """The cheapest, of those in the same situation only a few."""
    kept: list[_State] = []
    often: dict[tuple[int, int, int, int], int] = {}
    for state in sorted(states, key=lambda one: one.cost):
        key = (state.end, state.covered, state.twice, state.thrice)
        if often.get(key, 0) < _ALIKE:
            often[key] = often.get(key, 0) + 1
            kept.append(state)
            if len(kept) == width:
                break
    return kept


def _strokes(state: _State | None) -> tuple[tuple[int, ...], ...]:
    strokes: list[list[int]] = []
    current: list[int] = []
    while state is not None:
        current.append(state.end)
        if state.lifted:
            strokes.append(current[::-1])
            current = []
        state = state.before
    return tuple(tuple(stroke) for stroke in strokes[::-1])


def _prices(
    net: Network, small: float, begin: Sequence[int], finish: Sequence[int], through: Sequence[int], costs: Costs
) -> _Prices:
    count = len(net.branches)
    run = net.length * (net.half / small)
    degree = {knot: len(ends) for knot, ends in net.at.items()}
    loose = {*begin, *finish, *through}  # where the letter is cut off, nobody turns
    onward = [
        [(b, _turn(net, a, b, degree[knot], costs) + _missed(net, a, b, costs)) for b in net.at[knot] if a != b or a not in loose]
        for a, knot in enumerate(net.knot.tolist())
    ]
    for a, b, price in _gaps(net, [e for e in range(2 * count) if degree[int(net.knot[e])] == 1 and e not in loose], costs):
        onward[a].append((b, price))
    passing = [_against(net, end, small, costs) for end in range(2 * count)]
    again = [costs.retrace + costs.retraced * float(run[e >> 1]) + passing[e] for e in range(2 * count)]
    at = [degree[knot] for knot in net.knot.tolist()]
    loops = [int(net.knot[e]) == int(net.knot[e ^ 1]) for e in range(2 * count)]
    landing = [0.0 if n == 1 else costs.passing if n == 2 and not loop else costs.landing for n, loop in zip(at, loops, strict=True)]
    leaving = [0.0 if n == 1 else costs.passing if n == 2 and not loop else costs.leaving for n, loop in zip(at, loops, strict=True)]
    for end in finish:
        landing[end] += costs.first
    for end in (*begin, *through):
        leaving[end] += costs.first
    places = np.array([net.place(e) for e in range(2 * count)])
    away = places[None] - places[:, None]
    # back to the left a pen goes only for what it has left out
    air = costs.jump * (np.hypot(away[..., 0], away[..., 1]) + np.maximum(-away[..., 0], 0)) / small
    return _Prices(onward, passing, again, landing, leaving, air.tolist())


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
                yield a, b, costs.gap * far / costs.gap_far + costs.turn * ((1 - straight) / 2) ** 1.5


def _turn(net: Network, arrived: int, end: int, degree: int, costs: Costs) -> float:
    """Of arriving by one end and leaving by another of the same knot."""
    if arrived == end:
        return costs.tip if degree == 1 else costs.corner if degree == 2 else costs.turn
    straight = -float(net.leaving[arrived] @ net.leaving[end])  # cosine of the turn
    return costs.turn * ((1 - straight) / 2) ** 1.5


def _missed(net: Network, arrived: int, end: int, costs: Costs) -> float:
    """Of not going straight on where two lines cross."""
    ends = net.at[int(net.knot[arrived])]
    if len(ends) < 4:
        return 0.0
    ahead = max((e for e in ends if e != arrived), key=lambda e: -float(net.leaving[arrived] @ net.leaving[e]))
    back = max((e for e in ends if e != ahead), key=lambda e: -float(net.leaving[ahead] @ net.leaving[e]))
    straight = -float(net.leaving[arrived] @ net.leaving[ahead])
    return costs.cross * max(0.0, straight) if back == arrived and end != ahead else 0.0


def _against(net: Network, end: int, small: float, costs: Costs) -> float:
    """Of passing a branch in a direction that is not the habitual one."""
    way: Array = net.xy[net.way(end)]
    if len(way) < 2:
        return 0.0
    step = np.diff(way, axis=0)
    size = np.hypot(step[:, 0], step[:, 1])
    # down and to the right costs nothing
    along = (step @ np.array([0.5, -0.866])) / np.maximum(size, 1e-12)
    return float(costs.against * (size * (1 - along) / 2).sum() / small)
