"""The geometry of the sheets, and the PDF that has it."""

import io
import re

import numpy as np
import pikepdf
import pytest

from handout.errors import DoesNotFit, InputError
from handout.prompting import prompt_pages, sheet_pdf
from handout.prompting.prompt_pages import Prompt
from handout.prompting.sheet_layout import PAPERS, SheetLayout, corner_of_mark, mark_cells, mark_number, paper_of_name

POINT = 25.4 / 72
A4, LETTER = PAPERS


def overlap(a, b):
    return bool((np.minimum(a[2:], b[2:]) > np.maximum(a[:2], b[:2]) + 1e-9).all())


@pytest.mark.parametrize("page", PAPERS)
@pytest.mark.parametrize("pitch", [6.0, 8.5, 10.0, 20.0])
def test_nothing_lies_over_anything_else(page, pitch):
    layout = SheetLayout(page, pitch)
    boxes = [*layout.masks, *layout.bands]
    assert not any(overlap(a, b) for i, a in enumerate(boxes) for b in boxes[:i])
    room = np.array([[layout.left, y - 0.53 * pitch, layout.right, y + 0.25 * pitch] for y in layout.baselines])
    assert not any(overlap(line, box) for line in room for box in layout.masks)
    every = np.vstack(boxes)
    assert every.min() > 3 and (every[:, 2:] < [page.width - 3, page.height - 3]).all()
    assert len(layout.baselines) == layout.lines >= 10
    assert np.allclose(np.diff(layout.baselines), pitch)
    assert (layout.bands[:, 3] < layout.baselines).all()
    assert (layout.bands[1:, 1] > layout.baselines[:-1]).all()


def test_about_two_hundred_words_fit():
    assert SheetLayout(A4).lines == 23 and SheetLayout(A4).width() == 51
    assert SheetLayout(LETTER).lines == 21 and SheetLayout(LETTER).width() == 53
    assert SheetLayout(A4, 8.0).width(2.5) == 68


def test_bounds():
    with pytest.raises(InputError, match="5 mm is outside 6 to 20 mm"):
        SheetLayout(A4, 5.0)
    with pytest.raises(InputError, match="makes 5 letters a line"):
        SheetLayout(A4).width(30.0)
    with pytest.raises(InputError, match="A4 or letter"):
        paper_of_name("A5")
    assert paper_of_name("LETTER") is LETTER


def test_marks_are_all_different_and_say_where_they_are():
    numbers = [mark_number(page, corner) for page in PAPERS for corner in range(4)]
    assert [corner_of_mark(n) for n in numbers] == [(page, c) for page in PAPERS for c in range(4)]
    assert corner_of_mark(8) is None and corner_of_mark(-1) is None
    cells = [mark_cells(number) for number in numbers]
    assert all(cell[0].all() and cell[:, 0].all() and cell[-1].all() and cell[:, -1].all() for cell in cells)
    turned = [np.rot90(cell, k).tobytes() for cell in cells for k in range(4)]
    assert len(set(turned)) == len(turned)


@pytest.mark.slow
def test_the_same_prompt_gives_the_same_bytes(prompt, pdf):
    again = sheet_pdf.to_pdf(prompt, SheetLayout(A4))
    assert again == pdf
    assert sheet_pdf.to_pdf(prompt, SheetLayout(A4, 9.9)) != pdf


def operations(pdf, number):
    with pikepdf.open(io.BytesIO(pdf)) as document:
        return [
            (str(operator), list(operands))
            for operands, operator in pikepdf.parse_content_stream(document.pages[number])
        ]


def test_a_page_has_its_size_lines_and_words(prompt, pdf):
    layout = SheetLayout(A4)
    with pikepdf.open(io.BytesIO(pdf)) as document:
        assert len(document.pages) == 2
        size = [float(x) * POINT for x in document.pages[0].MediaBox]
        assert np.allclose(size, [0, 0, 210, 297], atol=0.01)
        assert document.Root.ViewerPreferences.PrintScaling == "/None"
        assert prompt.pages and str(document.docinfo["/Subject"]).startswith("Prompt ")
    heights = [297 - float(v[1]) * POINT for name, v in operations(pdf, 0) if name == "m"]
    assert np.allclose(sorted(heights)[-layout.lines :], layout.baselines, atol=0.01)


def test_nothing_printed_where_one_writes_shows_in_the_red_channel(pdf):
    for number in range(2):
        colour, painted = None, set()
        for name, values in operations(pdf, number):
            if name in ("rg", "RG"):
                colour = tuple(float(v) for v in values)
            elif name == "Tj":
                painted.add(("words", colour))
            elif name == "S":
                painted.add(("lines", colour))
            elif name in ("f", "f*"):
                painted.add(("cells", colour))
        assert painted == {("words", sheet_pdf.WORDS), ("lines", sheet_pdf.RULE), ("cells", (0, 0, 0))}
    assert sheet_pdf.WORDS[0] == sheet_pdf.RULE[0] == 1.0


@pytest.mark.slow
def test_plain_sheets_have_words_beside_and_lines_to_lay_under(prompt):
    layout = SheetLayout(LETTER, 10.0, printed=False)
    small = Prompt(tuple(page[: layout.lines] for page in prompt.pages), ())
    pdf = sheet_pdf.to_pdf(small, layout)
    with pikepdf.open(io.BytesIO(pdf)) as document:
        assert len(document.pages) == 5
    kinds = [[name for name, _ in operations(pdf, number)] for number in range(5)]
    assert [names.count("S") for names in kinds] == [0, 0, 0, 0, layout.lines + 4]
    assert [names.count("Tj") > layout.lines for names in kinds] == [False, True, False, True, False]
    assert layout.bands.shape == (0, 4)


def test_characters_that_cannot_be_printed_are_named():
    prompt = Prompt((("Жук Ω ŵ",),), ())
    with pytest.raises(InputError, match="not with Ж к у"):
        sheet_pdf.to_pdf(prompt, SheetLayout(A4))


def test_more_than_the_codes_hold_is_refused():
    rng = np.random.default_rng(1)
    noise = tuple("".join(map(chr, rng.integers(33, 127, 120))) for _ in range(38))
    with pytest.raises(DoesNotFit, match=re.escape("use a wider ruling")):
        sheet_pdf.to_pdf(Prompt((noise,), ()), SheetLayout(A4, 6.0))


@pytest.mark.slow
def test_a_narrow_ruling_full_of_english_fits_its_codes():
    from handout.prompting import corpus, sentence_choice

    layout = SheetLayout(A4, 6.0)
    target = sentence_choice.frequencies(corpus.shipped_sentences())
    prompt = prompt_pages.prompt(corpus.shipped_sentences(), target, pages=1, lines=layout.lines, width=layout.width())
    assert prompt.words > 450
    assert len(sheet_pdf.to_pdf(prompt, layout)) > 10_000
