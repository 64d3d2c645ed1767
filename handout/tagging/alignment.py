"""Aligning a page with its transcript: where every letter is, how sure that is, how well each line's text fits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from handout.alphabet import SPACE
from handout.errors import InputError
from handout.networks import one_thread
from handout.progress import Tell, silent
from handout.tagging import network
from handout.tagging.decoder import Decoded
from handout.tagging.line_space import LineFrame, LineStrip, frames, strips
from handout.tagging.network import RectifierNetwork
from handout.tagging.segmentation import PageReader, by_segments, confidence, page_reader
from handout.tagging.transcript import TranscriptLine, read_transcript
from handout.tagging.transcript_fit import POOR, assigned_to_lines, refuse_other_text

if TYPE_CHECKING:
    from handout.scanning.written_page import WrittenPage

DOUBTFUL = 0.5  # confidence under which a letter is worth a look

Method = Callable[[PageReader, Sequence[TranscriptLine], np.random.Generator, Tell], list[list[Decoded]]]
METHODS: Mapping[str, Method] = {"segments": by_segments, "segments-once": partial(by_segments, adapting=False)}


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
class Alignment:
    """A page aligned with its transcript.

    lines : from top to bottom; lines of the page without text are missing.
    poor : numbers of the lines whose text seems not to be what is written there.
    method : the name of the method that was used.
    """

    lines: tuple[AlignedLine, ...]
    poor: tuple[int, ...] = ()
    method: str | Method = "segments"

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
    method: str | Method = "segments",
    rng: np.random.Generator,
    networks: Sequence[RectifierNetwork] | None = None,
    tell: Tell = silent,
) -> Alignment:
    """Find every letter of a page.

    Parameters
    ----------
    page : scanning.written_page.WrittenPage
        With its mask of ink and its text lines.
    transcript : str
        What is written, a line of text for a line of the page where that is known; ``~~words~~`` were struck out.
        Line breaks that differ from the page's are found.
    method : {"segments", "segments-once"} or function
        "segments-once" learns nothing from the page, which is quicker and finds fewer; a function such as these takes
        the lines of the page, what is written on each, a random generator and `tell`.
    rng : numpy.random.Generator
        Drives the training on the page; the same generator gives the same alignment.
    networks : sequence of Network, optional
        In place of the shipped ones.
    tell : function, optional
        Told how far it has come.

    Raises
    ------
    InputError
        An empty transcript, a page without lines, an unknown method, or the transcript of another page.
    """
    straightened = strips(page.mask.ink, frames(page)) if page.text_lines.lines else []
    return align_strips(straightened, transcript, method=method, rng=rng, networks=networks, tell=tell)


@one_thread
def align_strips(
    strips: Sequence[LineStrip],
    transcript: str,
    *,
    method: str | Method = "segments",
    rng: np.random.Generator,
    networks: Sequence[RectifierNetwork] | None = None,
    tell: Tell = silent,
) -> Alignment:
    """The same for lines that have been straightened."""
    name, decode_lines = _method(method)
    lines = read_transcript(transcript)
    if not strips:
        raise InputError("No lines of writing were found on the page: nothing can be aligned.")
    reader = page_reader([strip.image for strip in strips], networks or network.load_networks())
    texts, fits = assigned_to_lines(reader, lines, rng)
    with_text = [i for i, text in enumerate(texts) if text.letters]
    refuse_other_text([fits[i] for i in with_text], (len(strips), len(lines)))
    decodings = decode_lines(reader.part(with_text), [texts[i] for i in with_text], rng, tell)
    aligned = tuple(
        AlignedLine(i, strips[i].frame, aligned_letters(strips[i].frame, texts[i], of_line), float(fits[i]))
        for i, of_line in zip(with_text, decodings, strict=True)
    )
    return Alignment(aligned, tuple(i for i in with_text if fits[i] < POOR), name)


def _method(method: str | Method) -> tuple[str, Method]:
    """The name of a method of alignment, and the method."""
    if not isinstance(method, str):
        return method.__name__, method
    if method not in METHODS:
        raise InputError(f"method {method!r} is unknown; use {' or '.join(METHODS)}.")
    return method, METHODS[method]


def aligned_letters(frame: LineFrame, text: TranscriptLine, decodings: Sequence[Decoded]) -> tuple[PageLetter, ...]:
    best, confidences = decodings[-1], confidence(decodings)
    left, right = (frame.to_page(side)[:, 0].tolist() for side in (best.left, best.right))
    return tuple(
        PageLetter(text.at[i], text.spelt[i], left[i], right[i], float(confidences[i]), bool(best.found[i]))
        for i, letter in enumerate(text.letters)
        if letter != SPACE
    )
