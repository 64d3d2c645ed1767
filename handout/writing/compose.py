"""Text and hand to manuscripts: the pipeline of the writing room."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from handout.hand.scanned import ScannedHand
from handout.values import Hand, Manuscript
from handout.writing.drawn_line_writer import DrawnLineWriter
from handout.writing.layout import Layout
from handout.writing.line_breaking import fitted_rows, rows_of
from handout.writing.line_writer import LineWriter, W
from handout.writing.sheets import Sheet, paginate
from handout.writing.slips import slip
from handout.writing.text import Piece, paragraphs_of


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
    sheets = each_page(text, hand, layout, rng, pages=pages, fallback=fallback, slips=slips)
    return [sheet.manuscript for sheet in sheets]


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
    paragraphs: Iterable[Sequence[Piece]] = paragraphs_of(text, writer.repertoire, fallback=fallback)
    if slips:
        # a stream of their own: with slips and without, the words are written alike
        paragraphs = slip(paragraphs, slips, rng.spawn(1)[0])
    written = writer.paragraphs(paragraphs)
    limit = pages or (1 if layout.fit else None)
    if limit is None:
        return paginate(rows_of(written, layout), writer, layout, rng)
    layout, rows = fitted_rows([(indent, list(units)) for indent, units in written], writer.pitch, layout, limit)
    return paginate(rows, writer, layout, rng)
