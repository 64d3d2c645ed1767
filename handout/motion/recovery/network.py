"""A line graph as what a pen can do on it: branches between nodes, and what each movement over them costs a hand.

Every branch has two ends: end 2 b is where branch b begins, end 2 b + 1 where it ceases.  A pen that leaves a node by
an end arrives at the next node by the other end of that branch, `end ^ 1`.  Lengths are in half widths of the line.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from handout.branching import branches
from handout.values import Array, Indices

Complexes: TypeAlias = NDArray[np.complex128]

SHORT = 5.0  # half widths: so short a branch is a crossing drawn out, and may be passed at any time
_NEAR, _FAR = 1.4, 8.0  # half widths from a node between which a branch shows its direction
_BENT = 0.51  # how far the turn of the branch beyond is carried on into the node
_MOST_BENT = 0.6  # rad
_AHEAD = 0.5  # cosine: a gap left by failing ink lies along the way
_BESIDE = 2.5  # half widths: over so small a gap the pen may go on in any direction
_RING = 8  # vertices: a smaller ring is a dot
_SEAM = 0.06  # of a ring, to either side, that tells whether it was closed there
_MARKED = 1.0  # log odds by which a seam at the top of a ring stands out …
_BEGUN = 3.0  # … and more, as it lies lower: people begin rings above; pens that go slowly darken the lower left, too
_FAINT = 0.05  # of the usual density: less ink tells no more
_HABITUAL = np.array([0.5, -0.866])  # direction in which writing costs nothing: down and to the right


@dataclass(frozen=True)
class InkWeights:
    """Log odds that the pen passed a branch more than once, from the ink along it, over the odds without it.

    The slopes were fitted to the branches of two simulated pages whose strokes are known (area under the curve .85 and
    .88; for long branches .91 and .96); recorded pens, inked, give about the same.  `least` was set on recorded words.
    """

    base: float = -0.3
    wide: float = 7.0  # for the logarithm of the width over the usual one
    dark: float = 5.0  # for that of the density
    most: float = 3.0  # for more than once …
    least: float = -0.7  # … and for once: who goes back on the same line leaves it no wider
    clear: float = 1.5  # half widths from a node within which the ink is also that of other branches
    short: float = 3.0  # half widths: the ink of a branch up to this long tells nothing …
    long: float = 12.0  # … and from this length on all that it can


_INK = InkWeights()


@dataclass(frozen=True, eq=False)
class BranchNetwork:
    """Branches between nodes.

    xy : (n, 2) float, vertices, y up, in any unit.
    radius, density : (n,) float.
    half_width : half the usual width of the line, in that unit.
    branches : vertices in order along each, both nodes included; a dot is a branch of one vertex.
    node : (2 b,) int: the node at each end.
    length : (b,) float, half widths.
    leaving : (2 b, 2) float: unit vector in which the pen leaves the node by each end.
    usual : radius and density of the line where the pen passes once.
    """

    xy: Array
    radius: Array
    density: Array
    half_width: float
    branches: tuple[Indices, ...]
    node: Indices
    length: Array
    leaving: Array
    usual: tuple[float, float]

    @cached_property
    def retrace_odds(self) -> Array:
        """(b,) float: log odds, by its ink, that each branch was passed more than once; they are costs as they are."""
        return np.array([self._find_retrace_odds(b) for b in range(len(self.branches))])

    def _find_retrace_odds(self, branch: int) -> float:
        long = min(max((float(self.length[branch]) - _INK.short) / (_INK.long - _INK.short), 0.0), 1.0)
        path = self.branches[branch]
        # vertices are about evenly apart
        margin = round(_INK.clear / float(self.length[branch]) * len(path)) if long else 0
        inner = path[margin : len(path) - margin]
        if not long or not len(inner):
            return 0.0
        odds = _INK.base + float(self.ink_odds(inner).mean())
        return long * min(max(odds, _INK.least), _INK.most)

    def ink_odds(self, vertices: Indices) -> Array:
        """(n,) float: what the ink at some vertices adds to the log odds that the pen passed them more than once."""
        radius, density = self.usual
        wide = np.log(self.radius[vertices] / radius)
        dark = np.log(np.maximum(self.density[vertices] / max(density, _FAINT), _FAINT))
        return np.asarray(_INK.wide * wide + _INK.dark * dark)

    @cached_property
    def ends_at(self) -> dict[int, list[int]]:
        """Node → ends that meet there."""
        meeting: dict[int, list[int]] = {}
        for end, node in enumerate(self.node.tolist()):
            meeting.setdefault(node, []).append(end)
        return meeting

    def is_loose(self, end: int) -> bool:
        """Whether only this branch meets the node at an end."""
        return len(self.ends_at[int(self.node[end])]) == 1

    def is_crossing(self, end: int) -> bool:
        """Whether the branch of an end is no more than a crossing drawn out."""
        return bool(self.length[end >> 1] < SHORT) and not self.is_loose(end) and not self.is_loose(end ^ 1)

    def vertices_from(self, end: int) -> Indices:
        """Vertices of a branch in the order in which the pen passes them that leaves by an end."""
        vertices = self.branches[end >> 1]
        return vertices[::-1] if end & 1 else vertices

    @cached_property
    def _extents(self) -> list[tuple[float, float, float]]:
        extents = []
        for path in self.branches:
            x, y = self.xy[path].T
            low, high, twice = float(y.min()), float(y.max()), float(x[:-1] @ y[1:] - x[1:] @ y[:-1])
            extents += [(low, high, twice), (low, high, -twice)]
        return extents

    def extent(self, end: int) -> tuple[float, float, float]:
        """Lowest and highest y of a branch, and twice the area that it sweeps seen from (0, 0), left by an end."""
        return self._extents[end]

    def position(self, end: int) -> Array:
        """(2,): where an end is."""
        return np.asarray(self.xy[self.branches[end >> 1][-1 if end & 1 else 0]])


def build_network(
    xy: Array,
    radius: Array,
    density: Array,
    edges: Indices,
    half_width: float | None = None,
    usual: tuple[float, float] | None = None,
) -> BranchNetwork:
    """The branches of a line graph.

    xy, radius, density, edges : as in `values.LineGraph`, y up.
    half_width : half the usual width of the line; default: the median radius.
    usual : as in `BranchNetwork`; default: the medians.
    """
    usual = usual or (float(np.median(radius)), float(np.median(density)))
    half = half_width if half_width is not None else float(np.median(radius))
    paths = branches(edges, len(xy))
    places = as_complex(xy)
    whole = BranchNetwork(
        xy, radius, density, half, (), np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros((0, 2)), usual
    )
    return _with_branches(whole, paths, [_measure(places[path], half) for path in paths])


def subnetwork(net: BranchNetwork, keep: Sequence[int], cuts: Sequence[int] = ()) -> BranchNetwork:
    """Some branches of a network, with further nodes at the vertices `cuts`."""
    if not cuts:
        ends = np.array([e for b in keep for e in (2 * b, 2 * b + 1)], dtype=np.intp)
        branches = tuple(net.branches[b] for b in keep)
        rows = list(keep)
        return replace(net, branches=branches, node=net.node[ends], length=net.length[rows], leaving=net.leaving[ends])
    places, paths, measures = as_complex(net.xy), list[Indices](), list[tuple[float, Array]]()
    for b in keep:
        path = net.branches[b]
        closed = len(path) > 1 and path[0] == path[-1] and len(net.ends_at[int(path[0])]) == 2
        parts = _cut_path(path, cuts, closed)
        paths += parts
        if len(parts) == 1 and parts[0] is path:
            measures.append((float(net.length[b]), net.leaving[2 * b : 2 * b + 2]))
        else:
            measures += [_measure(places[part], net.half_width) for part in parts]
    return _with_branches(net, paths, measures)


def _with_branches(
    net: BranchNetwork, paths: Sequence[Indices], measures: Sequence[tuple[float, Array]]
) -> BranchNetwork:
    """A network with other branches, measured."""
    nodes = np.array([path[side] for path in paths for side in (0, -1)], dtype=np.intp)
    length = np.array([length for length, _ in measures])
    leaving = np.concatenate([np.zeros((0, 2)), *(directions for _, directions in measures)])
    return replace(net, branches=tuple(paths), node=nodes, length=length, leaving=leaving)


def ring_seams(net: BranchNetwork, among: Sequence[int]) -> dict[int, set[int]]:
    """Where rings that meet no other branch were begun and ended: vertex → all of its ring.

    A pen that closes an o goes a little over its own beginning: the ink is wider and darker there than elsewhere.
    """
    seams = dict[int, set[int]]()
    for path in (net.branches[b] for b in among):
        if path[0] != path[-1] or len(path) <= _RING or len(net.ends_at[int(path[0])]) != 2:
            continue
        ring = path[:-1]
        ink = net.ink_odds(ring)
        reach = max(1, round(_SEAM * len(ring)))
        smooth = np.convolve(np.concatenate([ink[-reach:], ink, ink[:reach]]), np.ones(2 * reach + 1), "valid")
        smooth /= 2 * reach + 1
        best = int(smooth.argmax())
        usual = float(np.median(smooth))
        right, up = net.xy[ring[best]] - net.xy[ring].mean(axis=0)
        low = 1 - up / max(float(np.hypot(right, up)), 1e-9)
        if smooth[best] > usual + _MARKED + _BEGUN * low:
            thin = np.roll(smooth < (smooth[best] + usual) / 2, -best)
            first, last = int(thin[::-1].argmax()), int(thin.argmax())
            for vertex in (ring[best - first], ring[(best + last) % len(ring)]):
                seams[int(vertex)] = set(path.tolist())
    return seams


def as_complex(xy: Array) -> Complexes:
    """(n,) complex, of places (n, 2)."""
    return np.ascontiguousarray(xy, dtype=np.float64).view(np.complex128)[:, 0]


def chain_vertices(net: BranchNetwork, chain: Sequence[int]) -> Indices:
    """Vertices along some ends, by which the pen leaves one node after the other; over gaps, too."""
    paths = [net.vertices_from(end) for end in chain]
    return np.concatenate([paths[0], *(b[1:] if b[0] == a[-1] else b for a, b in pairwise(paths))])


def _measure(places: Complexes, half_width: float) -> tuple[float, Array]:
    """Length of a branch, half widths, and (2, 2) the directions in which the pen leaves by its two ends."""
    step = places[1:] - places[:-1]
    run = np.zeros(len(places))
    np.hypot(step.real, step.imag).cumsum(out=run[1:])
    whole = float(run[-1])
    ahead = _direction(places, run, half_width)
    return whole / half_width, np.array([ahead, _direction(places[::-1], whole - run[::-1], half_width)])


def _cut_path(path: Indices, cuts: Sequence[int], closed: bool) -> list[Indices]:
    """Cut a path at some of its vertices; a closed path, which has no node, is opened at the first of them."""
    inside = [i for i in range(1, len(path) - 1) if path[i] in cuts]
    if not inside:
        return [path]
    if closed and path[0] not in cuts:
        opened = np.concatenate([path[inside[0] : -1], path[: inside[0] + 1]])
        return _cut_path(opened, cuts, closed=False)
    bounds = [0, *inside, len(path) - 1]
    return [path[a : b + 1] for a, b in pairwise(bounds)]


def _direction(places: Complexes, run: Array, half_width: float) -> tuple[float, float]:
    """The direction in which a path leaves its first vertex, seen beyond the ink that it shares there with others."""
    whole = float(run[-1])
    if whole < 1e-9:
        return 0.0, 0.0
    reaches = (_NEAR, 0.3), (_FAR, 0.7), (2 * _FAR - _NEAR, 1.0)
    far = [min(reach * half_width, share * whole) for reach, share in reaches]
    a, b, c = np.interp(far, run, places).tolist()
    near, beyond = cmath.phase(b - a), cmath.phase(c - b)
    turn = (near - beyond + math.pi) % (2 * math.pi) - math.pi
    angle = near + min(max(_BENT * turn, -_MOST_BENT), _MOST_BENT)
    return math.cos(angle), math.sin(angle)


@dataclass(frozen=True)
class CostWeights:
    """What movements cost a hand; a right angle turned at a node costs about half of `turn`.

    The figures were found by random search on pages of the simulated author and on recorded letters, such that the
    share of strokes recovered and that of words all right were greatest; `benchmarks.order_search` searches anew.
    `third` was lowered since, when the ink began to tell of retracing, on recorded words.
    """

    turn: float = 1.6  # of turning back at a node
    corner: float = 0.8  # of turning back in a bend where forms of the letter turn
    tip: float = 0.71  # of turning back at a loose end
    cross: float = 1.0  # more, of not going straight on where two lines cross
    retrace: float = 0.18  # of passing a branch once more
    retraced: float = 0.28  # and for each x-height of that
    third: float = 0.1  # more, of passing it a third time
    lift: float = 4.2  # of lifting the pen
    after: float = 2.0  # more, where it has left for the next letter
    landing: float = 0.59  # of setting the pen down where other strokes pass
    leaving: float = 0.9  # of lifting it there
    passing: float = 0.92  # of either in the middle of a branch
    jump: float = 0.25  # for each x-height that the pen goes in the air
    against: float = 0.46  # for each x-height that is written against the habit, up and to the left
    first: float = (
        1.97  # of beginning elsewhere than where the pen comes from the letter before, or of going back there
    )
    gap: float = 1.5  # of going on over a gap in the ink of `gap_far`
    gap_far: float = 9.4  # half widths, the widest gap


WEIGHTS = CostWeights()


@dataclass(frozen=True)
class Ends:
    """Ends of a network at loose nodes where a letter is cut off from others, so that no pen turns there.

    entries, exits : where the pen comes from the letter before, and where it goes to the next.
    bar_entries : where a delayed stroke of another letter comes in.
    """

    entries: Sequence[int] = ()
    exits: Sequence[int] = ()
    bar_entries: Sequence[int] = ()


NO_ENDS = Ends()


@dataclass(frozen=True, eq=False)
class EdgeCosts:
    """What movements by the ends of a network cost.

    turning : for each end that the pen arrives at, those by which it may go on, and what turning there costs.
    passing, again, third : of the branch passed from each end, first and once more; and more for every further time.
    once : for each branch what is added in the end where it was passed once only.
    landing, leaving : of beginning and of ending a stroke.
    air : for each end where a stroke ends, the others with the cost of going there in the air and landing, cheapest
        first.
    crossings : bits of the branches that are no more than a crossing drawn out.
    exits : ends where the pen goes to the next letter.
    """

    turning: list[list[tuple[int, float]]]
    passing: list[float]
    again: list[float]
    third: list[float]
    once: list[float]
    landing: list[float]
    leaving: list[float]
    air: list[list[tuple[float, int]]]
    crossings: int
    exits: frozenset[int]


def edge_costs(net: BranchNetwork, x_height: float, ends: Ends, weights: CostWeights) -> EdgeCosts:
    """What movements over a network cost, see `traversal.beam_search`."""
    count = 2 * len(net.branches)
    run = net.length * (net.half_width / x_height)
    passing = _habit_costs(net, x_height, weights)
    told = net.retrace_odds.tolist()
    # what is wide is taken to be passed again until the end, so that no traversal is dropped that does so late
    once = [max(worth, 0.0) for worth in told]
    again = [
        weights.retrace + weights.retraced * float(run[e >> 1]) + passing[e] + max(-told[e >> 1], 0.0)
        for e in range(count)
    ]
    third = [weights.third - max(-worth, 0.0) for worth in told for _ in range(2)]
    passing = [cost - once[e >> 1] for e, cost in enumerate(passing)]
    landing, leaving = (_stroke_ends(net, weights.passing, other) for other in (weights.landing, weights.leaving))
    for end in ends.exits:
        landing[end] += weights.first
    for end in (*ends.entries, *ends.bar_entries):
        leaving[end] += weights.first
    # `EdgeCosts.air`
    places = net.xy[net.node]
    away = places[None] - places[:, None]
    # a pen goes back to the left only for what it has left out
    jump = weights.jump * (np.hypot(away[..., 0], away[..., 1]) + np.maximum(-away[..., 0], 0)) / x_height
    jump += np.array(landing)
    order = np.argsort(jump, axis=1, kind="stable")
    ranked = zip(np.take_along_axis(jump, order, axis=1).tolist(), order.tolist(), strict=True)
    air = [list(zip(row, ends, strict=True)) for row, ends in ranked]
    crossings = sum(1 << b for b in np.flatnonzero(net.length < SHORT).tolist())
    turning = _turning(net, {*ends.entries, *ends.exits, *ends.bar_entries}, weights)
    return EdgeCosts(turning, passing, again, third, once, landing, leaving, air, crossings, frozenset(ends.exits))


def _turning(net: BranchNetwork, cut_off: set[int], weights: CostWeights) -> list[list[tuple[int, float]]]:
    """`EdgeCosts.turning`; at the ends `cut_off` the pen does not turn back."""
    # cosines of the turns from each end to each other
    straight = np.negative(net.leaving @ np.ascontiguousarray(net.leaving.T)).tolist()
    turning = []
    for a, node in enumerate(net.node.tolist()):
        ends = net.ends_at[node]
        crossed = _crossing_costs(straight, a, ends, weights)
        turns = [(b, _turn(straight, a, b, len(ends), weights) + more) for b, more in zip(ends, crossed, strict=True)]
        turning.append([(b, cost) for b, cost in turns if a != b or a not in cut_off])
    loose = [e for e in range(len(net.node)) if net.is_loose(e) and e not in cut_off]
    for a, b, cost in _gap_costs(net, loose, weights):
        turning[a].append((b, cost))
    return turning


def _stroke_ends(net: BranchNetwork, passing: float, meeting: float) -> list[float]:
    """What beginning or ending a stroke costs at each end: nothing at a loose one, `passing` where only its own line
    goes on, else `meeting`."""
    nodes, costs = net.node.tolist(), []
    for end, node in enumerate(nodes):
        degree, loop = len(net.ends_at[node]), node == nodes[end ^ 1]
        costs.append(0.0 if degree == 1 else passing if degree == 2 and not loop else meeting)
    return costs


def _gap_costs(net: BranchNetwork, loose: Sequence[int], weights: CostWeights) -> Iterator[tuple[int, int, float]]:
    """Loose ends that a pen may go on between though it left no ink there: (arrived, end, cost), either way."""
    for a in loose:
        for b in loose:
            if a == b:
                continue
            way = net.position(b) - net.position(a)
            far = float(np.hypot(*way)) / net.half_width
            if far > weights.gap_far or far < 1e-9:
                continue
            aim = way / (far * net.half_width)
            straight = min(-float(net.leaving[a] @ aim), float(net.leaving[b] @ aim))
            if straight > _AHEAD or far < _BESIDE:
                yield a, b, weights.gap * far / weights.gap_far + weights.turn * (max(0.0, 1 - straight) / 2) ** 1.5


def _turn(straight: Sequence[Sequence[float]], arrived: int, end: int, degree: int, weights: CostWeights) -> float:
    """Cost of arriving at a node by one end and leaving it by another."""
    if arrived == end:
        return weights.tip if degree == 1 else weights.corner if degree == 2 else weights.turn
    return float(weights.turn * (max(0.0, 1 - straight[arrived][end]) / 2) ** 1.5)


def _crossing_costs(
    straight: Sequence[Sequence[float]], arrived: int, ends: Sequence[int], weights: CostWeights
) -> list[float]:
    """Cost of leaving a crossing of two lines by each end without going straight on; 0 at other nodes."""
    free = [0.0] * len(ends)
    if len(ends) < 4:
        return free
    ahead = max((e for e in ends if e != arrived), key=straight[arrived].__getitem__)
    back = max((e for e in ends if e != ahead), key=straight[ahead].__getitem__)
    if back != arrived:
        return free
    cost = weights.cross * max(0.0, straight[arrived][ahead])
    return [0.0 if end == ahead else cost for end in ends]


def _habit_costs(net: BranchNetwork, x_height: float, weights: CostWeights) -> list[float]:
    """Cost of passing each branch, left by each of its ends, against the habitual direction of writing."""
    costs: list[float] = []
    for path in net.branches:
        way: Array = net.xy[path]
        if len(way) < 2:
            costs += [0.0, 0.0]
            continue
        step = way[1:] - way[:-1]
        size = np.hypot(step[:, 0], step[:, 1])
        along = (step @ _HABITUAL) / np.maximum(size, 1e-12)
        there, back = size * (1 - along) / 2, size * (1 + along) / 2
        costs += [float(weights.against * sums / x_height) for sums in (there.sum(), back[::-1].copy().sum())]
    return costs
