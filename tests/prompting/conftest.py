"""A prompt on sheets, as a PDF and as drawn pages: made once for all tests of the room."""

import pytest
import scans

from handout.prompting import corpus, prompt_pages, sentence_choice, sheet_pdf
from handout.prompting.sheet_layout import SheetLayout, paper_of_name


@pytest.fixture(scope="session")
def prompt():
    layout = SheetLayout(paper_of_name("A4"))
    allowed = frozenset(corpus.PRINTABLE + "é ")
    target = sentence_choice.frequencies(corpus.usable(corpus.shipped_sentences(), allowed))
    characters = corpus.PRINTABLE + "éČ"
    return prompt_pages.prompt(
        corpus.shipped_sentences(), target, characters, pages=2, lines=layout.lines, width=layout.width()
    )


@pytest.fixture(scope="session")
def pdf(prompt):
    return sheet_pdf.to_pdf(prompt, SheetLayout(paper_of_name("A4")))


@pytest.fixture(scope="session")
def drawn(pdf):
    """The second page to write on, at 300 dpi."""
    return scans.drawn(pdf, 1)
