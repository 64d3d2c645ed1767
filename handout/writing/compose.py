"""Text and hand to manuscripts: the pipeline of the writing room."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from handout.errors import DoesNotFit
from handout.values import Hand, Manuscript
from handout.writing import text as texts
from handout.writing.layout import Layout
from handout.writing.lines import Row, Unit, wrap
from handout.writing.sheets import lines_a_page, paginate, room, spacing
from handout.writing.text import Letter
from handout.writing.variation import USUAL
from handout.writing.words import Writer, write_part

_SMALLEST_FIT = 0.55  # --fit never makes writing smaller than this share of what was asked for
_BUNCHED = (0.72, 0.88)  # what --fit then makes of word gaps and line distance
_BREAK_AFTER = "-–—/"
_MOST_SPACES = 12


def compose(
    text: str,
    hand: Hand,
    layout: Layout,
    rng: np.random.Generator,
    *,
    pages: int | None = None,
    fallback: bool = False,
) -> list[Manuscript]:
    """Write `text` in `hand`, without ink and without time.

    Parameters
    ----------
    text : str
        Unicode; a newline starts a paragraph, leading spaces indent it.
    layout : Layout
        Page, margins, size, alignment.
    rng : numpy.random.Generator
        All variation comes from it.
    pages : int, optional
        How many pages there may be; None: as many as are needed (one, where `layout.fit` asks to shrink).
    fallback : bool
        Accept borrowed forms for characters that the hand lacks.

    Returns
    -------
    list of Manuscript, one a page.

    Raises
    ------
    InputError, MissingCharacters
        Nothing to write, or not in this hand.
    DoesNotFit
        More text than the pages hold; the message says by how much.
    """
    tokens = texts.spell(texts.normalise(text), hand, fallback=fallback)
    paragraphs = _write_paragraphs(tokens, hand, rng, layout)
    limit = pages or (1 if layout.fit else None)
    layout, rows = _set(paragraphs, hand, layout, limit)
    return paginate(rows, hand, layout, rng)


def _write_paragraphs(
    tokens: Sequence[Letter | str], hand: Hand, rng: np.random.Generator, layout: Layout
) -> list[tuple[float, list[Unit]]]:
    """(indent, units) of every paragraph; the words are written here, once, whatever the lines will be."""
    writer = Writer(hand, rng, layout.jitter)
    paragraphs = []
    for paragraph in _split(tokens, "\n"):
        indent, spaces = 0.0, 0
        units: list[Unit] = []
        for piece in _pieces(paragraph):
            if isinstance(piece, int):
                spaces = piece
                continue
            word = writer.word(piece)
            gap = _gap(spaces, hand, rng, layout.jitter)
            if not units and spaces:
                indent = gap
            units.append(Unit(word, gap))
            spaces = 0
        paragraphs.append((indent, units))
    return paragraphs


def _gap(spaces: int, hand: Hand, rng: np.random.Generator, jitter: float) -> float:
    if not spaces:
        return 0.0
    wide = hand.word_space * (1 + 0.75 * (min(spaces, _MOST_SPACES) - 1))
    # a writer has one habit of spacing: neither a closed gap nor one that reads as two
    slack = rng.normal(0.0, USUAL.word_gap * jitter)
    return wide + min(max(slack, -0.28 * hand.word_space), 0.5 * hand.word_space)


def _split(tokens: Sequence[Letter | str], mark: str) -> Iterator[list[Letter | str]]:
    part: list[Letter | str] = []
    for token in tokens:
        if token == mark:
            yield part
            part = []
        else:
            part.append(token)
    yield part


def _pieces(paragraph: Sequence[Letter | str]) -> Iterator[list[Letter] | int]:
    """What is written in one go, and between them the number of spaces; a line may break after a hyphen."""
    piece: list[Letter] = []
    spaces = 0
    for token in paragraph:
        if isinstance(token, str):
            if piece:
                yield piece
                piece = []
            spaces += 1
            continue
        if spaces:
            yield spaces
            spaces = 0
        if len(piece) > 1 and piece[-1].base in _BREAK_AFTER and token.base.isalpha():
            yield piece
            piece = []
        piece.append(token)
    if piece:
        yield piece


def _set(
    paragraphs: Sequence[tuple[float, list[Unit]]], hand: Hand, layout: Layout, limit: int | None
) -> tuple[Layout, list[Row]]:
    """Rows that fit the pages, and the layout they fit with (smaller or tighter, where `layout.fit` allows it)."""
    rows = _rows(paragraphs, layout)
    fits = limit is None or _pages(len(rows), hand, layout) <= limit
    if fits and (not layout.fit or _widest(rows) <= room(layout)):
        return layout, rows
    if not layout.fit:
        raise _too_long(len(rows), hand, layout, limit or 1)
    for scale in np.linspace(1.0, _SMALLEST_FIT, 46)[1:]:
        smaller = _scaled(layout, hand, float(scale))
        rows = _rows(paragraphs, smaller)
        if _pages(len(rows), hand, smaller) <= (limit or 1) and _widest(rows) <= room(smaller):
            return smaller, rows
    tight = _scaled(layout, hand, _SMALLEST_FIT, _BUNCHED[1])
    rows = _rows([(indent, _bunch(units)) for indent, units in paragraphs], tight)
    if _pages(len(rows), hand, tight) <= (limit or 1):
        return tight, rows
    raise _too_long(len(rows), hand, tight, limit or 1)


def _scaled(layout: Layout, hand: Hand, scale: float, pitch: float = 1.0) -> Layout:
    distance = spacing(hand, layout) * scale * pitch
    return replace(layout, x_height=layout.x_height * scale, line_spacing=max(distance, layout.x_height * scale))


def _bunch(units: Sequence[Unit]) -> list[Unit]:
    return [replace(unit, gap=unit.gap * _BUNCHED[0]) for unit in units]


def _widest(rows: Sequence[Row]) -> float:
    return max(row.indent + row.width for row in rows)


def _rows(paragraphs: Sequence[tuple[float, list[Unit]]], layout: Layout) -> list[Row]:
    width = room(layout)
    return [
        row
        for indent, units in paragraphs
        for row in wrap([part for unit in units for part in _broken(unit, width)], min(indent, 0.5 * width), width)
    ]


def _broken(unit: Unit, room: float) -> list[Unit]:
    """A word wider than the line, cut between letters; any other as it is."""
    word = unit.word
    if max(word.right, word.advance) <= room or len(word.glyphs) == 1:
        return [unit]
    starts = [min(float(s[:, 0].min()) for s in strokes) for strokes in word.strokes]
    ends = [max(float(s[:, 0].max()) for s in strokes) for strokes in word.strokes]
    cuts, first = [0], 0
    for i in range(1, len(starts)):
        if ends[i] - starts[first] > room:
            cuts.append(i)
            first = i
    return [Unit(write_part(word, a, b), unit.gap if a == 0 else 0.01) for a, b in pairwise([*cuts, len(starts)])]


def _pages(rows: int, hand: Hand, layout: Layout) -> int | float:
    lines = lines_a_page(hand, layout)
    return math.ceil(rows / lines) if lines else math.inf


def _too_long(rows: int, hand: Hand, layout: Layout, limit: int) -> DoesNotFit:
    held = lines_a_page(hand, layout) * limit
    over = (rows - held) * spacing(hand, layout)
    way_out = "a larger page or less text" if layout.fit else "--fit, a smaller --x-height, or a larger page"
    sheets = "the page holds" if limit == 1 else f"{limit} pages hold"
    return DoesNotFit(
        f"The text needs {rows} lines at an x-height of {layout.x_height:.2g} mm, but {sheets} {held}: "
        f"{rows - held} lines or {over:.0f} mm too many; use {way_out}."
    )
