"""Patches made ready for a spline: repeats averaged, neighbours too close to tell apart merged, noise measured."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from handout.values import Array

CLOSE = 0.5 / 255  # colours nearer than this are one: a spline through both would have to jump
_FLOOR = 0.02 / 255  # no patch mean is known better
_REPEATS = 5  # degrees of freedom that a noise measured from repeats must have


class Prepared(NamedTuple):
    """x : (m, 3) and y : (m, 3) float, averaged; variances : (m,) float, of the errors of scanned values."""

    x: Array
    y: Array
    variances: Array


def noise(device: Array, scanned: Array, deviation: Array) -> Array:
    """(n,) variance of the error of each scanned mean: what repeats say, or the means' own errors if greater.

    Repeats that lie apart on the page hold what flat-fielding left of shading, which a standard error does not.
    """
    _, group = np.unique(device, axis=0, return_inverse=True)
    group = group.ravel()
    count = np.bincount(group)
    centred = scanned - np.column_stack([np.bincount(group, c) / count for c in scanned.T])[group]
    freedom = 3 * int((count - 1).sum())
    repeated = float((centred**2).sum() / freedom) if freedom >= 3 * _REPEATS else 0.0
    own = deviation**2
    usual = float(np.median(own[np.isfinite(own)])) if np.isfinite(own).any() else 0.0
    own = np.where(np.isfinite(own), own, usual)
    return np.maximum(np.maximum(own, repeated), _FLOOR**2)


def merged(x: Array, y: Array, variances: Array) -> Prepared:
    """Rows whose `x` are closer than `CLOSE` become one row, each weighted by how well it is known."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    pairs = KDTree(x).query_pairs(CLOSE, output_type="ndarray")
    joined = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(x), len(x)))
    group = connected_components(joined, directed=False)[1]
    weight = 1 / variances
    total = np.bincount(group, weight)

    def mean(rows: Array) -> Array:
        return np.column_stack([np.bincount(group, weight * column) / total for column in rows.T])

    return Prepared(mean(x), mean(y), 1 / total)
