"""Ways of a pen over all branches of a network, those first that cost a hand the least.

A walk is built branch by branch: each step covers one more, reached by going on, by retracing what is covered already,
or by lifting the pen.  So all walks of as many steps cover equally much and can be compared, and only so many of
them are followed: the effort is linear in the branches.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf
from operator import itemgetter
from typing import TypeAlias

from handout.motion.recovery.guide import Guide
from handout.motion.recovery.network import Network
from handout.motion.recovery.prices import USUAL, Costs, Prices
from handout.motion.recovery.prices import prices as prices_of

_WIDTH = 32  # walks that are followed
_GUIDED = 4  # where a form is followed
_ALIKE = 3  # of them that have covered the same and stand at the same place
_LIFTS = 6  # places where a lifted pen may land
_DEEP = 4  # branches that are retraced in one go
_ROUNDED = 1e-9  # costs that differ less may be equal


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
    prices = prices_of(net, small, begin, finish, through, costs)
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
    prices = prices_of(net, small, begin, finish, (), costs)
    first = [costs.first if begin and end not in begin else 0.0 for end in range(len(net.knot))]
    found = {strokes for guide in guides for _, strokes in _search(_swayed(prices, guide), first, costs, most, width)}
    return [Walk(strokes, _cost(strokes, prices, first, costs)) for strokes in sorted(found)]


def _search(
    prices: Prices, first: Sequence[float], costs: Costs, most: int, width: int
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


def _swayed(prices: Prices, guide: Guide) -> Prices:
    """What movements cost with a guide."""
    passing, onward, air = guide.passing.tolist(), guide.onward.tolist(), guide.air.tolist()
    return replace(
        prices,
        onward=[[(b, price + onward[a ^ 1][b]) for b, price in some] for a, some in enumerate(prices.onward)],
        passing=[price + more for price, more in zip(prices.passing, passing, strict=True)],
        again=[price + more for price, more in zip(prices.again, passing, strict=True)],
        air=[sorted((price + air[a ^ 1][b], b) for price, b in some) for a, some in enumerate(prices.air)],
    )


def _cost(strokes: Sequence[Sequence[int]], prices: Prices, first: Sequence[float], costs: Costs) -> float:
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


def _steps(state: _State, prices: Prices, costs: Costs, found: list[_State], bound: float) -> None:
    """Walks that cover one branch more and cost no more than a bound, added to those found."""
    cost, end, covered, twice, thrice, _, _ = state
    if cost <= bound:
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


def _onward(state: _State, prices: Prices, costs: Costs, found: list[_State], deep: int, most: float) -> None:
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
