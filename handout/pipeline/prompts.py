"""Sheets for an author to write on: sentences that hold every letter and pair often, set on ruled pages, as a PDF."""

from __future__ import annotations

import string
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from handout import atomic
from handout.errors import InputError
from handout.pipeline.inputs import output_path
from handout.pipeline.options import PromptOptions, millimetres
from handout.pipeline.results import Delivery
from handout.prompting import corpus, prompt_pages, sentence_choice, sheet_codes, sheet_pdf
from handout.prompting.sentence_choice import measure_coverage
from handout.prompting.sheet_layout import SheetLayout, paper_of_name
from handout.values import Array

if TYPE_CHECKING:
    from handout.prompting.sentence_choice import Coverage, Frequencies

# Letters copied a minute in the ninth grade, the mean of girls (121) and boys (114) rounded: Graham, Berninger,
# Weintraub and Schafer 1998.  In seed 000, §4, authors took 10 to 30 minutes for four pages on every other line.
_LETTERS_A_MINUTE = 117
_X_HEIGHT, _TYPE_X_HEIGHT = 3.0, 0.55  # mm, and of the sheets' typeface at size 1: what it lacks is written as high
_PAGES, _AGAIN_PAGES = 4, 1  # of sheets for a new hand (seed 000, §4), and for letters that one lacks


@dataclass(frozen=True, kw_only=True)
class PromptSheets(Delivery):
    """The sheets that were made; `coverage` says how often each letter and pair will be there."""

    coverage: Coverage


def prompt(output: str | Path, options: PromptOptions = PromptOptions()) -> PromptSheets:
    """Make sheets to write on, so that a scan of them becomes a hand.

    Raises InputError: no PDF is asked for, a file that cannot be read or written, a ruling or a number of pages out of
    bounds; a hand that has enough of every letter.
    """
    path = output_path(output, ".pdf", "sheets are written as")
    layout = SheetLayout(paper_of_name(options.page), millimetres(options.ruling, "ruling"), printed=options.ruled)
    width = layout.width(millimetres(options.letter_width, "letter width") if options.letter_width else None)
    file = options.corpus_file
    shipped = corpus.shipped_sentences(options.language)
    sentences = corpus.sentences(corpus.read_text(Path(file))) if file else list(shipped)
    target, characters = _choose_wanted(sentences, options)
    wanted, again = sentence_choice.frequencies(target), ""
    if options.hand is not None:
        wanted, again = _choose_again(options.hand, target, options)
        characters = again
    pages = prompt_pages.prompt(
        sentences,
        wanted,
        characters,
        pages=options.pages or (_AGAIN_PAGES if again else _PAGES),
        lines=layout.lines,
        width=width,
        language=options.language,
    )
    atomic.write(path, sheet_pdf.to_pdf(pages, layout, _write_line))
    texts = (" ".join(page) for page in pages.pages)
    covered = measure_coverage(texts, target, characters)
    letters = sum(not char.isspace() for page in pages.pages for line in page for char in line)
    told = {
        "files": [str(path)],
        "key": sheet_codes.key(pages.pages),
        "pages": len(pages.pages),
        "lines": sum(map(len, pages.pages)),
        "words": pages.words,
        "minutes": round(letters / _LETTERS_A_MINUTE, 1),  # that it takes to copy the text
        "page": layout.page.name,
        "ruling_mm": layout.pitch,
        "ruled": layout.printed,
        "text": ["\n".join(page) for page in pages.pages],
        "coverage": covered.as_json(),
        **({"write_again": list(again)} if again else {}),
    }
    return PromptSheets(files=(path,), told=told, coverage=covered)


def _choose_again(name: str, target: list[str], options: PromptOptions) -> tuple[Frequencies, str]:
    """What sheets for a hand should hold, and the letters that they must."""
    from handout.hand import file, library, report
    from handout.prompting.sentence_choice import frequencies_again

    hand = file.load(library.scanned_file(name))
    wished = corpus.as_typed(options.characters or string.ascii_letters + "".join(hand.letters)) + corpus.as_typed(
        options.also
    )
    frequencies, again = frequencies_again(hand, report.sure_letters(hand), target, wished)
    if not again:
        raise InputError(f"{name} has enough sure ones of every letter: give others with --also.")
    return frequencies, again


def _choose_wanted(sentences: list[str], options: PromptOptions) -> tuple[list[str], str]:
    """The texts whose letters and pairs count, and the characters of which each has to occur."""
    own = corpus.PRINTABLE if options.language == "en" else "".join([*sentences, string.digits])
    wished = corpus.as_typed(options.characters or own) + corpus.as_typed(options.also)
    if options.target:
        target = [corpus.read_text(Path(options.target))]
        wished += "".join(char for char in dict.fromkeys(target[0]) if char.isprintable())
    else:
        target = corpus.usable(sentences, frozenset(corpus.PRINTABLE + wished + " "))
    return target, "".join(dict.fromkeys(char for char in wished if not char.isspace()))


def _write_line(text: str) -> list[Array]:
    """The strokes of a line in the hand that prints, see `sheet_pdf.Write`."""
    from handout.hand import library
    from handout.motion.trace import trace
    from handout.page_sizes import page
    from handout.writing.compose import compose
    from handout.writing.layout import Layout

    hand, rng = library.load("house-print"), np.random.default_rng(0)
    (manuscript,) = compose(text, hand, Layout(page("2000x60mm"), x_height=_X_HEIGHT, align="left"), rng, pages=1)
    origin = np.array([manuscript.lines[0].placed[0].strokes[0][:, 0].min(), manuscript.lines[0].baseline])
    scale = _TYPE_X_HEIGHT / _X_HEIGHT
    return [(stroke.xy - origin) * (scale, -scale) for stroke in trace(manuscript, hand, rng).strokes]
