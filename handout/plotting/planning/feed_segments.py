"""Controllers that plan: the segments and feeds they are told, and the motion they make of them.

Such a controller (GRBL, Marlin) is given feeds from which it makes its own speeds, within its acceleration; here its
planner is run in advance, and the feeds are chosen for what it will make of them.


How lines reach a controller that plans: how many a second, and how many moves it has in hand at any moment.

Lines are read one after the other, each in `line_time`, as long as the queue has room.  After a rest the queue is
empty, and the machine waits for it to fill (`toolpath.starts`); from then on a move is read while others are executed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.plotting.dialects import dialect
from handout.plotting.planning import feed_segments, feeds, lookahead, segments, toolpath
from handout.plotting.planning.lookahead import Blocks, Flags, Motion
from handout.plotting.planning.segments import Track
from handout.plotting.planning.toolpath import Course
from handout.profiles import Plotter
from handout.values import Array

DEVIATION = 0.02  # mm between path and segments; corners cut off and whole steps add to it, 0.05 is allowed in all
_BURST = 8  # segments; half a queue
_SLOWED = 0.8  # a corner that allows less than this share of the wanted speed² is taken in shorter segments
_CHANGED = 1e-4  # s; a queue that runs shorter than it was taken for matters from here


def least_queue(way: Course, motion: Motion, profile: Plotter) -> int | None:
    """The fewest moves a controller that plans will have in hand in the middle of a stroke; None for other machines."""
    if dialect(profile.dialect).motion != "planned":
        return None
    return feed_segments.least(way, feed_segments.depth(way, motion, profile), profile.port.queue)


def lines(cuts: Track, profile: Plotter) -> tuple[Blocks, Flags]:
    """The lines between all cuts, and which of them are drawn (the others lead from stroke to stroke)."""
    within = cuts.stroke[1:] == cuts.stroke[:-1]
    stands = ~(within & np.append(False, within[:-1]))
    points = np.column_stack([cuts.xy, np.zeros(len(cuts.t))])
    return lookahead.blocks(points, stands, toolpath.machine(profile)), within


def shortest(profile: Plotter) -> float:
    """How long a segment is at least, mm."""
    return float(dialect(profile.dialect).shortest_segment / profile.limits.steps_per_mm)


def cut(path: Track, profile: Plotter) -> Track:
    """Cut the path into segments; shorter ones where corners of the usual length would have to be taken too slowly."""
    least, capacity = shortest(profile), feed_segments.capacity(profile)
    cuts = segments.cut(path, min(profile.segment_rate, capacity), least, DEVIATION)
    straight, within = lines(cuts, profile)
    if len(within) > 1:
        took = np.where(within, np.diff(cuts.t), np.inf)
        wanted = np.append(0.0, np.minimum(straight.length[1:] / took[1:], straight.length[:-1] / took[:-1])) ** 2
        could = _SLOWED * np.minimum(wanted, profile.limits.acceleration * straight.radius)
        slowed = straight.corner < could
        halve = within & (slowed | np.append(slowed[1:], False))
        middle = 0.5 * (cuts.t[:-1] + cuts.t[1:])
        off = path.at(middle)  # a pen that rested may not have left an end by then
        room = np.minimum(np.hypot(*(off - cuts.xy[:-1]).T), np.hypot(*(off - cuts.xy[1:]).T))
        halve &= (room >= least) & (took > 2.0 / capacity)
        t = np.sort(np.append(cuts.t, middle[halve]))
        cuts = Track(t, path.at(t), path.stroke_at(t))
    return Track(cuts.t, np.round(cuts.xy, 3), cuts.stroke)


def run(way: Course, profile: Plotter) -> tuple[Array, Motion]:
    """The feed of every move, mm/min, as it is written, fitted to the planner; and what the planner makes of them."""
    limits, queue = profile.limits, profile.port.queue
    blocks = lookahead.blocks(way.points, way.stands, toolpath.machine(profile))
    given = toolpath.pen_up_speeds(way, profile)
    most = feeds.greatest(blocks, limits.acceleration, float(limits.draw_speed))
    crowding = _crowding(way, 1.0 / feed_segments.capacity(profile))
    wanted = way.intended * crowding
    crowded = crowding > 1.0  # no time is to be made up where lines could not follow
    most[crowded] = np.minimum(most, blocks.length / np.maximum(wanted, 1e-9))[crowded]
    feed = feeds.round_feed(feeds.fit(blocks, wanted, given, way.draws, most, queue))
    motion = lookahead.run(blocks, feed / 60.0, queue)
    seen = feed_segments.depth(way, motion, profile)
    short = lookahead.run(blocks, feed / 60.0, seen)
    return feed, short if abs(float((short.duration - motion.duration).sum())) > _CHANGED else motion


def _crowding(way: Course, line_time: float) -> Array:
    """How much slower segments have to be run where too many follow on each other, or the queue would run empty.

    The queue makes up for a few short ones; what counts is the mean over `_BURST` of them.
    """
    if not way.draws.any():
        return np.ones(len(way.kind))
    time = np.convolve(np.where(way.draws, way.intended, 1.0), np.ones(_BURST), "same")
    return np.asarray(np.maximum(_BURST * line_time / np.maximum(time[: len(way.intended)], 1e-9), 1.0))


_BUSY = 0.8  # share of what the controller can read that is asked of it
_LINE = 22.0  # bytes of a line at most


def capacity(profile: Plotter) -> float:
    """Lines a second that the connection carries and the controller reads, with something to spare."""
    return _BUSY / max(line_time(profile), 1e-4)


def line_time(profile: Plotter) -> float:
    """What a line takes to arrive and to be read, whichever is longer, s."""
    return max(float(profile.port.line_time), _LINE * 10 / profile.port.baud)


def depth(way: Course, motion: Motion, profile: Plotter) -> NDArray[np.intp]:
    """Moves in the machine's queue when each begins, that one included.  (n,) at least 1.

    A place in the queue counts as free when the move that held it begins; a GRBL frees it up to six moves earlier.
    """
    if len(way.kind) == 0:
        return np.zeros(0, dtype=np.intp)
    queue, each = profile.port.queue, line_time(profile)
    number = np.arange(len(way.kind))
    begins = toolpath.starts(way, motion, profile)[:-1]
    first = _first(way)
    room = np.where(number - queue >= first, begins[np.maximum(number - queue, 0)], -np.inf)
    room[way.stands] = begins[way.stands] - toolpath.filling(way, profile)
    read = each * (number + 1) + np.maximum.accumulate(room - each * number)
    have = np.searchsorted(read, begins + 1e-9, side="right") - number
    return np.asarray(np.clip(have, 1, queue), dtype=np.intp)


def least(way: Course, have: NDArray[np.intp], queue: int) -> int | None:
    """The fewest moves in the queue in the middle of a stroke, where there were more to come; None if there is none."""
    first = _first(way)
    ends = np.append(np.flatnonzero(way.stands)[1:], len(way.kind))
    after = ends[np.searchsorted(ends, np.arange(len(way.kind)), side="right")]
    middle = way.draws & (np.arange(len(way.kind)) > first) & (np.arange(len(way.kind)) + queue <= after)
    return int(have[middle].min()) if middle.any() else None


def _first(way: Course) -> NDArray[np.intp]:
    """Of every move, the first after the rest before it."""
    stand = np.flatnonzero(way.stands)
    return np.repeat(stand, np.diff(np.append(stand, len(way.kind))))
