"""From pages that were read to a hand: every letter of the transcripts that was found, with what it is joined to.

Source: seed 000, §5.1.3.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import units
from handout.errors import InputError
from handout.hand.ligatures import LigatureFinder
from handout.hand.places import Place, graphemes, places
from handout.hand.scanned import DOUBTFUL, NOBODY, ScannedGlyph, ScannedHand, ScannedPage, Texture
from handout.progress import Tell, silent, within
from handout.scanning.text_lines import TextLines, find_text_lines, line_owners
from handout.scanning.written_page import WrittenPage
from handout.summary import one_line
from handout.tagging.align import align, frames
from handout.tagging.alignment import AlignedLine, Alignment, Letter
from handout.tagging.assign import Assignment, assign, by_letter, owners_at
from handout.tagging.cropped import cropped, doubted
from handout.tagging.features import X_HEIGHT
from handout.tagging.transcript import read_transcript
from handout.values import Indices, LineGraph

_POOR = DOUBTFUL / 2  # confidence above which no letter of a poor line is
_BESIDE, _BELOW, _ABOVE = 1.5, 2.5, 4.0  # x-heights from a letter's column and baseline within which some of a piece is
_ENDS = ("left", "right")
_ALIGNED = 0.96  # of the work on a page whose lines are known; measured
_NONE: Indices = np.zeros(0, dtype=np.intp)
_SCRIBBLE = (3.0, 0.0, 10.0)  # x-height mm, slant and pitch mm of pages without writing, where nothing goes by them
_PAPER = 64  # pixels: longest side of the paper that is kept


@dataclass(frozen=True)
class Missing:
    """A letter of a transcript that was not found: its index among the graphemes there, and the written line."""

    at: int
    letter: str
    line: int


@dataclass(frozen=True, eq=False)
class MadePage:
    """A page with its glyphs; `make_page` makes it, `read_hand` puts several together.

    glyphs : numbered from 0 on this page, all of page 0.
    notes : sentences to show the user.
    poor : numbers of the written lines whose text seems not to be what is there.
    missing : letters that are in the transcript and were not found.
    fits : how well each aligned line's text explains it, 0–1, by number of the line.
    """

    page: ScannedPage
    glyphs: tuple[ScannedGlyph, ...]
    notes: tuple[str, ...] = ()
    poor: tuple[int, ...] = ()
    missing: tuple[Missing, ...] = ()
    fits: tuple[tuple[int, float], ...] = ()

    __repr__ = one_line


def with_lines(written: WrittenPage, transcript: str, rng: np.random.Generator) -> WrittenPage:
    """The page with as many lines as its transcript has, if the text fits those better than the lines that were found.

    A transcript may break lines as the page does, and then its number of lines helps; or it may not.
    """
    count = len(read_transcript(transcript))
    if count == len(written.text_lines.lines):
        return written
    other = replace(written, text_lines=find_text_lines(written.mask.ink, written.scan.dpi, count))
    fits = [_fit(page, transcript, rng) for page in (written, other)]
    return other if fits[1] > fits[0] else written


def _fit(written: WrittenPage, transcript: str, rng: np.random.Generator) -> float:
    """How well a text explains a page's lines, weighed by its letters; 0 if not at all."""
    try:
        alignment = align(written, transcript, method="segments-once", rng=rng)
    except InputError:
        return 0.0
    weights = [len(line.letters) for line in alignment.lines]
    return float(np.average([line.fit for line in alignment.lines], weights=weights)) if sum(weights) else 0.0


def make_page(
    written: WrittenPage,
    transcript: str,
    *,
    rng: np.random.Generator,
    method: str = "segments",
    tell: Tell = silent,
) -> MadePage:
    """Find the letters of a page that has been read.

    Parameters
    ----------
    written : WrittenPage
    transcript : str
        What is written on it; words struck out as ``~~words~~`` are no letters of the hand.
    rng : numpy.random.Generator
        The same generator gives the same page.
    method : str
        Of the alignment, one of `align.METHODS`.
    tell : function, optional
        Told how far it has come.

    Raises
    ------
    InputError
        As `align`: an empty transcript, a page without lines, the transcript of another page.

    Source: seed 000, §5.1.3.
    """
    written = with_lines(written, transcript, rng)
    alignment = align(written, transcript, method=method, rng=rng, tell=within(tell, 0.0, _ALIGNED))
    tell(_ALIGNED, "the joins")
    own = line_owners(written.mask.ink, frames(written))
    assignment = assign(written.graph, alignment, owners_at(own, written.graph.uv))
    page = page_of(written, transcript)
    glyphs, missing = _glyphs(page, alignment, _within_reach(written.graph, alignment, assignment.letter))
    glyphs, cut = doubted(glyphs, cropped(written.graph, written.scan.shape, written.scan.pixel), page.source)
    notes = (*written.notes, *_notes(page, alignment, missing), *cut)
    fits = tuple((line.number, line.fit) for line in alignment.lines)
    return MadePage(page, glyphs, notes, alignment.poor, missing, fits)


def labelled_page(written: WrittenPage, transcript: str, letters: Indices) -> MadePage:
    """A page of which it is known what every vertex of its graph writes.

    Parameters
    ----------
    written : WrittenPage
    transcript : str
    letters : (n,) int: index of the grapheme of the transcript that each vertex belongs to.

    Raises
    ------
    InputError
        The page has no lines.
    """
    if not written.text_lines.lines:
        raise InputError("no line of writing was found, so its letters stand nowhere.")
    units, graph = graphemes(transcript), written.graph
    known, owner = np.unique(letters, return_inverse=True)
    near = written.text_lines.nearest(graph.xy)
    found: dict[int, list[Letter]] = {}
    for number, at in enumerate(known.tolist()):
        own = owner == number
        x, line = graph.uv[own, 0], int(np.bincount(near[own]).argmax())
        found.setdefault(line, []).append(Letter(at, units[at], float(x.min()), float(x.max()), 1.0))
    frame = frames(written)
    lines = tuple(AlignedLine(line, frame[line], tuple(row), 1.0) for line, row in sorted(found.items()))
    order = {letter.at: number for number, letter in enumerate(letter for line in lines for letter in line.letters)}
    page = page_of(written, transcript)
    numbers = np.array([order[at] for at in known.tolist()], dtype=np.intp)
    glyphs, missing = _glyphs(page, Alignment(lines, method="labels"), numbers[owner])
    return MadePage(page, glyphs, (*written.notes, *_notes(page, Alignment(lines), missing)), (), missing)


def read_hand(name: str, pages: Sequence[MadePage], title: str = "") -> ScannedHand:
    """The hand that some pages show.

    Raises
    ------
    InputError
        No page, or not a single letter on them.
    """
    glyphs: list[ScannedGlyph] = []
    for number, made in enumerate(pages):
        first = len(glyphs)
        glyphs += [_moved(glyph, number, first) for glyph in made.glyphs]
    if not glyphs:
        raise InputError(
            f"{name}: no letter was found on {units.count(len(pages), 'page')}, so there is no hand to keep."
        )
    return ScannedHand(name, title or name, tuple(made.page for made in pages), tuple(glyphs))


def read_pen(name: str, pages: Sequence[WrittenPage], title: str = "") -> ScannedHand:
    """What a pen writes like: pages of anything drawn with it, none of whose letters are known.

    Raises
    ------
    InputError
        No page.
    """
    if not pages:
        raise InputError(f"{name}: no page, so there is no pen to keep.")
    blank = TextLines((), *_SCRIBBLE)
    found = tuple(page_of(replace(page, text_lines=blank), "") for page in pages)
    return ScannedHand(name, title or name, found, ())


def _moved(glyph: ScannedGlyph, page: int, first: int) -> ScannedGlyph:
    before, after = (n + first if n >= 0 else n for n in (glyph.before, glyph.after))
    return replace(glyph, page=page, before=before, after=after)


def page_of(written: WrittenPage, transcript: str) -> ScannedPage:
    """What is kept of a page; its places are pixels of the file's own picture, before borders were cut off."""
    scan = written.scan
    dx, dy = scan.origin
    graph = written.graph
    uv = graph.uv + np.array(scan.origin)
    lines = [
        (frame.baseline[0] + dy, frame.baseline[1], frame.baseline[2], frame.middle + dx, frame.reach)
        for frame in frames(written)
    ]
    return ScannedPage(
        source=Path(scan.source).name,
        transcript=transcript,
        dpi=scan.dpi,
        shape=(scan.shape[0] + dy, scan.shape[1] + dx),
        graph=LineGraph((uv + 0.5) * scan.pixel, graph.radius, graph.density, uv, graph.edges),
        baselines=np.array(lines).reshape(-1, 5),
        pitch=written.text_lines.pitch,
        x_height=written.text_lines.x_height,
        slant=written.text_lines.slant,
        pen=written.mask.pen,
        texture=_texture(written.matte.rgba, (dx, dy)),
        paper=_reduced(written.matte.paper),
        moments=written.moments,
    )


def _texture(rgba: NDArray[np.uint8], origin: tuple[int, int]) -> Texture:
    """The ink, cut to its own box."""
    inky = rgba[:, :, 3] > 0
    rows, columns = np.flatnonzero(inky.any(axis=1)), np.flatnonzero(inky.any(axis=0))
    top, bottom = (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, 1)
    left, right = (int(columns[0]), int(columns[-1]) + 1) if len(columns) else (0, 1)
    cut = np.ascontiguousarray(rgba[top:bottom, left:right])
    cut[cut[:, :, 3] == 0] = 0
    return Texture((left + origin[0], top + origin[1]), (bottom - top, right - left), lambda: cut)


def _reduced(paper: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import cv2

    height, width = paper.shape[:2]
    part = min(1.0, _PAPER / max(height, width))
    size = (max(1, round(width * part)), max(1, round(height * part)))
    return np.asarray(cv2.resize(paper, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _within_reach(graph: LineGraph, alignment: Alignment, letter: Indices) -> Indices:
    """The letter of each vertex (n,), −1 for pieces that lie nowhere near it: the edge of the sheet, a stain."""
    near = np.zeros(len(graph), dtype=bool)
    first = 0
    for line in alignment.lines:
        own = np.flatnonzero((letter >= first) & (letter < first + len(line.letters)))
        at = letter[own] - first
        u, up = line.frame.to_line(graph.uv[own]).T / X_HEIGHT
        unit = line.frame.scale / X_HEIGHT
        left, right = ((np.array([getattr(x, end) for x in line.letters]) - line.frame.left) * unit for end in _ENDS)
        away = np.maximum(left[at] - u, u - right[at])
        near[own] = (away < _BESIDE) & (up > -_BELOW) & (up < _ABOVE)
        first += len(line.letters)
    _, piece = np.unique(np.stack([letter, graph.components]), axis=1, return_inverse=True)
    reached = np.zeros(int(piece.max(initial=0)) + 1, dtype=bool)
    np.logical_or.at(reached, piece.ravel(), near)
    return np.where(reached[piece.ravel()], letter, NOBODY)


def _glyphs(
    page: ScannedPage, alignment: Alignment, letters: Indices
) -> tuple[tuple[ScannedGlyph, ...], tuple[Missing, ...]]:
    """The letters that were found, in the order of the text, and those that were not."""
    numbered = _numbered(page.transcript)
    vertices = by_letter(Assignment(letters, _NONE), len(alignment.letters))
    owner = np.full(len(page.graph), NOBODY, dtype=np.intp)
    glyphs: list[ScannedGlyph] = []
    missing: list[Missing] = []
    for (line, letter), own in zip(_in_order(alignment), vertices, strict=True):
        if _struck(letter):
            continue
        if not letter.present or not len(own):
            missing.append(Missing(letter.at, letter.text, line.number))
            continue
        word, place = numbered[letter.at]
        sure = min(letter.confidence, _POOR) if line.number in alignment.poor else letter.confidence
        owner[own] = len(glyphs)
        glyphs.append(
            ScannedGlyph(letter.text, place, 0, line.number, word, letter.at, np.sort(own), confidence=float(sure))
        )
    return tuple(_joined(page, glyphs, owner)), tuple(missing)


def _in_order(alignment: Alignment) -> Iterable[tuple[AlignedLine, Letter]]:
    return ((line, letter) for line in alignment.lines for letter in line.letters)


def _struck(letter: Letter) -> bool:
    """Whether it stands for several graphemes: something struck out."""
    return len(graphemes(letter.text)) > 1


def _joined(page: ScannedPage, glyphs: list[ScannedGlyph], owner: Indices) -> list[ScannedGlyph]:
    """The glyphs with their neighbours, of which nothing between is missing, and the ligatures towards those."""
    joining = LigatureFinder(page, owner)
    done = list(glyphs)
    for i, (a, b) in enumerate(pairwise(glyphs)):
        if a.word == b.word and a.line == b.line and b.at == a.at + 1:
            done[i] = replace(done[i], after=i + 1, ligatures=joining.between(i, i + 1, a.line))
            done[i + 1] = replace(b, before=i)
    return done


def _numbered(transcript: str) -> list[tuple[int, Place]]:
    """For every grapheme of a text the number of its word, and its place among the letters, or digits, there."""
    units = graphemes(transcript)
    # a word begins after a space
    first = [not unit.isspace() and (i == 0 or units[i - 1].isspace()) for i, unit in enumerate(units)]
    return list(zip((np.cumsum(first) - 1).tolist(), places(units), strict=True))


def _notes(page: ScannedPage, alignment: Alignment, missing: Sequence[Missing]) -> list[str]:
    text = {line.number: line.text for line in alignment.lines}
    said = [
        f"{page.source}, line {number + 1}: “{_short(text.get(number, ''))}” seems not to be what is written there; "
        "its letters are kept as doubtful."
        for number in alignment.poor
    ]
    if missing:
        named = ", ".join(f"{one.letter} (line {one.line + 1})" for one in missing[:12])
        more = f" and {len(missing) - 12} more" if len(missing) > 12 else ""
        said.append(f"{page.source}: not found on the page: {named}{more}.")
    return said


def _short(text: str) -> str:
    return text if len(text) <= 24 else text[:23] + "…"
