"""From files to the pages that a hand is read from: each scan with its transcript, its light and inks known.

A prompt sheet that was filled in is found in its scan, made flat, and its print taken out (`print_removal`); its codes
say what was to be copied.

A page may lie any way round: its text fits its lines only as they were written, not upside down or backwards.  A page
whose text fits as it lies is left alone; others are tried turned and mirrored.  A text that never fits is refused, with
the likeliest reason.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import units
from handout.errors import InputError
from handout.libraries import cv2
from handout.progress import Tell, narrow_reports, silent
from handout.scanning.checks import check_dpi, check_writing_size, likely_dpi, source_of
from handout.scanning.density import Scale, pooled_scale
from handout.scanning.page_layout import Gutter, find_gutter, flat_sheet
from handout.scanning.picture_files import ENOUGH_DPI, count_pages, read_picture, scan_of
from handout.scanning.scan import FilePicture, Scan
from handout.scanning.text_lines import TextLines, find_text_lines
from handout.scanning.written_page import Inked, PreparedScan, find_ink, finish, prepare, with_recorded_line
from handout.tagging.alignment import REFUSED, Method, refusal, text_breadth, text_fit
from handout.tagging.glyph_extraction import list_names
from handout.tagging.line_space import straight_lines
from handout.tagging.page_tagging import TaggedPage, tag_labelled_page, tag_page
from handout.tagging.print_removal import take_print_out
from handout.tagging.segmentation import by_segments
from handout.tagging.transcript import TranscriptLine, read_transcript
from handout.values import Array, Indices, Stroke

_NAMED_PAGES = re.compile(r"(?P<path>.+):(?P<first>\d+)(?:-(?P<last>\d+))?")
_LOST = 0.3  # share of a text's letters that may be missing on its page
_UNLIKE = 0.05  # share by which a likelier resolution differs from the guessed one before the page is read again
_DIFFERENT = 1.02  # how far --dpi may lie from the file's own resolution before it is mentioned

Say = Callable[[str], None]
# shares of the time that a page takes until it lies upright, and until its lines are known; measured
_TURNED, _WRITTEN = 0.11, 0.17
_ONE_EACH = "give one --text for each page, in the same order"
# ink a letter below which a line of a sheet is empty, of that of full lines, a quantile; empty ones have .01 of it,
# others .24
_EMPTY, _FULL = 0.1, 0.9
# mm² of ink a letter over the words of nine lines in ten: pens leave .001 to .1, tall loops .4 with 2.0 of the print's
# colour beside it, grey print 1.2 and none of it
_PRINT_LEFT = 0.3
_SAME = 0.75  # cosine between the ink of two pictures from which they show one sheet: photographs have .94
_NOTHING = 0.02  # mm² of ink a letter of full lines, below which a sheet is blank: pens and pencils leave 1.7 to 2.5
_REDDISH = 0.5  # of the ink beside print, how much may have its colour: a red pen's has 1.5, blue, black and grey .006


@dataclass(frozen=True, eq=False)
class PageSource:
    """A page that is to be read.

    prepared : its scan, upright or not.
    transcript : what is written on it.
    movements : of a recording, the way of its pen; see `with_recorded_line`. Such a page lies upright.
    timed : whether their times mean anything.
    letters : (n,) int, for every sample of them the grapheme of the transcript that it writes, where that is known.
    lines : how many lines of writing there are, where that is known.
    notes : sentences to show the user.
    """

    prepared: PreparedScan
    transcript: str
    movements: tuple[Stroke, ...] = ()
    timed: bool = False
    letters: Indices | None = None
    lines: int | None = None
    notes: tuple[str, ...] = ()


def chosen_pages(names: Sequence[str]) -> list[tuple[Path, int | None]]:
    """The files, and pages of files, that some names mean, in order.

    A file of several pages stands for all of them, ``file.pdf:2`` for its second, ``file.pdf:2-4`` for three.

    Raises InputError: a page that is twice among them, or pages in the wrong order.
    """
    chosen: list[tuple[Path, int | None]] = []
    for name in names:
        chosen += _pages(name)
    real = [(path.resolve(), page or 1) for path, page in chosen]
    for i, place in enumerate(real):
        if place in real[:i]:
            path, page = chosen[i]
            raise InputError(f"{source_of(path, page, 2 if page else 1)} is given twice: leave it out once.")
    return chosen


def _pages(name: str) -> list[tuple[Path, int | None]]:
    path, named = Path(name), _NAMED_PAGES.fullmatch(name)
    if named and not path.exists():
        path, first = Path(named["path"]), int(named["first"])
        last = int(named["last"] or first)
        if last < first:
            raise InputError(f"{name}: the pages run backwards; write {path}:{last}-{first}.")
        count = count_pages(path)
        if path.is_file() and not 1 <= first <= last <= count:
            pages = "1 page" if count == 1 else f"pages 1–{count}"
            raise InputError(f"{name}: there is no such page; {path} holds {pages}.")
        return [(path, number) for number in range(first, last + 1)]
    count = count_pages(path)
    return [(path, None)] if count == 1 else [(path, number) for number in range(1, count + 1)]


def gather_sources(names: Sequence[str], texts: Sequence[tuple[str, str]], dpi: float | None) -> list[PageSource]:
    """The pages of some files, each with its transcript: its own of `texts`, or what a prompt sheet says of itself.

    names : as `chosen_pages`.
    texts : names and contents, in the order of the pages; sheets need none.
    dpi : pixels an inch, where neither a file nor a sheet's marks say.

    Raises InputError: a file that cannot be read or used, a page twice, texts too few or too many.
    """
    check_dpi(dpi)
    pages = chosen_pages(names)
    if len(texts) > len(pages):
        raise InputError(f"{units.count(len(texts), 'text')} for {units.count(len(pages), 'page')}: {_ONE_EACH}.")
    remaining, sources, source_of = list(texts), list[PageSource](), dict[bytes, str]()
    sheets: list[FilledSheet | None] = []
    for path, page in pages:
        picture = read_picture(path, page)
        digest = hashlib.blake2b(np.ascontiguousarray(picture.rgb).data, person=b"scan").digest()
        if digest in source_of:
            raise InputError(
                f"{picture.source} shows the very same picture as {source_of[digest]}: leave one of them out, or its "
                "letters would count twice."
            )
        source_of[digest] = picture.source
        sheets.append(sheet := filled_sheet(picture))
        has_text = len(texts) == len(pages) or (sheet is None and bool(remaining))
        if sheet is None and not has_text:
            refuse_mirrored(picture)
            counts = f"{units.count(len(texts), 'text')} for {units.count(len(pages), 'page')}: {_ONE_EACH}"
            raise InputError(
                f"{picture.source}: what is written on it? Give its text with --text{f' ({counts})' if texts else ''}; "
                "only sheets made with `handout hand prompt` say it themselves."
            )
        text = remaining.pop(0)[1] if has_text else ""
        sources.append(
            PageSource(prepare(sheet.scan), text or sheet.transcript, notes=() if text else sheet.notes)
            if sheet
            else _plain_page(picture, dpi, text)
        )
    refuse_shown_twice(sheets)
    if remaining:
        raise InputError(
            f"--text {remaining[-1][0]}: every scan without a text of its own has one already; leave it out."
        )
    return sources


def refuse_shown_twice(sheets: Sequence[FilledSheet | None]) -> None:
    """Raise InputError where two pictures show one sheet."""
    for (first, a), (second, b) in combinations([(sheet.scan.source, sheet.ink) for sheet in sheets if sheet], 2):
        if a.shape == b.shape and np.vdot(a, b) > _SAME * np.linalg.norm(a) * np.linalg.norm(b):
            raise InputError(
                f"{second} shows the same sheet as {first}: leave the worse picture out, or its letters would count "
                "twice."
            )


def _plain_page(picture: FilePicture, dpi: float | None, text: str) -> PageSource:
    """A page that is no prompt sheet."""
    flat, notes = flat_sheet(picture), list[str]()
    if dpi and picture.own and max(dpi, picture.own) > _DIFFERENT * min(dpi, picture.own):
        notes.append(f"{picture.source} says {picture.own:.0f} dpi; {dpi:g} is believed, as --dpi says.")
    if flat is not picture:
        notes.append(
            f"{picture.source} shows a sheet on something darker: it is made flat; a scan makes a better hand."
        )
    elif picture.photographed:
        notes.append(
            f"{picture.source} is a photograph: not all edges of the sheet are seen, and it is read as it lies."
        )
    return PageSource(prepare(scan_of(flat, dpi, guess=True)), text, notes=tuple(notes))


def common_scale(sources: Sequence[PageSource]) -> Scale | None:
    """The scale of densities of all pages of a hand; None where there is but one.

    Source: seed 000, §5.1.1.
    """
    return pooled_scale([source.prepared.scale for source in sources]) if len(sources) > 1 else None


def tagged_pages(
    sources: Sequence[PageSource],
    seed: int,
    pen: str | None,
    say: Say,
    *,
    method: Method = by_segments,
    tell: Tell = silent,
) -> Iterator[TaggedPage]:
    """The pages with their letters, one after the other, all on one scale of densities.

    sources : as `gather_sources` gives them.
    seed : the same one gives the same pages.
    pen : one of `mask.PENS`, optional.
    say : takes sentences to show the user.
    method : of the alignment, as `alignment.align` takes it.
    tell : told how far it has come.

    Raises InputError: as `find_ink`, `find_turn`, `tag_page`.
    """
    scale = common_scale(sources)
    for number, source in enumerate(sources):
        say(f"Page {number + 1} of {len(sources)}: {source.prepared.scan.source} …")
        rng = np.random.default_rng((seed, number))
        part = narrow_reports(tell, number / len(sources), (number + 1) / len(sources), f"page {number + 1}: ")
        yield _tag_source(source, scale, rng, pen, say, method, part)


def _tag_source(
    source: PageSource,
    scale: Scale | None,
    rng: np.random.Generator,
    pen: str | None,
    say: Say,
    method: Method,
    tell: Tell,
) -> TaggedPage:
    tell(0.0, "the ink")
    inked = find_ink(prepared := source.prepared, pen, lines=source.lines, scale=scale)
    turn = 0 if source.movements else find_turn(inked, source.transcript, rng.spawn(1)[0])
    if turn:
        say(f"  the page lies {ORIENTATIONS[turn]}: turned upright")
        prepared = prepared.turn_quarters(turn)
        inked = find_ink(prepared, pen, scale=scale)
    if prepared.scan.told is None:
        inked = _at_likely_size(inked, prepared, pen, scale)
    tell(_TURNED, "the lines")
    written = finish(replace(inked, notes=(*source.notes, *inked.notes)))
    if source.movements:
        written = with_recorded_line(written, source.movements, timed=source.timed)
    lines = units.count(len(written.text_lines.lines), "line")
    say(f"  ink and {lines} found; looking for the letters …")
    try:
        if source.letters is not None:
            tagged = tag_labelled_page(written, source.transcript, source.letters)
        else:
            tagged = tag_page(
                written, source.transcript, rng=rng, method=method, tell=narrow_reports(tell, _WRITTEN, 1.0)
            )
    except InputError as error:
        raise InputError(f"{written.scan.source}: {error}") from error
    _refuse_lost(tagged, lines)
    for note in tagged.notes:
        say(f"  {note}")
    return tagged


def _at_likely_size(inked: Inked, prepared: PreparedScan, pen: str | None, scale: Scale | None) -> Inked:
    """A page whose resolution was guessed at the one that its letters make likely, which is told."""
    scan = inked.prepared.scan
    x_height = inked.text_lines.x_height / scan.pixel
    dpi = likely_dpi(scan.shape, x_height) * prepared.scan.dpi / scan.dpi  # of the scan before it was enlarged
    if x_height and abs(dpi / prepared.scan.dpi - 1) > _UNLIKE:
        inked = find_ink(prepared.turn_quarters(0, dpi), pen, scale=scale)
    note = (
        f"{scan.source}: nothing says its resolution; {inked.prepared.scan.dpi:.0f} dpi are taken, at which its small "
        f"letters are {inked.text_lines.x_height:.1f} mm high: if they are not, give --dpi."
    )
    return replace(inked, notes=(*inked.notes, note))


def _refuse_lost(tagged: TaggedPage, lines: str) -> None:
    """Raise InputError for a text much of which is not on its page."""
    missing, characters = len(tagged.missing), len(tagged.missing) + len(tagged.glyphs)
    if missing > _LOST * characters:
        raise InputError(
            f"{tagged.page.source}: {missing} of the {characters} characters of its text are not on the page, which "
            f"has {lines} of writing: give the text of this page alone, line by line."
        )


@dataclass(frozen=True, eq=False)
class FilledSheet:
    """A sheet as a scan of its own: flat, everything printed on it replaced by paper.

    transcript : what was to be copied, without the lines under which nothing is written.
    ink : (h, w) float, a pixel a mm: share of it that is inked.
    notes : sentences to show the user.
    """

    scan: Scan
    transcript: str
    ink: Array
    notes: tuple[str, ...] = ()


def filled_sheet(scan: Scan | FilePicture) -> FilledSheet | None:
    """The prompt sheet in a scan or photograph, or None if there is none; its marks say how large it is.

    Raises InputError: there are marks of a sheet, but too few; or its codes cannot be read.
    """
    from handout.prompting.sheet_detection import find_sheet, printed_on, rectify

    try:
        sheet = find_sheet(np.asarray(scan.rgb))
    except InputError as error:
        raise InputError(f"{scan.source}: {error}") from error
    if sheet is None:
        return None
    dpi = min(float(round(sheet.dpi)), ENOUGH_DPI)
    flat = rectify(np.asarray(scan.rgb), sheet, dpi)
    unprinted, ink, words = take_print_out(flat, printed_on(sheet, dpi), len(sheet.bands) > 0, dpi)
    lines = sheet.record.lines
    of_letter, reddish, over_words, coloured = (
        np.array([np.count_nonzero(mask[top:foot, left:right]) / dpi**2 for left, top, right, foot in boxes.tolist()])
        * 25.4**2
        / [len(line) for line in lines[: len(boxes)]]
        for mask, places in ((ink, sheet.fields), (words, sheet.fields), (ink, sheet.bands), (words, sheet.bands))
        for boxes in [np.rint(places / 25.4 * dpi).astype(int)]
    )
    if fault := _ink_fault(of_letter, reddish, over_words, coloured):
        raise InputError(f"{scan.source}: {fault}")
    empty = np.flatnonzero(of_letter < _EMPTY * np.quantile(of_letter, _FULL)).tolist()
    named = list_names([f"line {number + 1} (“{lines[number]}”)" for number in empty])
    notes = [f"{scan.source}: nothing is written on {named} of the sheet; left out of its text."] if empty else []
    text = "\n".join(line for number, line in enumerate(lines) if number not in empty)
    size = round(sheet.page.width), round(sheet.page.height)
    reduced = np.asarray(cv2.resize(ink.astype(np.float64), size, interpolation=cv2.INTER_AREA), dtype=np.float64)
    return FilledSheet(Scan(unprinted, dpi, scan.source, told=True), text, reduced, tuple(notes))


def _ink_fault(of_letter: Array, reddish: Array, over_words: Array, coloured: Array) -> str | None:
    """Why the ink of a sheet cannot be read; all arrays (lines,), mm² a letter.

    reddish : what has the print's colour; over_words, coloured : ink, and that colour, over its words, if any.
    """
    if reddish.sum() > _REDDISH * of_letter.sum():
        return (
            "its writing has the colour of the print, by which that is taken out: write with a pen that is not red, or "
            "on sheets made with `handout hand prompt --plain`."
        )
    if np.quantile(of_letter, _FULL) < _NOTHING:
        return "nothing is written on the sheet."
    if len(over_words) and np.quantile(over_words, 1 - _FULL) > max(_PRINT_LEFT, float(np.median(coloured))):
        return (
            "its printed words are not orange, and cannot be told from the writing: scan or photograph it in colour, "
            "or, where the printer has none, write on sheets made with `handout hand prompt --plain`."
        )
    return None


def refuse_mirrored(scan: Scan | FilePicture) -> None:
    """Raise InputError for the mirror image of a sheet."""
    from handout.prompting.sheet_layout import register

    with suppress(InputError):
        if register(np.ascontiguousarray(scan.rgb[:, ::-1])) is None:
            return
    raise InputError(
        f"{scan.source} is mirrored: the marks of a sheet can be read only backwards. Scan it again without mirroring, "
        "or flip the picture from left to right."
    )


_SURE = 0.35  # fit above which a page is believed to lie that way: pages the wrong way round have up to 0.1
_LITTLE, _MUCH = 1.6, 0.6  # breadth of letters against the usual ones, where text is missing and where it is too long
# how a page lies that must be turned by so many quarters
ORIENTATIONS = {1: "on its side, its top to the right", 2: "upside down", 3: "on its side, its top to the left"}


def find_turn(inked: Inked, transcript: str, rng: np.random.Generator) -> int:
    """The number of quarter turns, anticlockwise, that make a page lie upright.

    transcript : what is written on the page.

    Raises InputError: the page is mirrored, shows two columns, or has another size or another text.
    """
    lines = read_transcript(transcript)
    ink, dpi = inked.mask.ink, inked.prepared.scan.dpi
    fit_as_is = page_fit(ink, dpi, inked.text_lines, lines, rng)
    if fit_as_is < REFUSED and len(lines) != len(inked.text_lines.lines):
        fit_as_is = max(fit_as_is, page_fit(ink, dpi, find_text_lines(ink, dpi, len(lines)), lines, rng))
    if fit_as_is >= REFUSED:
        return 0
    gutter, breadth = find_gutter(ink, dpi), 1.0
    if inked.text_lines.lines:  # of the page's letters against the usual ones if this were its text
        straight = straight_lines(inked.mask.ink, inked.text_lines, inked.prepared.scan.pixel)
        breadth = text_breadth(straight, lines)
    # lines of two pages, or of another amount of text, may be those of a page that lies on its side, and no others
    sideways_only = gutter is not None or not _MUCH <= breadth <= _LITTLE
    best, quarters = _best(ink, dpi, lines, rng, (1, 3) if sideways_only else (2, 1, 3))
    if best >= max(_SURE, fit_as_is):
        return quarters
    mirrored = (0.0, 0) if gutter else _best(ink[:, ::-1], dpi, lines, rng, (1, 3) if sideways_only else (0, 2))
    if mirrored[0] >= max(_SURE, fit_as_is):
        raise InputError(
            f"{inked.prepared.scan.source} is mirrored: its writing runs from right to left. Scan it again without "
            "mirroring, or flip the picture from left to right."
        )
    raise _reason(inked, lines, fit_as_is, gutter, breadth)


def page_fit(
    ink: NDArray[np.bool_], dpi: float, text_lines: TextLines, lines: Sequence[TranscriptLine], rng: np.random.Generator
) -> float:
    """How well a text fits the written lines of a page: as `alignment.text_fit`; 0 without lines."""
    return text_fit(straight_lines(ink, text_lines, 25.4 / dpi), lines, rng)


def _best(
    ink: NDArray[np.bool_], dpi: float, lines: Sequence[TranscriptLine], rng: np.random.Generator, turns: Sequence[int]
) -> tuple[float, int]:
    """The best fit of a page turned in some ways, and by how many quarters it was; the first sure one wins."""
    best = (0.0, 0)
    for quarters in turns:
        turned = np.ascontiguousarray(np.rot90(ink, quarters))
        best = max(best, (page_fit(turned, dpi, find_text_lines(turned, dpi), lines, rng), quarters))
        if best[0] >= _SURE:
            break
    return best


def _reason(
    inked: Inked, lines: Sequence[TranscriptLine], fit: float, gutter: Gutter | None, breadth: float
) -> InputError:
    """Why a text does not fit in any way."""
    scan, text_lines = inked.prepared.scan, inked.text_lines
    check_writing_size(text_lines, scan)
    if gutter:
        return InputError(
            f"{scan.source} shows two pages or columns side by side ({gutter.lines[0]} and {gutter.lines[1]} lines, "
            f"{gutter.width:.0f} mm of paper between them at x = {gutter.at:.0f} mm): cut it there, and give each part "
            "as a --scan with its own --text."
        )
    if not text_lines.lines:
        return InputError(f"{scan.source}: no line of writing was found on it; is it the right scan?")
    if not _MUCH <= breadth <= _LITTLE:
        letters, count = sum(len(line.letters) for line in lines), len(lines)
        advice = "the text of this page alone, line by line"
        if breadth > _LITTLE:
            advice = (
                "all that is written on the page, line by line, and cover or cut off what is printed or stamped there; "
                f"if that is done, its letters are {breadth:.1f} times as broad as usual, too broad to be read"
            )
        return InputError(
            f"{scan.source} has {len(text_lines.lines)} lines of writing, and its text "
            f"({units.count(count, 'line')}, {units.count(letters, 'character')}) is about "
            f"{1 / breadth:.1f} times what they hold: give {advice}."
        )
    return InputError(f"{scan.source}: {refusal(fit, (len(text_lines.lines), len(lines)))}")
