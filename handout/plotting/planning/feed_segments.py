"""Plans for controllers that plan (GRBL, Marlin): segments and feeds, fitted to what the controller makes of them.

Such a controller is given feeds from which it makes its own speeds, within its acceleration; here its planner is run in
advance, and the feeds are chosen for what it will make of them.  The segments are equal steps in time, since
the hand's speed falls where its path turns.

Lines reach the controller one after the other, each in `line_time`, as long as its queue has room.  After a rest the
queue is empty, and the machine waits for it to fill (`toolpath.start_times`); from then on a move is read while others
are executed.  So segments are no shorter than lines can follow on each other (`capacity`), and where the queue runs
short of moves all the same (`depth`) the plan says what the controller makes of that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handout.plotting import pen_lift
from handout.plotting.dialects import MoveBlock, dialect
from handout.plotting.planning import lookahead, segments
from handout.plotting.planning.lookahead import Motion
from handout.plotting.planning.plan import DEVIATION, Plan, PlanRequest, find_shortest_segment, lay_lines, set_pace
from handout.plotting.planning.segments import Trajectory
from handout.plotting.planning.toolpath import (
    Toolpath,
    lay_out,
    machine_of,
    pen_up_speeds,
    queue_filling_times,
    start_times,
)
from handout.profiles import Plotter
from handout.values import Array

_BURST = 8  # segments; half a queue
_SLOWED = 0.8  # a corner that allows less than this share of the wanted speed² is taken in shorter segments
_CHANGED = 1e-4  # s; a queue that runs shorter than it was taken for matters from here
_BUSY = 0.8  # share of what the controller can read that is asked of it
_LINE = 22.0  # bytes of a line at most


def plan(request: PlanRequest) -> Plan:
    """A plan of moves with feeds; see `planner.plan`."""
    profile, asked = request.profile, set_pace(request)
    cuts = cut_for_corners(asked.path, profile)
    clock = np.interp(cuts.t, asked.path.t, asked.drawn) * request.factor  # of the drawing, which has the pressure
    heights = pen_lift.heights_along(request.drawing, clock, profile.pen)
    toolpath = lay_out(cuts, asked.dots, profile, request.hooked, heights)
    feed, motion = fit_feeds(toolpath, profile)
    starts = start_times(toolpath, motion, profile)
    target = toolpath.drawn_times(cuts, np.interp(cuts.t, asked.path.t, asked.target))
    xyz, feeds_ = toolpath.points[1:].tolist(), feed.tolist()
    height = (toolpath.draws & toolpath.follows_pressure).tolist()
    blocks = toolpath.blocks(
        lambda row: MoveBlock(xyz[row][0], xyz[row][1], feeds_[row], xyz[row][2] if height[row] else None)
    )
    return Plan.from_request(request, toolpath, motion, starts, blocks, target)


def cut_for_corners(path: Trajectory, profile: Plotter) -> Trajectory:
    """Cut the path into segments; shorter ones where corners of the usual length would have to be taken too slowly."""
    least, most = find_shortest_segment(profile), capacity(profile)
    cuts = segments.cut_path(path, min(profile.segment_rate, most), least, DEVIATION)
    straight, within = lay_lines(cuts, profile)
    if len(within) > 1:
        took = np.where(within, np.diff(cuts.t), np.inf)
        wanted = np.append(0.0, np.minimum(straight.length[1:] / took[1:], straight.length[:-1] / took[:-1])) ** 2
        could = _SLOWED * np.minimum(wanted, profile.limits.acceleration * straight.radius)
        slowed = straight.corner < could
        halve = within & (slowed | np.append(slowed[1:], False))
        middle = 0.5 * (cuts.t[:-1] + cuts.t[1:])
        off = path.places_at(middle)  # a pen that rested may not have left an end by then
        room = np.minimum(np.hypot(*(off - cuts.xy[:-1]).T), np.hypot(*(off - cuts.xy[1:]).T))
        halve &= (room >= least) & (took > 2.0 / most)
        t = np.sort(np.append(cuts.t, middle[halve]))
        cuts = Trajectory(t, path.places_at(t), path.stroke_at(t))
    return Trajectory(cuts.t, np.round(cuts.xy, 3), cuts.stroke)


def fit_feeds(toolpath: Toolpath, profile: Plotter) -> tuple[Array, Motion]:
    """The feed of every move, mm/min, as written, fitted to the planner; and the motion that this makes."""
    limits, queue = profile.limits, profile.port.queue
    blocks = lookahead.blocks(toolpath.points, toolpath.stands, machine_of(profile))
    pen_up = pen_up_speeds(toolpath, profile)
    most = lookahead.greatest(blocks, limits.acceleration, float(limits.draw_speed))
    crowding = np.ones(len(toolpath.kind))
    if toolpath.draws.any():
        # segments are run more slowly where too many follow on each other and the queue would run empty; it makes up
        # for a few short ones: what counts is the mean over `_BURST` of them
        time = np.convolve(np.where(toolpath.draws, toolpath.requested_time, 1.0), np.ones(_BURST), "same")
        time = np.maximum(time[: len(toolpath.kind)], 1e-9)
        crowding = np.asarray(np.maximum(_BURST * (1.0 / capacity(profile)) / time, 1.0))
    wanted = toolpath.requested_time * crowding
    crowded = crowding > 1.0  # no time is to be made up where lines could not follow
    most[crowded] = np.minimum(most, blocks.length / np.maximum(wanted, 1e-9))[crowded]
    feed = lookahead.round_feed(lookahead.fit(blocks, wanted, pen_up, toolpath.draws, most, queue))
    motion = lookahead.run_planner(blocks, feed / 60.0, queue)
    visible = depth(toolpath, motion, profile)
    short = lookahead.run_planner(blocks, feed / 60.0, visible)
    return feed, short if abs(float((short.duration - motion.duration).sum())) > _CHANGED else motion


def capacity(profile: Plotter) -> float:
    """Lines a second that the connection carries and the controller reads, with something to spare."""
    return _BUSY / max(line_time(profile), 1e-4)


def line_time(profile: Plotter) -> float:
    """What a line takes to arrive and to be read, whichever is longer, s."""
    return max(float(profile.port.line_time), _LINE * 10 / profile.port.baud)


def depth(toolpath: Toolpath, motion: Motion, profile: Plotter) -> NDArray[np.intp]:
    """Moves in the machine's queue when each begins, that one included.  (n,) at least 1.

    A place in the queue counts as free when the move that held it begins; a GRBL frees it up to six moves earlier.
    """
    if len(toolpath.kind) == 0:
        return np.zeros(0, dtype=np.intp)
    queue, each = profile.port.queue, line_time(profile)
    number = np.arange(len(toolpath.kind))
    begins = start_times(toolpath, motion, profile)[:-1]
    first = _find_firsts(toolpath)
    room = np.where(number - queue >= first, begins[np.maximum(number - queue, 0)], -np.inf)
    room[toolpath.stands] = begins[toolpath.stands] - queue_filling_times(toolpath, profile)
    read = each * (number + 1) + np.maximum.accumulate(room - each * number)
    have = np.searchsorted(read, begins + 1e-9, side="right") - number
    return np.asarray(np.clip(have, 1, queue), dtype=np.intp)


def least_queue(plan: Plan) -> int | None:
    """The fewest moves a controller that plans will have in hand in the middle of a stroke; None for other machines."""
    if dialect(plan.profile.dialect).motion != "planned":
        return None
    return find_least_queue(plan.toolpath, depth(plan.toolpath, plan.motion, plan.profile), plan.profile.port.queue)


def find_least_queue(toolpath: Toolpath, have: NDArray[np.intp], queue: int) -> int | None:
    """The fewest moves in the queue in the middle of a stroke, where there were more to come; None if there is none."""
    first = _find_firsts(toolpath)
    ends = np.append(np.flatnonzero(toolpath.stands)[1:], len(toolpath.kind))
    after = ends[np.searchsorted(ends, np.arange(len(toolpath.kind)), side="right")]
    middle = toolpath.draws & (np.arange(len(toolpath.kind)) > first) & (np.arange(len(toolpath.kind)) + queue <= after)
    return int(have[middle].min()) if middle.any() else None


def _find_firsts(toolpath: Toolpath) -> NDArray[np.intp]:
    """Of every move, the first after the rest before it."""
    stand = np.flatnonzero(toolpath.stands)
    return np.repeat(stand, np.diff(np.append(stand, len(toolpath.kind))))
