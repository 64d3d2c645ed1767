"""The line of a scanned glyph where it is written, and how its surroundings are moved there from the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.inking.source import Source
from handout.values import Ink

_SMOOTH = 6  # rounds in which a vertex takes on its neighbours' movement
_STEP = 1.2  # pixels between vertices, at most
_LEAST, _MOST = 0.5, 2.0  # what a line's length may change by, of what its width does
_ALIKE = 0.8  # of the movements around a vertex, that is left in their mean
_SHARE = 1e-6  # of the whole glyph's movement in every vertex's: what a dot goes by

_Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Course:
    """Vertices of a line, at most `_STEP` apart; places are x + i y.

    at : (n,) complex, pixels of the page that is written.
    uv : (n,) complex, pixels of the picture.
    radius : (n,) float, pixels of the page.
    turn : (n,) complex: movement along the line from page to picture is multiplied by this.
    width : (n,) float: movement across the line is so many times as long in the picture.
    twice : (n,) complex: direction of the line on the page, its angle doubled; shorter than 1 where there are several.
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
        """Where in the picture places (m,) of the page come from, as the vertices (m,) beside them are moved."""
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
    known = np.abs(square) > 0
    radius, own = graph.radius * scale, source.radius_at(graph.uv)
    width = np.abs(_smooth(own, spread) / np.maximum(_smooth(radius, spread), 1e-9))
    wide, narrow = around(np.conj(step) * cut)
    # where a way turns back on itself the movements on either side are opposite, and their middle is none
    torn = np.abs(wide) < _ALIKE * np.abs(around(np.abs(step) * np.abs(cut) + 0j)[0])
    turn = np.where(
        known, np.where(torn, narrow, wide) / np.where(known, np.where(torn, step_square, square), 1), width
    )
    turn = np.where(np.abs(turn) > 1e-6, turn, width)
    twice = np.where(known, around(step**2)[0] / np.where(known, square, 1), 0)
    along = np.abs(turn)
    turn *= np.clip(along, _LEAST * width, _MOST * width) / along
    loose = graph.degree < 2
    return _finer(Course(at, uv, radius, turn, width, twice, loose), a, b, np.abs(step))


def _plane(xy: NDArray[np.float64]) -> _Complex:
    return np.asarray(xy[:, 0] + 1j * xy[:, 1])


def _spread(edges: NDArray[np.intp], count: int) -> Any:
    """Matrix (n, n) that gives every vertex the mean of itself and its neighbours."""
    from scipy.sparse import csr_matrix

    own = np.arange(count)
    a, b = edges.T
    rows, columns = np.concatenate([a, b, own]), np.concatenate([b, a, own])
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
