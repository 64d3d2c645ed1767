"""How far a drawing has been drawn: from the blocks of its plan that are done to a place on one of its strokes."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handout.plotting.blocks import Pen
from handout.plotting.planned import Plan
from handout.values import Array


class Place(NamedTuple):
    """All strokes before `stroke` are drawn, and of this one what lies before `time` (s, on the drawing's clock).

    A time before the stroke's first means that nothing of it is drawn; a stroke after the last, that all are.
    """

    stroke: int
    time: float = -np.inf


START = Place(0)


class Milestones:
    """What has been drawn when so many blocks of a plan are done.

    Attributes
    ----------
    stroke : (blocks + 1,) int; time : (blocks + 1,) float, s: the `Place` for every number of blocks done.
    ink : (blocks + 1,) float, mm: the length that is drawn by then.
    """

    stroke: NDArray[np.intp]
    time: Array
    ink: Array

    def __init__(self, plan: Plan) -> None:
        told, course = plan.course.told, plan.course
        at = np.arange(len(told))
        rows = np.array([row if block is None else -1 for block, row in told], dtype=np.intp)
        drawn = (rows >= 0) & course.draws[rows]
        pens = [(index, block.down) for index, (block, _) in enumerate(told) if isinstance(block, Pen)]
        # a stroke is done with what comes last before the pen is lifted from it: a move, or the rest of a dot
        complete = np.array([lift - 1 for (_, down), (lift, _) in itertools.pairwise(pens) if down], dtype=int)
        stroke = np.searchsorted(complete, at, side="right")
        last = np.maximum.accumulate(np.where(drawn, at, -1))
        under_way = (last >= 0) & (course.stroke[rows[last]] == stroke)
        time = np.where(under_way, _reached(plan)[rows[last]], -np.inf)
        length = np.where(drawn, np.hypot(*np.diff(course.points[:, :2], axis=0).T)[rows], 0.0)
        self.stroke, self.time = np.append(0, stroke), np.append(-np.inf, time)
        self.ink = np.append(0.0, np.cumsum(length))

    def place(self, done: int) -> Place:
        """What is drawn when `done` blocks are done."""
        return Place(int(self.stroke[done]), float(self.time[done]))


def place(plan: Plan, done: int) -> Place:
    """What is drawn when `done` blocks of a plan are done; `Milestones` answers the same for many numbers at once."""
    return Milestones(plan).place(done)


def _reached(plan: Plan) -> Array:
    """(n,) float, s: for every drawn move of the course, the time in the drawing at which it ends."""
    draws, stroke = plan.course.draws, plan.course.stroke
    meant = np.where(draws, np.maximum(plan.meant, 0.0), 0.0)
    so_far = np.cumsum(meant)
    many = len(plan.drawing.strokes)
    whole = np.bincount(stroke[draws], meant[draws], many)
    before = np.append(0.0, np.cumsum(whole)[:-1])
    begins, ends = (np.array([one.t[at] for one in plan.drawing.strokes]) for at in (0, -1))
    share = np.clip((so_far - before[stroke]) / np.maximum(whole[stroke], 1e-12), 0.0, 1.0)
    return np.asarray(np.where(share > 1.0 - 1e-9, ends[stroke], begins[stroke] + share * (ends - begins)[stroke]))
