"""The scanned page that ink is cut from, and the movement that takes a glyph's line from there to where it is written.

`InkSource` cuts the ink around a glyph's line from its page and leaves out the ink of other lines.  `course` computes,
for every vertex of a line, how its surroundings are turned and stretched; a `Course` holds the result.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import ScannedPage
from handout.libraries import cv2
from handout.values import Array, Ink
from handout.writing.forms import square_distances

_OWN = 0.8  # pixels within which a vertex of the page is the glyph's: less than the distance of two vertices
_NEAR = 3.0  # pixels around a line, which lies along its page's, in which the page's is looked for

_BAND = 64  # pixels: height of the bands in which vertices are looked up

_Pixels = NDArray[np.float32]
Box = tuple[int, int, int, int]


class InkSource:
    """A page of a hand, to cut ink from."""

    def __init__(self, page: ScannedPage) -> None:
        self.page = page
        self.radius: Array = page.graph.radius / page.pixel

    @cached_property
    def _by_band(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.int16], Array]:
        """(n,) the vertices from left to right, (n,) their numbers there, band after band of the picture, (n,) the
        bands of those, and (2, n) their places, pixels."""
        order = np.argsort(self.page.graph.uv[:, 0])
        band = np.floor(self.page.graph.uv[order, 1] / _BAND).astype(np.int16)  # which are sorted at once
        number = np.argsort(band, kind="stable")
        return order, number, band[number], self.page.graph.uv.T.take(order[number], axis=1)

    @cached_property
    def premultiplied_ink(self) -> NDArray[np.uint8]:
        """(h, w, 4) uint8: all ink of the page, from the corner of its texture."""
        return np.asarray(cv2.cvtColor(self.page.texture.rgba, cv2.COLOR_RGBA2mRGBA), dtype=np.uint8)

    def part(self, box: Box) -> NDArray[np.uint8]:
        """(h, w, 4) uint8, straight alpha: ink of a part of the picture (left, top, right, bottom), pixels; outside the
        picture there is none."""
        left, top, right, bottom = box
        (x, y), (h, w) = self.page.texture.corner, self.page.texture.shape
        ink = np.zeros((bottom - top, right - left, 4), dtype=np.uint8)
        x0, y0, x1, y1 = max(left, x), max(top, y), min(right, x + w), min(bottom, y + h)
        if x0 < x1 and y0 < y1:
            part = self.page.texture.part(slice(y0 - y, y1 - y), slice(x0 - x, x1 - x))
            ink[y0 - top : y1 - top, x0 - left : x1 - left] = part
        return ink

    def others(self, box: Box, own: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Vertices (n,) in a part of the picture that are not on a glyph's line, and those (m,) on it from which the
        line goes on into another letter.

        own : (k,) int: the page's vertices on the line.
        """
        left, top, right, bottom = box
        on_line = np.zeros(len(self.radius), dtype=bool)
        on_line[own] = True
        near = self.within((left, top, right - 1, bottom - 1))
        neighbours, first = self.page.graph.neighbour_lists
        mine = np.flatnonzero(on_line)
        count = first[mine + 1] - first[mine]
        position = np.repeat(first[mine] - (np.cumsum(count) - count), count) + np.arange(count.sum())
        ends = np.unique(np.repeat(mine, count)[~on_line[neighbours[position]]])
        return near[~on_line[near]], ends

    def within(self, box: tuple[float, float, float, float]) -> NDArray[np.intp]:
        """Vertices (n,) inside a part of the picture (left, top, right, bottom), pixels."""
        (order, number, band, places), (left, top, right, bottom) = self._by_band, box
        near = slice(*band.searchsorted(np.floor([top / _BAND, bottom / _BAND + 1]).astype(np.int16)))
        x, y = places[:, near]
        return np.asarray(order[np.sort(number[near][(x > left) & (x < right) & (y > top) & (y < bottom)])])


def own_vertices(inks: Sequence[Ink], sources: Mapping[int, InkSource]) -> list[tuple[Array, NDArray[np.intp]]]:
    """For each ink the radius (n,) of its line in the picture, pixels, and the page's vertices on it."""
    found = []
    for ink in inks:
        source, uv = sources[ink.source], ink.graph.uv
        near = source.within((*(uv.min(axis=0) - _NEAR), *(uv.max(axis=0) + _NEAR)))
        near = near if len(near) else np.arange(len(source.radius))
        if not len(near):  # a page without any
            found.append((np.ones(len(uv)), near))
            continue
        apart = square_distances(uv, source.page.graph.uv[near])
        at = near[apart.argmin(axis=1)]
        found.append((source.radius[at], at[apart.min(axis=1) < _OWN**2]))
    return found


@lru_cache(maxsize=8)
def source_of(page: ScannedPage) -> InkSource:
    """The page to cut ink from; what is worked out of it once serves all pages that are written."""
    return InkSource(page)


_SMOOTH = 6  # rounds in which a vertex takes on its neighbours' movement
_STEP = 1.2  # pixels between vertices, at most
_LEAST, _MOST = 0.5, 2.0  # stretch along the line over stretch across it, at least and at most
_ALIKE = 0.8  # length of the mean movement around a vertex over their mean length: below, they cancel out
_SHARE = 1e-6  # weight of the whole glyph's movement at each vertex, which decides for a dot

_Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Course:
    """Vertices of the lines of some glyphs, glyph after glyph, on each at most `_STEP` apart; places are x + i y.

    at : (n,) complex, pixels of the page that is written.
    uv : (n,) complex, pixels of the picture.
    radius : (n,) float, pixels of the page.
    turn : (n,) complex: factor, from page to picture, of a step along the line: rotation and stretch.
    width : (n,) float: stretch of a step across the line.
    twice : (n,) complex: direction of the line on the page with its angle doubled; shorter than 1 where lines meet.
    loose : (n,) bool: ends of lines.
    glyph : (n,) int: which glyph each is of.
    """

    at: _Complex
    uv: _Complex
    radius: NDArray[np.float64]
    turn: _Complex
    width: NDArray[np.float64]
    twice: _Complex
    loose: NDArray[np.bool_]
    glyph: NDArray[np.intp]

    def take(self, vertices: NDArray[np.intp]) -> Course:
        """Some of the vertices."""
        return Course(*(getattr(self, each.name)[vertices] for each in fields(self)))

    def movement(self) -> tuple[_Complex, _Complex, _Complex]:
        """(n,) each: by each vertex, where places z of the page come from in the picture:
        start + turn · z + mirror · conj(z)."""
        along, unit = np.abs(self.turn), self.turn / np.abs(self.turn)
        turn, mirror = unit * (along + self.width) / 2, unit * (along - self.width) / 2 * self.twice
        return self.uv - turn * self.at - mirror * np.conj(self.at), turn, mirror

    def even_movement(self) -> tuple[_Complex, _Complex, _Complex]:
        """(n,) each, as `movement`: for all vertices of a glyph the one that fits them best."""
        count = np.bincount(self.glyph)

        def mean(values: _Complex) -> _Complex:
            return _sums(self.glyph, values, len(count)) / count

        middle, target = mean(self.at), mean(self.uv)
        away, cut = self.at - middle[self.glyph], self.uv - target[self.glyph]
        # a straight line does not determine the movement beside it: a small weight on a similarity does
        reach = np.zeros(len(count))
        np.maximum.at(reach, self.glyph, np.abs(away))
        size = 0.01 * (reach + 1.0) ** 2 / count
        square, both = mean(np.abs(away) ** 2 + 0j).real, mean(away**2)
        along, across = mean(np.conj(away) * cut), mean(away * cut)
        along += size * np.where(square > 0, along / np.where(square > 0, square, 1), mean(self.turn))
        whole = (square + size) ** 2 - np.abs(both) ** 2
        turn = ((square + size) * along - np.conj(both) * across) / whole
        mirror = ((square + size) * across - both * along) / whole
        start = target - turn * middle - mirror * np.conj(middle)
        return start[self.glyph], turn[self.glyph], mirror[self.glyph]


def factors(start: _Complex, turn: _Complex, mirror: _Complex) -> _Pixels:
    """(6, n) float32: a, b, c, d, e, f for u = a + b x + c y and v = d + e x + f y, of n affine movements of the plane
    by z ↦ start + turn · z + mirror · conj(z)."""
    sums, apart = turn + mirror, turn - mirror
    return np.array([start.real, sums.real, -apart.imag, start.imag, sums.imag, apart.real], dtype=np.float32)


def course(inks: Sequence[Ink], source_radius: Sequence[Array], scales: Array) -> Course:
    """The course of glyphs; for each the radius (n,) of its line in the picture, and pixels of the page a mm."""
    sizes = np.array([len(ink.graph) for ink in inks])
    glyph, first = np.repeat(np.arange(len(inks)), sizes), np.cumsum(sizes) - sizes
    xy, uv, radius = (np.concatenate([getattr(ink.graph, part) for ink in inks]) for part in ("xy", "uv", "radius"))
    scale, count = scales[glyph], len(xy)
    at, uv, radius = _plane(xy) * scale - 0.5 * (1 + 1j), _plane(uv), radius * scale
    a, b = np.concatenate([ink.graph.edges + start for ink, start in zip(inks, first, strict=True)]).T
    step, cut = at[b] - at[a], uv[b] - uv[a]
    # every vertex is given the mean of itself and its neighbours
    vertex = np.arange(count)
    rows, other = np.concatenate([a, b, vertex]), np.concatenate([b, a, vertex])
    order = np.lexsort((other, rows))
    size = np.bincount(rows, minlength=count)
    ends, beside, share = np.cumsum(size) - size, other[order], (1 / size)[rows[order]]

    def sum_around(values: _Complex) -> _Complex:
        """(n,) sums over the edges at each vertex."""
        return (
            _sums(np.concatenate([a, b]), np.tile(values, 2), count)
            + _SHARE * _sums(glyph[a], values, len(inks))[glyph]
        )

    step_square, narrow, length, direction = (
        sum_around(values)
        for values in (np.abs(step) ** 2 + 0j, np.conj(step) * cut, np.abs(step) * np.abs(cut) + 0j, step**2)
    )
    columns = [part for values in (step_square, narrow, length, direction) for part in (values.real, values.imag)]
    smooth = [*columns, np.concatenate(source_radius), radius]
    for _ in range(_SMOOTH):
        smooth = [np.add.reduceat(share * values[beside], ends) for values in smooth]
    square, wide, long, along_line = (smooth[k] + 1j * smooth[k + 1] for k in range(0, 8, 2))
    moving = np.abs(square) > 0
    width = np.abs(smooth[8] / np.maximum(smooth[9], 1e-9))
    # where a line turns back on itself the movements on its two sides cancel out: the narrower mean is used
    torn = np.abs(wide) < _ALIKE * np.abs(long)
    turn = np.where(
        moving, np.where(torn, narrow, wide) / np.where(moving, np.where(torn, step_square, square), 1), width
    )
    turn = np.where(np.abs(turn) > 1e-6, turn, width)
    twice = np.where(moving, along_line / np.where(moving, square, 1), 0)
    along = np.abs(turn)
    turn *= np.clip(along, _LEAST * width, _MOST * width) / along
    return _finer(Course(at, uv, radius, turn, width, twice, size < 3, glyph), a, b, np.abs(step))


def _sums(at: NDArray[np.intp], values: _Complex, count: int) -> _Complex:
    """(count,) sums of the values at each of some places."""
    return np.asarray(np.bincount(at, values.real, count) + 1j * np.bincount(at, values.imag, count))


def _plane(xy: NDArray[np.float64]) -> _Complex:
    return np.asarray(xy[:, 0] + 1j * xy[:, 1])


def _finer(line: Course, a: NDArray[np.intp], b: NDArray[np.intp], length: Array) -> Course:
    """The course with vertices where edges (m,) are long."""
    more = np.maximum(np.ceil(length / _STEP).astype(np.intp) - 1, 0)
    edge = np.repeat(np.arange(len(more)), more)
    part = (np.arange(len(edge)) - np.repeat(np.cumsum(more) - more, more) + 1) / (more[edge] + 1)
    a, b = a[edge], b[edge]
    between = {
        name: (values := getattr(line, name))[a] * (1 - part) + values[b] * part
        for name in ("at", "uv", "radius", "turn", "width", "twice")
    }
    new = replace(line.take(a), loose=np.zeros(len(edge), dtype=bool), **between)
    order = np.argsort(np.concatenate([line.glyph, new.glyph]), kind="stable")
    parts = (np.concatenate([getattr(some, each.name) for some in (line, new)]) for each in fields(line))
    return Course(*(values[order] for values in parts))
