"""How a hand moves along paths of which only the shape is known: strokes of lognormal speed, one between two bends.

A path is cut where it bends most.  How long each piece takes follows from its length and from how much it turns; each
is one stroke of lognormal speed.  Neighbouring strokes overlap, the more the softer the bend between them, and where
both are under way their velocities add up as vectors: in a sharp bend they cancel and the pen nearly stops.  The
lengths of the strokes are virtual, as targets are: they are led to where each piece has its own length.

All paths of a page are worked on at once.

Source: seed 002, §3.1–3.2 (Sigma-Lognormal strokes; overlap by sharpness).  Durations, overlaps and how the pen lands
and leaves are fitted to 92 sentences of joined writing by 13 writers, recorded at 200 Hz (UNIPEN, `atu`): speeds that
follow from the shape alone agree with the recorded ones with a correlation of .88, that of their logarithms along the
path, and of .82 and .84 for two writers to whom nothing was fitted (`benchmarks/speed.py`).  How hard the pen was
pressed there says nothing more (correlation with what is left −.00, middle of the sentences), and on simulated pages
density and width of the ink add .00 to the correlation: neither has a say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.motion import lognormal
from handout.motion.air import STROKE
from handout.peaks import peaks
from handout.values import Array, Indices

_STEP = 0.04  # x-heights, as are all lengths below; between places of a path
_BLUR = 0.10  # of the curvature
_BEND = 0.8  # 1 / x-height: how much a bend must stand out to part strokes
_NEAR = 0.15  # no bend is nearer to an end
_LOCAL = 0.15  # of the path on either side of a bend that make it sharp or soft
_SHARPEST = 2.6  # rad
# duration over the median's: exp(c) · length^a · (turning + .3)^b; first and last strokes are cut off
_LENGTH, _TURNING, _FIRST, _LAST, _MEDIAN = 0.34, 0.40, -0.03, -0.13, -0.44
_STILL = 0.3  # rad
_SHORTEST = 0.05
_SOFT, _SHARP = 2.6, 1.6  # duration of a stroke, from −3 to +3 deviations, over that of its piece
_ASYMMETRY = 0.03
# the pen lands when the first stroke is under way and leaves before the last is over; deviations of the logarithm
_LANDING, _LEAVING = -1.3, 1.0
_SAMPLES = 24  # of a piece
_ROUNDS = 4
_BESIDE = 2  # strokes on either side that may still be under way


@dataclass(frozen=True, eq=False)
class Course:
    """Paths of a page, evenly sampled, one behind the other.

    xy : (n, 2) float, x-heights; first : (k + 1,) int, where each path begins, the last entry n.
    step : (k,) float, x-heights between places of a path.
    """

    xy: Array
    first: Indices
    step: Array


@dataclass(frozen=True, eq=False)
class Pace:
    """When the pen is where on some paths.

    t : (m,) float, s, each path on its own clock, from 0; along : (m,) float: how far along its path, x-heights.
    first : (k + 1,) int, where each path begins, the last entry m.
    """

    t: Array
    along: Array
    first: Indices


def course(paths: Sequence[Array]) -> Course:
    """Paths (n, 2) in x-heights, each at least two different places, evenly sampled."""
    count = np.array([len(path) for path in paths])
    xy = np.concatenate(paths)
    moved = np.hypot(*np.diff(xy, axis=0).T)
    begin = np.concatenate([[0], np.cumsum(count)])
    moved[begin[1:-1] - 1] = 1.0  # from path to path
    run = np.concatenate([[0.0], np.cumsum(moved)])
    low, high = run[begin[:-1]], run[begin[1:] - 1]
    steps = np.maximum(np.ceil((high - low) / _STEP), 6).astype(np.intp)
    first = np.concatenate([[0], np.cumsum(steps + 1)])
    number = np.arange(first[-1]) - np.repeat(first[:-1], steps + 1)
    step = (high - low) / steps
    at = np.minimum(np.repeat(low, steps + 1) + number * np.repeat(step, steps + 1), np.repeat(high, steps + 1))
    return Course(np.column_stack([np.interp(at, run, xy[:, k]) for k in (0, 1)]), first, step)


def pace(way: Course, stroke: float = STROKE) -> Pace:
    """When the pen is where.

    Parameters
    ----------
    stroke : s, the usual duration of a stroke; see `handout.motion.air`.
    """
    bend = curvature(way)
    cut, of = _pieces(way, bend)
    length, turning, sharp = _measured(way, bend, cut, of)
    start = np.concatenate([[True], of[1:] != of[:-1]])
    end = np.concatenate([of[1:] != of[:-1], [True]])
    lasts = np.log(np.maximum(length, _SHORTEST)) * _LENGTH + np.log(turning + _STILL) * _TURNING + _MEDIAN
    duration = stroke * np.exp(lasts + _FIRST * start + _LAST * end)
    t, along = _played(length, sharp, duration, start, end)
    pieces = np.bincount(of, minlength=len(way.step))
    return _whole(t, along, pieces)


def curvature(way: Course) -> Array:
    """(n,) 1 / x-height, smoothed: positive from x towards y; 0 at the ends of the paths."""
    from scipy.ndimage import gaussian_filter1d

    direction = np.diff(way.xy @ np.array([1.0, 1j]))
    turned = np.zeros(len(way.xy))
    turned[1:-1] = np.angle(direction[1:] * np.conj(direction[:-1]))
    turned[way.first[:-1]] = turned[way.first[1:] - 1] = 0.0
    # room between the paths, so that none is smoothed into the next
    room = round(4 * _BLUR / _STEP) + 1
    place = np.arange(len(turned)) + room * np.repeat(np.arange(len(way.step)), np.diff(way.first))
    spread = np.zeros(int(place[-1]) + 1 + room)
    spread[place] = turned / np.repeat(way.step, np.diff(way.first))
    return np.asarray(gaussian_filter1d(spread, _BLUR / _STEP, mode="constant")[place])


def _pieces(way: Course, bend: Array) -> tuple[Indices, Indices]:
    """(m, 2) int: first and last place of every piece between two bends; (m,) int: its path."""
    bends = peaks(np.abs(bend), prominence=_BEND)
    path = np.searchsorted(way.first, bends, side="right") - 1
    near = np.minimum(bends - way.first[path], way.first[path + 1] - 1 - bends) * way.step[path] <= _NEAR
    bends, path = bends[~near], path[~near]
    begin = np.concatenate([way.first[:-1], bends])
    finish = np.concatenate([way.first[1:] - 1, bends])
    of = np.concatenate([np.arange(len(way.step)), path])
    return np.column_stack([np.sort(begin), np.sort(finish)]), np.sort(of)


def _measured(way: Course, bend: Array, cut: Indices, of: Indices) -> tuple[Array, Array, Array]:
    """Of every piece its length and how much it turns, rad; and how sharp the bend is with which it ends, rad."""
    step = way.step[of]
    turned = np.concatenate([[0.0], np.cumsum(np.abs(bend) * np.repeat(way.step, np.diff(way.first)))])
    local = np.maximum(np.round(_LOCAL / step), 1).astype(np.intp)
    after = np.minimum(cut[:, 1] + local, way.first[of + 1] - 1)
    before = np.maximum(cut[:, 1] - local, way.first[of])
    return (cut[:, 1] - cut[:, 0]) * step, turned[cut[:, 1]] - turned[cut[:, 0]], turned[after] - turned[before]


def _played(length: Array, sharp: Array, duration: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """(m, samples) each: times from the beginning of a piece, and how far along it the pen is."""
    soft = _SOFT - (_SOFT - _SHARP) * np.sqrt(np.minimum(sharp / _SHARPEST, 1.0))
    into = np.where(start, soft, np.roll(soft, 1))
    out = np.where(end, into, soft)
    into = np.where(start, out, into)
    pulses = lognormal.pulses(duration * np.sqrt(into * out), _ASYMMETRY, 0.0, 0.0)
    middle = pulses.time(0.0)
    begin = np.where(start, pulses.time(_LANDING) - middle, -duration / 2)
    finish = np.where(end, pulses.time(_LEAVING) - middle, duration / 2)
    t = begin[:, None] + (finish - begin)[:, None] * np.linspace(0.0, 1.0, _SAMPLES)
    beside = _beside(pulses, middle, t, start, duration)
    cosine = np.cos(np.minimum(sharp, np.pi))
    virtual = length.copy()
    for _ in range(_ROUNDS):
        run = _run(virtual, beside, cosine, t)
        virtual = virtual * length / run[:, -1]
    return t - begin[:, None], run * (length / run[:, -1])[:, None]


def _beside(
    pulses: lognormal.Pulses, middle: Array, t: Array, start: Array, duration: Array
) -> list[tuple[Indices, Array]]:
    """Of every stroke that may be under way in a piece, its number and its speed there for a length of 1."""
    count, path = len(middle), np.cumsum(start)
    centre = np.cumsum(duration) - duration / 2
    found = []
    for by in range(-_BESIDE, _BESIDE + 1):
        other = np.clip(np.arange(count) + by, 0, count - 1)
        there = (path[other] == path) & (other == np.arange(count) + by)
        late = t + (centre - centre[other])[:, None] + (middle - pulses.t0)[other][:, None]
        going = (late > 0) & there[:, None]
        late = np.where(going, late, 1.0)
        sigma = pulses.sigma[other][:, None]
        z = (np.log(late) - pulses.mu[other][:, None]) / sigma
        rate = np.where(going, np.exp(-0.5 * z * z) / (np.sqrt(2 * np.pi) * sigma * late), 0.0)
        found.append((other, rate))
    return found


def _run(virtual: Array, beside: list[tuple[Indices, Array]], cosine: Array, t: Array) -> Array:
    """(m, samples): how far the pen has gone in each piece, given the lengths of the strokes."""
    speed = [virtual[other][:, None] * rate for other, rate in beside]
    square = np.asarray(sum(one * one for one in speed))
    for (other, _), one, following in zip(beside, speed, speed[1:], strict=False):
        square = square + 2 * cosine[other][:, None] * one * following
    total = np.sqrt(np.maximum(square, 1e-12))
    gone = np.cumsum((total[:, 1:] + total[:, :-1]) / 2 * np.diff(t, axis=1), axis=1)
    return np.concatenate([np.zeros((len(t), 1)), gone], axis=1)


def _whole(t: Array, along: Array, pieces: Indices) -> Pace:
    """The pieces of every path one behind the other."""
    last = np.cumsum(pieces)
    begun = [np.cumsum(values[:, -1]) - values[:, -1] for values in (t, along)]
    begun = [values - np.repeat(values[last - pieces], pieces) for values in begun]
    keep = np.ones(t.shape, dtype=bool)
    keep[:, 0] = False
    keep[last - pieces, 0] = True
    first = np.concatenate([[0], np.cumsum(pieces * (_SAMPLES - 1) + 1)])
    return Pace((t + begun[0][:, None])[keep], (along + begun[1][:, None])[keep], first)
