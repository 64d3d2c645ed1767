"""Slow, straightforward solutions of the problems that handout.motion solves quickly: what it is measured against.

None of them shares code with it.  Forward Euler throughout, Ts = 1, so that the control is the n-th difference.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

Array = NDArray[np.float64]


def system(order: int, dimensions: int, dt: float) -> tuple[Array, Array]:
    """A (nD, nD) and B (nD, D) of a chain of integrators, forward Euler."""
    a = np.eye(order) + dt * np.eye(order, k=1)
    b = np.zeros((order, 1))
    b[-1] = dt
    return np.kron(a, np.eye(dimensions)), np.kron(b, np.eye(dimensions))


def control_cost(covariances: Array, smooth: float, order: int) -> float:
    """The weight of the squared control that belongs to a smoothing time of `smooth` intervals (Ts = 1)."""
    deviations = np.sqrt(np.linalg.eigvalsh(covariances))
    return float(smooth ** (2 * order) / np.exp(np.log(deviations).mean()) ** 2)


def riccati(targets: Array, covariances: Array, smooth: float, steps: int, order: int) -> Array:
    """The optimal path (N, D) from rest at the first target, by the backward Riccati recursion."""
    m, d = targets.shape
    a, b = system(order, d, 1 / steps)
    cost = control_cost(covariances, smooth, order) * np.eye(d)
    precision = np.linalg.inv(covariances)
    goal, weight = np.repeat(targets, steps, axis=0), np.repeat(precision, steps, axis=0)
    n = m * steps
    value, pull = np.zeros((order * d, order * d)), np.zeros(order * d)
    value[:d, :d], pull[:d] = weight[-1], weight[-1] @ goal[-1]
    gains, offsets = np.zeros((n - 1, d, order * d)), np.zeros((n - 1, d))
    for t in range(n - 2, -1, -1):
        through = b.T @ value
        inverse = np.linalg.inv(cost + through @ b)
        gains[t], offsets[t] = inverse @ (through @ a), inverse @ (b.T @ pull)
        closed = a - b @ gains[t]
        pull = closed.T @ pull
        value = a.T @ value @ closed
        value = 0.5 * (value + value.T)
        value[:d, :d] += weight[t]
        pull[:d] += weight[t] @ goal[t]
    state = np.zeros(order * d)
    state[:d] = targets[0]
    path = np.zeros((n, d))
    path[0] = targets[0]
    for t in range(n - 1):
        state = a @ state + b @ (offsets[t] - gains[t] @ state)
        path[t + 1] = state[:d]
    return path


def dense_batch(targets: Array, covariances: Array, smooth: float, steps: int, order: int) -> Array:
    """The same by single shooting: one dense least-squares problem in all controls (the textbook's solution)."""
    m, d = targets.shape
    n = m * steps
    a, b = system(order, d, 1 / steps)
    look = np.zeros((d, order * d))
    look[:, :d] = np.eye(d)
    power, responses, free = look, np.zeros((n, d, d)), np.zeros((n, d, order * d))
    for t in range(n):
        responses[t], free[t] = power @ b, power
        power = power @ a
    shooting = np.zeros((n * d, (n - 1) * d))
    for j in range(n - 1):
        shooting[(j + 1) * d :, j * d : (j + 1) * d] = responses[: n - 1 - j].reshape(-1, d)
    weight = np.repeat(np.linalg.inv(covariances), steps, axis=0)
    start = np.zeros(order * d)
    start[:d] = targets[0]
    away = np.repeat(targets, steps, axis=0) - free @ start
    weighted = np.einsum("tij,tjk->tik", weight, shooting.reshape(n, d, -1)).reshape(n * d, -1)
    hessian = shooting.T @ weighted
    hessian[np.diag_indices_from(hessian)] += control_cost(covariances, smooth, order)
    controls = linalg.solve(hessian, weighted.T @ away.reshape(-1), check_finite=False)
    return np.asarray((free @ start) + (shooting @ controls).reshape(n, d))


def dense_covariance(weights: Array, stiffness: float, order: int, ends: str) -> Array:
    """(N·D, N·D): covariance of the path for the density exp(−J/2), from dense matrices, samples before dimensions.

    With free ends or ends at rest it also maps weighted targets to the mean.
    """
    n, d = weights.shape[:2]
    differences = np.diff(np.eye(n), order, axis=0)
    tied = np.eye(n)
    if ends == "rest":
        tied = np.zeros((n, n - 2 * (order - 1)))
        tied[np.arange(n), np.clip(np.arange(n) - (order - 1), 0, n - 2 * order + 1)] = 1
    if ends == "fixed":
        tied = np.eye(n)[:, order:]
    wide = np.kron(tied, np.eye(d))
    hessian = linalg.block_diag(*weights) + stiffness * np.kron(differences.T @ differences, np.eye(d))
    return np.asarray(wide @ np.linalg.solve(wide.T @ hessian @ wide, wide.T))
