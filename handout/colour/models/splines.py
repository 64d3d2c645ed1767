"""Polyharmonic splines through the patches of a chart, smoothed by as much as the patches are known to be uncertain.

A spline is Σ wᵢ φ(|x − xᵢ|) + a polynomial.  Smoothing is the estimation of a random function with the generalised
covariance φ from values with known variances: its strength is the one under which the data are most likely once the
polynomial is taken out (restricted likelihood), so it follows the measured noise and no patch is left out for it.

Source: Bookstein 1989 (thin plates); Duchon 1977 (polyharmonic kernels); Wahba 1990, §4.9 (generalised maximum
likelihood); Patterson and Thompson 1971 (restricted likelihood).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handout.branching import number_pieces
from handout.libraries import optimize, spatial
from handout.values import Array

CLOSE = 0.5 / 255  # colours nearer than this are one: a spline through both would have to jump
_FLOOR = 0.02 / 255  # no patch mean is known better
_REPEATS = 5  # degrees of freedom that a noise measured from repeats must have


class PreparedSamples(NamedTuple):
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
    variances = deviation**2
    usual = float(np.median(variances[np.isfinite(variances)])) if np.isfinite(variances).any() else 0.0
    variances = np.where(np.isfinite(variances), variances, usual)
    return np.maximum(np.maximum(variances, repeated), _FLOOR**2)


def merge_close_rows(x: Array, y: Array, variances: Array) -> PreparedSamples:
    """Merge rows whose `x` are closer than `CLOSE`, each weighted by how well it is known."""
    group = number_pieces(spatial.KDTree(x).query_pairs(CLOSE, output_type="ndarray"), len(x))
    weight = 1 / variances
    total = np.bincount(group, weight)

    def mean(rows: Array) -> Array:
        return np.column_stack([np.bincount(group, weight * column) / total for column in rows.T])

    return PreparedSamples(mean(x), mean(y), 1 / total)


_CHUNK = 4096  # points evaluated at a time: the distances to all centres stay in the cache


class Kernel(NamedTuple):
    """φ as a function of squared distances, signed so that it is conditionally positive, and its least polynomial."""

    phi: Callable[[Array], Array]
    degree: int


KERNELS = {
    "r2 log r": Kernel(lambda square: 0.5 * square * np.log(np.maximum(square, 1e-300)), 1),
    "r3": Kernel(lambda square: square * np.sqrt(square), 1),
    "r5": Kernel(lambda square: -square * square * np.sqrt(square), 2),
}


@dataclass(frozen=True, eq=False)
class Spline:
    """A function of colours.

    centres : (m, 3) float.  weights : (m, k) float.  drift : (t, k) float, of the polynomial's terms.
    kernel : one of `KERNELS`.  degree : of the polynomial, 1 or 2.
    """

    centres: Array
    weights: Array
    drift: Array
    kernel: str
    degree: int

    def __call__(self, points: Array) -> Array:
        """(n, k) values at (n, 3) points."""
        out = terms(points, self.degree) @ self.drift
        phi = KERNELS[self.kernel].phi
        for begin in range(0, len(points), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            out[part] += phi(squares(points[part], self.centres)) @ self.weights
        return np.asarray(out)


def squares(first: Array, second: Array) -> Array:
    """(n, m) squared distances of (n, 3) and (m, 3) points."""
    lengths = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1)
    return np.asarray(np.maximum(lengths - 2 * first @ second.T, 0.0))


def terms(points: Array, degree: int) -> Array:
    """(n, 4 or 10) terms of a polynomial of degree 1 or 2 in three variables."""
    x, y, z = points.T
    columns = [np.ones(len(points)), x, y, z]
    if degree == 2:
        columns += [x * x, x * y, x * z, y * y, y * z, z * z]
    return np.column_stack(columns)


def exact(centres: Array, values: Array, kernel: str = "r2 log r") -> Spline:
    """The spline that takes (m, k) `values` at (m, 3) `centres`, which must not coincide or lie in a plane."""
    phi, degree = KERNELS[kernel]
    polynomial = terms(centres, degree)
    m, t = polynomial.shape
    system = np.zeros((m + t, m + t))
    system[:m, :m] = phi(squares(centres, centres))
    system[:m, m:], system[m:, :m] = polynomial, polynomial.T
    solved = np.linalg.solve(system, np.concatenate([values, np.zeros((t, values.shape[1]))]))
    return Spline(centres, solved[:m], solved[m:], kernel, degree)


def smooth(centres: Array, values: Array, variances: Array, kernels: Sequence[str], degree: int) -> Spline:
    """The spline that is most likely, given how uncertain the values are.

    centres : (m, 3) float, different from each other.
    values : (m, k) float.
    variances : (m,) float > 0, of the values' errors, as measured.  If the values scatter more than these say, all are
        raised by one factor for each of the k.
    kernels : the one that makes the data most likely is taken.
    degree : of the polynomial, the same for all kernels, so that their likelihoods may be compared.
    """
    fits = [_fit_kernel(centres, values, variances, kernel, degree) for kernel in kernels]
    return min(fits, key=lambda fit: fit[0])[1]


def _fit_kernel(centres: Array, values: Array, variances: Array, kernel: str, degree: int) -> tuple[float, Spline]:
    """The negative log likelihood (up to what kernels share), and the spline."""
    from scipy.linalg import eigh

    polynomial = terms(centres, degree)
    t = polynomial.shape[1]
    scale = 1 / np.sqrt(variances)
    gram = KERNELS[kernel].phi(squares(centres, centres)) * scale[:, None] * scale
    q, r = np.linalg.qr(polynomial * scale[:, None], mode="complete")
    free, data = q[:, t:], values * scale[:, None]
    inner = free.T @ gram @ free
    spectrum, vectors = eigh((inner + inner.T) / 2, overwrite_a=True, check_finite=False)
    spectrum = np.maximum(spectrum, 0.0)
    components = vectors.T @ (free.T @ data)
    unlikely, strengths = zip(*(_most_likely_strength(spectrum, column) for column in components.T), strict=True)
    strength = np.array(strengths)
    weights = free @ (vectors @ (components * strength / (strength * spectrum[:, None] + 1)))
    left = data - gram @ weights - weights / strength
    drift = np.linalg.solve(r[:t], q[:, :t].T @ left)
    return float(sum(unlikely)), Spline(centres, weights * scale[:, None], drift, kernel, degree)


def _most_likely_strength(spectrum: Array, components: Array) -> tuple[float, float]:
    """The least negative log likelihood, and the variance of the function over that of the errors there."""
    square, largest = components**2, float(spectrum[-1])

    def unlikely(exponent: float) -> float:
        spread = np.exp(exponent) / largest * spectrum + 1
        raised = max(1.0, float((square / spread).mean()))
        return float(len(components) * np.log(raised) + np.log(spread).sum() + (square / spread).sum() / raised)

    tried = np.linspace(-8.0, 45.0, 54)
    best = tried[np.argmin([unlikely(exponent) for exponent in tried])]
    fine = optimize.minimize_scalar(unlikely, bounds=(best - 1, best + 1), method="bounded", options={"xatol": 0.01})
    return float(fine.fun), float(np.exp(fine.x) / largest)
