"""From a page that was read and its transcript to its letters, and from pages to a hand.

`tag_page` is the way of a scan; `tag_labelled_page` that of a recording which says itself what every vertex writes.

Source: seed 000, §5.1.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import units
from handout.alphabet import JUNK, fold, resemble
from handout.errors import InputError
from handout.hand.measures import contradicted_cases, outsized_letters, reaching_lines, unmarked_letters
from handout.hand.page_editor import line_alone
from handout.hand.places import graphemes, word_at
from handout.hand.scanned import NOBODY, ScannedGlyph, ScannedHand, ScannedPage
from handout.progress import Tell, narrow_reports, silent
from handout.scanning.text_lines import TextLines, find_text_lines
from handout.scanning.written_page import WrittenPage, foreign_ink
from handout.summary import one_line
from handout.tagging.alignment import AlignedLine, Alignment, Method, OddWord, PageLetter, align, transcript_fit
from handout.tagging.glyph_extraction import (
    Missing,
    doubt_cropped_glyphs,
    extract_glyphs,
    letters_within_reach,
    list_names,
    scanned_page,
)
from handout.tagging.ink_exchange import exchange_ink
from handout.tagging.letter_assignment import assign_letters
from handout.tagging.line_space import frames, vertex_lines
from handout.tagging.segmentation import by_segments
from handout.tagging.transcript import read_transcript
from handout.values import Indices

_ALIGNED = 0.96  # share of the time of `tag_page` that the alignment takes; measured
_SCRIBBLE = (3.0, 0.0, 10.0)  # x-height mm, slant, pitch mm of pages without writing: nothing depends on them
_LEAST_FOREIGN = 0.002  # share of a page's line that a second ink has; pages of one ink have at most 2 in 10 000
_QUOTED = 24  # characters of a line that are quoted in a note


@dataclass(frozen=True, eq=False)
class TaggedPage:
    """A page with its glyphs; `hand_of_pages` puts several together.

    glyphs : numbered from 0 on this page, all of page 0.
    notes : sentences to show the user.
    poor : numbers of the written lines whose text seems not to be what is there.
    missing : letters that are in the transcript and were not found.
    fits : how well each aligned line's text explains it, 0–1, by number of the line.
    cases : numbers of the glyphs that are as large as the other case of their letter (`contradicted_cases`).
    odd : words by which the page and the transcript seem to differ.
    """

    page: ScannedPage
    glyphs: tuple[ScannedGlyph, ...]
    notes: tuple[str, ...] = ()
    poor: tuple[int, ...] = ()
    missing: tuple[Missing, ...] = ()
    fits: tuple[tuple[int, float], ...] = ()
    cases: tuple[int, ...] = ()
    odd: tuple[OddWord, ...] = ()

    __repr__ = one_line


def tag_page(
    written: WrittenPage,
    transcript: str,
    *,
    rng: np.random.Generator,
    method: Method = by_segments,
    tell: Tell = silent,
) -> TaggedPage:
    """Find the letters of a page that has been read.

    transcript : what is written on it; words struck out as ``~~words~~`` are no letters of the hand.
    rng : the same generator gives the same page.
    method : of the alignment, as `alignment.align` takes it.
    tell : told how far it has come.

    Raises InputError: as `align`: an empty transcript, a page without lines, the transcript of another page.

    Source: seed 000, §5.1.3.
    """
    written, foreign, told = without_foreign_ink(written, transcript, rng)
    written = with_transcript_lines(written, transcript, rng)
    alignment = align(written, transcript, method=method, rng=rng, tell=narrow_reports(tell, 0.0, _ALIGNED))
    tell(_ALIGNED, "the joins")
    assignment = assign_letters(written.graph, alignment, np.where(foreign, NOBODY, vertex_lines(written)))
    page = replace(scanned_page(written, transcript), dismissed=np.flatnonzero(foreign))
    letters = letters_within_reach(written.graph, alignment, assignment.letter)
    glyphs, missing = extract_glyphs(page, alignment, *exchange_ink(page, alignment, letters))
    glyphs, cropped = doubt_cropped_glyphs(glyphs, written.graph, written.scan)
    alone = ScannedHand("", "", (page,), glyphs)
    cases, reaching, outsized, unmarked = (
        tuple(i for i in np.flatnonzero(find(alone)).tolist() if glyphs[i].line not in alignment.poor)
        for find in (contradicted_cases, reaching_lines, outsized_letters, unmarked_letters)
    )
    odd = _odd_notes(page, glyphs, (cases, reaching, sorted({*outsized} - {*cases, *reaching}), unmarked))
    told = [*told, *_notes(page, alignment, missing), *odd, *cropped]
    notes = (*written.notes, *told)
    fits = tuple((line.number, line.fit) for line in alignment.lines)
    return TaggedPage(page, glyphs, notes, alignment.poor, missing, fits, cases, alignment.odd)


def without_foreign_ink(
    written: WrittenPage, transcript: str, rng: np.random.Generator
) -> tuple[WrittenPage, NDArray[np.bool_], list[str]]:
    """The page without ink of another colour than most of it has, if its text fits better so.

    Returns the page; (n,) which vertices of its line were left out; sentences to show the user.
    """
    foreign = foreign_ink(written.graph, written.scan, written.paper)
    share = float(foreign.mean()) if len(foreign) else 0.0
    none = np.zeros(len(foreign), dtype=bool)
    if share < _LEAST_FOREIGN:
        return written, none, []
    ink = written.mask.ink & ~line_alone(written.graph, foreign, written.scan.shape, written.scan.pixel)
    bare = replace(written, mask=replace(written.mask, ink=ink), text_lines=find_text_lines(ink, written.scan.dpi))
    source, part = Path(written.scan.source).name, f"{share:.{0 if share >= 0.01 else 1}%}"
    if transcript_fit(bare, transcript, rng) <= transcript_fit(written, transcript, rng):
        return written, none, [f"{source}: {part} of its line has ink of another colour, and belongs to its text."]
    return bare, foreign, [
        f"{source}: {part} of its line has ink of another colour, and was left out: the text fits better without "
        "it. What of it is writing can be labelled with `handout hand edit`."
    ]  # fmt: skip


def with_transcript_lines(written: WrittenPage, transcript: str, rng: np.random.Generator) -> WrittenPage:
    """The page with as many lines as its transcript has, if the text fits those better than the lines that were found.

    A transcript may break lines as the page does, and then its number of lines helps; or it may not.
    """
    count = len(read_transcript(transcript))
    if count == len(written.text_lines.lines):
        return written
    counted = replace(written, text_lines=find_text_lines(written.mask.ink, written.scan.dpi, count))
    fits = [transcript_fit(page, transcript, rng) for page in (written, counted)]
    return counted if fits[1] > fits[0] else written


def tag_labelled_page(written: WrittenPage, transcript: str, graphemes_at: Indices) -> TaggedPage:
    """Tag a page for which the letter of every vertex is known.

    graphemes_at : (n,) int: index of the grapheme of the transcript that each vertex belongs to, −1 for none.

    Raises InputError: the page has no lines.
    """
    if not written.text_lines.lines:
        raise InputError("no line of writing was found, so its letters stand nowhere.")
    page = scanned_page(written, transcript)
    alignment, letters = _labelled_alignment(written, graphemes(transcript), graphemes_at)
    glyphs, missing = extract_glyphs(page, alignment, letters)
    return TaggedPage(page, glyphs, (*written.notes, *_notes(page, alignment, missing)), (), missing)


def _labelled_alignment(written: WrittenPage, units: Sequence[str], graphemes_at: Indices) -> tuple[Alignment, Indices]:
    """The alignment that labels of vertices amount to, and the letter of each vertex (n,)."""
    named = graphemes_at >= 0
    labels, owner = np.unique(graphemes_at[named], return_inverse=True)
    nearest = written.text_lines.nearest(written.graph.xy)
    rows: dict[int, list[PageLetter]] = {}
    for number, at in enumerate(labels.tolist()):
        vertices = np.flatnonzero(named)[owner == number]
        x, line = written.graph.uv[vertices, 0], int(np.bincount(nearest[vertices]).argmax())
        rows.setdefault(line, []).append(PageLetter(at, units[at], float(x.min()), float(x.max()), 1.0))
    frame = frames(written)
    lines = tuple(AlignedLine(line, frame[line], tuple(row), 1.0) for line, row in sorted(rows.items()))
    alignment = Alignment(lines)
    order = {letter.at: number for number, letter in enumerate(alignment.letters)}
    letters = np.full(len(graphemes_at), NOBODY, dtype=np.intp)
    letters[named] = np.array([order[at] for at in labels.tolist()], dtype=np.intp)[owner]
    return alignment, letters


def hand_of_pages(name: str, pages: Sequence[TaggedPage], title: str = "") -> ScannedHand:
    """The hand that some pages show.

    Raises InputError: no page, or not a single letter on them.
    """
    glyphs: list[ScannedGlyph] = []
    for number, tagged in enumerate(pages):
        first = len(glyphs)
        glyphs += [renumber_glyph(glyph, number, first) for glyph in tagged.glyphs]
    if not glyphs:
        raise InputError(
            f"{name}: no letter was found on {units.count(len(pages), 'page')}, so there is no hand to keep."
        )
    return ScannedHand(name, title or name, tuple(tagged.page for tagged in pages), tuple(glyphs))


def pen_of_pages(name: str, pages: Sequence[WrittenPage]) -> ScannedHand:
    """What a pen writes like: pages of anything drawn with it, none of whose letters are known.

    Raises InputError: no page.
    """
    if not pages:
        raise InputError(f"{name}: no page, so there is no pen to keep.")
    no_lines = TextLines((), *_SCRIBBLE)
    scanned_pages = tuple(replace(scanned_page(replace(page, text_lines=no_lines), ""), scan=None) for page in pages)
    return ScannedHand(name, name, scanned_pages, ())


def renumber_glyph(glyph: ScannedGlyph, page: int, first: int) -> ScannedGlyph:
    """A glyph of one page as a glyph of a hand: numbers of neighbours count from `first`."""
    before, after = (number + first if number >= 0 else number for number in (glyph.before, glyph.after))
    return replace(glyph, page=page, before=before, after=after)


def _notes(page: ScannedPage, alignment: Alignment, missing: Sequence[Missing]) -> list[str]:
    units = graphemes(page.transcript)
    text = {
        line.number: " ".join("".join(units[line.letters[0].at : line.letters[-1].at + 1]).split())
        for line in alignment.lines
        if line.letters
    }
    notes = [
        f"{page.source}, line {number + 1}: “{_quote(text.get(number, ''))}” seems not to be what is written there, or "
        "to lack a word of it; its letters are kept as doubtful; put the text right, and read the page again."
        for number in alignment.poor
    ]
    notes += _word_notes(page.source, alignment.odd)
    if bare := [f"line {number + 1}" for number in range(len(page.baselines)) if number not in text]:
        notes.append(
            f"{page.source}: nothing of its text is on {list_names(bare)} of its {len(page.baselines)} lines of "
            "writing; what is there is left out."
        )
    if missing:
        names = list_names([f"{letter.letter} (line {letter.line + 1})" for letter in missing])
        notes.append(f"{page.source}: not found on the page: {names}.")
    spelt = dict.fromkeys(unit for unit in units if unit.isalpha())
    if unlearnt := [unit for unit in spelt if fold(unit) == JUNK != resemble(unit)]:
        notes.append(
            f"{page.source}: no network has learnt {list_names(unlearnt)}; they are found by the Latin letters that "
            "they resemble, and words with them are not read again to doubt them: look at the letters."
        )
    return notes


def _word_notes(source: str, odd: Sequence[OddWord]) -> list[str]:
    """Sentences of words by which lines and their texts seem to differ."""
    notes = list[str]()
    for one in odd:
        what = f"the text has “{one.word}”, which the page seems not to show"
        if one.more:
            what = f"beside “{one.word}” the page shows something that the text lacks"
        notes.append(f"{source}, line {one.line + 1}: {what}; put the text right, and read the page again.")
    return notes


def _odd_notes(page: ScannedPage, glyphs: Sequence[ScannedGlyph], odd: Sequence[Sequence[int]]) -> list[str]:
    """Sentences of letters that are odd: as large as their other case, on two lines, too high, without their mark."""
    text = graphemes(page.transcript)
    case = "by their size these are not of the case that the transcript has"
    said = (
        (case, "Put it right where it is wrong, and read the page again"),
        ("these hold ink of the line above or below", "Give it back with `handout hand tag`"),
        ("these are far higher than others of their letter", "See whether one holds its neighbour's ink"),
        ("these have no accent", "See whether a neighbour has it"),
    )
    notes = list[str]()
    for numbers, (what, way) in zip(odd, said, strict=True):
        named = [f"{glyphs[i].letter} in “{word_at(text, glyphs[i].at)}” (line {glyphs[i].line + 1})" for i in numbers]
        if named:
            notes.append(
                f"{page.source}: {what}: {list_names(named)}. {way}; they are not written while others stand, and "
                "where none does, --fallback lends one."
            )
    return notes


def _quote(text: str) -> str:
    return text if len(text) <= _QUOTED else text[: _QUOTED - 1] + "…"
