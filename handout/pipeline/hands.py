"""A hand from scanned pages or recorded pens: the pages are opened, their letters found, and the hand is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from handout import atomic, units
from handout.errors import InputError
from handout.hand import file, library, report, svg_font
from handout.hand.boundaries import mend_boundaries
from handout.hand.learnt import remember
from handout.hand.pending import PendingLog
from handout.pipeline.hand_learning import learn
from handout.pipeline.inputs import decode_text, hand_path, read_bytes
from handout.pipeline.kept_hands import own_place, scan_notes
from handout.pipeline.letter_desk import keep_letters
from handout.pipeline.options import ReadingOptions
from handout.pipeline.results import SILENT, Delivery, Fact, Listener
from handout.progress import narrow_reports
from handout.sources import read_drawing
from handout.tagging.page_sources import PageSource, gather_sources, tagged_pages
from handout.tagging.page_tagging import TaggedPage, hand_of_pages, renumber_glyph
from handout.writing.legibility import unclear_letters

if TYPE_CHECKING:
    from handout.hand.scanned import ScannedHand

_MOST_TEXT = 200_000  # bytes; no page holds more
_OPENED, _MADE = 0.04, 0.97  # of the work on a page, when it is opened, and when its letters are found; measured


@dataclass(frozen=True, eq=False, kw_only=True)
class ReadHand(Delivery):
    """A hand that was read.

    pages : how each page was; moved : strokes and pieces of ink that went to another letter (`mend_boundaries`).
    """

    hand: ScannedHand
    pages: tuple[TaggedPage, ...]
    moved: int


def _deliver_hand(
    hand: ScannedHand, path: Path | None, pages: tuple[TaggedPage, ...], seed: int, notes: tuple[str, ...], moved: int
) -> ReadHand:
    """A hand that was read, which is kept in a file, or None."""
    files = () if path is None else (path,)
    found = [_page_facts(page) for page in pages]
    told = {**report.facts(hand), "files": [*map(str, files)], "seed": seed, "found": found, "moved": moved}
    unclear = {} if path is None else unclear_letters(hand)
    told["unclear"] = unclear
    if unclear:
        told_how = "Look at them with `handout hand check`, or read another page."
        notes = (*notes, f"Strangers mostly take for other letters: {', '.join(unclear)}. {told_how}")
    if moved:
        said = f"Ink that reads better with the letter beside, or with none, went there: {units.count(moved, 'piece')}."
        notes = (said, *notes)
    return ReadHand(seed=seed, files=files, told=told, hand=hand, pages=pages, notes=notes, moved=moved)


def read(
    name: str,
    scans: Sequence[str | Path] = (),
    texts: Sequence[str | Path] = (),
    output: str | Path | None = None,
    options: ReadingOptions = ReadingOptions(),
    *,
    inks: Sequence[str | Path] = (),
    listener: Listener = SILENT,
) -> ReadHand:
    """Read a hand from scanned pages, or from recordings of a pen, and what is written on them.

    name : of the hand.
    scans : pictures of pages: PNG, JPEG, TIFF, PDF; of several pages all, or FILE:2, or FILE:2-4.
    texts : text files with what is on the pages, line by line, in the same order; prompt sheets need none.
    output : the .hand file to keep it in, if any.
    inks : recorded pens, instead of scans: .inkml .dat .svc .gml .svg .json, or a single-line SVG font.

    Raises InputError: a file that cannot be read or used, texts too few or too many.
    """
    path = None if output is None else hand_path(output)
    transcripts = [_transcript(str(text), read_bytes(text), listener) for text in texts]
    return _read_pages(name, scans, inks, transcripts, path, options, listener)


def _read_pages(
    name: str,
    scans: Sequence[str | Path],
    inks: Sequence[str | Path],
    transcripts: Sequence[tuple[str, str]],
    path: Path | None,
    options: ReadingOptions,
    listener: Listener,
) -> ReadHand:
    """`read`, of texts with what they are called."""
    if bool(scans) == bool(inks):
        raise InputError("A hand is read from scans or from recorded pens: give --scan or --ink, one of them.")
    listener.progress(0.0, "opening the pages")
    if inks:
        sources = _open_recordings([str(ink) for ink in inks], transcripts, listener)
    else:
        sources = gather_sources([str(scan) for scan in scans], transcripts, options.dpi)
    tell = narrow_reports(listener.progress, _OPENED, _MADE)
    pages = tuple(tagged_pages(sources, options.seed, options.pen, listener.say, tell=tell))
    listener.progress(_MADE, "writing the hand")
    hand, moved = mend_boundaries(hand_of_pages(name, pages, options.title or ""))
    if options.ink_only:
        hand = replace(hand, pages=tuple(replace(page, scan=None) for page in hand.pages))
    notes: tuple[str, ...] = ()
    if path is not None:
        with atomic.hold_file(path, listener.say):
            file.save(hand, path)
            notes = (*scan_notes(hand), *_keep_learnt(hand, path))
    return _deliver_hand(hand, path, pages, options.seed, notes, moved)


def _keep_learnt(hand: ScannedHand, path: Path) -> tuple[str, ...]:
    """Keep what is worked out of a hand in its file; what is to be said where that cannot be."""
    try:
        remember(hand, learn(path))
    except InputError as error:
        return (f"{hand.name} is kept, and slower to write with, since what is worked out of it is not: {error}",)
    return ()


def read_as_own(
    name: str,
    scans: Sequence[str | Path],
    texts: Sequence[str],
    options: ReadingOptions = ReadingOptions(),
    listener: Listener = SILENT,
) -> ReadHand:
    """Read a hand from scanned pages and keep it among the user's own; see `read`.

    texts : what is on the pages, itself.

    Raises InputError: there is a hand of that name; as `read`.
    """
    path = own_place(name)
    return _read_pages(name, scans, (), _transcripts(texts, listener), path, options, listener)


def _transcripts(texts: Sequence[str], listener: Listener) -> list[tuple[str, str]]:
    """Texts of pages with what they are called."""
    return [_transcript(f"text of page {n}", text.encode(), listener) for n, text in enumerate(texts, 1)]


def read_more(
    name: str,
    scans: Sequence[str | Path],
    texts: Sequence[str],
    options: ReadingOptions = ReadingOptions(),
    listener: Listener = SILENT,
) -> ReadHand:
    """Read more pages of an author, and add them to a hand of the user's own; see `read_as_own`.

    What was corrected stays so; its journal ends, for an entry of it names letters of the pages before.

    Raises InputError: there is no such hand of the user's own, or as `read`; the hand is as it was then.
    """
    path = library.own_scanned().get(name) or (Path(name) if Path(name).suffix == ".hand" else None)
    if path is None:
        raise InputError(f"There is no hand {name!r} among your own: copy it first, or read one.")
    file.check(path)
    if PendingLog(path).exists():
        keep_letters(str(path))
    known = file.load(path)
    keeping = any(page.scan is not None for page in known.pages)
    options = replace(options, ink_only=options.ink_only or not keeping)
    more = _read_pages(known.name, scans, (), _transcripts(texts, listener), None, options, listener)
    with atomic.hold_file(path, listener.say):  # as it is now: reading takes minutes
        if PendingLog(path).exists():
            keep_letters(str(path))
        hand, corrected = file.load(path), file.journal(path).made
        first, pages = len(hand.glyphs), len(hand.pages)
        glyphs = [renumber_glyph(glyph, glyph.page + pages, first) for glyph in more.hand.glyphs]
        joined = replace(hand, pages=(*hand.pages, *more.hand.pages), glyphs=(*hand.glyphs, *glyphs))
        file.save(joined, path)
        notes = (f"What was corrected in {hand.name} stays, and can no longer be undone.",) if corrected else ()
        notes = (*notes, *scan_notes(more.hand), *_keep_learnt(joined, path))
    return _deliver_hand(joined, path, more.pages, options.seed, notes, more.moved)


def _transcript(name: str, data: bytes, listener: Listener) -> tuple[str, str]:
    """The text of a page, and what it is called."""
    text = decode_text(data[: _MOST_TEXT + 1], name, listener)
    if len(data) > _MOST_TEXT:
        raise InputError(f"{name}: {len(data)} bytes are more than a page holds; give the text of one page.")
    if not text.strip():
        raise InputError(f"{name} is empty: give what is written on the page, line by line.")
    return name, text


def _open_recordings(inks: Sequence[str], texts: Sequence[tuple[str, str]], listener: Listener) -> list[PageSource]:
    """The pages of recorded pens."""
    from handout.tagging.recorded_pages import RecordedPage, font_specimen, page_source, recorded_pages

    if texts and len(texts) != len(inks):
        raise InputError(
            f"{len(texts)} --text for {len(inks)} --ink: give one for each, in the same order, or none where the "
            "recordings have labels."
        )
    transcripts = [text for _, text in texts] or [""] * len(inks)
    opened: list[RecordedPage] = []
    for ink, text in zip(inks, transcripts, strict=True):
        if svg_font.holds_font(Path(ink)):  # a recording of each of its letters
            opened += font_specimen(ink, svg_font.read_svg_font(Path(ink)))
        else:
            opened.append(RecordedPage(ink, read_drawing(ink), text))
    return [page_source(recording) for recording in recorded_pages(opened, listener.say)]


def _page_facts(page: TaggedPage) -> dict[str, Fact]:
    """What `--json` says of how a page was read; lines are numbered from 0."""
    return {
        "source": page.page.source,
        "glyphs": len(page.glyphs),
        "poor_lines": list(page.poor),
        "other_case": [
            {"at": page.glyphs[i].at, "letter": page.glyphs[i].letter, "line": page.glyphs[i].line} for i in page.cases
        ],
        "odd_words": [{"at": o.at, "word": o.word, "line": o.line, "page_shows_more": o.more} for o in page.odd],
        "missing": [{"at": letter.at, "letter": letter.letter, "line": letter.line} for letter in page.missing],
        "fits": {str(line): round(fit, 3) for line, fit in page.fits},
        "notes": list(page.notes),
    }
