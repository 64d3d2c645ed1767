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
from handout.inking.sweep import InkedWay, Sweep
from handout.inking.texture import texture
from handout.values import Array, Glyph, Indices, Ink, Line, LineGraph, Manuscript, Page, Placed

_WIDTH = 180.0  # mm, at most, of the added page; any will do
_BETWEEN = 0.4  # line space left and right of a specimen
_TALL = 2.0  # line space from one row to the next: what reaches far up or down stays clear of other rows


@dataclass(frozen=True, eq=False)
class SpecimenPart:
    """Some line of a letter, or of the letters beside it.

    graph : in line space; its `uv` is where its ink is on page `source`.
    source : number of a page of the hand, `NO_PAGE` for a line that is still to be inked.
    role : (n,) int, whose vertices they are: −1 the letter before, 0 the letter, 1 the letter after.
    ways : line space: how the pen goes along a line that is still to be inked.
    """

    graph: LineGraph
    source: int
    role: Indices
    ways: tuple[InkedWay, ...] = ()

    def shift_by(self, shift: Array) -> SpecimenPart:
        """The part moved by (2,)."""
        ways = tuple(replace(way, xy=way.xy + shift) for way in self.ways)
        return replace(self, graph=replace(self.graph, xy=self.graph.xy + shift), ways=ways)


@dataclass(frozen=True, eq=False)
class Specimen:
    """A letter to be added, with the letters that it was joined to: their ink shows how it can be joined again.

    places : of the letter before, the letter and the letter after; "" where there is none.
    entries, exits : ways from and to those, vertices of the first part.
    """

    letter: str
    parts: tuple[SpecimenPart, ...]
    places: tuple[Place | None, Place, Place | None] = (None, "alone", None)
    entries: tuple[Indices, ...] = ()
    exits: tuple[Indices, ...] = ()


def add_page(hand: ScannedHand, specimens: Sequence[Specimen]) -> ScannedHand:
    """The hand with one page more, which holds the specimens as its letters.

    Raises InputError: some are to be drawn, and there are too few clear pieces of line to take the pen from.
    """
    like = hand.pages[0]
    spots, page = _origins(specimens, like)
    laid = [
        [_lay_part(part, spot, like) for part in specimen.parts]
        for specimen, spot in zip(specimens, spots, strict=True)
    ]
    pixels = _page_pixels(hand, specimens, laid, spots, page, like)
    # all lines as one graph on the sheet's own picture, and each one's first vertex
    graphs = [graph for some in laid for graph in some]
    first = np.cumsum([0, *map(len, graphs)]).tolist()
    xy, radius, density = (np.concatenate([getattr(each, of) for each in graphs]) for of in ("xy", "radius", "density"))
    edges = np.concatenate([each.edges + start for each, start in zip(graphs, first, strict=False)])
    graph = LineGraph(xy, radius, density, xy / like.pixel - 0.5, edges)
    rows = np.unique(spots[:, 1])
    baselines = np.array([[row / like.pixel - 0.5, 0.0, 0.0, 0.0, 1.0] for row in rows])
    height, width = pixels.shape[:2]
    sheet = ScannedPage(
        "put together", "", like.dpi, (height, width), graph, baselines, like.pitch, like.x_height, like.slant,
        like.pen, Texture((0, 0), (height, width), lambda: pixels), like.paper,
    )  # fmt: skip
    starts = iter(first)
    glyphs = list(hand.glyphs)
    for number, (specimen, spot) in enumerate(zip(specimens, spots, strict=True)):
        offsets = [next(starts) for _ in specimen.parts]
        line = int(np.searchsorted(rows, spot[1]))
        glyphs += _glyphs(specimen, offsets, len(glyphs), len(hand.pages), line, number, sheet)
    return replace(hand, pages=(*hand.pages, sheet), glyphs=tuple(glyphs), author=hand.author or hand)


def _origins(specimens: Sequence[Specimen], like: ScannedPage) -> tuple[Array, Page]:
    """(n, 2) mm: the origin of each specimen on its baseline; and a sheet that holds all."""
    origins, x, y, widest = [], 0.0, 0.6 * _TALL * like.pitch, 20.0
    for specimen in specimens:
        xs = np.concatenate([part.graph.xy[:, 0] for part in specimen.parts]) * like.pitch
        gap = _BETWEEN * like.pitch
        width = float(np.ptp(xs)) + 2 * gap
        if x and x + width > _WIDTH:
            x, y = 0.0, y + _TALL * like.pitch
        origins.append((x + gap - float(xs.min()), y))
        x += width
        widest = max(widest, x)
    return np.array(origins), Page(widest, y + 0.4 * _TALL * like.pitch, "sheet")


def _lay_part(part: SpecimenPart, spot: Array, like: ScannedPage) -> LineGraph:
    """A part on the sheet, mm."""
    graph = part.graph
    xy = spot + graph.xy * [like.pitch, -like.pitch]
    return LineGraph(xy, graph.radius * like.pitch, graph.density, graph.uv, graph.edges)


def _page_pixels(
    hand: ScannedHand,
    specimens: Sequence[Specimen],
    laid: Sequence[Sequence[LineGraph]],
    spots: Array,
    page: Page,
    like: ScannedPage,
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """(h, w, 4) uint8: the sheet's ink, what was drawn in the pen that the hand is written with."""
    scanned = []
    for number, (specimen, graphs) in enumerate(zip(specimens, laid, strict=True)):
        blank = Glyph(specimen.letter, (), (), 0.0)
        placed = tuple(
            Placed(blank, (), False, number, 0, Ink(graph, part.source, NOBODY))
            for part, graph in zip(specimen.parts, graphs, strict=True)
            if part.source != NO_PAGE
        )
        scanned.append(Line(specimen.letter, placed, 0.0))
    written = texture(Manuscript(tuple(scanned), page, like.x_height), hand, like.dpi)
    rgba = np.asarray(written.rgba / 255, dtype=np.float32)
    ways = [
        replace(way, xy=(spot + way.xy * [like.pitch, -like.pitch]) / like.pixel - 0.5)
        for specimen, spot in zip(specimens, spots, strict=True)
        for part in specimen.parts
        for way in part.ways
    ]
    if ways:
        rgba[:, :, :3] *= rgba[:, :, 3:]
        sweep = Sweep(hand)
        for way in ways:
            sweep.ink(rgba, way)
    inked = rgba[:, :, 3] > 0
    values = rgba[inked]
    if ways:
        values[:, :3] /= values[:, 3:]
    pixels = np.zeros(rgba.shape, dtype=np.uint8)
    pixels[inked] = np.rint(values * 255)
    return pixels


def _glyphs(
    specimen: Specimen, offsets: Sequence[int], number: int, page: int, line: int, word: int, sheet: ScannedPage
) -> Iterator[ScannedGlyph]:
    """The letter, then those beside it, which have no name here."""
    mine = [_vertices(specimen, offsets, role) for role in (-1, 0, 1)]
    has = [bool(len(vertices)) for vertices in mine]
    before, after = number + 1 if has[0] else NOBODY, number + 1 + has[0] if has[2] else NOBODY
    places: list[Place] = [place or "alone" for place in specimen.places]
    entries, exits = (
        tuple(sheet.ligature(line, path + offsets[0]) for path in paths) for paths in (specimen.entries, specimen.exits)
    )
    yield ScannedGlyph(
        specimen.letter, places[1], page, line, word, -1, mine[1], before, after, exits if has[2] else ()
    )
    if has[0]:
        yield ScannedGlyph("", places[0], page, line, word, -1, mine[0], NOBODY, number, entries)
    if has[2]:
        yield ScannedGlyph("", places[2], page, line, word, -1, mine[2], number, NOBODY)


def _vertices(specimen: Specimen, offsets: Sequence[int], role: int) -> Indices:
    vertices = [start + np.flatnonzero(part.role == role) for part, start in zip(specimen.parts, offsets, strict=True)]
    return np.asarray(np.concatenate(vertices), dtype=np.intp)
