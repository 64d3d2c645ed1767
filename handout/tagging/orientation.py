"""Which way round a page lies: its text fits its lines only as they were written, not upside down or backwards.

A page whose text fits as it lies is left alone; others are tried turned and mirrored.  A text that never fits is
refused, with the likeliest reason.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from handout import units
from handout.errors import InputError
from handout.scanning.checks import check_writing_size
from handout.scanning.page_layout import Gutter, find_gutter
from handout.scanning.text_lines import TextLines, find_text_lines
from handout.scanning.written_page import Inked
from handout.tagging.line_space import frames_of, strips
from handout.tagging.transcript import TranscriptLine, read_transcript
from handout.tagging.transcript_fit import REFUSED, refusal, text_breadth, text_fit

_SURE = 0.35  # fit above which a page is believed to lie that way: pages the wrong way round have up to 0.1
_LITTLE, _MUCH = 1.6, 0.6  # breadth of letters against the usual ones, where text is missing and where it is too long
_QUARTERS = {1: "on its side, its top to the right", 2: "upside down", 3: "on its side, its top to the left"}


def find_turn(inked: Inked, transcript: str, rng: np.random.Generator) -> int:
    """The number of quarter turns, anticlockwise, that make a page lie upright.

    Parameters
    ----------
    inked : Inked
    transcript : str
        What is written on the page.
    rng : numpy.random.Generator

    Raises
    ------
    InputError
        The page is mirrored, shows two columns, or has another size or another text.
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
        straight = strips(inked.mask.ink, frames_of(inked.text_lines, inked.prepared.scan.pixel))
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


def orientation_name(quarters: int) -> str:
    """How a page lies that must be turned by that number of quarters."""
    return _QUARTERS[quarters]


def page_fit(
    ink: NDArray[np.bool_], dpi: float, text_lines: TextLines, lines: Sequence[TranscriptLine], rng: np.random.Generator
) -> float:
    """How well a text fits the written lines of a page: as `transcript_fit.text_fit`; 0 without lines."""
    if not text_lines.lines:
        return 0.0
    return text_fit(strips(ink, frames_of(text_lines, 25.4 / dpi)), lines, rng)


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
        advice = "the text of this page alone" if breadth < _MUCH else "all that is written on the page"
        return InputError(
            f"{scan.source} has {len(text_lines.lines)} lines of writing, and its text "
            f"({units.count(count, 'line')}, {units.count(letters, 'character')}) is about "
            f"{1 / breadth:.1f} times what they hold: give {advice}, line by line."
        )
    return InputError(f"{scan.source}: {refusal(fit, (len(text_lines.lines), len(lines)))}")
