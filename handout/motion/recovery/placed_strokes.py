"""The strokes of the glyphs of one placed word, put together where neighbouring glyphs share them.

A placed glyph has the body of its form, vertex by vertex, and ligatures of its own: `place_strokes` lays the strokes of
the hand's glyph on it.  `WordInk` finds ways over ink that is there already: who joins letters retraces a stem rather
than lift the pen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby, pairwise
from typing import TypeAlias

import numpy as np

from handout.libraries import csgraph, sparse
from handout.motion.recovery.ink_gaps import endpoint_of, gap_bridges, log_odds, prior_log_odds
from handout.motion.recovery.network import as_complex
from handout.motion.recovery.stroke_order import StrokeOrderModel, outwards
from handout.values import Array, Indices, LineGraph, Placed
from handout.writing.forms import GlyphLine

_SAME = 1e-6  # mm between two places that are one
_GRAIN = 1e-5  # mm: vertices of a word that are nearer to each other are one
_FAILED = 2.0  # a way without ink counts as so many times as long

Part: TypeAlias = "tuple[PlacedGlyph, Indices]"  # a glyph and what a movement has of its vertices


@dataclass(eq=False)
class PlacedStroke:
    """A movement while its word is put together.

    vertices : of the glyph's graph; begin, end : the ligature at whose outer end it begins, ends, or None.
    bar : whether it is a crossbar, delayed or not.
    """

    vertices: Indices
    delayed: bool
    begin: int | None
    end: int | None
    bar: bool = False


@dataclass(eq=False)
class PlacedGlyph:
    """A placed glyph with its strokes.

    entries : how many of its ligatures lead to the glyph before; the others lead to the one after.
    chains : for each ligature its vertices in the placed graph, anchor first, outwards; None where it is not there.
    clocks : see `StrokeOrderModel.clocks`.
    """

    placed: Placed
    graph: LineGraph
    entries: int
    chains: list[Indices | None]
    clocks: tuple[Array, Array] | None = None
    strokes: list[PlacedStroke] = field(default_factory=list)

    def is_left_by(self, stroke: PlacedStroke) -> bool:
        """Whether a stroke leads on to the glyph after."""
        return stroke.end is not None and stroke.end >= self.entries


def place_strokes(placed: Placed, model: StrokeOrderModel) -> PlacedGlyph:
    """A placed glyph with the strokes of the hand's own glyph."""
    assert placed.ink is not None
    number, graph = placed.ink.number, placed.ink.graph
    form = model.forms[number]
    written, sections = model.strokes_of(number)
    chains = _chains(graph, form)
    glyph = PlacedGlyph(placed, graph, len(form.entries), chains, model.clocks(number))
    section = np.full(len(form.xy) + sum(map(len, sections)), -1, dtype=np.intp)
    for k, ligature in enumerate(sections):
        section[ligature] = k
    bars = written.bars or written.delayed
    for vertices, delayed, bar in zip(written.strokes, written.delayed, bars, strict=True):
        path, begin, end = _on_placed(vertices, section, sections, chains)
        if len(path):
            glyph.strokes.append(PlacedStroke(path, delayed, begin, end, bar))
    return glyph


def _on_placed(
    vertices: Indices, section: Indices, sections: tuple[Indices, ...], chains: list[Indices | None]
) -> tuple[Indices, int | None, int | None]:
    """A stroke of a glyph's line on the graph of the placed glyph, whose ligatures are other than they were.

    Returns its vertices there, none where all of it is gone, and the ligatures at whose outer ends it begins and ends.
    """
    if not sections:
        return vertices, None, None
    of = section[vertices]
    bounds = [0, *(np.flatnonzero(np.diff(of)) + 1).tolist(), len(of)]
    parts: list[Indices] = []
    begin = end = None
    for a, b in pairwise(bounds):
        way = int(of[a])
        if way < 0:
            parts.append(vertices[a:b])
            continue
        chain = chains[way]
        if chain is None:
            continue
        outer = int(sections[way][-1])
        if b - a < len(sections[way]):
            # the part of the placed ligature that is like these vertices of the ligature as it was
            share = len(chain[1:]) / len(sections[way])
            at = np.floor((vertices[[a, b - 1]] - sections[way][0]) * share).astype(np.intp)
            run = chain[1 + at.min() : 2 + at.max()]
            parts.append(run if at[0] <= at[1] else run[::-1])
            continue
        if vertices[a] == outer and a == 0:
            begin = way
        if vertices[b - 1] == outer and b == len(of):
            end = way
        inward = vertices[a] == outer
        parts.append(chain[:0:-1] if inward else chain[1:])
    return np.concatenate([np.zeros(0, dtype=np.intp), *parts]), begin, end


def _chains(graph: LineGraph, form: GlyphLine) -> list[Indices | None]:
    """For each ligature of a form its vertices in a placed graph, anchor first; told by where their ink is from."""
    ways = [way for way, _ in outwards(form)]
    if not ways:
        return []
    count = len(form.xy)
    chains: list[Indices | None] = [None] * len(ways)
    added = graph.edges[len(form.edges) :]
    starts = np.flatnonzero(added[:, 0] < count)
    for a, b in pairwise([*starts.tolist(), len(added)]):
        chain = np.concatenate([added[a : a + 1, 0], added[a:b, 1]])
        free = [k for k, way in enumerate(ways) if chains[k] is None and way.anchor == chain[0]]
        chosen = free[0] if free else None
        if len(free) > 1:
            far, middle = graph.uv[chain[-1]], graph.uv[chain[len(chain) // 2]]
            chosen = min(free, key=lambda k: sum(float(np.hypot(*(ways[k].uv - uv).T).min()) for uv in (far, middle)))
        if chosen is not None:
            chains[chosen] = chain
    return chains


def shared_ligatures(first: PlacedGlyph, second: PlacedGlyph) -> dict[int, int]:
    """Ligature into the second → ligature out of the first that is the same line."""
    shared = {}
    for i in range(second.entries):
        into = second.chains[i]
        if into is None or not len(into):
            continue
        for j in range(first.entries, len(first.chains)):
            out = first.chains[j]
            if out is None or not len(out):
                continue
            ends = np.abs(second.graph.xy[into[[0, -1]]] - first.graph.xy[out[[-1, 0]]]).max()
            if ends < _SAME:
                shared[i] = j
    return shared


def without_shared(glyph: PlacedGlyph, stroke: PlacedStroke, shared: dict[int, int]) -> Indices:
    """The vertices of a stroke without a ligature that the letter before has already."""
    vertices = stroke.vertices
    if stroke.begin in shared:
        vertices = vertices[_inner(glyph, stroke.begin) :]
    if stroke.end in shared:
        vertices = vertices[: len(vertices) - _inner(glyph, stroke.end)]
    return vertices


def _inner(glyph: PlacedGlyph, ligature: int | None) -> int:
    """How many vertices a placed ligature has beside its anchor."""
    chain = None if ligature is None else glyph.chains[ligature]
    assert chain is not None
    return len(chain) - 1


def goes_on_over_gap(first: Part, second: Part, joined_share: float) -> bool:
    """Whether a movement goes on in another with a little ink missing, in a hand that joins such a share of letters."""
    (glyph, before), (following, after) = first, second
    half_width = float(np.median(glyph.graph.radius))
    ends = [
        endpoint_of(g.graph.xy, g.graph.radius, chain, half_width)
        for g, chain in ((glyph, before[::-1]), (following, after))
    ]
    return log_odds(ends[0], ends[1], half_width) + prior_log_odds(joined_share) > 0


class WordInk:
    """The line of a whole word, letters and ligatures in one, with bridges where its ink failed.

    joined_share : share of letters that the hand joins to the next.
    """

    def __init__(self, glyphs: Sequence[PlacedGlyph], joined_share: float) -> None:
        self._glyphs = glyphs
        self._first = np.cumsum([0, *(len(glyph.graph) for glyph in glyphs)])
        self._number = {id(glyph): k for k, glyph in enumerate(glyphs)}
        xy = np.concatenate([glyph.graph.xy for glyph in glyphs])
        # complex numbers are sorted far faster than pairs
        rounded = as_complex(np.rint(xy / _GRAIN))
        _, self._vertex_of, self._node_of = np.unique(rounded, return_index=True, return_inverse=True)
        edge_parts = [glyph.graph.edges + first for glyph, first in zip(glyphs, self._first[:-1], strict=True)]
        edges = self._node_of[np.concatenate(edge_parts)]
        place = xy[self._vertex_of]
        length = np.hypot(*(place[edges[:, 0]] - place[edges[:, 1]]).T) + 1e-9
        count = len(place)
        # an edge that two letters share is there once
        _, distinct = np.unique(edges.min(axis=1) * count + edges.max(axis=1), return_index=True)
        pairs = np.sort(edges[distinct], axis=1)
        radius = np.concatenate([glyph.graph.radius for glyph in glyphs])
        owner = np.repeat(np.arange(len(glyphs)), np.diff(self._first))[self._vertex_of]
        over = gap_bridges(place, radius[self._vertex_of], pairs, float(np.median(radius)), owner, joined_share)
        far = np.hypot(*(place[over[:, 0]] - place[over[:, 1]]).T)
        pairs, length = np.concatenate([pairs, over]), np.concatenate([length[distinct], _FAILED * far])
        self._lengths = sparse.csr_array((length, (pairs[:, 0], pairs[:, 1])), shape=(count, count))

    def path_between(self, before: Part, after: Part, most: float) -> list[Part] | None:
        """The shortest way over ink from the end of one part to the start of another; None if longer than `most` mm."""
        here, there = self._node_at(before, -1), self._node_at(after, 0)
        if here == there:
            return []
        far, back = csgraph.dijkstra(self._lengths, directed=False, indices=there, limit=most, return_predecessors=True)
        if not np.isfinite(far[here]):
            return None
        nodes = []
        node = int(back[here])
        while node != there:
            nodes.append(node)
            node = int(back[node])
        vertices = self._vertex_of[nodes]
        owner = np.searchsorted(self._first, vertices, side="right") - 1
        return [
            (self._glyphs[k], np.array([v - self._first[k] for v, _ in run], dtype=np.intp))
            for k, run in groupby(zip(vertices.tolist(), owner.tolist(), strict=True), key=lambda pair: pair[1])
        ]

    def _node_at(self, part: Part, index: int) -> int:
        glyph, vertices = part
        return int(self._node_of[self._first[self._number[id(glyph)]] + vertices[index]])
