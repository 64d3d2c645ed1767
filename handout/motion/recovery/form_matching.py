"""How far ways of writing a letter are from its forms: elastic matching of paths by dynamic time warping.

Source: Sakoe and Chiba 1978.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from handout.motion.recovery import letter_forms
from handout.motion.recovery.letter_forms import LetterForms, frame_of
from handout.values import Array

_PLACES = 48  # of a line that forms are compared with
_MOST_OPEN = 0.5  # of a path, at most, is skipped on the way from or to another letter


def nearest_forms(forms: LetterForms, xy: Array, most: int) -> tuple[LetterForms, Array]:
    """The forms of a letter that lie nearest to a line, those of built-in hands before others, the nearest first.

    xy : (n, 2) float, y up: places all over the letter's line.

    Returns LetterForms : of `most` forms of each kind at most.
    (f, s, 2) float: these, laid over the line.
    """
    places = xy[:: max(1, len(xy) // _PLACES)]
    middle = xy.mean(axis=0)
    laid = forms.xy @ frame_of(xy - middle).T + middle
    flat = laid.reshape(-1, 2)
    apart = (flat**2).sum(axis=1)[:, None] + (places**2).sum(axis=1)
    apart += (-2 * flat) @ places.T
    square = apart.reshape(*laid.shape[:2], -1)
    there, back = (np.sqrt(np.maximum(square.min(axis=k), 0.0)).mean(axis=1) for k in (2, 1))
    nearest = np.argsort(there + back, kind="stable")
    drawn = forms.drawn[nearest]
    chosen = np.concatenate([nearest[drawn][:most], nearest[~drawn][:most]])
    return forms.take(chosen), laid[chosen]


def form_distances(
    ways: Sequence[Sequence[Array]], forms: LetterForms, laid: Array, *, entered: bool = False, left: bool = False
) -> Array:
    """How far each way of writing is from each form of a letter.

    ways : for each its strokes, (n, 2) float, in order, y up.
    forms : LetterForms, f of them; laid : (f, s, 2) float: these, laid over the letter.
    entered, left : whether the pen comes from another letter, and goes to one: the way from there need not be like.

    Returns (w, f) float ≥ 0: mean cost along both paths; about .2 for the same way of writing, 1 and more for others.
    """
    weights = letter_forms.WEIGHTS
    sampled = _evenly(ways, laid.shape[1])
    size = float(np.sqrt((sampled[0].std(axis=0) ** 2).sum()))
    lifts = np.array([len(strokes) for strokes in ways])[:, None] - forms.strokes
    opened, closed = (weights.open if joined else np.inf for joined in (entered, left))
    return _warp_paths(sampled, laid, max(size, 1e-9), opened, closed) + weights.lifted * np.abs(lifts)


def _evenly(ways: Sequence[Sequence[Array]], count: int) -> Array:
    """(w, count, 2): places at even distances along the strokes of each way; that between two has no length."""
    xy = np.concatenate([stroke for strokes in ways for stroke in strokes])
    begin = np.cumsum([0, *(len(stroke) for strokes in ways for stroke in strokes)])
    first = begin[np.cumsum([0, *map(len, ways)])]
    step = np.empty(len(xy))
    moved = xy[1:] - xy[:-1]
    np.sqrt(moved[:, 0] ** 2 + moved[:, 1] ** 2 + 1e-18, out=step[1:])
    step[begin[:-1]] = 1e-9
    # all ways lie one behind the other, apart
    step[first[:-1]] = 1.0
    run = step.cumsum()
    low, high = run[first[:-1]], run[first[1:] - 1]
    at = low[:, None] + ((high - low) / (count - 1))[:, None] * np.arange(count)
    at[:, -1] = high
    places = np.empty((*at.shape, 2))
    places[..., 0], places[..., 1] = np.interp(at, run, xy[:, 0]), np.interp(at, run, xy[:, 1])
    return places


def directions(paths: Array) -> Array:
    """(…, s, 2): directions along paths (…, s, 2)."""
    step = np.empty_like(paths)
    step[..., 1:-1, :] = paths[..., 2:, :] - paths[..., :-2, :]
    step[..., 0, :], step[..., -1, :] = paths[..., 1, :] - paths[..., 0, :], paths[..., -1, :] - paths[..., -2, :]
    return np.asarray(step / np.maximum(np.hypot(step[..., 0], step[..., 1]), 1e-12)[..., None])


def _warp_paths(ours: Array, theirs: Array, size: float, opened: float, closed: float) -> Array:
    """(w, f): least mean cost of going along two paths together, for paths (w, s, 2) and (f, s, 2)."""
    (ways, count), forms = ours.shape[:2], len(theirs)
    costs = _costs(ours, theirs, size)
    before2 = np.full((count + 1, ways * forms), np.inf, dtype=np.float32)
    before, here = before2.copy(), before2.copy()
    before[1] = 2 * costs[0, 0]
    # of skipping so many places, and of what may then begin or have ceased
    most = int(np.ceil(_MOST_OPEN * count))
    skipped = np.arange(most, dtype=np.float32)[:, None]
    entries = (
        np.float32(opened) * skipped + costs[np.arange(most), np.arange(most)] if opened < np.inf else costs[0, :0]
    )
    exits = np.empty((most, ways * forms), dtype=np.float32)
    for total in range(1, 2 * count - 1):
        # diagonal by diagonal: what place i of ours costs at place total - i of theirs
        low, high = max(0, total - count + 1), min(total, count - 1) + 1
        step = costs[total, low:high]
        # going on along one path only counts once, along both twice: all ways then have the same weight
        now = here[low + 1 : high + 1]
        np.add(before2[low:high], step, out=now)
        np.minimum(now, before[low + 1 : high + 1], out=now)
        np.minimum(now, before[low:high], out=now)
        if total < len(entries):
            np.minimum(now[-1], entries[total], out=now[-1])
        now += step
        before2, before, here = before, here, before2
        left = 2 * count - 2 - total
        if left < most:
            exits[left] = before[count - left]
    if closed < np.inf:
        exits += np.float32(closed) * skipped
        exits[0] = exits.min(axis=0)
    return np.asarray(exits[0].reshape(forms, ways).T / (2 * count), dtype=np.float64)


def _costs(ours: Array, theirs: Array, size: float) -> NDArray[np.float32]:
    """(2 s - 1, s, f · w): of place i of one path at place k - i of the other, at [k, i], where there are both."""
    (ways, count), forms = ours.shape[:2], len(theirs)
    weights = letter_forms.WEIGHTS
    middle = ours[0].mean(axis=0)
    scale = 1 / (size * weights.near)
    a, aim_a = (_by_place(values) for values in ((ours - middle) * scale, directions(ours)))
    b, aim_b = (_by_place(values) for values in ((theirs - middle) * scale, directions(theirs)))
    # squared distance and, once that is cut off, what the directions add: each in one product
    free = np.float32(weights.aimed)
    one_a, one_b = np.ones((len(a), 1), np.float32), np.ones((len(b), 1), np.float32)
    square_a, square_b = ((values**2).sum(axis=1, keepdims=True) for values in (a, b))
    cost = np.hstack([b, square_b + free, one_b]) @ np.hstack([-2 * a, one_a, square_a]).T
    np.minimum(cost, np.float32(weights.farthest) + free, out=cost)
    cost += (-free * aim_b) @ aim_a.T
    # every pair of paths beside the next, and what a step needs together: a view in which i and k - i count
    pairs = np.empty((2 * count - 1, count, forms * ways), dtype=np.float32)
    down, across, along = pairs.strides
    view = as_strided(pairs, (count, count, forms, ways), (down + across, down, along * ways, along))
    view[...] = cost.reshape(count, forms, count, ways).transpose(2, 0, 1, 3)
    return pairs


def _by_place(paths: Array) -> NDArray[np.float32]:
    """(s · k, 2) of paths (k, s, 2)."""
    return np.ascontiguousarray(paths.transpose(1, 0, 2), dtype=np.float32).reshape(-1, 2)
