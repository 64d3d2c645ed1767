"""The lines of all glyphs of a scanned hand, taken off their pages in one go: one glyph's after the other's.

Glyphs and vertices are told apart by one number, glyph · vertices + vertex, with the vertices of all pages counted
through, so that whole hands are compared by sorting.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from operator import itemgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array, Indices


class Line(NamedTuple):
    """Vertices of one line; see `Lines`."""

    xy: Array
    radius: Array
    density: Array
    uv: Array


@dataclass(frozen=True, eq=False)
class Lines:
    """Vertices of many lines, in line space from their glyphs' centres.

    first : (lines + 1,) int: where each line begins, and where the last one ends.
    xy, radius, density, uv : as in `values.LineGraph`.
    """

    first: Indices
    xy: Array
    radius: Array
    density: Array
    uv: Array

    @property
    def count(self) -> Indices:
        """(lines,): how many vertices each has."""
        return np.diff(self.first)

    def __getitem__(self, line: int) -> Line:
        part = slice(self.first[line], self.first[line + 1])
        return Line(self.xy[part], self.radius[part], self.density[part], self.uv[part])


@dataclass(frozen=True, eq=False)
class Connectors:
    """The ways that leave the glyphs of a hand, or those that come to them; those of one glyph together.

    lines : of each way, from the letter on the left to the one on the right.
    of : (ways,) int: the glyph that has it.
    away : (vertices,) int: how many vertices of its way are between each and the glyph's body.
    owned : (ways,) int: how many of its vertices belong to the glyph, counted from its body outwards; one at least.
    anchor : (ways,) int: the vertex of the glyph's body that it begins (ends) at.
    """

    lines: Lines
    of: Indices
    away: Indices
    owned: Indices
    anchor: Indices

    def within(self, reach: Indices) -> NDArray[np.bool_]:
        """(vertices,): which are among the first so many (ways,) of their way, counted from the glyph's body."""
        return np.asarray(self.away < np.repeat(reach, self.lines.count))


class ExtractedStrokes:
    """The bodies of all glyphs of a hand, and the ways between them.

    Parameters
    ----------
    hand : ScannedHand
    ways : glyph → the paths of its ligatures to the next.
    centre : (n, 2) float, line space.

    Attributes
    ----------
    bodies : Lines, one a glyph: what is not on the way to another, with the ends of those ways.
    entries, exits : Connectors
    """

    def __init__(self, hand: ScannedHand, ways: Mapping[int, tuple[Indices, ...]], centre: Array) -> None:
        self._hand, self._centre = hand, centre
        self._before = np.cumsum([0, *(len(page.graph) for page in hand.pages)])  # vertices of the pages before
        self._count = int(self._before[-1])
        self._owned = self._coded(enumerate(glyph.vertices for glyph in hand.glyphs))
        out = [(number, path) for number, paths in sorted(ways.items()) for path in paths]
        into = sorted(((hand.glyphs[number].after, path) for number, path in out), key=itemgetter(0))
        gone = self._coded([(i, path[1:]) for i, path in out] + [(i, path[:-1]) for i, path in into])
        ends = self._coded([(i, path[:1]) for i, path in out] + [(i, path[-1:]) for i, path in into])
        self._codes = _rising(np.concatenate([self._owned[~_among(self._owned, np.sort(gone))], ends]))
        self.bodies = self._lines(self._codes, np.searchsorted(self._codes, np.arange(len(centre) + 1) * self._count))
        self._ways = [(self._coded(side), np.cumsum([0, *(len(path) for _, path in side)])) for side in (out, into)]
        self.exits = self._strokes(*self._ways[0], leaving=True)
        self.entries = self._strokes(*self._ways[1], leaving=False)

    def vertices(self, number: int) -> Indices:
        """(n,) int, rising: of a glyph's body, by their numbers on its page."""
        codes = self._codes[self.bodies.first[number] : self.bodies.first[number + 1]]
        return np.asarray(codes % self._count - self._before[self._hand.glyphs[number].page])

    def edges(self) -> list[Indices]:
        """n of (m, 2) int: the edges between vertices of each body, by their place in it, without those of the ways."""
        owner = np.full(self._count, NOBODY)
        owner[self._owned % self._count] = self._owned // self._count
        pairs = np.concatenate(
            [page.graph.edges + at for page, at in zip(self._hand.pages, self._before, strict=False)]
        )
        holder = owner[pairs[:, 0]]
        inside = (holder == owner[pairs[:, 1]]) & (holder != NOBODY)
        holder, pairs = holder[inside], pairs[inside]
        codes = holder[:, None] * self._count + pairs
        at = np.minimum(np.searchsorted(self._codes, codes), len(self._codes) - 1)
        walked = [
            self._steps(np.delete(np.column_stack([way[:-1], way[1:]]), first[1:-1] - 1, axis=0))
            for way, first in self._ways
        ]
        in_body = (self._codes[at] == codes).all(axis=1) & ~_among(self._steps(codes), np.sort(np.concatenate(walked)))
        order = np.flatnonzero(in_body)[np.argsort(holder[in_body], kind="stable")]
        local = at[order] - self.bodies.first[holder[order], None]
        return np.split(local, np.searchsorted(holder[order], np.arange(1, len(self._centre))))

    def _coded(self, lines: Iterable[tuple[int, Indices]]) -> Indices:
        """The numbers of the vertices of lines, each with the glyph that has it."""
        pages = [glyph.page for glyph in self._hand.glyphs]
        codes = [vertices + (number * self._count + self._before[pages[number]]) for number, vertices in lines]
        return np.concatenate([np.zeros(0, dtype=np.intp), *codes])

    def _steps(self, codes: Indices) -> Indices:
        """(m,): one number for each pair of vertices (m, 2) of one glyph, the same in either order."""
        low, high = np.minimum(*codes.T), np.maximum(*codes.T)
        return np.asarray(low * self._count + high % self._count)

    def _strokes(self, codes: Indices, first: Indices, *, leaving: bool) -> Connectors:
        begin, end, size = first[:-1], first[1:] - 1, np.diff(first)
        away = np.arange(len(codes)) - np.repeat(begin, size)
        if not leaving:
            away = np.repeat(size, size) - 1 - away
        theirs = np.where(_among(codes, self._owned), np.repeat(size, size), away)
        owned = np.maximum(np.minimum.reduceat(theirs, begin), 1) if len(begin) else size
        of = codes[begin] // self._count
        anchor = np.searchsorted(self._codes, codes[begin if leaving else end]) - self.bodies.first[of]
        return Connectors(self._lines(codes, first), of, away, owned, anchor)

    def _lines(self, codes: Indices, first: Indices) -> Lines:
        number, vertex = codes // self._count, codes % self._count
        row = np.array([glyph.line for glyph in self._hand.glyphs], dtype=np.intp)[number]
        on = np.searchsorted(self._before, vertex, side="right") - 1
        place, uv = np.empty((2, len(codes), 2))
        radius, density = np.empty((2, len(codes)))
        for page, (scan, before) in enumerate(zip(self._hand.pages, self._before, strict=False)):
            here = np.flatnonzero(on == page)
            vertices = vertex[here] - before
            uv[here], density[here] = scan.graph.uv[vertices], scan.graph.density[vertices]
            place[here], radius[here] = scan.to_line(row[here], uv[here]), scan.graph.radius[vertices] / scan.pitch
        return Lines(first, place - self._centre[number], radius, density, uv)


def _rising(codes: Indices) -> Indices:
    """The distinct codes, sorted; `np.unique` hashes numbers, which takes ten times as long for these."""
    codes = np.sort(codes)
    return codes[np.diff(codes, prepend=-1) > 0]


def _among(codes: Indices, rising: Indices) -> NDArray[np.bool_]:
    """(n,): which codes occur in a sorted array of others; by search, since `np.isin` is slower here."""
    if not len(rising):
        return np.zeros(len(codes), dtype=bool)
    return np.asarray(rising[np.minimum(np.searchsorted(rising, codes), len(rising) - 1)] == codes)
