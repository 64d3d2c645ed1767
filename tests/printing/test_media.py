import re

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout import page_sizes
from handout.inking.device_pixels import DevicePixels
from handout.printing import media
from handout.profiles import Envelope, Length, Margins, Printer
from handout.values import Page

SHORT = Printer(kind="printer", title="P", dpi=300)


@pytest.mark.parametrize(
    ("name", "standard"),
    [
        ("dl", "iso_dl_110x220mm"), ("c6", "iso_c6_114x162mm"), ("c5", "iso_c5_162x229mm"),
        ("number-10", "na_number-10_4.125x9.5in"), ("a4", "iso_a4_210x297mm"), ("a5", "iso_a5_148x210mm"),
        ("a6", "iso_a6_105x148mm"), ("letter", "na_letter_8.5x11in"),
    ],
)  # fmt: skip
def test_every_page_has_its_standard_name_when_fed_short_side_first(name, standard):
    page = page_sizes.page(name)
    turn = media.turn_for(page, SHORT)
    assert bool(turn) == (page.width > page.height)
    assert media.name(media.turned_page(page, turn)) == standard


def test_other_sheets_are_custom_sizes():
    assert media.name(Page(100, 150.5)) == "Custom.100x150.5mm"
    long = msgspec.structs.replace(SHORT, feed="long")
    dl = page_sizes.page("dl")
    assert media.turn_for(dl, long) == "" and media.name(dl) == "Custom.220x110mm"
    assert media.turn_for(page_sizes.page("a4"), long) == "left"


@pytest.mark.parametrize("sheet", page_sizes._SIZES, ids=lambda size: size.media)
def test_names_say_the_size(sheet):
    """A name of PWG 5101.1 ends with the sides in inches or mm, the shorter first."""
    name, across, along = sheet[:3]
    sides, unit = re.search(r"_([\d.]+x[\d.]+)(mm|in)$", name).groups()
    stated = [float(side) * (25.4 if unit == "in" else 1) for side in sides.split("x")]
    assert [across, along] == pytest.approx(stated, abs=1e-6) and across <= along
    assert media.name(Page(across, along)) == name


def test_no_two_sheets_can_be_taken_for_each_other():
    sizes = np.array([(size.short, size.long) for size in page_sizes._SIZES])
    apart = np.abs(sizes[:, None] - sizes[None]).max(axis=2)
    assert apart[~np.eye(len(sizes), dtype=bool)].min() > 2 * page_sizes._SAME


@pytest.mark.parametrize(
    ("name", "is_one"), [("DL", True), ("c6", True), ("number-10", True), ("a4", False), ("a6", False)]
)
def test_envelopes_are_known_by_their_size_either_way_up(name, is_one):
    page = page_sizes.page(name.lower())
    assert media.is_envelope(page) == media.is_envelope(Page(page.height, page.width)) == is_one


def test_envelopes_have_margins_and_a_tray_of_their_own():
    profile = msgspec.structs.replace(
        SHORT, sources=("main", "rear"), source="main", envelope=Envelope(margins=Margins(top=Length(9)), source="rear")
    )
    fed = media.printer_for(page_sizes.page("dl"), profile)
    assert (fed.source, fed.margins.top) == ("rear", 9) and media.printer_for(page_sizes.page("a4"), profile) is profile
    partly = msgspec.structs.replace(profile, envelope=Envelope(source="rear"))
    assert media.printer_for(page_sizes.page("dl"), partly).margins == profile.margins


@given(
    st.sampled_from(["left", "right"]),
    st.tuples(*[st.floats(0, 90)] * 2).map(sorted),
    st.tuples(*[st.floats(0, 90)] * 2).map(sorted),
)
def test_turning_there_and_back(turn, across, down):
    bounds = (across[0], down[0], across[1], down[1])
    page = Page(150, 100)
    back = {"left": "right", "right": "left"}[turn]
    sheet = media.turned_page(page, turn)
    there = media.turned_bounds(bounds, page, turn)
    assert media.turned_bounds(there, sheet, back) == pytest.approx(bounds)
    assert 0 <= there[0] <= there[2] <= sheet.width and 0 <= there[1] <= there[3] <= sheet.height


def test_a_quarter_turn_to_the_left_brings_the_right_edge_to_the_top():
    page = Page(100, 50)
    rgb = np.zeros((4, 6, 3), dtype=np.uint8)
    rgb[0, 5] = 1  # the pixel at the top right
    pixel = 25.4 / 254
    turned = media.turned_pixels(DevicePixels(rgb, 254, (100 - 6 * pixel, 0)), page, "left")
    assert turned.rgb.shape == (6, 4, 3) and turned.rgb[0, 0, 2] == 1 and turned.rgb[..., 2].sum() == 1
    assert turned.origin == pytest.approx((0, 0))
    other = media.turned_pixels(DevicePixels(rgb, 254, (100 - 6 * pixel, 0)), page, "right")
    assert other.rgb[5, 3, 2] == 1
    assert other.origin == pytest.approx((50 - 4 * pixel, 100 - 6 * pixel))


def test_ink_near_an_edge_is_told_with_the_worst_edge():
    sheet, edge = Page(110, 220), Length(3)
    margins = Margins(top=edge, right=edge, bottom=Length(20), left=edge)
    assert media.margin_warning((3, 3, 107, 200), sheet, margins, "P") is None
    told = media.margin_warning((2.5, 40, 90, 205), sheet, margins, "P")
    assert told and "15.0 mm of the trailing edge" in told and "20 mm" in told
    beyond = media.margin_warning((-2, 40, 90, 100), sheet, margins, "P")
    assert beyond and "2.0 mm beyond the left edge" in beyond


@pytest.mark.parametrize(
    ("changes", "wanted"),
    [
        ({"turn": "left"}, (4.0, 1.0, 2.0, 3.0)),
        ({"turn": "right"}, (2.0, 3.0, 4.0, 1.0)),
        ({"feed": "long"}, (1.0, 2.0, 3.0, 4.0)),
        ({"feed": "long", "flap": "trailing"}, (3.0, 4.0, 1.0, 2.0)),
    ],
)
def test_what_a_printer_does_not_reach_of_a_page_as_it_is_read(changes, wanted):
    """What is just inside these margins is inside those of the sheet as it is fed, and what is on them is not."""
    kept = Margins(top=Length(1), right=Length(2), bottom=Length(3), left=Length(4))
    profile = msgspec.structs.replace(SHORT, margins=kept, **changes)
    page = page_sizes.page("DL")
    top, right, bottom, left = media.page_margins(page, profile)
    assert (top, right, bottom, left) == wanted
    feeding = media.Feeding.for_page(page, profile)
    inside = (left, top, page.width - right, page.height - bottom)
    assert media.margin_warning(feeding.bounds(inside), feeding.sheet, kept, "P") is None
    for at in range(4):
        out = list(inside)
        out[at] += 0.5 if at > 1 else -0.5
        assert media.margin_warning(feeding.bounds(tuple(out)), feeding.sheet, kept, "P") is not None
