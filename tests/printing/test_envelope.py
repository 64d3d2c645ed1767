from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError
from handout.hand.library import load
from handout.page_sizes import page
from handout.printing.envelope import WINDOWS, address_layout, box_layout
from handout.values import Page
from handout.writing.compose import compose
from handout.writing.layout import ASCENT, DESCENT

ENVELOPES = ["DL", "C6", "C5", "number-10"]


@pytest.mark.parametrize("name", ENVELOPES)
def test_the_block_stands_where_people_put_it(name):
    sheet = page(name)
    layout = address_layout(sheet, 4, 16)
    top, right, bottom, left = layout.margin
    assert layout.x_height == pytest.approx(3.2)
    assert 0.5 * sheet.width < left < 0.56 * sheet.width
    centre = (top + sheet.height - bottom) / 2
    assert 0.5 * sheet.height < centre < 0.65 * sheet.height
    assert top >= 39 and bottom >= 14 and right >= 9, "clear of stamps and bar code"
    assert layout.fit


@pytest.mark.parametrize("name", ENVELOPES)
def test_a_long_line_moves_the_block_before_it_shrinks_it(name):
    sheet = page(name)
    usual, longer, longest = (address_layout(sheet, 4, n) for n in (12, 34, 60))
    assert longer.margin[3] < usual.margin[3]
    assert longest.x_height < usual.x_height and longest.margin[3] >= 0.3 * sheet.width - 1e-9
    assert longest.width >= 60 * longest.x_height or longest.x_height == pytest.approx(1.8)


@given(
    width=st.floats(20, 400),
    height=st.floats(20, 400),
    lines=st.integers(0, 40),
    longest=st.integers(0, 200),
)
def test_every_envelope_has_a_layout_on_it(width, height, lines, longest):
    layout = address_layout(Page(width, height), lines, longest)
    assert min(layout.margin) >= 0
    assert layout.width >= 5 and layout.height >= 5


@given(st.sampled_from(ENVELOPES), st.integers(1, 7), st.integers(1, 30))
def test_the_room_is_for_as_many_lines_and_no_more(name, lines, longest):
    layout = address_layout(page(name), lines, longest)
    used = (ASCENT + DESCENT) * layout.x_height + (lines - 1) * layout.line_spacing
    assert used <= layout.height + 1e-9 < used + layout.line_spacing


def test_the_size_can_be_given():
    assert address_layout(page("DL"), 4, 60, x_height=2.5).x_height == 2.5
    with pytest.raises(InputError):
        address_layout(page("DL"), 4, 20, x_height=200)


@pytest.mark.parametrize("name", WINDOWS)
def test_four_lines_stand_in_every_window_above_the_letter(name):
    window = WINDOWS[name]
    sheet, (x, y, width, height) = page(window.page), window.box
    top, right, bottom, left = box_layout(sheet, window.box, 4, 24).margin
    assert left >= x and top >= y and sheet.width - right <= x + width + 0.01 <= sheet.width
    assert sheet.height - bottom <= y + height + 0.01 < window.below


def test_a_long_line_is_shrunk_rather_than_broken():
    def written(lines, unbroken, seed=0):
        layout = address_layout(page("220x110mm"), len(lines), 12)  # a hand is broader than is reckoned
        layout, text = replace(layout, unbroken=unbroken), "\n".join(lines)
        (sheet,) = compose(text, load("house-joined"), layout, np.random.default_rng(seed))
        return [line.text for line in sheet.lines], sheet.x_height / layout.x_height

    lines, broken = ["Marjorie Mommsen", "418 Wammow Road", "Apt 3B", "Mommbrimmwoommerham, MA 02138", "USA"], 0
    for seed in range(8):
        (free, size), (whole, smaller) = written(lines, False, seed), written(lines, True, seed)
        assert whole == lines and 0.7 < smaller <= size
        broken += free != lines
    assert broken
    longer = [*lines[:3], "Commbrimmge upon Wammowwater under Mommsbury Hill, MA 02138"]
    assert written(longer, True) == written(longer, False), "unbroken it would be too small to be read easily"
