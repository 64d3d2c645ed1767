"""When the pen should be where: the times of the drawing at the speed asked for, or the least there can be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.plotting.dialects import dialect
from handout.plotting.planning import feeds, lookahead
from handout.plotting.planning.lookahead import Blocks, Flags
from handout.plotting.planning.plan import PlanRequest
from handout.plotting.planning.segments import Trajectory, cut_path
from handout.plotting.planning.toolpath import machine_of
from handout.profiles import Plotter
from handout.values import Array

DEVIATION = 0.02  # mm between path and segments; corners cut off and whole steps add to it, 0.05 is allowed in all
_DENSE = 0.15  # mm between points at which a path is looked at to find how fast it can be drawn
_LONGEST_DOT = 1.0  # s the pen rests on the paper, however long it rested in the drawing


@dataclass(frozen=True, eq=False)
class AskedPace:
    """The times that are asked for.

    path : the strokes on the clock asked for; drawn : (n,) float, s, the times of its samples in the drawing.
    target : (n,) float, s, against which the plan is measured: those of the drawing, or the least there can be.
    dots : (strokes,) float, s, how long the pen rests in a stroke that goes nowhere.
    """

    path: Trajectory
    drawn: Array
    target: Array
    dots: Array


def pace(request: PlanRequest) -> AskedPace:
    """The times that a request asks for: those of the drawing, scaled, or the least for a fast plot."""
    path = request.path
    if request.speed == "fast":
        path, drawn = _fastest(path, request.profile)
        return AskedPace(path, drawn, drawn if request.drawing.timed else path.t, _dots(request))
    scaled = Trajectory(path.t / request.factor, path.xy, path.stroke)
    return AskedPace(scaled, scaled.t, scaled.t, _dots(request))


def _dots(request: PlanRequest) -> Array:
    strokes = request.drawing.strokes
    if not request.drawing.timed:
        return np.zeros(len(strokes))
    return np.array([min((stroke.t[-1] - stroke.t[0]) / request.factor, _LONGEST_DOT) for stroke in strokes])


def _fastest(path: Trajectory, profile: Plotter) -> tuple[Trajectory, Array]:
    """The path at the greatest speed the machine can keep, and the times of its samples in the drawing."""
    step = np.hypot(*np.diff(path.xy, axis=0, prepend=path.xy[:1]).T)
    step[np.diff(path.stroke, prepend=0) > 0] = 1.0
    distance = Trajectory(np.cumsum(np.maximum(step, 1e-6)), path.xy, path.stroke)
    dense = cut_path(distance, 1.0 / _DENSE, shortest(profile), DEVIATION / 2)
    blocks, within = lines(dense, profile)
    fastest = float(profile.limits.draw_speed)
    most = np.minimum(feeds.greatest(blocks, profile.limits.acceleration, fastest), blocks.rate)
    limit = np.zeros(len(most) + 1)
    limit[1:-1] = np.where(within[1:] & within[:-1], np.minimum(most[1:], most[:-1]) ** 2, 0.0)
    sharp = np.isinf(blocks.radius[1:])  # no curve turns there
    limit[1:-1][sharp] = np.minimum(limit[1:-1], blocks.corner[1:])[sharp]
    speed = np.sqrt(lookahead.reachable(limit, 2.0 * blocks.acceleration * blocks.length))
    took = lookahead.trapezoid_time(blocks.length, blocks.acceleration, speed[:-1], speed[1:], most)
    t = np.concatenate([[0.0], np.cumsum(np.where(within, np.maximum(took, 1e-6), 1.0))])
    return Trajectory(t, dense.xy, dense.stroke), np.interp(dense.t, distance.t, path.t)


def shortest(profile: Plotter) -> float:
    """How long a segment is at least, mm."""
    return float(dialect(profile.dialect).shortest_segment / profile.limits.steps_per_mm)


def lines(cuts: Trajectory, profile: Plotter) -> tuple[Blocks, Flags]:
    """The lines between all cuts, and which of them are drawn (the others lead from stroke to stroke)."""
    within = cuts.stroke[1:] == cuts.stroke[:-1]
    stands = ~(within & np.append(False, within[:-1]))
    points = np.column_stack([cuts.xy, np.zeros(len(cuts.t))])
    return lookahead.blocks(points, stands, machine_of(profile)), within
