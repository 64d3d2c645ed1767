"""The sigma-lognormal model: a movement as a sum of pulses of lognormal speed, each along a circular arc.

Complex numbers ``x + iy`` stand for places; angles are positive from x towards y.

Source: seed 002, §3.1, corrected: eq. 1 (the minus sign belongs into the exponent), eq. 2 (the turning starts at −θ),
eq. 3 (the speed belongs inside the sum; the start is the first target), eq. 4 (a rotation has +cos twice), eq. 5 (not
1 at θ = ±π, where the arc is a full circle), eq. 7 (onsets follow the duration of the pulse before).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.values import Array

Complex = NDArray[np.complex128]

# Half the turning of one pulse; at π its arc would be a whole circle around a chord of no length
MOST_BENT = 2.6
LEAST_SKEWED, MOST_SKEWED = 1e-3, 0.6
# A pulse is evaluated within this many standard deviations of its logarithm; its progress is 0 before and 1 after
REACH = 4.0
# Less bent than this, a pulse is taken to be bent so little
_STRAIGHT = 1e-12


@dataclass(frozen=True, eq=False)
class Pulses:
    """Pulses, all (k,): reference time t0, s; mu and sigma of ln(t − t0); theta, rad, half the turning."""

    t0: Array
    mu: Array
    sigma: Array
    theta: Array

    def time(self, deviations: float) -> Array:
        """(k,) s: when each pulse is `deviations` standard deviations of its logarithm past its median."""
        return np.asarray(self.t0 + np.exp(self.mu + deviations * self.sigma))

    @property
    def span(self) -> tuple[float, float]:
        """s: from when to when any pulse moves, as far as it is evaluated."""
        return float(self.time(-REACH).min()), float(self.time(REACH).max())

    def delay_by(self, delay: ArrayLike) -> Pulses:
        """The same pulses, `delay` (k,) s later."""
        return Pulses(self.t0 + np.asarray(delay, dtype=np.float64), self.mu, self.sigma, self.theta)


def pulses(duration: ArrayLike, asymmetry: ArrayLike, theta: ArrayLike, onset: ArrayLike) -> Pulses:
    """Pulses from parameters that can be read.

    duration : (k,) float, s: from −3 to +3 standard deviations of the logarithm: 99.73 % of the pulse.
    asymmetry : (k,) float: one minus mode over median of the speed; kept in 0.001–0.6.
    theta : (k,) float, rad: half the turning; kept within ±2.6.
    onset : (k,) float, s: when the duration begins.

    Raises ValueError: a duration that is not positive and finite.

    Source: seed 002, eq. 6–7.
    """
    lasts = np.atleast_1d(np.asarray(duration, dtype=np.float64))
    if not (np.isfinite(lasts).all() and (lasts > 0).all()):
        raise ValueError("the duration of a pulse must be positive and finite")
    skewed = _clip(asymmetry, LEAST_SKEWED, MOST_SKEWED)
    sigma = np.sqrt(-np.log1p(-skewed)) + np.zeros_like(lasts)
    mu = 3 * sigma + np.log(lasts / np.expm1(6 * sigma))
    bend = _clip(theta, -MOST_BENT, MOST_BENT) + np.zeros_like(lasts)
    return Pulses(np.asarray(onset, dtype=np.float64) - np.exp(mu - 3 * sigma), mu, sigma, bend)


def _clip(values: ArrayLike, least: float, greatest: float) -> Array:
    return np.asarray(np.minimum(np.maximum(np.asarray(values, dtype=np.float64), least), greatest))


def onsets(dt: ArrayLike, duration: ArrayLike) -> Array:
    """(k,) s: each pulse begins `dt` of the duration of the pulse before after that; the first at 0, dt[0] unread."""
    lasts = np.asarray(duration, dtype=np.float64)
    later = np.asarray(dt, dtype=np.float64)[1:] * lasts[:-1]
    return np.concatenate([[0.0], np.cumsum(later)])


def rate(these: Pulses, t: ArrayLike) -> Array:
    """(k, n) 1/s: the lognormal speed of each pulse at times t (n,), of area 1.  Source: seed 002, eq. 1."""
    late = np.asarray(t, dtype=np.float64) - these.t0[:, None]
    begun = late > 0
    late = np.where(begun, late, 1.0)
    z = (np.log(late) - these.mu[:, None]) / these.sigma[:, None]
    return np.asarray(np.where(begun, np.exp(-0.5 * z * z) / (np.sqrt(2 * np.pi) * these.sigma[:, None] * late), 0.0))


def progress(these: Pulses, t: ArrayLike) -> Array:
    """(k, n) in 0–1: the share of each pulse that is done at times t, (n,) or (k, n): the integral of `rate`."""
    from scipy.special import ndtr  # which takes longer to load than a drawn hand takes for a sentence

    late = np.maximum(np.asarray(t, dtype=np.float64) - these.t0[:, None], np.finfo(np.float64).tiny)
    return np.asarray(ndtr((np.log(late) - these.mu[:, None]) / these.sigma[:, None]))


def turn_of_share(share: Array, theta: Array) -> Array:
    """Direction relative to the chord, rad, after a `share` of the pulse: −θ to θ.  Source: seed 002, eq. 2."""
    return np.asarray(theta * (2 * share - 1))


def arc_over_chord(theta: ArrayLike) -> Array:
    """Length of an arc of turning 2θ over its chord: θ / sin θ.  Source: seed 002, eq. 5."""
    angle = np.asarray(theta, dtype=np.float64)
    bent = np.where(np.abs(angle) < _STRAIGHT, _STRAIGHT, angle)
    return np.asarray(bent / np.sin(bent))


def arc(share: Array, theta: Array) -> Complex:
    """Displacement after a `share` of the pulse, in units of its chord: 0 to 1 along an arc of turning 2θ.

    ``e^{iθ(S−1)} sin(θS) / sin θ``: the integral of the velocity in closed form, without cancellation.
    """
    angle = np.where(np.abs(theta) < _STRAIGHT, _STRAIGHT, theta)
    ahead = angle * share
    size = np.sin(ahead) / np.sin(angle)
    back = ahead - angle
    place = np.empty(size.shape, dtype=np.complex128)
    place.real = size * np.cos(back)
    place.imag = size * np.sin(back)
    return place


def position(these: Pulses, chords: Complex, t: ArrayLike) -> Complex:
    """Displacement (n,) from the start at times t (n,); `chords` (k,) are the displacements of the whole pulses."""
    return np.asarray(chords @ arc(progress(these, t), these.theta[:, None]))


def velocity(these: Pulses, chords: Complex, t: ArrayLike) -> Complex:
    """Velocity (n,), length/s, at times t (n,).  Source: seed 002, eq. 3."""
    turn = turn_of_share(progress(these, t), these.theta[:, None])
    return np.asarray((chords * arc_over_chord(these.theta)) @ (rate(these, t) * np.exp(1j * turn)))


def share_within(these: Pulses, t: Array) -> Array:
    """Like `progress`, for t (k, n), but exactly 0 before and 1 after the reach of each pulse."""
    from scipy.special import ndtr

    late, outside = np.maximum(t - these.t0[:, None], np.finfo(np.float64).tiny), ndtr(-REACH)
    z = _clip((np.log(late) - these.mu[:, None]) / these.sigma[:, None], -REACH, REACH)
    return np.asarray((ndtr(z) - outside) / (1 - 2 * outside))


def path(these: Pulses, chords: Complex, start: float, step: float, samples: int) -> Complex:
    """Displacement at `samples` even times from `start`, every `step` s, each pulse evaluated only while it lasts.

    In time linear in the number of pulses; equal to `position` but for what lies outside the reach of each pulse
    (3 parts in 100 000 of its chord), so that the path rests exactly before its first and after its last pulse.
    """
    begin, end = these.time(-REACH), these.time(REACH)
    first = np.ceil((begin - start) / step).astype(np.intp)
    width = int(np.ceil((end - begin).max() / step)) + 2
    index = first[:, None] + np.arange(width)
    t: Array = start + step * index.astype(np.float64)
    done = arc(share_within(these, t), these.theta[:, None])
    done[:, 1:] -= done[:, :-1].copy()
    increments = chords[:, None] * done
    # what happens before the first sample counts for it; what happens after the last is never seen
    index = np.minimum(np.maximum(index, 0), samples).ravel()
    gained = [np.bincount(index, part.ravel(), minlength=samples + 1) for part in (increments.real, increments.imag)]
    return np.asarray(np.cumsum(gained[0][:samples]) + 1j * np.cumsum(gained[1][:samples]))
