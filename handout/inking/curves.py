"""Timed strokes as smooth curves: cubic Béziers that pass through samples and keep their time.

Within a Bézier the parameter runs evenly with time, so that a curve cut at any parameter is the stroke cut at that
moment: a replay needs nothing but the times of the knots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Stroke

_Index = NDArray[np.intp]
_Points = NDArray[np.complex128]
_Number = TypeVar("_Number", np.float64, np.complex128)

TOLERANCE = 0.008  # mm; leaves room for rounding to 0.001 mm within the 0.01 mm that outputs promise
_LONG = 0.5  # mm between two samples
_PLANE = np.array([1, 1j])
_LONGEST = 32  # samples of the pieces that fitting begins with


@dataclass(frozen=True, eq=False)
class Curve:
    """One stroke as Béziers.

    t : (k,) float, s: times of the knots, all of them times of samples.
    points : (3 k − 2, 2) float, mm: knot, handle, handle, knot, …; a single point is a dot.
    """

    t: Array
    points: Array

    def places_at(self, t: Array) -> Array:
        """(n, 2) float, mm: where the pen is at the times `t` (n,), held at both ends."""
        if len(self.t) < 2:
            return np.repeat(self.points[:1], len(t), axis=0)
        i = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 2)
        u = np.clip((t - self.t[i]) / (self.t[i + 1] - self.t[i]), 0.0, 1.0)[:, None]
        a, b, c, d = (self.points[3 * i + j] for j in range(4))
        return np.asarray((1 - u) ** 3 * a + 3 * (1 - u) ** 2 * u * b + 3 * (1 - u) * u**2 * c + u**3 * d)


@dataclass(frozen=True, eq=False)
class Beziers:
    """All Béziers of several curves in one row; a dot counts as one without length.

    control : (4, m) complex, mm: control points x + i y.
    t : (2, m) float, s: begin and end.
    stroke : (m,) index of the curve each belongs to.
    """

    control: _Points
    t: Array
    stroke: _Index


def beziers(fitted: Sequence[Curve]) -> Beziers:
    """Every Bézier of the `fitted` curves, in order; there must be at least one curve."""
    whole = [c if len(c.t) > 1 else Curve(np.repeat(c.t, 2), np.repeat(c.points, 4, axis=0)) for c in fitted]
    control = np.concatenate([np.stack([c.points[j : 3 * len(c.t) - 5 + j : 3] for j in range(4)]) for c in whole], 1)
    t = np.concatenate([np.stack([c.t[:-1], c.t[1:]]) for c in whole], axis=1)
    owner = np.repeat(np.arange(len(whole)), [len(c.t) - 1 for c in whole])
    return Beziers(control @ _PLANE, t, owner)


def fit(strokes: Sequence[Stroke], tolerance: float = TOLERANCE) -> list[Curve]:
    """Fit every stroke with few Béziers that keep it within `tolerance` (mm).

    The reference is the C¹ curve with a knot at every sample.  Knots are left out as long as the curve without
    them, compared moment by moment at the samples and half way between them, stays within `tolerance` of it; at
    the knots that remain the curve meets the samples exactly.
    """
    if not strokes:
        return []
    row = _SampleRow(strokes)
    knots = _merge(row, _split_pieces(row, tolerance), tolerance)
    places = np.searchsorted(knots, row.ends)
    return [_curve(row, knots[a:b]) for a, b in zip([0, *places[:-1]], places, strict=True)]


class _SampleRow:
    """The samples of all strokes in one row, so that a page is fitted at once, and the reference through them.

    Points are complex numbers x + i y here: numpy is much faster along one row than along pairs.

    t, z, velocity : (n,) s, mm, mm/s.
    starts, ends : (strokes,) index of each stroke's first sample, and after its last.
    check_t, check : (2 n − 1,) the reference at the samples (even places) and half way between (odd places).
    """

    def __init__(self, strokes: Sequence[Stroke]) -> None:
        self.ends: _Index = np.cumsum([len(s.t) for s in strokes])
        self.starts: _Index = np.r_[0, self.ends[:-1]]
        self.t: Array = np.concatenate([s.t for s in strokes])
        self.z: _Points = np.concatenate([s.xy for s in strokes]) @ _PLANE
        self.velocity = self._velocities()
        self.check_t = _interleave(self.t, (self.t[:-1] + self.t[1:]) / 2)
        bow = (self.velocity[:-1] - self.velocity[1:]) * np.diff(self.t) / 8
        self.check = _interleave(self.z, (self.z[:-1] + self.z[1:]) / 2 + bow)

    def _velocities(self) -> _Points:
        """Of the parabola through three neighbours; at an end, of the parabola that ends there."""
        inside = np.ones(len(self.t) - 1, dtype=bool)
        inside[self.ends[:-1] - 1] = False  # the way from one stroke to the next is not part of either
        step = np.where(inside, np.diff(self.t), 1.0)
        slope = np.where(inside, np.diff(self.z) / step, 0.0)
        velocity = np.zeros_like(self.z)
        velocity[1:-1] = (slope[:-1] * step[1:] + slope[1:] * step[:-1]) / (step[:-1] + step[1:])
        # 0 where two long chords meet at a right angle or sharper, a corner that was meant; 1 up to 60°, a bend
        chord = slope * step
        size = np.abs(chord)
        turn = (chord[:-1] * chord[1:].conj()).real / np.maximum(size[:-1] * size[1:], 1e-12)
        velocity[1:-1] *= np.where(np.minimum(size[:-1], size[1:]) > _LONG, np.clip(2 * turn, 0, 1), 1.0)
        long = self.ends - self.starts > 1
        a, b = self.starts[long], self.ends[long] - 1
        pair = b - a == 1
        velocity[self.starts[~long]] = 0.0
        velocity[a] = np.where(pair, slope[a], 2 * slope[a] - velocity[a + 1])
        velocity[b] = np.where(pair, slope[a], 2 * slope[b - 1] - velocity[b - 1])
        # no handle longer than its chord: no loops where the pen is jerked
        bound = np.where(inside, 3 * np.abs(slope), np.inf)
        bound = np.minimum(np.r_[bound, np.inf], np.r_[np.inf, bound])
        return np.asarray(velocity * np.minimum(1.0, bound / np.maximum(np.abs(velocity), 1e-12)))

    def error(self, a: _Index, b: _Index) -> Array:
        """(m,) mm: how far one Bézier from sample `a` to sample `b` departs from the reference, for each of m."""
        count = 2 * (b - a) - 1
        begin = np.cumsum(count) - count
        at = np.arange(count.sum()) + np.repeat(2 * a + 1 - begin, count)
        span = self.t[b] - self.t[a]
        u = (self.check_t[at] - np.repeat(self.t[a], count)) / np.repeat(span, count)
        v = 1 - u
        chord = np.repeat(self.z[b] - self.z[a], count)
        out, back = np.repeat(span * self.velocity[a], count), np.repeat(span * self.velocity[b], count)
        place = np.repeat(self.z[a], count) + u * (u * (1 + 2 * v) * chord + v * (v * out - u * back))
        return np.asarray(np.maximum.reduceat(np.abs(place - self.check[at]), begin))


def _interleave(at: NDArray[_Number], half_step: NDArray[_Number]) -> NDArray[_Number]:
    """The two in turn: at, half, at, half, … at."""
    both = np.empty(len(at) + len(half_step), dtype=at.dtype)
    both[::2], both[1::2] = at, half_step
    return both


def _split_pieces(row: _SampleRow, tolerance: float) -> _Index:
    """Knots by halving every piece that is not within the tolerance."""
    # longer pieces are hardly ever within it, so trying them would only take time
    last = np.repeat(row.ends - 1, row.ends - row.starts)
    a = np.flatnonzero((np.arange(len(row.t)) - np.repeat(row.starts, row.ends - row.starts)) % _LONGEST == 0)
    b = np.minimum(a + _LONGEST, last[a])
    places = [a, b]
    a, b = a[b - a > 1], b[b - a > 1]
    while len(a):
        wide = row.error(a, b) > tolerance
        a, b = a[wide], b[wide]
        middle = (a + b) // 2
        places.append(middle)
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        a, b = a[b - a > 1], b[b - a > 1]
    return np.unique(np.concatenate(places))


def _merge(row: _SampleRow, knots: _Index, tolerance: float) -> _Index:
    """Knots without those that halving put where none is needed."""
    fixed = np.zeros(len(row.t), dtype=bool)
    fixed[row.starts] = fixed[row.ends - 1] = True
    for turn in range(6):
        # only every other knot is tried at a time, so that its neighbours stay
        place = np.arange(1 + turn % 2, len(knots) - 1, 2)
        place = place[~fixed[knots[place]]]
        if not len(place):
            continue
        spare = row.error(knots[place - 1], knots[place + 1]) <= tolerance
        keep = np.ones(len(knots), dtype=bool)
        keep[place[spare]] = False
        knots = knots[keep]
    return knots


def _curve(row: _SampleRow, knots: _Index) -> Curve:
    t, z = row.t[knots], row.z[knots]
    points = np.empty(3 * len(knots) - 2, dtype=np.complex128)
    points[::3] = z
    handle = np.diff(t) / 3
    points[1::3] = z[:-1] + row.velocity[knots[:-1]] * handle
    points[2::3] = z[1:] - row.velocity[knots[1:]] * handle
    return Curve(t, np.column_stack([points.real, points.imag]))
