"""Fits a plan of lognormal strokes to the shape of a trace alone.

First the key points give a guess; then the virtual targets are solved by linear least squares, since the path is linear
in them; then Gauss–Newton steps on the distances across the path refine targets, bends and overlaps.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from handout.libraries import optimize
from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.reconstruction import key_points
from handout.motion.reconstruction.key_points import Index, extent, resample_path
from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.sigma_lognormal_model import MOST_BENT, Complex
from handout.motion.timing import arc_length
from handout.values import Array

ASYMMETRY, DURATION = 0.1, 0.3  # of every stroke of the first guess
LEAST_DT, MOST_DT = 0.3, 0.9  # of the first guess; seed 002, §3.1
_BOUNDS_DT = (0.1, 1.5)
_SHARPEST, _SOFTEST = 4.0, 24.0  # samples, spread of the turning at a corner
_COMPARED, _COMPARED_EACH = 110, 6  # places at which path and trace are compared, at least, and for each stroke
_RIDGE = 1e-3
_ROUNDS = 25
ENOUGH, _BEYOND = 42.0, 45.0  # dB, of the path: above the first no stroke is added, above the second nothing is refined
_MORE, _CLOSEST = 2, 8  # times that strokes are added where the fit is poor; least samples between key points
_HELD = 1e-5  # weight of the distance of durations and asymmetries from their first values
# the same of a steady plan, whose durations and asymmetries stay, and of its bends and overlaps: with .01 (of .0001 to
# .01) what a stroke is could best be told from the targets on pages of a drawn hand and of UNIPEN, at 37 dB
_STAYING, _STEADY = 1e3, 1e-2
_STEADY_ENOUGH = 36.0  # dB: above, a steady plan is given no more strokes
_TINY = 1e-4  # step of the numerical derivatives
_ENOUGH = 4e-3  # of the extent: a smaller improvement ends the refinement


def from_shape(xy: Array, *, steady: bool = False, unit: float = np.inf) -> LognormalPlan:
    """Fit a plan whose path has the shape of a trace; its times are those of unhurried writing.

    xy : (n, 2) float, mm: at least two different points.
    steady : all strokes last equally long and are equally skewed, and bends and overlaps stay near what the key points
        suggest: alike traces get alike plans, which can be learned, at some 5 dB less.
    unit : mm: a longer trace is followed as closely as one of this extent, so that words are as their letters are.

    Raises ValueError: fewer than two different points.

    Source: seed 002, §3.2; linear targets and refinement are this project's.
    """
    xy = np.asarray(xy, dtype=np.float64)
    whole = extent(xy)
    size = min(whole, unit)
    if len(xy) < 2 or size <= 0:
        raise ValueError("a trace needs at least two different points")
    even = resample_path(xy, max(8, round(float(arc_length(xy)[-1]) / size * key_points.SAMPLES) + 1))
    index = key_points.find(even).index
    best = _refine_plan(even, _lead_through(even, first_guess(even, index=index)), size, steady)
    off = _distances(even, best)
    for _ in range(_MORE):
        if snr_of(even, whole / size * off) >= (_STEADY_ENOUGH if steady else ENOUGH):
            break
        # more key points, half-way along the segments that fit worst
        total = np.concatenate([[0.0], np.cumsum(off**2)])
        inside = np.where(np.diff(index) >= 2 * _CLOSEST, total[index[1:]] - total[index[:-1]], -1.0)
        worst = np.argsort(-inside, kind="stable")[: math.ceil(whole / size)]
        worst = worst[inside[worst] >= 0]
        index = np.sort(np.append(index, (index[worst] + index[worst + 1]) // 2))
        tried = _refine_plan(even, _lead_through(even, first_guess(even, index=index)), size, steady)
        if np.square(then := _distances(even, tried)).sum() < np.square(off).sum():
            best, off = tried, then
    return best


def _distances(even: Array, plan: LognormalPlan) -> Array:
    """(n,) mm: how far the path is from the trace, at equal shares of their lengths."""
    pulses = plan.pulses()
    t = np.linspace(*pulses.span, _dense(_places_of(plan)))
    path = resample_path(plan.position_at(t), len(even))
    return np.asarray(np.hypot(*(path - even).T))


def _places_of(plan: LognormalPlan) -> int:
    """Places at which a plan's path and a trace are compared."""
    return max(_COMPARED, _COMPARED_EACH * plan.strokes)


def _dense(places: int) -> int:
    """Samples of a path among which such places are found."""
    return 2 * places + 20


def snr_of(even: Array, off: Array) -> float:
    """dB, of a trace (n, 2) and distances (n,) from it."""
    signal = float(((even - even.mean(axis=0)) ** 2).sum())
    return float(10 * np.log10(signal / max(float((off**2).sum()), 1e-12 * signal)))


def first_guess(
    even: Array, *, index: Index | None = None, bend: Callable[[Array], float] | None = None
) -> LognormalPlan:
    """Targets at the key points of an evenly sampled trace (n, 2); bends and overlaps from the trace between them.

    index : (m,) key points to take instead of those of `key_points.find`.
    bend : half the turning of a piece of the trace, rad, instead of what `key_points` and its length allow.
    """
    key = key_points.find(even)
    index, bend = key.index if index is None else index, bend or _half_turning
    theta = np.array([bend(even[a : b + 1]) for a, b in itertools.pairwise(index.tolist())])
    dt = np.concatenate([[0.0], _overlaps(key.turning, index[1:-1])])
    return plan_of(even[index], dt, theta)


def plan_of(targets: Array, dt: Array, theta: Array) -> LognormalPlan:
    """A plan of strokes of one duration and asymmetry; targets (m, 2) mm, dt and theta (m − 1,)."""
    k = len(theta)
    duration = np.full(k, DURATION)
    onset = lognormal.onsets(dt, duration)
    return LognormalPlan(targets, onset, duration, np.full(k, ASYMMETRY), theta, 0.0, float(onset[-1] + DURATION))


def _half_turning(piece: Array) -> float:
    """Half the turning of a piece of a trace, no more than the ratio of its length to its chord allows."""
    length, chord = float(arc_length(piece)[-1]), float(np.hypot(*(piece[-1] - piece[0])))
    if len(piece) < 4 or length <= 0:
        return 0.0
    direction = np.diff(resample_path(piece, 16) @ np.array([1.0, 1j]))
    half = float(np.angle(direction[1:] * np.conj(direction[:-1])).sum()) / 2 * 15 / 14
    ratio = length / max(chord, 1e-9)
    if ratio <= 1 + 1e-7:
        return 0.0
    most = optimize.brentq(lambda angle: angle / np.sin(angle) - ratio, 1e-9, 3.0) if ratio < 20 else MOST_BENT
    return float(np.copysign(min(abs(half), most, MOST_BENT), half))


def _overlaps(turning: Array, corners: Index) -> Array:
    """(k,) dt of the strokes that begin at the corners: late where the turning is sharp, early where it is spread.

    Source: seed 002, §3.2 (a mixture of Gaussians fitted to the turning, in one dimension).
    """
    if len(corners) == 0:
        return np.zeros(0)
    x, weight = np.arange(len(turning), dtype=np.float64), (turning + 1e-9) / (turning + 1e-9).sum()
    mean, spread = corners.astype(np.float64), np.full(len(corners), 6.0)
    share = np.full(len(corners), 1 / len(corners))
    for _ in range(10):
        near = share[:, None] * np.exp(-((x - mean[:, None]) ** 2) / (2 * spread[:, None] ** 2)) / spread[:, None]
        near *= weight / (near.sum(axis=0) + 1e-300)
        total = near.sum(axis=1) + 1e-12
        share, mean = total / total.sum(), (near @ x) / total
        spread = np.sqrt((near * (x - mean[:, None]) ** 2).sum(axis=1) / total + 1.0)
    soft = np.clip(np.log(spread / _SHARPEST) / np.log(_SOFTEST / _SHARPEST), 0.0, 1.0)
    return np.asarray(LEAST_DT + (MOST_DT - LEAST_DT) * (1 - soft))


def _times(path: Complex, t: Array, count: int) -> Array:
    """Times at which a path has covered equal shares of its length."""
    arc = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path)))])
    return np.asarray(np.interp(np.linspace(0.0, arc[-1], count), arc, t))


def _lead_through(even: Array, plan: LognormalPlan, rounds: int = 3) -> LognormalPlan:
    """The plan with targets that bring its path nearest to the trace, compared at equal shares of their lengths."""
    places = _places_of(plan)
    wanted = resample_path(even, places) @ np.array([1.0, 1j])
    z = plan.targets @ np.array([1.0, 1j])
    guess, pulses = z.copy(), plan.pulses()
    t = np.linspace(*pulses.span, _dense(places))
    done = lognormal.arc(lognormal.progress(pulses, t), pulses.theta[:, None])
    for _ in range(rounds):
        when = _times(z[0] + np.diff(z) @ done, t, places)
        matrix = path_matrix(lognormal.arc(lognormal.progress(pulses, when), pulses.theta[:, None]))
        weight = np.sqrt(_RIDGE * places)
        rows = np.concatenate([matrix, weight * np.eye(len(z))])
        z = np.linalg.lstsq(rows, np.concatenate([wanted, weight * guess]), rcond=None)[0]
    return plan_of(np.column_stack([z.real, z.imag]), plan.dt, plan.theta)


def path_matrix(done: Complex) -> Complex:
    """(n, m): matrix from targets (m,) to the path, given the completed share of each stroke (m − 1, n)."""
    matrix = np.zeros((done.shape[1], done.shape[0] + 1), dtype=np.complex128)
    matrix[:, 0] = 1.0
    matrix[:, 1:] += done.T
    matrix[:, :-1] -= done.T
    return matrix


def _refine_plan(even: Array, plan: LognormalPlan, size: float, steady: bool) -> LognormalPlan:
    """Levenberg–Marquardt on targets, bends, onsets, durations and asymmetries, the last ones held near the guess."""
    wanted = resample_path(even, _places_of(plan)) @ np.array([1.0, 1j])
    k = plan.strokes
    x = np.concatenate(
        [*(plan.targets / size).T, plan.theta, plan.onset[1:], np.log(plan.duration), np.full(k, np.log(ASYMMETRY))]
    )
    # (6 k + 1, 6 k + 1): precision of the guess, in what a vector of k strokes holds behind its targets
    behind, n = 2 * (k + 1), 6 * k + 1
    weight, differences = np.zeros(n), np.eye(n)
    weight[n - 2 * k :] = _STAYING if steady else _HELD
    if steady:  # overlaps are differences of onsets
        weight[behind : behind + k] = _STEADY
        weight[behind + k : behind + 2 * k - 1] = _STEADY / DURATION**2
        late = np.arange(behind + k + 1, behind + 2 * k - 1)
        differences[late, late - 1] = -1.0
    guess, held = x.copy(), differences.T @ (weight[:, None] * differences)

    def try_plan(x: Array) -> tuple[Array, Array, float, float]:
        residual, jacobian, mean = _differences(x, k, wanted / size)
        return residual, jacobian, mean, mean + float((x - guess) @ held @ (x - guess)) / len(wanted)

    damping = 1e-3
    aim = float(np.var(wanted / extent(even))) * 10 ** (-_BEYOND / 10)
    residual, jacobian, _, cost = try_plan(x)
    for _ in range(_ROUNDS):
        normal, slope = jacobian.T @ jacobian + held, jacobian.T @ residual + held @ (x - guess)
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-6), slope)
        there = _bound_vector(x - step, k)
        then = try_plan(there)
        if then[3] < cost:
            gained = cost - then[3]
            x, (residual, jacobian, off, cost) = there, then
            damping = max(damping / 5, 1e-9)
            if gained < _ENOUGH * cost or off < aim:
                break
        else:
            damping *= 6
            if damping > 1e6:
                break
    z, theta, onset, duration, asymmetry = _parts(x, k)
    end = float((onset + duration).max())
    found = LognormalPlan(size * np.column_stack([z.real, z.imag]), onset, duration, asymmetry, theta, 0.0, end)
    return plan_of(found.targets, found.dt, found.theta) if steady else found


def _parts(x: Array, k: int) -> tuple[Complex, Array, Array, Array, Array]:
    """Targets, half turnings, onsets, durations and asymmetries of a vector."""
    m = k + 1
    z, rest = x[:m] + 1j * x[m : 2 * m], x[2 * m :]
    onset = np.concatenate([[0.0], rest[k : 2 * k - 1]])
    return z, rest[:k], onset, np.exp(rest[2 * k - 1 : 3 * k - 1]), np.exp(rest[3 * k - 1 :])


def _bound_vector(x: Array, k: int) -> Array:
    x = x.copy()
    rest = x[2 * k + 2 :]
    rest[:k] = np.clip(rest[:k], -MOST_BENT, MOST_BENT)
    rest[2 * k - 1 : 3 * k - 1] = np.clip(rest[2 * k - 1 : 3 * k - 1], np.log(0.06), np.log(1.2))
    rest[3 * k - 1 :] = np.clip(rest[3 * k - 1 :], np.log(0.01), np.log(0.5))
    duration = np.exp(rest[2 * k - 1 : 3 * k - 1])
    before = 0.0
    for i in range(1, k):
        least, most = _BOUNDS_DT[0] * duration[i - 1], _BOUNDS_DT[1] * duration[i - 1]
        before = min(max(rest[k + i - 1], before + least), before + most)
        rest[k + i - 1] = before
    return x


def _differences(x: Array, k: int, wanted: Complex) -> tuple[Array, Array, float]:
    """Residuals, their derivatives, and the mean square of the distances of places at equal shares of length."""
    z, theta, onset, duration, asymmetry = _parts(x, k)
    chord = np.diff(z)
    pulses = lognormal.pulses(duration, asymmetry, theta, onset)
    t = np.linspace(*pulses.span, _dense(len(wanted)))
    when = _times(z[0] + lognormal.position(pulses, chord, t), t, len(wanted))
    share = lognormal.progress(pulses, when)
    done = lognormal.arc(share, theta[:, None])
    off = z[0] + chord @ done - wanted
    linear = path_matrix(done).T
    # the derivative of `lognormal.arc` by theta
    angle = np.where(np.abs(theta[:, None]) < 1e-4, 1e-4, theta[:, None])
    ahead, sine = angle * share, np.sin(angle)
    size = share * np.cos(ahead) / sine - np.sin(ahead) * np.cos(angle) / sine**2
    bend = chord[:, None] * (1j * (share - 1) * done + np.exp(1j * (ahead - angle)) * size)
    moving = (chord * lognormal.arc_over_chord(theta))[:, None] * np.exp(1j * theta[:, None] * (2 * share - 1))
    delay = -(moving * lognormal.rate(pulses, when))[1:]
    longer = lognormal.progress(lognormal.pulses(duration * (1 + _TINY), asymmetry, theta, onset), when)
    skewed = lognormal.progress(lognormal.pulses(duration, asymmetry * (1 + _TINY), theta, onset), when)
    columns = np.concatenate(
        [linear, 1j * linear, bend, delay, moving * (longer - share) / _TINY, moving * (skewed - share) / _TINY]
    )
    # derivatives of the places at equal shares of length, from those of the same places at fixed times: what makes the
    # path longer before a place pushes it back along the path, by as much as its share is not kept
    path = off + wanted
    step = np.diff(path)
    tangent = step / np.maximum(np.abs(step), 1e-12)
    gained = np.zeros(columns.shape)
    gained[:, 1:] = np.cumsum((np.diff(columns, axis=1) * np.conj(tangent)).real, axis=1)
    beyond = np.linspace(0.0, 1.0, len(path)) * gained[:, -1:] - gained
    middle = np.concatenate([tangent[:1], tangent[1:] + tangent[:-1], tangent[-1:]])
    columns = columns + beyond * middle / np.maximum(np.abs(middle), 1e-12)
    residual = np.concatenate([off.real, off.imag])
    jacobian = np.concatenate([columns.real, columns.imag], axis=1).T
    return residual, jacobian, float(np.mean(np.abs(off) ** 2))
