"""Specimens: letters put together for a scanned hand, as lines in line space, and the page that holds them, inked.

Line space: y up from the baseline, the unit is the pitch of the lines.

Source: seed 000, §6.2, for line space and ligatures; the specimens are this project's own method.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handout.hand.places import Place
from handout.hand.scanned import NO_PAGE, NOBODY, ScannedGlyph, ScannedHand, ScannedPage, Texture
from handout.inking.pen_replacement import replace_pen
from handout.inking.texture import texture
from handout.values import Array, Glyph, Hand, Indices, Ink, Line, LineGraph, Manuscript, Page, Placed

_STEP = 0.03  # x-heights between vertices of a line that is drawn; .9 pixels at 300 dpi and 2.5 mm
_WIDTH = 180.0  # mm, at most, of the added page; any will do
_BETWEEN = 0.4  # line space left and right of a specimen
_TALL = 2.0  # line space from one row to the next: what reaches far up or down stays clear of other rows


@dataclass(frozen=True, eq=False)
class Part:
    """Some line of a letter, or of the letters beside it.

    graph : in line space; its `uv` is where its ink is on page `source`.
    source : number of a page of the hand, `NO_PAGE` for a line that is still to be inked.
    role : (n,) int, whose vertices they are: −1 the letter before, 0 the letter, 1 the letter after.
    """

    graph: LineGraph
    source: int
    role: Indices


@dataclass(frozen=True, eq=False)
class Specimen:
    """A letter to be added, with the letters that it was joined to: their ink shows how it can be joined again.

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


def shifted(graph: LineGraph, shift: Array) -> LineGraph:
    """A line moved by (2,)."""
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
    return Specimen(letter, (Part(same, NO_PAGE, _letter_only(same)),))


def drawn(strokes: Sequence[Array], radius: float) -> Part:
    """Strokes in line space as a line that is still to be inked; each is sampled already, or one point."""
    count, edges = 0, [np.zeros((0, 2), dtype=np.intp)]
    for stroke in strokes:
        numbers = count + np.arange(len(stroke))
        edges.append(np.column_stack([numbers[:-1], numbers[1:]]))
        count += len(stroke)
    xy = np.concatenate(list(strokes))
    graph = LineGraph(xy, np.full(count, radius), np.ones(count), np.zeros((count, 2)), np.concatenate(edges))
    return Part(graph, NO_PAGE, _letter_only(graph))


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


def _letter_only(graph: LineGraph) -> Indices:
    return np.zeros(len(graph), dtype=np.intp)


def add_page(hand: ScannedHand, specimens: Sequence[Specimen]) -> ScannedHand:
    """The hand with one page more, which holds the specimens as its letters.

    Raises
    ------
    InputError
        Some are to be drawn, and there are too few clear pieces of line to take the pen from.
    """
    like = hand.pages[0]
    spots, page = _origins(specimens, like)
    laid = [[_laid(part, spot, like) for part in one.parts] for one, spot in zip(specimens, spots, strict=True)]
    pixels = _page_pixels(hand, specimens, laid, page, like)
    graph, first = _united([graph for some in laid for graph in some], like.pixel)
    rows = np.unique(spots[:, 1])
    sheet = ScannedPage(
        "put together",
        "",
        like.dpi,
        (pixels.shape[0], pixels.shape[1]),
        graph,
        np.array([[row / like.pixel - 0.5, 0.0, 0.0, 0.0, 1.0] for row in rows]),
        like.pitch,
        like.x_height,
        like.slant,
        like.pen,
        Texture((0, 0), (pixels.shape[0], pixels.shape[1]), lambda: pixels),
        like.paper,
    )
    starts = iter(first)
    glyphs = list(hand.glyphs)
    for number, (one, spot) in enumerate(zip(specimens, spots, strict=True)):
        offsets = [next(starts) for _ in one.parts]
        line = int(np.searchsorted(rows, spot[1]))
        glyphs += _glyphs(one, offsets, len(glyphs), len(hand.pages), line, number, sheet)
    return replace(hand, pages=(*hand.pages, sheet), glyphs=tuple(glyphs))


def _origins(specimens: Sequence[Specimen], like: ScannedPage) -> tuple[Array, Page]:
    """(n, 2) mm: where x = 0 of each specimen and its baseline are, and a sheet that holds them."""
    found, x, y, widest = [], 0.0, 0.6 * _TALL * like.pitch, 20.0
    for one in specimens:
        xs = np.concatenate([part.graph.xy[:, 0] for part in one.parts]) * like.pitch
        gap = _BETWEEN * like.pitch
        width = float(np.ptp(xs)) + 2 * gap
        if x and x + width > _WIDTH:
            x, y = 0.0, y + _TALL * like.pitch
        found.append((x + gap - float(xs.min()), y))
        x += width
        widest = max(widest, x)
    return np.array(found), Page(widest, y + 0.4 * _TALL * like.pitch, "sheet")


def _laid(part: Part, spot: Array, like: ScannedPage) -> LineGraph:
    """A part on the sheet, mm."""
    graph = part.graph
    xy = spot + graph.xy * [like.pitch, -like.pitch]
    return LineGraph(xy, graph.radius * like.pitch, graph.density, graph.uv, graph.edges)


def _page_pixels(
    hand: ScannedHand,
    specimens: Sequence[Specimen],
    laid: Sequence[Sequence[LineGraph]],
    page: Page,
    like: ScannedPage,
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """(h, w, 4) uint8: the sheet's ink, what was drawn in the pen that the hand is written with."""
    own, foreign = [], []
    for number, (one, graphs) in enumerate(zip(specimens, laid, strict=True)):
        pairs = list(zip(one.parts, graphs, strict=True))
        own.append(_line(one, number, [(g, p.source) for p, g in pairs if p.source != NO_PAGE]))
        foreign.append(_line(one, number, [(g, 0) for p, g in pairs if p.source == NO_PAGE]))
    drawn = Manuscript(tuple(foreign), page, like.x_height)
    if any(line.placed for line in foreign):
        drawn = replace_pen(drawn, hand)
    lines = [replace(a, placed=a.placed + b.placed) for a, b in zip(own, drawn.lines, strict=True)]
    raster = texture(Manuscript(tuple(lines), page, like.x_height), hand, like.dpi)
    return np.rint(raster.rgba * 255).astype(np.uint8)


def _line(one: Specimen, number: int, parts: Sequence[tuple[LineGraph, int]]) -> Line:
    blank = Glyph(one.letter, (), (), 0.0)
    placed = tuple(Placed(blank, (), False, number, 0, Ink(graph, source, NOBODY)) for graph, source in parts)
    return Line(one.letter, placed, 0.0)


def _united(graphs: Sequence[LineGraph], pixel: float) -> tuple[LineGraph, list[int]]:
    """All lines as one graph on the sheet's own picture, and each one's first vertex."""
    first = np.cumsum([0, *map(len, graphs)]).tolist()
    xy, radius, density = (
        np.concatenate([getattr(graph, name) for graph in graphs]) for name in ("xy", "radius", "density")
    )
    edges = np.concatenate([graph.edges + start for graph, start in zip(graphs, first, strict=False)])
    return LineGraph(xy, radius, density, xy / pixel - 0.5, edges), first[:-1]


def _glyphs(
    one: Specimen, offsets: Sequence[int], number: int, page: int, line: int, word: int, sheet: ScannedPage
) -> Iterator[ScannedGlyph]:
    """The letter, then those beside it, which have no name here."""
    mine = [_vertices(one, offsets, role) for role in (-1, 0, 1)]
    has = [bool(len(vertices)) for vertices in mine]
    before, after = number + 1 if has[0] else NOBODY, number + 1 + has[0] if has[2] else NOBODY
    places: list[Place] = [place or "alone" for place in one.places]
    entries, exits = (
        tuple(sheet.ligature(line, path + offsets[0]) for path in paths) for paths in (one.entries, one.exits)
    )
    yield ScannedGlyph(one.letter, places[1], page, line, word, -1, mine[1], before, after, exits if has[2] else ())
    if has[0]:
        yield ScannedGlyph("", places[0], page, line, word, -1, mine[0], NOBODY, number, entries)
    if has[2]:
        yield ScannedGlyph("", places[2], page, line, word, -1, mine[2], number, NOBODY)


def _vertices(one: Specimen, offsets: Sequence[int], role: int) -> Indices:
    found = [start + np.flatnonzero(part.role == role) for part, start in zip(one.parts, offsets, strict=True)]
    return np.asarray(np.concatenate(found), dtype=np.intp)
