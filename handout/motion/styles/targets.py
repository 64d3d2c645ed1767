"""Finds the targets of a drawn path: its ends, its corners, and the points at which it runs upright or level.

A circle has no extreme of curvature to place a target at, but like every curve it has a top, a left, a bottom and a
right.

Source: seed 003, §4 (there at extremes of curvature); extremes of the curves, evenly spaced: own method.
"""

from __future__ import annotations

from bisect import bisect
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.libraries import ndimage
from handout.values import Array, Drawing, Indices

_STEPS = 60  # samples in the height of a letter
_MOST = 40_000  # samples of a path
_SMOOTHED = 1.2  # samples over which a path's own noise is smoothed away
_ARM = 4  # samples on either side of a corner
_CORNER = np.radians(60)  # turning within the arms that makes one
_SOON = 0.09  # letter heights: of targets nearer to each other than this only one stays
_LONG = 0.62  # letter heights: targets further apart than this get another between them
_ROUND = 1.6  # times `_LONG`: how far apart the targets of a ring may be
USUAL_HEIGHT = 1.5  # x-heights: the usual size of unjoined letters, as in the built-in printed hand
_TURNS = 0.12  # of a stroke's height: shorter ways up or down do not count
_WORD = 6  # ways up and down: a stroke with as many is a word
_FLATTEST = 0.1  # of a stroke's longer side: the least size of a letter that it is taken for
_SMALL = 0.4  # of the letter height: a stroke's own size counts down to this
_DOT = 0.06  # heights: a path of no more extent is a dot
_NEAR = 0.2  # heights between the end of a ring and its beginning
_TIP = 0.4  # heights at either end of a ring that may stick out


@dataclass(frozen=True, eq=False)
class Motif:
    """A stroke without its style: its path and its targets.

    path : (n, 2) float, mm: evenly sampled.
    points : (m, 2) float, mm: its targets, in order.
    corner : (m,) bool: which targets are corners.
    bends : (k,) int: samples of the path that are its corners.
    ring : whether it comes back to where it begins without a corner there; the first point then follows the last.
    """

    path: Array
    points: Array
    corner: NDArray[np.bool_]
    bends: Indices
    ring: bool = False


def letter_height(drawing: Drawing) -> float:
    """The usual size of a letter, mm.

    If the drawing states its x-height (`about["x_height"]`, mm), 1.5 times that; else the median size of its strokes,
    weighted by length.  A stroke that goes up and down many times is a word: its ways up and down give its size.

    Raises ValueError: no strokes.
    """
    x_height = drawing.about.get("x_height")
    if isinstance(x_height, int | float) and 0 < x_height <= max(drawing.page.width, drawing.page.height):
        return USUAL_HEIGHT * float(x_height)
    sizes = [_size(stroke.xy) for stroke in drawing.strokes]
    weights = [stroke.length for stroke in drawing.strokes]
    if not sizes:
        raise ValueError("a drawing without strokes has no letters")
    if not max(weights) > 0:
        return max(max(drawing.page.width, drawing.page.height) / 10, 1.0)
    order = np.argsort(sizes)
    share = np.cumsum(np.array(weights)[order])
    return max(float(np.array(sizes)[order][np.searchsorted(share, 0.5 * share[-1])]), 1e-3)


def _size(xy: Array) -> float:
    """mm: the larger side of a plain stroke, the height of one that turns to and fro, the letter height of a word."""
    wide, high = (float(side) for side in np.ptp(xy, axis=0))
    size = max(wide, high)
    if float(np.linalg.norm(np.diff(xy, axis=0), axis=1).sum()) <= 1.8 * size:
        return size
    # lengths of the ways up and down; turning back by less than `least` does not end one
    y, least = xy[:, 1], _TURNS * high
    turns = [float(y[0])]
    extreme, way = float(y[0]), 0
    for value in y.tolist():
        if way * (value - extreme) >= 0 and way:
            extreme = value
        elif abs(value - extreme) >= least > 0:
            turns.append(extreme)
            extreme, way = value, 1 if value > extreme else -1
    runs = np.abs(np.diff([*turns[1:], extreme]))
    if len(runs) >= _WORD:
        high = min(high, USUAL_HEIGHT * float(np.median(runs)))
    return max(min(high, 2 * wide), _FLATTEST * size)


def find(xy: Array, height: float) -> Motif:
    """The targets of a path (n, 2), in a drawing whose letters have that height (mm)."""
    away = np.linalg.norm(np.diff(xy, axis=0), axis=1)
    if float(np.ptp(xy, axis=0).max()) <= _DOT * height:
        middle = 0.5 * (xy.min(axis=0) + xy.max(axis=0))
        return Motif(middle[None], middle[None], np.array([True]), np.zeros(0, dtype=np.intp))
    # sampled evenly and smoothed a little
    along = np.concatenate([[0.0], np.cumsum(away)])
    count = int(np.clip(along[-1] / height * _STEPS, 8, _MOST)) + 1
    keep = np.concatenate([[True], away > 0])
    where = np.linspace(0.0, along[-1], count)
    even = np.column_stack([np.interp(where, along[keep], xy[keep, axis]) for axis in (0, 1)])
    path = ndimage.gaussian_filter1d(even, _SMOOTHED, axis=0, mode="nearest")
    path[0], path[-1] = even[0], even[-1]
    path, closed = _close_ring(path, height)
    ring = closed and not _has_corner(path)
    corners = _corners(path)
    ends = np.array([0, len(path) - 1])
    samples = np.unique(np.concatenate([[] if ring else ends, corners, _extremes(path)]).astype(np.intp))
    # the targets of a small letter lie closer together
    unit = float(np.clip(_size(xy), _SMALL * height, height)) / _step(path)
    if ring:
        # once round and back to the first, filled; at least three
        spaced, count = _space_targets(samples, corners, samples[:0], _SOON * unit), len(path) - 1
        spaced = spaced if len(spaced) else np.zeros(1, dtype=np.intp)
        turn = np.concatenate([spaced, spaced[:1] + count])
        places = np.unique(_fill_gaps(turn, min(_ROUND * (_LONG * unit), count / 3))[:-1] % count)
    else:
        places = _fill_gaps(_space_targets(samples, corners, ends, _SOON * unit), _LONG * unit)
    return Motif(path, path[places], np.isin(places, corners), corners, ring)


def _step(path: Array) -> float:
    """mm from one sample to the next."""
    return float(np.median(np.linalg.norm(np.diff(path, axis=0), axis=1))) or 1.0


def _close_ring(path: Array, height: float) -> tuple[Array, bool]:
    """The path, and whether it comes back to its beginning: then it is closed there.

    Short ends that stick out beyond the place where it closes are cut off.
    """
    step = _step(path)
    reach = min(int(_TIP * height / step), len(path) // 4)
    if len(path) * step < 4 * _NEAR * height or reach < 1:
        return path, False
    gap = np.linalg.norm(path[:reach, None] - path[None, -reach:], axis=2)
    first, last = np.unravel_index(int(gap.argmin()), gap.shape)
    if gap[first, last] > _NEAR * height:
        return path, False
    ring = path[first : len(path) - reach + last + 1]
    return ring - np.linspace(0.0, 1.0, len(ring))[:, None] ** 2 * (ring[-1] - ring[0]), True


def _has_corner(ring: Array) -> bool:
    """Whether a ring has a corner where it closes."""
    chord = np.stack([ring[-1] - ring[-1 - _ARM], ring[_ARM] - ring[0]]) @ np.array([1.0, 1j])
    return bool(np.abs(np.angle(chord[1] * np.conj(chord[0]))) > _CORNER)


def _corners(path: Array) -> Indices:
    """Samples where the path turns by more than `_CORNER` at once."""
    if len(path) < 2 * _ARM + 1:
        return np.zeros(0, dtype=np.intp)
    chord = (path[_ARM:] - path[:-_ARM]) @ np.array([1.0, 1j])
    turn = np.abs(np.angle(chord[_ARM:] * np.conj(chord[:-_ARM])))
    peak = np.flatnonzero(turn > _CORNER)
    groups = np.split(peak, np.flatnonzero(np.diff(peak) > 1) + 1) if len(peak) else []
    return np.array([int(group[turn[group].argmax()]) + _ARM for group in groups], dtype=np.intp)


def _extremes(path: Array) -> Indices:
    """Samples between corners at which the path runs upright or level."""
    extremes: list[int] = []
    bounds = [0, *_corners(path).tolist(), len(path) - 1]
    for low, high in pairwise(bounds):
        piece = path[low : high + 1]
        if len(piece) < 5:
            continue
        step = ndimage.gaussian_filter1d(np.diff(piece, axis=0), 2.0, axis=0, mode="nearest")
        quarter = np.unwrap(np.arctan2(step[:, 1], step[:, 0])) / (np.pi / 2)
        extremes += [low + at for at in _crossings(quarter)]
    return np.array(extremes, dtype=np.intp)


def _crossings(quarter: Array, slack: float = 0.12) -> list[int]:
    """Indices at which a sequence passes a whole number by more than `slack`."""
    crossings, side = [], None
    for at, value in enumerate(quarter.tolist()):
        near = round(value)
        if abs(value - near) < slack:
            continue
        now = int(np.floor(value))
        if side is not None and now != side:
            crossed = max(now, side) if abs(now - side) == 1 else near
            back = at
            while back > 0 and (quarter[back - 1] >= crossed) == (value >= crossed):
                back -= 1
            crossings.append(back)
        side = now
    return crossings


def _space_targets(samples: Indices, corners: Indices, ends: Indices, least: float) -> Indices:
    """Targets at least `least` samples apart; ends are chosen before corners, and corners before extremes."""
    rank = np.where(np.isin(samples, ends), 2, np.where(np.isin(samples, corners), 1, 0))
    places: list[int] = sorted(ends.tolist())
    for at in samples[np.lexsort((samples, -rank))].tolist():
        place = bisect(places, at)
        if all(abs(at - other) >= least for other in places[max(place - 1, 0) : place + 1]):
            places.insert(place, at)
    return np.array(places, dtype=np.intp)


def _fill_gaps(places: Indices, most: float) -> Indices:
    """The targets, with further ones evenly between those more than `most` samples apart."""
    parts = [np.linspace(a, b, int(np.ceil((b - a) / most)) + 1)[:-1] for a, b in pairwise(places.tolist())]
    return np.unique(np.rint(np.concatenate([*parts, places[-1:]])).astype(np.intp))
