"""Where a timed path is cut into straight segments: evenly in time, at every turning point, finer where it curves.

All strokes of a page are treated at once, on one clock: stroke follows stroke with a pause between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.values import Array

Index = NDArray[np.intp]
_PAUSE = 1.0  # s between strokes on the common clock; nothing is ever interpolated across it
_MERGED = 1e-9


@dataclass(frozen=True, eq=False)
class Track:
    """Timed strokes one after the other.

    t : (n,) float, s, increasing; xy : (n, 2) float, mm; stroke : (n,) index of the stroke of each sample.
    """

    t: Array
    xy: Array
    stroke: Index

    def at(self, t: Array) -> Array:
        """(m, 2) mm: where the pen should be at times t."""
        return np.stack([np.interp(t, self.t, self.xy[:, 0]), np.interp(t, self.t, self.xy[:, 1])], axis=1)


def track(times: list[Array], paths: list[Array]) -> Track:
    """Strokes, each with its own clock, on one clock."""
    clock, shifted = 0.0, []
    for t in times:
        shifted.append(t - t[0] + clock)
        clock += t[-1] - t[0] + _PAUSE
    stroke = np.repeat(np.arange(len(times)), [len(t) for t in times])
    return Track(np.concatenate(shifted), np.concatenate(paths), stroke)


def cut(path: Track, rate: float, shortest: float, deviation: float) -> Track:
    """Cut a path into segments.

    Parameters
    ----------
    rate : segments a second of pen time.
    shortest : mm; segments shorter than this are merged with their neighbours.
    deviation : mm the segments may depart from the path.

    Returns
    -------
    Track
        The knots.  Every stroke keeps its first and last sample (one knot if it never leaves `shortest`).
    """
    turning = _turning_points(path, 1.0 / rate)
    knots = _evenly(path, turning, rate)
    knots = _finer_where_curved(path, knots, deviation)
    return _merge(path, knots, turning, shortest)


def _turning_points(path: Track, interval: float) -> Array:
    """Times of the ends of strokes and of the least speeds in between, at least 2 intervals apart.

    A hand slows down where its path turns; a segment that began before a turn and ended behind it would cut it off.
    """
    t, stroke = path.t, path.stroke
    first = np.flatnonzero(np.diff(stroke, prepend=-1))
    last = np.append(first[1:], len(t)) - 1
    early, late = (np.clip(t + sign * interval / 2, t[first][stroke], t[last][stroke]) for sign in (-1, 1))
    moved = path.at(late) - path.at(early)
    speed = np.sqrt((moved * moved).sum(axis=1)) / np.maximum(late - early, _MERGED)
    least = np.flatnonzero((speed[1:-1] < speed[:-2]) & (speed[1:-1] <= speed[2:])) + 1
    ends = np.union1d(t[first], t[last])
    chosen: list[float] = []
    for time in t[least[np.argsort(speed[least], kind="stable")]]:
        chosen.append(float(time))
    return _spaced(ends, np.array(chosen), 2 * interval)


def _spaced(fixed: Array, wanted: Array, gap: float) -> Array:
    """The fixed times and, in order of preference, those wanted ones that keep their distance from all others."""
    taken = {int(time // gap) for time in fixed}
    cells: dict[int, list[float]] = {}
    for time in fixed:
        cells.setdefault(int(time // gap), []).append(float(time))
    for time in wanted:
        cell = int(time // gap)
        near = [other for c in (cell - 1, cell, cell + 1) for other in cells.get(c, ())]
        if all(abs(other - time) >= gap for other in near):
            cells.setdefault(cell, []).append(float(time))
            taken.add(cell)
    return np.sort(np.array([time for cell in cells.values() for time in cell]))
