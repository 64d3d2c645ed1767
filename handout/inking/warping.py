"""Draws the ink of one scanned glyph along its line on a page, by one smooth map from the page back to the picture.

Each pixel near the line is traced back to the picture by the movement of its nearest vertex: turned, stretched along
the line and across it.  The movements are then averaged over the width of the line, so that ink shears where the line
bends.  A glyph that is only moved keeps every pixel as it was.

Source: seed 000, §6.5 (there quad strips, which overlap where a line bends).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.inking.layers import Layer
from handout.inking.source import Course, Source, course
from handout.inking.swatches import CLEAR
from handout.values import Ink

MARGIN = 0.51  # mm of picture around the line, 12 pixels at 600 dpi: with 8 the tips of sharp turns are lost
_COARSE = 1.3  # pixels of the picture in one of the page, above which several are averaged
_MOST_FINER = 16
_EXACT = 0.02  # pixels: what one even movement may be off by
_PAD = 8  # pixels around the part of the picture that is needed, so that lines beside it are noticed
_PARTS = 64  # of a pixel: places are rounded to these, so that a glyph that is only shifted is copied exactly
_ROUND = 1.5  # pixels beyond the radius where a piece of line fades out at its end
_FAINT = 0.15  # opacity of ink that two specks are joined by
_APART = 3.0  # pixels of the picture between neighbouring movements, above which they are not averaged
_GHOST = 2.0  # pixels by which ink may lie further from its line on the page than in the picture

_Pixels = NDArray[np.float32]


def warp(ink: Ink, source: Source, dpi: float, shape: tuple[int, int], *, margin: float = MARGIN) -> Layer | None:
    """The ink of a glyph on a page of `shape` (height, width) pixels; None where it lies outside.

    Parameters
    ----------
    ink : Ink
        A line with a negative `number` is put together from clear pieces: all ink around it is taken with it.
    source : Source
        The page of the hand that the ink comes from.
    margin : float
        mm of the page around the line within which the picture is taken.
    """
    finer = _finer(ink, source, dpi)
    line = course(ink, source, dpi / 25.4 * finer)
    lone = ink.number < 0
    reach = (min(margin, CLEAR) if lone else margin) * dpi / 25.4 * finer
    window = _window(line, reach, (shape[0] * finer, shape[1] * finer), finer)
    if window is None:
        return None
    # a piece from the middle of a line would go on past its end: it is cut off round there
    near, place = _nearest(line, window, np.where(line.loose & lone, _ROUND, reach))
    rgba = _pieces(line, near, place, source) if lone else _sampled(line, near, place, source, ink.graph.uv)
    left, top = window[0] // finer, window[1] // finer
    xy = np.stack([line.at.real, line.at.imag], axis=1)
    layer = Layer(rgba, near, (left, top), xy, line.radius, line.twice, line.loose)
    return layer if finer == 1 else _coarser(layer, finer)


def _finer(ink: Ink, source: Source, dpi: float) -> int:
    """How many times finer than the page the ink is drawn, so that no pixel of the picture is skipped."""
    graph = ink.graph
    if not len(graph):
        return 1
    ratio = float(np.median(source.radius_at(graph.uv) / np.maximum(graph.radius * dpi / 25.4, 1e-9)))
    return int(np.clip(np.ceil(ratio), 1, _MOST_FINER)) if ratio > _COARSE else 1


def _coarser(layer: Layer, finer: int) -> Layer:
    """The layer with `finer` × `finer` pixels averaged into one."""
    import cv2

    h, w = (side // finer for side in layer.near.shape)
    rgba = np.asarray(cv2.resize(layer.rgba, (w, h), interpolation=cv2.INTER_AREA), dtype=np.float32)
    near = np.ascontiguousarray(layer.near[finer // 2 :: finer, finer // 2 :: finer])
    inked = rgba[:, :, 3] > 0
    near = np.where(inked, np.maximum(near, np.asarray(_highest(layer.near, finer))), near)
    xy = (layer.xy + 0.5) / finer - 0.5
    return replace(layer, rgba=rgba, near=near, xy=xy, radius=layer.radius / finer)


def _highest(near: NDArray[np.int32], finer: int) -> NDArray[np.int32]:
    h, w = (side // finer for side in near.shape)
    return np.asarray(near.reshape(h, finer, w, finer).max(axis=(1, 3)))


def _window(line: Course, margin: float, shape: tuple[int, int], finer: int) -> tuple[int, int, int, int] | None:
    """(left, top, right, bottom) of what the line and its margin cover of the page, whole multiples of `finer`."""
    if not len(line.at):
        return None
    reach = line.radius + margin + 1
    low = [float((part - reach).min()) for part in (line.at.real, line.at.imag)]
    high = [float((part + reach).max()) for part in (line.at.real, line.at.imag)]
    left, top = (max(0, int(v // finer) * finer) for v in low)
    right, bottom = (min(side, int(-((-v - 1) // finer)) * finer) for v, side in zip(high, shape[::-1], strict=True))
    return (left, top, right, bottom) if left < right and top < bottom else None


def _nearest(
    line: Course, window: tuple[int, int, int, int], margin: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.complex128]]:
    """Nearest vertex (h, w) of every pixel, −1 beyond radius and margin, and the pixels' places (h, w)."""
    left, top, right, bottom = window
    place = np.arange(left, right)[None, :] + 1j * np.arange(top, bottom)[:, None]
    near = nearest(line.at - (left + 1j * top), place.shape)
    near[np.abs(place - line.at[near]) > (line.radius + margin)[near]] = -1
    return near, place


def nearest(at: NDArray[np.complex128], shape: tuple[int, int]) -> NDArray[np.int32]:
    """(h, w) int32: number of the point (n,), x + i y in pixels, that is nearest to each pixel, to within one.

    Points outside are taken for the pixels at the edge that are nearest to them.
    """
    import cv2

    x = np.clip(np.rint(at.real).astype(np.intp), 0, shape[1] - 1)
    y = np.clip(np.rint(at.imag).astype(np.intp), 0, shape[0] - 1)
    free = np.ones(shape, dtype=np.uint8)
    free[y, x] = 0
    _, label = cv2.distanceTransformWithLabels(free, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    number = np.zeros(int(label.max()) + 1, dtype=np.int32)
    number[label[y, x]] = np.arange(len(at))
    return np.asarray(number[label])


def _sampled(
    line: Course, near: NDArray[np.int32], place: NDArray[np.complex128], source: Source, uv: NDArray[np.float64]
) -> _Pixels:
    """(h, w, 4) ink of a window, premultiplied."""
    inside = near >= 0
    if not inside.any():
        return np.zeros((*near.shape, 4), dtype=np.float32)
    back, bent = _back(line, near, place, inside)
    x, y = (np.rint(part * _PARTS) / _PARTS for part in (back.real, back.imag))
    left, top = int(x.min()) - _PAD, int(y.min()) - _PAD
    box = (left, top, int(x.max()) + _PAD + 2, int(y.max()) + _PAD + 2)
    patch = source.patch(box, uv)
    places = np.full((2, *near.shape), -_PAD, dtype=np.float32)
    places[0][inside], places[1][inside] = x - left, y - top
    rgba = _cubic(patch, places[0], places[1])
    rgba[~inside] = 0
    if bent:
        rgba *= _unghosted(line, back, place, near, box, patch.shape[:2])[:, :, None]
        on = np.zeros(near.shape, dtype=bool)
        on[inside] = np.abs(place[inside] - line.at[near[inside]]) <= line.radius[near[inside]]
        _drop_specks(rgba, on)
    return rgba


def _drop_specks(rgba: _Pixels, on: NDArray[np.bool_]) -> None:
    """Clear ink that is not connected to ink `on` the line: remains of other strokes where the ink was bent."""
    import cv2

    _, label = cv2.connectedComponents((rgba[:, :, 3] > _FAINT).astype(np.uint8), connectivity=8)
    on_line = np.zeros(int(label.max()) + 1, dtype=bool)
    on_line[label[on]] = True
    on_line[0] = False
    # the soft edge of a stroke is fainter than _FAINT: what lies within two pixels is kept with it
    near = cv2.dilate(on_line[label].astype(np.uint8), np.ones((5, 5), np.uint8))
    rgba[near == 0] = 0


def _pieces(line: Course, near: NDArray[np.int32], place: NDArray[np.complex128], source: Source) -> _Pixels:
    """(h, w, 4) ink of a window, premultiplied, for a line of clear pieces from anywhere in the picture."""
    import cv2

    inside = near >= 0
    vertex = near[inside]
    back = line.back(place[inside], vertex.astype(np.intp))
    # beside the line only CLEAR mm are known to be free of other lines
    away = np.abs(back - line.uv[vertex]) - (line.width * line.radius)[vertex]
    back[away > CLEAR / source.page.pixel] = -_PAD
    x, y = source.page.texture.corner
    places = np.full((2, *near.shape), -_PAD, dtype=np.float32)
    places[0][inside], places[1][inside] = back.real - x, back.imag - y
    ink = cv2.remap(source.premultiplied, places[0], places[1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT)
    rgba = np.asarray(ink, dtype=np.float32) / np.float32(255)
    beyond = np.abs(place[inside] - line.at[vertex]) - line.radius[vertex]
    shown = np.where(line.loose[vertex], np.clip(_ROUND - beyond, 0, 1), 1)
    rgba[inside] *= shown[:, None].astype(np.float32)
    rgba[~inside] = 0
    return np.asarray(np.minimum(rgba, rgba[:, :, 3:]), dtype=np.float32)


def _cubic(patch: _Pixels, x: _Pixels, y: _Pixels) -> _Pixels:
    """Ink interpolated between pixels, sharp, but never darker nor lighter than the pixels around."""
    import cv2

    ink = np.asarray(cv2.remap(patch, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT))
    if (x == np.rint(x)).all() and (y == np.rint(y)).all():
        return np.asarray(ink, dtype=np.float32)
    kernel = np.ones((4, 4), np.uint8)
    left, top = np.floor(x), np.floor(y)
    # least and greatest of the sixteen pixels around, kept at the one to the upper left
    least = cv2.remap(cv2.erode(patch, kernel, anchor=(1, 1)), left, top, cv2.INTER_NEAREST)
    most = cv2.remap(cv2.dilate(patch, kernel, anchor=(1, 1)), left, top, cv2.INTER_NEAREST)
    ink = np.clip(ink, least, most)
    return np.asarray(np.minimum(ink, ink[:, :, 3:]), dtype=np.float32)


def _back(
    line: Course, near: NDArray[np.int32], place: NDArray[np.complex128], inside: NDArray[np.bool_]
) -> tuple[NDArray[np.complex128], bool]:
    """Where in the picture the m pixels `inside` come from, (m,), and whether one affine movement was not enough."""
    import cv2

    pixels = place[inside]
    back = line.back(pixels, near[inside].astype(np.intp))
    even = _even(line)(pixels)
    rest = back - even
    if max(np.abs(rest.real).max(), np.abs(rest.imag).max()) < _EXACT:
        return back, False
    side = 2 * max(1, round(float(np.median(line.radius)))) + 1
    parts = np.zeros((*place.shape, 4), dtype=np.float32)
    parts[inside] = np.stack([rest.real, rest.imag, np.abs(rest) ** 2, np.ones(len(rest))], axis=1)
    for _ in range(2):
        parts = np.asarray(cv2.blur(parts, (side, side)))
        parts[~inside] = 0
    x, y, square, weight = parts[inside].T
    mean = (x + 1j * y) / weight
    apart = np.sqrt(np.maximum(square / weight - np.abs(mean) ** 2, 0))
    # where strokes part, or a line turns back on itself, the mean of two movements would hit no ink
    own_share = np.clip(apart / _APART - 1, 0, 1)
    return even + mean + own_share * (rest - mean), True


def _even(line: Course) -> Any:
    """The affine movement from page to picture that fits the line's vertices best."""
    middle, goal = line.at.mean(), line.uv.mean()
    away, cut = line.at - middle, line.uv - goal
    columns = np.stack([away, np.conj(away)], axis=1)
    # a straight line does not determine the movement beside it: a small weight on a similarity does
    size = float(np.abs(away).max()) + 1.0
    square = float((np.abs(away) ** 2).sum())
    plain = (np.conj(away) * cut).sum() / square if square > 0 else line.turn.mean()
    extra = np.array([[size, 0], [0, size]]) * 0.1
    rows = np.concatenate([columns, extra])
    goals = np.concatenate([cut, [plain * size * 0.1, 0]])
    turn, mirror = np.linalg.lstsq(rows, goals, rcond=None)[0]
    return lambda place: goal + turn * (place - middle) + mirror * np.conj(place - middle)


def _unghosted(
    line: Course,
    back: NDArray[np.complex128],
    place: NDArray[np.complex128],
    near: NDArray[np.int32],
    box: tuple[int, int, int, int],
    shape: tuple[int, int],
) -> _Pixels:
    """(h, w) 0–1: 1 where ink is no further from its own line on the page than it was in the picture, falling to 0.

    Where two lines of a glyph are drawn further apart, each would otherwise bring a copy of the other along.
    """
    import cv2

    inside = near >= 0
    nearest_source = nearest(line.uv - (box[0] + 1j * box[1]), shape)
    x = np.clip(np.rint(back.real - box[0]).astype(np.intp), 0, shape[1] - 1)
    y = np.clip(np.rint(back.imag - box[1]).astype(np.intp), 0, shape[0] - 1)
    vertex, at = nearest_source[y, x], near[inside]
    there = np.abs(back - line.uv[vertex]) / np.abs(line.turn[vertex])
    here = np.abs(place[inside] - line.at[vertex])
    ghost = np.clip((here - there) / _GHOST - 1, 0, 1)
    beside = np.clip((np.abs(place[inside] - line.at[at]) - line.radius[at]) / _GHOST, 0, 1)
    share = np.ones(near.shape, dtype=np.float32)
    share[inside] = 1 - ghost * beside
    return np.asarray(np.minimum(share, cv2.blur(share, (3, 3))), dtype=np.float32)
