"""How like the usual ways of writing a letter some ways over its line are: elastic matching of paths.

Source: dynamic time warping (Sakoe and Chiba 1978).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from handout.motion.recovery.models import Models, frame
from handout.values import Array

_PLACES = 48  # of a line that forms are compared with
_NEAR = 0.82  # of a letter's size: places so far apart are unlike
_FARTHEST = 3.6  # what it costs at most
_AIMED = 0.59  # cost of a right angle between directions
_OPEN = 0.4  # cost of every place on the way from another letter that is skipped
_MOST_OPEN = 0.5  # of a path
_LIFTED = 0.04  # of every lift that one has and the other has not


def fitting(letter: Models, xy: Array, most: int) -> tuple[Models, Array]:
    """The forms of a letter that lie nearest to a line, those of built-in hands before others, the nearest first.

    Parameters
    ----------
    xy : (n, 2) float, y up: places all over the letter's line.

    Returns
    -------
    Models : of `most` forms of each kind at most.
    (f, s, 2) float: these, laid over the line.
    """
    places = xy[:: max(1, len(xy) // _PLACES)]
    middle = xy.mean(axis=0)
    laid = letter.xy @ frame(xy - middle).T + middle
    flat = laid.reshape(-1, 2)
    apart = (flat**2).sum(axis=1)[:, None] + (places**2).sum(axis=1) - 2 * flat @ places.T
    away = np.sqrt(np.maximum(apart, 0.0)).reshape(*laid.shape[:2], -1)
    nearest = np.argsort(away.min(axis=2).mean(axis=1) + away.min(axis=1).mean(axis=1), kind="stable")
    own = letter.drawn[nearest]
    chosen = np.concatenate([nearest[own][:most], nearest[~own][:most]])
    return letter.take(chosen), laid[chosen]


def unlikeness(
    ways: Sequence[Sequence[Array]], letter: Models, laid: Array, *, entered: bool = False, left: bool = False
) -> Array:
    """How far each way of writing is from each form of a letter.

    Parameters
    ----------
    ways : for each its strokes, (n, 2) float, in order, y up.
    letter : Models of f forms; laid : (f, s, 2) float: these, laid over the letter.
    entered, left : whether the pen comes from another letter, and goes to one: the way from there need not be like.

    Returns
    -------
    (w, f) float ≥ 0: mean cost along both paths; about .2 for the same way of writing, 1 and more for others.
    """
    sampled = np.array([_evenly(strokes, laid.shape[1]) for strokes in ways])
    size = float(np.sqrt((sampled[0].std(axis=0) ** 2).sum()))
    lifts = np.array([len(strokes) for strokes in ways])[:, None] - letter.strokes
    opened, closed = (_OPEN if joined else np.inf for joined in (entered, left))
    return _warped(sampled, laid, max(size, 1e-9), opened, closed) + _LIFTED * np.abs(lifts)


def _evenly(strokes: Sequence[Array], count: int) -> Array:
    """(count, 2): places at even distances along some strokes; the way between two has no length."""
    xy = np.concatenate(strokes)
    step = xy[1:] - xy[:-1]
    run = np.empty(len(xy))
    run[0] = 0.0
    np.sqrt(step[:, 0] ** 2 + step[:, 1] ** 2 + 1e-18, out=run[1:])
    first = 0
    for stroke in strokes[:-1]:
        first += len(stroke)
        run[first] = 1e-9
    run = run.cumsum()
    at = np.linspace(0.0, run[-1], count)
    return np.stack([np.interp(at, run, xy[:, 0]), np.interp(at, run, xy[:, 1])], axis=1)


def aims(paths: Array) -> Array:
    """(…, s, 2): directions along paths (…, s, 2)."""
    step = np.empty_like(paths)
    step[..., 1:-1, :] = paths[..., 2:, :] - paths[..., :-2, :]
    step[..., 0, :], step[..., -1, :] = paths[..., 1, :] - paths[..., 0, :], paths[..., -1, :] - paths[..., -2, :]
    return np.asarray(step / np.maximum(np.hypot(step[..., 0], step[..., 1]), 1e-12)[..., None])


def _warped(ours: Array, theirs: Array, size: float, opened: float, closed: float) -> Array:
    """(w, f): least mean cost of going along two paths together, for paths (w, s, 2) and (f, s, 2)."""
    (ways, count), forms = ours.shape[:2], len(theirs)
    # diagonal by diagonal: row i + j has what place i of ours costs at place j of theirs
    skewed = np.full((2 * count - 1, ways * forms, count), np.inf, dtype=np.float32)
    row, pair, place = skewed.strides
    within = np.lib.stride_tricks.as_strided(skewed, (count, count, ways * forms), (row + place, row, pair))
    within[...] = _costs(ours, theirs, size)
    before2 = np.full((ways * forms, count + 1), np.inf, dtype=np.float32)
    before, here = before2.copy(), before2.copy()
    before[:, 1] = 2 * skewed[0, :, 0]
    least = np.full(ways * forms, np.inf, dtype=np.float32)
    for total, step in enumerate(skewed[1:], 1):
        # going on along one path only counts once, along both twice: all ways then have the same weight
        np.minimum(before[:, 1:], before[:, :-1], out=here[:, 1:])
        np.minimum(here[:, 1:], before2[:, :-1] + step, out=here[:, 1:])
        if total < _MOST_OPEN * count:
            np.minimum(here[:, total + 1], opened * np.float32(total) + step[:, total], out=here[:, total + 1])
        here[:, 1:] += step
        before2, before, here = before, here, before2
        left = 2 * count - 2 - total
        if left < _MOST_OPEN * count:
            np.minimum(
                least, before[:, count - left] + closed * np.float32(left) if left else before[:, count], out=least
            )
    return np.asarray(least.reshape(ways, forms) / (2 * count), dtype=np.float64)


def _costs(ours: Array, theirs: Array, size: float) -> NDArray[np.float32]:
    """(s, s, w · f): of every place of one path at every place of the other."""
    (ways, count), forms = ours.shape[:2], len(theirs)
    middle = ours[0].mean(axis=0)
    scale = 1 / (size * _NEAR)
    a = np.ascontiguousarray(((ours - middle) * scale).transpose(1, 0, 2), dtype=np.float32).reshape(-1, 2)
    b = np.ascontiguousarray(((theirs - middle) * scale).transpose(1, 0, 2), dtype=np.float32).reshape(-1, 2)
    aim_a = np.ascontiguousarray(aims(ours).transpose(1, 0, 2), dtype=np.float32).reshape(-1, 2)
    aim_b = np.ascontiguousarray(aims(theirs).transpose(1, 0, 2), dtype=np.float32).reshape(-1, 2)
    cost = a @ (-2 * b.T)
    cost += (a**2).sum(axis=1)[:, None]
    cost += (b**2).sum(axis=1)
    np.minimum(cost, np.float32(_FARTHEST), out=cost)
    cost += np.float32(_AIMED)
    cost -= np.float32(_AIMED) * (aim_a @ aim_b.T)
    return cost.reshape(count, ways, count, forms).transpose(0, 2, 1, 3).reshape(count, count, ways * forms)
