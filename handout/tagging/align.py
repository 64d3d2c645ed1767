"""Where every letter of a scanned page is: the way from the page and its transcript to an `Alignment`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import threadpool_limits

from handout.errors import InputError
from handout.progress import Tell, silent
from handout.tagging import fit, network
from handout.tagging.alignment import AlignedLine, Alignment, Letter
from handout.tagging.alphabet import SPACE
from handout.tagging.decoder import Decoded, decode
from handout.tagging.linespace import Frame, Strip, strips
from handout.tagging.network import Network
from handout.tagging.segments import Page, by_line, confidence, page_scale
from handout.tagging.transcript import Written, in_one, read_transcript

if TYPE_CHECKING:
    from handout.scanning.text_lines import TextLines
    from handout.scanning.written_page import WrittenPage

METHODS = ("segments", "segments-once", "haines_2016")
_MOST_POOR = 1  # lines that may fit poorly before other line breaks are tried

Decodings = Callable[[Page, Sequence[Written], np.random.Generator, Tell], list[list[Decoded]]]


def align(
    page: WrittenPage,
    transcript: str,
    *,
    method: str = "segments",
    rng: np.random.Generator,
    networks: Sequence[Network] | None = None,
    tell: Tell = silent,
) -> Alignment:
    """Find every letter of a page.

    Parameters
    ----------
    page : scanning.reading.WrittenPage
        With its mask of ink and its text lines.
    transcript : str
        What is written, a line of text for a line of the page where that is known; ``~~words~~`` were struck out.
        Line breaks that differ from the page's are found.
    method : {"segments", "segments-once", "haines_2016"}
        "segments-once" learns nothing from the page, which is quicker and finds fewer; "haines_2016" is the chain of
        seed 000, for comparison.
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
    straight = strips(page.mask.ink, frames(page)) if page.text_lines.lines else []
    return align_strips(straight, transcript, method=method, rng=rng, networks=networks, tell=tell)


def align_strips(
    straight: Sequence[Strip],
    transcript: str,
    *,
    method: str = "segments",
    rng: np.random.Generator,
    networks: Sequence[Network] | None = None,
    tell: Tell = silent,
) -> Alignment:
    """The same for lines that have been straightened."""
    lines = read_transcript(transcript)
    if not straight:
        raise InputError("No lines of writing were found on the page: nothing can be aligned.")
    page = Page([strip.image for strip in straight], networks or network.shipped())
    parts, fits = _placed(page, lines, rng)
    fit.check([one for one, part in zip(fits, parts, strict=True) if part.letters], (len(straight), len(lines)))
    kept = [i for i, part in enumerate(parts) if part.letters]
    used, texts = page.part(kept), [parts[i] for i in kept]
    # matrices this small gain little from more processors, and sums in another order would make other letters of a page
    with threadpool_limits(limits=1, user_api="blas"):
        found = _decodings(method)(used, texts, rng, tell)
    aligned = tuple(
        AlignedLine(i, straight[i].frame, _letters(straight[i].frame, text, each), float(fits[i]))
        for i, text, each in zip(kept, texts, found, strict=True)
    )
    return Alignment(aligned, tuple(i for i in kept if fits[i] < fit.POOR), method)


def _decodings(method: str) -> Decodings:
    if method == "segments":
        return by_line
    if method == "segments-once":
        return partial(by_line, adapting=False)
    if method == "haines_2016":
        from handout.tagging.chain import haines_2016

        return haines_2016
    raise InputError(f"method {method!r} is unknown; use {' or '.join(METHODS)}.")


def _placed(page: Page, lines: Sequence[Written], rng: np.random.Generator) -> tuple[list[Written], list[float]]:
    """Which text is on which line of the page, and how well it fits there."""
    count = len(page.images)
    if len(lines) == count:
        fits = _fits(page, lines, rng)
        if sum(one < fit.POOR for one in fits) <= _MOST_POOR:
            return list(lines), fits
    readings = [page.reading(i) for i in range(count)]
    parts = fit.broken_freely(readings, lines, page.widths(_dealt(lines, count)))
    freely = _fits(page, parts, rng)
    if len(lines) == count and float(np.median(fits)) > float(np.median(freely)):
        parts, freely = list(lines), fits
    return parts, freely


def _dealt(lines: Sequence[Written], count: int) -> list[Written]:
    """The text cut into as many pieces as there are lines, all of about one length: enough to guess a scale from."""
    text = in_one(lines)
    cuts = np.linspace(0, len(text.letters), count + 1).astype(int)
    return [text.part(a, b) for a, b in pairwise(cuts.tolist())]


def _fits(page: Page, lines: Sequence[Written], rng: np.random.Generator) -> list[float]:
    widths = page.widths(lines)
    fits = []
    for i, line in enumerate(lines):
        reading = page.reading(i)
        found = decode(reading, line.letters, widths) if line.letters else None
        fits.append(fit.fit(reading, line, found, widths, rng) if found else 0.0)
    return fits


def _letters(frame: Frame, text: Written, decodings: Sequence[Decoded]) -> tuple[Letter, ...]:
    best, sure = decodings[-1], confidence(decodings)
    left, right = (frame.to_page(side)[:, 0].tolist() for side in (best.left, best.right))
    return tuple(
        Letter(text.at[i], text.spelt[i], left[i], right[i], float(sure[i]), bool(best.found[i]))
        for i, letter in enumerate(text.letters)
        if letter != SPACE
    )


def typical_fit(straight: Sequence[Strip], lines: Sequence[Written], rng: np.random.Generator) -> float:
    """How well a text fits straightened lines, broken as suits it best: the middle line's fit."""
    page = Page([strip.image for strip in straight], network.shipped())
    parts, fits = _placed(page, lines, rng)
    return fit.typical([one for one, part in zip(fits, parts, strict=True) if part.letters])


def breadth(page: Page, lines: Sequence[Written]) -> float:
    """How broad the page's letters would be against the usual ones if this were its text."""
    widths = np.mean([one.widths for one in page.networks], axis=0).astype(np.float64)
    return page_scale(page.images, _dealt(lines, len(page.images)), widths)


def frames(page: WrittenPage) -> list[Frame]:
    """The lines of a page in its own pixels, 0 the middle of the first one."""
    return frames_of(page.text_lines, page.scan.pixel)


def frames_of(text_lines: TextLines, pixel: float) -> list[Frame]:
    """Written lines as frames in pixels of `pixel` mm, 0 the middle of the first one."""
    return [
        Frame(
            baseline=(line.curve[0] / pixel - 0.5, line.curve[1], line.curve[2] * pixel),
            x_height=text_lines.x_height / pixel,
            slant=text_lines.slant,
            middle=line.middle / pixel - 0.5,
            reach=(line.right - line.left) / 2 / pixel,
        )
        for line in text_lines.lines
    ]
