"""A sheet more of a scanned hand: letters that were put together for it, inked as its own pages are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from handout.hand.places import Place
from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand, ScannedPage, Texture
from handout.inking.pen_replacement import NO_SOURCE, replace_pen
from handout.inking.specimens import Part, Specimen
from handout.inking.texture import texture
from handout.values import Array, Glyph, Indices, Ink, Line, LineGraph, Manuscript, Page, Placed

_WIDTH = 180.0  # mm at most
_BETWEEN = 0.4  # line space left and right of a specimen
_TALL = 2.0  # line space from one row to the next: what reaches far up or down stays clear of other rows


def with_sheet(hand: ScannedHand, specimens: Sequence[Specimen]) -> ScannedHand:
    """The hand with one page more, on which the specimens are its letters.

    Raises
    ------
    InputError
        Some are to be drawn, and there are too few clear pieces of line to take the pen from.
    """
    like = hand.pages[0]
    spots, page = _spots(specimens, like)
    laid = [[_laid(part, spot, like) for part in one.parts] for one, spot in zip(specimens, spots, strict=True)]
    pixels = _inked(hand, specimens, laid, page, like)
    graph, first = _whole([graph for some in laid for graph in some], like.pixel)
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


def _spots(specimens: Sequence[Specimen], like: ScannedPage) -> tuple[Array, Page]:
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


def _inked(
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
        own.append(_line(one, number, [(g, p.source) for p, g in pairs if p.source != NO_SOURCE]))
        foreign.append(_line(one, number, [(g, 0) for p, g in pairs if p.source == NO_SOURCE]))
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


def _whole(graphs: Sequence[LineGraph], pixel: float) -> tuple[LineGraph, list[int]]:
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
    mine = [_of(one, offsets, role) for role in (-1, 0, 1)]
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


def _of(one: Specimen, offsets: Sequence[int], role: int) -> Indices:
    found = [start + np.flatnonzero(part.role == role) for part, start in zip(one.parts, offsets, strict=True)]
    return np.asarray(np.concatenate(found), dtype=np.intp)
