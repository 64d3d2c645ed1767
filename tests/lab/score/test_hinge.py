"""Hinge and run lengths."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout_lab.score.hinge import BINS, chi_square, hinge, legs
from handout_lab.score.run_lengths import KINDS, LONGEST, run_distance, runs, spans


def scribble(seed, slant=0.0, thickness=4, size=500):
    rng = np.random.default_rng(seed)
    mask = np.zeros((size, size), np.uint8)
    for _ in range(30):
        points = rng.uniform(0, 40, (6, 2)) @ np.array([[1, 0], [slant, 1]]) + rng.uniform(40, size - 90, 2)
        cv2.polylines(mask, [np.int32(points)], False, 1, thickness)
    return mask.astype(bool)


def test_the_same_page_is_at_no_distance_and_order_does_not_matter():
    a, b = scribble(1), scribble(2, slant=-0.5, thickness=7)
    for measure, far in ((hinge, chi_square), (runs, run_distance)):
        assert far(measure(a), measure(a)) == 0
        assert far(measure(a), measure(b)) == far(measure(b), measure(a)) > 0.02


def test_one_way_of_writing_is_nearer_to_itself_than_to_another():
    upright, again, slanted = (hinge(scribble(seed, slant)) for seed, slant in ((1, 0.0), (2, 0.0), (3, -0.9)))
    assert chi_square(upright, again) < 0.6 * chi_square(upright, slanted)
    thin, other, thick = (runs(scribble(seed, 0, t)) for seed, t in ((1, 4), (2, 4), (3, 8)))
    assert run_distance(thin, other) < 0.4 * run_distance(thin, thick)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 60), st.integers(0, 60))
def test_moving_the_ink_changes_nothing(dx, dy):
    mask = scribble(4, size=300)
    moved = np.zeros((400, 400), dtype=bool)
    moved[dy : dy + 300, dx : dx + 300] = mask
    assert np.array_equal(hinge(moved), hinge(mask))
    assert np.array_equal(runs(moved), runs(mask))


def test_a_half_turn_turns_the_hinge():
    mask = scribble(5)
    turned = np.roll(hinge(mask), (BINS // 2, BINS // 2), axis=(0, 1))
    assert chi_square(hinge(mask[::-1, ::-1]), turned) < 0.003


def test_a_straight_bar_has_straight_legs():
    mask = np.zeros((60, 400), dtype=bool)
    mask[20:40, 10:390] = True
    histogram = hinge(mask)
    assert histogram.sum() == pytest.approx(1)
    # along both long edges one leg points right where the other points left
    assert histogram[0, BINS // 2] + histogram[BINS // 2, 0] > 0.85


def test_short_contours_and_empty_pages_give_nothing():
    mask = np.zeros((40, 40), dtype=bool)
    assert not hinge(mask).any() and not runs(mask).any()
    mask[10:12, 10:12] = True
    assert not hinge(mask).any()
    assert len(legs(mask, 7)[0]) == 0


def test_lengths_of_runs_are_those_that_were_drawn():
    mask = np.zeros((9, 40), dtype=bool)
    mask[2:7, 3:8] = True
    mask[2:7, 18:23] = True
    found = dict(zip(KINDS, runs(mask), strict=True))
    assert found["ink across"][5 - 1] == found["ink down"][5 - 1] == found["paper across"][10 - 1] == 1
    assert not found["paper down"].any()


def test_long_gaps_do_not_count():
    mask = np.zeros((5, 200), dtype=bool)
    mask[1:4, [5, 5 + LONGEST + 1]] = True
    assert runs(mask)[2, LONGEST - 1] == 1
    mask = np.zeros((5, 200), dtype=bool)
    mask[1:4, [5, 5 + LONGEST + 2]] = True
    assert not runs(mask)[2].any()


@settings(max_examples=30, deadline=None)
@given(st.lists(st.lists(st.booleans(), min_size=7, max_size=7), min_size=1, max_size=6))
def test_spans_cover_the_ink_and_nothing_else(rows):
    mask = np.array(rows)
    again = np.zeros_like(mask)
    for row, begin, end in zip(*spans(mask), strict=True):
        assert end > begin and not again[row, begin:end].any()
        again[row, begin:end] = True
    assert np.array_equal(again, mask)
