"""Which feed to give each segment so that the machine's own planner moves the pen as the hand did.

The mean speed of a segment is the wrong feed: GRBL enters a block no faster than the slower of two neighbours' feeds,
so every change of speed comes late.  Here the planner is run in advance (`lookahead`), and each feed is raised where
its segment would take too long and lowered where it would be over too soon, until the times agree.
"""

from __future__ import annotations

import numpy as np

from handout.plotting.lookahead import Blocks, Flags, Motion, run
from handout.values import Array

_ROUNDS = 40
_STEP = 0.6  # share of the remaining error, as a power, that a round corrects; more makes neighbours swing
_HEADROOM = 1.6  # a feed above this multiple of the wanted speed only makes the motion rough
_LEAST = 1 / 60  # mm/s: F1, the slowest a GRBL runs
_INSTANT = 1e-9
_SPARE_TURN = 2**0.5  # GRBL lets a diagonal move take that much more than an axis alone; so may a curve


def fit(lines: Blocks, wanted: Array, feed: Array, draws: Flags, most: Array, queue: int) -> Array:
    """Feeds, mm/s, with which the planner runs the drawn segments in the wanted times, as nearly as it can.

    Parameters
    ----------
    wanted : (n,) float, s, the time each segment should take (anything where `draws` is false).
    feed : (n,) float, mm/s: given for what is not drawn, ignored elsewhere.
    draws : (n,) bool: the pen is down.
    most : (n,) float, mm/s: greatest feeds (see `greatest`).
    """
    mean = np.where(draws, lines.length / np.maximum(wanted, _INSTANT), 0.0)
    around = np.maximum(mean, np.maximum(np.append(mean[1:], 0.0), np.append(0.0, mean[:-1])))
    most = np.clip(_HEADROOM * around, 10 * _LEAST, most)
    feed = np.where(draws, np.clip(mean, _LEAST, most), feed)
    best, least_error = feed, np.inf
    for _ in range(_ROUNDS):
        motion = run(lines, feed, queue)
        error = float((((motion.duration - wanted) * mean)[draws] ** 2).sum())
        if error < least_error:
            best, least_error = feed, error
        ratio = motion.duration[draws] / np.maximum(wanted[draws], _INSTANT)
        feed = feed.copy()
        feed[draws] = np.clip(feed[draws] * ratio**_STEP, _LEAST, most[draws])
    return best


def greatest(lines: Blocks, acceleration: float, fastest: float) -> Array:
    """Greatest feeds, mm/s, that ask no more than the acceleration, mm/s², in the curves.

    GRBL limits acceleration along the path and speed in sharp corners; a curve of short segments slips through.
    """
    radius = np.minimum(lines.radius, np.append(lines.radius[1:], np.inf))
    return np.asarray(np.minimum(np.sqrt(_SPARE_TURN * acceleration * radius), fastest))


def round_feed(feed: Array) -> Array:
    """Feeds in mm/min as they are written: whole numbers, a tenth below 100; never less than 1.  (n,) mm/s in."""
    minute = np.maximum(feed * 60.0, 1.0)
    return np.where(minute < 100.0, np.round(minute, 1), np.round(minute))


def likeness(lines: Blocks, intended: Array, motion: Motion, draws: Flags) -> tuple[float, float, float]:
    """How well the speeds along the strokes are kept.

    Returns
    -------
    correlation : of the mean speeds of the segments, weighted by intended time.
    rms : root mean square of their difference, as a share of the greatest intended speed.
    stretched : executed time over intended time.
    """
    chosen = draws & (lines.length > 0)
    if not chosen.any():
        return 1.0, 0.0, 1.0
    weight, length, took = intended[chosen], lines.length[chosen], motion.duration[chosen]
    a, b = length / weight, length / took
    rms = float(np.sqrt(np.average((a - b) ** 2, weights=weight)) / a.max())
    a0, b0 = a - np.average(a, weights=weight), b - np.average(b, weights=weight)
    spread = float(np.sqrt((weight * a0 * a0).sum() * (weight * b0 * b0).sum()))
    return float((weight * a0 * b0).sum()) / spread if spread > 0 else 1.0, rms, float(took.sum() / weight.sum())
