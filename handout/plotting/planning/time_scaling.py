"""A path slowed down where the machine cannot follow the hand, there alone and by no more than its limits require.

Every sample of the path gets a greatest speed: the hand's own, or less where turning alone would take more than the
machine's acceleration, or where a motor would have to step too fast.  One pass in each direction lowers these to what
acceleration and braking allow; every piece of the path then takes as much longer as it became slower.  Where the hand
stays within the limits nothing changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from handout.plotting.planning import lookahead
from handout.plotting.planning.lookahead import Flags
from handout.plotting.planning.segments import Trajectory, stroke_ends
from handout.values import Array


@dataclass(frozen=True)
class ScalingSettings:
    """What is taken for a corner, a straight line or a piece of a motion."""

    sample_gap: float = 0.012  # s; samples no further apart are those of a motion, others the ends of straight lines
    corner_bend: float = 0.15  # mm·rad; where turn times length is more, there is a corner, which is not rounded off
    speed_ratio: float = 0.3  # of neighbouring pieces; where it is less, the hand stops between them
    shortest_line: float = 0.1  # mm; shorter pieces are always those of a motion
    straight_turn: float = 0.02  # rad; a lesser turn is none
    steepest: float = 2.0  # slope at an end of a piece, of its length; more would swing the curve out
    line_piece: float = 0.3  # mm; straight lines are cut into such pieces, between which speed may change
    most_pieces: int = 4000  # of one straight line at most
    tiny: float = 1e-9  # keeps divisions by 0 away


SETTINGS = ScalingSettings()


@dataclass(frozen=True, eq=False)
class MotionLimits:
    """What a machine can do.

    speed : mm/s along the path; acceleration : mm/s²; deviation : mm, by which a corner may be rounded off.
    motor : mm/s, greatest of each motor; mix : (2, 2) float, by how much the motors move when the pen moves by x, y.
    """

    speed: float
    acceleration: float
    deviation: float
    motor: float
    mix: Array


@dataclass(frozen=True, eq=False)
class TimedCurve:
    """A track as a curve in time: smooth where its samples are those of a motion, straight lines elsewhere.

    smooth : (n,) bool, whether the velocity does not jump at the sample.
    """

    trajectory: Trajectory
    smooth: Flags

    @cached_property
    def velocities(self) -> tuple[Array, Array]:
        """(n, 2) mm/s each, on arriving at the samples and on leaving them; of a parabola where it is smooth."""
        if len(self.trajectory.t) < 2:
            return np.zeros_like(self.trajectory.xy), np.zeros_like(self.trajectory.xy)
        gap, chord = _chords(self.trajectory)
        before, after = np.vstack([chord[:1], chord]), np.vstack([chord, chord[-1:]])
        first, last = stroke_ends(self.trajectory.stroke)
        before[first], after[last] = after[first], before[last]
        early, late = np.append(gap[:1], gap), np.append(gap, gap[-1:])
        share = (late / (early + late))[:, None]
        mean = before * share + after * (1.0 - share)
        smooth = self.smooth[:, None]
        return np.where(smooth, mean, before), np.where(smooth, mean, after)

    def places_at(self, t: Array) -> Array:
        """(m, 2) mm: where the pen should be at times t on the track's clock."""
        trajectory = self.trajectory
        if len(trajectory.t) < 2:
            return np.repeat(trajectory.xy, len(t), axis=0)
        arriving, leaving = self.velocities
        piece = np.clip(np.searchsorted(trajectory.t, t, side="right") - 1, 0, len(trajectory.t) - 2)
        gap = np.maximum(trajectory.t[piece + 1] - trajectory.t[piece], SETTINGS.tiny)[:, None]
        u = np.clip((t - trajectory.t[piece])[:, None] / gap, 0.0, 1.0)
        a, b = trajectory.xy[piece], trajectory.xy[piece + 1]
        va, vb = _tame_slopes(leaving[piece] * gap, b - a), _tame_slopes(arriving[piece + 1] * gap, b - a)
        return np.asarray(a + u * (va + u * (3 * (b - a) - 2 * va - vb + u * (2 * (a - b) + va + vb))))


def _tame_slopes(slope: Array, way: Array) -> Array:
    """(m, 2) mm: slopes that do not carry a curve beyond the ends of its piece."""
    most = SETTINGS.steepest * np.hypot(*way.T) / np.maximum(np.hypot(*slope.T), SETTINGS.tiny)
    return np.asarray(slope * np.minimum(most, 1.0)[:, None])


def smooth_trajectory(trajectory: Trajectory) -> TimedCurve:
    """A track as a curve; long straight lines are cut into pieces."""
    trajectory = _cut_lines(trajectory)
    gap, chord = _chords(trajectory)
    length = gap * np.hypot(*chord.T)
    a, b = chord[:-1], chord[1:]
    turn = np.abs(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)))  # 0 where the pen rests
    smooth = np.zeros(len(trajectory.t), dtype=bool)
    both = np.maximum(length[1:], length[:-1])
    sampled = np.maximum(gap[1:], gap[:-1]) <= SETTINGS.sample_gap
    speed = np.hypot(*chord.T)
    even = np.minimum(speed[1:], speed[:-1]) > SETTINGS.speed_ratio * np.maximum(speed[1:], speed[:-1])
    smooth[1:-1] = (sampled & (turn * both <= SETTINGS.corner_bend) & (even | (both <= SETTINGS.shortest_line))) | (
        even & (turn <= SETTINGS.straight_turn)
    )
    smooth[1:-1] &= (trajectory.stroke[2:] == trajectory.stroke[1:-1]) & (
        trajectory.stroke[:-2] == trajectory.stroke[1:-1]
    )
    return TimedCurve(trajectory, smooth)


def slow_down(path: TimedCurve, limits: MotionLimits) -> TimedCurve:
    """The path with as much more time as the machine needs; every stroke begins and ends at rest."""
    trajectory = path.trajectory
    if len(trajectory.t) < 2:
        return path
    gap, chord = _chords(trajectory)
    length = gap * np.hypot(*chord.T)
    drawn = trajectory.stroke[1:] == trajectory.stroke[:-1]
    arriving, leaving = path.velocities
    hand = np.minimum(np.hypot(*arriving.T), np.hypot(*leaving.T))
    most = np.minimum(hand, _greatest(path, gap, chord, hand, limits))
    most[np.concatenate(stroke_ends(trajectory.stroke))] = 0.0
    speed = np.sqrt(lookahead.reachable(most**2, 2.0 * limits.acceleration * length))
    took = np.where(drawn & (length > 0), _longer(path, gap, length, hand, speed, limits), gap)
    return TimedCurve(
        Trajectory(np.append(0.0, np.cumsum(took)) + trajectory.t[0], trajectory.xy, trajectory.stroke), path.smooth
    )


def _longer(path: TimedCurve, gap: Array, length: Array, hand: Array, speed: Array, limits: MotionLimits) -> Array:
    """(n − 1,) s: what the pieces take.

    Between samples of a motion the hand's own time grows as the speeds at both ends fell; a piece that leads to a
    corner is run on its own, between the speeds at its ends.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        slower = np.where(speed[1:] + speed[:-1] > 0, (hand[1:] + hand[:-1]) / (speed[1:] + speed[:-1]), np.inf)
    a = np.full(len(gap), limits.acceleration)
    most = np.minimum(length / gap, limits.speed)
    alone = lookahead.trapezoid_time(length, a, speed[:-1], speed[1:], most)
    from_rest = 2.0 * np.sqrt(length / limits.acceleration) + length / limits.speed
    between = path.smooth[1:] & path.smooth[:-1]
    took = np.where(between, np.minimum(gap * np.maximum(slower, 1.0), np.maximum(gap, from_rest)), alone)
    return np.asarray(np.maximum(took, gap))


def _greatest(path: TimedCurve, gap: Array, chord: Array, hand: Array, limits: MotionLimits) -> Array:
    """(n,) mm/s: the greatest speeds at the samples that turning and the motors allow."""
    most = np.full(len(hand), limits.speed)
    early, late = np.append(gap[:1], gap), np.append(gap, gap[-1:])
    turning = np.zeros(len(hand))
    mean, change = chord[1:] + chord[:-1], np.diff(chord, axis=0)
    cross = mean[:, 0] * change[:, 1] - mean[:, 1] * change[:, 0]  # of the velocity, across its direction
    turning[1:-1] = np.abs(cross) / np.maximum(np.hypot(*mean.T), SETTINGS.tiny)
    turning /= 0.5 * (early + late)
    smooth = path.smooth & (turning > limits.acceleration)
    most[smooth] = np.minimum(most[smooth], hand[smooth] * np.sqrt(limits.acceleration / turning[smooth]))
    unit = chord / np.maximum(np.hypot(*chord.T), SETTINGS.tiny)[:, None]
    machine = lookahead.Machine(np.full(3, limits.acceleration), np.full(3, np.inf), np.ones(3), limits.deviation, 2)
    flat = np.column_stack([unit, np.zeros(len(unit))])
    corner = np.full(len(hand), np.inf)
    corner[1:-1] = lookahead.corner_speed2(flat[:-1], flat[1:], machine)
    most = np.where(path.smooth, most, np.minimum(most, np.sqrt(corner)))
    busiest = np.abs(unit @ limits.mix.T).max(axis=1)
    motor = limits.motor / np.maximum(busiest, SETTINGS.tiny)
    return np.asarray(np.minimum(most, np.minimum(np.append(motor, np.inf), np.append(np.inf, motor))))


def _cut_lines(trajectory: Trajectory) -> Trajectory:
    """Straight lines in pieces, at equal steps of time."""
    gap, chord = _chords(trajectory)
    length = gap * np.hypot(*chord.T)
    line = (trajectory.stroke[1:] == trajectory.stroke[:-1]) & (
        (gap > SETTINGS.sample_gap) | (length > 8 * SETTINGS.line_piece)
    )
    pieces = np.where(line, np.clip(np.ceil(length / SETTINGS.line_piece), 1, SETTINGS.most_pieces), 1).astype(int)
    start = np.repeat(np.arange(len(gap)), pieces)
    count = np.arange(len(start)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    t = np.append(trajectory.t[start] + gap[start] * count / pieces[start], trajectory.t[-1:])
    return Trajectory(t, trajectory.places_at(t), np.append(trajectory.stroke[start], trajectory.stroke[-1:]))


def _chords(trajectory: Trajectory) -> tuple[Array, Array]:
    """Time and mean velocity from each sample to the next, (n − 1,) s and (n − 1, 2) mm/s; 0 between strokes."""
    gap = np.maximum(np.diff(trajectory.t), SETTINGS.tiny)
    chord = np.diff(trajectory.xy, axis=0) / gap[:, None]
    chord[trajectory.stroke[1:] != trajectory.stroke[:-1]] = 0.0
    return gap, chord
