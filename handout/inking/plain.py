"""The plain pen: a line of even colour whose width follows pressure or speed, with round ends.

A stroke is cut into short straight pieces.  Each piece covers a share of every pixel around it, computed from the
distance and the direction of the pixel's centre; a pixel keeps its greatest share.  So a line that crosses or retraces
itself stays even: an opaque pen leaves no darker spot there, and edges do not thicken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.inking import curves, outline
from handout.values import Array, Drawing, Raster, Stroke

_Pixels = NDArray[np.floating[Any]]  # float32 in fact, for speed

Colour = tuple[float, float, float]

COLOUR: Colour = (0.1, 0.1, 0.18)  # a blue-black, device RGB
WHITE: Colour = (1.0, 1.0, 1.0)
_FINEST = 0.02  # mm, no line is thinner
_LONGEST = 0.4  # mm, of a piece: the width is linear along it
_FLAT = 0.05  # pixels between a piece and the curve
_CHUNK = 1 << 17  # pixels worked on at a time: what fits a processor's cache
_ROWS = 64  # of the page, worked on at a time
_CORNER = np.float32(0.7072)  # from the centre of a pixel to its corner
_MOST = 4e9  # pixels of a page
_MOST_PIECES = 4096  # of one Bézier: enough for metres of line; bounds the work on curves far off the page


def widths(stroke: Stroke, width: float, variation: float = 0.15, pace: float = 30.0) -> Array:
    """(n,) float, mm: width of the line at each sample.

    The stroke's own `width` if it has one; else wider with pressure, `width` at a pressure of 0.5; else wider
    where the pen is slower, since more ink flows there: `width` at the speed `pace` (mm/s).

    width : mm.
    variation : float in 0–1: by how much of `width` the line becomes wider at full pressure or at rest, and thinner at
        none or at high speed.
    """
    if stroke.width is not None:
        return np.maximum(stroke.width, _FINEST)
    if stroke.pressure is not None:
        lean = 2 * np.clip(stroke.pressure, 0.0, 1.0) - 1
    else:
        lean = (pace - stroke.speed) / (pace + stroke.speed)
    return np.maximum(width * (1 + variation * lean), _FINEST)


def coverage(drawing: Drawing, dpi: float, *, width: float = 0.4, variation: float = 0.15) -> NDArray[np.uint8]:
    """(h, w) uint8: how much of each pixel of the page the line covers, 255 for all of it.

    drawing : what lies beyond the edge of its page is left out.
    dpi : 20 to 4800.
    width : nominal width of the line, mm, 0.02 to 50; `variation` as in `widths`.

    Raises InputError: a resolution, width or variation out of its bounds, or a page of more than 4 gigapixels.
    """
    scale = dpi / 25.4
    cover = np.zeros(shape(drawing, dpi, width, variation), np.uint8)
    drawing = outline.round_strokes(drawing, scale)
    if drawing.strokes:
        _paint(cover, _pieces(drawing, scale, width, variation))
    return cover


def ink(
    drawing: Drawing, dpi: float, *, width: float = 0.4, colour: Colour = COLOUR, variation: float = 0.15
) -> Raster:
    """Ink a drawing with a plain pen on a transparent page.

    Parameters are those of `coverage`, and the colour of the ink: (r, g, b) in 0–1, device RGB.

    Returns the whole page, (h, w, 4); pixels without ink are zero in all channels, and take memory only near ink.
    """
    cover = coverage(drawing, dpi, width=width, variation=variation)
    rgba = np.zeros((*cover.shape, 4), dtype=np.uint8)
    table = np.empty((256, 4), dtype=np.uint8)
    table[:, :3], table[:, 3] = np.rint(np.multiply(colour, 255)), np.arange(256)
    pixels, rows = rgba.reshape(-1, 4), np.append(np.flatnonzero(cover.any(axis=1)), -1)
    inked = max(int(rows[0]), 0), int(rows.max()) + 1
    for at in inked_parts(cover, inked):
        pixels[at] = table[cover.reshape(-1)[at]]
    return Raster(rgba, dpi, rows=inked)


def shades(colour: Colour = COLOUR, paper: Colour = WHITE) -> NDArray[np.uint8]:
    """(256, 3) uint8: colour of a pixel for each coverage of 0–255, ink of one colour on paper of another."""
    share = np.linspace(0, 1, 256)[:, None]
    mixed = np.asarray(paper) * (1 - share) + np.asarray(colour) * share
    return np.rint(255 * np.clip(mixed, 0, 1)).astype(np.uint8)


def flatten(raster: Raster, paper: Colour = WHITE) -> NDArray[np.uint8]:
    """(h, w, 3) uint8, device RGB: the raster on paper of an even colour (r, g, b in 0–1)."""
    base = np.clip(np.asarray(paper, dtype=np.float32), 0, 1) * 255
    height, width = raster.rgba.shape[:2]
    flat = np.empty((height, width, 3), dtype=np.uint8)
    flat[:] = np.tile(np.rint(base).astype(np.uint8), (width, 1))  # by rows: ten times as fast
    pixels = raster.rgba.reshape(-1, 4)
    for at in inked_parts(raster.inked, raster.rows):
        rgba = pixels[at].astype(np.float32)
        flat.reshape(-1, 3)[at] = np.rint(base + (rgba[:, :3] - base) * (rgba[:, 3:] / 255))
    return flat


def inked_parts(cover: NDArray[Any], rows: tuple[int, int] | None = None) -> Iterator[NDArray[np.intp]]:
    """Flat indices of the pixels (h, w) that are not 0, some rows at a time: most of a page is paper.

    rows : see `values.Raster`.
    """
    width = cover.shape[1]
    first, end = rows or (0, len(cover))
    for top in range(first, end, _ROWS):
        yield np.flatnonzero(np.ascontiguousarray(cover[top : min(top + _ROWS, end)])) + top * width


def shape(drawing: Drawing, dpi: float, width: float, variation: float = 0.0) -> tuple[int, int]:
    """(h, w) pixels of a page, once its resolution and the pen's width have been checked; errors of `coverage`."""
    for name, value, least, greatest in (
        ("resolution (dpi)", dpi, 20, 4800),
        ("pen width (mm)", width, _FINEST, 50),
        ("variation", variation, 0, 1),
    ):
        if not least <= value <= greatest:
            raise InputError(f"{name}: {value:g} is outside {least:g} to {greatest:g}.")
    pixels = drawing.page.width * drawing.page.height * (dpi / 25.4) ** 2
    if pixels > _MOST:
        raise InputError(
            f"A page of {drawing.page.width:g} x {drawing.page.height:g} mm at {dpi:g} dpi has {pixels / 1e9:.1f} "
            f"gigapixels, more than {_MOST / 1e9:g}: use a lower resolution."
        )
    scale = dpi / 25.4
    return max(1, round(drawing.page.height * scale)), max(1, round(drawing.page.width * scale))


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Straight pieces of line, in pixels: both ends as x + i y (m,), and half the width there (m,)."""

    a: NDArray[np.complex128]
    b: NDArray[np.complex128]
    ra: Array
    rb: Array


def _pieces(drawing: Drawing, scale: float, width: float, variation: float) -> _Pieces:
    """All pieces of all strokes; a dot is a piece without length."""
    beziers = curves.beziers(curves.fit(drawing.strokes))
    control = beziers.control * scale
    bend = np.abs(np.diff(control, n=2, axis=0)).max(axis=0)
    length = np.abs(np.diff(control, axis=0)).sum(axis=0)
    # the greatest distance of a cubic from its m chords is at most 3/4 · bend / m²
    count = np.maximum(np.sqrt(0.75 * bend / _FLAT), length / (_LONGEST * scale))
    m = np.clip(np.ceil(count), 1, _MOST_PIECES).astype(np.intp)
    k = np.arange(m.sum()) - np.repeat(np.cumsum(m) - m, m)
    line = _LineWidths(drawing, width, variation)
    ends = []
    for u in (k / np.repeat(m, m), (k + 1) / np.repeat(m, m)):
        a, b, c, d = (np.repeat(row, m) for row in control)
        v = 1 - u
        t = np.repeat(beziers.t[0], m) * v + np.repeat(beziers.t[1], m) * u
        ends += [v * v * (v * a + 3 * u * b) + u * u * (3 * v * c + u * d)]
        ends += [line.width_at(np.repeat(beziers.stroke, m), t) * (scale / 2)]
    return _Pieces(ends[0], ends[2], ends[1], ends[3])


class _LineWidths:
    """Width of the line at any time of any stroke, interpolated over all samples on one continuous clock."""

    def __init__(self, drawing: Drawing, width: float, variation: float) -> None:
        strokes = drawing.strokes
        time = sum(float(s.t[-1] - s.t[0]) for s in strokes)
        pace = drawing.pen_down / time if time > 0 and drawing.pen_down > 0 else 30.0
        span = np.array([s.t[-1] - s.t[0] + 1.0 for s in strokes])
        self._shift = np.cumsum(span) - span - np.array([s.t[0] for s in strokes])
        self._clock = np.concatenate([s.t + shift for s, shift in zip(strokes, self._shift, strict=True)])
        self._width = np.concatenate([widths(s, width, variation, pace) for s in strokes])

    def width_at(self, stroke: NDArray[np.intp], t: Array) -> Array:
        """Width, mm, of the strokes of these indices at these times."""
        return np.asarray(np.interp(t + self._shift[stroke], self._clock, self._width))


def _paint(page: NDArray[np.uint8], pieces: _Pieces) -> None:
    """Cover the pixels of a page; pieces with equally large windows are painted together, `_CHUNK` pixels at a time."""
    reach = np.maximum(pieces.ra, pieces.rb) + 0.5
    low = np.minimum(pieces.a.real, pieces.b.real) - reach, np.minimum(pieces.a.imag, pieces.b.imag) - reach
    high = np.maximum(pieces.a.real, pieces.b.real) + reach, np.maximum(pieces.a.imag, pieces.b.imag) + reach
    height, width = page.shape
    on = (high[0] > 0) & (high[1] > 0) & (low[0] < width) & (low[1] < height)
    left, top = (np.floor(np.where(on, v, 0)).astype(np.int32) for v in low)
    side = np.maximum(np.ceil(high[0]) - left, np.ceil(high[1]) - top)
    for n in np.unique(side[on]).astype(int).tolist():
        group = np.flatnonzero(on & (side == n))
        step = max(1, _CHUNK // (n * n))
        for begin in range(0, len(group), step):
            some = group[begin : begin + step]
            cover = _cover(pieces, some, left[some], top[some], n)
            grid = np.arange(cover.shape[1], dtype=np.int32)
            x, y = (left[some][:, None] + grid)[:, None, :], (top[some][:, None] + grid)[:, :, None]
            inked = (cover > 0) & ((x >= 0) & (x < width)) & ((y >= 0) & (y < height))
            np.maximum.at(page.reshape(-1), (y.astype(np.int64) * width + x)[inked], cover[inked])


def _cover(
    p: _Pieces, some: NDArray[np.intp], left: NDArray[np.int32], top: NDArray[np.int32], n: int
) -> NDArray[np.uint8]:
    """(m, n, n) coverage, 0–255, of the pixels of the windows (left, top) by one piece each."""

    def column(values: Array) -> _Pixels:
        return values.astype(np.float32)[:, None, None]

    a, along = p.a[some], p.b[some] - p.a[some]
    grid = np.arange(n, dtype=np.float32) + np.float32(0.5)
    dx = grid[None, None, :] - column(a.real - left)
    dy = grid[None, :, None] - column(a.imag - top)
    square = np.maximum(np.abs(along) ** 2, 1e-12)
    u = dx * column(along.real / square) + dy * column(along.imag / square)
    np.clip(u, 0, 1, out=u)
    dx, dy = dx - u * column(along.real), dy - u * column(along.imag)
    d = np.sqrt(dx * dx + dy * dy)
    r = column(p.ra[some]) + u * column(p.rb[some] - p.ra[some])
    inside = r - d
    cover = (inside > 0).astype(np.float32)
    edge = np.abs(inside) < _CORNER
    normal = along / np.sqrt(square) * 1j + (along == 0)
    side = np.broadcast_to(normal[:, None, None], d.shape)[edge] * np.float32(1e-3)
    # the share of a pixel that lies within `r` of a line whose distance from its centre is `d`, towards (x, y)
    d, r, x, y = d[edge], r[edge], np.abs(dx[edge]) + np.abs(side.real), np.abs(dy[edge]) + np.abs(side.imag)
    norm = np.sqrt(x * x + y * y)
    long, short = np.maximum(x, y) / norm, np.maximum(np.minimum(x, y) / norm, np.float32(1e-3))
    share = _half(r - d, long, short)
    thin = r + d < _CORNER
    share[thin] -= _half(-r[thin] - d[thin], long[thin], short[thin])
    cover[edge] = share
    return (cover * 255 + np.float32(0.5)).astype(np.uint8)


def _half(s: _Pixels, long: _Pixels, short: _Pixels) -> _Pixels:
    """Share of a pixel on one side of a straight edge that lies `s` beyond its centre.

    A pixel seen along the edge is as thick as a trapezoid is high: `long` + `short` wide at its foot, `long` −
    `short` at its top, where these are the greater and the lesser part of the edge's unit normal.
    """
    past = np.maximum((long + short) / 2 - np.abs(s), 0)
    slope = np.minimum(past, short)
    tail = (slope * slope / (2 * short) + past - slope) / long
    return np.where(s > 0, 1 - tail, tail)
