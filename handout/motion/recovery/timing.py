"""When the pen was where, on paths of which only the ink is known: provisional, until strokes are fitted to them.

Speed follows the curve by the two-thirds power law, rises from rest at the beginning and comes to rest at the end.

Source: Lacquaniti, Terzuolo, Viviani 1983 (speed ∝ curvature^−⅓); seed 002, §3.2 for what is to replace it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from handout.motion.air import in_the_air
from handout.motion.recovery.pages import Path
from handout.values import Array, Stroke

RATE = 140.0  # samples a second, as of the drawn hands' strokes
_STEP = 0.05  # mm between the places of a path while it is made even
_SMOOTH = 0.12  # mm: what pixels add to a path is shorter
_SPEED = 11.0  # x-heights a second, at the usual curvature
_USUAL, _FLATTEST = 1.2, 0.25  # curvature, 1 / x-height: the usual one, and less than which counts as straight
_SLOWEST = 0.25  # of the usual speed, in the sharpest turns
_REST = 0.06  # s from rest to full speed, and back
_DWELL = 0.07  # s, of a dot


def strokes(paths: Sequence[Path], lines: Sequence[int], x_height: float, pace: float = 1.0) -> Iterator[Stroke]:
    """Timed strokes along some paths.

    Parameters
    ----------
    paths : in the order of writing; lines : of each, the number of its line on the page.
    x_height : mm.
    pace : 1 is a person's.
    """
    clock, before = 0.0, None
    for path, line in zip(paths, lines, strict=True):
        t, xy, width, pressure = _timed(path, x_height)
        if before is not None:
            end, word, above = before
            way = float(np.hypot(*(xy[0] - end))) / x_height
            clock += in_the_air(way, line=line != above, word=word != path.word)
        yield Stroke((clock + t) / pace, xy, pressure, width=width, word=path.word)
        clock += float(t[-1])
        before = (xy[-1], path.word, line)


def _timed(path: Path, x_height: float) -> tuple[Array, Array, Array, Array | None]:
    """t, xy, width and pressure of one movement, evenly sampled in time."""
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path.xy, axis=0).T))])
    pressed = _filled(path.pressure) if path.pressure is not None else None
    if run[-1] < _STEP:
        xy, width = np.repeat(path.xy[:1], 2, axis=0), np.repeat(path.width[:1], 2)
        return np.array([0.0, _DWELL]), xy, width, None if pressed is None else np.repeat(pressed[:1], 2)
    count = max(3, round(run[-1] / _STEP) + 1)
    at = np.linspace(0.0, run[-1], count)
    even = np.column_stack([np.interp(at, run, path.xy[:, k]) for k in (0, 1)])
    xy, width = smoothed(even, _SMOOTH / at[1]), smoothed(np.interp(at, run, path.width)[:, None], _SMOOTH / at[1])
    t = _clock(xy, x_height)
    if path.steps is not None:
        t = _measured(t, at, run, path.steps)
    times = np.linspace(0.0, t[-1], max(3, round(t[-1] * RATE) + 1))
    placed = np.column_stack([np.interp(times, t, xy[:, k]) for k in (0, 1)])
    pressure = None if pressed is None else np.interp(times, t, np.interp(at, run, pressed))
    return times, placed, np.interp(times, t, width[:, 0]), pressure


def _filled(values: Array) -> Array | None:
    """Values with what is not known between those that are; None if none is."""
    known = np.isfinite(values)
    return np.interp(np.arange(len(values)), np.flatnonzero(known), values[known]) if known.any() else None


def _measured(t: Array, at: Array, run: Array, steps: Array) -> Array:
    """(n,) s at places `at` along a path: what a recorded pen took, and where that is not known what `t` says.

    Parameters
    ----------
    run, steps : (m,), (m − 1,): the path's own places, mm, and how long the pen took from each to the next.
    """
    known = np.isfinite(steps)
    model = np.diff(np.interp(run, at, t))
    whole = np.concatenate([[0.0], np.cumsum(np.where(known, steps, model))])
    return np.asarray(np.maximum.accumulate(np.interp(at, run, whole)) + 1e-9 * np.arange(len(at)))


def smoothed(values: Array, sigma: float) -> Array:
    """(n, d): evenly spaced values (n, d) without what is shorter than `sigma` samples; both ends stay."""
    reach = max(1, min(int(3 * sigma), len(values) - 1))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(sigma, 1e-9)) ** 2)
    weights /= weights.sum()
    # turned about its ends, a line goes on as it came
    padded = np.concatenate([2 * values[0] - values[reach:0:-1], values, 2 * values[-1] - values[-2 : -reach - 2 : -1]])
    return np.column_stack([np.convolve(padded[:, k], weights, mode="valid") for k in range(values.shape[1])])


def _clock(xy: Array, x_height: float) -> Array:
    """(n,) s at places (n, 2) along a path."""
    first, step = np.gradient(xy, axis=0), np.hypot(*np.diff(xy, axis=0).T)
    second = np.gradient(first, axis=0)
    size = np.maximum(np.hypot(*first.T), 1e-9)
    bend = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / size**3 * x_height
    speed = np.maximum((np.maximum(bend, _FLATTEST) / _USUAL) ** (-1 / 3), _SLOWEST) * _SPEED * x_height
    t = np.concatenate([[0.0], np.cumsum(2 * step / (speed[1:] + speed[:-1]))])
    # at rest at both ends: there the same way takes longer
    eased = t + _REST * (np.exp(-3 * t / _REST) * -1 + 1) + _REST * np.exp(-3 * (t[-1] - t) / _REST)
    return np.asarray(eased - eased[0])
