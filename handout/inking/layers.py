"""Layers: each glyph's ink on the page that is written, and the seams between two layers that show the same line.

A seam does not show: left of it the one layer is seen, right of it the other.

Source: seed 000, §6.5; Kwatra, Schödl, Essa, Turk & Bobick 2003, Graphcut textures, §3.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.inking.atlas import pack
from handout.libraries import cv2
from handout.scanning.graph_cut import minimum_cut
from handout.values import Array, Indices
from handout.writing.forms import square_distances


@dataclass(frozen=True, eq=False)
class GlyphLayer:
    """The ink of one glyph.

    rgba : (h, w, 4) uint8, straight alpha.
    near : (h, w) int32: number of the nearest vertex, −1 where the line is out of reach.
    corner : (x, y) of its first pixel on the page.
    xy : (n, 2) float, pixels of the page: vertices of the line.
    radius : (n,) float, pixels.
    twice : (n,) complex: direction of the line, its angle doubled; shorter than 1 where there are several.
    loose : (n,) bool: ends of lines.
    """

    rgba: NDArray[np.uint8]
    near: NDArray[np.int32]
    corner: tuple[int, int]
    xy: Array
    radius: Array
    twice: NDArray[np.complex128]
    loose: NDArray[np.bool_]


_FINE = 64.0  # capacities become whole numbers: so much finer than they would
_NEAR, _OF_RADIUS = 1.5, 0.3  # pixels, and share of the radius, within which two lines are one
_ONE = 0.02  # pixels within which two vertices are one
_ENDING = 0.5  # radii before its end where a line gives way to one that goes on
_ALIKE = 0.5  # cosine of twice the angle between them, at least

_Mask = NDArray[np.bool_]
_Pixels = NDArray[np.uint8]


def seam(a: _Pixels, b: _Pixels, both: _Mask, to_a: _Mask, to_b: _Mask) -> _Mask:
    """Which pixels of an overlap are taken from the layer `b`, so that the seam costs least.

    The cost of a seam between neighbours s and t is ‖a(s) − b(s)‖ + ‖a(t) − b(t)‖.

    a, b : (h, w, 4) uint8, straight alpha.
    both : (h, w) bool: the overlap.
    to_a, to_b : (h, w) bool: pixels of it that are settled.

    The change of luma between s and t, which some add to the cost so that seams rather run where nothing is cut, was
    tried with weight 2 and left out.  It moves few pixels, and those for the worse: along a ligature the seam then
    keeps to the flank of the stroke instead of crossing it, which leaves steps along the edge and ends of strokes cut
    off square.

    Source: Kwatra et al. 2003, eq. 1.
    """
    at = np.flatnonzero(both)
    inks = [rgba.reshape(-1, 4).take(at, axis=0).astype(np.float32) / 255 for rgba in (a, b)]
    for ink in inks:
        ink[:, :3] *= ink[:, 3:]
    apart = np.zeros(both.shape, dtype=np.float32)
    apart[both] = np.sqrt(((inks[0] - inks[1]) ** 2).sum(axis=1))
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
    of_b = np.zeros(both.shape, dtype=bool)
    of_b[both] = minimum_cut(cost, first, second, price)
    return of_b


def part_layers(layers: Sequence[GlyphLayer]) -> list[GlyphLayer]:
    """Layers of a line of which one goes on where the one before ends: what both show is left to one of them.

    Both show the same line where their vertices lie on each other and lead the same way.  Of the pixels of that line
    those beside the rest of either layer are its own, and where a line ends in one layer only, the other has it;
    between them runs the seam.
    """
    if not layers:
        return []
    corner = np.array([layer.corner for layer in layers])
    end = corner + [layer.near.shape[::-1] for layer in layers]
    # the smallest windows of the page that hold what two layers share
    low, high = np.maximum(corner[:-1], corner[1:]), np.minimum(end[:-1], end[1:])
    first = np.cumsum([0, *(len(layer.xy) for layer in layers)])
    shared = _shared_vertices(layers, corner, end)
    joined = np.logical_or.reduceat(shared, first[:-1], axis=1)
    pairs = np.flatnonzero((low < high).all(axis=1) & joined[1, :-1] & joined[0, 1:]).tolist()
    parted = list(layers)
    if not pairs:
        return parted

    def view(pair: int, side: int) -> tuple[slice, slice]:
        (x, y), (r, b) = (low[pair] - corner[pair + side]).tolist(), (high[pair] - corner[pair + side]).tolist()
        return np.s_[y:b, x:r]

    atlas = pack((high - low)[pairs], 2)
    near = np.full((2, *atlas.shape), -1)  # the last of the tables below, of no vertex
    inks = np.zeros((2, *atlas.shape, 4), dtype=np.uint8)
    for pair, cell in zip(pairs, atlas.cells(), strict=True):
        for side in (0, 1):
            part = layers[pair + side].near[view(pair, side)]
            near[side][cell] = np.where(part < 0, -1, part + first[pair + side])
            inks[side][cell] = layers[pair + side].rgba[view(pair, side)]
    tables = [np.append(part, False) for part in shared[::-1]]
    lines = [table.take(part) for table, part in zip(tables, near, strict=True)]
    both, ending = lines[0] | lines[1], np.append(_ending(layers), False)
    rest = [_grow_mask((part >= 0) & ~line) & both for part, line in zip(near, lines, strict=True)]
    ends = [(ending & table).take(part) for table, part in zip(tables, near, strict=True)]
    to_a = (rest[0] & ~rest[1]) | (ends[1] & ~ends[0] & both)
    to_b = (rest[1] & ~rest[0]) | (ends[0] & ~ends[1] & both)
    sure = to_a ^ to_b
    of_b = seam(inks[0], inks[1], both, to_a & sure, to_b & sure)
    for pair, cell in zip(pairs, atlas.cells(), strict=True):
        for side, gone in ((0, of_b[cell]), (1, both[cell] & ~of_b[cell])) if sure[cell].any() else ():
            rgba = parted[pair + side].rgba.copy()
            rgba[view(pair, side)][gone] = 0
            parted[pair + side] = replace(parted[pair + side], rgba=rgba)
    return parted


def _grow_mask(mask: _Mask) -> _Mask:
    return np.asarray(cv2.dilate(mask.view(np.uint8), np.ones((3, 3), np.uint8)), dtype=bool)


def _shared_vertices(layers: Sequence[GlyphLayer], corner: Indices, end: Indices) -> _Mask:
    """(2, n) bool: vertices of the layers that lie on the line of the layer before, and of that behind.

    corner, end : (m, 2) of the layers, on the page.
    """
    found = [np.zeros((2, len(layer.xy)), dtype=bool) for layer in layers]
    for before, behind in pairwise(range(len(layers))):
        for side, mine, other in ((0, behind, before), (1, before, behind)):
            layer, beside = layers[mine], layers[other]
            some = np.flatnonzero(((layer.xy >= corner[other]) & (layer.xy < end[other])).all(axis=1))
            if not len(some):
                continue
            xy, twice = layer.xy[some], layer.twice[some]
            reach = np.maximum(_NEAR, _OF_RADIUS * layer.radius[some])
            around = (beside.xy >= xy.min(axis=0) - reach.max()) & (beside.xy <= xy.max(axis=0) + reach.max())
            if not len(there := np.flatnonzero(around.all(axis=1))):
                continue
            squares = square_distances(xy, beside.xy[there])
            away, their = np.sqrt(squares.min(axis=1)), beside.twice[there[squares.argmin(axis=1)]]
            along = (twice * np.conj(their)).real >= _ALIKE * np.abs(twice) * np.abs(their)
            # where a ligature turns sharply they see different directions; that vertices are in one place is enough
            found[mine][side, some] = (away <= reach) & (along | (away < _ONE))
    return np.concatenate(found, axis=1)


def _ending(layers: Sequence[GlyphLayer]) -> _Mask:
    """Vertices (n,) of the layers where their lines end, and those just before."""
    near = []
    for layer in layers:
        away = ((layer.xy[:, None] - layer.xy[layer.loose]) ** 2).sum(axis=2)
        near.append(away.min(axis=1, initial=np.inf) <= (_ENDING * layer.radius) ** 2)
    return np.concatenate(near)
