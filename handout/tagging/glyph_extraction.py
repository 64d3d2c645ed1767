"""What a hand keeps of an aligned page: the page itself, its glyphs, and the ligatures between them.

Glyphs that the edge of the picture cuts off are kept, but doubted, and named in a note.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from handout.hand.ligatures import find_again
from handout.hand.places import graphemes, places, word_numbers
from handout.hand.scanned import NOBODY, KeptScan, ScannedGlyph, ScannedPage, Texture
from handout.scanning.scan import Scan
from handout.scanning.written_page import WrittenPage
from handout.tagging.alignment import Alignment
from handout.tagging.letter_assignment import Assignment, by_letter
from handout.tagging.line_space import X_HEIGHT, frames
from handout.values import Array, Indices, LineGraph

# x-heights from a letter's column and baseline within which some part of its pieces lies; set by eye on real pages
_BESIDE, _BELOW, _ABOVE = 1.5, 2.5, 4.0
_PAPER = 64  # pixels: longest side of the paper that is kept, for its colour and shading only
_COARSE = 8  # pixels: how finely what lies around the writing is told from the rest
_MOST = 16383  # pixels of a side of a WebP
_QUALITY = 75  # of the scan that is kept: 80 to 150 KB a page of 300 dpi, and masks as from the scan itself
_LISTED = 12  # letters that a note names
_NO_JOINTS: Indices = np.zeros(0, dtype=np.intp)


@dataclass(frozen=True)
class Missing:
    """A letter of a transcript that was not found: its index among the graphemes there, and the written line."""

    at: int
    letter: str
    line: int


def scanned_page(written: WrittenPage, transcript: str) -> ScannedPage:
    """What is kept of a page; its places are pixels of the file's own picture, before borders were cut off."""
    import cv2

    scan, graph, text_lines = written.scan, written.graph, written.text_lines
    dx, dy = scan.origin
    uv = graph.uv + np.array(scan.origin)
    lines = [
        (frame.baseline[0] + dy, frame.baseline[1], frame.baseline[2], frame.middle + dx, frame.reach)
        for frame in frames(written)
    ]
    # the ink, cut to its own box
    rgba = written.matte.rgba
    inky = rgba[:, :, 3] > 0
    rows, columns = np.flatnonzero(inky.any(axis=1)), np.flatnonzero(inky.any(axis=0))
    top, bottom = (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, 1)
    left, right = (int(columns[0]), int(columns[-1]) + 1) if len(columns) else (0, 1)
    cut = np.ascontiguousarray(rgba[top:bottom, left:right])
    cut[cut[:, :, 3] == 0] = 0
    paper = written.matte.paper
    height, width = paper.shape[:2]
    part = min(1.0, _PAPER / max(height, width))
    size = (max(1, round(width * part)), max(1, round(height * part)))
    return ScannedPage(
        source=Path(scan.source).name,
        transcript=transcript,
        dpi=scan.dpi,
        shape=(scan.shape[0] + dy, scan.shape[1] + dx),
        graph=LineGraph((uv + 0.5) * scan.pixel, graph.radius, graph.density, uv, graph.edges),
        baselines=np.array(lines).reshape(-1, 5),
        pitch=text_lines.pitch,
        x_height=text_lines.x_height,
        slant=text_lines.slant,
        pen=written.mask.pen,
        texture=Texture((left + dx, top + dy), (bottom - top, right - left), lambda: cut),
        paper=np.asarray(cv2.resize(paper, size, interpolation=cv2.INTER_AREA), dtype=np.uint8),
        moments=written.moments,
        scan=_keep_around(scan, uv, text_lines.pitch / scan.pixel) if written.moments is None else None,
    )


def _keep_around(scan: Scan, uv: Array, reach: float) -> KeptScan | None:
    """The scan up to `reach` pixels from some places (n, 2) of the file's own picture; elsewhere its usual colour."""
    import cv2

    (dx, dy), (height, width) = scan.origin, scan.shape
    if max(height + dy, width + dx) > _MOST:
        return None
    far = np.ones((-(-height // _COARSE), -(-width // _COARSE)), dtype=np.uint8)
    column, row = (np.rint(uv - (dx, dy)).astype(np.intp) // _COARSE).T
    far[np.clip(row, 0, far.shape[0] - 1), np.clip(column, 0, far.shape[1] - 1)] = 0
    away = cv2.distanceTransform(far, cv2.DIST_L2, 5) * _COARSE
    near = (away <= reach).repeat(_COARSE, axis=0).repeat(_COARSE, axis=1)[:height, :width]
    pixels = np.empty((height + dy, width + dx, 3), dtype=np.uint8)
    pixels[:] = np.median(scan.rgb[::_COARSE, ::_COARSE].reshape(-1, 3), axis=0)[::-1]
    pixels[dy:, dx:][near] = scan.rgb[near][:, ::-1]
    return KeptScan(pixels.shape[:2], lambda: pixels, lambda: _webp(pixels))


def _webp(pixels: NDArray[np.uint8]) -> bytes:
    """A picture (h, w, 3), blue first, packed."""
    import cv2

    _, data = cv2.imencode(".webp", pixels, [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])
    return bytes(data)


def letters_within_reach(graph: LineGraph, alignment: Alignment, letter: Indices) -> Indices:
    """The letter of each vertex (n,), −1 for pieces that lie nowhere near it: the edge of the sheet, a stain."""
    near = np.zeros(len(graph), dtype=bool)
    first = 0
    for line in alignment.lines:
        vertices = np.flatnonzero((letter >= first) & (letter < first + len(line.letters)))
        at = letter[vertices] - first
        u, up = line.frame.to_line(graph.uv[vertices]).T / X_HEIGHT
        unit = line.frame.scale / X_HEIGHT
        left = (np.array([each.left for each in line.letters]) - line.frame.left) * unit
        right = (np.array([each.right for each in line.letters]) - line.frame.left) * unit
        away = np.maximum(left[at] - u, u - right[at])
        near[vertices] = (away < _BESIDE) & (up > -_BELOW) & (up < _ABOVE)
        first += len(line.letters)
    _, piece = np.unique(np.stack([letter, graph.components]), axis=1, return_inverse=True)
    reached = np.zeros(int(piece.max(initial=0)) + 1, dtype=bool)
    np.logical_or.at(reached, piece.ravel(), near)
    return np.where(reached[piece.ravel()], letter, NOBODY)


def extract_glyphs(
    page: ScannedPage, alignment: Alignment, letters: Indices, crossings: Mapping[int, Indices] = MappingProxyType({})
) -> tuple[tuple[ScannedGlyph, ...], tuple[Missing, ...]]:
    """The letters that were found, in the order of the text, and those that were not.

    letters : (n,) int: index of each vertex's letter in `Alignment.letters`, −1 for none.
    crossings : index of a letter → vertices, rising, that are its as well as another's.
    """
    units = graphemes(page.transcript)
    words = list(zip(word_numbers(units), places(units), strict=True))
    vertices = by_letter(Assignment(letters, _NO_JOINTS), len(alignment.letters))
    glyphs: list[ScannedGlyph] = []
    missing: list[Missing] = []
    in_order = ((line, letter) for line in alignment.lines for letter in line.letters)
    for number, ((line, letter), of_letter) in enumerate(zip(in_order, vertices, strict=True)):
        if len(graphemes(letter.text)) > 1:  # something struck out
            continue
        if not letter.present or not len(of_letter):
            missing.append(Missing(letter.at, letter.text, line.number))
            continue
        word, place = words[letter.at]
        confidence = 0.0 if line.number in alignment.poor else letter.confidence
        sorted_ = np.union1d(of_letter, crossings.get(number, of_letter))
        glyphs.append(
            ScannedGlyph(letter.text, place, 0, line.number, word, letter.at, sorted_, confidence=float(confidence))
        )
    # a glyph has a neighbour, and ligatures towards it, where no letter between is missing
    joined = list(glyphs)
    for i, (a, b) in enumerate(pairwise(glyphs)):
        if a.word == b.word and a.line == b.line and b.at == a.at + 1:
            joined[i] = replace(joined[i], after=i + 1)
            joined[i + 1] = replace(b, before=i)
    return find_again(joined, [page]), tuple(missing)


def doubt_cropped_glyphs(
    glyphs: Sequence[ScannedGlyph], graph: LineGraph, scan: Scan
) -> tuple[tuple[ScannedGlyph, ...], list[str]]:
    """The glyphs, without confidence where their ink reaches the edge of the scan, and the note that names these."""
    at_edge = reaches_edge(graph, scan.shape, scan.pixel)
    cropped = [bool(at_edge[glyph.vertices].any()) for glyph in glyphs]
    doubted = tuple(
        replace(glyph, confidence=0.0) if cut else glyph for glyph, cut in zip(glyphs, cropped, strict=True)
    )
    if not any(cropped):
        return doubted, []
    names = [f"{glyph.letter} (line {glyph.line + 1})" for glyph, cut in zip(glyphs, cropped, strict=True) if cut]
    return doubted, [
        f"{Path(scan.source).name}: the edge of the picture cuts {list_names(names)}; kept as doubtful. Scan the whole "
        "page, if there is more of it."
    ]


def reaches_edge(graph: LineGraph, shape: tuple[int, int], pixel: float) -> NDArray[np.bool_]:
    """(n,): whether the line of each vertex reaches the edge of its picture.

    graph : of a page, with `uv` in pixels of that picture and radii in mm.
    shape : (height, width), pixels.
    pixel : mm, its side.
    """
    room = np.minimum(graph.uv + 0.5, np.array(shape[::-1]) - 0.5 - graph.uv).min(axis=1)
    return np.asarray(room < np.maximum(graph.radius / pixel - 0.5, 0.5))


def list_names(names: Sequence[str]) -> str:
    """Names in a row, no more than a note can bear."""
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return ", ".join(names[:_LISTED]) + more
