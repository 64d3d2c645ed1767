"""From a drawing to a plan: where its paths are cut, how fast each segment is run, and what the machine is told."""

from __future__ import annotations

import dataclasses

import numpy as np

from handout.errors import InputError
from handout.plotting import bed, pen_lift
from handout.plotting.dialects import dialect
from handout.plotting.planning import feed_segments, feeds, lookahead, segments, time_slices, toolpath, vectors
from handout.plotting.planning.blocks import Block, Move
from handout.plotting.planning.lookahead import Motion
from handout.plotting.planning.order import shortened
from handout.plotting.planning.plan import Order, Plan, Speed
from handout.plotting.planning.segments import Track
from handout.plotting.planning.toolpath import Course
from handout.profiles import Plotter
from handout.values import Array, Drawing, Stroke, readonly

_DENSE = 0.15  # mm between points at which a path is looked at to find how fast it can be drawn
_LONGEST_DOT = 1.0  # s the pen rests on the paper, however long it rested in the drawing


def plan(drawing: Drawing, profile: Plotter, *, speed: Speed = 1.0, order: Order = "writing") -> Plan:
    """Turn a drawing into motion within a machine's limits, at the speeds of the hand as far as it can keep them.

    Parameters
    ----------
    speed : multiple of the speed of the drawing, or "fast": as fast as the machine can, as a drawing
        without times is always drawn.
    order : "writing" keeps the order of the strokes; "travel" shortens the way between them: by moving whole words
        about, or in a drawing without times in any way.

    Raises
    ------
    DoesNotFit
        Part of the drawing lies outside the bed.
    InputError
        Nothing to draw, or a speed that is not positive.

    Notes
    -----
    Seeds 001–003 time the strokes; the specification of GRBL 1.1's planner decides what becomes of that time.  The
    segments are equal steps in time, since the hand's speed falls where its path turns.
    """
    drawing = dataclasses.replace(drawing, strokes=_ordered(drawing, profile, speed, order))
    speed = speed if drawing.timed else "fast"
    if dialect(profile.dialect).motion == "vectors":
        return vectors.plan(drawing, profile, speed, order)
    placement = bed.place(drawing.page, profile)
    paths = [placement.to_machine(stroke.xy) for stroke in drawing.strokes]
    bed.check(np.concatenate(paths), profile)
    path = segments.track([stroke.t for stroke in drawing.strokes], paths)
    path, meant = _fastest(path, profile) if speed == "fast" else _scaled(path, float(speed))
    real = meant if drawing.timed else path.t
    if dialect(profile.dialect).motion == "timed":
        timing = time_slices.Timing(path, real, _dots(drawing, speed))
        return time_slices.plan(drawing, profile, timing, placement, speed, order)
    cuts = feed_segments.cut(path, profile)
    clock = np.interp(cuts.t, path.t, meant) * (1.0 if speed == "fast" else float(speed))
    way = toolpath.lay_out(cuts, _dots(drawing, speed), profile, pen_lift.along(drawing, clock, profile.pen))
    feed, motion = feed_segments.run(way, profile)
    intended = way.intended.copy()
    intended[way.draws] = np.diff(np.interp(cuts.t, path.t, real))[cuts.stroke[1:] == cuts.stroke[:-1]]
    starts = toolpath.starts(way, motion, profile)
    blocks, begins = _blocks(way, feed, starts, motion)
    return Plan(
        drawing, profile, speed, order, placement, way, motion, starts, blocks, begins, readonly(intended, None)
    )


def _ordered(drawing: Drawing, profile: Plotter, speed: Speed, order: Order) -> tuple[Stroke, ...]:
    """The strokes in the order asked for; refuses what cannot be planned."""
    if not drawing.strokes:
        raise InputError("The page has no strokes: there is nothing to plot.")
    if speed != "fast" and not (isinstance(speed, int | float) and 0.01 <= speed <= 100):
        raise InputError(f'speed: {speed} is not "fast" and not between 0.01 and 100 times the speed of the hand.')
    if order not in ("writing", "travel"):
        raise InputError(f'order: {order!r} is neither "writing" nor "travel".')
    if order == "writing":
        return drawing.strokes
    return shortened(drawing, bed.place(drawing.page, profile).to_page(np.zeros((1, 2)))[0])


def _scaled(path: Track, speed: float) -> tuple[Track, Array]:
    scaled = Track(path.t / speed, path.xy, path.stroke)
    return scaled, scaled.t


def _dots(drawing: Drawing, speed: Speed) -> Array:
    """How long the pen rests where a stroke goes nowhere, s."""
    if not drawing.timed:
        return np.zeros(len(drawing.strokes))
    factor = 1.0 if speed == "fast" else float(speed)
    return np.array([min((stroke.t[-1] - stroke.t[0]) / factor, _LONGEST_DOT) for stroke in drawing.strokes])


def _fastest(path: Track, profile: Plotter) -> tuple[Track, Array]:
    """The path at the greatest speed the machine can keep, and the times of its samples in the drawing."""
    step = np.hypot(*np.diff(path.xy, axis=0, prepend=path.xy[:1]).T)
    step[np.diff(path.stroke, prepend=0) > 0] = 1.0
    distance = Track(np.cumsum(np.maximum(step, 1e-6)), path.xy, path.stroke)
    dense = segments.cut(distance, 1.0 / _DENSE, feed_segments.shortest(profile), feed_segments.DEVIATION / 2)
    lines, within = feed_segments.lines(dense, profile)
    fastest = float(profile.limits.draw_speed)
    most = np.minimum(feeds.greatest(lines, profile.limits.acceleration, fastest), lines.rate)
    limit = np.zeros(len(most) + 1)
    limit[1:-1] = np.where(within[1:] & within[:-1], np.minimum(most[1:], most[:-1]) ** 2, 0.0)
    sharp = np.isinf(lines.radius[1:])  # no curve turns there
    limit[1:-1][sharp] = np.minimum(limit[1:-1], lines.corner[1:])[sharp]
    speed = np.sqrt(lookahead.reachable(limit, 2.0 * lines.acceleration * lines.length))
    took = lookahead.trapezoid_time(lines.length, lines.acceleration, speed[:-1], speed[1:], most)
    t = np.concatenate([[0.0], np.cumsum(np.where(within, np.maximum(took, 1e-6), 1.0))])
    return Track(t, dense.xy, dense.stroke), np.interp(dense.t, distance.t, path.t)


def _blocks(way: Course, feed: Array, starts: Array, motion: Motion) -> tuple[tuple[Block, ...], Array]:
    """What the machine is told, and when it begins each."""
    xyz, feeds_ = way.points[1:].tolist(), feed.tolist()
    rests = np.append(0.0, starts[:-1] + motion.duration)
    height = (way.draws & way.follows_pressure).tolist()
    blocks = tuple(
        Move(xyz[row][0], xyz[row][1], feeds_[row], xyz[row][2] if height[row] else None) if block is None else block
        for block, row in way.told
    )
    rows = np.array([row for _, row in way.told])
    moves = np.array([block is None for block, _ in way.told])
    return blocks, np.where(moves, starts[rows], rests[rows])
