"""Of the ways to move through a word those that look most like a style's example, as far as each letter stays legible.

What the dynamics of a style make of a word's targets is drawn twice and read.  Letters that are harder to read than in
plain writing get less of the style, step by step, until they read; the others keep all of it.  Then turns are shaped as
the example's, one by one, where that makes the word more like it and every letter still reads.

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
from handout.values import Array, Indices

SAMPLES = 60  # in the duration of a stroke: 200 a second at the usual .3 s
_RIDGE = 0.03  # how much virtual targets stay, against the places that they lead through, as in `optimal_control`
_KEPT = np.array([0.0, 0.25, 0.5, 0.75, 1.0])  # of its own bends and overlaps: steps that a letter is taken back
# nat: a letter that is read with a probability of .8 need not be plainer. With .1 four styles are told apart less often
# (23 of 32 samples, with .2 and smaller loops, too, 32), and other readers read hardly more of 40 words
_LEGIBLE = 0.2


@dataclass(frozen=True, eq=False)
class WordReading:
    """A word as it is read.

    nats : (letters, views) negative logarithms of the probabilities that each letter is read, the others being right.
    of : of each stroke (n,) int, the letters that its places belong to.
    """

    nats: Array
    of: Sequence[Indices]


# who reads the word of a number, of which strokes (n, 2) are given, mm; None: nobody can
ReadingOf = Callable[[int], Callable[[Sequence[Array]], WordReading] | None]


@dataclass(frozen=True, eq=False)
class WrittenWord:
    """A word as it was before, what it should look like, and who reads it.

    plans : of each of its movements.
    height : mm, of a letter; hold : how far paths are led through the places that it passed.
    wanted : (9,) the manner of the example, see `measure_manner`; None: there is no example.
    reads : who reads strokes (n, 2) mm each as the word.
    """

    plans: Sequence[LognormalPlan]
    height: float
    hold: float
    wanted: Array | None
    reads: Callable[[Sequence[Array]], WordReading] | None = None

    def choose_paths(self, draws: Sequence[Sequence[LognormalPlan]], keep: float) -> list[Array]:
        """(n, 2) mm, evenly in time, of each movement.

        draws : the word's plans with dynamics by chance; keep : the share of its own that stays where nobody reads.
        """
        if self.reads is None:
            shares = [np.full(plan.strokes, keep) for plan in self.plans]
            return self._shape_turns(min((self._move(plans, shares) for plans in draws), key=self._distance))
        read = self.reads([draw_path(plan, plan, 0.0) for plan in self.plans])
        over, _, paths = min((self._move_legibly(plans, read) for plans in draws), key=lambda each: each[:2])
        return self._shape_turns(paths, np.maximum(read.nats, _LEGIBLE) + over)

    def _move_legibly(self, plans: Sequence[LognormalPlan], read: WordReading) -> tuple[float, float, list[Array]]:
        """How much harder than in plain writing (nat) a letter stays, the distance from the example, and the paths."""
        assert self.reads is not None
        easy = np.maximum(read.nats, _LEGIBLE)
        given = np.zeros(len(easy), dtype=np.intp)  # steps that each letter is taken back
        of = list[Indices]()  # the letter that each stroke is half-way through in
        for own, plan in zip(read.of, self.plans, strict=True):
            pulses = plan.pulses()
            start, end = pulses.span if plan.strokes else (0.0, 1.0)
            share = (pulses.time(0.0) - start) / (end - start)
            of.append(own[np.clip(np.rint(share * (len(own) - 1)), 0, len(own) - 1).astype(np.intp)])
        while True:
            paths = self._move(plans, [_KEPT[given[own]] for own in of])
            over = (self.reads(paths).nats - easy).max(axis=1)
            hard, free = over > 0, given < len(_KEPT) - 1
            if not (hard & free).any():  # who is beside a letter may make it hard to read, too
                hard = np.convolve(hard, (1, 1, 1))[1:-1] > 0
            if not (hard & free).any():
                break
            given[hard & free] += 1
        return max(float(over.max()), 0.0), self._distance(paths), paths

    def _shape_turns(self, paths: list[Array], easy: Array | float = np.inf) -> list[Array]:
        """The paths, their turns shaped as the example's where that makes the word more like it.

        easy : (letters, 1) nat, as `WordReading` has them: no letter becomes harder to read; ∞: any may.
        """
        if self.wanted is None:
            return paths
        off = self._distance(paths)
        for k in range(len(paths)):
            for at, side in reversed(find_turns(paths[k], self.height)):
                made = shape_turn(paths[k], at, side, self.wanted, self.height)
                changed = paths if made is None else [*paths[:k], made, *paths[k + 1 :]]
                if (
                    changed is not paths
                    and (now := self._distance(changed)) < off
                    and (self.reads is None or (self.reads(changed).nats <= easy).all())
                ):
                    paths, off = changed, now
        return paths

    def _move(self, plans: Sequence[LognormalPlan], keep: Sequence[Array]) -> list[Array]:
        """Paths with dynamics between those told and, as far as `keep` (strokes,) of each says, the word's own."""
        paths = []
        for known, told, share in zip(self.plans, plans, keep, strict=True):
            dt, theta = ((1 - share) * a + share * b for a, b in ((told.dt, known.dt), (told.theta, known.theta)))
            paths.append(draw_path(known, plan_of(known.targets, dt, theta) if known.strokes else known, self.hold))
        return paths

    def _distance(self, paths: Sequence[Array]) -> float:
        return 0.0 if self.wanted is None else manner_distance(measure_manner(paths, self.height), self.wanted)


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
