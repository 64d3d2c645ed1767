"""When the pen is where: the time of strokes of which only the path is known, and of the pen in the air.

The time of a stroke is decided in one of two places.  Strokes of drawn hands get it from their motor engine
(`trace.trace`: an interval a point of the plan); paths over scanned ink get it here.  The time between strokes is
`time_in_air` for both.

A path is cut where it bends most.  How long each piece takes follows from its length and from how much it turns; each
is one stroke of lognormal speed.  Neighbouring strokes overlap, the more the softer the bend between them, and where
both are under way their velocities add up as vectors: in a sharp bend they cancel and the pen nearly stops.  The
lengths of the strokes are virtual, as targets are: they are adapted until each piece has its own length.  All paths of
a page are worked on at once.

Source: seed 002, §3.1–3.2 (sigma-lognormal strokes; overlap by sharpness); `Pace` and `AirTime` say what is fitted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from handout.libraries import ndimage
from handout.values import POSE, TURNS, Array, Indices, Stroke
from handout.writing.variation import USUAL

if TYPE_CHECKING:
    from handout.motion import sigma_lognormal_model as model
    from handout.motion.recovery.pen_paths import PenPath

# s: with it the usual stroke of traced ink lasts .15, as those of two healthy writers on paper (.135 and .160)
STROKE = 0.18


@dataclass(frozen=True)
class AirTime:
    """Time between strokes, in durations of the writer's usual stroke: medians of 1264 lifts by distance.

    Fitted to 92 sentences by 13 writers (UNIPEN, `atu`).  The time for a new line is not measured: no recording of
    several lines was at hand.
    """

    lift: float = 0.38
    lift_by_way: float = 0.41  # by the square root of the way in x-heights
    word: float = 0.23
    word_by_way: float = 1.88
    line: float = 2.0  # more
    farthest: float = 6.0  # x-heights: a hand goes back to the margin quicker, mm for mm, than to the next word
    hesitation: float = 0.5  # deviation of the logarithm: how much one lift differs from another of the same way
    most: float = 2.0  # deviations


@dataclass(frozen=True)
class Pace:
    """Speed along a path; all lengths in x-heights.

    Durations, overlaps and how the pen lands and leaves are fitted to 92 sentences of joined writing by 13 writers,
    recorded at 200 Hz (UNIPEN, `atu`): speeds that follow from the shape alone agree with the recorded ones with a
    correlation of .88, that of their logarithms along the path, and of .82 and .84 for two writers to whom nothing was
    fitted (`benchmarks/pen_speed.py`).  How hard the pen was pressed there says nothing more (correlation with the
    residuals −.00, middle of the sentences), and on simulated pages density and width of the ink add .00.
    """

    step: float = 0.04  # between places of a path
    blur: float = 0.10  # of the curvature
    bend: float = 0.8  # 1 / x-height: how much a bend must stand out to part strokes
    near: float = 0.15  # no bend is nearer to an end
    local: float = 0.15  # of the path on either side of a bend that make it sharp or soft
    sharpest: float = 2.6  # rad
    # duration over the median's: exp(c) · length^a · (turning + .3)^b; first and last strokes are cut off
    length: float = 0.34
    turning: float = 0.40
    first: float = -0.03
    last: float = -0.13
    median: float = -0.44
    still: float = 0.3  # rad
    shortest: float = 0.05
    # duration of a stroke, from −3 to +3 deviations, over that of its piece
    soft: float = 2.6
    sharp: float = 1.6
    asymmetry: float = 0.03
    # the pen lands when the first stroke is under way and leaves before the last is over; deviations of the logarithm
    landing: float = -1.3
    leaving: float = 1.0


_AIR, _PACE = AirTime(), Pace()
_SAMPLES = 24  # of a piece
_ROUNDS = 4  # of adapting the virtual lengths
_BESIDE = 2  # strokes on either side that may still be under way
RATE = 140.0  # samples a second, as of the drawn hands' strokes
_STEP = 0.05  # mm between the places of a path while it is made even
_SMOOTH = 0.12  # mm: what pixels add to a path is shorter
_DWELL = 0.07  # s, of a dot


def time_in_air(way: float, *, line: bool, word: bool, deviation: float = 0.0) -> float:
    """Seconds with the pen up.

    way : x-heights from the end of one movement to the beginning of the next.
    line, word : whether they are on different lines, and of different words.
    deviation : how many standard deviations the pause is longer or shorter than usual.
    """
    first, by_way = (_AIR.word, _AIR.word_by_way) if line or word else (_AIR.lift, _AIR.lift_by_way)
    strokes = first + by_way * math.sqrt(min(way, _AIR.farthest)) + (_AIR.line if line else 0.0)
    return STROKE * strokes * math.exp(_AIR.hesitation * min(max(deviation, -_AIR.most), _AIR.most))


@dataclass(frozen=True, eq=False)
class SampledPaths:
    """Paths of a page, evenly sampled, one behind the other.

    xy : (n, 2) float, x-heights; first : (k + 1,) int, where each path begins, the last entry n.
    step : (k,) float, x-heights between places of a path.
    """

    xy: Array
    first: Indices
    step: Array


@dataclass(frozen=True, eq=False)
class PathTimes:
    """When the pen is where on some paths.

    t : (m,) float, s, each path on its own clock, from 0; along : (m,) float: how far along its path, x-heights.
    first : (k + 1,) int, where each path begins, the last entry m.
    """

    t: Array
    along: Array
    first: Indices


def sample_paths(paths: Sequence[Array]) -> SampledPaths:
    """Paths (n, 2) in x-heights, each at least two different places, evenly sampled."""
    count = np.array([len(path) for path in paths])
    xy = np.concatenate(paths)
    moved = np.hypot(*np.diff(xy, axis=0).T)
    begin = np.concatenate([[0], np.cumsum(count)])
    moved[begin[1:-1] - 1] = 1.0  # from path to path
    run = np.concatenate([[0.0], np.cumsum(moved)])
    low, high = run[begin[:-1]], run[begin[1:] - 1]
    steps = np.maximum(np.ceil((high - low) / _PACE.step), 6).astype(np.intp)
    first = np.concatenate([[0], np.cumsum(steps + 1)])
    number = np.arange(first[-1]) - np.repeat(first[:-1], steps + 1)
    step = (high - low) / steps
    at = np.minimum(np.repeat(low, steps + 1) + number * np.repeat(step, steps + 1), np.repeat(high, steps + 1))
    return SampledPaths(np.column_stack([np.interp(at, run, xy[:, k]) for k in (0, 1)]), first, step)


def time_paths(paths: SampledPaths, stroke: float = STROKE) -> PathTimes:
    """When the pen is where.

    stroke : s, the usual duration of a stroke; see `AirTime`.
    """
    bend = curvature(paths)
    cut, of = _pieces(paths, bend)
    # of each piece its length and its turning, rad; and how sharp the bend is with which it ends, rad
    step = paths.step[of]
    turned = np.concatenate([[0.0], np.cumsum(np.abs(bend) * np.repeat(paths.step, np.diff(paths.first)))])
    local = np.maximum(np.round(_PACE.local / step), 1).astype(np.intp)
    after = np.minimum(cut[:, 1] + local, paths.first[of + 1] - 1)
    before = np.maximum(cut[:, 1] - local, paths.first[of])
    length, turning = (cut[:, 1] - cut[:, 0]) * step, turned[cut[:, 1]] - turned[cut[:, 0]]
    sharp = turned[after] - turned[before]
    start = np.concatenate([[True], of[1:] != of[:-1]])
    end = np.concatenate([of[1:] != of[:-1], [True]])
    by_length = np.log(np.maximum(length, _PACE.shortest)) * _PACE.length
    lasts = by_length + np.log(turning + _PACE.still) * _PACE.turning + _PACE.median
    duration = stroke * np.exp(lasts + _PACE.first * start + _PACE.last * end)
    t, along = _play(length, sharp, duration, start, end)
    pieces = np.bincount(of, minlength=len(paths.step))
    # the pieces of every path one behind the other
    last = np.cumsum(pieces)
    begun = [np.cumsum(values[:, -1]) - values[:, -1] for values in (t, along)]
    begun = [values - np.repeat(values[last - pieces], pieces) for values in begun]
    keep = np.ones(t.shape, dtype=bool)
    keep[:, 0] = False
    keep[last - pieces, 0] = True
    first = np.concatenate([[0], np.cumsum(pieces * (_SAMPLES - 1) + 1)])
    return PathTimes((t + begun[0][:, None])[keep], (along + begun[1][:, None])[keep], first)


def curvature(paths: SampledPaths) -> Array:
    """(n,) 1 / x-height, smoothed: positive from x towards y; 0 at the ends of the paths."""
    direction = np.diff(paths.xy @ np.array([1.0, 1j]))
    turned = np.zeros(len(paths.xy))
    turned[1:-1] = np.angle(direction[1:] * np.conj(direction[:-1]))
    turned[paths.first[:-1]] = turned[paths.first[1:] - 1] = 0.0
    # room between the paths, so that none is smoothed into the next
    room = round(4 * _PACE.blur / _PACE.step) + 1
    place = np.arange(len(turned)) + room * np.repeat(np.arange(len(paths.step)), np.diff(paths.first))
    spread = np.zeros(int(place[-1]) + 1 + room)
    spread[place] = turned / np.repeat(paths.step, np.diff(paths.first))
    return np.asarray(ndimage.gaussian_filter1d(spread, _PACE.blur / _PACE.step, mode="constant")[place])


def _pieces(paths: SampledPaths, bend: Array) -> tuple[Indices, Indices]:
    """(m, 2) int: first and last place of every piece between two bends; (m,) int: its path."""
    from handout.peaks import peaks

    bends = peaks(np.abs(bend), prominence=_PACE.bend)
    path = np.searchsorted(paths.first, bends, side="right") - 1
    near = np.minimum(bends - paths.first[path], paths.first[path + 1] - 1 - bends) * paths.step[path] <= _PACE.near
    bends, path = bends[~near], path[~near]
    begin = np.concatenate([paths.first[:-1], bends])
    finish = np.concatenate([paths.first[1:] - 1, bends])
    of = np.concatenate([np.arange(len(paths.step)), path])
    return np.column_stack([np.sort(begin), np.sort(finish)]), np.sort(of)


def _play(length: Array, sharp: Array, duration: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """(m, samples) each: times from the beginning of a piece, and how far along it the pen is."""
    soft = _PACE.soft - (_PACE.soft - _PACE.sharp) * np.sqrt(np.minimum(sharp / _PACE.sharpest, 1.0))
    into = np.where(start, soft, np.roll(soft, 1))
    out = np.where(end, into, soft)
    into = np.where(start, out, into)
    from handout.motion import sigma_lognormal_model as model

    pulses = model.pulses(duration * np.sqrt(into * out), _PACE.asymmetry, 0.0, 0.0)
    middle = pulses.time(0.0)
    begin = np.where(start, pulses.time(_PACE.landing) - middle, -duration / 2)
    finish = np.where(end, pulses.time(_PACE.leaving) - middle, duration / 2)
    t = begin[:, None] + (finish - begin)[:, None] * np.linspace(0.0, 1.0, _SAMPLES)
    beside = _neighbour_speeds(pulses, middle, t, start, duration)
    cosine = np.cos(np.minimum(sharp, np.pi))
    virtual = length.copy()
    for _ in range(_ROUNDS):
        # how far the pen has gone in each piece, given the lengths of the strokes
        speed = [virtual[other][:, None] * rate for other, rate in beside]
        square = np.asarray(sum(rate_here * rate_here for rate_here in speed))
        for (other, _), rate_here, following in zip(beside, speed, speed[1:], strict=False):
            square = square + 2 * cosine[other][:, None] * rate_here * following
        total = np.sqrt(np.maximum(square, 1e-12))
        gone = np.cumsum((total[:, 1:] + total[:, :-1]) / 2 * np.diff(t, axis=1), axis=1)
        run = np.concatenate([np.zeros((len(t), 1)), gone], axis=1)
        virtual = virtual * length / run[:, -1]
    return t - begin[:, None], run * (length / run[:, -1])[:, None]


def _neighbour_speeds(
    pulses: model.Pulses, middle: Array, t: Array, start: Array, duration: Array
) -> list[tuple[Indices, Array]]:
    """Of every stroke that may be under way in a piece, its number and its speed there for a length of 1."""
    count, path = len(middle), np.cumsum(start)
    centre = np.cumsum(duration) - duration / 2
    rates = []
    for by in range(-_BESIDE, _BESIDE + 1):
        other = np.clip(np.arange(count) + by, 0, count - 1)
        there = (path[other] == path) & (other == np.arange(count) + by)
        late = t + (centre - centre[other])[:, None] + (middle - pulses.t0)[other][:, None]
        going = (late > 0) & there[:, None]
        late = np.where(going, late, 1.0)
        sigma = pulses.sigma[other][:, None]
        z = (np.log(late) - pulses.mu[other][:, None]) / sigma
        rate = np.where(going, np.exp(-0.5 * z * z) / (np.sqrt(2 * np.pi) * sigma * late), 0.0)
        rates.append((other, rate))
    return rates


def timed_strokes(
    paths: Sequence[PenPath],
    lines: Sequence[int],
    x_height: float,
    rng: np.random.Generator,
    *,
    speed: float = 1.0,
    jitter: float = 1.0,
) -> Iterator[Stroke]:
    """Timed strokes along some paths.

    paths : in the order of writing; lines : of each, the number of its line on the page.
    x_height : mm.
    speed : 1 is a person's.
    jitter : scale of how much pauses and paces vary.
    """
    shapes = [_smooth_shape(path) for path in paths]
    hesitation = jitter * rng.standard_normal(len(paths))
    haste = np.exp(USUAL.pace * min(jitter, 2.0) * rng.standard_normal(len(paths)))
    clock, before = 0.0, np.zeros(2)
    for number, (t, xy, width, pose) in enumerate(_movements(paths, shapes, x_height)):
        path, t = paths[number], t * haste[number]
        if number:
            way = float(np.hypot(*(xy[0] - before))) / x_height
            line, word = lines[number] != lines[number - 1], path.word != paths[number - 1].word
            clock += time_in_air(way, line=line, word=word, deviation=float(hesitation[number]))
        yield Stroke((clock + t) / speed, xy, **pose, width=width, word=path.word)
        clock, before = clock + float(t[-1]), xy[-1]


def _movements(
    paths: Sequence[PenPath], shapes: Sequence[tuple[Array, Array]], x_height: float
) -> Iterator[tuple[Array, Array, Array, dict[str, Any]]]:
    """t, from 0, xy, width and pose of every movement along a shape, evenly sampled in time."""
    long = [number for number, (xy, _) in enumerate(shapes) if len(xy) > 1]
    timed = time_paths(sample_paths([shapes[number][0] / x_height for number in long])) if long else None
    place = dict(zip(long, range(len(long)), strict=True))
    for number, (path, (xy, width)) in enumerate(zip(paths, shapes, strict=True)):
        held = _pose(path)
        if timed is None or number not in place:
            dwelt = {name: np.repeat(values[:1], 2) for name, values in held.items()}
            yield np.array([0.0, _DWELL]), np.repeat(xy, 2, axis=0), np.repeat(width, 2), dwelt
            continue
        samples = slice(*timed.first[place[number] : place[number] + 2].tolist())
        run, along = arc_length(xy), timed.along[samples] * x_height
        t = np.interp(run, along * (run[-1] / along[-1]), timed.t[samples])
        raw = arc_length(path.xy)
        at = np.linspace(0.0, raw[-1], len(xy))  # where on the path as it was found the places of the shape lie
        if path.steps is not None:
            # what a recorded pen took from place to place, and where that is not known what `t` says
            finite = np.isfinite(path.steps)
            model = np.diff(np.interp(raw, at, t))
            whole = np.concatenate([[0.0], np.cumsum(np.where(finite, path.steps, model))])
            t = np.maximum.accumulate(np.interp(at, raw, whole)) + 1e-9 * np.arange(len(at))
        times = np.linspace(0.0, t[-1], max(3, round(float(t[-1]) * RATE) + 1))
        channels = [np.interp(times, t, values) for values in (*xy.T, width)]
        pose = {name: np.interp(np.interp(times, t, at), raw, values) for name, values in held.items()}
        yield times, np.column_stack(channels[:2]), channels[2], pose


def arc_length(xy: Array) -> Array:
    """(n,) mm: length along a path (n, 2) up to each of its places."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])


def _smooth_shape(path: PenPath) -> tuple[Array, Array]:
    """Places and widths along a path, evenly spaced, without what pixels add; of a dot only one."""
    run = arc_length(path.xy)
    if run[-1] < _STEP:
        return path.xy[:1], path.width[:1]
    at = np.linspace(0.0, run[-1], max(3, round(run[-1] / _STEP) + 1))
    even = np.column_stack([np.interp(at, run, values) for values in (*path.xy.T, path.width)])
    smooth = smooth_values(even, _SMOOTH / at[1])
    return smooth[:, :2], smooth[:, 2]


def _pose(path: PenPath) -> dict[str, Array]:
    """How a recorded pen was held along a path, (n,) each; only what is known of some of it, angles without jumps."""
    if path.pose is None:
        return {}
    pose = dict[str, Array]()
    for name, values in zip(POSE, path.pose.T, strict=True):
        known = np.isfinite(values)
        if known.any():
            filled = np.interp(np.arange(len(values)), np.flatnonzero(known), values[known])
            pose[name] = np.unwrap(filled) if name in TURNS else filled
    return pose


def smooth_values(values: Array, sigma: float) -> Array:
    """(n, d): evenly spaced values (n, d) without what is shorter than `sigma` samples; both ends stay."""
    reach = max(1, min(int(3 * sigma), len(values) - 1))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(sigma, 1e-9)) ** 2)
    weights /= weights.sum()
    # beyond each end the line is continued by its point reflection about that end
    padded = np.concatenate([2 * values[0] - values[reach:0:-1], values, 2 * values[-1] - values[-2 : -reach - 2 : -1]])
    return np.column_stack([np.convolve(padded[:, k], weights, mode="valid") for k in range(values.shape[1])])
