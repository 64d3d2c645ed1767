"""The published way from the shape of a trace to a plan of lognormal strokes, for comparison.

Key points at peaks of the smoothed turning, bends from circles fitted to the segments, overlaps from how sharp the
corners are, and targets moved by what the path misses the key points, again and again.

Source: D. Berio, M. Akten, F. Fol Leymarie, M. Grierson, R. Plamondon: Calligraphic stylisation learning with a
physiologically plausible model of movement and recurrent neural networks, 2017, §3.2 (seed 002).  What the text leaves
open (the step of the samples, the sums of the window) is as in `key_points`.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.reconstruction import key_points, shape_fit
from handout.motion.reconstruction.key_points import extent, resample_path
from handout.motion.reconstruction.plan import LognormalPlan
from handout.motion.sigma_lognormal_model import MOST_BENT, Pulses
from handout.motion.timing import arc_length
from handout.values import Array

_ROUNDS = 10
_FLAT = 50.0  # chords of radius beyond which a segment counts as straight


def from_shape(xy: Array, *, robust: bool = False) -> LognormalPlan:
    """The plan of a trace (n, 2), mm, by the published method.

    robust : with key points also at cusps and where segments nearly close on themselves, and bends limited by length
        over chord: what this project adds before it goes a way of its own.
    """
    length = float(arc_length(xy)[-1])
    even = resample_path(xy, max(8, round(length / extent(xy) * key_points.SAMPLES) + 1))
    if robust:
        guess = shape_fit.first_guess(even)
    else:
        index = key_points.find(even, cusps=False).index
        guess = shape_fit.first_guess(even, index=index, bend=_circle)
    wanted = guess.targets.copy()
    targets, pulses = wanted.copy(), guess.pulses()
    when = _meetings(pulses, guess)
    done = lognormal.arc(lognormal.progress(pulses, when), pulses.theta[:, None])
    for _ in range(_ROUNDS):
        z = targets @ np.array([1.0, 1j])
        reached = z[0] + np.diff(z) @ done
        targets = targets + wanted - np.column_stack([reached.real, reached.imag])
    return shape_fit.plan_of(targets, guess.dt, guess.theta)


def _meetings(pulses: Pulses, plan: LognormalPlan) -> Array:
    """(m,) s: before all, where each stroke becomes faster than the one before, and after all."""
    mode = pulses.t0 + np.exp(pulses.mu - pulses.sigma**2)

    def faster(t: float, i: int) -> float:
        rate = lognormal.rate(pulses, np.array([t]))[:, 0]
        return float(rate[i + 1] - rate[i])

    meets = []
    for i in range(plan.strokes - 1):
        a, b = float(mode[i]), float(mode[i + 1])
        crosses = faster(a, i) * faster(b, i) < 0
        meets.append(brentq(faster, a, b, args=(i,)) if crosses else 0.5 * (a + b))
    return np.array([-1e-3, *meets, float((plan.onset + 2 * plan.duration)[-1])])


def _circle(piece: Array) -> float:
    """Half the turning of the circle fitted to a segment by least squares, rad."""
    chord = piece[-1] - piece[0]
    length = float(np.hypot(*chord))
    if len(piece) < 4 or length < 1e-9:
        return 0.0
    rows = np.column_stack([2 * piece, np.ones(len(piece))])
    a, b, c = np.linalg.lstsq(rows, (piece**2).sum(axis=1), rcond=None)[0]
    radius = float(np.sqrt(max(c + a * a + b * b, 1e-12)))
    if radius > _FLAT * length:
        return 0.0
    half = float(np.arcsin(min(length / (2 * radius), 1.0)))
    normal = np.array([-chord[1], chord[0]]) / length
    side = float((piece[len(piece) // 2] - piece[0]) @ normal)
    if side * float((np.array([a, b]) - 0.5 * (piece[0] + piece[-1])) @ normal) > 0:
        half = np.pi - half
    return float(np.clip(-np.sign(side) * half, -MOST_BENT, MOST_BENT))
