"""Places on a drawing: how far it is drawn, what is left of it, and where on it a machine stands.

`Milestones` turns blocks of a plan that are done into places; `drawn` and `remaining` cut a drawing in two at one;
`found` turns a machine's own word for its position into one.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handout.plotting.dialects import PenBlock
from handout.plotting.planning.hooking import piece
from handout.plotting.planning.plan import Plan
from handout.values import Array, Drawing


class DrawnPlace(NamedTuple):
    """How far a drawing is drawn: all strokes before `stroke`, and this one up to `time` (s, drawing's clock).

    A time before the stroke's first means that nothing of it is drawn; a stroke after the last, that all are.
    """

    stroke: int
    time: float = -np.inf


START = DrawnPlace(0)


class Milestones:
    """Converts the number of blocks done of a plan into a place on the drawing.

    stroke : (blocks + 1,) int; time : (blocks + 1,) float, s: the `DrawnPlace` for every number of blocks done.
    ink : (blocks + 1,) float, mm: the length that is drawn by then.
    """

    stroke: NDArray[np.intp]
    time: Array
    ink: Array

    def __init__(self, plan: Plan) -> None:
        instructions, toolpath = plan.toolpath.instructions, plan.toolpath
        at = np.arange(len(instructions))
        rows = np.array([row if block is None else -1 for block, row in instructions], dtype=np.intp)
        drawn = (rows >= 0) & toolpath.draws[rows]
        pens = [
            (at, block.down) for at, (block, _) in enumerate(instructions) if isinstance(block, PenBlock) and block.inks
        ]
        # a stroke is done with what comes last before the pen is lifted from it: a move, or the rest of a dot
        complete = np.array([lift - 1 for (_, down), (lift, _) in itertools.pairwise(pens) if down], dtype=int)
        stroke = np.searchsorted(complete, at, side="right")
        last = np.maximum.accumulate(np.where(drawn, at, -1))
        under_way = (last >= 0) & (toolpath.stroke[rows[last]] == stroke)
        time = np.where(under_way, _end_times(plan)[rows[last]], -np.inf)
        length = np.where(drawn, np.hypot(*np.diff(toolpath.points[:, :2], axis=0).T)[rows], 0.0)
        self.stroke, self.time = np.append(0, stroke), np.append(-np.inf, time)
        self.ink = np.append(0.0, np.cumsum(length))

    def place(self, done: int) -> DrawnPlace:
        """The place reached after `done` blocks."""
        return DrawnPlace(int(self.stroke[done]), float(self.time[done]))


def place(plan: Plan, done: int) -> DrawnPlace:
    """The place reached after `done` blocks of a plan; for many numbers use `Milestones`."""
    return Milestones(plan).place(done)


def _end_times(plan: Plan) -> Array:
    """(n,) float, s: for every drawn move of the toolpath, the time in the drawing at which it ends."""
    draws, stroke = plan.toolpath.draws, plan.toolpath.stroke
    planned = np.where(draws, np.maximum(plan.target_time, 0.0), 0.0)
    so_far = np.cumsum(planned)
    many = len(plan.drawing.strokes)
    whole = np.bincount(stroke[draws], planned[draws], many)
    before = np.append(0.0, np.cumsum(whole)[:-1])
    begins, ends = (np.array([line.t[at] for line in plan.drawing.strokes]) for at in (0, -1))
    share = np.clip((so_far - before[stroke]) / np.maximum(whole[stroke], 1e-12), 0.0, 1.0)
    return np.asarray(np.where(share > 1.0 - 1e-9, ends[stroke], begins[stroke] + share * (ends - begins)[stroke]))


def take_drawn(drawing: Drawing, place: DrawnPlace) -> Drawing:
    """The part of a drawing that lies before a place."""
    whole, time = drawing.strokes[: place.stroke], place.time
    for stroke in drawing.strokes[place.stroke : place.stroke + 1]:
        if time >= stroke.t[0] and (time > stroke.t[0] or len(stroke.t) == 1):
            whole = (*whole, stroke if time >= stroke.t[-1] else piece(stroke, float(stroke.t[0]), time))
    return dataclasses.replace(drawing, strokes=whole)


def remaining(drawing: Drawing, place: DrawnPlace) -> Drawing:
    """The rest of a drawing after a place, where the broken stroke begins; times, words and layers stay."""
    if place.stroke >= len(drawing.strokes):
        return dataclasses.replace(drawing, strokes=())
    stroke, time, whole = drawing.strokes[place.stroke], place.time, drawing.strokes[place.stroke + 1 :]
    if (time <= stroke.t[0] and len(stroke.t) > 1) or time < stroke.t[0]:
        whole = (stroke, *whole)
    elif time < stroke.t[-1]:
        whole = (piece(stroke, time, float(stroke.t[-1])), *whole)
    return dataclasses.replace(drawing, strokes=whole)


def onward(before: DrawnPlace, left: Drawing, whole: Drawing, after: DrawnPlace) -> DrawnPlace:
    """A place on the rest of a drawing, as a place on the whole drawing."""
    return max(before, DrawnPlace(after.stroke + len(whole.strokes) - len(left.strokes), after.time))


# mm that a machine may stand beside what it was told to draw: segments, steps, a bed that is not quite 1:1
_NEAR = 0.15
_CLEARLY = 0.03  # mm by which it must be nearer to a later place: what machines say is rounded by half of that


def find_place(
    drawing: Drawing,
    certain: DrawnPlace,
    at: Array,
    reach: float,
    zero: Array | None = None,
    detours: Sequence[Array] = (),
) -> DrawnPlace | None:
    """The place of the drawing at which a machine stopped if it stands at `at`; None if that is on no line.

    certain : what is certainly drawn.
    at : (2,) float, mm on the page.
    reach : mm of ink that it can have drawn behind that.
    zero : (2,) float, mm on the page, from where it may have come to begin behind that place, or where it may have been
        going from there.
    detours : (n, 2) float, mm on the page: where the lifted pen may go between two strokes.

    Where it passes several times and about as near, the first counts, since the others might leave a gap.
    """
    near: list[tuple[float, DrawnPlace]] = []  # how near a piece of the way comes, mm, and where
    for place, a, b, until in _ways(drawing, certain, reach, zero, detours):
        along = b - a
        length2 = float(along @ along)
        share = float(np.clip((at - a) @ along / length2, 0.0, 1.0)) if length2 > 0 else 0.0
        off = float(np.hypot(*(a + share * along - at)))
        if off < _NEAR:
            time = place.time + share * (until - place.time) if np.isfinite(until) else place.time
            near.append((off, DrawnPlace(place.stroke, time)))
    nearest = min((off for off, _ in near), default=0.0)
    return next((place for off, place in near if off <= nearest + _CLEARLY), None)


def _ways(
    drawing: Drawing, certain: DrawnPlace, reach: float, zero: Array | None, detours: Sequence[Array]
) -> Iterator[tuple[DrawnPlace, Array, Array, float]]:
    """The straight pieces the pen takes from a place on: the place before each, its ends, the time at its end.

    Travels have an infinite time: wherever the pen stands on one, the next stroke has not begun.
    """
    left = remaining(drawing, certain)
    skipped = len(drawing.strokes) - len(left.strokes)
    before: Array | None = None
    for start in _starts(drawing, certain, zero) if left.strokes else ():
        yield from _travels(certain, start, left.strokes[0].xy[0], detours)
    for number, stroke in enumerate(left.strokes, skipped):
        if before is not None:
            yield from _travels(DrawnPlace(number), before, stroke.xy[0], detours)
        for at in range(len(stroke.t) - 1):
            yield DrawnPlace(number, float(stroke.t[at])), stroke.xy[at], stroke.xy[at + 1], float(stroke.t[at + 1])
            reach -= float(np.hypot(*(stroke.xy[at + 1] - stroke.xy[at])))
            if reach < 0:
                break
        if reach < 0:
            break
        if len(stroke.t) == 1:
            yield DrawnPlace(number), stroke.xy[0], stroke.xy[0], np.inf
        before = stroke.xy[-1]
    if zero is not None and (done := take_drawn(drawing, certain).strokes):  # it may have been on its way back
        yield from _travels(certain, done[-1].xy[-1], zero, detours)


def _travels(
    place: DrawnPlace, begin: Array, end: Array, detours: Sequence[Array]
) -> Iterator[tuple[DrawnPlace, Array, Array, float]]:
    """The ways of the lifted pen from one place to another: straight, or by a detour."""
    for detour in (np.zeros((0, 2)), *detours):
        for a, b in itertools.pairwise([begin, *detour, end]):
            yield place, a, b, np.inf


def _starts(drawing: Drawing, certain: DrawnPlace, zero: Array | None) -> Iterator[Array]:
    """Where the lifted pen starts towards a place: at zero, or at the end of the stroke before."""
    if zero is not None:
        yield zero
    if 0 < certain.stroke < len(drawing.strokes) and certain.time <= drawing.strokes[certain.stroke].t[0]:
        yield drawing.strokes[certain.stroke - 1].xy[-1]
