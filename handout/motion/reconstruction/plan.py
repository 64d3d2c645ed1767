"""A plan of lognormal strokes: virtual targets, and the strokes that lead from each to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.sigma_lognormal_model import Complex, Pulses
from handout.summary import one_line
from handout.values import Array, readonly


@dataclass(frozen=True, eq=False)
class LognormalPlan:
    """What a hand intends for one pen-down movement, in the parameters of the sigma-lognormal model.

    A stroke, in the words of the theory, is one aimed pulse of speed; there is one fewer than targets.

    targets : (m, 2) float, mm: where the movement starts, and where each stroke would end if it were alone.
    onset : (m − 1,) float, s: when each stroke begins.
    duration : (m − 1,) float, s: how long it lasts, from −3 to +3 standard deviations of its logarithm.
    asymmetry : (m − 1,) float: one minus mode over median of its speed.
    theta : (m − 1,) float, rad: half of how far it turns, positive from x towards y.
    start, end : s: when the movement was begun and ended.

    Source: seed 002, §3.1.
    """

    targets: Array
    onset: Array
    duration: Array
    asymmetry: Array
    theta: Array
    start: float
    end: float

    __repr__ = one_line

    def __post_init__(self) -> None:
        targets = readonly(self.targets, None, 2)
        if len(targets) == 0:
            raise ValueError("a plan needs at least one target")
        object.__setattr__(self, "targets", targets)
        for name in ("onset", "duration", "asymmetry", "theta"):
            object.__setattr__(self, name, readonly(getattr(self, name), len(targets) - 1))
        if not self.end > self.start:
            raise ValueError("a plan must end after it starts")

    @property
    def strokes(self) -> int:
        """How many strokes it has."""
        return len(self.onset)

    @property
    def dt(self) -> Array:
        """(m − 1,) float: onset after the previous stroke's, as a share of its duration; 0 for the first."""
        later = np.diff(self.onset) / self.duration[:-1]
        return np.concatenate([np.zeros(min(1, self.strokes)), later])

    def pulses(self) -> Pulses:
        """The strokes as pulses of the model."""
        return lognormal.pulses(self.duration, self.asymmetry, self.theta, self.onset)

    def chords(self) -> Complex:
        """(m − 1,) complex, mm: displacement of each stroke."""
        return np.asarray(np.diff(self.targets @ np.array([1.0, 1j])))

    def position_at(self, t: ArrayLike) -> Array:
        """(n, 2) float, mm: where the pen is at times t (n,), s."""
        if self.strokes == 0:
            return np.repeat(self.targets, len(np.atleast_1d(t)), axis=0)
        z = lognormal.position(self.pulses(), self.chords(), t)
        return np.asarray(self.targets[0] + np.column_stack([z.real, z.imag]))

    def speeds(self, t: ArrayLike) -> Array:
        """(k, n) float, mm/s: speed of every stroke alone at times t (n,), s."""
        pulses = self.pulses()
        length = np.abs(self.chords()) * lognormal.arc_over_chord(pulses.theta)
        return np.asarray(length[:, None] * lognormal.rate(pulses, t))

    def velocity(self, t: ArrayLike) -> Array:
        """(n, 2) float, mm/s: velocity at times t (n,), s."""
        v = lognormal.velocity(self.pulses(), self.chords(), t)
        return np.column_stack([v.real, v.imag])


def from_pulses(pulses: Pulses, origin: complex, chords: Complex, start: float, end: float) -> LognormalPlan:
    """The plan of pulses, sorted by the times of their medians; `origin` is where the movement starts, mm."""
    order = np.argsort(pulses.time(0.0), kind="stable")
    mu, sigma = pulses.mu[order], pulses.sigma[order]
    targets = origin + np.concatenate([[0.0], np.cumsum(chords[order])])
    return LognormalPlan(
        np.column_stack([targets.real, targets.imag]),
        pulses.t0[order] + np.exp(mu - 3 * sigma),
        np.exp(mu) * 2 * np.sinh(3 * sigma),
        -np.expm1(-(sigma**2)),
        pulses.theta[order],
        start,
        end,
    )
