"""The scanned page that ink is cut from, and the movement that takes a glyph's line from there to where it is written.

`InkSource` cuts the ink around a glyph's line from its page and leaves out the ink of other lines.  `courses` computes,
for every vertex of a line, how its surroundings are turned and stretched; a `Course` holds the result.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import ScannedPage
from handout.values import Array, Ink

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_OWN = 0.8  # pixels within which a vertex of the page is the glyph's: less than the distance of two vertices
_RIM = 1.0  # pixels on either side of its radius over which a line that is cut fades, as the rim of a lifted pen does

_Pixels = NDArray[np.float32]
Box = tuple[int, int, int, int]


class InkSource:
    """A page of a hand, to cut ink from."""

    def __init__(self, page: ScannedPage) -> None:
        self.page = page
        self.radius: Array = page.graph.radius / page.pixel

    @cached_property
    def tree(self) -> cKDTree:
        from scipy.spatial import cKDTree

        return cKDTree(self.page.graph.uv)

    @cached_property
    def _neighbours(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """(n + 1,) where the neighbours of each vertex begin, and (2m,) the neighbours, by vertex."""
        edges = self.page.graph.edges
        both = np.concatenate([edges, edges[:, ::-1]])
        both = both[np.argsort(both[:, 0], kind="stable")]
        return np.searchsorted(both[:, 0], np.arange(len(self.radius) + 1)), both[:, 1]

    @cached_property
    def _by_x(self) -> tuple[NDArray[np.intp], Array]:
        """(n,) the vertices from left to right, and (n,) their x."""
        x = self.page.graph.uv[:, 0]
        order = np.argsort(x)
        return order, x[order]

    @cached_property
    def premultiplied_ink(self) -> NDArray[np.uint8]:
        """(h, w, 4) uint8: all ink of the page, from the corner of its texture."""
        ink = self.page.texture.rgba.copy()
        alpha = ink[:, :, 3].astype(np.uint16)
        for k in range(3):
            ink[:, :, k] = (ink[:, :, k] * alpha + 127) // 255
        return ink

    def patch(self, box: Box, own: NDArray[np.intp]) -> _Pixels:
        """(h, w, 4) float32, premultiplied: ink of a part of the picture.

        Parameters
        ----------
        box : (left, top, right, bottom), pixels; outside the picture there is no ink.
        own : (n,) int: the page's vertices on the line; ink nearer to another line of the page is left out.
        """
        left, top, right, bottom = box
        order, x = self._by_x
        near = order[np.searchsorted(x, left, side="right") : np.searchsorted(x, right - 1)]
        y = self.page.graph.uv[near, 1]
        on_line = np.zeros(len(self.radius), dtype=bool)
        on_line[own] = True
        others = near[(y > top) & (y < bottom - 1) & ~on_line[near]]
        ink = self._cut_box(box)
        if len(others):
            ink *= self._find_own_share(box, on_line, others)[:, :, None]
        return ink

    def _cut_box(self, box: Box) -> _Pixels:
        left, top, right, bottom = box
        x, y = self.page.texture.corner
        h, w = self.page.texture.shape
        ink = np.zeros((bottom - top, right - left, 4), dtype=np.float32)
        x0, y0, x1, y1 = max(left, x), max(top, y), min(right, x + w), min(bottom, y + h)
        if x0 < x1 and y0 < y1:
            part = self.page.texture.part(slice(y0 - y, y1 - y), slice(x0 - x, x1 - x)).astype(np.float32)
            part *= np.float32(1 / 255)
            part[:, :, :3] *= part[:, :, 3:]
            ink[y0 - top : y1 - top, x0 - left : x1 - left] = part
        return ink

    def _find_own_share(self, box: Box, on_line: NDArray[np.bool_], others: NDArray[np.intp]) -> _Pixels:
        """(h, w) 0–1: 1 at pixels nearer to the glyph's line than to other lines, with a soft edge around them.

        Where the line goes on into another letter it is cut off round, as a pen's line ends.
        """
        import cv2

        size = (box[3] - box[1], box[2] - box[0])
        corner = np.array(box[:2])
        owner = np.ones(size, dtype=np.uint8)
        number = np.zeros(size, dtype=np.int32)
        mine = np.flatnonzero(on_line)
        every = np.concatenate([others, mine])
        u, v = np.clip(np.rint(self.page.graph.uv[every] - corner).astype(np.intp), 0, np.array(size[::-1]) - 1).T
        owner[v, u], number[v, u] = 0, np.arange(len(every))
        _, label = cv2.distanceTransformWithLabels(owner, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
        own = np.zeros(len(every) + 1, dtype=np.float32)
        own[label[v, u]] = number[v, u] >= len(others)
        share = np.asarray(own[label])
        # the glyph's vertices from which the line goes on into another letter
        first, neighbours = self._neighbours
        count = first[mine + 1] - first[mine]
        position = np.repeat(first[mine] - (np.cumsum(count) - count), count) + np.arange(count.sum())
        ends = np.unique(np.repeat(mine, count)[~on_line[neighbours[position]]])
        places = (self.page.graph.uv[ends] - corner).tolist()
        for (x, y), radius in zip(places, self.radius[ends].tolist(), strict=True):
            reach = int(radius + _RIM) + 1
            left, top = max(int(x) - reach, 0), max(int(y) - reach, 0)
            part = share[top : max(int(y) + reach + 2, 0), left : max(int(x) + reach + 2, 0)]
            down, right = np.ogrid[: part.shape[0], : part.shape[1]]
            away = np.hypot(right + left - x, down + top - y)
            np.maximum(part, np.clip((radius + _RIM - away) / (2 * _RIM), 0, 1), out=part, casting="same_kind")
        return np.asarray(np.maximum(share, cv2.blur(share, (3, 3))), dtype=np.float32)


def own_vertices(inks: Sequence[Ink], sources: Mapping[int, InkSource]) -> list[tuple[Array, NDArray[np.intp]]]:
    """For each ink the radius (n,) of its line in the picture, pixels, and the page's vertices on it."""
    found = {}
    for number in {ink.source for ink in inks}:
        some = [k for k, ink in enumerate(inks) if ink.source == number]
        away, at = sources[number].tree.query(np.concatenate([inks[k].graph.uv for k in some]))
        radius, end = np.append(sources[number].radius, 1.0), 0  # 1 for a page without any
        for k in some:
            part = np.s_[end : (end := end + len(inks[k].graph))]
            found[k] = radius[at[part]], at[part][away[part] < _OWN]
    return [found[k] for k in range(len(inks))]


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
    """Vertices of a line, at most `_STEP` apart; places are x + i y.

    at : (n,) complex, pixels of the page that is written.
    uv : (n,) complex, pixels of the picture.
    radius : (n,) float, pixels of the page.
    turn : (n,) complex: factor, from page to picture, of a step along the line: rotation and stretch.
    width : (n,) float: stretch of a step across the line.
    twice : (n,) complex: direction of the line on the page with its angle doubled; shorter than 1 where lines meet.
    loose : (n,) bool: ends of lines.
    """

    at: _Complex
    uv: _Complex
    radius: NDArray[np.float64]
    turn: _Complex
    width: NDArray[np.float64]
    twice: _Complex
    loose: NDArray[np.bool_]

    def movement(self, origin: complex, goal: complex) -> _Pixels:
        """(6, n): by each vertex, where places of the page come from in the picture; see `movements`.

        origin, goal : what places are told from, on the page and in the picture.
        """
        along, across, unit = np.abs(self.turn), self.width, self.turn / np.abs(self.turn)
        turn, mirror = unit * (along + across) / 2, unit * (along - across) / 2 * self.twice
        away = origin - self.at
        return movements(self.uv - goal + turn * away + mirror * np.conj(away), turn, mirror)


def movements(start: _Complex, turn: _Complex, mirror: _Complex) -> _Pixels:
    """(6, n) float32: a, b, c, d, e, f for u = a + b x + c y and v = d + e x + f y, of n affine movements of the plane
    by z ↦ start + turn · z + mirror · conj(z)."""
    sums, apart = turn + mirror, turn - mirror
    rows = (start.real, sums.real, -apart.imag, start.imag, sums.imag, apart.real)
    found = np.empty((6, len(start)), dtype=np.float32)
    for row, values in zip(found, rows, strict=True):
        row[:] = values
    return found


def courses(inks: Sequence[Ink], source_radius: Sequence[Array], scales: Sequence[float]) -> list[Course]:
    """The courses of glyphs; for each the radius (n,) of its line in the picture, and pixels of the page a mm."""
    from scipy.sparse import csr_matrix

    sizes = np.array([len(ink.graph) for ink in inks])
    glyph, first = np.repeat(np.arange(len(inks)), sizes), np.cumsum(sizes) - sizes
    xy, uv, radius = (np.concatenate([getattr(ink.graph, part) for ink in inks]) for part in ("xy", "uv", "radius"))
    scale, count = np.array(scales)[glyph], len(xy)
    at, uv, radius = _plane(xy) * scale - 0.5 * (1 + 1j), _plane(uv), radius * scale
    a, b = np.concatenate([ink.graph.edges + start for ink, start in zip(inks, first, strict=True)]).T
    step, cut = at[b] - at[a], uv[b] - uv[a]
    # a matrix that gives every vertex the mean of itself and its neighbours
    vertex = np.arange(count)
    rows, other = np.concatenate([a, b, vertex]), np.concatenate([b, a, vertex])
    order = np.lexsort((other, rows))
    size = np.bincount(rows, minlength=count)
    ends = np.concatenate([[0], np.cumsum(size)])
    spread = csr_matrix(((1 / size)[rows[order]], other[order], ends), shape=(count, count))

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
    smooth = np.stack([*columns, np.concatenate(source_radius), radius], axis=1)
    for _ in range(_SMOOTH):
        smooth = spread @ smooth
    square, wide, long, along_line = (smooth[:, k] + 1j * smooth[:, k + 1] for k in range(0, 8, 2))
    moving = np.abs(square) > 0
    width = np.abs(smooth[:, 8] / np.maximum(smooth[:, 9], 1e-9))
    # where a line turns back on itself the movements on its two sides cancel out: the narrower mean is used
    torn = np.abs(wide) < _ALIKE * np.abs(long)
    turn = np.where(
        moving, np.where(torn, narrow, wide) / np.where(moving, np.where(torn, step_square, square), 1), width
    )
    turn = np.where(np.abs(turn) > 1e-6, turn, width)
    twice = np.where(moving, along_line / np.where(moving, square, 1), 0)
    along = np.abs(turn)
    turn *= np.clip(along, _LEAST * width, _MOST * width) / along
    return _finer(Course(at, uv, radius, turn, width, twice, size < 3), glyph, len(inks), a, b, np.abs(step))


def _sums(at: NDArray[np.intp], values: _Complex, count: int) -> _Complex:
    """(count,) sums of the values at each of some places."""
    return np.asarray(np.bincount(at, values.real, count) + 1j * np.bincount(at, values.imag, count))


def _plane(xy: NDArray[np.float64]) -> _Complex:
    return np.asarray(xy[:, 0] + 1j * xy[:, 1])


def _finer(
    line: Course, glyph: NDArray[np.intp], glyphs: int, a: NDArray[np.intp], b: NDArray[np.intp], length: Array
) -> list[Course]:
    """The course of each glyph, from that of all vertices (n,), with vertices where edges (m,) are long."""
    more = np.maximum(np.ceil(length / _STEP).astype(np.intp) - 1, 0)
    edge = np.repeat(np.arange(len(more)), more)
    part = (np.arange(len(edge)) - np.repeat(np.cumsum(more) - more, more) + 1) / (more[edge] + 1)
    a, b = a[edge], b[edge]
    glyph = np.concatenate([glyph, glyph[a]])
    order = np.argsort(glyph, kind="stable")
    ends = np.cumsum(np.bincount(glyph, minlength=glyphs))[:-1]

    def append_between(values: NDArray[Any]) -> list[NDArray[Any]]:
        return np.split(np.concatenate([values, values[a] * (1 - part) + values[b] * part])[order], ends)

    parts = (line.at, line.uv, line.radius, line.turn, line.width, line.twice)
    loose = np.split(np.append(line.loose, np.zeros(len(edge), dtype=bool))[order], ends)
    return [Course(*each) for each in zip(*map(append_between, parts), loose, strict=True)]
