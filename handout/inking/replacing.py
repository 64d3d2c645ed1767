"""Writing with another pen: the line stays, its ink is put together from pieces of a line that the other pen drew.

Source: seed 000, §7.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise

import numpy as np

from handout.errors import InputError
from handout.hand.scanned import NOBODY, ScannedHand
from handout.inking.swatches import FEATURES, Swatches, Track, swatches, tracks
from handout.inking.welding import welded
from handout.values import Array, Ink, Line, LineGraph, Manuscript, Placed

_STEP = 0.08  # mm between vertices of the new line


@dataclass(frozen=True, eq=False)
class _Piece:
    """A part of a written line that one swatch is laid on.

    layer : 0 or 1: pieces of one layer follow each other, those of the other lie across their ends.
    """

    track: Track
    start: float
    end: float
    layer: int


def replace_pen(manuscript: Manuscript, sample: ScannedHand, *, width: float | None = None) -> Manuscript:
    """The same writing with another pen.

    Parameters
    ----------
    manuscript : Manuscript
        Of scanned ink; glyphs without are left out.
    sample : ScannedHand
        Pages written with the pen; their letters need not be known.
    width : float, optional
        mm, of the usual line, 0.05 to 10; None: as wide as the pen's own.

    Returns
    -------
    Manuscript
        Its ink is that of `sample`: give this to `texture` in place of the hand.  A word is two layers, of which each
        covers the ends of the other's pieces.

    Raises
    ------
    InputError
        A width out of its bounds, or a sample without enough clear lines.

    Source: seed 000, §7.2.
    """
    if width is not None and not 0.05 <= width <= 10:
        raise InputError(f"width of the line: {width:g} mm is outside 0.05 to 10 mm.")
    pens = swatches(sample)
    radii = [p.ink.graph.radius for line in manuscript.lines for p in line.placed if p.ink is not None]
    usual = float(np.median(np.concatenate(radii))) if radii and sum(map(len, radii)) else 1.0
    words = [word for line in manuscript.lines for word in _words(line)]
    rewritten: list[list[Placed]] = [[] for _ in words]
    for turn, pen in enumerate(pens):
        mine = slice(turn, None, len(pens))
        rewritten[mine] = _rewritten(words[mine], pen, usual, pen.radius if width is None else width / 2)
    found = iter(rewritten)
    lines = [
        replace(line, placed=tuple(placed for _ in _words(line) for placed in next(found))) for line in manuscript.lines
    ]
    return replace(manuscript, lines=tuple(lines))


def _words(line: Line) -> list[list[Placed]]:
    inked = [placed for placed in line.placed if placed.ink is not None]
    return [list(word) for _, word in groupby(inked, key=lambda placed: placed.word)]


def _rewritten(words: Sequence[Sequence[Placed]], pen: Swatches, usual: float, wanted: float) -> list[list[Placed]]:
    """Words in the pen's ink, two layers each; the radius of the line is `usual`, mm, and shall be `wanted`."""
    larger = wanted / pen.radius  # than the pen's own line
    pieces, features = list[list[_Piece]](), [np.zeros((0, FEATURES))]
    for word in words:
        graph = welded([placed.ink.graph for placed in word if placed.ink is not None])
        own = LineGraph(graph.xy, graph.radius * wanted / usual, graph.density, graph.uv, graph.edges)
        cut = [_cut(track, pen.length * larger) for track in tracks(own)]
        pieces.append([piece for some in cut for piece in some])
        for some in cut:
            start = np.array([piece.start for piece in some])
            features.append(some[0].track.features(start, max(some[0].end - some[0].start, 1e-6), wanted))
    every = [piece for some in pieces for piece in some]
    if not every:
        return [[] for _ in words]
    follows = [b.track is a.track for a, b in pairwise(every)]
    chosen = iter(pen.choose(np.concatenate(features), np.array([False, *follows])).tolist())
    made = []
    for word, some in zip(words, pieces, strict=True):
        own_choice = [next(chosen) for _ in some]
        inks = (_layer(some, own_choice, layer, pen, larger) for layer in (0, 1))
        made.append([replace(word[0], ink=ink) for ink in inks if ink is not None])
    return made


def _cut(track: Track, length: float) -> list[_Piece]:
    """The pieces of a line in order, each half over the one before."""
    count = 2 * max(1, round(track.length / length))
    at = np.linspace(0, track.length, count + 1).tolist()
    if track.length == 0:
        return [_Piece(track, 0.0, 0.0, 0)]
    return [_Piece(track, at[i], at[i + 2], i % 2) for i in range(count - 1)]


def _layer(pieces: Sequence[_Piece], chosen: Sequence[int], layer: int, pen: Swatches, larger: float) -> Ink | None:
    """One of the two layers of a word."""
    parts = [
        _laid(piece, pen.tracks[pen.track[number]], float(pen.start[number]), larger, pen.length)
        for piece, number in zip(pieces, chosen, strict=True)
        if piece.layer == layer
    ]
    if not parts:
        return None
    first = np.cumsum([0] + [len(part[0]) for part in parts])
    edges = [np.stack([np.arange(a, b - 1), np.arange(a + 1, b)], axis=1) for a, b in pairwise(first.tolist())]
    xy, radius, density, uv = (np.concatenate(values) for values in zip(*parts, strict=True))
    return Ink(LineGraph(xy, radius, density, uv, np.concatenate(edges)), pen.page, NOBODY)


def _laid(
    piece: _Piece, swatch: Track, start: float, larger: float, length: float
) -> tuple[Array, Array, Array, Array]:
    """Places, radii, densities and places in the picture of a piece with a swatch on it, at the pen's own scale."""
    long = piece.end - piece.start
    at = np.linspace(piece.start, piece.end, max(1 if long == 0 else 2, int(np.ceil(long / _STEP)) + 1))
    # a short piece takes the end of its swatch that is an end of a line, or else the middle
    taken = min(long / larger, length)
    loose = swatch.loose[0] and start < 0.3 * length
    there = start + (0 if loose and long else (length - taken) / 2) + (at - piece.start) / max(long, 1e-9) * taken
    own, ink = piece.track.rows(at), swatch.rows(there)
    return own[:, :2], own[:, 4], own[:, 5], ink[:, 2:4]
