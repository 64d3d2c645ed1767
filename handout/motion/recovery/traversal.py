"""Traversals: ways of a pen over all branches of a network, found by a beam search, those first that cost a hand least.

A traversal is built branch by branch: each step covers one more, reached by going on, by retracing what is covered
already, or by lifting the pen.  So all traversals of as many steps cover equally much and can be compared, and only the
cheapest of them are followed: the effort is linear in the branches.  A guide changes what movements cost, so that the
search finds the traversal which a form of the letter would take: most others cost a hand about the same, and the one
that was written need not be among the cheapest.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf
from operator import itemgetter
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from handout.motion.recovery import letter_forms
from handout.motion.recovery.form_matching import directions
from handout.motion.recovery.network import (
    NO_ENDS,
    SHORT,
    WEIGHTS,
    BranchNetwork,
    CostWeights,
    EdgeCosts,
    Ends,
    edge_costs,
)
from handout.values import Array

_WIDTH = 32  # traversals that are followed
_GUIDED = 4  # where a form is followed
_ALIKE = 3  # traversals kept that have covered the same branches and stand at the same place
_LIFTS = 6  # places where a lifted pen may land
_DEEP = 7  # branches that are retraced in one go
_ROUNDED = 1e-9  # costs that differ less may be equal
_FREE = 5.0  # of going back, at the end, over a line whose ink does not tell of it; set on one writer's words
_PLACES = 6  # of a branch that are compared with a form

_Strokes: TypeAlias = tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class Traversal:
    """A way over all branches of a network.

    strokes : for each pen-down movement the ends by which the pen leaves one node after the other.
    cost : see `CostWeights`.
    crossbars : those of the strokes that are crossbars.
    """

    strokes: _Strokes
    cost: float
    crossbars: _Strokes = ()


def beam_search(
    net: BranchNetwork,
    x_height: float,
    ends: Ends = NO_ENDS,
    *,
    weights: CostWeights = WEIGHTS,
    most: int = 16,
    width: int = _WIDTH,
) -> list[Traversal]:
    """The cheapest traversals.

    x_height : in the unit of the network.
    ends : where the letter is cut off from others.
    most : how many traversals are given.
    width : how many are followed.
    """
    costs = edge_costs(net, x_height, ends, weights)
    first = _first_costs(net, ends, weights)
    return [Traversal(strokes, cost) for cost, strokes in _search(costs, first, weights, most, width)]


def guided_search(
    net: BranchNetwork,
    x_height: float,
    guides: Iterable[FormGuide],
    ends: Ends = NO_ENDS,
    *,
    weights: CostWeights = WEIGHTS,
) -> list[Traversal]:
    """The traversals that follow each of some guides best, with what they cost without a guide; see `beam_search`."""
    costs = edge_costs(net, x_height, ends, weights)
    first = _first_costs(net, ends, weights)
    guided = {
        strokes
        for guide in guides
        for _, strokes in _search(_with_guide(costs, guide), np.add(first, guide.first).tolist(), weights, 1, _GUIDED)
    }
    return [Traversal(strokes, _cost(strokes, costs, first, weights)) for strokes in sorted(guided)]


def _first_costs(net: BranchNetwork, ends: Ends, weights: CostWeights) -> list[float]:
    """What beginning by each end costs, besides landing there."""
    elsewhere = ((ends.entries and e not in ends.entries) or e in ends.bar_entries for e in range(len(net.node)))
    return [weights.first if other else 0.0 for other in elsewhere]


def _search(
    costs: EdgeCosts, first: Sequence[float], weights: CostWeights, most: int, width: int
) -> list[tuple[float, _Strokes]]:
    """The cheapest traversals and what they cost, the cheapest first."""
    states: list[_State] = []
    for end, more in enumerate(first):
        cost = costs.landing[end] + more + costs.passing[end]
        states.append((cost, end, 1 << (end >> 1), 0, 0, None, True))
    for _ in range(len(first) // 2 - 1):
        reached: list[_State] = []
        bound, look = inf, 2 * width
        for state in states:
            if len(reached) >= look:
                # what costs more than the last that is kept so far is not kept; nor is any of it looked at again
                reached = _cheapest(reached, width)
                bound = reached[-1][0] + _ROUNDED if len(reached) == width else inf
                look = len(reached) + width
            _steps(state, costs, weights, reached, bound)
        states = _cheapest(reached, width)
    doubtful = [(1 << branch, cost) for branch, cost in enumerate(costs.once) if cost]
    done = [
        (last[0] + costs.leaving[last[1] ^ 1] + sum(cost for bit, cost in doubtful if not last[3] & bit), last)
        for state in states
        for last in _ways_out(state, costs, _FREE)
    ]
    done.sort(key=itemgetter(0))
    return [(cost, _strokes(state)) for cost, state in done[:most]]


def _with_guide(costs: EdgeCosts, guide: FormGuide) -> EdgeCosts:
    """What movements cost with a guide."""
    passing, onward, air = guide.passing.tolist(), guide.onward.tolist(), guide.air.tolist()
    return replace(
        costs,
        turning=[[(b, cost + onward[a ^ 1][b]) for b, cost in ends] for a, ends in enumerate(costs.turning)],
        passing=[cost + more for cost, more in zip(costs.passing, passing, strict=True)],
        again=[cost + more for cost, more in zip(costs.again, passing, strict=True)],
        air=[sorted((cost + air[a ^ 1][b], b) for cost, b in ends) for a, ends in enumerate(costs.air)],
    )


def _cost(strokes: Sequence[Sequence[int]], costs: EdgeCosts, first: Sequence[float], weights: CostWeights) -> float:
    """What a traversal costs."""
    total, passed, before = 0.0, dict[int, int](), -1
    for stroke in strokes:
        total += first[stroke[0]] + costs.landing[stroke[0]] if before < 0 else 0.0
        if before >= 0:
            after = weights.after if before ^ 1 in costs.exits else 0.0
            total += weights.lift + after + next(cost for cost, e in costs.air[before ^ 1] if e == stroke[0])
        for step, end in enumerate(stroke):
            if step:
                total += next(cost for e, cost in costs.turning[before ^ 1] if e == end)
            often = passed.get(end >> 1, 0)
            total += (costs.again if often else costs.passing)[end] + (costs.third[end] if often > 1 else 0.0)
            passed[end >> 1] = often + 1
            before = end
        total += costs.leaving[before ^ 1]
    return total + sum(cost for branch, cost in enumerate(costs.once) if passed.get(branch, 0) < 2)


# a traversal so far: what it cost, the end by which its last step left a node, bits of the branches that it covered,
# passed twice and passed thrice, the traversal before that step, and whether the pen was lifted for it
_State: TypeAlias = "tuple[float, int, int, int, int, _State | None, bool]"


def _steps(state: _State, costs: EdgeCosts, weights: CostWeights, reached: list[_State], bound: float) -> None:
    """Adds to `reached` the traversals that cover one branch more and cost no more than a bound."""
    cost, end, covered, twice, thrice, _, _ = state
    if cost <= bound:
        most = min(cost + weights.lift + weights.landing + weights.leaving, bound)
        _go_on_unlifted(state, costs, weights, reached, _DEEP, most)
    for last in _ways_out(state, costs):
        cost, end, covered, twice, thrice, _, _ = last
        stop = cost + costs.leaving[end ^ 1] + weights.lift + (weights.after if end ^ 1 in costs.exits else 0.0)
        count = 0
        for air, landing in costs.air[end ^ 1]:
            if stop + air > bound:
                break
            bit = 1 << (landing >> 1)
            if not covered & bit:
                reached.append((stop + air + costs.passing[landing], landing, covered | bit, twice, thrice, last, True))
                count += 1
                if count == _LIFTS:
                    break


def _ways_out(state: _State, costs: EdgeCosts, free: float = 0.0) -> list[_State]:
    """A traversal before the pen is lifted, and after it has gone back where ink tells so or costs are under `free`."""
    found = [state]
    for before in found:
        cost, arrived, covered, twice, thrice, _, _ = before
        for end, turning in costs.turning[arrived ^ 1]:
            bit = 1 << (end >> 1)
            more = turning + costs.again[end] - costs.once[end >> 1]
            if covered & bit and not twice & bit and (more < 0 or cost - state[0] + more < free):
                found.append((cost + turning + costs.again[end], end, covered, twice | bit, thrice, before, False))
    return found


def _go_on_unlifted(
    state: _State, costs: EdgeCosts, weights: CostWeights, reached: list[_State], deep: int, most: float
) -> None:
    """Adds those that go on to another branch without a lift, over covered ones if need be, up to a cost of `most`."""
    cost, arrived, covered, twice, thrice, _, _ = state
    for end, turning in costs.turning[arrived ^ 1]:
        bit = 1 << (end >> 1)
        if not covered & bit:
            reached.append((cost + turning + costs.passing[end], end, covered | bit, twice, thrice, state, False))
        elif deep:
            after = cost + turning + costs.again[end]
            third = bit & twice
            if third:
                after += costs.third[end]
                if third & thrice and not costs.crossings & bit:
                    continue
            if after < most:
                over = (after, end, covered, twice | bit, thrice | third, state, False)
                _go_on_unlifted(over, costs, weights, reached, deep - 1, most)


def _cheapest(states: list[_State], width: int) -> list[_State]:
    """Keep the cheapest states, and only a few of those in the same situation."""
    cheapest: list[_State] = []
    often: dict[tuple[int, int, int, int], int] = {}
    states.sort(key=itemgetter(0))
    for state in states:
        situation = state[1:5]
        if often.get(situation, 0) < _ALIKE:
            often[situation] = often.get(situation, 0) + 1
            cheapest.append(state)
            if len(cheapest) == width:
                break
    return cheapest


def _strokes(last: _State) -> _Strokes:
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


@dataclass(frozen=True, eq=False)
class FormGuide:
    """What movements cost more, or less, where a form of the letter is followed.

    first : (2 b,) of beginning by each end.
    passing : (2 b,) of passing the branch that is left for by each end.
    onward, air : (2 b, 2 b) of passing one after another, without and with a lift.
    """

    first: Array
    passing: Array
    onward: Array
    air: Array


def form_guides(net: BranchNetwork, laid: Array, stroke_of: NDArray[np.intp]) -> Iterator[FormGuide]:
    """A guide for each of some forms.

    laid : (f, s, 2) float: forms of the letter, laid over it; stroke_of : (f, s) int: the stroke that each place is on.
    """
    weights = letter_forms.WEIGHTS
    count = 2 * len(net.branches)
    places = np.array([_evenly(net.xy[net.vertices_from(end)]) for end in range(count)])
    size = max(float(np.sqrt((places.reshape(-1, 2).std(axis=0) ** 2).sum())), 1e-9)
    share = np.repeat(net.length / max(float(net.length.sum()), 1e-9), 2)
    short = np.repeat(net.length < SHORT, 2)
    aims = directions(places)
    for form, stroke in zip(laid, stroke_of, strict=True):
        away = ((places[:, :, None] - form) ** 2).sum(axis=-1) / (size * weights.near) ** 2
        cost = away + weights.aimed * (1 - aims @ directions(form[None])[0].T)
        unlike, begin, end = _best_parts(cost, stroke)
        left_out = np.abs(np.vstack([begin, begin[None] - end[:, None] - 0.5])) / len(form)
        left_out[1:][short] = 0.0
        left_out[:, short] = 0.0
        first, *leaps = weights.left_out * np.minimum(left_out, weights.most_left_out)
        leap = np.array(leaps)
        parted = stroke[end][:, None] != stroke[begin][None]
        lifted = weights.guided_lift * parted
        yield FormGuide(first, weights.passed * share * unlike, leap + lifted, leap - lifted)


def _evenly(xy: Array) -> Array:
    """(`_PLACES`, 2): places at even distances on a path."""
    if len(xy) < 2:
        return np.repeat(xy, _PLACES, axis=0)
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    at = np.linspace(0.0, run[-1], _PLACES)
    return np.column_stack([np.interp(at, run, xy[:, k]) for k in (0, 1)])


def _best_parts(cost: Array, stroke: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """For each of some paths the part of one stroke of a form that it is most like: how unlike, first and last place.

    cost : (e, p, s): of each place of each path at each of the form.
    """
    count = cost.shape[2]
    total, first = cost[:, 0].copy(), np.tile(np.arange(count), (len(cost), 1))
    here = np.arange(count)
    barred = np.where((stroke[:, None] == stroke) & (here[:, None] <= here), 0.0, np.inf)  # before, after
    for place in range(1, cost.shape[1]):
        ways = total[:, :, None] + barred
        before = ways.argmin(axis=1)
        total = np.take_along_axis(total, before, axis=1) + cost[:, place]
        first = np.take_along_axis(first, before, axis=1)
    last = total.argmin(axis=1)
    rows = np.arange(len(cost))
    return total[rows, last] / cost.shape[1], first[rows, last], last
