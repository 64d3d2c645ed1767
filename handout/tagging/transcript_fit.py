"""Which text of a transcript is on which line of the page, how well it fits there, and whether it is there at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from handout.alphabet import JUNK, SPACE
from handout.errors import InputError
from handout.tagging import network
from handout.tagging.decoder import ColumnReading, Decoded, decode, in_a_row
from handout.tagging.line_space import STEP, LineStrip
from handout.tagging.segmentation import PageReader, page_reader, page_scale
from handout.tagging.transcript import TranscriptLine, in_one_line

_SHUFFLES = 3  # of a line's letters, whose mean score is that of chance
# Measured on 79 lines of seven real pages: right texts 0.41 to 0.88; texts of other lines or pages, broken as suits
# them best, −0.08 to 0.27
POOR = 0.3  # fit of a line under which its text is reported
REFUSED = 0.25  # median fit of a page under which the transcript is refused
_MOST_POOR = 1  # lines that may fit poorly before other line breaks are tried


def assigned_to_lines(
    reader: PageReader, lines: Sequence[TranscriptLine], rng: np.random.Generator
) -> tuple[list[TranscriptLine], list[float]]:
    """The text on each line of the page, which may be none, and how well it fits there.

    The line breaks of the transcript are kept if its number of lines is the page's and they fit well; otherwise the
    text is broken as suits the page best.
    """
    count = len(reader.images)
    fits: list[float] = []
    if len(lines) == count:
        fits = line_fits(reader, lines, rng)
        if sum(of_line < POOR for of_line in fits) <= _MOST_POOR:
            return list(lines), fits
    if tuple(lines) not in reader.broken:
        readings = [reader.reading(i) for i in range(count)]
        widths = reader.widths(_evenly_broken(lines, count))
        reader.broken[tuple(lines)] = broken_freely(readings, lines, widths)
    rebroken = reader.broken[tuple(lines)]
    refits = line_fits(reader, rebroken, rng)
    if len(lines) == count and float(np.median(fits)) > float(np.median(refits)):
        return list(lines), fits
    return rebroken, refits


def line_fits(reader: PageReader, lines: Sequence[TranscriptLine], rng: np.random.Generator) -> list[float]:
    widths = reader.widths(lines)
    fits = []
    for i, line in enumerate(lines):
        reading = reader.reading(i)
        decoded = decode(reading, line.letters, widths) if line.letters else None
        fits.append(fit(reading, line, decoded, widths, rng) if decoded else 0.0)
    return fits


def fit(
    reading: ColumnReading,
    line: TranscriptLine,
    decoded: Decoded,
    widths: Mapping[str, float],
    rng: np.random.Generator,
) -> float:
    """How far the line's text comes from chance, 0, to what would suit every column best, 1."""
    least = chance(reading, line, widths, rng)
    most = np.maximum(np.diff(reading.letters, axis=0).max(axis=1), np.diff(reading.space)).sum()
    return (decoded.score - least) / max(float(most) - least, 1e-6)


def chance(
    reading: ColumnReading, line: TranscriptLine, widths: Mapping[str, float], rng: np.random.Generator
) -> float:
    """Score of the line's letters in another order, the words' lengths kept: mean of a few."""
    at = [i for i, letter in enumerate(line.letters) if letter not in (SPACE, JUNK)]
    scores = []
    for _ in range(_SHUFFLES):
        letters = list(line.letters)
        for i, j in zip(at, rng.permutation(at), strict=True):
            letters[i] = line.letters[j]
        scores.append(decode(reading, letters, widths).score)
    return float(np.mean(scores))


def broken_freely(
    readings: Sequence[ColumnReading], lines: Sequence[TranscriptLine], widths: Mapping[str, float]
) -> list[TranscriptLine]:
    """The text of each line of the page, perhaps empty, whatever the line breaks of the transcript."""
    text = in_one_line(lines)
    row = in_a_row(readings)
    decoded = decode(row, text.letters, widths)
    middle = 0.5 * (decoded.left + decoded.right) / STEP
    owner = np.searchsorted(np.array(row.lines), middle, side="right") - 1
    parts = []
    for number in range(len(readings)):
        on_line = [i for i in np.flatnonzero(owner == number) if text.letters[i] != SPACE]
        parts.append(text.part(int(on_line[0]), int(on_line[-1]) + 1) if on_line else text.part(0, 0))
    return parts


def _evenly_broken(lines: Sequence[TranscriptLine], count: int) -> list[TranscriptLine]:
    """The text cut into as many pieces as there are lines, all of about one length: enough to guess a scale from."""
    text = in_one_line(lines)
    cuts = np.linspace(0, len(text.letters), count + 1).astype(int)
    return [text.part(a, b) for a, b in pairwise(cuts.tolist())]


def median_fit(fits: Sequence[float]) -> float:
    """The middle line's fit; 0 without lines."""
    return float(np.median(fits)) if len(fits) else 0.0


def text_fit(strips: Sequence[LineStrip], lines: Sequence[TranscriptLine], rng: np.random.Generator) -> float:
    """How well a text fits straightened lines, broken as suits it best: the middle line's fit."""
    reader = page_reader([strip.image for strip in strips], network.load_networks())
    parts, fits = assigned_to_lines(reader, lines, rng)
    return median_fit([of_line for of_line, part in zip(fits, parts, strict=True) if part.letters])


def text_breadth(strips: Sequence[LineStrip], lines: Sequence[TranscriptLine]) -> float:
    """How broad the page's letters would be against the usual ones if this were its text."""
    widths = np.mean([shipped.widths for shipped in network.load_networks()], axis=0).astype(np.float64)
    return page_scale([strip.image for strip in strips], _evenly_broken(lines, len(strips)), widths)


def refuse_other_text(fits: Sequence[float], counts: Sequence[int]) -> None:
    """Raise InputError if the middle line's text fits no better than any other would; counts as in `refusal`."""
    if median_fit(fits) < REFUSED:
        raise InputError(refusal(median_fit(fits), counts))


def refusal(fit: float, counts: Sequence[int]) -> str:
    """The sentence about a transcript that fits so well a page with counts[0] lines; it has counts[1]."""
    return (
        f"The transcript does not seem to be this page's: its lines fit by {max(fit, 0):.0%}, where right ones have "
        f"40 % or more and another page's about 5 %. Check that it belongs to this scan; the page has {counts[0]} "
        f"lines of writing, the transcript {counts[1]}."
    )
