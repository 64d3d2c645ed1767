"""Strokes by optimal control: the smoothest movement that passes near a chain of Gaussian targets.

The hand minimises effort (the squared `order`-th derivative of its path) against precision at the targets.  One
dimensionless knob, ``smooth`` (smoothing time divided by the interval of the targets), decides how careful the
writing is; the path depends on nothing else of the time scale.

Source: seed 003, §3 (iterative cost replaced by an exact banded solve, see `handout.motion.banded`).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from handout.motion.banded import Chain, Ends, factorise
from handout.values import ActionPlan, Array

ORDER = 4
STEPS = 20
# Ridge of the backwards solve: a target never strays far from its point to fight smoothing it cannot win
RIDGE = 0.03
# The first and last half interval hold on to their targets, so that strokes begin and end where they were drawn
HOLD = 30.0
# Beyond this condition number of the band, the path is solved on a coarser grid and upsampled
STIFFEST = 1e10
# Motor noise of a plan without covariances, as a fraction of the root mean square distance of its points
LOOSENESS = 0.05


def follow(
    plan: ActionPlan,
    *,
    order: int = ORDER,
    steps: int = STEPS,
    rng: np.random.Generator | None = None,
    jitter: float = 0.0,
    baked_at: float | None = None,
) -> tuple[Array, Array]:
    """Turn a plan into a timed path that starts and ends at rest and passes nearly through the plan's points.

    Parameters
    ----------
    plan : ActionPlan
        Points on the curve, mm.  One point gives a dwell: two samples at the same place, one interval apart.  Two
        points give the straight movement of least effort.
    order : int
        Order of the chain of integrators, 2–6.
    steps : int
        Samples an interval.
    rng : numpy.random.Generator, optional
        Needed where `jitter` > 0.
    jitter : float
        Motor noise in units of the plan's covariances.
    baked_at : float, optional
        The smoothness at which the targets are sought that lead through the points; default: the plan's own.  A
        hand that plays targets baked at .30 with smooth = .36 is hasty, with .27 careful.

    Returns
    -------
    t : (n,) float, s, from 0.
    xy : (n, 2) float, mm.
    """
    points = np.asarray(plan.points)
    m = len(points)
    if m == 0:
        raise ValueError("a plan needs at least one point")
    targets = targets_through(points, smooth=baked_at or plan.smooth, order=order, steps=steps)
    xy = smooth_path(targets, smooth=plan.smooth, order=order, steps=steps)
    t = np.arange(len(xy)) * (plan.interval / steps)
    return t, xy


def targets_through(
    points: Array, *, smooth: float, lam: float = RIDGE, order: int = ORDER, steps: int = STEPS
) -> Array:
    """Targets (m, D) whose smoothed path passes (nearly) through `points` (m, D)."""
    m = len(points)
    if m < 3:
        return np.array(points, dtype=np.float64)
    chain, response, factor = _backwards(m, order, steps, smooth, lam)
    return np.asarray(cho_solve(factor, response.T @ points + lam * points, check_finite=False))


def smooth_path(targets: Array, *, smooth: float, order: int = ORDER, steps: int = STEPS) -> Array:
    """The path (m·steps, D) of least effort near `targets`, at rest at both ends."""
    m = len(targets)
    if m == 1:
        return np.repeat(targets, 2, axis=0)
    origin = targets[0]
    if m == 2:
        return origin + _least_effort(m * steps, order)[:, None] * (targets[1] - origin)
    chain = _chain(m, order, steps, smooth)
    weights = _weights(m, steps)
    return np.asarray(origin + chain.solve(weights[:, None] * np.repeat(targets - origin, steps, axis=0)))


def _least_effort(samples: int, order: int) -> Array:
    """From 0 to 1, at rest at both ends, with the least squared `order`-th derivative: a polynomial."""
    u = np.linspace(0.0, 1.0, samples)
    terms = [
        math.comb(order - 1 + k, k) * math.comb(2 * order - 1, order - 1 - k) * (-u) ** k for k in range(order)
    ]
    return np.asarray(u**order * np.sum(terms, axis=0))


def _weights(m: int, steps: int) -> Array:
    weights = np.ones(m * steps)
    weights[: steps // 2] = weights[m * steps - steps // 2 :] = HOLD
    return weights


@lru_cache(maxsize=256)
def _chain(m: int, order: int, steps: int, smooth: float) -> Chain:
    return factorise(_weights(m, steps), (smooth * steps) ** (2 * order), order, "rest")


@lru_cache(maxsize=256)
def _backwards(m: int, order: int, steps: int, smooth: float, lam: float):
    chain = _chain(m, order, steps, smooth)
    unit = _weights(m, steps)[:, None] * np.repeat(np.eye(m), steps, axis=0)
    paths = chain.solve(unit)
    centre = np.arange(m) * steps
    response = 0.5 * (paths[centre + steps // 2] + paths[centre + (steps - 1) // 2])
    response[0], response[-1] = paths[0], paths[-1]
    return chain, response, cho_factor(response.T @ response + lam * np.eye(m))
