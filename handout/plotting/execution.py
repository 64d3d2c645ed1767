"""Controllers that plan: the segments and feeds they are told, and the motion they make of them.

Such a controller (GRBL, Marlin) is given feeds from which it makes its own speeds, within its acceleration; here its
planner is run in advance, and the feeds are chosen for what it will make of them.
"""

from __future__ import annotations

import numpy as np

from handout.plotting import course, feeds, knots, lookahead, streaming
from handout.plotting.course import Course
from handout.plotting.knots import Track
from handout.plotting.lookahead import Blocks, Flags, Motion
from handout.profiles import Plotter
from handout.values import Array

DEVIATION = 0.02  # mm between path and segments; corners cut off and whole steps add to it, 0.05 is allowed in all
_PLANNING = frozenset({"grbl", "marlin"})  # dialects of controllers that plan; the others have plans of their own
_SHORTEST = 3.0  # steps a segment has at least: fewer have no direction, and their feeds make a GRBL crawl
_SHORTEST_MARLIN = 9.0  # which joins a move of fewer than six steps of its longer axis to the next
_BURST = 8  # segments; half a queue
_SLOWED = 0.8  # a corner that allows less than this share of the wanted speed² is taken in shorter segments
_CHANGED = 1e-4  # s; a queue that runs shorter than it was taken for matters from here


def least_queue(way: Course, motion: Motion, profile: Plotter) -> int | None:
    """The fewest moves a controller that plans will have in hand in the middle of a stroke; None for other machines."""
    if profile.dialect not in _PLANNING:
        return None
    return streaming.least(way, streaming.depth(way, motion, profile), profile.port.queue)


def lines(cuts: Track, profile: Plotter) -> tuple[Blocks, Flags]:
    """The lines between all cuts, and which of them are drawn (the others lead from stroke to stroke)."""
    within = cuts.stroke[1:] == cuts.stroke[:-1]
    stands = ~(within & np.append(False, within[:-1]))
    points = np.column_stack([cuts.xy, np.zeros(len(cuts.t))])
    return lookahead.blocks(points, stands, course.machine(profile)), within


def shortest(profile: Plotter) -> float:
    """How long a segment is at least, mm."""
    steps = _SHORTEST_MARLIN if profile.dialect == "marlin" else _SHORTEST
    return float(steps / profile.limits.steps_per_mm)


def cut(path: Track, profile: Plotter) -> Track:
    """Cut the path into segments; shorter ones where corners of the usual length would have to be taken too slowly."""
    least, capacity = shortest(profile), streaming.capacity(profile)
    cuts = knots.cut(path, min(profile.segment_rate, capacity), least, DEVIATION)
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
    blocks = lookahead.blocks(way.points, way.stands, course.machine(profile))
    given = course.pen_up_speeds(way, profile)
    most = feeds.greatest(blocks, limits.acceleration, float(limits.draw_speed))
    crowding = _crowding(way, 1.0 / streaming.capacity(profile))
    wanted = way.intended * crowding
    crowded = crowding > 1.0  # no time is to be made up where lines could not follow
    most[crowded] = np.minimum(most, blocks.length / np.maximum(wanted, 1e-9))[crowded]
    feed = feeds.round_feed(feeds.fit(blocks, wanted, given, way.draws, most, queue))
    motion = lookahead.run(blocks, feed / 60.0, queue)
    seen = streaming.depth(way, motion, profile)
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
