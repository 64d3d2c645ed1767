"""Which segments of a brush's ribbons make a stroke: the cheapest row of them along its path.

What a segment costs in its place: how far from head and tail it was painted, how its spine bent, and how much of the
paper it covers in how many streaks, against those of a *guide*, one of the ribbons laid out over the whole stroke.  So
a stroke runs dry as a real one does; without it the cheapest rows are solid ink, whose borders all fit.  What one
costs after another: how their ink and their edges differ at the border.  The row is found but for what comes again,
which every survivor of the search has to pay for, and for ways from survivors that cost much more than others.

Source: seed 004, eq. 1–10 (each pair of neighbours counted once); the guide, the costs of repeating: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.chains import viterbi
from handout.inking.brush.ribbon import SEGMENTS, Ribbon
from handout.values import Array, Indices
from handout.writing.choosing import fading_cost

_Costs = NDArray[np.floating[Any]]  # float32 in fact, for speed

_NEAR = 1.0  # widths from an end within which the distance from it matters, a Gaussian's deviation
_TIP, _INSIDE = 0.5, 1.0  # widths from an end whose ink is shaped by landing or leaving; what it costs inside a stroke
_END, _BEND, _COVER, _STREAKS = 1.0, 0.1, 1.5, 1.0  # weights of what a segment costs
_COLOUR, _WIDTH = 6.0, 3.0  # weights of what a border costs
_CUT = 0.3  # of any border that is not a ribbon's own
WITHIN = 8  # segments within which nothing should come again
_AGAIN = 12.0  # cost of a segment at once after itself
_SEEN = 32  # segments until a stroke may show one again at no cost
# cost of a segment that the strokes before have just used; segments until it is as new: on three lots of twelve strokes
# painted from eight, a stroke shares .59 of its segments with the one most like it, .69 at .25 and 96 and with
# guides forgotten sooner; more makes more joints
_LATELY, _FORGOTTEN = 0.5, 300
# of a place, from which all segments of the next are reached; repeats within 32 segments were no more than with all
# (.0028 and .019 for .0028 and .022)
_SURVIVORS = 32
_CHANCE = 0.1  # of the perturbation by which two strokes differ
_LENGTH = 2.0  # how much rather a stroke is guided by one of its own length
_WET = 3.5 * SEGMENTS  # segments: much shorter strokes are rather guided by those that cover well from the start
_ALIKE = (0.15, 2.5)  # in cover, in streaks: segments that differ by less from what a guide asks for can follow it
_PRESSED = 12.0  # exponent of the cover at full pressure; set by eye
_STRICT = 8  # exponent of what can be followed: rare dry segments that take turns with wet ones look like beads
_ANY = 1e-6  # of the likeliest guide's chance
_FADING = 0.9  # of how lately a guide was followed, a stroke


@dataclass(frozen=True, eq=False)
class Target:
    """The stroke that is to be painted.

    bend : (m,) float: turning of its path in each segment, rad a width.
    cover, streaks : (m,) float: of each segment, as `Ribbon` has them.
    """

    bend: Array
    cover: Array
    streaks: Array


class _Walk:
    """The steps of a stroke, in which every survivor remembers what it showed: what it shows again costs.

    One chain is solved with it, from its beginning; the costs of borders are (n, n), of numbers `same` (n,).
    """

    def __init__(self, borders: _Costs, same: Indices) -> None:
        self._borders, self._same, self._every = borders, same, np.arange(len(same))
        # of each survivor the place where it showed each number last
        self._shown = np.full((len(same), int(same.max()) + 1), -_SEEN, np.int32)
        self._shown[self._every, same] = 0
        self._next = np.empty_like(self._shown)
        self._own = borders.argmin(axis=0)  # of each segment that which it follows at least cost
        self._follow = borders[self._own, self._every]
        self._origins = list[Indices]()

    def totals(self, costs: _Costs) -> Array:
        """As `chains.ChainStep`, from the cheapest survivors, and from that which goes on in its own photograph."""
        place = len(self._origins)
        few = np.argpartition(costs, _SURVIVORS)[:_SURVIVORS] if len(costs) > _SURVIVORS else self._every
        again = self._cost_again(np.take(self._shown, few, axis=0), place)
        total = np.take(again, self._same, axis=1)
        total += np.take(self._borders, few, axis=0)
        total += costs[few, None]
        best = total.argmin(axis=0)
        on = self._cost_again(self._shown[self._own, self._same], place) + self._follow + costs[self._own]
        least = total[best, self._every]
        origin = np.where(on <= least, self._own, few[best])
        self._origins.append(origin)
        np.take(self._shown, origin, axis=0, out=self._next, mode="clip")
        self._next[self._every, self._same] = place + 1
        self._shown, self._next = self._next, self._shown
        return np.asarray(np.minimum(on, least))

    @staticmethod
    def _cost_again(shown: NDArray[np.int32], place: int) -> _Costs:
        """What it costs to show again after a place what was shown last at others."""
        return np.asarray(
            np.maximum(np.float32(_AGAIN) - np.float32(_AGAIN / _SEEN) * (place - shown).astype(np.float32), 0)
        )

    def origin(self, costs: _Costs, state: int) -> int:
        """As `chains.ChainStep`; asked from the last place to the first."""
        return int(self._origins.pop()[state])


@dataclass(frozen=True, eq=False)
class Library:
    """The segments of some ribbons and of their mirror images, one after the other, and what choosing among them costs.

    ribbons : the ribbons, each followed by its mirror image.
    """

    ribbons: tuple[Ribbon, ...]

    @classmethod
    def from_ribbons(cls, ribbons: Sequence[Ribbon]) -> Library:
        """The library of some ribbons."""
        return cls(tuple(each for ribbon in ribbons for each in (ribbon, ribbon.mirror())))

    @cached_property
    def ribbon(self) -> Indices:
        """(n,): of each segment its ribbon."""
        return np.repeat(np.arange(len(self.ribbons)), [len(each) for each in self.ribbons])

    @cached_property
    def place(self) -> Indices:
        """(n,): of each segment its number in its ribbon."""
        return np.concatenate([np.arange(len(each)) for each in self.ribbons])

    @cached_property
    def segment_numbers(self) -> Indices:
        """(n,): one number for a segment and its mirror image."""
        start = np.cumsum([0] + [len(each) for each in self.ribbons[::2]])
        return np.asarray(start[self.ribbon // 2] + self.place)

    def _gather_all(self, name: str) -> Array:
        return np.concatenate([getattr(each, name) for each in self.ribbons])

    @cached_property
    def cover(self) -> Array:
        """(n,): of each segment, as its ribbon has it."""
        return self._gather_all("cover")

    @cached_property
    def streaks(self) -> Array:
        """(n,): of each segment, as its ribbon has them."""
        return self._gather_all("streaks")

    @cached_property
    def _features(self) -> tuple[Array, Array, Array]:
        """Bend, cover and streaks (n,)."""
        return self._gather_all("bend"), self.cover, self.streaks

    @cached_property
    def _scales(self) -> tuple[float, float, float]:
        """Spread of the three features among the segments, so that they count alike."""
        bend, cover, streaks = (max(float(values.std()), 1e-3) for values in self._features)
        return max(bend, 0.2), max(cover, 0.05), max(streaks, 0.5)

    @cached_property
    def borders(self) -> Array:
        """(n, n): cost of each segment after each other one; none for one that follows in its own ribbon.

        Source: seed 004, eq. 7.
        """
        after, before = self._inks
        colour = _distances(before, after) / before.shape[1]
        widths = [np.concatenate([each.widths[part] for each in self.ribbons]) for part in (np.s_[1:], np.s_[:-1])]
        edge = _distances(*widths)
        cost = _COLOUR * colour / max(float(colour.mean()), 1e-6) + _WIDTH * edge / max(float(edge.mean()), 1e-6)
        cost += _CUT
        on = np.flatnonzero(np.diff(self.ribbon) == 0)
        cost[on, on + 1] = 0
        return np.asarray(cost)

    @cached_property
    def _inks(self) -> tuple[Array, Array]:
        """(n, ROWS · 4) each: the ink at each segment's beginning, and at its end."""
        parts = (np.s_[:-1], np.s_[1:])
        first, last = (np.concatenate([each.borders[part] for each in self.ribbons]) for part in parts)
        return first.reshape(len(first), -1), last.reshape(len(last), -1)

    @cached_property
    def _cut_off(self) -> Array:
        """(2, n): cost of each segment as the first, and as the last: of a border with nothing."""
        ends = np.stack([(ink**2).mean(axis=1) for ink in self._inks])
        return np.asarray(_COLOUR * ends / max(float(ends.mean()), 1e-6))

    @cached_property
    def _counts_alike(self) -> tuple[Array, Array]:
        """(n,) each: how many segments are like each, in the library and in its own ribbon; mirror images left out."""
        feature = np.stack([self.cover / _ALIKE[0], self.streaks / _ALIKE[1]])
        apart = np.hypot(*(feature[:, :, None] - feature[:, None, :]))
        own = self.ribbon[:, None] == self.ribbon
        return (apart < 1).sum(axis=1) / 2, ((apart < 1) & own).sum(axis=1)

    def rate_guides(self, count: int) -> Array:
        """(ribbons,) in 0–1: how well each can guide a stroke of so many segments without repeating what is rare.

        What a guide has of a kind is asked for as often as it is stretched, but comes again after `_SEEN` segments.
        """
        length = np.array([len(each) for each in self.ribbons])
        have, own = self._counts_alike
        share = np.minimum(1, have / np.minimum(_SEEN, own * count / length[self.ribbon]))
        return np.asarray(np.bincount(self.ribbon, share) / length)

    def target(self, bend: Array, guide: Ribbon) -> Target:
        """What is wanted of a stroke of so many bends (m,): its ends as the guide's ends, the rest stretched."""
        m, n = len(bend), len(guide)
        end = min(m, n) / 3
        # a brush that is lifted early is still wet: of a longer guide the dry part is left out
        dry = n - end if m > n else m - end
        at = np.interp(np.arange(m) + 0.5, [0, end, m - end - 1e-6, m - end, m], [0, end, dry, n - end, n])
        middle = np.arange(n) + 0.5
        return Target(bend, np.interp(at, middle, guide.cover), np.interp(at, middle, guide.streaks))

    def costs(self, target: Target) -> Array:
        """(m, n): cost of each segment in each place. Source: seed 004, eq. 8 and 9."""
        m = len(target.bend)
        length = np.array([len(each) for each in self.ribbons])[self.ribbon]
        at = np.arange(m)[:, None]
        cost: Array = np.zeros((m, len(self.place)))
        reach = min(_NEAR * SEGMENTS, m / 3)
        for wanted, have in ((at, self.place), (m - 1 - at, length - 1 - self.place)):
            apart = ((wanted - have) / reach) ** 2
            cost += _END * np.exp(-((wanted / reach) ** 2) / 2) * apart
            cost += _END * np.exp(-((have / (_TIP * SEGMENTS)) ** 2) / 2) * np.minimum(apart, _INSIDE)
        cost[0] += self._cut_off[0]
        cost[-1] += self._cut_off[1]
        wanted_of = (target.bend, target.cover, target.streaks)
        weights = (_BEND, _COVER, _STREAKS)
        for weight, asked, feature, scale in zip(weights, wanted_of, self._features, self._scales, strict=True):
            cost += weight * ((asked[:, None] - feature) / scale) ** 2
        return cost

    def energy(self, row: Indices, costs: Array) -> float:
        """Of a row of segments, with what each costs in its place, (m, n)."""
        return float(costs[np.arange(len(row)), row].sum() + self.borders[row[:-1], row[1:]].sum())

    def row(self, costs: Array) -> Indices:
        """(m,): the segments of a stroke: the cheapest, among which what came lately costs more."""
        walk = _Walk(self.borders.astype(np.float32), self.segment_numbers)
        return np.array(viterbi(list(costs.astype(np.float32)), [walk] * (len(costs) - 1)), dtype=np.intp)


class SegmentChooser:
    """Chooses the segments of a drawing, stroke by stroke; remembers what it used."""

    def __init__(self, library: Library, rng: np.random.Generator) -> None:
        self._library, self._rng = library, rng
        self._used = np.full(int(library.segment_numbers.max()) + 1, -float(_FORGOTTEN))
        self._painted, self._guided = 0, np.zeros(len(library.ribbons))

    def row(self, bend: Array, pressed: float = 0.0) -> Indices:
        """(m,): the segments of a stroke whose path bends so, with a guide of about its length.

        pressed : by how much harder than usual, −1 to 1: the harder, the rather are guides followed that cover well.
        """
        library, rng = self._library, self._rng
        lengths = np.array([len(each) for each in library.ribbons])
        near = np.exp(-_LENGTH * np.abs(np.log(len(bend) / lengths)) - self._guided)
        targets = [library.target(bend, guide) for guide in library.ribbons]
        cover = np.array([each.cover.mean() for each in targets])
        near *= cover ** ((_WET / len(bend)) ** 2 + _PRESSED * pressed) * library.rate_guides(len(bend)) ** _STRICT
        near += _ANY * near.max() + np.finfo(np.float64).tiny  # if none can be followed, each is as good
        guide = int(rng.choice(len(lengths), p=near / near.sum()))
        self._guided *= _FADING
        self._guided[[guide, guide ^ 1]] += 1
        costs = library.costs(targets[guide])
        costs += _CHANCE * rng.gumbel(size=costs.shape)
        costs += fading_cost(self._painted - self._used, _LATELY, _FORGOTTEN)[library.segment_numbers]
        row = library.row(costs)
        self._used[library.segment_numbers[row]] = self._painted + np.arange(len(row))
        self._painted += len(row)
        return row


def count_since_same(same: Indices) -> Indices:
    """(m,): for each place of a row how many places before the same came last; a huge number where it never did."""
    last, age = dict[int, int](), np.full(len(same), np.iinfo(np.intp).max)
    for at, one in enumerate(same.tolist()):
        age[at] = at - last.get(one, -len(age) - _FORGOTTEN)
        last[one] = at
    return age


def _distances(a: Array, b: Array) -> Array:
    """(n, n): squares of the distances of rows (n, d)."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    return np.asarray(np.maximum((a**2).sum(1)[:, None] - 2 * a @ b.T + (b**2).sum(1), 0))
