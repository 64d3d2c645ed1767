"""Glyphs on a page with their strokes: those of the hand's own glyph, on the graph of the one that is placed.

A placed glyph has the body of its form, vertex by vertex, and ways to its neighbours of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from handout.motion.recovery.failing import odds, prior, tip
from handout.motion.recovery.scribe import Scribe, outwards
from handout.values import Array, Indices, LineGraph, Placed
from handout.writing.scanned.forms import Form

_SAME = 1e-6  # mm between two places that are one


@dataclass(eq=False)
class PlacedStroke:
    """A movement while its word is put together.

    vertices : of the glyph's graph; begin, end : the way at whose outer end it begins, ends, or None.
    then : what follows without a lift in this glyph and the one before, up to its end.
    bar : whether it is a bar, late or not.
    """

    vertices: Indices
    late: bool
    begin: int | None
    end: int | None
    bar: bool = False
    then: list[tuple[PlacedGlyph, Indices]] = field(default_factory=list)


@dataclass(eq=False)
class PlacedGlyph:
    """A placed glyph with its strokes.

    chains : for each way its vertices in the placed graph, anchor first, outwards; None where it is not there.
    clocks : see `recorded.clocks`.
    """

    placed: Placed
    graph: LineGraph
    entries: int
    chains: list[Indices | None]
    clocks: tuple[Array, Array] | None = None
    strokes: list[PlacedStroke] = field(default_factory=list)


def place(placed: Placed, scribe: Scribe) -> PlacedGlyph:
    assert placed.ink is not None
    number, graph = placed.ink.number, placed.ink.graph
    form = scribe.forms[number]
    written, sections = scribe.written(number)
    chains = _chains(graph, form)
    made = PlacedGlyph(placed, graph, len(form.entries), chains, scribe.clocks(number))
    section = np.full(len(form.xy) + sum(map(len, sections)), -1, dtype=np.intp)
    for k, own in enumerate(sections):
        section[own] = k
    bars = written.bars or written.late
    for vertices, late, bar in zip(written.strokes, written.late, bars, strict=True):
        stroke = _laid(vertices, section, sections, chains, late, bar)
        if stroke is not None:
            made.strokes.append(stroke)
    return made


def _laid(
    vertices: Indices,
    section: Indices,
    sections: tuple[Indices, ...],
    chains: list[Indices | None],
    late: bool,
    bar: bool,
) -> PlacedStroke | None:
    """A stroke of a glyph's line on the graph of the placed glyph, whose ways are other than they were."""
    if not sections:
        return PlacedStroke(vertices, late, None, None, bar)
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
            parts.append(_some(vertices[a:b], sections[way], chain))
            continue
        if vertices[a] == outer and a == 0:
            begin = way
        if vertices[b - 1] == outer and b == len(of):
            end = way
        inward = vertices[a] == outer
        parts.append(chain[:0:-1] if inward else chain[1:])
    whole = np.concatenate([np.zeros(0, dtype=np.intp), *parts])
    return PlacedStroke(whole, late, begin, end, bar) if len(whole) else None


def _some(vertices: Indices, section: Indices, chain: Indices) -> Indices:
    """What of a placed way is like some vertices, in order, of the way as it was."""
    share = len(chain[1:]) / len(section)
    at = np.floor((vertices[[0, -1]] - section[0]) * share).astype(np.intp)
    run = chain[1 + at.min() : 2 + at.max()]
    return run if at[0] <= at[1] else run[::-1]


def _chains(graph: LineGraph, form: Form) -> list[Indices | None]:
    """For each way of a form its vertices in a placed graph, anchor first; told by where their ink is from."""
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


def shared(first: PlacedGlyph, second: PlacedGlyph) -> dict[int, int]:
    """Way into the second → way out of the first that is the same line."""
    found = {}
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
                found[i] = j
    return found


def trimmed(glyph: PlacedGlyph, stroke: PlacedStroke, joins: dict[int, int]) -> Indices:
    """The vertices of a stroke without a way in that the letter before has already."""
    vertices = stroke.vertices
    if stroke.begin in joins:
        chain = glyph.chains[stroke.begin]
        assert chain is not None
        vertices = vertices[len(chain) - 1 :]
    if stroke.end in joins:
        chain = glyph.chains[stroke.end]
        assert chain is not None
        vertices = vertices[: len(vertices) - len(chain) + 1]
    return vertices


def fails(first: tuple[PlacedGlyph, Indices], second: tuple[PlacedGlyph, Indices], rate: float) -> bool:
    """Whether a movement goes on in another with a little ink missing, in a hand that joins such a share of letters."""
    (one, end), (other, begin) = first, second
    half = float(np.median(one.graph.radius))
    ends = [tip(g.graph.xy, g.graph.radius, chain, half) for g, chain in ((one, end[::-1]), (other, begin))]
    return odds(ends[0], ends[1], half) + prior(rate) > 0
