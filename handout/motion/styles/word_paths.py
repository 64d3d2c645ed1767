"""Of the ways to move through a word those that look most like a style's example, among those in which it reads.

What the dynamics of a style make of a word's targets is drawn several times.  Of the word's own bends and overlaps so
much is kept as reading needs, the same of all strokes first, then less of a few; and turns are shaped as the example's.
Each is taken only where it makes the word more like the example, by a score of style, and as readable, by one of
reading.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.reconstruction.shape_fit import path_matrix, plan_of
from handout.motion.styles.manner import manner_distance, measure_manner
from handout.motion.styles.turns import find_turns, shape_turn
from handout.values import Array

SAMPLES = 60  # in the duration of a stroke: 200 a second at the usual .3 s
_RIDGE = 0.03  # how much virtual targets stay, against the places that they lead through, as in `optimal_control`
_KEPT = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # shares of a word's own bends and overlaps that are tried until it reads
_RUN = 3  # strokes of which less is then kept, if it still reads
# nat that a word may be harder to read than before: with more, styles are told apart better (.7: 92 of 96 samples,
# .1: 56 of 64), but readers that had no say in it misread more of 80 words
_HARDER = 0.1


@dataclass(frozen=True, eq=False)
class WrittenWord:
    """A word as it was before, what it should look like, and who reads it.

    plans : of each of its movements.
    height : mm, of a letter; hold : how far paths are led through the places that it passed.
    wanted : (9,) the manner of the example, see `measure_manner`; None: there is no example.
    surprise : nat, the negative logarithm of the probability that strokes (n, 2) mm each read as the word.
    """

    plans: Sequence[LognormalPlan]
    height: float
    hold: float
    wanted: Array | None
    surprise: Callable[[Sequence[Array]], float] | None = None

    def choose_paths(self, draws: Sequence[Sequence[LognormalPlan]], keep: float) -> list[Array]:
        """(n, 2) mm, evenly in time, of each movement.

        draws : the word's plans with dynamics by chance; keep : the share of its own that stays where nobody reads.
        """
        if self.surprise is None:
            return min((self._pass_through(plans, keep) for plans in draws), key=lambda tried: tried.off).paths
        easy = self.surprise([draw_path(plan, plan, 0.0) for plan in self.plans]) + _HARDER
        for share in _KEPT:
            tried = [self._pass_through(plans, share) for plans in draws]
            hard = [self.surprise(each.paths) for each in tried]
            if min(hard) <= easy:
                break
        easy = max(easy, min(hard))
        best = min((each for each, nat in zip(tried, hard, strict=True) if nat <= easy), key=lambda each: each.off)
        for k, plan in enumerate(self.plans):
            for start in range(0, plan.strokes, _RUN):
                share_of = best.shares[k].copy()
                share_of[start : start + _RUN] = 0.0
                path = self._blend_path(k, best.plans[k], share_of)
                best = self._take_nearer(best, k, path, share_of, easy)
        return self._shape_turns(best, easy).paths

    def _shape_turns(self, best: _MovedWord, easy: float) -> _MovedWord:
        """The word with those turns shaped as the example's that make it more like it and leave it as readable."""
        if self.wanted is None:
            return best
        for k, path in enumerate(best.paths):
            for at, side in reversed(find_turns(path, self.height)):
                made = shape_turn(best.paths[k], at, side, self.wanted, self.height)
                if made is not None:
                    best = self._take_nearer(best, k, made, best.shares[k], easy)
        return best

    def _pass_through(self, plans: Sequence[LognormalPlan], keep: float) -> _MovedWord:
        shares = [np.full(plan.strokes, keep) for plan in self.plans]
        paths = [self._blend_path(k, plan, share) for k, (plan, share) in enumerate(zip(plans, shares, strict=True))]
        return _MovedWord(plans, shares, paths, self._distance(paths))

    def _blend_path(self, k: int, told: LognormalPlan, keep: Array) -> Array:
        """The path of a movement with dynamics between those told and, as far as `keep` (strokes,) says, its own."""
        known = self.plans[k]
        if not known.strokes:
            return draw_path(known, known, self.hold)
        dt, theta = ((1 - keep) * new + keep * old for new, old in ((told.dt, known.dt), (told.theta, known.theta)))
        return draw_path(known, plan_of(known.targets, dt, theta), self.hold)

    def _distance(self, paths: Sequence[Array]) -> float:
        return 0.0 if self.wanted is None else manner_distance(measure_manner(paths, self.height), self.wanted)

    def _take_nearer(self, best: _MovedWord, k: int, path: Array, share: Array, easy: float) -> _MovedWord:
        """The word with another path of one movement, if that is more like the example and as readable; or as it is."""
        paths = [*best.paths[:k], path, *best.paths[k + 1 :]]
        assert self.surprise is not None
        off = self._distance(paths)
        if off >= best.off or self.surprise(paths) > easy:
            return best
        return _MovedWord(best.plans, [*best.shares[:k], share, *best.shares[k + 1 :]], paths, off)


@dataclass(frozen=True, eq=False)
class _MovedWord:
    """Plans with dynamics by chance, shares (strokes,) of its own ones that each keeps, paths, distance in manner."""

    plans: Sequence[LognormalPlan]
    shares: list[Array]
    paths: list[Array]
    off: float


def draw_path(known: LognormalPlan, plan: LognormalPlan, hold: float) -> Array:
    """(n, 2) mm, evenly in time: the path of a plan, led by `hold` through the places that the known one passes."""
    if not plan.strokes:
        return np.repeat(plan.targets, 2, axis=0)
    z = plan.targets @ np.array([1.0, 1j])
    if hold > 0:
        passing = _passing(plan)
        linear = path_matrix(lognormal.arc(lognormal.progress(plan.pulses(), passing), plan.theta[:, None]))
        places = known.position_at(_passing(known)) @ np.array([1.0, 1j])
        rows = np.concatenate([linear, np.sqrt(_RIDGE) * np.eye(len(z))])
        led = np.linalg.lstsq(rows, np.concatenate([places, np.sqrt(_RIDGE) * z]), rcond=None)[0]
        z = z + hold * (led - z)
    pulses = plan.pulses()
    start, end = pulses.span
    samples = max(round((end - start) * SAMPLES / float(plan.duration[0])), 2)
    path = z[0] + lognormal.path(pulses, np.diff(z), start, (end - start) / (samples - 1), samples)
    return np.column_stack([path.real, path.imag])


def _passing(plan: LognormalPlan) -> Array:
    """(m,) s: when a plan passes from each stroke to the next: half-way between their medians; at its ends, those."""
    pulses = plan.pulses()
    middle = pulses.time(0.0)
    start, end = pulses.span
    return np.concatenate([[start], 0.5 * (middle[1:] + middle[:-1]), [end]])
