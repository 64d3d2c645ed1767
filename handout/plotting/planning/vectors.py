"""Planning for plotters that draw vectors: every line from its start to its end at one speed for the whole stroke.

Such a plotter takes no times.  It is told a velocity before a stroke (VS) and draws each of its vectors with a
trapezoid of speed up to that velocity, each axis within its own limits; between two vectors it slows down as its
profile says, to rest with ``junction_deviation = "0mm"``.  So the timing of the hand is lost within a stroke; the
velocity is chosen so that each stroke as a whole takes the hand's time.

Source: Hewlett-Packard, HP 7470A manual (VS: of horizontal or vertical moves with the pen down, rounded to
0.38 cm/s).  How corners are taken is in no manual; a stand at each is what the profiles assume.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.plotting.dialects import Block, MoveBlock
from handout.plotting.planning import lookahead, segments
from handout.plotting.planning.lookahead import Blocks
from handout.plotting.planning.plan import Plan, PlanRequest
from handout.plotting.planning.segments import Trajectory
from handout.plotting.planning.toolpath import WIPE, Toolpath, lay_out, machine_of, start_times
from handout.profiles import Plotter
from handout.values import Array

Index = NDArray[np.intp]


@dataclass(frozen=True)
class VectorSettings:
    """How a path is cut into vectors, and what of the connection they may take."""

    deviation: float = 0.025  # mm between path and vectors: one plotter unit; rounding to whole ones adds half of one
    rate: float = 10.0  # vectors a second at least; more where the path curves
    shortest: float = 2.0  # plotter units a vector has at least
    longest: float = 2.5  # mm of a vector
    speeds: int = 48  # velocities that are tried
    matters: float = 0.08  # a velocity is kept as long as the stroke's time is no worse than the best by this share
    wire: float = 0.9  # share of the connection that is counted on; the rest is asking for room
    point: float = 10.5  # bytes that a vector takes on the wire, two coordinates with their commas
    ahead: float = 256.0  # bytes that are counted on to have come before they are drawn
    stroke: float = 40.0  # bytes of a stroke besides: pen up, the way to it, pen down, a velocity


SETTINGS = VectorSettings()


def plan(request: PlanRequest) -> Plan:
    """A plan of vectors; see `planner.plan`."""
    profile, per_mm = request.profile, request.profile.limits.steps_per_mm
    cuts = _shorter(segments.cut_path(request.path, SETTINGS.rate, SETTINGS.shortest / per_mm, SETTINGS.deviation))
    cuts = dataclasses.replace(cuts, xy=np.round(cuts.xy * per_mm) / per_mm)
    toolpath = lay_out(cuts, np.zeros(len(request.drawing.strokes)), profile, request.hooked)
    lines = lookahead.blocks(toolpath.points, toolpath.stands, machine_of(profile))
    if not profile.limits.junction_deviation > 0:  # the pen stands at every end of a vector
        lines = dataclasses.replace(lines, corner=np.zeros(len(lines.corner)))
    target = toolpath.requested_time / request.factor
    feed = _feeds(toolpath, lines, np.zeros_like(target) if request.speed == "fast" else target, profile)
    motion = lookahead.run_planner(lines, feed * lines.rate / _fastest(profile), profile.port.queue)
    xy, feeds = toolpath.points[1:, :2].tolist(), (feed * 60.0).tolist()
    blocks = toolpath.blocks(lambda row: MoveBlock(xy[row][0], xy[row][1], feeds[row]))
    fetching = float(profile.hpgl.pen_time)
    starts = start_times(toolpath, motion, profile) + fetching - profile.pen.up_time  # it is up already
    starts = starts + _measure_starvation(blocks, toolpath, starts, profile)
    starts[-1] += fetching if profile.hpgl.pens > 1 else 0.0
    target = target if request.drawing.timed else motion.duration
    return Plan.from_request(request, toolpath, motion, starts, blocks, np.where(toolpath.draws, target, 0.0))


def _shorter(cuts: Trajectory) -> Trajectory:
    """Long vectors in equal parts: what is drawn of one when a plot breaks off may have to be drawn again."""
    within = cuts.stroke[1:] == cuts.stroke[:-1]
    length = np.hypot(*np.diff(cuts.xy, axis=0).T)
    parts = np.append(np.where(within, np.maximum(np.ceil(length / SETTINGS.longest), 1), 1), 1).astype(int)
    row = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[row]
    ahead = np.minimum(row + 1, len(parts) - 1)
    t = cuts.t[row] + share * (cuts.t[ahead] - cuts.t[row])
    return Trajectory(t, cuts.xy[row] + share[:, None] * (cuts.xy[ahead] - cuts.xy[row]), cuts.stroke[row])


def _fastest(profile: Plotter) -> float:
    return float(max(profile.limits.draw_speed, profile.limits.travel_speed))


def _feeds(toolpath: Toolpath, lines: Blocks, wanted: Array, profile: Plotter) -> Array:
    """The velocity of every move, mm/s: each stroke lasts as long as it is meant to.

    A stroke whose vectors come over the wire more slowly than they could be drawn is drawn as slowly as they come: a
    pen that waits leaves a blot.
    """
    limits, draws = profile.limits, toolpath.draws
    # velocities that the plotter has, mm/s, slow to fast
    step, most = float(profile.hpgl.speed_step), float(limits.draw_speed)
    speeds = step * np.unique(np.round(np.geomspace(1, max(int(most / step + 1e-6), 1), SETTINGS.speeds)))
    feed = np.where(toolpath.kind == WIPE, speeds[-1], float(limits.travel_speed))
    if not draws.any():
        return feed
    stroke, many = toolpath.stroke[draws], len(toolpath.first)

    def move_feeds(feeds: Array) -> Array:
        return lookahead.run_planner(lines, feeds * lines.rate / _fastest(profile), profile.port.queue).duration

    lifted = np.where(
        draws, 0.0, move_feeds(feed)
    )  # (n,) s; then (strokes,) s between the end of the stroke before and each
    gaps = np.diff(np.concatenate([[0.0], np.cumsum(lifted + toolpath.pause[:-1])])[toolpath.first], prepend=0.0)
    durations = np.asarray(np.bincount(stroke, wanted[draws], many), dtype=float)
    durations = _wait_for_wire(durations, np.bincount(stroke, minlength=many), gaps, profile)
    took = np.array(
        [np.bincount(stroke, move_feeds(np.where(draws, v, feed))[draws], many) for v in speeds], dtype=float
    )
    # how far each velocity misses the time of each stroke, as a share of it; changed only where it matters
    off = np.abs(took - durations) / np.maximum(durations, 1e-9)
    best = off.argmin(axis=0)
    chosen, now = np.empty(many, dtype=np.intp), int(best[0])
    for index, wish in enumerate(best.tolist()):
        if off[now, index] > off[wish, index] + SETTINGS.matters:
            now = wish
        chosen[index] = now
    feed[draws] = speeds[chosen][stroke]
    return feed


def _wait_for_wire(durations: Array, vectors: Index, gaps: Array, profile: Plotter) -> Array:
    """(strokes,) s that strokes take: long enough for what is not in the plotter when one begins to come meanwhile.

    durations, gaps : (strokes,) s: of each, and before each, in which the wire gets ahead; vectors : how many each has.
    """
    rate = profile.port.baud / 10.0 * SETTINGS.wire
    ahead, took = 0.0, []
    for time, count, gap in zip(durations.tolist(), vectors.tolist(), gaps.tolist(), strict=True):
        ahead = min(ahead + gap * rate - SETTINGS.stroke, SETTINGS.ahead)
        need = count * SETTINGS.point
        took.append(max(time, (need - ahead) / rate))
        ahead = min(ahead + took[-1] * rate - need, SETTINGS.ahead)
    return np.array(took)


def _measure_starvation(blocks: tuple[Block, ...], toolpath: Toolpath, starts: Array, profile: Plotter) -> Array:
    """(n + 1,) float, s: how much later each move begins because it has not come over the wire by then."""
    from handout.plotting.dialects import dialect  # dialects plan with this module

    arrived, sent, done = np.zeros(len(blocks)), 0, 0
    for command in dialect(profile.dialect).program(blocks, profile):
        sent += len(command.data)
        arrived[done : command.done] = sent
        done = command.done
    arrived *= 10.0 / (profile.port.baud * SETTINGS.wire)
    late = np.zeros(len(starts))
    rows = np.array([row for _, row in toolpath.instructions])
    np.maximum.at(late, rows, arrived - starts[rows])
    return np.asarray(np.maximum(np.maximum.accumulate(late), 0.0))
