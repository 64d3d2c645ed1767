"""A prompt on sheets, as a PDF and as drawn pages: made once for all tests of the room."""

import pytest
import scans

from handout.prompting import corpus, counts, fiducials, pages, printing
from handout.prompting.sheet import SheetLayout


@pytest.fixture(scope="session")
def prompt():
    layout = SheetLayout(fiducials.paper("A4"))
    allowed = frozenset(corpus.PRINTABLE + "é ")
    target = counts.frequencies(corpus.usable(corpus.shipped(), allowed))
    characters = corpus.PRINTABLE + "éČ"
    return pages.prompt(corpus.shipped(), target, characters, pages=2, lines=layout.lines, width=layout.width())


@pytest.fixture(scope="session")
def pdf(prompt):
    return printing.to_pdf(prompt, SheetLayout(fiducials.paper("A4")))


@pytest.fixture(scope="session")
def drawn(pdf):
    """The second page to write on, at 600 dpi."""
    return scans.drawn(pdf, 1)
