"""Lines are found again where they were drawn, straight, upright and with their own ink."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.scanning.text_lines import line_owners
from handout.tagging.line_space import ABOVE, X_HEIGHT, LineFrame, median_slant, straighten_line, strips

finite = st.floats(-3000, 3000)


@pytest.mark.slow
@given(
    st.tuples(st.floats(0, 3000), st.floats(-0.1, 0.1), st.floats(-1e-5, 1e-5)),
    st.floats(8, 90),
    st.floats(-0.3, 1.2),
    finite,
    finite,
    st.floats(-100, 100),
)
def test_there_and_back(baseline, x_height, slant, left, u, up):
    frame = LineFrame(baseline, x_height, slant, left)
    back = frame.to_line(frame.to_page(np.array([u]), np.array([up])))
    assert back[0] == pytest.approx([u, up], abs=1e-6)


def drawn(frame: LineFrame, strokes, shape=(500, 900), width=3):
    """Ink of strokes given in line space (u, up in x-heights)."""
    page = np.zeros(shape, np.uint8)
    for stroke in strokes:
        points = np.array(stroke, float) * X_HEIGHT
        xy = frame.to_page(points[:, 0], points[:, 1])
        cv2.polylines(page, [np.rint(xy * 8).astype(np.int32)], False, 255, width, cv2.LINE_AA, 3)
    return page > 100


STEMS = [[(2 * i, 0), (2 * i, 1)] for i in range(9)] + [[(2 * i, 1), (2 * i, 2.6)] for i in range(0, 9, 3)]


@pytest.mark.parametrize("slant", [-0.2, 0.0, 0.35, 0.6])
def test_a_sloping_slanted_line_becomes_straight_and_upright(slant):
    frame = LineFrame((300.0, 0.04, -2e-5), 31.0, slant, 120.0)
    ink = drawn(frame, STEMS)
    strip = straighten_line(ink, 0, frame)
    rows = np.flatnonzero((strip.image > 110).sum(axis=1) > 9)
    assert rows[-1] == pytest.approx(ABOVE, abs=3) and rows[0] <= ABOVE - X_HEIGHT + 3
    # every stem fills few columns, and stands where its u says
    columns = np.flatnonzero((strip.image[ABOVE - 18 : ABOVE - 2] > 110).all(axis=0))
    places = (strip.frame.left - frame.left) * frame.scale + columns
    assert np.abs(places / X_HEIGHT / 2 - np.rint(places / X_HEIGHT / 2)).max() < 0.08


def test_the_slant_of_a_page_is_found():
    frames = [LineFrame((y, 0.01), 30.0, 0.45, 100.0) for y in (150.0, 300.0)]
    mask = np.logical_or.reduce([drawn(frame, STEMS) for frame in frames])
    found = strips(mask, frames)
    assert [strip.frame.slant for strip in found] == pytest.approx([0.45, 0.45], abs=0.06)
    assert median_slant([strip.image for strip in found]) == pytest.approx(0.0, abs=0.06)


def test_touching_lines_are_parted_along_their_strokes():
    upper, lower = LineFrame((150.0,), 30.0, 0.0, 100.0), LineFrame((250.0,), 30.0, 0.0, 100.0)
    # a tail of the upper line runs down into the head of a letter of the lower one, beside an ascender that is free
    tail = [(3.0, 0.9), (3.0, -1.2), (3.4, -1.7)]
    page = drawn(upper, [[(0, 0.5), (8, 0.5)], tail]) | drawn(lower, [[(0, 0.5), (8, 0.5)], [(3.4, 0.5), (3.4, 1.65)]])
    own = line_owners(page, [upper, lower])
    count, _ = cv2.connectedComponents(page.astype(np.uint8))
    assert count == 2, "the two lines must touch for this test"
    assert own[int(upper.base(0.0) + 20), 190] == 0
    assert own[int(lower.base(0.0)) - 30, 202] == 1
    assert (own[page] >= 0).all() and (own[~page] == -1).all()
    assert set(np.unique(own[130:140][page[130:140]])) == {0}


def test_specks_go_to_the_nearest_line():
    frames = [LineFrame((150.0,), 30.0), LineFrame((300.0,), 30.0)]
    page = drawn(frames[0], [[(5, 0.2), (9, 0.6)], [(6, 1.6), (6.1, 1.6)]]) | drawn(frames[1], [[(5, 0.2), (9, 0.6)]])
    page |= drawn(frames[1], [[(6, 1.7), (6.1, 1.75)], [(8, -0.5), (8, -0.6)]])
    own = line_owners(page, frames)
    assert (own[90:112][page[90:112]] == 0).all()
    assert (own[200:][page[200:]] == 1).all()


def test_a_line_without_ink_is_empty():
    strip = straighten_line(np.zeros((50, 50), bool), 0, LineFrame((20.0,), 10.0))
    assert not strip.image.any()
