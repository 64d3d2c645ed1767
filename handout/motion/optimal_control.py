"""Strokes by optimal control: the smoothest movement through the points of a plan.

The targets that lead such a movement through wanted points are found by solving the smoothing backwards, so a letter
is drawn as points on its curve and comes out as a hand would write it: extremes reached, everything between rounded
off, at rest at both ends.

Source: seed 003, §3 (see `handout.motion.tracker`); the backwards solve is this project's.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from handout.motion import covariance
from handout.motion.tracker import ORDER, STEPS, Tracker, mean, relative, sample, tracker
from handout.values import ActionPlan, Array

__all__ = ["follow", "mean", "sample", "smooth_path", "targets_through"]

# Ridge of the backwards solve: a target never strays far from its point to fight smoothing that it cannot win
RIDGE = 0.03
# The first and last half interval hold on to their targets, so that strokes begin and end where they were drawn
HOLD = 30.0
# Up to this many points the backwards solve is one cached matrix; beyond it is iterated, in linear time
_CACHED = 128


def follow(
    plan: ActionPlan,
    *,
    order: int = ORDER,
    steps: int = STEPS,
    rng: np.random.Generator | None = None,
    jitter: float = 0.0,
    baked_at: float | None = None,
) -> tuple[Array, Array]:
    """A timed path that starts and ends at rest and passes nearly through the points of a plan.

    plan : points on the curve.  One point gives a dwell: two samples in one place, an interval apart.  Two points give
        the straight movement of least effort.  Targets of larger covariance than the others may be cut.
    order : which derivative is the effort, 2–5.
    steps : samples an interval.
    rng : needed where `jitter` > 0.
    jitter : motor noise: its standard deviation at the targets, in units of the plan's covariances (where it has none:
        of a twentieth of the distance of its points).
    baked_at : the smoothness at which the targets are sought that lead through the points; default: the plan's own.
        Played at a larger one the writing is hasty and cuts its corners.

    Returns t : (n,) float, s, from 0; an interval a point.
        xy : (n, 2) float, mm.

    Raises ValueError: no points, no `rng`, a parameter outside its bounds.
    """
    points = np.asarray(plan.points)
    if len(points) == 0:
        raise ValueError("a plan needs at least one point")
    if jitter > 0 and rng is None:
        raise ValueError("jitter needs a random generator: give rng")
    if len(points) < 3 and rng is not None and jitter > 0:
        points = points + jitter * covariance.draw(covariance.plan_covariances(plan), rng)
    if len(points) == 1:
        return np.array([0.0, plan.interval]), np.repeat(points, 2, axis=0)
    targets = targets_through(points, smooth=plan.smooth if baked_at is None else baked_at, order=order, steps=steps)
    xy = smooth_path(targets, plan.spread, smooth=plan.smooth, order=order, steps=steps)
    if len(points) > 2 and rng is not None and jitter > 0:
        covariances = covariance.plan_covariances(plan)
        if plan.spread is None:
            solver = _uniform(len(plan.points), plan.smooth, order, steps, hold=1.0)
            size = math.sqrt(covariances[0, 0, 0])
        else:
            precision, size = relative(covariances)
            solver = tracker(precision, smooth=plan.smooth, steps=steps, order=order)
        xy = xy + jitter * (size * solver.noise(rng, 2))
    t: Array = np.arange(len(xy), dtype=np.float64) * (plan.interval / steps)
    return t, xy


def targets_through(
    points: ArrayLike, *, smooth: float, lam: float = RIDGE, order: int = ORDER, steps: int = STEPS
) -> Array:
    """Targets (m, D) whose smoothed path passes (nearly) through `points` (m, D).

    The path is linear in its targets, ``x = A T``; the targets are ``(A'A + lam)⁻¹ (A' + lam) P``, where A is taken
    at the centres of the targets and at the two ends.  Fewer than three points are their own targets.
    """
    through = np.asarray(points, dtype=np.float64)
    m = len(through)
    if m < 3:
        return through.copy()
    if m <= _CACHED:
        origin = through[0]
        return np.asarray(origin + _inverse_matrix(m, smooth, lam, order, steps) @ (through - origin))
    return _iterate_targets(_uniform(m, smooth, order, steps), through, lam)


def smooth_path(
    targets: ArrayLike,
    covariances: ArrayLike | None = None,
    *,
    smooth: float,
    order: int = ORDER,
    steps: int = STEPS,
) -> Array:
    """The path (m·steps, D) of least effort near `targets` (m, D), at rest at both ends, which it holds on to.

    Two targets give a straight line at the speeds of least effort, whatever the smoothness.
    """
    where = np.asarray(targets, dtype=np.float64)
    m = len(where)
    if m == 1:
        return np.repeat(where, steps, axis=0)
    if m == 2:
        # from 0 to 1, at rest at both ends, with the least squared derivative of that order: a polynomial
        samples = m * steps
        u = np.linspace(0.0, 1.0, samples)
        total = np.zeros(samples)
        for k in range(order):
            total += math.comb(order - 1 + k, k) * math.comb(2 * order - 1, order - 1 - k) * (-u) ** k
        return np.asarray(where[0] + np.outer(u**order * total, where[1] - where[0]))
    if covariances is None:
        solver = _uniform(m, smooth, order, steps)
    else:
        precision, _ = relative(covariance.settle_covariances(covariances, where))
        solver = tracker(precision, smooth=smooth, steps=steps, order=order, hold=HOLD)
    return solver.path(where)


def _uniform(m: int, smooth: float, order: int, steps: int, hold: float = HOLD) -> Tracker:
    """The solver for m targets that are all alike and round; kept, unless it is large."""
    build = _kept_tracker if m <= _CACHED else _kept_tracker.__wrapped__
    return build(m, smooth, order, steps, hold)


@lru_cache(maxsize=256)
def _kept_tracker(m: int, smooth: float, order: int, steps: int, hold: float) -> Tracker:
    return tracker(np.ones(m), smooth=smooth, steps=steps, order=order, hold=hold)


@lru_cache(maxsize=256)
def _inverse_matrix(m: int, smooth: float, lam: float, order: int, steps: int) -> Array:
    """The matrix (m, m) from points to targets."""
    solver = _uniform(m, smooth, order, steps)
    response = solver.at_targets(solver.coarse(np.eye(m)))
    ridge = lam * np.eye(m)
    return np.asarray(np.linalg.solve(response.T @ response + ridge, response.T + ridge))


def _iterate_targets(solver: Tracker, points: Array, lam: float) -> Array:
    """The same for long plans, by conjugate gradients: the smoothing is well conditioned, so few rounds do."""
    away = points - points[0]
    targets = away.copy()
    residual = _apply_transpose(solver, away - _apply_smoothing(solver, targets))
    direction = residual.copy()
    square = (residual**2).sum(axis=0)
    enough = 1e-24 * max(float((away**2).sum()), 1e-300)
    for _ in range(200):
        if square.sum() <= enough:
            break
        image = _apply_transpose(solver, _apply_smoothing(solver, direction)) + lam * direction
        length = square / np.maximum((direction * image).sum(axis=0), 1e-300)
        targets += length * direction
        residual -= length * image
        before, square = square, (residual**2).sum(axis=0)
        direction = residual + square / np.maximum(before, 1e-300) * direction
    return np.asarray(points[0] + targets)


def _apply_smoothing(solver: Tracker, targets: Array) -> Array:
    return solver.at_targets(solver.chain.solve(solver.weights[:, None] * np.repeat(targets, solver.grid, axis=0)))


def _apply_transpose(solver: Tracker, errors: Array) -> Array:
    push = np.zeros((len(solver.weights), errors.shape[1]))
    first = np.arange(1, len(errors) - 1) * solver.grid
    for half in (solver.grid // 2, (solver.grid - 1) // 2):
        push[first + half] += 0.5 * errors[1:-1]
    push[0], push[-1] = errors[0], errors[-1]
    pulled = solver.weights[:, None] * solver.chain.solve(push)
    return np.asarray(pulled.reshape(len(errors), solver.grid, -1).sum(axis=1))
