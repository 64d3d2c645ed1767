"""Draws the ink of scanned glyphs along their lines on a page, by smooth maps from the page back to the picture.

Each pixel near a line is traced back to the picture by the movement of its nearest vertex: turned, stretched along
the line and across it.  The movements are then averaged over the width of the line, so that ink shears where the line
bends.  A glyph that is only moved keeps every pixel as it was.

A call of a library costs as much as a thousand pixels: glyphs lie side by side, and each step is taken for all at once.

Source: seed 000, §6.5 (there quad strips, which overlap where a line bends).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.inking.atlas import Atlas, pack
from handout.inking.layers import GlyphLayer
from handout.inking.source import Course, InkSource, course, factors, own_vertices
from handout.inking.swatches import CLEAR
from handout.libraries import cv2
from handout.values import Array, Indices, Ink

MARGIN = 0.51  # mm of picture around the line, 12 pixels at 600 dpi: with 8 the tips of sharp turns are lost
_COARSE = 1.3  # pixels of the picture in one of the page, above which several are averaged
_MOST_FINER = 16
_EXACT = 0.02  # pixels: what one even movement may be off by
_PAD = 8  # pixels around the part of the picture that is needed, so that lines beside it are noticed
_PARTS = 64  # of a pixel: places are rounded to these, so that a glyph that is only shifted is copied exactly
_RIM = 1.0  # pixels on either side of its radius over which a line that is cut fades, as the rim of a lifted pen does
_ROUND = 1.5  # pixels beyond the radius where a piece of line fades out at its end
_FAINT = 0.15  # opacity of ink that two specks are joined by
_APART = 3.0  # pixels of the picture between neighbouring movements, above which they are not averaged
_ROW = 256  # pixels that are sampled in one row
_GHOST = 2.0  # pixels by which ink may lie further from its line on the page than in the picture
_SIXTEEN = np.ones((4, 4), np.uint8)
_FULL = 255 * 255  # opacity of ink that hides all: colours of 255 levels are multiplied with as many of opacity
_TOGETHER = 1 << 18  # pixels of glyphs that are drawn together

_Pixels = NDArray[np.float32]
_Ink = NDArray[np.uint16]


@dataclass(frozen=True, eq=False)
class _Glyphs:
    """Glyphs that are drawn together.

    own : for each the vertices of its page that are on its line.
    line : their vertices; on the page, from the corner of the atlas.
    lone : whether their lines are put together from clear pieces.
    reach : pixels beyond a line's radius within which there may be ink.
    side : pixels over which movements are averaged.
    finer : how many times finer than the page they are drawn, so that no pixel of the picture is skipped.
    """

    sources: list[InkSource]
    own: list[Indices]
    line: Course
    lone: bool
    reach: float
    side: int
    finer: int


def warp(
    inks: Sequence[Ink], sources: Mapping[int, InkSource], dpi: float, shape: tuple[int, int], *, margin: float = MARGIN
) -> list[GlyphLayer | None]:
    """The ink of each glyph on a page of `shape` (height, width) pixels; None where it lies outside.

    inks : a line with a negative `number` is put together from clear pieces: all ink around it is taken with it.
    sources : the pages of the hand that the ink comes from.
    margin : mm of the page around the line within which the picture is taken.
    """
    layers: list[GlyphLayer | None] = [None] * len(inks)
    numbers = np.array([k for k, ink in enumerate(inks) if len(ink.graph)], dtype=np.intp)
    if not len(numbers):
        return layers
    inks, scale = [inks[k] for k in numbers], dpi / 25.4
    radii, own = zip(*own_vertices(inks, sources), strict=True)
    ratio = [
        float(np.median(radius / np.maximum(ink.graph.radius * scale, 1e-9)))
        for ink, radius in zip(inks, radii, strict=True)
    ]
    finer = np.where(np.array(ratio) > _COARSE, np.ceil(np.clip(ratio, 1, _MOST_FINER)), 1).astype(np.intp)
    lone = np.array([ink.number < 0 for ink in inks])
    reach = np.where(lone, min(margin, CLEAR), margin) * scale * finer
    line = course(inks, radii, np.asarray(scale * finer, dtype=np.float64))
    first = np.searchsorted(line.glyph, np.arange(len(inks) + 1))
    low, high = _bounds(line.at, line.radius + reach[line.glyph] + 1, first)
    step = finer[:, None]
    start, end = (np.asarray(part, dtype=np.intp) * step for part in (low // step, -((-high - 1) // step)))
    seen = ((end > 0) & (start < np.array(shape[::-1]) * step)).all(axis=1)
    radius = [float(np.median(line.radius[a:b])) for a, b in pairwise(first)]
    side = 2 * np.maximum(1, np.rint(radius).astype(np.intp)) + 1
    kind = np.stack([lone, finer, side], axis=1)
    for alike in np.unique(kind[seen], axis=0):
        some = np.flatnonzero(seen & (kind == alike).all(axis=1))
        total = np.cumsum((end - start)[some].prod(axis=1))
        for part in np.split(some, np.flatnonzero(np.diff(total // _TOGETHER)) + 1):
            vertices = np.concatenate([np.arange(first[k], first[k + 1]) for k in part])
            drawn = replace(line.take(vertices), glyph=np.repeat(np.arange(len(part)), np.diff(first)[part]))
            given = [sources[inks[k].source] for k in part], [own[k] for k in part], drawn, bool(alike[0])
            glyphs = _Glyphs(*given, float(reach[part[0]]), int(alike[2]), int(alike[1]))
            for number, layer in zip(numbers[part], _draw(glyphs, start[part], end[part], shape), strict=True):
                layers[number] = layer
    return layers


def _bounds(places: NDArray[np.complex128], reach: Array, first: Indices) -> tuple[Array, Array]:
    """(n, 2) twice: least and greatest x and y that some places (m,) reach, those of each glyph from `first` on."""
    sides = places.real, places.imag
    low = [np.minimum.reduceat(side - reach, first[:-1]) for side in sides]
    return np.stack(low, axis=1), np.stack([np.maximum.reduceat(side + reach, first[:-1]) for side in sides], axis=1)


def _plane(xy: NDArray[Any]) -> NDArray[np.complex128]:
    return np.asarray(xy[:, 0] + 1j * xy[:, 1])


def _draw(glyphs: _Glyphs, start: Indices, end: Indices, shape: tuple[int, int]) -> Iterator[GlyphLayer | None]:
    """The layers of glyphs in windows of the page from `start` to `end` (n, 2), x and y."""
    line, finer = glyphs.line, glyphs.finer
    # so far apart that no pixel is nearer to another glyph's line than to its own, nor averaged with it
    atlas = pack(end - start, finer * int((line.radius.max() + glyphs.side) // finer + 1))
    line = replace(line, at=line.at - _plane(start)[line.glyph])
    band = _nearest(line, atlas, np.where(line.loose & glyphs.lone, _ROUND, glyphs.reach))
    at, ink = (_pieces if glyphs.lone else _sample_ink)(replace(glyphs, line=line), band)
    first = np.searchsorted(line.glyph, np.arange(len(start) + 1))
    near = band.window((np.arange(len(line.at)) - first[line.glyph]).astype(np.int32).take(band.vertex), -1)
    rgba, near = _lay(at, ink, near, finer)
    for k, (left, top, right, below) in enumerate((np.concatenate([start, end], axis=1) // finer).tolist()):
        x, y = (atlas.corner[k] // finer).tolist()
        # of what lies over the edge of the page that within
        inner = max(left, 0), max(top, 0), min(right, shape[1]), min(below, shape[0])
        cell = np.s_[y + inner[1] - top : y + inner[3] - top, x + inner[0] - left : x + inner[2] - left]
        own = slice(first[k], first[k + 1])
        xy = (np.stack([line.at.real[own], line.at.imag[own]], axis=1) + start[k] + 0.5) / finer - 0.5
        radius, twice, loose = line.radius[own] / finer, line.twice[own], line.loose[own]
        yield GlyphLayer(rgba[cell], near[cell], inner[:2], xy, radius, twice, loose)


@dataclass(frozen=True, eq=False)
class _Band:
    """The pixels of an atlas within reach of a line; what is known of them is (m,).

    shape : (h, w) of the atlas.
    at : flat indices, rising; x, y : from the corners of their cells, so that a glyph is the same wherever it lies.
    vertex : the nearest; beyond : pixels by which they lie outside its radius.
    """

    shape: tuple[int, int]
    at: Indices
    x: _Pixels
    y: _Pixels
    vertex: Indices
    beyond: _Pixels

    def window(self, values: NDArray[Any], elsewhere: float = 0) -> NDArray[Any]:
        """(h, w, …): values (m, …) in their places."""
        whole = np.full((self.shape[0] * self.shape[1], *values.shape[1:]), elsewhere, dtype=values.dtype)
        whole[self.at] = values
        return whole.reshape(*self.shape, *values.shape[1:])

    def take(self, some: Indices) -> _Band:
        return _Band(self.shape, *(getattr(self, name).take(some) for name in ("at", "x", "y", "vertex", "beyond")))


def _nearest(line: Course, atlas: Atlas, margin: Array) -> _Band:
    """The pixels whose nearest vertex is no further than its radius and margin."""
    corner = atlas.corner[line.glyph].astype(np.int32)
    away, near = nearest_points(line.at + _plane(corner), atlas.shape)
    x, y, radius, reach = (
        _single(values) for values in (line.at.real, line.at.imag, line.radius, line.radius + margin)
    )
    inside = np.flatnonzero(away <= reach.max() * np.float32(1.1) + 1)
    vertex = near.ravel().take(inside).astype(np.intp)
    row, column = np.divmod(inside.astype(np.int32), np.int32(atlas.shape[1]))
    across, down = (_single(part - corner[:, k].take(vertex)) for k, part in enumerate((column, row)))
    far = np.sqrt((across - x.take(vertex)) ** 2 + (down - y.take(vertex)) ** 2)
    some = np.flatnonzero(far <= reach.take(vertex))
    whole = _Band(atlas.shape, inside, across, down, vertex, far - radius.take(vertex))
    return whole.take(some)


def _single(values: NDArray[Any]) -> _Pixels:
    return np.asarray(values, dtype=np.float32)


def nearest_points(at: NDArray[np.complex128], shape: tuple[int, int]) -> tuple[_Pixels, NDArray[np.int32]]:
    """(h, w) twice: how far from each pixel the nearest of some points (n,), x + i y in pixels, is, and its number; to
    within one pixel.

    Points outside are taken for the pixels at the edge that are nearest to them.
    """
    x = np.clip(np.floor(at.real + 0.5).astype(np.intp), 0, shape[1] - 1)
    y = np.clip(np.floor(at.imag + 0.5).astype(np.intp), 0, shape[0] - 1)
    free = np.ones(shape, dtype=np.uint8)
    free[y, x] = 0
    away, found = cv2.distanceTransformWithLabels(free, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    label = np.asarray(found, dtype=np.int32)
    number = np.zeros(len(at) + 1, dtype=np.int32)
    number[label[y, x]] = np.arange(len(at))
    return np.asarray(away), np.asarray(number.take(label))


def _sample_ink(glyphs: _Glyphs, band: _Band) -> tuple[Indices, _Ink]:
    """(k,) flat indices of the pixels of a band that may have ink, and (k, 4) the ink, premultiplied: sharp, but never
    darker nor lighter than the pixels around."""
    line = glyphs.line
    reach = np.maximum(np.abs(line.turn), line.width) * (line.radius + glyphs.reach + glyphs.side)
    low, high = _bounds(line.uv, reach, np.searchsorted(line.glyph, np.arange(len(glyphs.own) + 1)))
    box = np.concatenate([np.floor(low) - _PAD, np.ceil(high) + _PAD + 1], axis=1).astype(np.intp)
    atlas = pack(box[:, 2:] - box[:, :2], int(reach.max()) + 1)
    line = replace(line, uv=line.uv - _plane(box)[line.glyph])
    patch, nearest = _cut_patches(replace(glyphs, line=line), box, atlas)
    *back, bent = _trace_back(line, band, glyphs)
    place = [_single(np.rint(part * _PARTS) / _PARTS) for part in back]
    corner = atlas.corner[line.glyph]
    cell = (corner[:, 1] * atlas.shape[1] + corner[:, 0]).take(band.vertex)
    # greatest and least of the sixteen pixels around, kept at the one to the upper left
    x, y = (part.astype(np.intp) for part in place)
    most, least = (np.asarray(limit(patch, _SIXTEEN, anchor=(1, 1))) for limit in (cv2.dilate, cv2.erode))
    around = cell + y * atlas.shape[1] + x
    some = np.flatnonzero(most[:, :, 3].ravel().take(around))
    around, cell, band, back = around.take(some), cell.take(some), band.take(some), [part.take(some) for part in back]
    shift = (_single(corner[:, k]).take(band.vertex) for k in (0, 1))
    ink = _remap(patch, *(part.take(some) + by for part, by in zip(place, shift, strict=True)))
    bounds = (part.view(np.uint64).ravel().take(around).view(np.uint16).reshape(-1, 4) for part in (least, most))
    ink = np.clip(ink, *bounds, out=ink)
    if bent.any():
        _unghost(line, band, back, (nearest, cell), ink)
        specks = _specks(band.window(ink[:, 3]), band.at[band.beyond <= 0])
        ink[specks.ravel().take(band.at) & bent.take(line.glyph).take(band.vertex)] = 0
    return band.at, ink


def _cut_patches(glyphs: _Glyphs, box: Indices, atlas: Atlas) -> tuple[_Ink, NDArray[np.int32]]:
    """(h, w, 4) uint16, premultiplied: ink around the glyphs' lines, and (h, w) their nearest vertices, −1 where
    another line of the page is nearer: its ink is left out, with a soft edge.

    Where a line goes on into another letter it is cut off round, as a pen's line ends.

    box : (n, 4) int: left, top, right, bottom of each glyph's part of its picture.
    """
    straight = np.zeros((*atlas.shape, 4), dtype=np.uint8)
    others, ends, radii = [], [], []
    line, shifts = glyphs.line, _plane(atlas.corner - box[:, :2])
    each = zip(glyphs.sources, glyphs.own, atlas.cells(), shifts, box.tolist(), strict=True)
    for source, own, cell, shift, part in each:
        straight[cell] = source.part(part)
        beside, end = source.others(part, own)
        others.append(_plane(source.page.graph.uv[beside]) + shift)
        ends.append(_plane(source.page.graph.uv[end]) + shift)
        radii.append(source.radius[end])
    beside = np.concatenate(others)
    vertices = np.concatenate([beside, line.uv + _plane(atlas.corner)[line.glyph]])
    nearest = nearest_points(vertices, atlas.shape)[1] - np.int32(len(beside))
    np.maximum(nearest, -1, out=nearest)
    share = (nearest >= 0).astype(np.float32)
    _round_ends(share, np.concatenate(ends), np.concatenate(radii))
    share = np.maximum(share, cv2.blur(share, (3, 3)))
    wide = straight.astype(np.uint16)
    alpha = cv2.extractChannel(wide, 3)
    ink: _Ink = wide * np.asarray(cv2.merge([alpha, alpha, alpha, np.full_like(alpha, 255)]), dtype=np.uint16)
    some = np.flatnonzero((share < 1) & (alpha > 0))
    ink.reshape(-1, 4)[some] = ink.reshape(-1, 4)[some] * share.ravel()[some, None] + np.float32(0.5)
    return ink, nearest


def _round_ends(share: _Pixels, ends: NDArray[np.complex128], radius: Array) -> None:
    """Raise (h, w) to 1 within `radius` (n,) of ends of lines, x + i y, and less around."""
    if not len(ends):
        return
    step = np.arange(-int(radius.max() + _RIM) - 1, int(radius.max() + _RIM) + 3)
    x, y = np.floor(ends.real).astype(np.intp)[:, None] + step, np.floor(ends.imag).astype(np.intp)[:, None] + step
    away = np.hypot((x - ends.real[:, None])[:, None], (y - ends.imag[:, None])[:, :, None])
    covered = np.clip((radius[:, None, None] + _RIM - away) / (2 * _RIM), 0, 1)
    np.maximum.at(share.ravel(), y[:, :, None] * share.shape[1] + x[:, None], covered.astype(np.float32))


def _specks(alpha: NDArray[np.uint16], on: Indices) -> NDArray[np.bool_]:
    """(h, w) where ink does not touch that at `on`, flat indices on the line: remains of other strokes."""
    label = np.asarray(
        cv2.connectedComponents((alpha > _FAINT * _FULL).view(np.uint8), connectivity=8)[1], dtype=np.int32
    )
    on_line = np.zeros(int(label.max()) + 1, dtype=np.uint8)
    on_line[label.ravel().take(on)] = 1
    on_line[0] = 0
    return np.asarray(cv2.dilate(on_line.take(label), np.ones((5, 5), np.uint8)) == 0)


def _pieces(glyphs: _Glyphs, band: _Band) -> tuple[Indices, _Ink]:
    """The same for lines of clear pieces from anywhere in the picture."""
    line, ink = glyphs.line, np.zeros((len(band.at), 4), dtype=np.uint16)
    for source in dict.fromkeys(glyphs.sources):
        of_source = np.array([each is source for each in glyphs.sources])
        some = np.flatnonzero(of_source[line.glyph].take(band.vertex))
        part, corner = band.take(some), complex(*source.page.texture.corner)
        x, y = _move_pixels(factors(*line.movement()).take(part.vertex, axis=1), part)
        # beside the line only CLEAR mm are known to be free of other lines
        own = line.uv[part.vertex]
        away = np.hypot(x - own.real, y - own.imag) - (line.width * line.radius)[part.vertex]
        x[away > CLEAR / source.page.pixel] = corner.real - _PAD
        found = _remap(source.premultiplied_ink, x - np.float32(corner.real), y - np.float32(corner.imag))
        fade = np.where(line.loose[part.vertex], np.clip(_ROUND - part.beyond, 0, 1), 1)
        ink[some] = found * (255 * fade[:, None])
    return band.at, ink


def _remap(picture: NDArray[Any], x: _Pixels, y: _Pixels) -> NDArray[Any]:
    """(m, 4): pixels of a picture (h, w, 4) at places (m,)."""
    rows = -(-len(x) // _ROW)
    places = np.full((2, rows * _ROW), -_PAD, dtype=np.float32)
    places[0, : len(x)], places[1, : len(x)] = x, y
    right, down = places.reshape(2, rows, _ROW)
    return np.asarray(
        cv2.remap(picture, right, down, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT).reshape(-1, 4)[: len(x)]
    )


def _move_pixels(movement: _Pixels, band: _Band) -> tuple[_Pixels, _Pixels]:
    """(m,) twice: where pixels come from by `source.factors` (6, m)."""
    a, b, c, d, e, f = movement
    return a + b * band.x + c * band.y, d + e * band.x + f * band.y


def _trace_back(line: Course, band: _Band, glyphs: _Glyphs) -> tuple[_Pixels, _Pixels, NDArray[np.bool_]]:
    """Where in the picture pixels come from, (m,) twice, and for which glyphs (n,) one movement was not enough."""
    own, even = line.movement(), line.even_movement()
    rest = [part - of_all for part, of_all in zip(own, even, strict=True)]
    start, turn, mirror = rest
    off = np.abs(start + turn * line.at + mirror * np.conj(line.at))
    off += (np.abs(turn) + np.abs(mirror)) * (line.radius + glyphs.reach)
    bent = np.bincount(line.glyph, off >= _EXACT) > 0
    x, y = _move_pixels(factors(*rest).take(band.vertex, axis=1), band)
    if bent.any():
        side, inside = (glyphs.side, glyphs.side), band.window(np.ones_like(x))
        whole = (band.window(part) for part in (x, y, x * x + y * y, inside.ravel().take(band.at)))
        *parts, share = (cv2.blur(cv2.blur(part, side) * inside, side).ravel().take(band.at) for part in whole)
        mean_x, mean_y, square = (part / share for part in parts)
        apart = np.sqrt(np.maximum(square - mean_x**2 - mean_y**2, 0))
        # where strokes part, or a line turns back on itself, the mean of two movements would hit no ink
        share = np.clip(apart / np.float32(_APART) - 1, 0, 1)
        if not bent.all():
            share[~bent.take(line.glyph).take(band.vertex)] = 1
        x, y = mean_x + share * (x - mean_x), mean_y + share * (y - mean_y)
    even_x, even_y = _move_pixels(factors(*even).take(band.vertex, axis=1), band)
    return even_x + x, even_y + y, bent


def _unghost(
    line: Course, band: _Band, back: Sequence[_Pixels], nearest: tuple[NDArray[np.int32], Indices], ink: _Ink
) -> None:
    """Fade ink that is further from its own line on the page than it was in the picture.

    Where two lines of a glyph are drawn further apart, each would otherwise bring a copy of the other along.

    back : places in the patches; nearest : the vertices nearest to the pixels of their atlas (h, w), and where in it,
        flat, each pixel's patch begins.
    """
    some = np.flatnonzero(band.beyond > 0)
    x, y = (part.take(some) for part in back)
    places = np.rint(y).astype(np.intp) * nearest[0].shape[1] + np.rint(x).astype(np.intp)
    vertex = nearest[0].ravel().take(nearest[1].take(some) + places).astype(np.intp)
    columns = np.array([line.uv.real, line.uv.imag, np.abs(line.turn), line.at.real, line.at.imag], dtype=np.float32)
    u, v, turn, left, top = columns.take(vertex, axis=1)
    there = np.sqrt((x - u) ** 2 + (y - v) ** 2) / turn
    here = np.sqrt((band.x.take(some) - left) ** 2 + (band.y.take(some) - top) ** 2)
    far = np.clip((here - there) / _GHOST - 1, 0, 1) * np.clip(band.beyond.take(some) / _GHOST, 0, 1)
    far[vertex < 0] = 0
    share = np.ones(len(band.at), dtype=np.float32)
    share[some] -= far
    share = np.minimum(share, cv2.blur(band.window(share, 1), (3, 3)).ravel().take(band.at))
    some = np.flatnonzero(share < 1)
    ink[some] = ink[some] * share[some, None]


def _lay(at: Indices, ink: _Ink, near: NDArray[np.int32], finer: int) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """(h, w, 4) uint8, straight alpha: ink (k, 4), premultiplied, in a picture, and its nearest vertices (h, w), with
    `finer` × `finer` pixels averaged into one."""
    h, w = near.shape[0] // finer, near.shape[1] // finer
    if finer > 1:
        whole = np.zeros((*near.shape, 4), dtype=np.uint16)
        whole.reshape(-1, 4)[at] = ink
        small = np.asarray(cv2.resize(whole, (w, h), interpolation=cv2.INTER_AREA), dtype=np.uint16)
        greatest = near.reshape(h, finer, w, finer).max(axis=(1, 3))
        near = near[finer // 2 :: finer, finer // 2 :: finer]
        near = np.where(small[:, :, 3] > 0, np.maximum(near, greatest), near)
        at, ink = np.arange(h * w), small.reshape(-1, 4)
    some = np.flatnonzero(ink[:, 3] > 127)
    ink = ink.take(some, axis=0)
    part = np.float32(255) / ink[:, 3]
    laid = np.empty((len(some), 4), dtype=np.uint8)
    for k in range(3):
        laid[:, k] = np.minimum(ink[:, k] * part + np.float32(0.5), 255)
    laid[:, 3] = (ink[:, 3] + 127) // 255
    rgba = np.zeros((h, w, 4), dtype=np.uint8)
    rgba.view(np.uint32).reshape(-1)[at.take(some)] = laid.view(np.uint32).ravel()
    return rgba, near
