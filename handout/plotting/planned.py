"""A drawing turned into motion within a machine's limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from handout.plotting.bed import Placement
from handout.plotting.blocks import Block
from handout.plotting.course import TRAVEL, Course
from handout.plotting.lookahead import Motion
from handout.profiles import Plotter
from handout.values import Array, Drawing, Stroke

Speed = float | Literal["fast"]
Order = Literal["writing", "travel"]


@dataclass(frozen=True, eq=False)
class Plan:
    """What a machine will do to draw a drawing; previews, time estimates and drivers read the same object.

    drawing : as it will be drawn, strokes in their order; profile : the machine; speed, order : as asked for.
    blocks : what the machine is told; begins : (blocks,) float, s, when it begins each.
    starts : (n + 1,) float, s, when each move of the course begins, and when all is done.
    stretched : time the strokes take over the time they were meant to take.
    correlation, rms : of the speeds along the strokes with the drawing's; rms as a share of its greatest speed.
    meant : (n,) float: what the drawn moves of a stroke take in the drawing, in any unit; how far it has come tells the
        place in the drawing.
    """

    drawing: Drawing
    profile: Plotter
    speed: Speed
    order: Order
    placement: Placement
    course: Course
    motion: Motion
    starts: Array
    blocks: tuple[Block, ...]
    begins: Array
    stretched: float
    correlation: float
    rms: float
    meant: Array

    @property
    def duration(self) -> float:
        """Announced time, s: from the first move to standing at zero again, all travel and lifting included."""
        return float(self.starts[-1])

    @cached_property
    def pen_down(self) -> float:
        """Length drawn, mm."""
        return float(self._lengths[self.course.draws].sum())

    @cached_property
    def pen_up(self) -> float:
        """Length travelled with the pen lifted, from zero and back to zero, mm."""
        return float(self._lengths[self.course.kind == TRAVEL].sum())

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Of what is drawn: (x least, y least, x greatest, y greatest), mm on the page."""
        bounds = self.drawing.bounds
        assert bounds is not None  # nothing is planned for an empty drawing
        return bounds

    @cached_property
    def _lengths(self) -> Array:
        return np.asarray(np.linalg.norm(np.diff(self.course.points, axis=0), axis=1))

    def at(self, t: float) -> tuple[float, float, bool]:
        """Where the pen is `t` seconds after the start: x, y in mm on the page, and whether it draws."""
        row = int(np.searchsorted(self.starts, t, side="right")) - 1
        moves = len(self.course.kind)
        if 0 <= row < moves and t - self.starts[row] < self.motion.duration[row]:
            share = self.motion.travelled(row, t - float(self.starts[row])) / max(float(self.motion.length[row]), 1e-9)
            a, b = self.course.points[row], self.course.points[row + 1]
            return (*self._on_page(a + share * (b - a)), bool(self.course.draws[row]))
        return (*self._on_page(self.course.points[min(row + 1, moves)]), False)

    def _on_page(self, point: Array) -> tuple[float, float]:
        x, y = self.placement.to_page(point[None, :2])[0]
        return float(x), float(y)

    def predicted(self) -> Drawing:
        """The strokes as the machine will draw them, on its clock: the ends of its moves, with their times."""
        draws, end = self.course.draws, self.starts[:-1] + self.motion.duration
        xy = self.placement.to_page(self.course.points[:, :2])
        strokes = []
        for index, (row, stroke) in enumerate(zip(self.course.first, self.drawing.strokes, strict=True)):
            last = row + int(np.searchsorted(~(draws[row:] & (self.course.stroke[row:] == index)), True))
            strokes.append(Stroke(np.append(self.starts[row], end[row:last]), xy[row : last + 1], word=stroke.word))
        return Drawing(tuple(strokes), self.drawing.page, self.drawing.about)
