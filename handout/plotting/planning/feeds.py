"""Which feed to give each segment so that the machine's own planner moves the pen as the hand did.

The mean speed of a segment is the wrong feed: GRBL enters a block no faster than the slower of two neighbours' feeds,
so every change of speed comes late.  Here the planner is run in advance (`lookahead`), and a feed is raised where its
segment would take too long and lowered where it would take too little time.  Where no feed lets the machine keep up,
the lost time is made up in the segments before and after, as far as they have speed to spare: each feed is also
corrected by the common error of short and long stretches around its segment.  A stroke that takes far longer on the
machine is not hurried elsewhere to make up for it: its time is lost, but its speeds are the hand's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.plotting.planning.lookahead import Blocks, Flags, run_planner
from handout.values import Array


@dataclass(frozen=True)
class FeedSettings:
    """How feeds are corrected, round by round, until strokes take the time that they were meant to take."""

    rounds: int = 30  # at most, after the first: pages of writing were done after 8 to 17 on four machines
    patience: int = 6  # rounds without a gain after which it is done
    first: int = 12  # rounds in which each segment looks at itself alone
    step: float = 0.6  # share of its own error, as a power, that a round corrects then; more makes neighbours swing
    step_around: float = 0.3  # the same where the stretches around it count as well
    # segments, and the share of their common error; in all below 2
    around: tuple[tuple[int, float], ...] = ((5, 0.2), (15, 0.3), (45, 0.4), (135, 0.3))
    # share by which a stroke takes too long: up to the first it is hurried, from the second not, less in between
    lost: tuple[float, float] = (0.02, 0.04)
    headroom: float = 1.6  # a feed above this multiple of the wanted speed only makes the motion rough
    least: float = 1 / 60  # mm/s: F1, the slowest a GRBL runs
    instant: float = 1e-9  # s; keeps logarithms finite
    spare_turn: float = 2**0.5  # GRBL lets a diagonal move take that much more than an axis alone; so may a curve


SETTINGS = FeedSettings()


class _Strokes:
    """Drawn segments, those of a stroke in a row.

    rows : (m,) their places among all moves; wanted : (m,) s; length : (m,) mm; first, last : (m,) of their stroke.
    """

    def __init__(self, length: Array, wanted: Array, draws: Flags) -> None:
        self.rows = np.flatnonzero(draws)
        self.wanted, self.length = np.maximum(wanted[self.rows], SETTINGS.instant), length[self.rows]
        starts = np.flatnonzero(np.diff(self.rows, prepend=-2) > 1)
        many = np.diff(np.append(starts, len(self.rows)))
        self.first = np.repeat(starts, many)
        self.last = np.repeat(starts + many - 1, many)

    def sum_around(self, values: Array, width: int) -> Array:
        """Sums over `width` segments around each, within its stroke."""
        total, number = np.concatenate([[0.0], np.cumsum(values)]), np.arange(len(values))
        late = np.minimum(number + width // 2, self.last) + 1
        return np.asarray(total[late] - total[np.maximum(number - width // 2, self.first)])

    def whole(self, values: Array) -> Array:
        """Sums over the stroke of each segment."""
        total = np.concatenate([[0.0], np.cumsum(values)])
        return np.asarray(total[self.last + 1] - total[self.first])

    def error(self, took: Array) -> float:
        """How far the motion is off: squares of the speeds' errors, at the same times and at the same places."""
        late = np.cumsum(took - self.wanted)
        late -= np.where(self.first > 0, late[self.first - 1], 0.0)
        speed = self.length / self.wanted
        inner = np.arange(len(speed)) < self.last
        leaving = np.where(inner, 0.5 * (speed + np.append(speed[1:], 0.0)), 0.5 * speed) * late
        entering = np.where(np.arange(len(speed)) > self.first, np.append(0.0, leaving[:-1]), 0.0)
        in_place = speed * (took - self.wanted)
        return float((((leaving - entering) ** 2 + in_place**2) / self.wanted).sum())


def fit(lines: Blocks, wanted: Array, feed: Array, draws: Flags, most: Array, queue: int) -> Array:
    """Feeds, mm/s, with which the planner runs the drawn segments in the wanted times, as nearly as it can.

    Parameters
    ----------
    wanted : (n,) float, s, the time each segment should take (anything where `draws` is false).
    feed : (n,) float, mm/s: given for what is not drawn, ignored elsewhere.
    draws : (n,) bool: the pen is down.
    most : (n,) float, mm/s: greatest feeds (see `greatest`).
    """
    if not draws.any():
        return feed
    strokes = _Strokes(lines.length, wanted, draws)
    rows, mean = strokes.rows, np.zeros(len(feed))
    mean[rows] = strokes.length / strokes.wanted
    near = np.maximum(mean, np.maximum(np.append(mean[1:], 0.0), np.append(0.0, mean[:-1])))
    most = np.clip(SETTINGS.headroom * near, 10 * SETTINGS.least, most)[rows]
    feed = feed.copy()
    feed[rows] = np.clip(mean[rows], SETTINGS.least, most)
    spans = [(width, share, strokes.sum_around(strokes.wanted, width)) for width, share in SETTINGS.around]
    best, least, since = feed.copy(), np.inf, 0
    hurry = np.zeros(len(rows))
    for number in range(SETTINGS.first + SETTINGS.rounds):
        took = run_planner(lines, feed, queue).duration[rows]
        if number == SETTINGS.first:
            late = strokes.whole(took) / strokes.whole(strokes.wanted) - 1.0
            hurried, given_up = SETTINGS.lost
            hurry, least, since = np.clip((given_up - late) / (given_up - hurried), 0.0, 1.0), np.inf, 0
        error = strokes.error(took)
        since = 0 if error < 0.998 * least else since + 1
        if error < least and number >= SETTINGS.first:
            best, least = feed.copy(), error
        if since > SETTINGS.patience and number > SETTINGS.first:
            break
        step = SETTINGS.step + (SETTINGS.step_around - SETTINGS.step) * hurry
        gain = step * np.log(np.maximum(took, SETTINGS.instant) / strokes.wanted)
        if number >= SETTINGS.first:
            for width, share, whole in spans:
                gain += hurry * share * np.log(np.maximum(strokes.sum_around(took, width), SETTINGS.instant) / whole)
        feed[rows] = np.clip(feed[rows] * np.exp(gain), SETTINGS.least, most)
    return best


def greatest(lines: Blocks, acceleration: float, fastest: float) -> Array:
    """Greatest feeds, mm/s, that ask no more than the acceleration, mm/s², in the curves.

    GRBL limits acceleration along the path and speed in sharp corners; a curve of short segments slips through.
    """
    radius = np.minimum(lines.radius, np.append(lines.radius[1:], np.inf))
    return np.asarray(np.minimum(np.sqrt(SETTINGS.spare_turn * acceleration * radius), fastest))


def round_feed(feed: Array) -> Array:
    """Feeds in mm/min as they are written: whole numbers, a tenth below 100; never less than 1.  (n,) mm/s in.

    Exact ones gain nothing (the correlations agree to four places), so inverse time (G93) would not either: to the
    planner it is the same feed, written as a time.
    """
    minute = np.maximum(feed * 60.0, 1.0)
    return np.where(minute < 100.0, np.round(minute, 1), np.round(minute))
