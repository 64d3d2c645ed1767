"""Light that falls off over a page, seen in white and grey patches that come again and again, and taken out.

Light and lens act on all colours by a factor.  The factor is a polynomial of the place, of the degree that predicts
patches best that it was not fitted to; with no shading that is a constant, and nothing is changed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, readonly

_DEGREES = (0, 1, 2, 3)
_AGAIN = 4  # times that a colour must come to be of use
_ROUNDS = 8
_DARKEST = 0.08  # values below it are mostly the scanner's own stray light


@dataclass(frozen=True, eq=False)
class Field:
    """The factor over a page.

    coefficients : (terms, 3), of the logarithm; no terms: 1 everywhere.
    degree : of the polynomial.
    middle, half : (2,) mm, the place and size that it is counted in.
    """

    coefficients: Array
    degree: int
    middle: Array
    half: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", readonly(self.coefficients, None, 3))

    def at(self, mm: Array) -> Array:
        """(n, 3) factors at points (n, 2) in mm."""
        return np.asarray(np.exp(_terms((mm - self.middle) / self.half, self.degree) @ self.coefficients))


def field_of(values: Array, device: Array, mm: Array, usable: NDArray[np.bool_]) -> Field:
    """The shading of a page.

    Parameters
    ----------
    values : (n, 3)
        What was read of the patches, 0–1.
    device : (n, 3)
        What was printed.
    mm : (n, 2)
        Middles of the patches.
    usable : (n,) bool

    Returns
    -------
    Field
        With a mean of 1 over the patches.
    """
    low, high = mm.min(axis=0), mm.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    colours, group = np.unique(device, axis=0, return_inverse=True)
    group = group.ravel()
    neutral = (np.ptp(colours, axis=1) == 0) & (np.bincount(group[usable], minlength=len(colours)) >= _AGAIN)
    chosen = usable & neutral[group] & (values > _DARKEST).all(axis=1)
    none = Field(np.zeros((0, 3)), 0, middle, half)
    if chosen.sum() < 3 * _AGAIN:
        return none
    levels = np.equal.outer(group[chosen], np.unique(group[chosen])).astype(np.float64)
    target, spot = np.log(values[chosen]), (mm[chosen] - middle) / half
    best, score = none, np.inf
    for degree in _DEGREES:
        design = np.hstack([levels, _terms(spot, degree)])
        if len(design) < 2 * design.shape[1]:
            break
        fitted, left_out = _robust(design, target)
        # a higher degree has to be clearly better: each one more bends more between the patches
        if left_out < 0.98 * score:
            score, best = left_out, Field(fitted[levels.shape[1] :], degree, middle, half)
    shift = np.log(best.at(mm)).mean(axis=0)
    return _shifted(best, shift)


def _shifted(field: Field, shift: Array) -> Field:
    """The same with a constant taken off its logarithm."""
    if field.degree == 0:
        return field
    coefficients = np.array(field.coefficients)
    # the constant is the last of the terms
    coefficients[-1] -= shift
    return Field(coefficients, field.degree, field.middle, field.half)


def _terms(spot: Array, degree: int) -> Array:
    """(n, terms): products of powers of x and y, the constant (which fitting leaves at 0) last; none for degree 0."""
    if degree == 0:
        return np.zeros((len(spot), 0))
    powers = [(i, total - i) for total in range(1, degree + 1) for i in range(total + 1)]
    columns = [spot[:, 0] ** i * spot[:, 1] ** j for i, j in powers]
    return np.column_stack([*columns, np.ones(len(spot))])


def _robust(design: Array, target: Array) -> tuple[Array, float]:
    """Least squares (p, 3) that outliers do not move, and the mean absolute error at points left out."""
    weight = np.ones(len(design))
    answer: Array = np.zeros((design.shape[1], target.shape[1]))
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)[:, None]
        answer = np.asarray(np.linalg.lstsq(design * root, target * root, rcond=None)[0], dtype=np.float64)
        off = np.abs(target - design @ answer).max(axis=1)
        scale = max(1.4826 * float(np.median(off)), 1e-6)
        weight = np.minimum(1.0, 2 * scale / np.maximum(off, 1e-9))
    inverse = np.linalg.pinv((design * weight[:, None]).T @ design)
    leverage = np.einsum("ij,jk,ik->i", design, inverse, design) * weight
    error = np.abs(target - design @ answer).max(axis=1) / np.maximum(1 - leverage, 0.05)
    return answer, float(np.minimum(error, 6 * np.median(error)).mean())
