"""The smoothest path near a chain of Gaussian targets: its mean, and samples of it.

One dimensionless knob, ``smooth`` (smoothing time over the interval of the targets), sets effort against precision;
the path then depends on no unit of length or time.

Source: seed 003, §3 (eq. 6, 9, 14–21 corrected).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from handout.libraries import interpolate
from handout.motion import covariance
from handout.motion.banded import Chain, End, factorise
from handout.values import Array

Ends = Literal["fixed", "free", "rest"]

ORDER = 4  # the derivative that is the effort: snap
STEPS = 20  # samples an interval
# The error of a band solve is about 1e-16 times its condition number, (2 · smooth · steps)^(2 · order); beyond this
# the path is solved on a coarser grid and upsampled
STIFFEST = 1e10
# Marginal covariances are found in blocks of targets with some context on either side, so that time stays linear
_BLOCK, _CONTEXT = 16, 8

_ENDS: dict[str, tuple[End, End]] = {"fixed": ("fixed", "free"), "free": ("free", "free"), "rest": ("rest", "rest")}


# what remains of the damping in the direction that a guide leads along; it keeps the inverse of eq. 21 finite
_EASE = 0.0025


@dataclass(frozen=True, eq=False)
class Guide:
    """What the velocity is held to, besides the targets: a direction in which a movement is drawn, or which it avoids.

    A guide damps the velocity across its direction ("along": the pen is led along it) or in its direction ("avoid").
    With the strength g the velocity in the damped direction is smoothed away over g intervals.

    direction : (2,) or (m, 2) float: unit vectors, for all or for each target's interval.
    strength : smoothing time over the interval, 0 or more; .3 is felt, 2 rules.
    mode : "along" damps the velocity across `direction`, "avoid" that along it.
    wanted : (2,) or (m, 2) float, length an interval, optional: the velocity that is wanted instead of none.

    Source: seed 003, §3.4, eq. 18–21.  Taken as printed, the precision v vᵀ damps the movement along v, which is what
    "avoid" does; the text describes the opposite, "along", whose precision is (v vᵀ + ε I)⁻¹ but for a factor.
    """

    direction: Array
    strength: float
    mode: Literal["along", "avoid"] = "along"
    wanted: Array | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.strength <= 100:
            raise ValueError(f"strength = {self.strength:g} is outside 0 to 100")
        size = np.linalg.norm(self.direction, axis=-1)
        if not np.allclose(size, 1.0, atol=1e-6):
            raise ValueError("a guide's directions must be unit vectors")

    def precisions(self, targets: int, grid: int) -> Array:
        """(N − 1, 2, 2): precision of every step of N = targets · grid samples."""
        along = np.broadcast_to(np.asarray(self.direction, dtype=np.float64), (targets, 2))
        held = along[:, :, None] * along[:, None, :]
        if self.mode == "along":
            held = np.eye(2) - (1 - _EASE) * held
        return np.asarray((self.strength * grid) ** 2 * _step_values(held, grid))

    def force(self, precisions: Array, grid: int) -> Array | float:
        """(N, 2): what the wanted velocity pushes the samples with; 0 where none is wanted."""
        if self.wanted is None:
            return 0.0
        targets = (len(precisions) + 1) // grid
        step = _step_values(np.broadcast_to(self.wanted, (targets, 2)) / grid, grid)
        push = np.einsum("tij,tj->ti", precisions, step)
        force = np.zeros((len(precisions) + 1, 2))
        force[1:] += push
        force[:-1] -= push
        return force


def _step_values(values: Array, grid: int) -> Array:
    """Values (m, …) of intervals from one target's centre to the next, for each step of m · grid samples."""
    interval = np.clip((np.arange(len(values) * grid - 1) + 1 - grid // 2) // grid, 0, len(values) - 1)
    return np.asarray(values[interval])


@dataclass(frozen=True, eq=False)
class Tracker:
    """A chain of targets whose precisions are known and factorised; what is left to give is where they are.

    precision : (m,) or (m, D, D) float, relative: about 1.
    steps, grid : samples an interval wanted, and solved for (fewer where the problem is too stiff).
    guide : what the velocity is held to, besides the targets; `velocity` (N − 1, D, D) is its precision of each step.
    """

    precision: Array
    weights: Array
    chain: Chain
    smooth: float
    order: int
    steps: int
    grid: int
    ends: Ends
    guide: Guide | None = None
    velocity: Array | None = None

    def path(self, targets: Array) -> Array:
        """The mean path (m·steps, D) of targets (m, D)."""
        if len(targets) == 1:
            return np.repeat(targets, self.steps, axis=0)
        return self.refine(self.coarse(targets))

    def coarse(self, targets: Array) -> Array:
        """The mean path (m·grid, D) on the grid of the solve."""
        origin = targets[0]  # solved about it, so that a far-away page costs no digits
        away = np.repeat(targets - origin, self.grid, axis=0)
        force = self.weights[:, None] * away if self.weights.ndim == 1 else np.einsum("tij,tj->ti", self.weights, away)
        if self.guide is not None and self.velocity is not None:
            force = force + self.guide.force(self.velocity, self.grid)
        return np.asarray(origin + self.chain.solve(force))

    def at_targets(self, coarse: Array) -> Array:
        """The path where it should be at its targets: (m, …) at their centres, the first and last at the ends."""
        at = centres(coarse, self.grid)
        at[0], at[-1] = coarse[0], coarse[-1]
        return at

    def refine(self, coarse: Array) -> Array:
        """A path on the grid of the solve, brought to the wanted number of steps by a spline."""
        if self.grid == self.steps:
            return coarse
        m = len(coarse) // self.grid
        coarse_times = (np.arange(m * self.grid) + 0.5) / self.grid
        wanted = (np.arange(m * self.steps) + 0.5) / self.steps
        start, end = _ENDS[self.ends]
        lowest = coarse_times[0] if start != "free" else -np.inf
        highest = coarse_times[-1] if end != "free" else np.inf
        spline = interpolate.make_interp_spline(coarse_times, coarse, k=min(5, 2 * ((len(coarse_times) - 1) // 2) - 1))
        return np.asarray(spline(np.clip(wanted, lowest, highest)))

    def noise(self, rng: np.random.Generator, dimensions: int) -> Array:
        """A draw (m·steps, D) of the deviation from the mean, of unit relative covariance at the targets' centres.

        The posterior has a covariance that depends on the grid and shrinks near the ends; it is scaled to what was
        asked for by a gain that changes slowly along the path.
        """
        m = len(self.precision)
        blocks = self.precision.ndim == 3
        wanted: Array = np.asarray(np.linalg.inv(self.precision) if blocks else 1.0 / self.precision, dtype=np.float64)
        if m == 1:
            return np.repeat(covariance.draw(_matrices(wanted, dimensions), rng), self.steps, axis=0)
        size = self.bandwidth_gain()
        drawn = size * self.chain.noise(rng, dimensions)
        have = size**2 * self._centre_covariances
        if self.ends == "fixed":
            first = covariance.draw(_matrices(wanted[:1], dimensions), rng)[0]
            drawn += self.chain.solve(np.zeros_like(drawn), first)
            have = have + self._start_covariances(wanted[0])
        return self.refine(_scale_path(drawn, have, wanted, self.grid))

    def bandwidth_gain(self) -> float:
        """Standard deviation of one target's sample over that of the posterior path, far from the ends."""
        return math.sqrt(2 * self.order * math.sin(math.pi / (2 * self.order)) * self.grid * self.smooth)

    @cached_property
    def _centre_covariances(self) -> Array:
        """(m,) or (m, D, D): covariance of the posterior at every target's centre."""
        m = len(self.precision)
        blocks = [self._block_covariances(low, min(low + _BLOCK, m)) for low in range(0, m, _BLOCK)]
        return np.concatenate(blocks)

    def _block_covariances(self, low: int, high: int) -> Array:
        m, grid = len(self.precision), self.grid
        left, right = max(low - _CONTEXT, 0), min(high + _CONTEXT, m)
        start, end = _ENDS[self.ends]
        part = factorise(
            self.weights[left * grid : right * grid],
            (self.smooth * grid) ** (2 * self.order),
            self.order,
            start if left == 0 else "free",
            end if right == m else "free",
            None if self.velocity is None else self.velocity[left * self.grid : right * self.grid - 1],
        )
        count, d = high - low, part.dimensions
        push = np.zeros(((right - left) * grid, d, count, d))
        for i in range(count):
            sample = (low + i - left) * grid
            for half in (sample + grid // 2, sample + (grid - 1) // 2):
                push[half, :, i] += 0.5 * np.eye(d)
        answer = part.solve(push.reshape(len(push), *((d, -1) if self.precision.ndim == 3 else (-1,))))
        at = centres(answer.reshape(push.shape), grid)[low - left : high - left]
        diagonal = at[np.arange(count), :, np.arange(count)]
        return diagonal if self.precision.ndim == 3 else diagonal[:, 0, 0]

    def _start_covariances(self, first: Array) -> Array:
        """What the draw of a fixed start, of covariance `first`, adds to those of the centres."""
        d = self.chain.dimensions
        shape = (len(self.weights), d, d) if self.precision.ndim == 3 else (len(self.weights), 1)
        unit = np.eye(d) if self.precision.ndim == 3 else np.ones(1)
        answer = centres(self.chain.solve(np.zeros(shape), unit), self.grid)
        if self.precision.ndim == 3:
            return np.asarray(answer @ first @ np.swapaxes(answer, 1, 2))
        return np.asarray(answer[:, 0] ** 2 * first)


def tracker(
    precision: Array,
    *,
    smooth: float,
    steps: int = STEPS,
    order: int = ORDER,
    ends: Ends = "rest",
    hold: float = 1.0,
    guide: Guide | None = None,
) -> Tracker:
    """Factorise the problem of following targets of the given relative precisions (m,) or (m, D, D).

    `hold` multiplies the precision over the first and the last half interval.  A `guide` needs targets in the plane.

    Raises ValueError: an order outside 2–5, too few steps for it, or a smoothness outside 0.01–2.
    """
    if order not in (2, 3, 4, 5):
        raise ValueError(f"order = {order} is outside 2 to 5")
    if steps <= order:
        raise ValueError(f"steps = {steps} is too few for order {order}: at least {order + 1} are needed")
    if not 0.01 <= smooth <= 2:
        raise ValueError(f"smooth = {smooth:g} is outside 0.01 to 2")
    grid = max(order + 1, min(steps, int(STIFFEST ** (0.5 / order) / (2 * smooth))))
    if guide is not None:
        precision = _matrices(precision, 2)
    weights = np.repeat(precision, grid, axis=0)
    if hold != 1.0:
        weights[: grid // 2] *= hold
        weights[len(weights) - grid // 2 :] *= hold
    start, end = _ENDS[ends] if len(precision) > 1 else ("free", "free")
    velocity = None if guide is None else guide.precisions(len(precision), grid)
    chain = factorise(weights, (smooth * grid) ** (2 * order), order, start, end, velocity)
    return Tracker(precision, weights, chain, smooth, order, steps, grid, ends, guide, velocity)


def mean(
    targets: ArrayLike,
    covariances: ArrayLike | None = None,
    *,
    smooth: float,
    steps: int = STEPS,
    order: int = ORDER,
    ends: Ends = "rest",
    guide: Guide | None = None,
) -> Array:
    """The path of least effort near Gaussian targets.

    targets : (m, D) float: means of the targets, one an interval.
    covariances : (m, D, D) float, optional: their covariances; only their sizes relative to each other matter.
        Default: all alike, round.
    smooth : smoothing time over the interval: below .1 the path dwells at each target, .2–.3 gives one speed peak a
        target, from .4 on targets are cut.
    steps : samples an interval.
    order : which derivative is the effort: 2–5 (4: snap).
    ends : {"fixed", "free", "rest"}: "fixed": starts at rest in the first target's mean, ends anywhere; "free": any
        state at both ends; "rest": at rest at both ends, near the first and the last target.
    guide : what the velocity is held to; for targets in the plane.

    Returns (m·steps, D) float: positions; target i has its centre between samples i·steps and (i+1)·steps − 1.

    Source: seed 003, §3.1, eq. 6–14 (as one banded system in the positions), and eq. 18–21 for a guide.
    """
    where, precision, _ = _check_targets(targets, covariances)
    return tracker(precision, smooth=smooth, steps=steps, order=order, ends=ends, guide=guide).path(where)


def sample(
    targets: ArrayLike,
    covariances: ArrayLike,
    rng: np.random.Generator,
    *,
    smooth: float,
    jitter: float = 1.0,
    steps: int = STEPS,
    order: int = ORDER,
    ends: Ends = "rest",
) -> Array:
    """One draw (m·steps, D) of the path; at the centre of target i its covariance is ``jitter² covariances[i]``.

    Other parameters as in `mean`.

    Source: seed 003, §3.2, eq. 16–17 (band Cholesky factor instead of eigenvectors).
    """
    where, precision, size = _check_targets(targets, covariances)
    solver = tracker(precision, smooth=smooth, steps=steps, order=order, ends=ends)
    return np.asarray(solver.path(where) + jitter * size * solver.noise(rng, where.shape[1]))


def relative(covariances: Array) -> tuple[Array, float]:
    """Precisions (m, D, D) relative to the geometric mean of all standard deviations, and that mean."""
    _, logarithms = np.linalg.slogdet(covariances)
    size = math.exp(float(logarithms.mean()) / (2 * covariances.shape[1]))
    return np.asarray(np.linalg.inv(covariances / size**2)), size


def _check_targets(targets: ArrayLike, covariances: ArrayLike | None) -> tuple[Array, Array, float]:
    where = np.asarray(targets, dtype=np.float64)
    if where.ndim != 2 or len(where) == 0 or not np.isfinite(where).all():
        raise ValueError(f"expected finite targets of shape (m, D) with m ≥ 1, got {where.shape}")
    if covariances is None:
        return where, np.ones(len(where)), 1.0
    return where, *relative(covariance.settle_covariances(covariances, where))


def centres(path: Array, grid: int) -> Array:
    """Entries of a path (m·grid, …) at the centres of its targets, (m, …)."""
    first = np.arange(len(path) // grid) * grid
    return np.asarray(0.5 * (path[first + grid // 2] + path[first + (grid - 1) // 2]))


def _matrices(variances: Array, dimensions: int) -> Array:
    """Covariances (m, D, D) from themselves, or from the variances (m,) of round ones."""
    return variances if variances.ndim == 3 else variances[:, None, None] * np.eye(dimensions)


def _scale_path(path: Array, have: Array, wanted: Array, grid: int) -> Array:
    """Scale a path so that its covariances at the centres turn from `have` into `wanted`."""
    if have.ndim == 1:
        gain = np.sqrt(wanted / have)
        return path * _between_centres(gain, len(path), grid)[:, None]
    side = covariance.root(have)
    inner = covariance.root(side @ wanted @ side)
    inverse = np.linalg.inv(side)
    return np.asarray(np.einsum("tij,tj->ti", _between_centres(inverse @ inner @ inverse, len(path), grid), path))


def _between_centres(values: Array, samples: int, grid: int) -> Array:
    """Values (m, …) at the centres, interpolated linearly to all samples and constant before and after."""
    position = np.clip((np.arange(samples) + 0.5) / grid - 0.5, 0, len(values) - 1)
    low = np.minimum(position.astype(np.intp), len(values) - 2)
    part = (position - low).reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray((1 - part) * values[low] + part * values[low + 1])
