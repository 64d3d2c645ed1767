"""Draws the ink of one scanned glyph along its line on a page, by one smooth map from the page back to the picture.

Each pixel near the line is traced back to the picture by the movement of its nearest vertex: turned, stretched along
the line and across it.  The movements are then averaged over the width of the line, so that ink shears where the line
bends.  A glyph that is only moved keeps every pixel as it was.

Source: seed 000, §6.5 (there quad strips, which overlap where a line bends).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.inking.layers import GlyphLayer
from handout.inking.source import Course, InkSource, courses, movements, own_vertices
from handout.inking.swatches import CLEAR
from handout.values import Indices, Ink

MARGIN = 0.51  # mm of picture around the line, 12 pixels at 600 dpi: with 8 the tips of sharp turns are lost
_COARSE = 1.3  # pixels of the picture in one of the page, above which several are averaged
_MOST_FINER = 16
_EXACT = 0.02  # pixels: what one even movement may be off by
_PAD = 8  # pixels around the part of the picture that is needed, so that lines beside it are noticed
_PARTS = 64  # of a pixel: places are rounded to these, so that a glyph that is only shifted is copied exactly
_ROUND = 1.5  # pixels beyond the radius where a piece of line fades out at its end
_FAINT = 0.15  # opacity of ink that two specks are joined by
_APART = 3.0  # pixels of the picture between neighbouring movements, above which they are not averaged
_ROW = 256  # pixels that are sampled in one row
_GHOST = 2.0  # pixels by which ink may lie further from its line on the page than in the picture
_SIXTEEN = np.ones((4, 4), np.uint8)

_Pixels = NDArray[np.float32]


def warp(
    inks: Sequence[Ink], sources: Mapping[int, InkSource], dpi: float, shape: tuple[int, int], *, margin: float = MARGIN
) -> Iterator[GlyphLayer | None]:
    """The ink of each glyph on a page of `shape` (height, width) pixels; None where it lies outside.

    Parameters
    ----------
    inks : sequence of Ink
        A line with a negative `number` is put together from clear pieces: all ink around it is taken with it.
    sources : mapping of `Ink.source` to Source
        The pages of the hand that the ink comes from.
    margin : float
        mm of the page around the line within which the picture is taken.
    """
    radii, own = zip(*own_vertices(inks, sources), strict=True)
    # how many times finer than the page the ink is drawn, so that no pixel of the picture is skipped
    ratios = np.ones(len(inks))
    for k, (ink, radius) in enumerate(zip(inks, radii, strict=True)):
        if len(radius):
            ratios[k] = np.median(radius / np.maximum(ink.graph.radius * dpi / 25.4, 1e-9))
    finer = np.where(ratios > _COARSE, np.ceil(np.clip(ratios, 1, _MOST_FINER)), 1).astype(int).tolist()
    lines = courses(inks, radii, [dpi / 25.4 * times for times in finer])
    for ink, line, times, vertices in zip(inks, lines, finer, own, strict=True):
        source, lone = sources[ink.source], ink.number < 0
        reach = (min(margin, CLEAR) if lone else margin) * dpi / 25.4 * times
        window = _window(line, reach, (shape[0] * times, shape[1] * times), times)
        if window is None:
            yield None
            continue
        # a piece from the middle of a line would go on past its end: it is cut off round there
        near, band = _nearest(line, window, np.where(line.loose & lone, _ROUND, reach))
        rgba = np.zeros((*near.shape, 4), dtype=np.float32)
        if len(band.at):
            at, laid = _pieces(line, band, source) if lone else _sample_ink(line, band, source, vertices)
            rgba.reshape(-1, 4)[at] = laid
        corner, xy = (window[0] // times, window[1] // times), np.stack([line.at.real, line.at.imag], axis=1)
        layer = GlyphLayer(rgba, near, corner, xy, line.radius, line.twice, line.loose)
        yield layer if times == 1 else _downsample(layer, times)


def _downsample(layer: GlyphLayer, finer: int) -> GlyphLayer:
    """The layer with `finer` × `finer` pixels averaged into one."""
    import cv2

    h, w = layer.near.shape[0] // finer, layer.near.shape[1] // finer
    rgba = np.asarray(cv2.resize(layer.rgba, (w, h), interpolation=cv2.INTER_AREA), dtype=np.float32)
    near = np.ascontiguousarray(layer.near[finer // 2 :: finer, finer // 2 :: finer])
    inked = rgba[:, :, 3] > 0
    near = np.where(inked, np.maximum(near, layer.near.reshape(h, finer, w, finer).max(axis=(1, 3))), near)
    xy = (layer.xy + 0.5) / finer - 0.5
    return replace(layer, rgba=rgba, near=near, xy=xy, radius=layer.radius / finer)


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


@dataclass(frozen=True, eq=False)
class _Band:
    """The pixels of a window within reach of a line; what is known of them is (m,), places are in float32.

    origin : of the window on the page, x + i y; shape : (h, w) of it.
    at : flat indices, rising; x, y : from the origin.
    vertex : the nearest; beyond : pixels by which they lie outside its radius.
    """

    origin: complex
    shape: tuple[int, int]
    at: NDArray[np.intp]
    x: _Pixels
    y: _Pixels
    vertex: NDArray[np.intp]
    beyond: _Pixels

    def window(self, values: NDArray[Any], elsewhere: float = 0.0) -> NDArray[Any]:
        """(h, w, …): values (m, …) in their window."""
        whole = np.full((self.shape[0] * self.shape[1], *values.shape[1:]), elsewhere, dtype=values.dtype)
        whole[self.at] = values
        return whole.reshape(*self.shape, *values.shape[1:])


def _nearest(
    line: Course, window: tuple[int, int, int, int], margin: NDArray[np.float64]
) -> tuple[NDArray[np.int32], _Band]:
    """Nearest vertex (h, w) of every pixel, −1 beyond radius and margin, and the pixels within."""
    left, top, right, bottom = window
    origin, shape = left + 1j * top, (bottom - top, right - left)
    at = line.at - origin
    near = nearest(at, shape)
    x, y, radius, reach = (_single(values) for values in (at.real, at.imag, line.radius, line.radius + margin))
    across = np.arange(shape[1], dtype=np.float32) - x.take(near)
    down = np.arange(shape[0], dtype=np.float32)[:, None] - y.take(near)
    square = across * across + down * down
    near[square > np.square(reach).take(near)] = -1
    inside = np.flatnonzero(near >= 0)
    vertex, (row, column) = near.take(inside).astype(np.intp), np.divmod(inside, shape[1])
    beyond = np.sqrt(square.take(inside)) - radius.take(vertex)
    return near, _Band(origin, shape, inside, _single(column), _single(row), vertex, beyond)


def _single(values: NDArray[Any]) -> _Pixels:
    return np.asarray(values, dtype=np.float32)


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
    number = np.zeros(len(at) + 1, dtype=np.int32)
    number[label[y, x]] = np.arange(len(at))
    return np.asarray(number[label])


def _sample_ink(line: Course, band: _Band, source: InkSource, own: Indices) -> tuple[Indices, _Pixels]:
    """(k,) flat indices of the pixels of a band that may have ink, and (k, 4) the ink, premultiplied: sharp, but never
    darker nor lighter than the pixels around."""
    import cv2

    goal = complex(np.round(line.uv[0]))
    x, y, bent = _trace_back(line, band, goal)
    left, top = int(x.min()) - _PAD, int(y.min()) - _PAD
    width, height = int(x.max()) + _PAD + 2 - left, int(y.max()) + _PAD + 2 - top
    corner = (left + int(goal.real), top + int(goal.imag))
    patch = source.patch((*corner, corner[0] + width, corner[1] + height), own)
    back = np.stack([x - left, y - top])
    place = np.rint(back * _PARTS) / _PARTS
    # greatest and least of the sixteen pixels around, kept at the one to the upper left
    x, y = place.astype(np.intp)
    most, least = (limit(patch, _SIXTEEN, anchor=(1, 1)).reshape(-1, 4) for limit in (cv2.dilate, cv2.erode))
    around = y * width + x
    some = np.flatnonzero(most[:, 3].take(around))
    parts = {name: getattr(band, name).take(some) for name in ("at", "x", "y", "vertex", "beyond")}
    band, back, place, around = replace(band, **parts), back[:, some], place[:, some], around[some]
    ink = np.clip(_remap(patch, *place), least.take(around, axis=0), most.take(around, axis=0))
    np.minimum(ink, ink[:, 3:], out=ink)
    if bent:
        ink *= _unghost(line, band, back, complex(*corner), patch.shape[:2])[:, None]
        ink[_specks(band.window(ink[:, 3]), band.at[band.beyond <= 0]).ravel().take(band.at)] = 0
    return band.at, ink


def _specks(alpha: _Pixels, on: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(h, w) where ink does not touch that at `on`, flat indices on the line: remains of other strokes."""
    import cv2

    _, label = cv2.connectedComponents((alpha > _FAINT).astype(np.uint8), connectivity=8)
    on_line = np.zeros(int(label.max()) + 1, dtype=np.uint8)
    on_line[label.ravel()[on]] = 1
    on_line[0] = 0
    return np.asarray(cv2.dilate(on_line[label], np.ones((5, 5), np.uint8)) == 0)


def _pieces(line: Course, band: _Band, source: InkSource) -> tuple[Indices, _Pixels]:
    """The same for a line of clear pieces from anywhere in the picture."""
    corner = complex(*source.page.texture.corner)
    x, y = _move_pixels(line.movement(band.origin, corner).take(band.vertex, axis=1), band)
    # beside the line only CLEAR mm are known to be free of other lines
    own = line.uv[band.vertex] - corner
    away = np.hypot(x - own.real, y - own.imag) - (line.width * line.radius)[band.vertex]
    x[away > CLEAR / source.page.pixel] = -_PAD
    rgba = _remap(source.premultiplied_ink, x, y) / np.float32(255)
    rgba *= np.where(line.loose[band.vertex], np.clip(_ROUND - band.beyond, 0, 1), 1)[:, None]
    return band.at, np.minimum(rgba, rgba[:, 3:], out=rgba)


def _remap(picture: NDArray[Any], x: _Pixels, y: _Pixels) -> _Pixels:
    """(m, 4) float32: pixels of a picture (h, w, 4) at places (m,)."""
    import cv2

    rows = -(-len(x) // _ROW)
    places = np.full((2, rows * _ROW), -_PAD, dtype=np.float32)
    places[0, : len(x)], places[1, : len(x)] = x, y
    right, down = places.reshape(2, rows, _ROW)
    found = np.asarray(cv2.remap(picture, right, down, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT))
    return np.asarray(found.reshape(-1, 4)[: len(x)], dtype=np.float32)


def _move_pixels(movement: Iterable[_Pixels], band: _Band) -> tuple[_Pixels, _Pixels]:
    """(m,) twice: where pixels come from by a `Course.movement` (6, m) each, or one (6,) for all."""
    a, b, c, d, e, f = movement
    return a + b * band.x + c * band.y, d + e * band.x + f * band.y


def _trace_back(line: Course, band: _Band, goal: complex) -> tuple[_Pixels, _Pixels, bool]:
    """Where in the picture pixels come from, (m,) twice from `goal`, and whether one affine movement was not enough."""
    import cv2

    movement, even = line.movement(band.origin, goal), _fit_movement(line, band.origin, goal)
    even_x, even_y = _move_pixels(even, band)
    rest = np.ones((len(band.x), 4), dtype=np.float32)
    rest[:, 0], rest[:, 1] = _move_pixels((movement - even[:, None]).take(band.vertex, axis=1), band)
    if np.abs(rest[:, :2]).max() < _EXACT:
        return *_move_pixels(movement.take(band.vertex, axis=1), band), False
    rest[:, 2] = rest[:, 0] ** 2 + rest[:, 1] ** 2
    side = 2 * max(1, round(float(np.median(line.radius)))) + 1
    whole = band.window(rest)
    once = cv2.blur(whole, (side, side)) * whole[:, :, 3:]
    parts = _single(cv2.blur(once, (side, side))).reshape(-1, 4).take(band.at, axis=0)
    mean = parts[:, :3] / parts[:, 3:]
    apart = np.sqrt(np.maximum(mean[:, 2] - mean[:, 0] ** 2 - mean[:, 1] ** 2, 0))
    # where strokes part, or a line turns back on itself, the mean of two movements would hit no ink
    own_share = np.clip(apart / np.float32(_APART) - 1, 0, 1)[:, None]
    rest = mean[:, :2] + own_share * (rest[:, :2] - mean[:, :2])
    return even_x + rest[:, 0], even_y + rest[:, 1], True


def _fit_movement(line: Course, origin: complex, goal: complex) -> _Pixels:
    """(6,) the affine movement from page to picture that fits the line's vertices best, as a `Course.movement`."""
    middle, target = line.at.mean(), line.uv.mean()
    away, cut = line.at - middle, line.uv - target
    # a straight line does not determine the movement beside it: a small weight on a similarity does
    size = 0.01 * (float(np.abs(away).max()) + 1.0) ** 2
    square = float((np.abs(away) ** 2).sum())
    along, across = np.vdot(away, cut), (away * cut).sum()
    plain = along / square if square > 0 else line.turn.mean()
    both = complex((away**2).sum())
    normal = np.array([[square + size, np.conj(both)], [both, square + size]])
    turn, mirror = np.linalg.solve(normal, np.array([along + size * plain, across]))
    away = origin - middle
    return movements(np.array([target - goal + turn * away + mirror * np.conj(away)]), turn, mirror)[:, 0]


def _unghost(line: Course, band: _Band, back: _Pixels, corner: complex, shape: Any) -> _Pixels:
    """(m,) 0–1: 1 where ink is no further from its own line on the page than it was in the picture, falling to 0.

    Where two lines of a glyph are drawn further apart, each would otherwise bring a copy of the other along.

    back : places in the part of the picture of `shape`, whose first pixel is at `corner`.
    """
    import cv2

    uv, at = line.uv - corner, line.at - band.origin
    x, y = (np.clip(np.rint(part).astype(np.intp), 0, side - 1) for part, side in zip(back, shape[::-1], strict=True))
    vertex = nearest(uv, shape)[y, x]
    columns = _single(np.array([uv.real, uv.imag, np.abs(line.turn), at.real, at.imag]))
    u, v, turn, left, top = columns.take(vertex, axis=1)
    there = np.sqrt((back[0] - u) ** 2 + (back[1] - v) ** 2) / turn
    here = np.sqrt((band.x - left) ** 2 + (band.y - top) ** 2)
    share = 1 - np.clip((here - there) / _GHOST - 1, 0, 1) * np.clip(band.beyond / _GHOST, 0, 1)
    return _single(np.minimum(share, _single(cv2.blur(band.window(share, 1.0), (3, 3))).ravel()[band.at]))
