"""Short pieces of a pen's line, from any pages written with it, to write another line with.

A piece is known by its course and by how wide and how dense the line is along it, each in four parts.  It lies clear of
all other lines of its page, so that its surroundings can be taken along.

Source: seed 000, §7.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand.measures import in_other_ink
from handout.hand.scanned import ScannedHand, ScannedPage
from handout.libraries import spatial
from handout.values import Array, Indices, LineGraph
from handout.writing.choosing import fading_cost

LENGTH = 3.2  # median radii of the line: length of a piece
CLEAR = 0.25  # mm beside the line where there must be no other
BINS = 4
FEATURES = 4 * BINS + 2
_STARTS = 6  # pieces begin so many times in each length
_FEWEST = 12
_WIDTH, _DENSITY, _END = 0.5, 0.5, 1.0  # weights beside that of the course
_LIKE, _AFTER = 24, 90  # pieces looked at for each place; choices after which a piece is as good as new
_AGAIN, _GOES_ON = 0.5, 0.4  # cost of a piece that has just been used; gain of one that goes on where the last ended


@dataclass(frozen=True, eq=False)
class Track:
    """A line from junction or end to junction or end, laid out by length.

    along : (n,) float, mm from its beginning.
    xy : (n, 2) float, mm.
    uv : (n, 2) float, pixels of the picture.
    radius : (n,) float, mm.
    density : (n,) float.
    loose : whether it begins, and whether it ends, without touching another.
    """

    along: Array
    xy: Array
    uv: Array
    radius: Array
    density: Array
    loose: tuple[bool, bool]

    @property
    def length(self) -> float:
        """mm."""
        return float(self.along[-1])

    @cached_property
    def _table(self) -> Array:
        return np.column_stack([self.xy, self.uv, self.radius, self.density])

    def rows(self, at: Array) -> Array:
        """(n, 6) float: x, y, u, v, radius and density after so many mm, (n,)."""
        if len(self.along) < 2:
            return np.repeat(self._table, len(at), axis=0)
        low = np.clip(np.searchsorted(self.along, at, side="right") - 1, 0, len(self.along) - 2)
        span = np.maximum(self.along[low + 1] - self.along[low], 1e-12)
        part = np.clip((at - self.along[low]) / span, 0, 1)[:, None]
        return np.asarray(self._table[low] * (1 - part) + self._table[low + 1] * part)

    def places(self, at: Array) -> Array:
        """(…, 2) float: places on the page after so many mm."""
        return np.stack([np.interp(at, self.along, self.xy[:, k]) for k in (0, 1)], axis=-1)

    def features(self, start: Array, length: float, radius: float) -> Array:
        """(m, FEATURES) float: what pieces are told by that begin after so many mm, (m,), and are `length` mm long.

        radius : mm, of the usual line.
        """
        ends = start[:, None] + np.linspace(0, length, BINS + 1)
        middle = (ends[:, 1:] + ends[:, :-1]) / 2
        course = np.diff(self.places(ends), axis=1).reshape(len(start), -1) / length * 2
        width = np.interp(middle, self.along, self.radius) / radius
        dense = np.interp(middle, self.along, self.density)
        slack = 0.3 * length
        first = self.loose[0] & (start < slack)
        last = self.loose[1] & (start + length > self.length - slack)
        rows = [course, _WIDTH * width, _DENSITY * dense, _END * np.stack([first, last], axis=1)]
        return np.concatenate(rows, axis=1)


def tracks(graph: LineGraph) -> list[Track]:
    """The lines of a graph in mm; a dot is one of no length."""
    lines = []
    for path in graph.branches:
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(graph.xy[path], axis=0), axis=1))])
        loose = (bool(graph.degree[path[0]] < 2), bool(graph.degree[path[-1]] < 2))
        lines.append(Track(along, graph.xy[path], graph.uv[path], graph.radius[path], graph.density[path], loose))
    return lines


@dataclass(frozen=True, eq=False)
class Swatches:
    """Pieces of a pen's line on one page, each in both directions.

    page : number of the page.
    tracks : the lines that they are pieces of.
    track : (k,) int; start : (k,) float, mm along it; back : (k,) bool, whether read from its end.
    features : (k, FEATURES), see `Track.features`.
    length, radius : mm, of a piece and of the usual line.
    """

    page: int
    tracks: tuple[Track, ...]
    track: Indices
    start: Array
    features: Array
    length: float
    radius: float

    @cached_property
    def _tree(self) -> spatial.cKDTree:
        return spatial.cKDTree(self.features)

    @cached_property
    def _piece_numbers(self) -> Indices:
        """(k,) int: one number for pieces that overlap, which are one and the same to the eye."""
        place = np.floor(self.start / (self.length / 2)).astype(np.intp)
        first = np.concatenate([[True], (np.diff(self.track) != 0) | (np.diff(place) != 0)])
        return np.asarray(np.cumsum(first) - 1, dtype=np.intp)

    def choose(self, wanted: Array, follows: NDArray[np.bool_]) -> Indices:
        """(n,) int: a piece for each of the features (n, FEATURES), like it, but not one that was used shortly before.

        follows : (n,) bool: whether a piece lies half a length further on the same line than the one before.
        """
        near, at = self._tree.query(wanted, k=min(_LIKE, len(self.features)))
        near, at = near.reshape(len(wanted), -1), at.reshape(len(wanted), -1)
        same = self._piece_numbers
        used = np.full(int(same.max()) + 1, -_AFTER)
        chosen = np.zeros(len(wanted), dtype=np.intp)
        last, on = -1, _STARTS // 2
        for number in range(len(wanted)):
            some, cost = at[number], near[number]
            onward = last + on
            if follows[number] and onward < len(self.track) and self.track[onward] == self.track[last]:
                goes_on = float(np.linalg.norm(self.features[onward] - wanted[number])) - _GOES_ON
                some, cost = np.append(some, onward), np.append(cost, goes_on)
            cost = cost + fading_cost(number - used[same[some]], _AGAIN, _AFTER)
            last = int(some[cost.argmin()])
            used[same[last]] = number
            chosen[number] = last
        return chosen


@lru_cache(maxsize=2)  # several layers of a page, and all pages of a batch, are written with one pen
def swatches(sample: ScannedHand) -> tuple[Swatches, ...]:
    """The pieces of every page that has enough of them.

    Raises InputError: no page has.

    Source: seed 000, §7.2.
    """
    of_pages = [_of_page(number, page, letter_vertices(sample, number)) for number, page in enumerate(sample.pages)]
    enough = tuple(pen for pen in of_pages if len(pen.start) >= _FEWEST)
    if not enough:
        raise InputError(
            f"{sample.name}: there are too few clear pieces of line to take a pen from; scribble half a page of loose "
            "waves and strokes with it, not over each other."
        )
    return enough


def letter_vertices(sample: ScannedHand, page: int) -> NDArray[np.bool_]:
    """Vertices (n,) of a page that are letters in its usual ink; all where none is known: a sheet's edge is no ink."""
    other = set(np.flatnonzero(in_other_ink(sample.author or sample)).tolist())
    glyphs = [glyph.vertices for n, glyph in enumerate(sample.glyphs) if glyph.page == page and n not in other]
    lettered = np.full(len(sample.pages[page].graph), not glyphs)
    for vertices in glyphs:
        lettered[vertices] = True
    return lettered


def _of_page(number: int, page: ScannedPage, ink: NDArray[np.bool_]) -> Swatches:
    graph = page.graph
    radius = float(np.median(graph.radius[ink])) if ink.any() else 1.0
    length = LENGTH * radius
    lines, track, start, features = list[Track](), [np.zeros(0)], [np.zeros(0)], [np.zeros((0, FEATURES))]
    free_of_others = clear(graph) & ink
    for path, line in zip(graph.branches, tracks(graph), strict=True):
        xy, uv, wide, density = (values[::-1] for values in (line.xy, line.uv, line.radius, line.density))
        back = Track(line.along[-1] - line.along[::-1], xy, uv, wide, density, line.loose[::-1])
        for directed, free in ((line, free_of_others[path]), (back, free_of_others[path][::-1])):
            begin = np.arange(0, directed.length - length, length / _STARTS)
            lost = np.interp(begin + length, directed.along, np.cumsum(~free)) > np.interp(
                begin, directed.along, np.cumsum(~free)
            )
            begin = begin[~lost & free[np.searchsorted(directed.along, begin)]]
            if len(begin):
                track.append(np.full(len(begin), len(lines)))
                start.append(begin)
                features.append(directed.features(begin, length, radius))
                lines.append(directed)
    return Swatches(
        number,
        tuple(lines),
        np.concatenate(track).astype(np.intp),
        np.concatenate(start),
        np.concatenate(features),
        length,
        radius,
    )


def clear(graph: LineGraph) -> NDArray[np.bool_]:
    """Vertices (n,) beside which no other line, nor another part of their own, comes near."""
    free = np.ones(len(graph), dtype=bool)
    branch, along = np.full(len(graph), -1), np.zeros(len(graph))
    for number, path in enumerate(graph.branches):
        step = np.linalg.norm(np.diff(graph.xy[path], axis=0), axis=1)
        branch[path], along[path] = number, np.concatenate([[0.0], np.cumsum(step)])
    branch[graph.degree > 2] = -1
    reach = 2 * graph.radius + CLEAR
    if not len(graph):
        return free
    pairs = spatial.cKDTree(graph.xy).query_pairs(float(np.percentile(reach, 90)), output_type="ndarray")
    a, b = pairs.T
    away = np.linalg.norm(graph.xy[a] - graph.xy[b], axis=1)
    other = (branch[a] != branch[b]) | (np.abs(along[a] - along[b]) > 2 * away + CLEAR)
    for ends in (a, b):
        free[ends[other & (away < reach[ends])]] = False
    free[branch < 0] = False
    return free
