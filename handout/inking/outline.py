"""Marks as outlines, for outputs made of lines: what a pen of changing width, or a flat nib, covers; and scanned ink.

The mark of a stroke is the union of its pieces, none of which has a hole.  A flat nib is an edge that is moved without
turning against the page, so that the mark's width follows its direction; for outputs of pixels it is many round points.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from handout.inking.curves import Curve
from handout.inking.mixing import passed_light
from handout.libraries import cv2, spatial
from handout.values import NIB_THICKNESS, Array, Drawing, Indices, Raster, Stroke

_POINTS_APART = 0.3  # of the thickness: distance of the points that stand for an edge
_THINNEST_PIXELS = 1.5  # pixels of the thickness
_MOST_POINTS = 400  # points


def edge(stroke: Stroke) -> Array:
    """(n, 2) float, mm: from the middle of a flat nib to the end of its edge, at each sample."""
    assert stroke.rotation is not None
    half_edge = 0.5 * (1 - NIB_THICKNESS) * stroke.nib
    return half_edge * np.column_stack([np.cos(stroke.rotation), np.sin(stroke.rotation)])


def round_strokes(drawing: Drawing, scale: float) -> Drawing:
    """The drawing with every stroke of a flat nib as many of a round point, side by side, at `scale` pixels a mm."""
    if not any(stroke.nib > 0 for stroke in drawing.strokes):
        return drawing
    return replace(drawing, strokes=tuple(part for stroke in drawing.strokes for part in _points(stroke, scale)))


def _points(stroke: Stroke, scale: float) -> Iterator[Stroke]:
    if not stroke.nib > 0:
        yield stroke
        return
    thick = max(NIB_THICKNESS * stroke.nib, _THINNEST_PIXELS / scale)
    count = min(max(math.ceil(stroke.nib / (_POINTS_APART * thick)), 2), _MOST_POINTS)
    reach = edge(stroke)
    for share in np.linspace(-1, 1, count):
        yield replace(stroke, xy=stroke.xy + share * reach, width=np.full(len(stroke.t), thick), nib=0.0)


_FLAT = 0.02  # mm between a curve and its chords
_ROUND = 0.008  # mm between a disc and its corners' chords
_MOST_CHORDS = 24  # chords of one Bézier
_TURNED = np.radians(60)  # a part of the mark turns by no more
_CORNER = np.radians(25)  # between two chords: a part ends there
_STILL = 1e-4  # mm between two places that are one
_THINNEST = 0.02  # mm


def reach(stroke: Stroke) -> float:
    """mm: width of an even line that covers all of the mark, and whose own edges stay clear of it."""
    assert stroke.width is not None or stroke.nib > 0
    widest = 0.0 if stroke.width is None else float(stroke.width.max())
    return 1.3 * max(widest, stroke.nib, _THINNEST)


def pieces(stroke: Stroke, curve: Curve) -> list[Array]:
    """Closed polygons (k, 2), mm, all turning the same way; the mark of the stroke is their union."""
    if stroke.nib > 0:
        return _sweep_nib(stroke, curve)
    t = _times(curve)
    place = curve.places_at(t)
    moved = np.concatenate([[True], np.hypot(*np.diff(place, axis=0).T) > _STILL])
    t, place = t[moved], place[moved]
    if len(t) < 2:  # a dot is as wide as the pen ever was on it
        return _discs(curve.points[:1], _radii(stroke, stroke.t).max(keepdims=True))
    # parts begin and end where they have turned so far that their sides would cross
    step = np.diff(place, axis=0) @ np.array([1.0, 1j])
    turn = np.abs(np.angle(step[1:] * np.conj(step[:-1])))
    cuts, turned = [0], 0.0
    for at, angle in enumerate(turn.tolist(), 1):
        turned += angle
        if angle > _CORNER or turned > _TURNED:
            cuts.append(at)
            turned = 0.0
    radius, ends = _radii(stroke, t), np.array([*cuts, len(place) - 1])
    return [*_ribbons(place, radius, ends), *_discs(place[ends], radius[ends])]


def _radii(stroke: Stroke, t: Array) -> Array:
    assert stroke.width is not None
    return np.asarray(np.maximum(np.interp(t, stroke.t, stroke.width), _THINNEST) / 2)


def _times(curve: Curve) -> Array:
    """Times at which a curve is cut into chords, rising."""
    if len(curve.t) < 2:
        return curve.t
    control = np.stack([curve.points[j : len(curve.points) - 3 + j : 3] for j in range(3)] + [curve.points[3::3]])
    bend = np.abs(np.diff(control, n=2, axis=0)).max(axis=(0, 2))
    count = np.clip(np.ceil(np.sqrt(0.75 * bend / _FLAT)), 1, _MOST_CHORDS).astype(np.intp)
    step = np.diff(curve.t) / count
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.unique(np.append(number * np.repeat(step, count) + np.repeat(curve.t[:-1], count), curve.t[-1]))


def _ribbons(place: Array, radius: Array, ends: Indices) -> list[Array]:
    """The parts of a curve with its width, each along its left and back along its right."""
    size = np.diff(ends) + 1
    first = np.cumsum(size) - size
    vertex = np.arange(size.sum()) + np.repeat(ends[:-1] - first, size)
    # at its ends a part goes as its first and its last chord do
    before = np.maximum(vertex - 1, np.repeat(ends[:-1], size))
    after = np.minimum(vertex + 1, np.repeat(ends[1:], size))
    way = (place[after] - place[before]) / (after - before)[:, None]
    normal = way[:, ::-1] * [-1.0, 1.0] / np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-12)[:, None]
    aside = normal * radius[vertex][:, None]
    left, right = place[vertex] + aside, place[vertex] - aside
    parts = [slice(a, a + n) for a, n in zip(first.tolist(), size.tolist(), strict=True)]
    return [_orient(np.concatenate([left[part], right[part][::-1]])) for part in parts]


def _sweep_nib(stroke: Stroke, curve: Curve) -> list[Array]:
    """The ways of a flat nib's edge along the chords of a curve."""
    t = _times(curve)
    edges = np.column_stack([np.interp(t, stroke.t, side) for side in edge(stroke).T])
    place = curve.places_at(t)
    if len(t) == 1:
        t, edges, place = np.repeat(t, 2), np.repeat(edges, 2, axis=0), np.repeat(place, 2, axis=0)
    along = edges / np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), 1e-12)
    thick = along[:, ::-1] * [-0.5, 0.5] * max(NIB_THICKNESS * stroke.nib, _THINNEST)
    corners = np.stack([place + a * edges + b * thick for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))], axis=1)
    hulls = []
    for before, after in pairwise(corners):
        both = np.concatenate([before, after])
        hulls.append(_orient(both[spatial.ConvexHull(both).vertices]))
    return hulls


def _discs(places: Array, radii: Array) -> list[Array]:
    """Discs about places (n, 2), of radii (n,)."""
    count = np.clip(np.ceil(np.pi / np.arccos(np.maximum(1 - _ROUND / radii, 0.0))), 6, 48).astype(np.intp)
    last = np.cumsum(count)
    angle = (np.arange(last[-1]) - np.repeat(last - count, count)) * np.repeat(2 * np.pi / count, count)
    corners = np.repeat(radii, count)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.split(np.repeat(places, count, axis=0) + corners, last[:-1])


def _orient(polygon: Array) -> Array:
    """The polygon, turning the way discs do."""
    x, y = polygon.T
    twice = float(x[:-1] @ y[1:] - y[:-1] @ x[1:] + x[-1] * y[0] - y[-1] * x[0])
    return polygon if twice >= 0 else polygon[::-1]


_HALF = 0.5  # of the ink about a place: where there is as much is an edge
_ABOUT = 0.35  # mm about a place, half of a wide ballpoint's line and more
_PALEST = 0.15  # of alpha: less is no ink; set by eye, on the two shipped scanned hands
_EDGE = 0.01  # mm between the edge of ink and its outline
_SMALLEST = 0.01  # mm², of an outline; set by eye: grain of the paper is smaller
_VOTES = 500  # that all ink has together when its colours are told apart, and each piece one at least
_SHARE = 0.02  # of the pieces: a colour of fewer is no ink of its own


def areas(raster: Raster) -> list[tuple[str, list[Array]]]:
    """The edges of scanned ink.

    Returns list of (colour, outlines): for each ink, the one there is most of first: the mean colour in which it is
    seen on white, ``"#rrggbb"``, and closed outlines (n, 2), mm on the page, the last point the first; those of holes
    turn the other way.

    Source: own method.  A pale line is as wide as a dark one: its edge is where there is half as much ink as in the
    middle of the line, found between pixels by linear interpolation (marching squares).
    """
    from skimage.measure import find_contours

    scale = raster.dpi / 25.4
    alpha = np.pad(raster.rgba[..., 3] / np.float32(255), 1)
    size = 2 * max(round(_ABOUT * scale), 1) + 1
    most = cv2.GaussianBlur(cv2.dilate(alpha, np.ones((size, size), np.uint8)), (size, size), 0)
    share = alpha / np.maximum(most, _PALEST)
    contours: Any = find_contours  # it has no types
    edges = [edge for edge in contours(share, _HALF) if len(edge) > 3]
    # a pixel's middle lies half a pixel from its corner, and there is one pixel of padding
    places = [(edge[:, ::-1] - 0.5) / scale + raster.origin for edge in edges]
    # mm² of each, below 0 where it turns the other way
    areas = [float(x[:-1] @ y[1:] - y[:-1] @ x[1:]) / 2 for x, y in (place.T for place in places)]
    kept = [at for at, area in enumerate(areas) if abs(area) >= _SMALLEST]
    if not kept:
        return []
    count, label = cv2.connectedComponents((share > _HALF).astype(np.uint8), connectivity=4)
    ink, colours = _inks(raster, label[1:-1, 1:-1].astype(np.intp), count)
    found: dict[int, list[Array]] = {}
    for at in kept:
        corners = np.stack([np.floor(edges[at][0]), np.ceil(edges[at][0])]).astype(int)
        piece = int(label[corners[:, 0], corners[:, 1]].max())
        simple = cv2.approxPolyDP(places[at].astype(np.float32)[:, None], _EDGE, closed=True)[:, 0].astype(np.float64)
        if len(simple) > 2:
            found.setdefault(int(ink[piece]), []).append(np.concatenate([simple, simple[:1]]))
    return [(colours[number], found[number]) for number in sorted(found)]


def _inks(raster: Raster, label: Indices, count: int) -> tuple[Indices, list[str]]:
    """Which ink each of `count` pieces, whose numbers `label` (h, w) has, is of (0 is none), and the inks' colours."""
    taken = 1 - passed_light(raster.rgba.reshape(-1, 4))  # of the white of the paper
    size = np.bincount(label.ravel(), minlength=count)[1:]
    sums = np.stack([np.bincount(label.ravel(), taken[:, k], count)[1:] for k in range(3)], axis=1)
    way = sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-9)
    votes = np.ceil(_VOTES * size / size.sum()).astype(np.intp)
    from handout import hues

    kind = hues.kinds(np.repeat(way, votes, axis=0), _SHARE)[np.cumsum(votes) - 1]
    amount = np.bincount(kind, size)
    rank = np.argsort(np.argsort(-amount))
    colours = [""] * len(amount)
    for number in np.flatnonzero(amount):
        shade = 1 - sums[kind == number].sum(axis=0) / amount[number]
        colours[rank[number]] = "#{:02x}{:02x}{:02x}".format(*np.rint(255 * np.clip(shade, 0, 1)).astype(int))
    return np.concatenate([[0], rank[kind]]), colours
