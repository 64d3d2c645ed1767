"""The scanned page that ink is cut from, and the movement that takes a glyph's line from there to where it is written.

`Source` cuts the ink around a glyph's line from its page and leaves out the ink of other lines.  `course` computes, for
every vertex of the line, how its surroundings are turned and stretched; a `Course` holds the result.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
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


class Source:
    """A page of a hand, to cut ink from."""

    def __init__(self, page: ScannedPage) -> None:
        self.page = page
        self.radius: Array = page.graph.radius / page.pixel

    @cached_property
    def _tree(self) -> cKDTree:
        from scipy.spatial import cKDTree

        return cKDTree(self.page.graph.uv)

    @cached_property
    def _crossing(self) -> NDArray[np.intp]:
        """(2m, 2) int: edges of the page's graph, both ways."""
        edges = self.page.graph.edges
        return np.concatenate([edges, edges[:, ::-1]])

    @cached_property
    def premultiplied(self) -> NDArray[np.uint8]:
        """(h, w, 4) uint8: all ink of the page, from the corner of its texture."""
        ink = self.page.texture.rgba.copy()
        alpha = ink[:, :, 3].astype(np.uint16)
        for k in range(3):
            ink[:, :, k] = (ink[:, :, k] * alpha + 127) // 255
        return ink

    def radius_at(self, uv: Array) -> Array:
        """(n,) float, pixels of the picture: radius of the line at places (n, 2) on it."""
        if not len(self.radius):
            return np.ones(len(uv))
        return np.asarray(self.radius[self._tree.query(uv)[1]])

    def patch(self, box: Box, uv: Array | None) -> _Pixels:
        """(h, w, 4) float32, premultiplied: ink of a part of the picture.

        Parameters
        ----------
        box : (left, top, right, bottom), pixels; outside the picture there is no ink.
        uv : (n, 2) float: vertices of the line; ink nearer to another line of the page is left out; None: none is.
        """
        ink = self._cut(box)
        if uv is not None:
            mine, others = self._vertices(box, uv)
            if len(others):
                ink *= self._kept(box, mine, others)[:, :, None]
        return ink

    def _cut(self, box: Box) -> _Pixels:
        left, top, right, bottom = box
        x, y = self.page.texture.corner
        h, w = self.page.texture.shape
        ink = np.zeros((bottom - top, right - left, 4), dtype=np.float32)
        x0, y0, x1, y1 = max(left, x), max(top, y), min(right, x + w), min(bottom, y + h)
        if x0 < x1 and y0 < y1:
            part = self.page.texture.rgba[y0 - y : y1 - y, x0 - x : x1 - x].astype(np.float32)
            part *= np.float32(1 / 255)
            part[:, :, :3] *= part[:, :, 3:]
            ink[y0 - top : y1 - top, x0 - left : x1 - left] = part
        return ink

    def _vertices(self, box: Box, uv: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Numbers of the page's vertices in a box: those on the line, and the others."""
        away, at = self._tree.query(uv, distance_upper_bound=_OWN)
        mine = np.unique(at[np.isfinite(away)])
        x, y = self.page.graph.uv.T
        left, top, right, bottom = box
        others = (x > left) & (x < right - 1) & (y > top) & (y < bottom - 1)
        others[mine] = False
        return mine, np.flatnonzero(others)

    def _kept(self, box: Box, mine: NDArray[np.intp], others: NDArray[np.intp]) -> _Pixels:
        """(h, w) 0–1: 1 at pixels nearer to the glyph's line than to other lines, with a soft edge around them.

        Where the line goes on into another letter it is cut off round, as a pen's line ends.
        """
        import cv2

        size = (box[3] - box[1], box[2] - box[0])
        corner = np.array(box[:2])
        owner = np.ones(size, dtype=np.uint8)
        number = np.zeros(size, dtype=np.int32)
        every = np.concatenate([others, mine])
        u, v = np.clip(np.rint(self.page.graph.uv[every] - corner).astype(np.intp), 0, np.array(size[::-1]) - 1).T
        owner[v, u], number[v, u] = 0, np.arange(len(every))
        _, label = cv2.distanceTransformWithLabels(owner, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
        at = np.zeros(int(label.max()) + 1, dtype=np.int32)
        at[label[v, u]] = number[v, u]
        share = (at[label] >= len(others)).astype(np.float32)
        for (x, y), radius in self._cuts(mine, corner):
            reach = int(radius + _RIM) + 1
            left, top = max(int(x) - reach, 0), max(int(y) - reach, 0)
            part = share[top : max(int(y) + reach + 2, 0), left : max(int(x) + reach + 2, 0)]
            down, right = np.ogrid[: part.shape[0], : part.shape[1]]
            away = np.hypot(right + left - x, down + top - y)
            np.maximum(part, np.clip((radius + _RIM - away) / (2 * _RIM), 0, 1), out=part, casting="same_kind")
        return np.asarray(np.maximum(share, cv2.blur(share, (3, 3))), dtype=np.float32)

    def _cuts(self, mine: NDArray[np.intp], corner: Any) -> list[tuple[tuple[float, float], float]]:
        """Centre and radius of the glyph's vertices from which the line goes on into another letter, pixels."""
        on_line = np.zeros(len(self.radius), dtype=bool)
        on_line[mine] = True
        a, b = self._crossing.T
        ends = np.unique(a[on_line[a] & ~on_line[b]])
        places = (self.page.graph.uv[ends] - corner).tolist()
        return [((x, y), r) for (x, y), r in zip(places, self.radius[ends].tolist(), strict=True)]


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

    def back(self, place: _Complex, vertex: NDArray[np.intp]) -> _Complex:
        """Places (m,) of the picture from which places (m,) of the page come, each by the movement of a vertex (m,)."""
        away = place - self.at[vertex]
        along, across = np.abs(self.turn), self.width
        even = (along + across)[vertex] / 2 * away
        uneven = ((along - across) / 2 * self.twice)[vertex] * np.conj(away)
        return np.asarray(self.uv[vertex] + (self.turn / along)[vertex] * (even + uneven))


def course(ink: Ink, source: Source, scale: float) -> Course:
    """The course of a glyph on a page of `scale` pixels a mm."""
    graph = ink.graph
    at, uv = _plane(graph.xy) * scale - 0.5 * (1 + 1j), _plane(graph.uv)
    a, b = graph.edges.T
    step, cut = at[b] - at[a], uv[b] - uv[a]
    count = len(at)
    spread = _spread(graph.edges, count)

    def around(values: NDArray[np.complex128]) -> tuple[_Complex, ...]:
        total = np.zeros(count, dtype=np.complex128)
        np.add.at(total, a, values)
        np.add.at(total, b, values)
        total += _SHARE * values.sum()
        near = total
        for _ in range(_SMOOTH):
            total = spread @ total
        return total, near

    square, step_square = around(np.abs(step) ** 2 + 0j)
    moving = np.abs(square) > 0
    radius, source_radius = graph.radius * scale, source.radius_at(graph.uv)
    width = np.abs(_smooth(source_radius, spread) / np.maximum(_smooth(radius, spread), 1e-9))
    wide, narrow = around(np.conj(step) * cut)
    # where a line turns back on itself the movements on its two sides cancel out: the narrower mean is used
    torn = np.abs(wide) < _ALIKE * np.abs(around(np.abs(step) * np.abs(cut) + 0j)[0])
    turn = np.where(
        moving, np.where(torn, narrow, wide) / np.where(moving, np.where(torn, step_square, square), 1), width
    )
    turn = np.where(np.abs(turn) > 1e-6, turn, width)
    twice = np.where(moving, around(step**2)[0] / np.where(moving, square, 1), 0)
    along = np.abs(turn)
    turn *= np.clip(along, _LEAST * width, _MOST * width) / along
    loose = graph.degree < 2
    return _finer(Course(at, uv, radius, turn, width, twice, loose), a, b, np.abs(step))


def _plane(xy: NDArray[np.float64]) -> _Complex:
    return np.asarray(xy[:, 0] + 1j * xy[:, 1])


def _spread(edges: NDArray[np.intp], count: int) -> Any:
    """Matrix (n, n) that gives every vertex the mean of itself and its neighbours."""
    from scipy.sparse import csr_matrix

    vertex = np.arange(count)
    a, b = edges.T
    rows, columns = np.concatenate([a, b, vertex]), np.concatenate([b, a, vertex])
    weight = 1 / np.bincount(rows, minlength=count)
    return csr_matrix((weight[rows], (rows, columns)), shape=(count, count))


def _smooth(values: NDArray[np.float64], spread: Any) -> NDArray[np.float64]:
    for _ in range(_SMOOTH):
        values = spread @ values
    return values


def _finer(line: Course, a: NDArray[np.intp], b: NDArray[np.intp], length: NDArray[np.float64]) -> Course:
    """The course with vertices between those that lie far apart."""
    more = np.maximum(np.ceil(length / _STEP).astype(np.intp) - 1, 0)
    if not more.any():
        return line
    edge = np.repeat(np.arange(len(more)), more)
    part = (np.arange(len(edge)) - np.repeat(np.cumsum(more) - more, more) + 1) / (more[edge] + 1)
    a, b = a[edge], b[edge]

    def both(values: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([values, values[a] * (1 - part) + values[b] * part])

    loose = np.concatenate([line.loose, np.zeros(len(edge), dtype=bool)])
    parts = (line.at, line.uv, line.radius, line.turn, line.width, line.twice)
    at, uv, radius, turn, width, twice = (both(values) for values in parts)
    return Course(at, uv, radius, turn, width, twice, loose)
