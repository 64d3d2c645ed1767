"""Reads a simulated page as a user's scan is read, and scores the letters that come out.

The reader gets the picture and the transcript, never the truth; only the score uses that.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from handout.hand.places import graphemes
from handout.hand.scanned import ScannedGlyph
from handout.scanning.scan import Scan
from handout.scanning.written_page import WrittenPage, read_page
from handout.tagging.page_tagging import TaggedPage
from handout.values import Array, Indices
from handout_lab.author import ground_truth_score
from handout_lab.author.truth import Simulated, Truth


@dataclass(frozen=True)
class LetterScore:
    """How well a page's letters were found.

    right : share whose name is right; identity : share that are themselves, not an equal letter beside them.
    splits : the places where joined letters part.
    """

    right: float
    identity: float
    splits: ground_truth_score.SplitScore


def transcript(simulated: Simulated) -> str:
    """What is written on a page, line by line."""
    return "\n".join(line.text for line in simulated.manuscript.lines)


def read(simulated: Simulated, source: str = "the scan") -> WrittenPage:
    """The page's ink, path and lines, as `read_page` finds them in the picture."""
    return read_page(Scan(np.asarray(simulated.image), float(simulated.dpi), source))


def score(truth: Truth, page: TaggedPage) -> LetterScore:
    """Judge the letters of a page that was made from the whole of its own transcript."""
    uv, letters = page.page.graph.uv, vertex_letters(page, [letter.at for letter in truth.letters])
    texts = {letter.at: letter.text for letter in truth.letters}
    right = ground_truth_score.letters_right(truth, uv, [texts.get(at, "") for at in letters.tolist()])
    return LetterScore(
        right, ground_truth_score.letters_identified(truth, uv, letters), ground_truth_score.splits(truth, cuts(page))
    )


def vertex_letters(page: TaggedPage, written: Iterable[int]) -> Indices:
    """(n,) for every vertex the letter that it was assigned to, −1 for none.

    Parameters
    ----------
    written : the numbers of the page's letters, in order: line breaks and spaces of a transcript may be others than
        those of the text, letters are the same.
    """
    units = graphemes(page.page.transcript)
    number = dict(zip((i for i, unit in enumerate(units) if not unit.isspace()), written, strict=True))
    letters = np.full(len(page.page.graph), ground_truth_score.NOBODY, dtype=np.intp)
    for glyph in page.glyphs:
        letters[glyph.vertices] = number[glyph.at]
    return letters


def cuts(page: TaggedPage) -> Array:
    """(k, 2) pixels: where ligatures pass from one letter to the next."""
    uv = page.page.graph.uv
    ways = ((way.path, _passed(glyph, way.path)) for glyph in page.glyphs for way in glyph.ligatures)
    return np.array([uv[path[i - 1 : i + 1]].mean(axis=0) for path, i in ways]).reshape(-1, 2)


def _passed(glyph: ScannedGlyph, path: Indices) -> int:
    """The first vertex of a ligature that is no longer its letter's."""
    return int(np.flatnonzero(~np.isin(path, glyph.vertices))[0])
