"""Aligning a page with its transcript: which text is on which line, how well it fits, where each letter is."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from handout.alphabet import SPACE
from handout.errors import InputError
from handout.networks import one_thread
from handout.progress import Tell, silent
from handout.tagging import network
from handout.tagging.decoder import Decoded
from handout.tagging.line_space import LineFrame, LineStrip, straight_lines
from handout.tagging.network import RectifierNetwork
from handout.tagging.segmentation import PageReader, by_segments, confidence, page_reader
from handout.tagging.transcript import TranscriptLine, read_transcript
from handout.values import Array

if TYPE_CHECKING:
    from handout.scanning.written_page import WrittenPage
from collections.abc import Mapping
from itertools import pairwise

from handout.alphabet import JUNK
from handout.tagging.decoder import ColumnReading, decode, in_a_row, word_gains
from handout.tagging.line_space import STEP
from handout.tagging.segmentation import page_scale
from handout.tagging.transcript import in_one_line

_SHUFFLES = 3  # of a line's letters, whose mean score is that of chance
# Measured on 79 lines of seven real pages: right texts 0.41 to 0.88; texts of other lines or pages, broken as suits
# them best, −0.08 to 0.27
POOR = 0.3  # fit of a line under which its text is reported
REFUSED = 0.25  # median fit of a page under which the transcript is refused
_MOST_POOR = 1  # lines that may fit poorly before other line breaks are tried
# A line and its text differ by a word where it would score so much more without one of its words, or with something
# that is not in the text beside one.  Of 23 people's pages, under each of which one word was added or left out, 20
# and 13 are told so (of nine that had no part in these bounds, 6 and 4).  Of their own texts six words are named that
# the pages do lack, three on lines that were cut or not found, and one that is right
_LACKS, _HAS_MORE = 45.0, 70.0
_STRANGE = 0.3  # how far the score of what is not in the text lies from chance to the usual fit of the page's lines


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
    """How far each line's text comes from chance, 0, to what would suit every column best, 1; 0 without text.

    Of one page they are worked out once; `rng` moves on as far all the same, so that the letters are found alike.
    """
    shuffled = [[_shuffle(line, rng) for _ in range(_SHUFFLES if line.letters else 0)] for line in lines]
    if tuple(lines) not in reader.fits:
        widths, fits, chance = reader.widths(lines), list[float](), list[float]()
        for i, (line, others) in enumerate(zip(lines, shuffled, strict=True)):
            fits.append(0.0)
            if line.letters:
                reading = reader.reading(i)
                score, *by_chance = (decode(reading, letters, widths).score for letters in (line.letters, *others))
                least = float(np.mean(by_chance))
                fits[-1] = (score - least) / max(_most(reading).sum() - least, 1e-6)
                chance.append(least / reading.columns)
        reader.fits[tuple(lines)] = fits
        reader.chance[tuple(lines)] = float(np.median(chance)) if chance else 0.0
    return list(reader.fits[tuple(lines)])


def _most(reading: ColumnReading) -> Array:
    """(n,) the score of what would suit each column best."""
    most: Array = np.maximum(np.diff(reading.letters, axis=0).max(axis=1), np.diff(reading.space))
    return most


def _shuffle(line: TranscriptLine, rng: np.random.Generator) -> list[str]:
    """The line's letters in another order, the words' lengths kept."""
    at = [i for i, letter in enumerate(line.letters) if letter not in (SPACE, JUNK)]
    letters = list(line.letters)
    for i, j in zip(at, rng.permutation(at), strict=True):
        letters[i] = line.letters[j]
    return letters


def broken_freely(
    readings: Sequence[ColumnReading], lines: Sequence[TranscriptLine], widths: Mapping[str, float]
) -> list[TranscriptLine]:
    """The text of each line of the page, perhaps empty, whatever the line breaks of the transcript.

    Where the transcript has fewer lines, one that its text would fit poorly, as a printed heading, is left without any.
    """
    text, unread = in_one_line(lines), list[float]()
    if len(lines) < len(readings):
        counts, most = np.array([(reading.columns, _most(reading).sum()) for reading in readings]).T
        backwards = [part.letters[::-1] for part in _evenly_broken(lines, len(readings))]
        least = [decode(one, letters, widths).score for one, letters in zip(readings, backwards, strict=True)]
        # a line's own would tell how much text it was given, too
        by_chance = float(np.median(least / counts)) * counts
        unread = (by_chance + POOR * (most - by_chance)).tolist()
    row = in_a_row(readings, unread)
    decoded = decode(row, text.letters, widths)
    middle = 0.5 * (decoded.left + decoded.right) / STEP
    owner = np.searchsorted(np.array(row.lines), middle, side="right") - 1
    parts = []
    for number in range(len(readings)):
        on_line = [i for i in np.flatnonzero(owner == number) if text.letters[i] != SPACE]
        parts.append(text.part(int(on_line[0]), int(on_line[-1]) + 1) if on_line else text.part(0, 0))
    return parts


def odd_words(reader: PageReader, texts: Sequence[TranscriptLine], fits: Sequence[float]) -> Iterator[OddWord]:
    """Words by which lines and their texts seem to differ, at most two a line.

    None of lines that fit poorly, which are told as a whole, nor of those with words struck out.

    texts : of each line of the page, whose fits `line_fits` worked out.

    Source: own method: scores of the line's best segmentation with one word less, or with one unread stretch more.
    """
    widths, chance = reader.widths(texts), reader.chance[tuple(texts)]
    judged = [i for i, fit in enumerate(fits) if fit >= POOR and JUNK not in texts[i].letters]
    for i in judged:
        reading, text = reader.reading(i), texts[i]
        strange = chance + _STRANGE * float(np.median([fits[k] for k in judged])) * (_most(reading) - chance)
        gains = word_gains(reading, text.letters, widths, np.concatenate([[0.0], np.cumsum(strange)]))
        ends = [k for k, letter in enumerate(text.letters) if letter == SPACE]
        words = list(zip([0, *(k + 1 for k in ends)], [*ends, len(text.letters)], strict=True))
        for more, of_word, least in zip((False, True), gains, (_LACKS, _HAS_MORE), strict=True):
            k = int(np.argmax(of_word)) if of_word else 0
            if of_word and of_word[k] >= least:
                first, stop = words[min(k, len(words) - 1)]
                yield OddWord(i, text.at[first], "".join(text.spelt[first:stop]), more)


def _evenly_broken(lines: Sequence[TranscriptLine], count: int) -> list[TranscriptLine]:
    """The text cut into as many pieces as there are lines, all of about one length: enough to guess a scale from."""
    text = in_one_line(lines)
    cuts = np.linspace(0, len(text.letters), count + 1).astype(int)
    return [text.part(a, b) for a, b in pairwise(cuts.tolist())]


def median_fit(fits: Sequence[float]) -> float:
    """The middle line's fit; 0 without lines."""
    return float(np.median(fits)) if len(fits) else 0.0


def text_fit(strips: Sequence[LineStrip], lines: Sequence[TranscriptLine], rng: np.random.Generator) -> float:
    """How well a text fits straightened lines, broken as suits it best: the middle line's, 0 of a bare one."""
    return median_fit([fit for fit, _ in _fits_of_text(strips, lines, rng)])


def transcript_fit(page: WrittenPage, transcript: str, rng: np.random.Generator) -> float:
    """How well a text explains a page's lines, weighted by its letters; 0 where `align` would refuse it."""
    found = _fits_of_text(
        straight_lines(page.mask.ink, page.text_lines, page.scan.pixel), read_transcript(transcript), rng
    )
    fits, weights = [fit for fit, _ in found], [count for _, count in found]
    refused = median_fit([fit for fit, count in found if count]) < REFUSED
    return 0.0 if refused else float(np.average(fits, weights=weights))


def _fits_of_text(
    strips: Sequence[LineStrip], lines: Sequence[TranscriptLine], rng: np.random.Generator
) -> list[tuple[float, int]]:
    """How well the text of each line fits it, and how many letters that is; 0 where it has none."""
    if not strips:
        return []
    reader = page_reader([strip.image for strip in strips], network.load_networks())
    parts, fits = assigned_to_lines(reader, lines, rng)
    counts = [len(part.letters) - part.letters.count(SPACE) for part in parts]
    return list(zip(fits, counts, strict=True))


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


DOUBTFUL = 0.5  # confidence under which a letter is worth a look

Method = Callable[[PageReader, Sequence[TranscriptLine], np.random.Generator, Tell], list[list[Decoded]]]


@dataclass(frozen=True)
class PageLetter:
    """One letter on a page.

    at : index of its grapheme in the transcript.
    text : the grapheme; of something struck out, all of it.
    left, right : x where it begins and ends on the baseline, pixels of the page; the borders lean by the line's slant.
    confidence : 0–1, no probability: 1 where all networks agree on both ends, with and without having learned from the
        page, 0.5 where they lie a third of a tolerance apart.  Of letters under 0.5 more are wrong, but most are right.
    present : False where the page seems not to have it (it has no width then).
    """

    at: int
    text: str
    left: float
    right: float
    confidence: float
    present: bool = True


@dataclass(frozen=True)
class AlignedLine:
    """A line of the page with its letters, from left to right, without spaces.

    number : of the line on the page, from 0, counting the lines that were found.
    frame : where the line lies.
    fit : how well its text explains the line: 0 as its letters in another order would, 1 as well as anything could;
        right texts have 0.4 to 0.9.
    """

    number: int
    frame: LineFrame
    letters: tuple[PageLetter, ...]
    fit: float

    @property
    def text(self) -> str:
        """The letters in a row (spaces left out)."""
        return "".join(letter.text for letter in self.letters)


@dataclass(frozen=True)
class OddWord:
    """A word by which a line of the page and its text seem to differ.

    line : number of the line on the page, from 0.
    at : index of the word's first grapheme in the transcript.
    word : as the transcript has it.
    more : whether the page shows something beside it that the text lacks, not the text a word that the page lacks.
    """

    line: int
    at: int
    word: str
    more: bool


@dataclass(frozen=True)
class Alignment:
    """A page aligned with its transcript.

    lines : from top to bottom; lines of the page without text are missing.
    poor : numbers of the lines whose text seems not to be what is written there.
    odd : words by which other lines seem to differ from their text.
    """

    lines: tuple[AlignedLine, ...]
    poor: tuple[int, ...] = ()
    odd: tuple[OddWord, ...] = ()

    @property
    def letters(self) -> tuple[PageLetter, ...]:
        """All letters of the page."""
        return tuple(letter for line in self.lines for letter in line.letters)

    @property
    def doubtful(self) -> tuple[PageLetter, ...]:
        """The letters worth a look, the least certain first."""
        low = [letter for letter in self.letters if letter.confidence < DOUBTFUL or not letter.present]
        return tuple(sorted(low, key=lambda letter: letter.confidence))


def align(
    page: WrittenPage,
    transcript: str,
    *,
    method: Method = by_segments,
    rng: np.random.Generator,
    networks: Sequence[RectifierNetwork] | None = None,
    tell: Tell = silent,
) -> Alignment:
    """Find every letter of a page.

    page : with its mask of ink and its text lines.
    transcript : what is written, a line of text for a line of the page where that is known; ``~~words~~`` were struck
        out. Line breaks that differ from the page's are found.
    method : takes the lines of the page, what is written on each, a random generator and `tell`.
    rng : drives the training on the page; the same generator gives the same alignment.
    networks : in place of the shipped ones.
    tell : told how far it has come.

    Raises InputError: an empty transcript, a page without lines, or the transcript of another page.
    """
    return align_strips(
        straight_lines(page.mask.ink, page.text_lines, page.scan.pixel),
        transcript,
        method=method,
        rng=rng,
        networks=networks,
        tell=tell,
    )


@one_thread
def align_strips(
    strips: Sequence[LineStrip],
    transcript: str,
    *,
    method: Method = by_segments,
    rng: np.random.Generator,
    networks: Sequence[RectifierNetwork] | None = None,
    tell: Tell = silent,
) -> Alignment:
    """The same for lines that have been straightened."""
    lines = read_transcript(transcript)
    if not strips:
        raise InputError("No lines of writing were found on the page: nothing can be aligned.")
    reader = page_reader([strip.image for strip in strips], networks or network.load_networks())
    texts, fits = assigned_to_lines(reader, lines, rng)
    with_text = [i for i, text in enumerate(texts) if text.letters]
    refuse_other_text([fits[i] for i in with_text], (len(strips), len(lines)))
    decodings = method(reader.part(with_text), [texts[i] for i in with_text], rng, tell)
    aligned = tuple(
        AlignedLine(i, strips[i].frame, aligned_letters(strips[i].frame, texts[i], of_line), float(fits[i]))
        for i, of_line in zip(with_text, decodings, strict=True)
    )
    return Alignment(aligned, tuple(i for i in with_text if fits[i] < POOR), tuple(odd_words(reader, texts, fits)))


def aligned_letters(frame: LineFrame, text: TranscriptLine, decodings: Sequence[Decoded]) -> tuple[PageLetter, ...]:
    best, confidences = decodings[-1], confidence(decodings)
    left, right = (frame.to_page(side)[:, 0].tolist() for side in (best.left, best.right))
    return tuple(
        PageLetter(text.at[i], text.spelt[i], left[i], right[i], float(confidences[i]), bool(best.found[i]))
        for i, letter in enumerate(text.letters)
        if letter != SPACE
    )
