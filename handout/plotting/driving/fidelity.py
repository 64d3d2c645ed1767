"""How faithfully strokes were executed: their paths, their speeds, their time.

Two drawings are compared stroke by stroke; strokes that go nowhere (dots) only count for their place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handout.values import Array, Drawing, Stroke

_HALF = 0.005  # s; speeds are means over a hundredth of a second
_FINE = 0.02  # mm between points at which paths are compared
_LOOK = 0.6  # mm along the path within which the same place is looked for
_NEIGHBOURS = 25  # places over which the shift along the path is averaged
_LAGS = np.arange(-0.05, 0.0501, 0.0025)  # s


@dataclass(frozen=True)
class Fidelity:
    """Executed against intended.

    deviation : mm, greatest distance between the paths, either way.
    correlation, rms : of the speeds at the same places of the path; rms as a share of the greatest intended speed.
    timed, timed_rms : of the speeds at the same times, after the one shift of the clock that suits all strokes best.
    stretched : time the strokes took over the time they were meant to take.
    """

    deviation: float
    correlation: float
    rms: float
    timed: float
    timed_rms: float
    stretched: float


def compare(intended: Drawing, executed: Drawing) -> Fidelity:
    """Compare two drawings of the same strokes in the same order.

    Raises
    ------
    ValueError
        They have not the same number of strokes, or none of them moves.
    """
    pairs = list(zip(intended.strokes, executed.strokes, strict=True))
    moving = [pair for pair in pairs if comparable(*pair)]
    if not moving:
        raise ValueError("no stroke of the drawing moves")
    places = [_speeds_in_place(a, b) for a, b in moving]
    want, have = (np.concatenate(column) for column in zip(*places, strict=True))
    deviation = max(deviation_of(a, b) for a, b in pairs)
    return Fidelity(
        deviation,
        _correlation(want, have),
        _rms(want, have),
        *_compare_speeds(moving),
        measure_stretch(intended, executed),
    )


def measure_timing(intended: Drawing, executed: Drawing) -> float | None:
    """`Fidelity.timed` alone; None if no stroke is long enough to have a speed."""
    moving = [pair for pair in zip(intended.strokes, executed.strokes, strict=True) if comparable(*pair)]
    return _compare_speeds(moving)[0] if moving else None


def measure_stretch(intended: Drawing, executed: Drawing) -> float:
    """Time the strokes took over the time they were meant to take; dots do not count."""
    planned, executed_time = times(intended, executed)
    return executed_time / planned if planned > 0 else 1.0


def times(intended: Drawing, executed: Drawing) -> tuple[float, float]:
    """Time the strokes were meant to take and took, s; dots do not count."""
    pairs = [(a, b) for a, b in zip(intended.strokes, executed.strokes, strict=False) if moves(a, b)]
    return sum(float(a.t[-1] - a.t[0]) for a, _ in pairs), sum(float(b.t[-1] - b.t[0]) for _, b in pairs)


def moves(intended: Stroke, executed: Stroke) -> bool:
    """Whether a stroke goes somewhere, as it was meant and as it was executed."""
    return intended.length > 0 and executed.length > 0


def comparable(intended: Stroke, executed: Stroke) -> bool:
    """Whether a stroke moves, and for long enough to have a speed."""
    return moves(intended, executed) and len(_grid(intended)) > 1


def deviation_of(a: Stroke, b: Stroke) -> float:
    """Greatest distance of a point of either path from the same stretch of the other, mm.

    It is never less than the Hausdorff distance of the two paths.
    """
    return max(_measure_distance(a.xy, b.xy), _measure_distance(b.xy, a.xy))


def _measure_distance(path: Array, other: Array) -> float:
    """Greatest distance of a point on one path from the other path at about the same share of its length."""
    points, at = _dense(path, 0.1)
    along = along_path(other)
    if along[-1] == 0.0:
        return float(np.hypot(*(points - other[0]).T).max())
    guess = at * (along[-1] / at[-1] if at[-1] > 0 else 0.0)
    near = np.searchsorted(along, guess[:, None] + np.array([-_LOOK, _LOOK]))
    width = int(np.diff(near).max()) + 1
    index = np.clip(near[:, :1] - 1 + np.arange(width), 0, len(other) - 2)
    # x and y by themselves: an axis of two is slow
    (x, y), (way_x, way_y) = other[:-1].T, np.diff(other, axis=0).T
    square = np.maximum(way_x * way_x + way_y * way_y, 1e-12)
    off_x, off_y = points[:, :1] - x[index], points[:, 1:] - y[index]
    way_x, way_y = way_x[index], way_y[index]
    share = np.clip((off_x * way_x + off_y * way_y) / square[index], 0.0, 1.0)
    off_x -= share * way_x
    off_y -= share * way_y
    return float(np.sqrt((off_x * off_x + off_y * off_y).min(axis=1)).max())


def along_path(xy: Array) -> Array:
    """(n,) mm: how far along its path each point of a stroke lies."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])


def _dense(xy: Array, step: float = _FINE) -> tuple[Array, Array]:
    """Points every `step` mm along a path, corners included, and how far along they are."""
    arc = along_path(xy)
    at = np.union1d(arc, np.arange(0.0, arc[-1], step))
    keep = np.append(True, np.diff(arc) > 0)
    return np.stack([np.interp(at, arc[keep], xy[keep, axis]) for axis in (0, 1)], axis=1), at


def _speed_at(t: Array, clock: Array, arc: Array) -> Array:
    """Mean speed along the path around times t, mm/s."""
    early, late = np.clip(t - _HALF, clock[0], clock[-1]), np.clip(t + _HALF, clock[0], clock[-1])
    way = np.interp(late, clock, arc) - np.interp(early, clock, arc)
    return np.asarray(way / np.maximum(late - early, 1e-9))


def _grid(stroke: Stroke) -> Array:
    return np.arange(stroke.t[0] + _HALF, stroke.t[-1] - _HALF / 2, _HALF)


def _speeds_in_place(a: Stroke, b: Stroke) -> tuple[Array, Array]:
    """Intended and executed speed where the pen was meant to be at equal steps of time."""
    t, arc_a, arc_b = _grid(a), along_path(a.xy), along_path(b.xy)
    xy = np.stack([np.interp(t, a.t, a.xy[:, axis]) for axis in (0, 1)], axis=1)
    along = _match(xy, np.interp(t, a.t, arc_a) * arc_b[-1] / arc_a[-1], b.xy)
    when = np.interp(along, arc_b, b.t)
    return _speed_at(t, a.t, arc_a), _speed_at(when, b.t, arc_b)


def _match(xy: Array, guess: Array, path: Array) -> Array:
    """How far along the path the places are, looked for around a guess, in order.

    Executed paths are a little shorter or longer than meant; that grows slowly along a stroke, so what is found for
    single places, to within a step of the motors, is averaged over their neighbours.
    """
    points, at = _dense(path)
    even = np.arange(0.0, at[-1] + _FINE, _FINE)
    points = np.stack([np.interp(even, at, points[:, axis]) for axis in (0, 1)], axis=1)
    reach = round(_LOOK / _FINE)
    index = np.clip(np.rint(guess / _FINE).astype(int)[:, None] + np.arange(-reach, reach + 1), 0, len(even) - 1)
    off = points[index] - xy[:, None]
    cost = (off * off).sum(axis=2) + 1e-3 * (even[index] - guess[:, None]) ** 2
    shift = even[index[np.arange(len(xy)), np.argmin(cost, axis=1)]] - guess
    window = np.ones(min(_NEIGHBOURS, len(shift)))
    mean = np.convolve(shift, window, "same") / np.convolve(np.ones(len(shift)), window, "same")
    return np.asarray(np.maximum.accumulate(np.clip(guess + mean, 0.0, at[-1])))


def _compare_speeds(moving: list[tuple[Stroke, Stroke]]) -> tuple[float, float]:
    """Correlation and rms, as a share of the peak, of the speeds at the same times, at the best lag of all."""
    wanted, executed = [], []  # at equal steps of time, (n,); at the same times and every lag, (n, lags)
    for a, b in moving:
        t = _grid(a)
        wanted.append(_speed_at(t, a.t, along_path(a.xy)))
        executed.append(_speed_at((t - a.t[0] + b.t[0])[:, None] + _LAGS, b.t, along_path(b.xy)))
    want, lagged = np.concatenate(wanted), np.concatenate(executed)
    best = int(np.argmin(((lagged - want[:, None]) ** 2).sum(axis=0)))
    return _correlation(want, lagged[:, best]), _rms(want, lagged[:, best])


def _rms(want: Array, have: Array) -> float:
    return float(np.sqrt(np.mean((want - have) ** 2)) / want.max())


def _correlation(a: Array, b: Array) -> float:
    if len(a) < 2 or np.ptp(a) < 1e-9 or np.ptp(b) < 1e-9:
        return 1.0
    return float(np.corrcoef(a, b)[0, 1])
