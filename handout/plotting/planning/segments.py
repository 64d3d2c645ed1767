"""Where a timed path is cut into straight segments: evenly in time, at every turning point, finer where it curves.

All strokes of a page are treated at once, on one clock: stroke follows stroke with a pause between.
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.values import Array

Index = NDArray[np.intp]
_PAUSE = 1.0  # s between strokes on the common clock; nothing is ever interpolated across it
_TINY = 1e-12
_PASSES = 12  # each pass at least halves what is left of a curve


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Timed strokes one after the other.

    t : (n,) float, s, increasing; xy : (n, 2) float, mm; stroke : (n,) index of the stroke of each sample.
    """

    t: Array
    xy: Array
    stroke: Index

    def places_at(self, t: Array) -> Array:
        """(m, 2) mm: where the pen should be at times t."""
        return np.stack([np.interp(t, self.t, self.xy[:, 0]), np.interp(t, self.t, self.xy[:, 1])], axis=1)

    def stroke_at(self, t: Array) -> Index:
        """(m,) stroke under way at times t."""
        return self.stroke[np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 1)]


def on_one_clock(times: list[Array], paths: list[Array]) -> Trajectory:
    """Strokes, each with its own clock, on one clock."""
    clock, shifted = 0.0, []
    for t in times:
        shifted.append(t - t[0] + clock)
        clock += t[-1] - t[0] + _PAUSE
    stroke = np.repeat(np.arange(len(times)), [len(t) for t in times])
    return Trajectory(np.concatenate(shifted), np.concatenate(paths), stroke)


def cut_path(path: Trajectory, rate: float, shortest: float, deviation: float) -> Trajectory:
    """Cut a path into segments.

    rate : segments a second of pen time.
    shortest : mm; segments shorter than this are merged with their neighbours.
    deviation : mm the segments may depart from the path.

    Returns the breakpoints.  Every stroke keeps its first and last sample; the last is left out where the stroke ends
    within `shortest` of its beginning and no breakpoint fits in between: one that stays within `shortest` has one.
    Segments and path are within `deviation` + `shortest` of each other.
    """
    turning = _turning_points(path, 1.0 / rate)
    # between those of one stroke as many more, evenly in time, as the rate asks for
    gaps, stroke = np.diff(turning), path.stroke_at(turning)
    pieces = np.where(stroke[1:] == stroke[:-1], np.ceil(gaps * rate - 1e-6), 1).astype(int)
    pieces = np.maximum(pieces, 1)
    start = np.repeat(np.arange(len(gaps)), pieces)
    count = np.arange(len(start)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    breakpoints = np.append(turning[start] + gaps[start] * count / pieces[start], turning[-1])
    breakpoints = _merge(path, _follow(path, breakpoints, deviation), turning, shortest)
    return Trajectory(breakpoints, path.places_at(breakpoints), path.stroke_at(breakpoints))


def _turning_points(path: Trajectory, interval: float) -> Array:
    """Times of the ends of strokes and of the least speeds in between, at least 2 intervals apart.

    A hand slows down where its path turns; a segment that began before a turn and ended behind it would cut it off.
    """
    t, stroke = path.t, path.stroke
    first, last = stroke_ends(stroke)
    early, late = (np.clip(t + half, t[first][stroke], t[last][stroke]) for half in (-interval / 2, interval / 2))
    moved = path.places_at(late) - path.places_at(early)
    speed = np.sqrt((moved * moved).sum(axis=1)) / np.maximum(late - early, _TINY)
    least = np.flatnonzero((speed[1:-1] < speed[:-2]) & (speed[1:-1] <= speed[2:])) + 1
    chosen = np.union1d(t[first], t[last]).tolist()
    for time in t[least[np.argsort(speed[least], kind="stable")]].tolist():  # the slowest first
        place = bisect.bisect(chosen, time)
        if time - chosen[place - 1] >= 2 * interval and (place == len(chosen) or chosen[place] - time >= 2 * interval):
            chosen.insert(place, time)
    return np.array(chosen)


def stroke_ends(stroke: Index) -> tuple[Index, Index]:
    """Index of the first and of the last sample of every stroke."""
    first = np.flatnonzero(np.diff(stroke, prepend=-1))
    return first, np.append(first[1:], len(stroke)) - 1


def _follow(path: Trajectory, breakpoints: Array, deviation: float) -> Array:
    """Add the sample farthest from its chord to every segment that departs from the path, until none does."""
    for _ in range(_PASSES):
        ends = path.places_at(breakpoints)
        piece = np.clip(np.searchsorted(breakpoints, path.t, side="right") - 1, 0, len(breakpoints) - 2)
        away = distance_to_lines(path.xy, ends[piece], ends[piece + 1])
        away[path.stroke_at(breakpoints[piece]) != path.stroke_at(breakpoints[piece + 1])] = 0.0
        order = np.lexsort((away, piece))
        farthest = order[np.flatnonzero(np.diff(piece[order], append=-1))]
        more = farthest[away[farthest] > deviation]
        if len(more) == 0:
            break
        breakpoints = np.union1d(breakpoints, path.t[more])
    return breakpoints


def distance_to_lines(place: Array, begin: Array, end: Array) -> Array:
    """(n,) distance of places (k,) or (n, k) from straight lines between points (n, k), in their unit."""
    way, to = end - begin, place - begin
    share = np.clip((to * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), _TINY), 0.0, 1.0)
    return np.asarray(np.linalg.norm(to - share[:, None] * way, axis=1))


def _merge(path: Trajectory, breakpoints: Array, wanted: Array, shortest: float) -> Array:
    """Leave out breakpoints nearer than `shortest` to the one before; turning points stay rather than others.

    What is left out is always nearer than that to a breakpoint that stays.
    """
    stroke, xy = path.stroke_at(breakpoints), path.places_at(breakpoints)
    knots = _fill_knots(xy, stroke, _sift_knots(xy, stroke, np.isin(breakpoints, wanted), shortest), shortest)
    length = np.hypot(*np.diff(xy[knots], axis=0).T)
    # no breakpoint fits between the ends of a stroke that comes back: it goes as far as it went
    back = np.append(False, (stroke[knots][1:] == stroke[knots][:-1]) & (length < shortest))
    return breakpoints[_fill_knots(xy, stroke, knots[~back], shortest)]


def _sift_knots(xy: Array, stroke: Index, wanted: NDArray[np.bool_], shortest: float) -> Index:
    """Knots one after the other, each far enough from the one before, and both ends of every stroke."""
    places, firm = xy.tolist(), wanted.tolist()
    first, last = (set(ends.tolist()) for ends in stroke_ends(stroke))
    knots: list[int] = []
    for index, (x, y) in enumerate(places):
        stays = firm[index] or index in last
        while index not in first and math.hypot(x - places[knots[-1]][0], y - places[knots[-1]][1]) < shortest:
            before = knots[-1]
            if before in first or not stays or (firm[before] and index not in last):
                knots += [index] * (index in last)
                break
            knots.pop()
        else:
            knots.append(index)
    return np.array(knots)


def _fill_knots(xy: Array, stroke: Index, knots: Index, shortest: float) -> Index:
    """The kept ones and, of those left out, the farthest from its neighbours, until none is `shortest` from both."""
    while True:
        place = np.searchsorted(knots, np.arange(len(xy)), side="right") - 1
        before, after = knots[place], knots[np.minimum(place + 1, len(knots) - 1)]
        after = np.where(stroke[after] == stroke, after, before)
        room = np.minimum(np.hypot(*(xy - xy[before]).T), np.hypot(*(xy - xy[after]).T))
        order = np.lexsort((room, place))
        farthest = order[np.flatnonzero(np.diff(place[order], append=-1))]
        more = farthest[room[farthest] >= shortest]
        if len(more) == 0:
            return knots
        knots = np.union1d(knots, more)
