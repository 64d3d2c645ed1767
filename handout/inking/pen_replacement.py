"""Writing with another pen: the line stays, its ink is put together from pieces of a line that the other pen drew.

`ink_drawing` makes a page of scanned ink a drawing; strokes on it, such as those that strike a word out, are written in
the ink of its letters.

Source: seed 000, §7.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand.measures import half_width
from handout.hand.scanned import NO_PAGE, NOBODY, ScannedHand
from handout.inking.swatches import Swatches, Track, swatches, tracks
from handout.inking.texture import texture
from handout.libraries import spatial
from handout.values import ActionPlan, Array, Drawing, Glyph, Ink, Line, LineGraph, Manuscript, Placed

_ONE = 0.12  # mm within which two lines are one
_LONGEST = 0.4  # mm that a cut line is joined over


def weld_graphs(graphs: Sequence[LineGraph]) -> LineGraph:
    """One graph of several in the same frame (mm); where the next shows the line of those before, it is left out.

    A line that is cut by this goes on in the vertex of the others that is nearest to the cut.
    """
    whole = graphs[0]
    for graph in graphs[1:]:
        whole = _weld_pair(whole, graph)
    return whole


def _weld_pair(a: LineGraph, b: LineGraph) -> LineGraph:
    if not (len(a) and len(b)):
        return a if len(a) else b
    away, at = spatial.cKDTree(a.xy).query(b.xy)
    gone = (away < _ONE) & (np.abs(np.sum(directions(a)[at] * directions(b), axis=1)) > np.sqrt(0.75))
    if gone.all():
        return a
    rest = b.take(~gone)
    number = np.cumsum(~gone) - 1
    cut = b.edges[gone[b.edges].sum(axis=1) == 1]
    inner = np.where(gone[cut[:, 0]], cut[:, 1], cut[:, 0])
    lost = np.where(gone[cut[:, 0]], cut[:, 0], cut[:, 1])
    near = away[lost] < _LONGEST
    joins = np.stack([at[lost], number[inner] + len(a)], axis=1)[near]
    edges = np.concatenate([a.edges, rest.edges + len(a), joins])
    xy, radius, density, uv = (
        np.concatenate([getattr(graph, name) for graph in (a, rest)]) for name in ("xy", "radius", "density", "uv")
    )
    return LineGraph(xy, radius, density, uv, edges)


def directions(graph: LineGraph) -> Array:
    """(n, 2) float: where the line leads at every vertex, one way or the other; 0 at junctions and dots."""
    first, second = np.full(len(graph), -1), np.full(len(graph), -1)
    a, b = np.concatenate([graph.edges, graph.edges[:, ::-1]]).T
    first[a] = b
    second[a[::-1]] = b[::-1]
    simple: NDArray[np.bool_] = (graph.degree == 2) | (graph.degree == 1)
    here = np.arange(len(graph))
    first, second = np.where(simple, first, here), np.where(simple, second, here)
    along = graph.xy[first] - graph.xy[np.where(first == second, here, second)]
    size = np.linalg.norm(along, axis=1, keepdims=True)
    return np.asarray(along / np.maximum(size, 1e-12))


_VERTEX_STEP = 0.08  # mm between vertices of the new line


@dataclass(frozen=True, eq=False)
class _LinePiece:
    """A part of a written line that one swatch is laid on.

    layer : 0 or 1: pieces of one layer follow each other, those of the other lie across their ends.
    """

    track: Track
    start: float
    end: float
    layer: int


def replace_pen(manuscript: Manuscript, sample: ScannedHand, *, width: float | None = None) -> Manuscript:
    """The same writing with another pen.

    manuscript : of scanned ink; glyphs without are left out.
    sample : pages written with the pen; their letters need not be known.
    width : mm, of the usual line, 0.05 to 10; None: as wide as the pen's own.

    Returns a manuscript with ink of `sample`: give this to `texture` in place of the hand.  A word is two layers, of
    which each covers the ends of the other's pieces.

    Raises InputError: a width out of its bounds, or a sample without enough clear lines.

    Source: seed 000, §7.2.
    """
    if width is not None and not 0.05 <= width <= 10:
        raise InputError(f"width of the line: {width:g} mm is outside 0.05 to 10 mm.")
    pens = swatches(sample)
    half_width = _half_width(manuscript)
    usual = 1.0 if half_width is None else half_width
    words = [word for line in manuscript.lines for word in _words(line)]
    rewritten: list[list[Placed]] = [[] for _ in words]
    for turn, pen in enumerate(pens):
        mine = slice(turn, None, len(pens))
        rewritten[mine] = _rewrite_words(words[mine], pen, usual, pen.radius if width is None else width / 2)
    inked = iter(rewritten)
    lines = [
        replace(line, placed=tuple(placed for _ in _words(line) for placed in next(inked))) for line in manuscript.lines
    ]
    return replace(manuscript, lines=tuple(lines))


def _half_width(page: Manuscript) -> float | None:
    """mm, half the usual width of the ink's line; None for a page without."""
    radii = [placed.ink.graph.radius for line in page.lines for placed in line.placed if placed.ink is not None]
    return float(np.median(np.concatenate(radii))) if sum(map(len, radii)) else None


def _words(line: Line) -> list[list[Placed]]:
    inked = [placed for placed in line.placed if placed.ink is not None]
    return [list(word) for _, word in groupby(inked, key=lambda placed: placed.word)]


def _rewrite_words(words: Sequence[Sequence[Placed]], pen: Swatches, usual: float, wanted: float) -> list[list[Placed]]:
    """Words in the pen's ink, two layers each; half the width of the line is `usual`, mm, and shall be `wanted`."""
    larger = wanted / pen.radius  # than the pen's own line
    cut = [_pieces_of(word, usual, wanted, pen.length * larger) for word in words]
    lines = list(chain.from_iterable(cut))
    if not lines:
        return [[] for _ in words]
    follows = [b.track is a.track for a, b in pairwise(chain.from_iterable(lines))]
    features = [
        pieces[0].track.features(
            np.array([piece.start for piece in pieces]), max(pieces[0].end - pieces[0].start, 1e-6), wanted
        )
        for pieces in lines
    ]
    chosen = iter(pen.choose(np.concatenate(features), np.array([False, *follows])).tolist())
    inked = []
    for word, lines_of_word in zip(words, cut, strict=True):
        pieces = list(chain.from_iterable(lines_of_word))
        choice = [next(chosen) for _ in pieces]
        inks = (_layer(pieces, choice, layer, pen, larger) for layer in (0, 1))
        inked.append([replace(word[0], ink=ink) for ink in inks if ink is not None])
    return inked


def _pieces_of(word: Sequence[Placed], usual: float, wanted: float, length: float) -> list[list[_LinePiece]]:
    """The pieces of every line of a word, `length` mm long; half the width of its line, `usual`, becomes `wanted`."""
    graph = weld_graphs([placed.ink.graph for placed in word if placed.ink is not None])
    resized = LineGraph(graph.xy, graph.radius * wanted / usual, graph.density, graph.uv, graph.edges)
    pieces = []
    for track in tracks(resized):
        count = 2 * max(1, round(track.length / length))
        at = np.linspace(0, track.length, count + 1).tolist()
        # in order, each half over the one before
        halves = [_LinePiece(track, at[i], at[i + 2], i % 2) for i in range(count - 1)]
        pieces.append(halves if track.length else [_LinePiece(track, 0.0, 0.0, 0)])
    return pieces


def _layer(pieces: Sequence[_LinePiece], chosen: Sequence[int], layer: int, pen: Swatches, larger: float) -> Ink | None:
    """One of the two layers of a word."""
    parts = [
        _swatch_rows(piece, pen.tracks[pen.track[number]], float(pen.start[number]), larger, pen.length)
        for piece, number in zip(pieces, chosen, strict=True)
        if piece.layer == layer
    ]
    if not parts:
        return None
    first = np.cumsum([0] + [len(part[0]) for part in parts])
    edges = [np.stack([np.arange(a, b - 1), np.arange(a + 1, b)], axis=1) for a, b in pairwise(first.tolist())]
    xy, radius, density, uv = (np.concatenate(values) for values in zip(*parts, strict=True))
    return Ink(LineGraph(xy, radius, density, uv, np.concatenate(edges)), pen.page, NOBODY)


def _swatch_rows(
    piece: _LinePiece, swatch: Track, start: float, larger: float, length: float
) -> tuple[Array, Array, Array, Array]:
    """Places, radii, densities and places in the picture of a piece with a swatch on it, at the pen's own scale."""
    long = piece.end - piece.start
    at = np.linspace(piece.start, piece.end, max(1 if long == 0 else 2, int(np.ceil(long / _VERTEX_STEP)) + 1))
    # a short piece takes the end of its swatch that is an end of a line, or else the middle
    span = min(long / larger, length)
    loose = swatch.loose[0] and start < 0.3 * length
    there = start + (0 if loose and long else (length - span) / 2) + (at - piece.start) / max(long, 1e-9) * span
    line, ink = piece.track.rows(at), swatch.rows(there)
    return line[:, :2], line[:, 4], line[:, 5], ink[:, 2:4]


_SMOOTH = 0.28  # of the movement, see ActionPlan: a stroke that is not aimed rounds its turns
_LEAST, _MOST = 0.05, 10.0  # mm, of a line


def add_strokes(page: Manuscript, written: Manuscript, sample: ScannedHand) -> Manuscript:
    """A page with the strokes of what was written on it, inked, after the letters of their lines.

    page : of ink of `sample`.
    written : the same lines, in which the strokes are; its ink is not looked at.
    sample : whose ink the strokes are written with, as wide as the letters of the page.

    Raises InputError: there are strokes, and too few clear pieces of line to write them with.
    """
    lines = [
        replace(x, placed=tuple(_strokes_as_line(p, sample) for p in x.placed if p.strokes)) for x in written.lines
    ]
    if not any(line.placed for line in lines):
        return page
    letter_half_width = _half_width(page)
    width = None if letter_half_width is None else float(np.clip(2 * letter_half_width, _LEAST, _MOST))
    inked = replace_pen(replace(written, lines=tuple(lines)), sample, width=width)
    both = [replace(a, placed=a.placed + b.placed) for a, b in zip(page.lines, inked.lines, strict=True)]
    return replace(page, lines=tuple(both))


def _strokes_as_line(placed: Placed, sample: ScannedHand) -> Placed:
    """Strokes as a line without ink."""
    from handout.motion.optimal_control import follow

    ways = list[Array]()
    for stroke in placed.strokes:  # as a hand goes them
        _, xy = follow(ActionPlan(stroke, 1.0, _SMOOTH), baked_at=_SMOOTH)
        ways.append(xy[np.concatenate([[True], (np.abs(np.diff(xy, axis=0)) > 1e-9).any(axis=1)])])
    first = np.cumsum([0, *map(len, ways)])
    edges = [np.column_stack([np.arange(a, b - 1), np.arange(a + 1, b)]) for a, b in pairwise(first.tolist())]
    count = int(first[-1])
    radius = np.full(count, half_width(sample))
    graph = LineGraph(np.concatenate(ways), radius, np.ones(count), np.zeros((count, 2)), np.concatenate(edges))
    return Placed(Glyph("", (), (), 0.0), (), False, placed.word, placed.at, Ink(graph, NO_PAGE, NOBODY))


def ink_drawing(manuscript: Manuscript, hand: ScannedHand, pen: ScannedHand | None = None) -> Drawing:
    """The drawing whose ink is that of the manuscript's glyphs; pixels are made when they are asked for.

    manuscript : of glyphs of `hand`.
    pen : whose ink is taken instead of the hand's own; its letters need not be known.

    Raises InputError: a pen of which there is too little.
    """
    about = {"hand": hand.name, **manuscript.about}
    letters = manuscript
    if pen is not None:
        letters = replace_pen(manuscript, pen)
        about["pen"] = pen.name
    written = add_strokes(letters, manuscript, pen or hand)
    inks = [placed.ink.graph for line in written.lines for placed in line.placed if placed.ink is not None]
    bounds = None
    if inks:
        xy = np.concatenate([graph.xy for graph in inks])
        radius = np.concatenate([graph.radius for graph in inks])[:, None]
        bounds = (*(xy - radius).min(axis=0).tolist(), *(xy + radius).max(axis=0).tolist())
    return Drawing((), manuscript.page, about, partial(texture, written, pen or hand), bounds)
