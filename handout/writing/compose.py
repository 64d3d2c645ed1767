"""Text and hand to manuscripts: the pipeline of the writing room."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, groupby, islice, tee
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from handout.errors import DoesNotFit
from handout.values import Manuscript
from handout.writing.choosing import NO_REWRITES, Choice, GlyphChooser, Rewrites, choices, choose_words
from handout.writing.drawn_words import DrawnHandwriting
from handout.writing.kept_text import KeptText, TextWriting, last_text
from handout.writing.layout import Layout
from handout.writing.pages import Handwriting, Sheet, Unit, paginate, rows_on_pages
from handout.writing.slips import slip
from handout.writing.text import Piece, TiedSpaces, paragraphs_of

if TYPE_CHECKING:
    from handout.hand.drawn import Hand
    from handout.hand.scanned import ScannedHand
    from handout.writing.scanned_words import SetParagraph


class Proofreader(Protocol):
    """Who reads paragraphs.

    manner : two of the same read alike; words : what was read so far.
    """

    @property
    def manner(self) -> Hashable: ...

    words: list[Any]

    def __call__(self, paragraph: SetParagraph, again: Sequence[int] | None = None) -> None:
        """Read one, and have words of it written again; or read some of its words again, and leave them."""


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

    text : Unicode; a newline starts a paragraph, leading spaces indent it.
    layout : page, margins, size, alignment.
    rng : all variation comes from it.
    pages : how many pages there may be; None: as many as are needed (one, where `layout.fit` asks to shrink).
    fallback : accept borrowed forms for characters that the hand lacks.
    slips : how many words in 100 are begun wrongly, struck out and written again, 0 to 100; which, is told in `about`.

    Returns list of Manuscript, one a page.

    Raises InputError, MissingCharacters: nothing to write, or not in this hand.
    Raises DoesNotFit: more text than the pages hold; the message says by how much.
    """
    sheets = each_page(text, hand, layout, rng, pages=pages, fallback=fallback, slips=slips)
    return [sheet.manuscript for sheet in sheets]


def each_page(
    text: str,
    hand: Hand | ScannedHand,
    layout: Layout,
    seed: np.random.Generator | Sequence[int],
    *,
    pages: int | None = None,
    fallback: bool = False,
    slips: float = 0.0,
    proofread: Proofreader | None = None,
) -> Iterator[Sheet]:
    """The same, page by page on demand, each with the generator with which `motion.trace` goes on.

    No more is written for a page than it takes, a word at a time in a drawn hand, a paragraph in a scanned one, unless
    `pages` or `layout.fit` ask how much there is.  All characters are checked before the first page.  A text that
    begins as the last one did goes on from there.

    proofread : looks at each paragraph of a scanned hand when it is set, and has words of it written again.
    """
    rng = np.random.default_rng(seed)
    # streams of their own for slips and for what is struck out: with slips and without, all else is written alike
    slip_stream = rng.spawn(1)[0] if slips else None
    streams = (rng, rng.spawn(1)[0])
    rewrites = Rewrites(layout.rewritten)
    writer = handwriting(hand, streams, layout.jitter, rewrites, ruled=layout.ruling is not None)
    paragraphs: Iterable[Sequence[Piece]] = paragraphs_of(text, writer.repertoire, fallback=fallback)
    if slip_stream is not None:
        paragraphs = slip(paragraphs, slips, slip_stream)
    choosers = [GlyphChooser(writer.stock, stream, min(layout.jitter, 1.0)) for stream in streams]
    how = (layout.jitter, rewrites, bool(slips), layout.ruling is not None)
    key = () if isinstance(seed, np.random.Generator) else (tuple(seed), *how)
    set_pieces = keep_setting(key, hand, writer, choosers, proofread, rewrites)
    words = (set_pieces(pieces) for pieces in paragraphs)
    layout, rows = rows_on_pages(words, writer.pitch, layout, pages)
    return paginate(rows, writer, layout, rng)


def each_part(
    texts: Sequence[str],
    hand: Hand | ScannedHand,
    layouts: Sequence[Layout],
    seed: Sequence[int],
    *,
    fallback: bool = False,
    proofread: Proofreader | None = None,
) -> Iterator[Sheet | None]:
    """Write texts one after the other, each on a page of its own.

    None stands for a text that is larger than its place; `Placed.at` counts through all texts, with one character
    between two.

    Raises InputError, MissingCharacters: nothing to write, or not in this hand.
    """
    rng = np.random.default_rng(seed)
    streams = (rng, rng.spawn(1)[0])
    jitter = max(layout.jitter for layout in layouts)
    writer = handwriting(hand, streams, jitter, ruled=any(layout.ruling for layout in layouts))
    choosers = [GlyphChooser(writer.stock, stream, min(jitter, 1.0)) for stream in streams]
    counts = [len(paragraphs_of(text, writer.repertoire, fallback=fallback)) for text in texts]
    paragraphs = paragraphs_of("\n".join(texts), writer.repertoire, fallback=fallback)
    words = (set_paragraph(writer, choosers[0], chosen, proofread) for chosen in choices(paragraphs, choosers))
    for count, layout in zip(counts, layouts, strict=True):
        part = [iter(list(units)) for units in islice(words, count)]
        try:
            fitting, rows = rows_on_pages(part, writer.pitch, layout, 1)
            yield next(paginate(rows, writer, fitting, rng.spawn(1)[0]))
        except DoesNotFit:
            yield None


def keep_setting(
    key: tuple[Hashable, ...],
    hand: Hand | ScannedHand,
    writer: Any,
    choosers: Sequence[GlyphChooser],
    proofread: Proofreader | None,
    rewrites: Rewrites,
) -> Callable[[Sequence[Piece]], Iterator[Unit[Any]]]:
    """What sets paragraphs one after the other, and takes those with which the last text of the same key began as they
    were; key : all that they depend on besides hand and letters, () where nothing is kept."""
    kept = last_text((hand, proofread and proofread.manner, *key)) if key else KeptText()
    writing = TextWriting(kept, (*choosers, *writer.writers))
    read = [] if proofread is None else proofread.words

    def set_part(pieces: Sequence[Piece]) -> Sequence[tuple[Choice, Unit[Any]]]:
        part = [(piece, getattr(piece, "__dict__", None)) for piece in pieces]  # what formulas and slips are, too
        chosen = choose_words(pieces, choosers)
        return writing.write(part, lambda: list(_set_words(writer, choosers[0], chosen, proofread, rewrites)), read)

    return lambda pieces: _gather_formulas((pair for part in _parts(pieces, writer) for pair in set_part(part)), writer)


def set_paragraph(
    writer: Any,
    chooser: GlyphChooser,
    words: Iterator[Choice],
    proofread: Proofreader | None,
    rewrites: Rewrites = NO_REWRITES,
) -> Iterator[Unit[Any]]:
    """A paragraph as a handwriting sets it, and what its proofreader makes of it."""
    return _gather_formulas(_set_words(writer, chooser, words, proofread, rewrites), writer)


def _parts(pieces: Sequence[Piece], writer: Handwriting[Any]) -> Iterator[Sequence[Piece]]:
    """What of a paragraph is set at a time: each word with the spaces before it, or all of it in a scanned hand."""
    if not isinstance(writer, DrawnHandwriting):
        yield pieces
        return
    begin = 0
    for end, piece in enumerate(pieces, 1):
        if not isinstance(piece, int):
            yield pieces[begin:end]
            begin = end


def _set_words(
    writer: Any, chooser: GlyphChooser, words: Iterator[Choice], proofread: Proofreader | None, rewrites: Rewrites
) -> Iterable[tuple[Choice, Unit[Any]]]:
    """The same, each word with its glyphs."""
    if proofread is None and (not rewrites.times or isinstance(writer, DrawnHandwriting)):
        words, noted = tee(words)
        return zip(noted, writer.set_paragraph(words), strict=True)
    from handout.writing.scanned_words import SetParagraph

    paragraph = SetParagraph(writer, chooser, list(words))
    if proofread is not None:
        proofread(paragraph)
    places = paragraph.rewrite(rewrites)
    if proofread is not None and places:
        proofread(paragraph, places)
    return zip(paragraph.choices, paragraph.units, strict=True)


def _gather_formulas(set_words: Iterable[tuple[Choice, Unit[Any]]], writer: Handwriting[Any]) -> Iterator[Unit[Any]]:
    """The units of a paragraph, those of each formula as one, or as several between which a line may end."""
    for _, group in groupby(set_words, key=lambda each: id(each[0].formula) if each[0].formula else 0):
        first, unit = next(group)
        if first.formula is None:
            for choice, each in chain([(first, unit)], group):
                yield replace(each, tied=True) if isinstance(choice.spaces, TiedSpaces) else each
        else:
            from handout.writing.formula_words import set_formula

            words = [unit.word, *(following.word for _, following in group)]
            whole = set_formula(first.formula, words, unit.gap, writer, writer.wander(first.key))
            yield replace(next(whole), tied=isinstance(first.spaces, TiedSpaces))
            yield from whole


def handwriting(
    hand: Hand | ScannedHand,
    streams: Sequence[np.random.Generator],
    jitter: float,
    rewrites: Rewrites = NO_REWRITES,
    ruled: bool = False,
) -> Handwriting[Any]:
    """How a hand writes, on rules or not: nothing behind this asks which kind it is."""
    if hand.pages is None:
        return DrawnHandwriting(hand, streams, jitter, rewrites, ruled)
    from handout.writing.scanned_words import ScannedHandwriting

    return ScannedHandwriting(hand, streams[0].spawn(1)[0], jitter)  # choosing goes on as if nothing were set
