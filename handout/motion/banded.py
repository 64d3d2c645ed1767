"""The linear-quadratic tracker, solved for positions only.

A chain of `order` integrators driven by forward differences has the control ``u_t = (Δⁿ x)_t / dtⁿ``, so the whole
optimal control problem is one quadratic form in the positions, and its Hessian is symmetric, positive definite and
banded.  A band Cholesky factor then gives the mean and exact samples in time linear in the length, where the dense
batch solution is cubic and has lost all its digits after some ten targets.

Source: seed 003, §3.1–3.2 (eq. 9 corrected: ω = 2π/Ts; eq. 14 corrected: its second arguments are precisions).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from handout.libraries import lapack
from handout.values import Array

End = Literal["free", "rest", "fixed"]


@dataclass(frozen=True, eq=False)
class Chain:
    """A factorised quadratic form in the positions of N samples in D dimensions.

    At an end at rest the first (last) `order` samples are one unknown, which makes the rest exact and keeps the
    band: `before` (`after`) samples are repetitions of the first (last) unknown.  `factor` is the lower band
    Cholesky factor over the unknowns, interleaved by dimension; `dimensions` is 1 where all dimensions share it.
    A fixed start is left out of the factor; its `coupling` to the unknowns that follow is kept instead.
    """

    factor: Array
    before: int
    after: int
    dimensions: int
    coupling: Array | None

    def solve(self, force: Array, start: Array | None = None) -> Array:
        """Positions (N, D) that answer the generalised force (N, D); `start` (D,) where the chain fixes it."""
        rhs = _gather(force, self.before, self.after)
        if self.coupling is not None:
            rhs = rhs[1:]
            if start is not None:
                reach = min(len(self.coupling), len(rhs))
                rhs[:reach] -= np.multiply.outer(self.coupling[:reach], start)
        flat = rhs if self.dimensions == 1 else rhs.reshape(self.factor.shape[1], -1)
        solved, _ = lapack.dpbtrs(self.factor, flat, lower=1, overwrite_b=1)
        return self._unfold(solved.reshape(rhs.shape), start)

    def noise(self, rng: np.random.Generator, dimensions: int) -> Array:
        """One draw (N, `dimensions`) from N(0, H⁻¹), by back substitution in the factor; a fixed start stays put."""
        columns = dimensions if self.dimensions == 1 else 1
        white = rng.standard_normal((self.factor.shape[1], columns))
        drawn, _ = lapack.dtbtrs(self.factor, white, uplo="L", trans="T", diag="N")
        return self._unfold(drawn.reshape(-1, dimensions), None)

    def _unfold(self, unknowns: Array, start: Array | None) -> Array:
        """Positions of all samples from those of the unknowns."""
        if self.coupling is not None:
            first = np.zeros(unknowns.shape[1:]) if start is None else start
            unknowns = np.concatenate([first[None], unknowns])
        head = np.repeat(unknowns[:1], self.before, axis=0)
        tail = np.repeat(unknowns[-1:], self.after, axis=0)
        return np.concatenate([head, unknowns, tail])


def factorise(
    weights: Array, stiffness: float, order: int, start: End, end: End, velocity: Array | None = None
) -> Chain:
    """Factorise ``H = blockdiag(weights) + stiffness · Δⁿ'Δⁿ + Δ' blockdiag(velocity) Δ`` under end conditions.

    weights : (N,) or (N, D, D) float: precision of each sample's target.
    stiffness : weight of the squared differences: ``(smooth · steps)^(2 order)`` where the weights are about 1.
    order : order of the chain of integrators; N ≥ 2 order.
    start, end : {"free", "rest", "fixed"}: "rest": the first (last) `order` samples coincide; "fixed" (start only): at
        a given place.
    velocity : (N − 1, D, D) float, optional: precision of each step from one sample to the next; needs weights of shape
        (N, D, D).

    Raises numpy.linalg.LinAlgError: so stiff that the form is singular to working precision.
    """
    before, after = (order - 1 if kind != "free" else 0 for kind in (start, end))
    gathered = _gather(weights, before, after)
    band = _whole_band(stiffness * _difference_band(len(weights), before, after, order), gathered)
    if velocity is not None:
        # add Δ' blockdiag(velocity) Δ; samples that share an unknown take no step
        d = velocity.shape[1]
        step = velocity[before : len(velocity) - after]
        first = np.arange(len(step)) * d
        for i in range(d):
            for j in range(d):
                band[d + i - j, first + j] -= step[:, i, j]
                if i >= j:
                    band[i - j, first + j] += step[:, i, j]
                    band[i - j, first + d + j] += step[:, i, j]
    dimensions = 1 if weights.ndim == 1 else weights.shape[1]
    coupling = None
    if start == "fixed":
        coupling = band[dimensions::dimensions, 0].copy()
        band = band[:, dimensions:]
    factor, unlike = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
    if unlike:
        raise np.linalg.LinAlgError(f"the form is not positive definite from unknown {unlike} on")
    return Chain(factor, before, after, dimensions, coupling)


def _gather(values: Array, before: int, after: int) -> Array:
    """Add up what belongs to one unknown: the first `before` + 1 and the last `after` + 1 entries."""
    gathered = values[before : len(values) - after].copy()
    gathered[0] += values[:before].sum(axis=0)
    gathered[-1] += values[len(values) - after :].sum(axis=0)
    return gathered


def _difference_band(samples: int, before: int, after: int, order: int) -> Array:
    """Lower band (order + 1, unknowns) of Δⁿ'Δⁿ, where samples that share an unknown are added together."""
    stencil = np.array([1.0])
    for _ in range(order):
        stencil = np.convolve(stencil, [-1.0, 1.0])
    unknowns, rows = samples - before - after, samples - order
    column = np.clip(np.arange(samples) - before, 0, unknowns - 1)
    first = column[:rows]
    local = np.zeros((rows, order + 1))
    for i, coefficient in enumerate(stencil):
        local[np.arange(rows), column[i : i + rows] - first] += coefficient
    band = np.zeros((order + 1, unknowns + order))
    for k in range(order + 1):
        for i in range(order + 1 - k):
            band[k] += np.bincount(first + i, local[:, i] * local[:, i + k], minlength=unknowns + order)
    return band[:, :unknowns]


def _whole_band(differences: Array, weights: Array) -> Array:
    """Lower band of the Hessian: the differences in every dimension, the weights on the diagonal."""
    if weights.ndim == 1:
        band = differences.copy()
        band[0] += weights
        return band
    unknowns, d = weights.shape[:2]
    band = np.zeros(((len(differences) - 1) * d + 1, unknowns * d))
    for axis in range(d):
        band[::d, axis::d] += differences
        for other in range(axis + 1):
            band[axis - other, other::d] += weights[:, axis, other]
    return band
