"""Strokes as sums of lognormal speed pulses: the kinematic theory of rapid movements.

Every stroke of an action plan moves the pen along a circular arc with a lognormal speed profile; strokes overlap in
time, and the path is their sum.  Its position has a closed form that is linear in the displacements, so the virtual
displacements that lead the path through wanted points are the solution of one banded complex system.

Source: seed 002, §3.1 (eq. 1–5 corrected).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded
from scipy.special import ndtr

from handout.values import ActionPlan, Array

Complex = NDArray[np.complex128]

STEPS = 20
ASYMMETRY = 0.1
REACH = 4.0
GAIN = 0.5
OVERLAP = 7.0


@dataclass(frozen=True, eq=False)
class Pulses:
    """Lognormal speed pulses: t0 s, mu ln s, sigma, and theta rad (half the turning), all (k,)."""

    t0: Array
    mu: Array
    sigma: Array
    theta: Array

    def time(self, deviations: float) -> Array:
        """(k,) s: when each pulse is `deviations` standard deviations of its logarithm past its median."""
        return np.asarray(self.t0 + np.exp(self.mu + deviations * self.sigma))


def pulses(onset: Array, duration: Array, theta: Array, asymmetry: Array) -> Pulses:
    sigma = np.sqrt(-np.log1p(-asymmetry))
    mu = 3 * sigma + np.log(duration) - np.log(np.expm1(6 * sigma))
    return Pulses(onset - np.exp(mu - 3 * sigma), mu, sigma, theta)


def progress(p: Pulses, t: Array) -> Array:
    """Share of the stroke done, 0–1; t (k, n) s."""
    late = np.maximum(t - p.t0[:, None], 1e-300)
    z = np.clip((np.log(late) - p.mu[:, None]) / p.sigma[:, None], -REACH, REACH)
    tail = ndtr(-REACH)
    return np.asarray((ndtr(z) - tail) / (1 - 2 * tail))


def bend(share: Array, theta: Array) -> Complex:
    """Displacement along an arc of turning 2 theta after `share` of it, in units of the chord."""
    straight = np.abs(theta) < 1e-6
    angle = np.where(straight, 1.0, theta)
    arc = np.exp(1j * angle * (share - 1)) * np.sin(angle * share) / np.sin(angle)
    return np.asarray(np.where(straight, share, arc))


def _plan_pulses(points: Array, smooth: float, gain: float = GAIN) -> Pulses:
    theta, corner = _turning(points)
    k = len(points) - 1
    overlap = np.full(k, OVERLAP * smooth)
    # a stroke that begins or ends at a corner or at rest is over when the next begins
    crisp = np.concatenate([[True], corner, [True]])
    shorter = crisp[:-1].astype(float) + crisp[1:]
    duration = np.maximum(overlap * np.array([1.0, 0.75, 0.55])[shorter.astype(int)], 0.9)
    centre = np.arange(k, dtype=float)
    p = pulses(centre, duration, gain * theta, np.full(k, ASYMMETRY))
    return Pulses(p.t0 + centre - p.time(0.0), p.mu, p.sigma, p.theta)


def _turning(points: Array) -> tuple[Array, NDArray[np.bool_]]:
    z = points[:, 0] + 1j * points[:, 1]
    chord = np.diff(z)
    k = len(chord)
    angle = np.angle(chord)
    length = np.abs(chord)
    turn = np.angle(np.exp(1j * np.diff(angle)))
    corner = (np.abs(turn) > np.radians(110)) | (length[:-1] < 1e-9) | (length[1:] < 1e-9)
    part = length[:-1] / np.maximum(length[:-1] + length[1:], 1e-300)
    turn = np.where(corner, 0.0, turn)
    # the tangent of the circle through three points divides the turning in the ratio of the chords
    total = np.zeros(k)
    total[:-1] += part * turn
    total[1:] += (1 - part) * turn
    free = np.ones(k)
    return np.clip(total / 2, -1.3, 1.3) * free, corner


def follow(
    plan: ActionPlan,
    *,
    steps: int = STEPS,
    rng: np.random.Generator | None = None,
    jitter: float = 0.0,
    baked_at: float | None = None,
    gain: float = GAIN,
) -> tuple[Array, Array]:
    """Turn a plan into a timed path of lognormal strokes through its points, at rest at both ends."""
    points = np.asarray(plan.points)
    m = len(points)
    if m == 1:
        return np.array([0.0, plan.interval]), np.repeat(points, 2, axis=0)
    p = _plan_pulses(points, plan.smooth, gain)
    baked = p if baked_at is None else _plan_pulses(points, baked_at, gain)
    chord = _displacements(points, baked)
    begin, end = p.time(-REACH).min(), p.time(REACH).max()
    n = m * steps
    z = _evaluate(p, chord, np.linspace(begin, end, n))
    xy = points[0] + np.column_stack([z.real, z.imag])
    return np.arange(n) * (plan.interval / steps), xy


def _displacements(points: Array, p: Pulses) -> Complex:
    z = points[:, 0] + 1j * points[:, 1]
    centre = p.time(0.0)
    k = len(centre)
    key = np.concatenate([[p.time(-REACH).min()], (centre[1:] + centre[:-1]) / 2, [p.time(REACH).max()]])
    done = bend(progress(p, np.broadcast_to(key, (k, k + 1))), p.theta[:, None])
    return np.asarray(np.linalg.solve(np.diff(done, axis=1).T, np.diff(z)))


def _evaluate(p: Pulses, chord: Complex, t: Array) -> Complex:
    done = bend(progress(p, np.broadcast_to(t, (len(chord), len(t)))), p.theta[:, None])
    return np.asarray(chord @ done)
