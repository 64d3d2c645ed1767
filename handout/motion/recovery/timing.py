"""When the pen was where, on paths of which only the ink is known.

Source: seed 002, §3.1–3.2; see `pacing` for the speed along a path, `handout.motion.air` for the time between paths.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from handout.motion.air import in_the_air
from handout.motion.recovery.pacing import course, pace
from handout.motion.recovery.pages import Path
from handout.values import POSE, TURNS, Array, Stroke
from handout.writing.variation import USUAL

RATE = 140.0  # samples a second, as of the drawn hands' strokes
_STEP = 0.05  # mm between the places of a path while it is made even
_SMOOTH = 0.12  # mm: what pixels add to a path is shorter
_DWELL = 0.07  # s, of a dot


def strokes(
    paths: Sequence[Path],
    lines: Sequence[int],
    x_height: float,
    rng: np.random.Generator,
    *,
    speed: float = 1.0,
    jitter: float = 1.0,
) -> Iterator[Stroke]:
    """Timed strokes along some paths.

    Parameters
    ----------
    paths : in the order of writing; lines : of each, the number of its line on the page.
    x_height : mm.
    speed : 1 is a person's.
    jitter : scale of how much pauses and paces vary.
    """
    shapes = [_shape(path) for path in paths]
    hesitation = jitter * rng.standard_normal(len(paths))
    haste = np.exp(USUAL.pace * min(jitter, 2.0) * rng.standard_normal(len(paths)))
    clock, before = 0.0, np.zeros(2)
    for number, (t, xy, width, pose) in enumerate(_moved(paths, shapes, x_height)):
        path, t = paths[number], t * haste[number]
        if number:
            way = float(np.hypot(*(xy[0] - before))) / x_height
            line, word = lines[number] != lines[number - 1], path.word != paths[number - 1].word
            clock += in_the_air(way, line=line, word=word, chance=float(hesitation[number]))
        yield Stroke((clock + t) / speed, xy, **pose, width=width, word=path.word)
        clock, before = clock + float(t[-1]), xy[-1]


def _moved(
    paths: Sequence[Path], shapes: Sequence[tuple[Array, Array]], x_height: float
) -> Iterator[tuple[Array, Array, Array, dict[str, Any]]]:
    """t, from 0, xy, width and pose of every movement along a shape, evenly sampled in time."""
    long = [number for number, (xy, _) in enumerate(shapes) if len(xy) > 1]
    timed = pace(course([shapes[number][0] / x_height for number in long])) if long else None
    place = dict(zip(long, range(len(long)), strict=True))
    for number, (path, (xy, width)) in enumerate(zip(paths, shapes, strict=True)):
        held = _held(path)
        if timed is None or number not in place:
            dwelt = {name: np.repeat(values[:1], 2) for name, values in held.items()}
            yield np.array([0.0, _DWELL]), np.repeat(xy, 2, axis=0), np.repeat(width, 2), dwelt
            continue
        own = slice(*timed.first[place[number] : place[number] + 2].tolist())
        run, along = run_of(xy), timed.along[own] * x_height
        t = np.interp(run, along * (run[-1] / along[-1]), timed.t[own])
        raw = run_of(path.xy)
        at = np.linspace(0.0, raw[-1], len(xy))  # where on the path as it was found the places of the shape lie
        if path.steps is not None:
            t = _measured(t, at, raw, path.steps)
        times = np.linspace(0.0, t[-1], max(3, round(float(t[-1]) * RATE) + 1))
        channels = [np.interp(times, t, values) for values in (*xy.T, width)]
        pose = {name: np.interp(np.interp(times, t, at), raw, values) for name, values in held.items()}
        yield times, np.column_stack(channels[:2]), channels[2], pose


def run_of(xy: Array) -> Array:
    """(n,) mm: length of a path up to each of its places (n, 2)."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])


def _shape(path: Path) -> tuple[Array, Array]:
    """Places and widths along a path, evenly spaced, without what pixels add; of a dot only one."""
    run = run_of(path.xy)
    if run[-1] < _STEP:
        return path.xy[:1], path.width[:1]
    at = np.linspace(0.0, run[-1], max(3, round(run[-1] / _STEP) + 1))
    even = np.column_stack([np.interp(at, run, values) for values in (*path.xy.T, path.width)])
    smooth = smoothed(even, _SMOOTH / at[1])
    return smooth[:, :2], smooth[:, 2]


def _held(path: Path) -> dict[str, Array]:
    """How a recorded pen was held along a path, (n,) each; only what is known of some of it, angles without jumps."""
    if path.pose is None:
        return {}
    filled = {name: _filled(values) for name, values in zip(POSE, path.pose.T, strict=True)}
    return {name: np.unwrap(v) if name in TURNS else v for name, v in filled.items() if v is not None}


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
