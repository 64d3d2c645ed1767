"""Layers: each glyph's ink on the page that is written, and the seams between two layers that show the same line.

A seam does not show: left of it the one layer is seen, right of it the other.

Source: seed 000, §6.5; Kwatra, Schödl, Essa, Turk & Bobick 2003, Graphcut textures, §3.1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.scanning.graph_cut import minimum_cut
from handout.values import Array


@dataclass(frozen=True, eq=False)
class GlyphLayer:
    """The ink of one glyph.

    rgba : (h, w, 4) float32, premultiplied.
    near : (h, w) int32: number of the nearest vertex, −1 where the line is out of reach.
    corner : (x, y) of its first pixel on the page.
    xy : (n, 2) float, pixels of the page: vertices of the line.
    radius : (n,) float, pixels.
    twice : (n,) complex: direction of the line, its angle doubled; shorter than 1 where there are several.
    loose : (n,) bool: ends of lines.
    """

    rgba: NDArray[np.float32]
    near: NDArray[np.int32]
    corner: tuple[int, int]
    xy: Array
    radius: Array
    twice: NDArray[np.complex128]
    loose: NDArray[np.bool_]

    def view(self, window: tuple[int, int, int, int]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Ink and nearest vertices in a window (left, top, right, bottom) of the page that lies within the layer."""
        left, top, right, bottom = window
        (x, y) = self.corner
        part = np.s_[top - y : bottom - y, left - x : right - x]
        return self.rgba[part], self.near[part]


_FINE = 64.0  # capacities become whole numbers: so much finer than they would
_NEAR, _OF_RADIUS = 1.5, 0.3  # pixels, and share of the radius, within which two lines are one
_ONE = 0.02  # pixels within which two vertices are one
_ENDING = 0.5  # radii before its end where a line gives way to one that goes on
_ALIKE = 0.5  # cosine of twice the angle between them, at least

_Mask = NDArray[np.bool_]
_Pixels = NDArray[np.floating[Any]]


def seam(a: _Pixels, b: _Pixels, both: _Mask, to_a: _Mask, to_b: _Mask) -> _Mask:
    """Which pixels of an overlap are taken from the layer `b`, so that the seam costs least.

    The cost of a seam between neighbours s and t is ‖a(s) − b(s)‖ + ‖a(t) − b(t)‖.

    Parameters
    ----------
    a, b : (h, w, 4) float, premultiplied.
    both : (h, w) bool: the overlap.
    to_a, to_b : (h, w) bool: pixels of it that are settled.

    Notes
    -----
    The change of luma between s and t, which some add to the cost so that seams rather run where nothing is cut, was
    tried with weight 2 and left out.  It moves few pixels, and those for the worse: along a ligature the seam then
    keeps to the flank of the stroke instead of crossing it, which leaves steps along the edge and ends of strokes cut
    off square.

    Source: Kwatra et al. 2003, eq. 1.
    """
    at = np.flatnonzero(both)
    apart = np.zeros(both.shape, dtype=a.dtype)
    apart[both] = np.sqrt(((a.reshape(-1, a.shape[2])[at] - b.reshape(-1, b.shape[2])[at]) ** 2).sum(axis=1))
    number = np.full(both.shape, -1, dtype=np.intp)
    number[both] = np.arange(len(at))
    pairs, prices = [], []
    for left, right in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        edge = both[left] & both[right]
        pairs.append(np.stack([number[left][edge], number[right][edge]]))
        prices.append(apart[left][edge] + apart[right][edge])
    (first, second), price = np.concatenate(pairs, axis=1), np.concatenate(prices).astype(np.float64) * _FINE
    sure = np.bincount(first, price, len(at)) + np.bincount(second, price, len(at)) + 1
    cost = sure * (to_a[both].astype(np.float64) - to_b[both])
    from_a = np.zeros(both.shape, dtype=bool)
    from_a[both] = minimum_cut(cost, first, second, price)
    return from_a


def part_layers(a: GlyphLayer, b: GlyphLayer) -> tuple[GlyphLayer, GlyphLayer]:
    """Two layers of which one goes on where the other ends: what both show is left to one of them, pixel by pixel.

    Both show the same line where their vertices lie on each other and lead the same way.  Of the pixels of that line
    those beside the rest of either layer are its own, and where a line ends in one layer only, the other has it;
    between them runs the seam.
    """
    # the smallest window of the page that holds what the layers share
    left, top = (max(a.corner[k], b.corner[k]) for k in (0, 1))
    right, bottom = (min(layer.corner[k] + layer.near.shape[1 - k] for layer in (a, b)) for k in (0, 1))
    if left >= right or top >= bottom:
        return a, b
    window = left, top, right, bottom
    same = _shared_vertices(a, b), _shared_vertices(b, a)
    if not (same[0].any() and same[1].any()):
        return a, b
    views = [layer.view(window) for layer in (a, b)]
    lines = [_part(near, shared) for (_, near), shared in zip(views, same, strict=True)]
    both = lines[0] | lines[1]
    rest = [_grow_mask((near >= 0) & ~line) & both for (_, near), line in zip(views, lines, strict=True)]
    ends = [_part(near, _ending(layer) & shared) for (_, near), layer, shared in zip(views, (a, b), same, strict=True)]
    to_a = (rest[0] & ~rest[1]) | (ends[1] & ~ends[0] & both)
    to_b = (rest[1] & ~rest[0]) | (ends[0] & ~ends[1] & both)
    unsure = to_a & to_b
    to_a, to_b = to_a & ~unsure, to_b & ~unsure
    if not (to_a.any() or to_b.any()):
        return a, b
    inks = [rgba for rgba, _ in views]
    from_a = seam(inks[0], inks[1], both, to_a, to_b)
    return _clear_pixels(a, window, both & from_a), _clear_pixels(b, window, both & ~from_a)


def _grow_mask(mask: _Mask) -> _Mask:
    import cv2

    return np.asarray(cv2.dilate(mask.view(np.uint8), np.ones((3, 3), np.uint8)), dtype=bool)


def _shared_vertices(layer: GlyphLayer, other: GlyphLayer) -> _Mask:
    """Vertices (n,) of a layer that lie on the other's line."""
    from scipy.spatial import cKDTree

    reach = np.maximum(_NEAR, _OF_RADIUS * layer.radius)
    away, at = cKDTree(other.xy).query(layer.xy, distance_upper_bound=float(reach.max()))
    near = away <= reach
    at = np.where(near, at, 0)
    cosine = (layer.twice * np.conj(other.twice[at])).real
    along = cosine >= _ALIKE * np.abs(layer.twice) * np.abs(other.twice[at])
    # where a ligature turns sharply the two see different directions; that its vertices are in one place is enough
    return np.asarray(near & (along | (away < _ONE)))


def _ending(layer: GlyphLayer) -> _Mask:
    """Vertices (n,) where lines end, and those just before."""
    away = ((layer.xy[:, None] - layer.xy[layer.loose]) ** 2).sum(axis=2)
    return np.asarray(away.min(axis=1, initial=np.inf) <= (_ENDING * layer.radius) ** 2)


def _part(near: NDArray[np.int32], vertices: _Mask) -> _Mask:
    """Pixels (h, w) whose nearest vertex is one of those."""
    return np.asarray((near >= 0) & vertices[near])


def _clear_pixels(layer: GlyphLayer, window: tuple[int, int, int, int], gone: _Mask) -> GlyphLayer:
    """The layer with some pixels of the window clear."""
    left, top, right, bottom = window
    x, y = layer.corner
    rgba = layer.rgba.copy()
    rgba[top - y : bottom - y, left - x : right - x][gone] = 0
    return replace(layer, rgba=rgba)
