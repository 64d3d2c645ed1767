"""What a GRBL planner will do with a program, computed on the host for a whole page at once; feeds that suit it.

GRBL gives every block (a straight line with a feed) an entry speed that no later block makes impossible to brake from,
as far as its queue lets it see, and runs each block as a trapezoid of speed.  The same rule, written for arrays: with
E the running sum of 2·a·length, a speed v is reachable from another u when v² − E and u² − E are ordered, so the pass
back from the end of the queue is a sliding minimum of (limit + E), and the pass forward a running one.

The mean speed of a segment is the wrong feed: GRBL enters a block no faster than the slower of two neighbours' feeds,
so every change of speed comes late.  So the planner is run in advance, and a feed is raised where its segment would
take too long and lowered where it would take too little time.  Where no feed lets the machine keep up, the lost time is
made up in the segments before and after, as far as they have speed to spare: each feed is also corrected by the common
error of short and long stretches around its segment.  A stroke that takes far longer on the machine is not hurried
elsewhere to make up for it: its time is lost, but its speeds are the hand's.

Source: Skogsrud and Jeon, GRBL 1.1h (2019): junction deviation, entry speed at most both nominal speeds, look-ahead
of the queue, a block ends at rest when the queue is empty.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from handout.summary import one_line
from handout.values import Array

Flags = NDArray[np.bool_]
Queue = int | NDArray[np.intp]
_STRAIGHT = 0.999999  # cosine beyond which GRBL takes a corner for straight, or for a reversal
_REST = 1e-9
_CHORD, _OCTAGON, _LEAST_TURN = 1.0, 0.7071067812, 0.033  # mm; cosine; rad: what Marlin takes for a curve


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine as its planner sees it; three axes (x, y, z).

    acceleration : (3,) float, mm/s²; rate : (3,) float, mm/s; steps : (3,) float, steps/mm.
    deviation : junction deviation, mm; queue : blocks the planner looks ahead.
    path : mm/s², greatest acceleration along the path, in whatever direction.
    curves : what else limits the speed in a corner: "short", the curve that short segments make (Marlin); "all", the
        circle that touches both lines in the middle of the shorter (Klipper); "", nothing.
    jerk : mm/s, greatest change of an axis' speed between two lines, which replaces junction deviation (0: does not).
    """

    acceleration: Array
    rate: Array
    steps: Array
    deviation: float
    queue: int
    path: float = np.inf
    curves: Literal["", "short", "all"] = ""
    jerk: float = 0.0


@dataclass(frozen=True, eq=False)
class Blocks:
    """Straight lines in a row, as far as they do not depend on the feed.

    length : (n,) float, mm; acceleration : (n,) float, mm/s² along the line; rate : (n,) float, mm/s, greatest speed.
    corner : (n,) float, mm²/s², square of the greatest speed at the block's start; 0 where the machine stands.
    radius : (n,) float, mm, of the curve that turns there; infinite where the machine stands or turns back.
    """

    length: Array
    acceleration: Array
    rate: Array
    corner: Array
    radius: Array


@dataclass(frozen=True, eq=False)
class Motion:
    """How the blocks run: speeds at their ends, mm/s, and how long each takes, s.

    entry, leave, nominal, duration : (n,) float; acceleration : (n,) float, mm/s²; length : (n,) float, mm.
    """

    entry: Array
    leave: Array
    nominal: Array
    acceleration: Array
    length: Array
    duration: Array

    __repr__ = one_line

    def distance_travelled(self, rows: NDArray[np.intp], t: Array) -> Array:
        """How far blocks have come `t` seconds after their starts.  (m,) mm."""
        u, v, a, length = self.entry[rows], self.leave[rows], self.acceleration[rows], self.length[rows]
        top = top_speed(length, a, u, v, self.nominal[rows])
        left, speeding, braking = self.duration[rows] - t, (top - u) / a, (top - v) / a
        level = (top * top - u * u) / (2 * a) + top * (t - speeding)
        way = np.where(left <= braking, length - v * left - 0.5 * a * left * left, level)
        return np.asarray(np.where(t <= speeding, u * t + 0.5 * a * t * t, way))


def to_steps(points: Array, steps: Array) -> Array:
    """The points the machine goes to: whole steps.  (n, 3) float, mm."""
    return np.round(points * steps) / steps


def blocks(points: Array, stands: Flags, machine: Machine) -> Blocks:
    """The lines from each point to the next.

    points : (n + 1, 3) float, mm, machine coordinates; the first is where the machine stands.
    stands : (n,) bool: whether the machine comes to rest before the block (a pen command, a pause).
    """
    move = np.diff(to_steps(points, machine.steps), axis=0)
    length = np.sqrt((move * move).sum(axis=1))
    unit = move / np.maximum(length, _REST)[:, None]
    acceleration = np.minimum(limit_along(unit, machine.acceleration), machine.path)
    corner, radius = np.zeros(len(length)), np.full(len(length), np.inf)
    corner[1:] = corner_speed2(unit[:-1], unit[1:], machine)
    if machine.curves and not machine.jerk:
        limit = _curve_speed2 if machine.curves == "short" else _circle_speed2
        corner[1:] = np.minimum(corner[1:], limit(unit, length, acceleration))
    way = np.diff(points, axis=0)  # whole steps would make rough what is smooth
    chord = np.maximum(np.sqrt((way * way).sum(axis=1)), _REST)
    cosine = (way[:-1] * way[1:]).sum(axis=1) / (chord[:-1] * chord[1:])
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    # of the curve of which each two lines are chords; a turn of more than a quarter is none
    radius[1:] = np.where(cosine > 0, 0.5 * (chord[:-1] + chord[1:]) / np.maximum(angle, _REST), np.inf)
    corner[stands], radius[stands] = 0.0, np.inf
    return Blocks(length, acceleration, limit_along(unit, machine.rate), corner, radius)


def limit_along(unit: Array, limits: Array) -> Array:
    """The greatest value along each direction that keeps every axis within its limit.  (n,) float."""
    with np.errstate(divide="ignore"):
        most = (limits / np.abs(unit)).min(axis=1)
    return np.asarray(np.where(np.isfinite(most), most, limits.max()))  # a line of no length has no direction


def corner_speed2(before: Array, after: Array, machine: Machine) -> Array:
    """Square of the speed allowed where two lines meet, mm²/s².

    before, after : (n, 3) float, unit vectors.  The speed is that of a circle which touches both lines and leaves the
    corner by the junction deviation: v² = a·δ·sin(θ/2) / (1 − sin(θ/2)), θ the angle between the lines.
    """
    if machine.jerk:
        with np.errstate(divide="ignore"):
            return np.asarray((machine.jerk / np.abs(after - before).max(axis=1)) ** 2)
    cosine = -(before * after).sum(axis=1)
    half = np.sqrt(np.clip(0.5 * (1.0 - cosine), 0.0, 1.0))
    across = after - before
    across /= np.maximum(np.sqrt((across * across).sum(axis=1)), _REST)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = np.minimum(limit_along(across, machine.acceleration), machine.path)
        speed2 = np.asarray(limit * machine.deviation * half / (1.0 - half))
    speed2[cosine < -_STRAIGHT] = np.inf
    speed2[cosine > _STRAIGHT] = 0.0
    return np.asarray(speed2)


def _curve_speed2(unit: Array, length: Array, acceleration: Array) -> Array:
    """Square of the speed with which Marlin begins a line that is a chord of a curve, mm²/s²; infinite elsewhere."""
    cosine = np.clip((unit[:-1] * unit[1:]).sum(axis=1), -1.0, 1.0)
    speed2 = acceleration[1:] * length[1:] / np.maximum(np.arccos(cosine), _LEAST_TURN)
    return np.where((length[1:] < _CHORD) & (cosine > _OCTAGON), speed2, np.inf)


def _circle_speed2(unit: Array, length: Array, acceleration: Array) -> Array:
    """Square of the speed on the circle that touches two lines, the shorter in its middle, mm²/s² (Klipper)."""
    cosine = np.clip(-(unit[:-1] * unit[1:]).sum(axis=1), -_STRAIGHT, _STRAIGHT)
    energy = 0.5 * acceleration * length
    return np.asarray(np.minimum(energy[:-1], energy[1:]) * np.sqrt((1.0 - cosine) / (1.0 + cosine)))


def run_planner(lines: Blocks, feed: Array, queue: Queue) -> Motion:
    """How a GRBL planner runs the lines at the given feeds.

    feed : (n,) float, mm/s, the F of each block.
    queue : blocks in its queue when a block begins, that one included; one number, or (n,) where it ran short of lines.
    """
    if len(feed) == 0:
        return Motion(*(np.zeros(0) for _ in range(6)))
    nominal = np.minimum(feed, lines.rate)
    limit = np.empty(len(feed) + 1)
    limit[0] = limit[-1] = 0.0
    limit[1:-1] = np.minimum(np.minimum(nominal[1:], nominal[:-1]) ** 2, lines.corner[1:])
    speed2 = reachable(limit, 2.0 * lines.acceleration * lines.length, queue)
    speed = np.sqrt(speed2)
    entry, leave = speed[:-1], speed[1:]
    took = trapezoid_time(lines.length, lines.acceleration, entry, leave, nominal)
    return Motion(entry, leave, nominal, lines.acceleration, lines.length, took)


def reachable(limit: Array, gain: Array, queue: Queue | None = None) -> Array:
    """The greatest squared speeds under `limit` that acceleration and braking allow.

    limit : (n + 1,) float, mm²/s², at the ends of the blocks; gain : (n,) float, 2·a·length of each block.
    queue : how many blocks ahead braking is planned (None: all; (n,): at the start of each); beyond them the planner
        expects to stop.
    """
    energy = np.concatenate([[0.0], np.cumsum(gain)])
    raised = limit + energy
    if queue is None or np.min(queue) >= len(gain):
        back = np.minimum.accumulate(raised[::-1])[::-1]
    else:
        width = np.append(np.broadcast_to(queue, len(gain)), 1)
        stop = energy[np.minimum(np.arange(len(energy)) + width, len(gain))]
        back = np.minimum(_ahead_minimum(raised, width), stop)
    speed2 = np.minimum.accumulate(back - 2.0 * energy) + energy
    return np.asarray(np.maximum(speed2, 0.0))


def _ahead_minimum(values: Array, width: NDArray[np.intp]) -> Array:
    """Minimum of each value and the `width` − 1 after it, of two spans whose lengths are powers of two."""
    n = len(values)
    out, span, level = values.copy(), 1, values
    while span <= width.max():
        chosen = np.flatnonzero((width >= span) & (width < 2 * span))
        out[chosen] = np.minimum(level[chosen], level[np.minimum(chosen + width[chosen] - span, n - 1)])
        ahead = np.append(level[span:], np.full(min(span, n), np.inf))
        level, span = np.minimum(level, ahead[:n]), 2 * span
    return out


def top_speed(length: Array, acceleration: Array, entry: Array, leave: Array, nominal: Array) -> Array:
    """Greatest speed of lines run with constant acceleration and braking, at most at the nominal speed.  mm/s."""
    peak = np.sqrt(0.5 * (entry**2 + leave**2) + acceleration * length)
    return np.asarray(np.minimum(peak, np.maximum(nominal, np.maximum(entry, leave))))


def trapezoid_time(length: Array, acceleration: Array, entry: Array, leave: Array, nominal: Array) -> Array:
    """Time of lines run with constant acceleration, a plateau at most at the nominal speed, and braking.  (n,) s."""
    top = top_speed(length, acceleration, entry, leave, nominal)
    plateau = np.maximum(length - (2.0 * top**2 - entry**2 - leave**2) / (2.0 * acceleration), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        time = (2.0 * top - entry - leave) / acceleration + plateau / top
    return np.asarray(np.where(length > 0.0, time, 0.0))


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
