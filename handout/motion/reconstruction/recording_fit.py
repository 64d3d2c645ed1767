"""Fits a plan of lognormal strokes to a recorded movement, whose times are known.

The movement is linear in the displacements of its strokes, so they are eliminated (variable projection), and the search
runs over time, duration, skew and turning of each stroke.  It starts with a stroke at every peak of speed, and adds one
where the fit is worst until the signal-to-noise ratio of the velocities is high enough.

Source: the theory of seed 002, §3.1; the method is this project's.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from handout.libraries import ndimage
from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.reconstruction.plan import LognormalPlan, from_pulses
from handout.motion.sigma_lognormal_model import Complex, Pulses
from handout.peaks import peaks
from handout.values import Array

ENOUGH = 25.0  # dB, of velocities
SHORTEST = 0.02  # s: no plan is fitted to a shorter movement
_STEP = 0.005  # s between compared samples
_SMOOTH = 0.010  # s: smooths away what is faster than some 13 Hz, which is the tablet, not the hand
_PLACES = 0.3  # weight of places against velocities
_RIDGE = 1e-4
_MOST = 12  # strokes, or twice the number of peaks of speed if that is more
_ROUNDS = 25
_GAIN = 0.05  # dB that another stroke must gain to be kept
# Strokes fitted together at most; longer movements go by windows: strokes in one, strokes to the next, s of margin
_TOGETHER, _WINDOW, _HOP, _MARGIN = 14, 10, 6, 0.06
_SWEEPS, _MORE, _LEAST = 2, 3, 20
_LOW, _HIGH = np.log([0.03, 0.02]), np.log([0.8, 1.2])  # sigma, and the time from t0 to the median, s
_TURN = 2.4  # rad: half the turning of a stroke at most, as `sigma_lognormal_model.MOST_BENT`, a little less
_PRIOR = 1e-2  # weight of the distance of the parameters from their first values
_TINY = 1e-4  # step of the numerical derivatives


@dataclass(frozen=True, eq=False)
class SampledMovement:
    """An evenly sampled movement: times (n,) s, places and velocities (n,) complex, mm and mm/s."""

    t: Array
    place: Complex
    velocity: Complex


def prepare_recording(t: Array, xy: Array) -> SampledMovement:
    """Sample a recorded movement evenly and smooth it a little.

    t : (n,) float, s, increasing; xy : (n, 2) float, mm.

    Raises ValueError: it lasts less than three samples, or does not move.
    """
    span = float(t[-1] - t[0])
    even = np.linspace(t[0], t[-1], max(round(span / _STEP) + 1, 2))
    if len(even) < 5 or not np.ptp(xy, axis=0).any():
        raise ValueError("a movement must last at least 20 ms and go somewhere")
    z = np.interp(even, t, xy[:, 0]) + 1j * np.interp(even, t, xy[:, 1])
    width = _SMOOTH / (even[1] - even[0])
    # point reflections at both ends keep the ends in place
    pad = min(len(z) - 1, round(4 * width))
    longer = np.concatenate([2 * z[0] - z[pad:0:-1], z, 2 * z[-1] - z[-2 : -pad - 2 : -1]])
    smooth = ndimage.gaussian_filter1d(longer.real, width) + 1j * ndimage.gaussian_filter1d(longer.imag, width)
    place = smooth[pad : pad + len(z)]
    return SampledMovement(even, place, np.gradient(place, even))


def from_recording(t: Array, xy: Array) -> LognormalPlan:
    """Fit a plan to a recorded movement.

    t : (n,) float, s, increasing; xy : (n, 2) float, mm.
    """
    recording = prepare_recording(np.asarray(t, dtype=np.float64), np.asarray(xy, dtype=np.float64))
    # a stroke for every peak of speed
    times, speed = recording.t, np.abs(recording.velocity)
    least = peaks(-speed, prominence=0.04 * float(speed.max()), apart=4)
    guesses = []
    for a, b in pairwise([0, *least.tolist(), len(times) - 1]):
        # a stroke between two samples: ln sigma, mu, time of the median, theta
        v = recording.velocity[a : b + 1]
        moving = v[np.abs(v) > 0.05 * np.abs(v).max()]
        half = float(np.angle(moving[1:] * np.conj(moving[:-1])).sum()) / 2 if len(moving) > 2 else 0.0
        guesses.append(_stroke(float(times[a + int(np.argmax(np.abs(v)))]), float(times[b] - times[a]), half))
    x = np.stack(guesses)
    x = _explain_recording(recording, x, max(_MOST, 2 * len(x))) if len(x) <= _TOGETHER else _fit_windows(recording, x)
    origin, chords = _chords(recording, x)
    return from_pulses(_pulses(x), origin, chords, float(recording.t[0]), float(recording.t[-1]))


def _explain_recording(recording: SampledMovement, x: Array, most: int) -> Array:
    """Fit the strokes (rows), and add more until the fit is good enough or there are `most`."""
    x = _fit_strokes(recording, x)
    had = quality(recording, x)
    while had < ENOUGH and len(x) < most:
        more = _fit_strokes(recording, np.concatenate([x, _missing(recording, x)]))
        better = quality(recording, more)
        if better < had + _GAIN:
            break
        x, had = more, better
    return x


def _fit_windows(recording: SampledMovement, x: Array) -> Array:
    """Fit a long movement a few strokes at a time, the others held fixed, in two sweeps."""
    for _ in range(_SWEEPS):
        done, x = -np.inf, x[np.argsort(x[:, 2], kind="stable")]
        while (ahead := np.flatnonzero(x[:, 2] > done)).size:
            chosen = np.zeros(len(x), dtype=bool)
            chosen[ahead[:_WINDOW]] = True
            done = float(x[ahead[min(_HOP, len(ahead)) - 1], 2])
            # fitted to the movement around them minus all other strokes
            t = recording.t
            y, z = np.searchsorted(t, [x[chosen, 2].min() - _MARGIN, x[chosen, 2].max() + _MARGIN])
            near = slice(min(int(y), len(t) - _LEAST), max(int(z), _LEAST))
            _, chords = _chords(recording, x)
            moving, gone = _moving(_pulses(x[~chosen]), t[near])
            left = SampledMovement(
                t[near],
                recording.place[near] - chords[~chosen] @ gone,
                recording.velocity[near] - chords[~chosen] @ moving,
            )
            x = np.concatenate([x[~chosen], _explain_recording(left, x[chosen], int(chosen.sum()) + _MORE)])
            x = x[np.argsort(x[:, 2], kind="stable")]
    return x


def quality(recording: SampledMovement, x: Array) -> float:
    """Signal to noise of the velocities, dB."""
    _, chords = _chords(recording, x)
    off = chords @ _moving(_pulses(x), recording.t)[0] - recording.velocity
    return float(10 * np.log10((np.abs(recording.velocity) ** 2).sum() / max((np.abs(off) ** 2).sum(), 1e-30)))


def _pulses(x: Array) -> Pulses:
    """Pulses of rows of ln sigma, mu, time of the median and theta, (k, 4)."""
    return Pulses(x[:, 2] - np.exp(x[:, 1]), x[:, 1], np.exp(x[:, 0]), x[:, 3])


def _moving(pulses: Pulses, t: Array) -> tuple[Complex, Complex]:
    """(k, n) each: velocity and displacement of strokes of chord 1."""
    theta = pulses.theta[:, None]
    share = lognormal.progress(pulses, t)
    turn = np.exp(1j * theta * (2 * share - 1)) * lognormal.arc_over_chord(theta)
    return np.asarray(lognormal.rate(pulses, t) * turn), lognormal.arc(share, theta)


def _stroke(peak: float, lasts: float, half: float) -> Array:
    sigma = 0.29
    mu = 3 * sigma + np.log(1.7 * max(lasts, 0.03) / np.expm1(6 * sigma))
    median = peak - np.exp(mu - sigma**2) + np.exp(mu)
    return np.array([np.log(sigma), mu, median, np.clip(half, -1.5, 1.5)])


def _missing(recording: SampledMovement, x: Array) -> Array:
    """A stroke where the residual of the fit is largest: (1, 4)."""
    _, chords = _chords(recording, x)
    off = recording.velocity - chords @ _moving(_pulses(x), recording.t)[0]
    power = ndimage.gaussian_filter1d(np.abs(off) ** 2, 3)
    peak = int(np.argmax(power))
    under = power < 0.3 * power[peak]
    before = np.flatnonzero(under[:peak])
    after = np.flatnonzero(under[peak:])
    a = int(before[-1]) if len(before) else 0
    b = peak + int(after[0]) if len(after) else len(power) - 1
    return _stroke(float(recording.t[peak]), float(recording.t[b] - recording.t[a]), 0.0)[None]


def _system(recording: SampledMovement, x: Array) -> tuple[Complex, Complex, tuple[float, float]]:
    """Matrix and right side of the displacements; and the scales of velocities and places."""
    v, z = recording.velocity, recording.place - recording.place[0]
    scales = 1 / float(np.sqrt(np.mean(np.abs(v) ** 2))), _PLACES / float(np.sqrt(np.mean(np.abs(z - z.mean()) ** 2)))
    moving, done = _moving(_pulses(x), recording.t)
    k, n = moving.shape
    matrix = np.zeros((2 * n + k, k + 1), dtype=np.complex128)
    matrix[:n, 1:], matrix[n : 2 * n, 1:] = scales[0] * moving.T, scales[1] * done.T
    matrix[n : 2 * n, 0] = scales[1]
    matrix[2 * n :, 1:] = np.eye(k) * np.sqrt(_RIDGE * n) * scales[1]
    return matrix, np.concatenate([scales[0] * v, scales[1] * z, np.zeros(k)]), scales


def _chords(recording: SampledMovement, x: Array) -> tuple[complex, Complex]:
    matrix, wanted, _ = _system(recording, x)
    solution = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
    return complex(solution[0] + recording.place[0]), np.asarray(solution[1:], dtype=np.complex128)


def _fit_strokes(recording: SampledMovement, x: Array) -> Array:
    """Levenberg–Marquardt on the rows with eliminated displacements (Kaufman's approximation of the derivatives)."""
    prior, damping = x.copy(), 1e-2
    now = _project_strokes(recording, x, prior)
    for _ in range(_ROUNDS):
        residual, jacobian, cost = now
        normal, slope = jacobian.T @ jacobian, jacobian.T @ residual
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-6), slope)
        tried = x - step.reshape(x.shape)
        tried[:, 0] = np.clip(tried[:, 0], _LOW[0], _HIGH[0])
        tried[:, 1] = np.clip(tried[:, 1], _LOW[1], _HIGH[1])
        tried[:, 2] = np.clip(tried[:, 2], recording.t[0] - 0.1, recording.t[-1] + 0.1)
        tried[:, 3] = np.clip(tried[:, 3], -_TURN, _TURN)
        then = _project_strokes(recording, tried, prior)
        if then[2] < cost:
            x, now, damping = tried, then, max(damping / 4, 1e-8)
            if cost - then[2] < 2e-3 * cost:
                break
        else:
            damping *= 5
            if damping > 1e5:
                break
    return x


def _project_strokes(recording: SampledMovement, x: Array, prior: Array) -> tuple[Array, Array, float]:
    """Residuals with the best displacements, their derivatives by the rows, and the cost."""
    matrix, wanted, scales = _system(recording, x)
    q, r = np.linalg.qr(matrix)
    solution = np.linalg.solve(r + 1e-12 * np.eye(len(r)), q.conj().T @ wanted)
    residual = matrix @ solution - wanted
    k, n = len(x), len(recording.t)
    moving, done = _moving(_pulses(x), recording.t)
    columns = np.zeros((len(wanted), 4 * k), dtype=np.complex128)
    for j in range(4):
        nudged = x.copy()
        nudged[:, j] += _TINY
        moved, gone = _moving(_pulses(nudged), recording.t)
        columns[:n, j::4] = (scales[0] * solution[1:, None] * (moved - moving) / _TINY).T
        columns[n : 2 * n, j::4] = (scales[1] * solution[1:, None] * (gone - done) / _TINY).T
    columns -= q @ (q.conj().T @ columns)
    pull = _PRIOR * np.sqrt(n) * 0.1 * (x - prior).ravel()
    rows = np.concatenate([residual.real, residual.imag, pull])
    jacobian = np.concatenate([columns.real, columns.imag, _PRIOR * np.sqrt(n) * 0.1 * np.eye(4 * k)])
    return rows, jacobian, float(rows @ rows)
