"""Letters that a scanned hand lacks, put together from its own or drawn: lines in line space, still without a page.

Source: seed 000, §6.2 (what is to be done about letters that a hand lacks is this project's).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.hand.places import Place
from handout.hand.scanned import NOBODY, ScannedHand
from handout.inking.pen_replacement import NO_SOURCE
from handout.values import Array, Hand, Indices, LineGraph

_STEP = 0.03  # x-heights between vertices of a line that is drawn


@dataclass(frozen=True, eq=False)
class Part:
    """Some line in line space, y up: `uv` is where its ink is on page `source`; `role` (n,) whose it is.

    role : −1 the letter before, 0 the letter, 1 the letter after.
    """

    graph: LineGraph
    source: int
    role: Indices


@dataclass(frozen=True, eq=False)
class Specimen:
    """One letter to be, with the letters that it was joined to, which go along so that it can be joined again.

    places : of the letter before, the letter and the letter after; "" where there is none.
    entries, exits : ways from and to those, vertices of the first part.
    """

    letter: str
    parts: tuple[Part, ...]
    places: tuple[Place | None, Place, Place | None] = (None, "alone", None)
    entries: tuple[Indices, ...] = ()
    exits: tuple[Indices, ...] = ()


def pieces(hand: ScannedHand, number: int) -> list[Indices]:
    """The connected pieces of a glyph, vertices of its page's graph, the largest first."""
    glyph = hand.glyphs[number]
    inside = hand.pages[glyph.page].graph.take(glyph.vertices).components
    found = [glyph.vertices[inside == k] for k in range(int(inside.max()) + 1)]
    return sorted(found, key=lambda vertices: -len(vertices))


def line(hand: ScannedHand, number: int, vertices: Indices) -> LineGraph:
    """Some vertices of a glyph's page in the line space of its line, as a graph."""
    glyph = hand.glyphs[number]
    page = hand.pages[glyph.page]
    own = page.graph.take(vertices)
    return LineGraph(page.to_line(glyph.line, own.uv), own.radius / page.pitch, own.density, own.uv, own.edges)


def moved(graph: LineGraph, shift: Array) -> LineGraph:
    """The line elsewhere."""
    return LineGraph(graph.xy + shift, graph.radius, graph.density, graph.uv, graph.edges)


def with_neighbours(hand: ScannedHand, number: int, gone: Indices, letter: str, marks: Sequence[Part]) -> Specimen:
    """A glyph without the vertices `gone`, in its surroundings, and with marks."""
    glyph = hand.glyphs[number]
    beside = [(glyph.before, -1), (number, 0), (glyph.after, 1)]
    owners = [(hand.glyphs[i].vertices, role) for i, role in beside if i != NOBODY]
    vertices = np.unique(np.concatenate([own for own, _ in owners]))
    vertices = vertices[~np.isin(vertices, gone)]
    role = np.zeros(len(vertices), dtype=np.intp)
    for own, kind in owners[::-1]:
        if kind:
            role[np.isin(vertices, own)] = kind
    role[np.isin(vertices, glyph.vertices)] = 0
    before = hand.glyphs[glyph.before] if glyph.before != NOBODY else None
    after = hand.glyphs[glyph.after] if glyph.after != NOBODY else None

    def paths(ways: Sequence[Indices]) -> tuple[Indices, ...]:
        return tuple(np.searchsorted(vertices, way) for way in ways if np.isin(way, vertices).all())

    return Specimen(
        letter,
        (Part(line(hand, number, vertices), glyph.page, role), *marks),
        (before.place if before else None, glyph.place, after.place if after else None),
        paths([way.path for way in before.ligatures]) if before else (),
        paths([way.path for way in glyph.ligatures]),
    )


def resized(hand: ScannedHand, number: int, letter: str, factor: float) -> Specimen:
    """The body of a glyph made larger or smaller, to be inked anew: a pen's line does not grow with its letters."""
    graph = line(hand, number, hand.body(number))
    same = LineGraph(graph.xy * factor, graph.radius, graph.density, graph.uv, graph.edges)
    return Specimen(letter, (Part(same, NO_SOURCE, _mine(same)),))


def drawn(strokes: Sequence[Array], radius: float) -> Part:
    """Strokes in line space as a line that is still to be inked; each is sampled already, or one point."""
    count, edges = 0, [np.zeros((0, 2), dtype=np.intp)]
    for stroke in strokes:
        numbers = count + np.arange(len(stroke))
        edges.append(np.column_stack([numbers[:-1], numbers[1:]]))
        count += len(stroke)
    xy = np.concatenate(list(strokes))
    graph = LineGraph(xy, np.full(count, radius), np.ones(count), np.zeros((count, 2)), np.concatenate(edges))
    return Part(graph, NO_SOURCE, _mine(graph))


def mark_strokes(house: Hand, mark: str, rng: np.random.Generator) -> list[Array]:
    """A mark of a drawn hand: sampled strokes, x-heights, upright, over (under) a small letter at x = 0."""
    forms = house.marks[mark]
    form = forms[int(rng.integers(len(forms)))]
    found = [smooth(stroke) for stroke in form.strokes]
    return [np.column_stack([xy[:, 0] - house.slant * xy[:, 1], xy[:, 1]]) for xy in found]


def smooth(points: Array) -> Array:
    """(m, 2): a curve through points (n, 2), x-heights."""
    from scipy.interpolate import CubicSpline

    apart = np.hypot(*np.diff(points, axis=0).T) if len(points) > 1 else np.zeros(0)
    if not (apart > 1e-6).any():
        return np.array(points[:1])
    kept = np.concatenate([[True], apart > 1e-6])
    along = np.concatenate([[0.0], np.cumsum(apart[apart > 1e-6])])
    at = np.linspace(0, along[-1], max(3, int(along[-1] / _STEP) + 2))
    return np.asarray(CubicSpline(along, points[kept])(at))


def _mine(graph: LineGraph) -> Indices:
    return np.zeros(len(graph), dtype=np.intp)
