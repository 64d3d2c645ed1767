"""Pixels as they are sent to a printer: what of a page is not white, and where it lies."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.inking.device_pixels import DevicePixels
from handout.printing.media import turned_pixels
from handout.values import Page

SIDES = st.integers(1, 9)


@st.composite
def pages(draw):
    """A white page with one dark rectangle, at 25.4 dpi, so that a pixel is a millimetre."""
    height, width = draw(SIDES), draw(SIDES)
    rgb = np.full((height, width, 3), 255, np.uint8)
    top, left = draw(st.integers(0, height - 1)), draw(st.integers(0, width - 1))
    rgb[
        top : draw(st.integers(top + 1, height)), left : draw(st.integers(left + 1, width)), draw(st.integers(0, 2))
    ] = 7
    return DevicePixels(rgb, 25.4, (draw(st.integers(-3, 3)), draw(st.integers(-3, 3))))


def laid(pixels, side=30):
    """The pixels where they lie on a sheet with room on all sides."""
    sheet = np.full((side, side, 3), 255, np.uint8)
    x, y = (round(at) + 10 for at in pixels.origin)
    sheet[y : y + pixels.rgb.shape[0], x : x + pixels.rgb.shape[1]] = pixels.rgb
    return sheet


@given(pages())
def test_what_is_trimmed_lies_where_it_lay(pixels):
    trimmed = pixels.trim_white()
    assert (laid(trimmed) == laid(pixels)).all()
    assert (trimmed.rgb[[0, -1]] < 255).any(axis=(1, 2)).all() and (trimmed.rgb[:, [0, -1]] < 255).any(
        axis=(0, 2)
    ).all()


@pytest.mark.parametrize("turn", ["left", "right"])
@given(pages())
def test_a_page_may_be_trimmed_before_it_is_turned_or_behind(turn, pixels):
    sheet = Page(10, 9, "")
    before, behind = turned_pixels(pixels.trim_white(), sheet, turn), turned_pixels(pixels, sheet, turn).trim_white()
    assert np.allclose(before.origin, behind.origin)
    assert (before.rgb == behind.rgb).all()


def test_white_is_left_as_it_is():
    white = DevicePixels(np.full((3, 4, 3), 255, np.uint8), 300)
    assert white.trim_white() is white and white.crop_white() is None
