"""Covariances of targets: how exactly the hand means a point.

A small covariance is a point the pen must reach, a large one a point it may cut; motor noise has the same shape.

Source: seed 003, §3.3 and §4 (oriented and semi-tied covariances).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from handout.values import ActionPlan, Array

# Standard deviation of a plan's targets that has no covariances, as a share of the typical distance of its points
LOOSENESS = 0.05
# No variance is smaller than this share of the squared extent, so that a singular covariance can be inverted
FLOOR = 1e-9


def tie_covariances(basis: ArrayLike, sizes: ArrayLike) -> Array:
    """Covariances (m, D, D) of one shape: ``sizes[i] · basis basisᵀ``.

    The columns of `basis` (D, D) are the axes of the shape, so that all targets share the directions along which the
    hand is loose; `sizes` (m,) > 0 is best drawn from a log-normal distribution.
    """
    shape = np.asarray(basis, dtype=np.float64)
    return np.asarray(np.asarray(sizes, dtype=np.float64)[:, None, None] * (shape @ shape.T))


def plan_covariances(plan: ActionPlan) -> Array:
    """The plan's covariances (m, 2, 2), mm²; where it has none, circles in proportion to its step."""
    if plan.spread is not None:
        return settle_covariances(plan.spread, plan.points)
    steps = np.diff(plan.points, axis=0)
    square = float((steps**2).sum() / max(len(steps), 1))
    return np.broadcast_to(LOOSENESS**2 * square * np.eye(2), (len(plan.points), 2, 2))


def settle_covariances(covariances: ArrayLike, targets: Array) -> Array:
    """Covariances (m, D, D) made symmetric and invertible, by a floor far below the extent of the `targets`.

    Raises ValueError: shape other than (m, D, D), or a matrix that is not positive semi-definite.
    """
    matrices = np.asarray(covariances, dtype=np.float64)
    m, d = targets.shape
    if matrices.shape != (m, d, d):
        raise ValueError(f"expected covariances of shape {(m, d, d)}, got {matrices.shape}")
    matrices = 0.5 * (matrices + np.swapaxes(matrices, 1, 2))
    largest = float(np.abs(matrices).max())
    if not np.isfinite(largest):
        raise ValueError("expected finite covariances")
    variances, axes = np.linalg.eigh(matrices)
    if variances.min() < -1e-9 * largest:
        raise ValueError(f"covariance {int(variances.min(axis=1).argmin())} is not positive semi-definite")
    floor = FLOOR * (float(np.ptp(targets, axis=0).max()) ** 2 or largest or 1.0)
    low = variances[:, 0] < floor
    lifted = (axes[low] * np.maximum(variances[low], floor)[:, None, :]) @ np.swapaxes(axes[low], 1, 2)
    matrices[low] = lifted
    return matrices


def draw(covariances: Array, rng: np.random.Generator) -> Array:
    """One independent draw (m, D) from every N(0, Σ)."""
    noise = rng.standard_normal(covariances.shape[:2])
    return np.asarray((root(covariances) @ noise[..., None])[..., 0])


def root(matrices: Array) -> Array:
    """The symmetric square roots of symmetric positive semi-definite matrices (…, D, D)."""
    values, vectors = np.linalg.eigh(matrices)
    scaled = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    return np.asarray(scaled @ np.swapaxes(vectors, -1, -2))
