"""The mark of a stroke as outlines: what a pen of changing width, or a flat nib, covers; for outputs made of lines.

The mark is the union of its pieces, none of which has a hole.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.spatial import ConvexHull

from handout.inking import nibs
from handout.inking.curves import Curve
from handout.values import NIB_THICKNESS, Array, Stroke

_VARIES = 0.08  # of the width: what varies less is an even line
_FLAT = 0.02  # mm between a curve and its chords
_ROUND = 0.008  # mm between a disc and its corners' chords
_MOST = 24  # chords of one Bézier
_TURNED = np.radians(60)  # a part of the mark turns by no more
_CORNER = np.radians(25)  # between two chords: a part ends there
_STILL = 1e-4  # mm between two places that are one
_THINNEST = 0.02  # mm


def needed(stroke: Stroke) -> bool:
    """Whether a line of even width would not do for the stroke's mark."""
    if stroke.nib > 0:
        return True
    return stroke.width is not None and float(np.ptp(stroke.width)) > _VARIES * max(float(stroke.width.mean()), 1e-9)


def reach(stroke: Stroke) -> float:
    """mm: width of an even line that covers all of the mark, and whose own edges stay clear of it."""
    assert stroke.width is not None or stroke.nib > 0
    widest = 0.0 if stroke.width is None else float(stroke.width.max())
    return 1.3 * max(widest, stroke.nib, _THINNEST)


def pieces(stroke: Stroke, curve: Curve) -> list[Array]:
    """Closed polygons (k, 2), mm, all turning the same way; the mark of the stroke is their union."""
    if stroke.nib > 0:
        return _swept(stroke, curve)
    ribbons = _ribbons(stroke, curve)
    if not ribbons:  # a dot is as wide as the pen ever was on it
        return [_disc(curve.points[0], float(_radii(stroke, stroke.t).max()))]
    ends = [curve.points[0], *(place[-1] for place, _ in ribbons)]
    times = [curve.t[0], *(t[-1] for _, t in ribbons)]
    discs = [_disc(place, radius) for place, radius in zip(ends, _radii(stroke, np.array(times)), strict=True)]
    return [*(_ribbon(place, _radii(stroke, t)) for place, t in ribbons), *discs]


def _ribbons(stroke: Stroke, curve: Curve) -> list[tuple[Array, Array]]:
    """Parts of a curve, as places (k, 2) and times (k,), none of which turns so far that its sides cross."""
    if len(curve.t) < 2:
        return []
    t = np.unique(np.concatenate([_times(curve, k) for k in range(len(curve.t) - 1)]))
    place = curve.at(t)
    moved = np.concatenate([[True], np.linalg.norm(np.diff(place, axis=0), axis=1) > _STILL])
    t, place = t[moved], place[moved]
    if len(t) < 2:
        return []
    step = np.diff(place, axis=0) @ np.array([1.0, 1j])
    turn = np.abs(np.angle(step[1:] * np.conj(step[:-1])))
    parts, first, turned = [], 0, 0.0
    for at, angle in enumerate(turn.tolist(), 1):
        turned += angle
        if angle > _CORNER or turned > _TURNED:
            parts.append((place[first : at + 1], t[first : at + 1]))
            first, turned = at, 0.0
    return [*parts, (place[first:], t[first:])]


def _radii(stroke: Stroke, t: Array) -> Array:
    assert stroke.width is not None
    return np.asarray(np.maximum(np.interp(t, stroke.t, stroke.width), _THINNEST) / 2)


def _times(curve: Curve, k: int) -> Array:
    """Times at which the k-th Bézier is cut into chords."""
    control = curve.points[3 * k : 3 * k + 4]
    bend = float(np.abs(np.diff(control, n=2, axis=0)).max())
    count = int(np.clip(np.ceil(np.sqrt(0.75 * bend / _FLAT)), 1, _MOST))
    return np.linspace(curve.t[k], curve.t[k + 1], count + 1)


def _ribbon(place: Array, radius: Array) -> Array:
    """A part of a curve with its width: along its left, and back along its right."""
    way = np.gradient(place, axis=0)
    normal = way[:, ::-1] * [-1.0, 1.0] / np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-12)[:, None]
    aside = normal * radius[:, None]
    return _turned(np.concatenate([place + aside, (place - aside)[::-1]]))


def _swept(stroke: Stroke, curve: Curve) -> list[Array]:
    """The ways of a flat nib's edge along the chords of a curve."""
    if len(curve.t) < 2:
        t = curve.t
    else:
        t = np.unique(np.concatenate([_times(curve, k) for k in range(len(curve.t) - 1)]))
    edges = np.column_stack([np.interp(t, stroke.t, side) for side in nibs.edge(stroke).T])
    place = curve.at(t)
    if len(t) == 1:
        t, edges, place = np.repeat(t, 2), np.repeat(edges, 2, axis=0), np.repeat(place, 2, axis=0)
    along = edges / np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), 1e-12)
    thick = along[:, ::-1] * [-0.5, 0.5] * max(NIB_THICKNESS * stroke.nib, _THINNEST)
    corners = np.stack([place + a * edges + b * thick for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))], axis=1)
    found = []
    for before, after in pairwise(corners):
        both = np.concatenate([before, after])
        found.append(_turned(both[ConvexHull(both).vertices]))
    return found


def _disc(place: Array, radius: float) -> Array:
    count = int(np.clip(np.ceil(np.pi / np.arccos(max(1 - _ROUND / radius, 0.0))), 6, 48))
    angle = np.arange(count) * (2 * np.pi / count)
    return np.asarray(place + radius * np.column_stack([np.cos(angle), np.sin(angle)]))


def _turned(polygon: Array) -> Array:
    """The polygon, turning the way discs do."""
    x, y = polygon.T
    return polygon if float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) >= 0 else polygon[::-1]
