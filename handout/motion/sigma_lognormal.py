"""Strokes by the kinematic theory of rapid movements: overlapping lognormal pulses through the points of a plan.

Between two points of the plan lies one pulse (a stroke, in the words of the theory).  How much it bends comes from the
smooth curve through the points; how much it overlaps its neighbours from the plan's smoothness; at a reversal, pulses
are shorter and straight.  The chords of the pulses are virtual: they solve the linear system that leads the path
through the points.

Source: seed 002, §3.1–3.2 (see `sigma_lognormal_model`; virtual targets solved exactly instead of by iteration).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handout.libraries import lapack
from handout.motion import covariance
from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.sigma_lognormal_model import REACH, Complex, Pulses
from handout.values import ActionPlan, Array

STEPS = 20  # samples an interval
ASYMMETRY = 0.08  # of every pulse: one minus mode over median of its speed
# Duration of a pulse over the interval is this times the plan's smoothness, where both give the same roundness …
OVERLAP = 9.0
# … between these: shorter ones would stop at every point, longer ones could no longer be led through them
SHORTEST, LONGEST, LONGEST_PLAYED = 1 / 0.9, 1 / 0.3, 1 / 0.2
# Pulses from and to rest, and on either side of a full reversal, last this share as long
_AT_REST, _AT_REVERSAL = 0.75, 0.7
# Turning, rad, from which a point begins to be a reversal; at π it fully is one
_REVERSING = np.radians(150)
_MOST_BENT = np.pi / 2
# Chords much shorter than this share of the typical one are too short to have a bend
_SHORT = 0.1
# Jitter: noise of ln duration and of theta, and correlation of the displacements of neighbouring points
_DURATION_NOISE, _THETA_NOISE, _CORRELATION = 0.04, 0.06, 0.5


def follow(
    plan: ActionPlan,
    *,
    steps: int = STEPS,
    rng: np.random.Generator | None = None,
    jitter: float = 0.0,
    baked_at: float | None = None,
) -> tuple[Array, Array]:
    """A timed path of lognormal pulses that starts and ends at rest and passes through the points of a plan.

    plan, steps, rng, jitter, baked_at : as in `optimal_control.follow`; covariances matter for `jitter` only, which
        displaces the points and varies the duration and bend of the pulses.

    Returns t : (n,) float, s, from 0; an interval a point.
        xy : (n, 2) float, mm; the first and last sample are the first and last point.

    Raises ValueError: no points, no `rng`, or fewer than two steps.
    """
    if len(plan.points) == 0:
        raise ValueError("a plan needs at least one point")
    if steps < 2:
        raise ValueError(f"steps = {steps} is too few: at least 2 are needed")
    if jitter > 0 and rng is None:
        raise ValueError("jitter needs a random generator: give rng")
    points = np.asarray(plan.points)
    if rng is not None and jitter > 0:
        # displaced by noise of the plan's covariances that is correlated along the plan, as a hand's is
        covariances = covariance.plan_covariances(plan)
        fresh = rng.standard_normal(covariances.shape[:2])
        white = np.sqrt(1 - _CORRELATION**2)
        for i in range(1, len(fresh)):
            fresh[i] = _CORRELATION * fresh[i - 1] + white * fresh[i]
        points = points + jitter * (covariance.root(covariances) @ fresh[..., None])[..., 0]
    if len(points) == 1:
        return np.array([0.0, plan.interval]), np.repeat(points, 2, axis=0)
    shape = _shape(points)
    baked = _pace_pulses(*shape, plan.smooth if baked_at is None else baked_at, LONGEST)
    chords = virtual_chords(points, baked)
    as_baked = baked_at in (None, plan.smooth) and OVERLAP * plan.smooth <= LONGEST
    played = baked if as_baked else _pace_pulses(*shape, plan.smooth, LONGEST_PLAYED)
    if rng is not None and jitter > 0:
        # other durations and bends; the medians stay
        stretch = np.exp(jitter * _DURATION_NOISE * rng.standard_normal(len(played.mu)))
        bend = played.theta + jitter * _THETA_NOISE * rng.standard_normal(len(played.mu))
        longer = replace(played, mu=played.mu + np.log(stretch), theta=np.clip(bend, -_MOST_BENT, _MOST_BENT))
        played = longer.delay_by(played.time(0.0) - longer.time(0.0))
    # from the start of the first pulse to the end of the last
    samples = len(points) * steps
    start, end = played.span
    z = lognormal.path(played, chords, start, (end - start) / (samples - 1), samples)
    xy: Array = points[0] + np.column_stack([z.real, z.imag])
    xy[-1] = points[-1]
    t: Array = np.arange(len(xy), dtype=np.float64) * (plan.interval / steps)
    return t, xy


def pulses_through(points: Array, smooth: float) -> Pulses:
    """The m − 1 pulses of points (m, 2); times in intervals, the median of pulse i at i."""
    return _pace_pulses(*_shape(points), smooth, LONGEST)


def _shape(points: Array) -> tuple[Array, Array]:
    """How much of a reversal each point is (m,), 0–1; half the turning of each pulse (m − 1,), rad."""
    z = points[:, 0] + 1j * points[:, 1]
    reversal = np.zeros(len(z))
    # (m − 2,) in 0–1: how much of a reversal each inner point is; a repeated point is a full stop
    chords = np.diff(z)
    length = np.abs(chords)
    tiny = length <= 1e-9 * length.max(initial=0.0)
    turn = np.abs(np.angle(chords[1:] * np.conj(chords[:-1])))
    reversing = np.clip((turn - _REVERSING) / (np.pi - _REVERSING), 0, 1)
    reversal[1:-1] = np.where(tiny[1:] | tiny[:-1], 1.0, reversing)
    return reversal, _bends(z) * (1 - np.maximum(reversal[1:], reversal[:-1]))


def _pace_pulses(reversal: Array, theta: Array, smooth: float, longest: float) -> Pulses:
    """Pulses whose durations follow from the smoothness and from what they begin and end with."""
    calm = 1 - (1 - _AT_REVERSAL) * reversal
    calm[[0, -1]] = _AT_REST
    duration = np.minimum(np.maximum(OVERLAP * smooth * np.sqrt(calm[1:] * calm[:-1]), SHORTEST), longest)
    raw = lognormal.pulses(duration, ASYMMETRY, theta, 0.0)
    return raw.delay_by(np.arange(len(duration)) - raw.time(0.0))


def virtual_chords(points: Array, pulses: Pulses) -> Complex:
    """Chords (m − 1,) of the pulses such that their sum passes through points (m, 2).

    The path is at a point half-way between the medians of the pulses before and after it.  Each equation says what
    all pulses contribute between one point and the next; pulses that overlap make it a band.

    Source: seed 002, §3.2 (there iterated).
    """
    k = len(pulses.mu)
    z = points[:, 0] + 1j * points[:, 1]
    middle = pulses.time(0.0)
    # before the first and after the last point nothing is missing, whatever the reach of the pulses
    passing = np.concatenate([[-np.inf], 0.5 * (middle[1:] + middle[:-1]), [np.inf]])
    below = min(k - 1, int(np.ceil((pulses.time(REACH) - middle).max())) + 1)
    above = min(k - 1, int(np.ceil((middle - pulses.time(-REACH)).max())) + 1)
    edge = np.arange(k)[:, None] + np.arange(-above, below + 2)
    share = lognormal.share_within(pulses, passing[np.minimum(np.maximum(edge, 0), k)])
    done = lognormal.arc(share, pulses.theta[:, None])
    # rows of the band beyond the matrix come out as 0; the first `below` rows are room for the pivoting
    band = np.zeros((2 * below + above + 1, k), dtype=np.complex128)
    band[below:] = (done[:, 1:] - done[:, :-1]).T
    *_, chords, trouble = lapack.zgbsv(below, above, band, np.diff(z)[:, None])
    if trouble:
        raise ValueError("the pulses overlap too much to be led through their points")
    return np.asarray(chords[:, 0])


def _bends(z: Complex) -> Array:
    """(m − 1,) rad: half the turning of the smooth curve through places z between each two of them.

    An arc whose half turning is θ rises ``tan(θ/2) / 2`` of its chord above it; the rise is that of the natural cubic
    spline through the points.  (Turnings of the polyline would make loops out of reversals.)
    """
    k = len(z) - 1
    if k < 2:
        return np.zeros(k)
    # derivatives at its knots of the natural cubic spline through the places
    beside = np.ones(len(z) - 1, dtype=np.complex128)
    middle = np.full(len(z), 4.0 + 0j)
    middle[[0, -1]] = 2.0
    sides = np.empty_like(z)
    sides[1:-1] = z[2:] - z[:-2]
    sides[0], sides[-1] = z[1] - z[0], z[-1] - z[-2]
    *_, slope, _ = lapack.zgtsv(beside, middle, beside, 3 * sides)
    chord = np.diff(z)
    rise = (slope[:-1] - slope[1:]) / 8
    square = np.abs(chord) ** 2
    floor = _SHORT**2 * float(square.mean())
    relative = (rise * np.conj(chord)).imag / np.maximum(square + floor, np.finfo(np.float64).tiny)
    return np.asarray(np.minimum(np.maximum(-2 * np.arctan(2 * relative), -_MOST_BENT), _MOST_BENT))
