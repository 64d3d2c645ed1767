"""Plans for machines that keep time: strokes cut into short slices of time, each with its place at its end.

Such a machine does as it is told, so the plan itself sees to it that no more is asked than it can do, and nothing has
to be guessed about a planner.  Slices are cut where a motor turns round, so that within a slice each goes one way; all
durations are whole milliseconds, which every such machine can count.

A path is slowed down where the machine cannot follow the hand, there alone and by no more than its limits require.
Every sample of the path gets a greatest speed: the hand's own, or less where turning alone would take more than the
machine's acceleration, or where a motor would have to step too fast.  One pass in each direction lowers these to what
acceleration and braking allow; every piece of the path then takes as much longer as it became slower.  Where the hand
stays within the limits nothing changes.

Source: Schmalz, EiBotBoard command set: whole milliseconds, 25 000 steps/s of a motor at most; the rest is own method.
"""

from __future__ import annotations

import bisect
from dataclasses import dataclass
from functools import cached_property

import msgspec
import numpy as np

from handout.plotting import pen_lift
from handout.plotting.dialects import Timed
from handout.plotting.planning import lookahead
from handout.plotting.planning.lookahead import Flags, Motion
from handout.plotting.planning.plan import Plan, PlanRequest, set_pace
from handout.plotting.planning.segments import Trajectory, stroke_ends
from handout.plotting.planning.toolpath import FREE, TRAVEL, WIPE, HookSpan, Instruction, Toolpath, lay_out, start_times
from handout.profiles import PenLift as PenProfile
from handout.profiles import Plotter, Time
from handout.values import Array, readonly


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


_STEP_RATE = 24_900.0  # steps/s of a motor at most; the boards count 25 000 ticks a second
_SHORTEST = 0.006  # s; boards of any age read the next move within that time
_TRAVEL = 0.025  # s; slices of a move with the pen lifted
_MS = 1000.0
_PULSE = 0.024  # s between two pulses to the servo: it would not hear of a value sooner
_VALUES = 16  # that the servo is told between no pressure and full
_CORNER = np.radians(30.0)  # a turn by more is the end of a slice


def plan(request: PlanRequest) -> Plan:
    """A plan of timed moves; see `planner.plan`."""
    profile, asked = request.profile, set_pace(request)
    path = smooth_trajectory(asked.path)
    target = np.interp(path.trajectory.t, asked.path.t, asked.target)
    slow = slow_down(path, motion_limits(profile))
    cuts, when = slices(slow, profile)
    drawn = np.interp(path.trajectory.t, asked.path.t, asked.drawn)  # on the drawing's clock, which has the pressure
    clock = np.interp(when, slow.trajectory.t, drawn) * request.factor
    values = pen_lift.heights_along(request.drawing, clock, profile.pen)
    toolpath, motion = _motion(lay_out(cuts, asked.dots, _attentive(profile), request.hooked, values), profile)
    starts = start_times(toolpath, motion, _attentive(profile))
    ends, took = toolpath.points[1:, :2].tolist(), np.round(motion.duration, 6).tolist()
    servo = _set_pressures(toolpath, took, profile.pen)
    blocks = toolpath.blocks(lambda row: Timed(ends[row][0], ends[row][1], took[row], servo[row]))
    times = toolpath.drawn_times(cuts, np.interp(when, slow.trajectory.t, target))
    return Plan.from_request(request, toolpath, motion, starts, blocks, times)


def _set_pressures(toolpath: Toolpath, took: list[float], pen: PenProfile) -> list[float | None]:
    """Values for the servo as each move begins, by the pressure at its end; None: it stays."""
    values: list[float | None] = [None] * len(took)
    if pen.pressed is None or not toolpath.follows_pressure:
        return values
    step = (pen.pressed - pen.down) / _VALUES
    parts = np.rint((toolpath.points[1:, 2] - pen.down) / step).astype(int).tolist()
    told, since = 0, np.inf
    for row, draws in enumerate(toolpath.draws.tolist()):
        if not draws:
            told, since = 0, np.inf
        elif parts[row] != told and since >= _PULSE:
            told, since = parts[row], 0.0
            values[row] = float(round(pen.down + step * told))
        since += took[row]
    return values


def motion_limits(profile: Plotter) -> MotionLimits:
    """What a machine that keeps time can do."""
    limits = profile.limits
    mix = np.array([[1.0, 1.0], [1.0, -1.0]]) if profile.bed.gantry == "corexy" else np.eye(2)
    return MotionLimits(
        float(limits.draw_speed),
        float(limits.acceleration),
        float(limits.junction_deviation),
        _STEP_RATE / limits.steps_per_mm,
        mix,
    )


def _attentive(profile: Plotter) -> Plotter:
    """The machine as if it read its commands in no time: while it stands, the next are read already."""
    return msgspec.structs.replace(profile, port=msgspec.structs.replace(profile.port, line_time=Time(0.0)))


def slices(path: TimedCurve, profile: Plotter) -> tuple[Trajectory, Array]:
    """Cut the strokes into slices of about the length the profile asks for, in whole milliseconds.

    Returns the ends of the slices; a stroke that goes nowhere has one.
        when : (n,) float, s, the same on the clock of the path, which differs by less than a millisecond a stroke.
    """
    trajectory = path.trajectory
    first, last = stroke_ends(trajectory.stroke)
    mix = motion_limits(profile).mix
    # samples at which a straight line ends and another begins in another direction
    arriving, leaving = path.velocities
    cross = arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0]
    turn = np.abs(np.arctan2(cross, (arriving * leaving).sum(axis=1)))
    corner = ~path.smooth & (turn > _CORNER)
    length = min(max(1.0 / profile.segment_rate, _SHORTEST), 4 * _TRAVEL)
    least = 1.0 / profile.limits.steps_per_mm
    clocks, times = [], []
    for a, b in zip(first.tolist(), last.tolist(), strict=True):
        begin, whole = float(trajectory.t[a]), float(trajectory.t[b] - trajectory.t[a])
        moves = b > a and bool((np.ptp(trajectory.xy[a : b + 1], axis=0) >= least).any())
        if not moves:
            clocks.append(np.array([begin]))
            times.append(np.array([begin]))
            continue
        ms = max(round(whole * _MS), 2 * round(_SHORTEST * _MS))
        corners = np.rint((trajectory.t[a : b + 1][corner[a : b + 1]] - begin) / whole * ms).astype(int)
        ends = _ends_of_slices(path, begin, whole / ms, ms, corners, mix, round(length * _MS))
        clocks.append(begin + ends / _MS)
        times.append(begin + ends * (whole / ms))
    stroke = np.repeat(np.arange(len(clocks)), [len(clock) for clock in clocks])
    when = np.concatenate(times)
    return Trajectory(np.concatenate(clocks), path.places_at(when), trajectory.stroke[first][stroke]), when


def _ends_of_slices(
    path: TimedCurve, begin: float, unit: float, ms: int, corners: Array, mix: Array, length: int
) -> Array:
    """Where the slices of one stroke end, ms: at its corners, where a motor turns round, and evenly in between."""
    at = np.arange(ms + 1)
    motors = path.places_at(np.asarray(begin + at * unit)) @ mix.T
    steps = np.diff(motors, axis=0)
    turned = (steps[1:] * steps[:-1] < 0).any(axis=1)
    turns = np.flatnonzero(turned) + 1
    sharp = np.abs(np.diff(steps, axis=0)).max(axis=1)[turns - 1]
    wanted = np.concatenate([corners, turns[np.argsort(-sharp, kind="stable")]]).astype(int)
    ends = [0, ms]
    shortest = round(_SHORTEST * _MS)
    for place in wanted.tolist():
        after = bisect.bisect(ends, place)
        if 0 < after < len(ends) and place - ends[after - 1] >= shortest and ends[after] - place >= shortest:
            ends.insert(after, place)
    pieces = np.maximum(np.rint(np.diff(ends) / length), 1).astype(int)
    parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends, ends[1:], pieces.tolist(), strict=False)]
    return np.append(np.rint(np.concatenate(parts)), ms)


def travel(begin: Array, end: Array, profile: Plotter) -> list[Timed]:
    """A move with the pen lifted from one place to another, (2,) mm each: speeding up, level, braking."""
    run = _travel(begin, end, profile, float(profile.limits.travel_speed))
    return [Timed(x, y, seconds) for (x, y), seconds in zip(run.points.tolist(), run.took.tolist(), strict=True)]


@dataclass(frozen=True, eq=False)
class _TravelSlices:
    """A travel in slices: where each ends, (n, 2) mm; how long it takes, (n,) s; speeds where they meet, (n + 1,)."""

    points: Array
    took: Array
    speed: Array


def _travel(begin: Array, end: Array, profile: Plotter, fastest: float) -> _TravelSlices:
    length = float(np.hypot(*(end - begin)))
    if length == 0.0:
        return _TravelSlices(np.zeros((0, 2)), np.zeros(0), np.zeros(1))
    machine, unit = motion_limits(profile), (end - begin) / length
    motor = machine.motor / float(np.abs(machine.mix @ unit).max())
    most = min(fastest, motor, (machine.acceleration * length) ** 0.5)
    up = max(int(np.ceil(most / machine.acceleration * _MS - 1e-6)), round(_SHORTEST * _MS))
    level = max(int(np.ceil(length / most * _MS - up - 1e-6)), 0)
    level = max(level, round(_SHORTEST * _MS)) if level else 0
    top = length / (up + level)  # mm a ms
    parts = [(0.0, top, up), (top, top, level), (top, 0.0, up)]
    took: list[float] = []
    speed = [0.0]
    for before, after, ms in parts:
        marks = np.rint(np.linspace(0, ms, max(round(ms / (_TRAVEL * _MS)), 1) + 1)) if ms else np.zeros(1)
        took += np.diff(marks).tolist()
        speed += (before + (after - before) * marks[1:] / max(ms, 1)).tolist()
    travelled = np.cumsum(np.array(took) * 0.5 * (np.array(speed[1:]) + np.array(speed[:-1])))
    points = begin + unit * travelled[:, None]
    points[-1] = end
    return _TravelSlices(points, np.array(took) / _MS, np.array(speed) * _MS)


def _motion(toolpath: Toolpath, profile: Plotter) -> tuple[Toolpath, Motion]:
    """The toolpath with its travels in slices, and how it runs: drawn slices at their mean speeds."""
    fastest = {TRAVEL: float(profile.limits.travel_speed), WIPE: float(profile.limits.draw_speed)}
    runs = {
        row: _travel(toolpath.points[row, :2], toolpath.points[row + 1, :2], profile, fastest[int(toolpath.kind[row])])
        for row in np.flatnonzero(np.isin(toolpath.kind, FREE)).tolist()
    }
    toolpath = _slice_travels(toolpath, runs)
    length = np.hypot(*np.diff(toolpath.points[:, :2], axis=0).T)
    took, travels = toolpath.requested_time.copy(), np.isin(toolpath.kind, FREE)
    if runs:
        took[travels] = np.concatenate([run.took for run in runs.values()])
    mean = length / np.maximum(took, 1e-9)
    entry, leave = mean.copy(), mean.copy()
    if runs:
        entry[travels] = np.concatenate([run.speed[:-1] for run in runs.values()])
        leave[travels] = np.concatenate([run.speed[1:] for run in runs.values()])
    acceleration = np.maximum(np.abs(leave - entry) / np.maximum(took, 1e-9), 1.0)
    return toolpath, Motion(entry, leave, np.maximum(entry, leave), acceleration, length, took)


def _slice_travels(toolpath: Toolpath, runs: dict[int, _TravelSlices]) -> Toolpath:
    """The toolpath with every travel in as many moves as its run has."""
    many = np.ones(len(toolpath.kind), dtype=int)
    for row, run in runs.items():
        many[row] = len(run.took)
    begin = np.append(0, np.cumsum(many))
    points = np.empty((begin[-1] + 1, 3))
    points[begin] = toolpath.points
    for row, run in runs.items():
        inside = slice(begin[row] + 1, begin[row + 1])
        points[inside, :2], points[inside, 2] = run.points[:-1], toolpath.points[row + 1, 2]
    stands, pause = np.zeros(begin[-1], dtype=bool), np.zeros(begin[-1] + 1)
    stands[begin[:-1]], pause[begin] = toolpath.stands, toolpath.pause
    instructions: list[Instruction] = []
    begins: list[int] = []  # of each instruction, where it begins among the new ones
    for block, row in toolpath.instructions:
        begins.append(len(instructions))
        first = int(begin[row])
        instructions += [(block, first)] if block is not None else [(None, first + part) for part in range(many[row])]
    begins.append(len(instructions))
    return Toolpath(
        points=readonly(points, None, 3),
        kind=np.repeat(toolpath.kind, many),
        stroke=np.repeat(toolpath.stroke, many),
        requested_time=np.repeat(toolpath.requested_time, many),
        stands=stands,
        pause=pause,
        first=begin[toolpath.first],
        instructions=tuple(instructions),
        hooks=tuple(HookSpan(name, begins[first], begins[stop]) for name, first, stop in toolpath.hooks),
    )
