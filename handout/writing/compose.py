"""Text and hand to manuscripts: the pipeline of the writing room."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import tee

import numpy as np

from handout.errors import DoesNotFit
from handout.hand.scanned import ScannedHand
from handout.values import Hand, Manuscript
from handout.writing import text as texts
from handout.writing.drawn_line_writer import DrawnLineWriter
from handout.writing.layout import Layout
from handout.writing.line_breaking import Row, wrap
from handout.writing.line_writer import LineWriter, Piece, Unit, W, paragraphs_of
from handout.writing.sheets import Sheet, baseline_distance, lines_a_page, paginate, room
from handout.writing.slips import Struck, check_rate, slip

_SMALLEST_FIT = 0.55  # --fit never makes writing smaller than this share of what was asked for
_BUNCHED = (0.72, 0.88)  # what --fit then makes of word gaps and line distance
_CUT = 0.01  # x-heights before what a word that is wider than its line goes on with: it is still one word


def compose(
    text: str,
    hand: Hand | ScannedHand,
    layout: Layout,
    rng: np.random.Generator,
    *,
    pages: int | None = None,
    fallback: bool = False,
    slips: float = 0.0,
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
    slips : float
        How many words in 100 are begun wrongly, struck out and written again, 0 to 100; which, is told in `about`.

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
    made = each_page(text, hand, layout, rng, pages=pages, fallback=fallback, slips=slips)
    return [sheet.manuscript for sheet in made]


def each_page(
    text: str,
    hand: Hand | ScannedHand,
    layout: Layout,
    rng: np.random.Generator,
    *,
    pages: int | None = None,
    fallback: bool = False,
    slips: float = 0.0,
) -> Iterator[Sheet]:
    """The same, one page when it is asked for, with the generator that `motion.trace` is to go on with.

    In a drawn hand no more is written for a page than it takes, unless `pages` or `layout.fit` ask how much there is;
    the glyphs of a scanned one are chosen for the whole text.  All characters are checked before the first page.
    """
    if isinstance(hand, Hand):
        return _each(text, DrawnLineWriter(hand, rng, layout.jitter), layout, rng, pages, fallback, slips)
    from handout.writing.scanned.line_writer import ScannedLineWriter

    return _each(text, ScannedLineWriter(hand, rng, layout.jitter), layout, rng, pages, fallback, slips)


def _each(
    text: str,
    writer: LineWriter[W],
    layout: Layout,
    rng: np.random.Generator,
    pages: int | None,
    fallback: bool,
    slips: float,
) -> Iterator[Sheet]:
    tokens = texts.spell(texts.normalise(text), writer.repertoire, fallback=fallback)
    pieces = paragraphs_of(tokens)
    if check_rate(slips):
        # a stream of their own: with slips and without, the words are written alike
        pieces = slip(pieces, slips, rng.spawn(1)[0])
    pieces, same = tee(pieces)
    paragraphs = (
        (indent, _marked(units, own)) for (indent, units), own in zip(writer.paragraphs(pieces), same, strict=True)
    )
    limit = pages or (1 if layout.fit else None)
    if limit is None:
        return paginate(_rows(paragraphs, layout), writer, layout, rng)
    written = [(indent, list(units)) for indent, units in paragraphs]
    layout, rows = _set(written, writer.pitch, layout, limit)
    return paginate(rows, writer, layout, rng)


def _marked(units: Iterable[Unit[W]], pieces: Sequence[Piece]) -> Iterator[Unit[W]]:
    """The units of a paragraph, with those that are struck out marked so."""
    words = (piece for piece in pieces if not isinstance(piece, int))
    return (
        replace(unit, intended=word.intended) if isinstance(word, Struck) else unit
        for unit, word in zip(units, words, strict=True)
    )


def _set(
    paragraphs: Sequence[tuple[float, list[Unit[W]]]], pitch: float, layout: Layout, limit: int
) -> tuple[Layout, list[Row[W]]]:
    """Rows that fit the pages, and the layout they fit with (smaller or tighter, where `layout.fit` allows it)."""
    rows = list(_rows(paragraphs, layout))
    fits = _pages(len(rows), pitch, layout) <= limit
    if fits and (not layout.fit or _widest(rows) <= room(layout)):
        return layout, rows
    if not layout.fit:
        raise _too_long(len(rows), pitch, layout, limit)
    for scale in np.linspace(1.0, _SMALLEST_FIT, 46)[1:]:
        smaller = _scaled(layout, pitch, float(scale))
        rows = list(_rows(paragraphs, smaller))
        if _pages(len(rows), pitch, smaller) <= limit and _widest(rows) <= room(smaller):
            return smaller, rows
    tight = _scaled(layout, pitch, _SMALLEST_FIT, _BUNCHED[1])
    rows = list(_rows([(indent, _bunch(units)) for indent, units in paragraphs], tight))
    if _pages(len(rows), pitch, tight) <= limit:
        return tight, rows
    raise _too_long(len(rows), pitch, tight, limit)


def _scaled(layout: Layout, pitch: float, scale: float, tighter: float = 1.0) -> Layout:
    if layout.ruling is not None:  # the rules stay where they are
        return replace(layout, x_height=layout.x_height * scale)
    distance = baseline_distance(pitch, layout) * scale * tighter
    return replace(layout, x_height=layout.x_height * scale, line_spacing=max(distance, layout.x_height * scale))


def _bunch(units: Sequence[Unit[W]]) -> list[Unit[W]]:
    return [replace(unit, gap=unit.gap * _BUNCHED[0]) for unit in units]


def _widest(rows: Sequence[Row[W]]) -> float:
    return max(row.indent + row.width for row in rows)


def _rows(paragraphs: Iterable[tuple[float, Iterable[Unit[W]]]], layout: Layout) -> Iterator[Row[W]]:
    width = room(layout)
    for indent, units in paragraphs:
        parts = (part for unit in units for part in _broken(unit, width))
        yield from wrap(parts, min(indent, 0.5 * width), width)


def _broken(unit: Unit[W], room: float) -> list[Unit[W]]:
    """A word wider than the line, cut between letters; any other as it is."""
    first, *others = unit.word.parts(room)
    intended = None if unit.intended is None else ""  # a slip is told of once
    return [replace(unit, word=first), *(Unit(part, _CUT, intended) for part in others)]


def _pages(rows: int, pitch: float, layout: Layout) -> int | float:
    lines = lines_a_page(pitch, layout)
    return math.ceil(rows / lines) if lines else math.inf


def _too_long(rows: int, pitch: float, layout: Layout, limit: int) -> DoesNotFit:
    held = lines_a_page(pitch, layout) * limit
    over = (rows - held) * baseline_distance(pitch, layout)
    way_out = "a larger page or less text" if layout.fit else "--fit, a smaller --x-height, or a larger page"
    sheets = "the page holds" if limit == 1 else f"{limit} pages hold"
    return DoesNotFit(
        f"The text needs {rows} lines at an x-height of {layout.x_height:.2g} mm, but {sheets} {held}: "
        f"{rows - held} lines or {over:.0f} mm too many; use {way_out}."
    )
