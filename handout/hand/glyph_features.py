"""What a glyph looks like, in numbers: where its ink lies, how large it is, of how many pieces, ends and loops.

A glyph is upright, one x-height high, with its baseline at 0 and the middle of its line at x = 0.  Where the ink lies
is the length of line around the points of a coarse grid, as seen from afar; its lowest frequencies are kept.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from handout.branching import number_pieces
from handout.hand.scanned import ScannedHand, ScannedPage
from handout.values import Array, Indices, LineGraph


@dataclass(frozen=True)
class FeatureSettings:
    """Set by eye: the grid holds the letters of six pages, the frequencies draw them so that they can be read."""

    blur: float = 0.2  # x-heights, and the distance of the grid's points
    across: tuple[float, float] = (-1.6, 1.6)  # x-heights from the middle of a glyph's line
    up: tuple[float, float] = (-1.2, 2.4)  # x-heights over the baseline
    frequencies: tuple[int, int] = (7, 6)  # that are kept: up and across
    loops: int = 4  # at most: rough ink has many


SETTINGS = FeatureSettings()
_FIGURES = 14  # features beside the frequencies, in the order in which `_sizes` and `_connections` give them
COUNT = SETTINGS.frequencies[0] * SETTINGS.frequencies[1] + _FIGURES  # features of a glyph


@dataclass(frozen=True, eq=False)
class _Ink:
    """The vertices of some sets, one set behind the other, x-heights.

    of : (m,) the set of each vertex; first : (n + 1,) where each set begins.
    """

    of: Indices
    first: Indices
    vertices: Indices
    x: Array
    y: Array

    def mean(self, each: Array) -> Array:
        return np.asarray(np.add.reduceat(each, self.first[:-1])) / np.diff(self.first)

    def most(self, each: Array) -> Array:
        return np.asarray(np.maximum.reduceat(each, self.first[:-1]))


def glyph_features(hand: ScannedHand) -> Array:
    """(n, COUNT) float: the features of all glyphs of a hand, with their stubs and marks."""
    features = np.zeros((len(hand.glyphs), COUNT))
    for number, sheet in enumerate(hand.pages):
        here = [i for i, glyph in enumerate(hand.glyphs) if glyph.page == number]
        lines = np.array([hand.glyphs[i].line for i in here], dtype=np.intp)
        features[here] = features_of(sheet, lines, [hand.glyphs[i].vertices for i in here])
    return features


def features_of(sheet: ScannedPage, lines: Indices, sets: Sequence[Indices]) -> Array:
    """(n, COUNT) float: the features of sets of a page's vertices, each rising, none empty, on some lines (n,)."""
    if not sets:
        return np.zeros((0, COUNT))
    size = np.array([len(vertices) for vertices in sets], dtype=np.intp)
    of, first = np.repeat(np.arange(len(size)), size), np.concatenate([[0], np.cumsum(size)])
    vertices = np.concatenate(list(sets))
    x, y = (sheet.to_line(lines[of], sheet.graph.uv[vertices]) * (sheet.pitch / sheet.x_height)).T
    x = x - sheet.slant * y
    ink = _Ink(of, first, vertices, x, y)
    ink = _Ink(of, first, vertices, x - ink.mean(x)[of], y)
    # the lowest frequencies (n, k) of where the ink of each set lies
    grids = [np.arange(low, high + SETTINGS.blur / 2, SETTINGS.blur) for low, high in (SETTINGS.up, SETTINGS.across)]
    up, across = (
        np.exp(np.square(((at[:, None] - grid) / SETTINGS.blur).astype(np.float32)) / -2)
        for at, grid in zip((ink.y, ink.x), grids, strict=True)
    )
    seen = np.array([up[a:b].T @ across[a:b] for a, b in pairwise(ink.first.tolist())])
    vertical, level = (_cosines(len(grid), kept) for grid, kept in zip(grids, SETTINGS.frequencies, strict=True))
    waves = vertical @ np.sqrt(seen * np.float32(sheet.pixel / sheet.x_height)) @ level.T
    waves = np.asarray(waves, dtype=np.float64).reshape(len(seen), -1)
    return np.concatenate([waves, _sizes(ink), _connections(sheet, ink)], axis=1)


def _cosines(count: int, kept: int) -> Array:
    """(kept, count): the first rows of the discrete cosine transform."""
    rows = np.cos(np.pi * np.arange(kept)[:, None] * (np.arange(count) + 0.5) / count) * np.sqrt(2 / count)
    rows[0] /= np.sqrt(2)
    return np.asarray(rows)


def _sizes(ink: _Ink) -> Array:
    """(n, 6): width, top, bottom, middle height, right and left end."""
    right, left, top, bottom = ink.most(ink.x), -ink.most(-ink.x), ink.most(ink.y), -ink.most(-ink.y)
    return np.column_stack([right - left, top, bottom, ink.mean(ink.y), right, left])


def _connections(sheet: ScannedPage, ink: _Ink) -> Array:
    """(n, 8): logarithms of length and radius; density; pieces, loops, ends and forks; share of the main piece."""
    graph, count, sets = sheet.graph, len(ink.vertices), len(ink.first) - 1
    inner = _inner_edges(graph, ink)
    piece = number_pieces(inner, count)
    size = np.bincount(piece)
    degree = np.bincount(inner.ravel(), minlength=count)
    owner = np.zeros(len(size), dtype=np.intp)
    owner[piece] = ink.of
    step = np.hypot(*(graph.xy[ink.vertices[inner[:, 0]]] - graph.xy[ink.vertices[inner[:, 1]]]).T) / sheet.x_height

    def counted(whose: Indices, each: Array | None = None) -> Array:
        return np.asarray(np.bincount(whose, each, minlength=sets), dtype=np.float64)

    total, parts, main = counted(ink.of), counted(owner), np.zeros(sets)
    np.maximum.at(main, owner, size)
    edges = ink.of[inner[:, 0]]
    loops = np.clip(counted(edges) - total + parts, 0, SETTINGS.loops)
    length = np.log(counted(edges, step) + 0.1)
    radius = np.log(ink.mean(graph.radius[ink.vertices] / sheet.x_height) + 1e-6)
    ends, forks = np.log1p(counted(ink.of[degree == 1])), np.log1p(counted(ink.of[degree > 2]))
    density = ink.mean(graph.density[ink.vertices])
    return np.column_stack([length, radius, density, np.log(parts), loops, ends, forks, main / total])


def _inner_edges(graph: LineGraph, ink: _Ink) -> Indices:
    """(k, 2): edges of the graph of which both ends are in one set, by their places in `ink`."""
    edges, count, (order, begin) = graph.edges, len(graph), graph.leaving
    out = begin[ink.vertices + 1] - begin[ink.vertices]
    start = np.repeat(np.arange(len(out)), out)
    number = np.arange(len(start)) - np.repeat(np.cumsum(out) - out, out) + np.repeat(begin[ink.vertices], out)
    codes = ink.of * count + ink.vertices
    wanted = ink.of[start] * count + edges[order[number], 1]
    end = np.minimum(np.searchsorted(codes, wanted), len(codes) - 1)
    within = codes[end] == wanted
    return np.column_stack([start[within], end[within]])
