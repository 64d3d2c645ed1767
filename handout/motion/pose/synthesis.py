"""How a pen would be held along a stroke, after strokes of a library that look alike.

For every sample of a stroke the nearest samples of the library are found by their features, exactly.  `closest` takes
the nearest of all, `average` the mean of the nearest, and `optimal` a sequence of a few long segments of the library's
strokes, the cheapest of all (`chains`): near in shape, with few jumps and none over a large difference in pose, no
segment short, beginning and ending where the library's strokes do.  Where it jumps, one segment fades into the next.

Source: seed 001, §4.2 and §4.3.1.  The weight of the features against the other costs is measured here, since the
source gives none; that a sample is repeated once only, and how long a segment has become, are part of the state,
without which the cheapest sequence would not be exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from handout.chains import viterbi
from handout.errors import InputError
from handout.motion import POSE_METHODS
from handout.motion.pose.features import FEATURES, Features, velocities
from handout.motion.pose.library import PoseLibrary
from handout.values import Array, Indices

_BLEND = 6  # samples on either side of a jump over which one segment fades into the next; the source's
_APART = 3  # numbers left free between strokes, so that no step of a segment leads from one into the next


@dataclass(frozen=True)
class PoseCosts:
    """What a sequence of library samples costs; the source's figures, but for `feature` and `jump`.

    feature : of a distance of 1 in the space of features.
    repeat, skip : of taking a library sample twice, or leaving one out.
    jump, change : of any other step, and of a difference of 1 in pose (or, for a trajectory, in direction) there.
    short, least : of a segment of fewer than `least` samples: (short + what it lacks)².
    end : of each sample between the ends of the stroke and of the library's strokes.
    """

    feature: float = 10.0
    repeat: float = 3.0
    skip: float = 3.0
    jump: float = 100.0
    change: float = 10.0
    short: float = 3.0
    least: int = 12
    end: float = 3.0


class PoseNeighbours(NamedTuple):
    """The samples of a library that are nearest to each of a stroke's in their features, the nearest first.

    distance : (n, k) float; number : (n, k) int.
    """

    distance: Array
    number: Indices


@dataclass(frozen=True, eq=False)
class PoseModel:
    """A library, ready for looking samples up.

    features : one of `FEATURES`.
    neighbours : samples of the library that are candidates for each of a stroke's.
    """

    library: PoseLibrary
    features: str = "velocities"
    neighbours: int = 20
    costs: PoseCosts = PoseCosts()

    @cached_property
    def _axes(self) -> Features:
        """(d, d): the features' principal axes, along which a tree is searched faster; distances stay as they are."""
        raw = self._compute_features().astype(np.float64)
        raw -= raw.mean(axis=0)
        return np.asarray(np.linalg.eigh(raw.T @ raw)[1], np.float32)

    def _compute_features(self) -> Features:
        return np.concatenate([FEATURES[self.features](xy) for xy, _ in self.library.strokes()])

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._compute_features() @ self._axes)

    @cached_property
    def directions(self) -> Array:
        """(n, 2): which way the library's pen goes at each sample, of length 1."""
        step = np.concatenate([velocities(xy) for xy, _ in self.library.strokes()])
        return np.asarray(step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-9))

    @cached_property
    def steps(self) -> Array:
        """(n, 2): the library's velocities, hand units a sample."""
        return np.concatenate([velocities(xy) for xy, _ in self.library.strokes()])

    def nearest(self, xy: Array) -> PoseNeighbours:
        """For a stroke (n, 2) in hand units, evenly sampled."""
        k = min(self.neighbours, len(self.library.xy))
        distance, number = self._tree.query(FEATURES[self.features](xy) @ self._axes, k)
        return PoseNeighbours(distance.reshape(len(xy), k), number.reshape(len(xy), k))

    def pose(self, xy: Array, method: str = "optimal") -> Array:
        """(n, c): the pose, as a point (`library.embed_channels`), along a stroke (n, 2) in hand units."""
        return self._apply_method(xy, self.library.pose, method)

    def movement(self, xy: Array, method: str = "optimal") -> Array:
        """(n, 2): velocities, hand units a sample, in the library's manner along a stroke (n, 2) in hand units."""
        return self._apply_method(xy, self.steps, method, turning=True)

    def _apply_method(self, xy: Array, values: Array, method: str, *, turning: bool = False) -> Array:
        """(n, c): of the library's `values` (m, c), what a method makes of those of the neighbours."""
        if method not in POSE_METHODS:
            raise InputError(f"method: {method!r} is unknown; use {', '.join(POSE_METHODS)}.")
        if method == "closest":
            return np.asarray(values[self.nearest(xy).number[:, 0]])
        if method == "average":
            near = self.nearest(xy)
            weight = 1.0 / np.maximum(near.distance, 1e-6)
            weight /= weight.sum(axis=1, keepdims=True)
            return np.asarray(np.einsum("nk,nkc->nc", weight, values[near.number]))
        return blend_segments(self.sequence(self.nearest(xy), turning=turning), values, self.library)

    def sequence(self, near: PoseNeighbours, *, turning: bool = False) -> Indices:
        """(n,) int: the cheapest sequence of library samples.

        turning : jumps are dear by how much the direction changes, for a trajectory; else by how much the pose does.
        """
        library, costs = self.library, self.costs
        own = costs.feature * near.distance
        own[0] += costs.end * library.place[near.number[0]]
        own[-1] += costs.end * library.samples_left[near.number[-1]]
        number = near.number + _APART * np.searchsorted(library.first_samples, near.number, side="right")
        lacking = costs.least - np.arange(1, costs.least + 1)
        short = np.where(lacking > 0, (costs.short + lacking) ** 2, 0.0)
        # for directions 1 − cos, which is half the square of the distance of their unit vectors
        unlike = _distances(self.directions[near.number]) ** 2 / 2 if turning else _distances(library.pose[near.number])
        jumps = costs.jump + costs.change * unlike
        # for steps of 0, 1 and 2 samples between candidates (n, k) and those of the next sample: (n − 1, 3, k) each
        step = number[1:, None, :] - number[:-1, :, None]
        ways = np.stack([step == length for length in range(3)], axis=1)
        came, price = ways.argmax(axis=2), np.where(ways.any(axis=2), 0.0, np.inf)
        price += np.array([costs.repeat, 0.0, costs.skip])[:, None]
        steps = [_Segments(*each, short) for each in zip(came, price, jumps, strict=True)]
        shape = (2, costs.least, near.number.shape[1])
        unary = np.broadcast_to(own[:, None, None, :], (len(own), *shape)).reshape(len(own), -1)
        begun = np.full(shape, np.inf)
        begun[0, 0] = 0.0
        closing = np.broadcast_to(short[:, None], shape).ravel()
        first, last = unary[0] + begun.ravel(), unary[-1] + closing
        rows = [first + closing] if len(own) == 1 else [first, *unary[1:-1], last]
        states = np.array(viterbi(rows, steps)) % shape[2]
        return np.asarray(near.number[np.arange(len(own)), states])


def _distances(values: Array) -> Array:
    """(n − 1, k, k): distances of candidates' values (n, k, c) from those of the next sample."""
    columns = values.transpose(2, 0, 1)
    return np.asarray(np.sqrt(sum((column[:-1, :, None] - column[1:, None, :]) ** 2 for column in columns)))


class _Segments:
    """A `chains.ChainStep`: from the states of one sample to those of the next.

    A state is (whether the library sample is a repetition, how long the segment is, which candidate), raveled from
    (2, least, k); segments of `least` samples and more are alike.
    """

    def __init__(self, came: Indices, price: Array, jump: Array, short: Array) -> None:
        self._same, self._next, self._after = came
        self._still, self._on, self._over = price
        self._jump, self._short = jump, short

    def totals(self, costs: Array) -> Array:
        before = costs.reshape(2, len(self._short), -1)
        either = np.minimum(before[0], before[1])
        closed = (either + self._short[:, None]).min(axis=0)
        reached, total = np.empty_like(before), np.empty_like(before)
        np.minimum(either[:, self._next] + self._on, either[:, self._after] + self._over, out=reached[0])
        np.add(before[0][:, self._same], self._still, out=reached[1])
        total[:, 1:-1] = reached[:, :-2]
        np.minimum(reached[:, -2], reached[:, -1], out=total[:, -1])
        total[0, 0] = (closed[:, None] + self._jump).min(axis=0)
        total[1, 0] = np.inf
        return total.reshape(-1)

    def origin(self, costs: Array, state: int) -> int:
        least = len(self._short)
        before = costs.reshape(2, least, -1)
        again, length, at = np.unravel_index(state, before.shape)
        ways: list[tuple[float, tuple[int, int, int]]] = []
        lengths = {int(length) - 1, int(length) if length == least - 1 else int(length) - 1} - {-1}
        for was in sorted(lengths):
            if again:
                j = int(self._same[at])
                ways.append((before[0, was, j] + self._still[at], (0, was, j)))
                continue
            for came, price in ((self._next, self._on), (self._after, self._over)):
                j = int(came[at])
                ways += [(before[kind, was, j] + price[at], (kind, was, j)) for kind in (0, 1)]
        if length == 0 and not again:
            closing = before + self._short[:, None] + self._jump[:, at]
            best = np.unravel_index(int(closing.argmin()), before.shape)
            ways.append((closing[best], (int(best[0]), int(best[1]), int(best[2]))))
        return int(np.ravel_multi_index(min(ways)[1], before.shape))


def segments(sequence: Indices, library: PoseLibrary) -> list[slice]:
    """Parts of a sequence of library samples that run on in one stroke of the library."""
    step = np.diff(sequence)
    runs_on = (step >= 0) & (step <= 2) & (np.diff(library.place[sequence]) == step)
    ends = np.flatnonzero(~runs_on) + 1
    bounds = [0, *ends.tolist(), len(sequence)]
    return [slice(a, b) for a, b in pairwise(bounds)]


def blend_segments(sequence: Indices, values: Array, library: PoseLibrary) -> Array:
    """(n, c): the library's values (m, c) along a sequence (n,), each segment fading into the next.

    Each segment goes on for up to six samples beyond its ends, as its library stroke does there, and weighs as much as
    a ramp over the twelve around a jump says; where the library's stroke ends the other has all of the weight.
    """
    total, weights = np.zeros((len(sequence), values.shape[1])), np.zeros(len(sequence))
    parts = segments(sequence, library)
    for part in parts:
        head = min(_BLEND, part.start, int(library.place[sequence[part.start]]))
        tail = min(_BLEND, len(sequence) - part.stop, int(library.samples_left[sequence[part.stop - 1]]))
        before = sequence[part.start] - np.arange(head, 0, -1)
        after = sequence[part.stop - 1] + np.arange(1, tail + 1)
        of = np.concatenate([before, sequence[part], after])
        at = np.arange(part.start - head, part.stop + tail)
        rising = np.ones(len(at)) if part.start == 0 else (at - part.start + _BLEND + 0.5) / (2 * _BLEND)
        falling = np.ones(len(at)) if part.stop == len(sequence) else (part.stop + _BLEND - at - 0.5) / (2 * _BLEND)
        weight = np.clip(np.minimum(rising, falling), 1e-6, 1.0)
        total[at] += weight[:, None] * values[of]
        weights[at] += weight
    return np.asarray(total / weights[:, None])
