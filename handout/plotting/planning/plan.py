"""What is asked of planning, a `PlanRequest`, and what comes of it: a `Plan`, motion within a machine's limits.

The times that are asked for are those of the drawing at a speed, or the least there can be (`AskedPace`).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from handout.plotting.bed import BedPlacement
from handout.plotting.dialects import Block, PenBlock, dialect
from handout.plotting.planning import lookahead
from handout.plotting.planning.hooking import NONE, Hooking
from handout.plotting.planning.lookahead import Blocks, Flags, Motion
from handout.plotting.planning.segments import Trajectory, cut_path
from handout.plotting.planning.toolpath import TRAVEL, HookSpan, Toolpath, machine_of
from handout.profiles import Plotter
from handout.summary import one_line
from handout.values import Array, Drawing, Stroke, readonly

Speed = float | Literal["fast"]
Order = Literal["writing", "travel"]
_EVERY = 0.0025  # s between the samples of a predicted stroke


@dataclass(frozen=True, eq=False)
class PlanRequest:
    """A drawing that is to be planned.

    drawing : its strokes in the order in which they are drawn; profile : the machine; speed, order : as asked for.
    placement : of the page on the bed; path : the strokes in machine coordinates, on the clock of the drawing.
    whole : whether the page begins with the drawing, and ends with it; hooked : what is done besides.
    """

    drawing: Drawing
    profile: Plotter
    speed: Speed
    order: Order
    placement: BedPlacement
    path: Trajectory
    whole: tuple[bool, bool] = (True, True)
    hooked: Hooking = NONE

    @property
    def factor(self) -> float:
        """By how much faster than the drawing; 1 where that is for the machine to say."""
        return 1.0 if self.speed == "fast" else float(self.speed)


@dataclass(frozen=True, eq=False)
class Plan:
    """What a machine will do to draw a drawing; previews, time estimates and drivers read the same object.

    drawing, profile, speed, order, placement, whole : as in the `PlanRequest`.
    blocks : what the machine is told; begins : (blocks,) float, s, when it begins each.
    starts : (n + 1,) float, s, when each move of the toolpath begins, and when all is done.
    target_time : (n,) float, s, what drawn moves take in the drawing (at the best, if it has no time); else 0.
    """

    drawing: Drawing
    profile: Plotter
    speed: Speed
    order: Order
    placement: BedPlacement
    toolpath: Toolpath
    motion: Motion
    starts: Array
    blocks: tuple[Block, ...]
    begins: Array
    target_time: Array
    whole: tuple[bool, bool]

    __repr__ = one_line

    @classmethod
    def from_request(
        cls,
        request: PlanRequest,
        toolpath: Toolpath,
        motion: Motion,
        starts: Array,
        blocks: tuple[Block, ...],
        target_time: Array,
    ) -> Plan:
        """The plan of a request; the other fields as above."""
        asked = request.drawing, request.profile, request.speed, request.order, request.placement
        begins = toolpath.block_starts(starts, motion)
        return cls(*asked, toolpath, motion, starts, blocks, begins, readonly(target_time, None), request.whole)

    @property
    def duration(self) -> float:
        """Announced time, s: from the first move to standing at zero again, all travel and lifting included."""
        return float(self.starts[-1])

    @property
    def dips(self) -> int:
        """How often the pen is dipped."""
        return sum(span.name == "dip" for span in self.toolpath.hooks)

    @cached_property
    def hook_time(self) -> float:
        """Of the announced time what hooks take, s, with the ways to and from them."""
        begins = np.append(self.begins, self.duration)
        return float(sum(begins[span.stop] - begins[span.first] for span in self.toolpath.hooks))

    def hook_ways(self) -> list[dict[str, Any]]:
        """What is done besides drawing, for previews: name, the stroke that comes after it, places on the page, mm.

        way : where the pen goes; down : where it is lowered.
        """
        ways, path = [], self.toolpath
        xy = np.round(self._on_page(path.points), 3)
        for name, first, stop in path.hooks:
            told = path.instructions[first:stop]
            rows = [row for block, row in told if block is None]
            down = [xy[row].tolist() for block, row in told if isinstance(block, PenBlock) and block.down]
            way = xy[rows[0] : rows[-1] + 2] if rows else xy[told[0][1] : told[0][1] + 1]
            stroke = int(np.searchsorted(path.first, told[-1][1]))
            ways.append({"name": name, "stroke": stroke, "way": _turns(way).tolist(), "down": down})
        return ways

    @property
    def opening_count(self) -> int:
        """How many blocks are done when what comes before the page is done."""
        return next((span.stop for span in self.toolpath.hooks if span.name == "before_page"), 0)

    def after_page(self) -> Plan | None:
        """What is done after the page alone, begun at zero, with the drawing of its last stroke; None: nothing is."""
        span = self.toolpath.hooks[-1] if self.toolpath.hooks else None
        if span is None or span.name != "after_page":
            return None
        path, told = self.toolpath, self.toolpath.instructions[span.first :]
        row = min(told[0][1], len(path.kind) - 1)
        moves = slice(row, None)
        toolpath = dataclasses.replace(
            path,
            points=path.points[moves],
            kind=path.kind[moves],
            stroke=path.stroke[moves],
            requested_time=path.requested_time[moves],
            stands=path.stands[moves],
            pause=path.pause[moves],
            first=path.first[:0],
            instructions=tuple((block, at - row) for block, at in told),
            hooks=(HookSpan("after_page", 0, len(told)),),
        )
        motion = Motion(*(getattr(self.motion, field.name)[moves] for field in dataclasses.fields(Motion)))
        blocks, starts = self.blocks[span.first :], self.starts[moves] - self.starts[row]
        begins = toolpath.block_starts(starts, motion)
        drawing = dataclasses.replace(self.drawing, strokes=self.drawing.strokes[-1:])
        parts = {"toolpath": toolpath, "motion": motion, "starts": starts, "blocks": blocks, "begins": begins}
        return dataclasses.replace(self, drawing=drawing, target_time=self.target_time[moves], **parts)

    @cached_property
    def stretched(self) -> float:
        """Time the strokes take over the time they were meant to take."""
        whole = float(self.target_time.sum())
        return float(self.motion.duration[self.toolpath.draws].sum()) / whole if whole > 0 else 1.0

    @cached_property
    def pen_down(self) -> float:
        """Length drawn, mm."""
        return float(self._lengths[self.toolpath.draws].sum())

    @cached_property
    def pen_up(self) -> float:
        """Length travelled with the pen lifted, from zero and back to zero, mm."""
        return float(self._lengths[self.toolpath.kind == TRAVEL].sum())

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Of what is drawn: (x least, y least, x greatest, y greatest), mm on the page."""
        bounds = self.drawing.bounds
        assert bounds is not None  # nothing is planned for an empty drawing
        return bounds

    @cached_property
    def _lengths(self) -> Array:
        return np.asarray(np.linalg.norm(np.diff(self.toolpath.points, axis=0), axis=1))

    def pen_at(self, t: float) -> tuple[float, float, bool]:
        """Where the pen is `t` seconds after the start: x, y in mm on the page, and whether it draws."""
        row = int(np.searchsorted(self.starts, t, side="right")) - 1
        moves = len(self.toolpath.kind)
        if 0 <= row < moves and t - self.starts[row] < self.motion.duration[row]:
            travelled = self.motion.distance_travelled(np.array([row]), np.array([t - self.starts[row]]))
            share = float(travelled[0]) / max(float(self.motion.length[row]), 1e-9)
            a, b = self.toolpath.points[row], self.toolpath.points[row + 1]
            x, y = self._on_page((a + share * (b - a))[None])[0].tolist()
            return x, y, bool(self.toolpath.draws[row])
        x, y = self._on_page(self.toolpath.points[min(row + 1, moves)][None])[0].tolist()
        return x, y, False

    def _on_page(self, points: Array) -> Array:
        return self.placement.to_page(points[:, :2])

    def predicted_drawing(self) -> Drawing:
        """The strokes as the machine will draw them, on its clock, with the speeds within its moves."""
        toolpath = self.toolpath
        rows = np.flatnonzero(toolpath.draws & (self.motion.duration > 0))
        many = np.maximum(np.ceil(self.motion.duration[rows] / _EVERY), 1).astype(int)
        row = np.repeat(rows, many)
        last = np.cumsum(many)
        piece = np.arange(len(row)) - np.repeat(last - many, many) + 1
        t = self.motion.duration[row] * piece / np.repeat(many, many)
        share = self.motion.distance_travelled(row, t) / np.maximum(self.motion.length[row], 1e-9)
        share[last - 1] = 1.0
        xy = self._on_page(toolpath.points[row] + share[:, None] * (toolpath.points[row + 1] - toolpath.points[row]))
        begin = self._on_page(toolpath.points[toolpath.first])
        ends = np.cumsum(np.bincount(toolpath.stroke[row], minlength=len(toolpath.first)))
        strokes = []
        for index, stroke in enumerate(self.drawing.strokes):
            samples = slice(ends[index - 1] if index else 0, ends[index])
            clock = np.append(self.starts[toolpath.first[index]], self.starts[row[samples]] + t[samples])
            strokes.append(Stroke(clock, np.concatenate([begin[index : index + 1], xy[samples]]), word=stroke.word))
        return Drawing(tuple(strokes), self.drawing.page, self.drawing.about)

    def intended_drawing(self) -> Drawing:
        """The strokes as they were meant to be drawn: at the speed asked for, or the best for one without time."""
        if not self.drawing.timed:
            toolpath = self.toolpath
            count = np.bincount(toolpath.stroke[toolpath.draws], minlength=len(toolpath.first))
            drawn = []
            for row, many, stroke in zip(toolpath.first, count, self.drawing.strokes, strict=True):
                t = np.append(0.0, np.cumsum(self.target_time[row : row + many]))
                drawn.append(Stroke(t, self._on_page(toolpath.points[row : row + many + 1]), word=stroke.word))
            return Drawing(tuple(drawn), self.drawing.page, self.drawing.about, timed=False)
        factor = 1.0 if self.speed == "fast" else float(self.speed)
        strokes = (dataclasses.replace(stroke, t=stroke.t / factor) for stroke in self.drawing.strokes)
        return dataclasses.replace(self.drawing, strokes=tuple(strokes))


def _turns(way: Array) -> Array:
    """(m, 2) the places of a way at which it turns, and both its ends."""
    if len(way) < 3:
        return way
    step = np.diff(way, axis=0)
    across = np.abs(step[:-1, 0] * step[1:, 1] - step[:-1, 1] * step[1:, 0])
    long = np.hypot(*step[:-1].T) * np.hypot(*step[1:].T)
    back = (step[:-1] * step[1:]).sum(axis=1) < 0
    return np.asarray(way[np.concatenate([[True], (across > 1e-3 * long + 1e-9) | back, [True]])])


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


def set_pace(request: PlanRequest) -> AskedPace:
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
    dense = cut_path(distance, 1.0 / _DENSE, find_shortest_segment(profile), DEVIATION / 2)
    blocks, within = lay_lines(dense, profile)
    fastest = float(profile.limits.draw_speed)
    most = np.minimum(lookahead.greatest(blocks, profile.limits.acceleration, fastest), blocks.rate)
    limit = np.zeros(len(most) + 1)
    limit[1:-1] = np.where(within[1:] & within[:-1], np.minimum(most[1:], most[:-1]) ** 2, 0.0)
    sharp = np.isinf(blocks.radius[1:])  # no curve turns there
    limit[1:-1][sharp] = np.minimum(limit[1:-1], blocks.corner[1:])[sharp]
    speed = np.sqrt(lookahead.reachable(limit, 2.0 * blocks.acceleration * blocks.length))
    took = lookahead.trapezoid_time(blocks.length, blocks.acceleration, speed[:-1], speed[1:], most)
    t = np.concatenate([[0.0], np.cumsum(np.where(within, np.maximum(took, 1e-6), 1.0))])
    return Trajectory(t, dense.xy, dense.stroke), np.interp(dense.t, distance.t, path.t)


def find_shortest_segment(profile: Plotter) -> float:
    """How long a segment is at least, mm."""
    return float(dialect(profile.dialect).shortest_segment / profile.limits.steps_per_mm)


def lay_lines(cuts: Trajectory, profile: Plotter) -> tuple[Blocks, Flags]:
    """The lines between all cuts, and which of them are drawn (the others lead from stroke to stroke)."""
    within = cuts.stroke[1:] == cuts.stroke[:-1]
    stands = ~(within & np.append(False, within[:-1]))
    points = np.column_stack([cuts.xy, np.zeros(len(cuts.t))])
    return lookahead.blocks(points, stands, machine_of(profile)), within
