"""Direction and width of the ink together."""

import cv2
import numpy as np
import pytest

from handout_lab.score.hinge import chi_square
from handout_lab.score.quill import DIRECTIONS, WIDEST, quill, quill_counts, widths


def bar(angle, thickness):
    """A straight bar, drawn at eight times the size so that its width is exact."""
    big = np.zeros((3200, 3200), np.uint8)
    run = 1200 * np.array([np.cos(angle), np.sin(angle)])
    aside = 4 * thickness * np.array([-np.sin(angle), np.cos(angle)])
    corners = 1600 + np.array([run + aside, run - aside, -run - aside, -run + aside])
    cv2.fillPoly(big, [np.int32(np.rint(corners))], 255)
    return cv2.resize(big, (400, 400), interpolation=cv2.INTER_AREA) > 127


@pytest.mark.parametrize("degrees", [0, 30, 45, 90, 120, 165])
@pytest.mark.parametrize("thickness", [4, 9])
def test_a_bar_lies_where_its_direction_and_width_say(degrees, thickness):
    mask = bar(np.radians(degrees), thickness)
    found = quill(mask)
    assert found.sum() == pytest.approx(1)
    turn = np.exp(2j * np.pi * np.arange(DIRECTIONS) / DIRECTIONS)
    mean = np.degrees(np.angle((found.sum(axis=1) * turn).sum())) / 2 % 180
    assert min(abs(mean - degrees), 180 - abs(mean - degrees)) < 3
    assert (found.sum(axis=0) @ np.arange(1, WIDEST + 1)) == pytest.approx(mask.sum() / 300, abs=0.5)


def test_a_pen_held_broad_is_told_from_a_round_one_of_the_same_mean_width():
    def scribble(nib, seed):
        rng = np.random.default_rng(seed)
        mask = np.zeros((900, 900), np.uint8)
        for _ in range(60):
            cv2.polylines(mask, [np.int32(rng.uniform(30, 870, (3, 2)))], False, 1, 1)
        return cv2.dilate(mask, nib) > 0

    round_, broad = np.ones((5, 5), np.uint8), np.ones((1, 9), np.uint8)
    same = chi_square(quill(scribble(round_, 1)), quill(scribble(round_, 2)))
    other = chi_square(quill(scribble(round_, 1)), quill(scribble(broad, 2)))
    assert 5 * same < other > 0.3


def test_width_is_counted_to_the_paper_by_brute_force():
    mask = bar(np.radians(20), 7)
    y, x = 200, int(np.flatnonzero(mask[200])[0])
    along = np.array([[np.cos(np.radians(20)), np.sin(np.radians(20))]])
    (found,) = widths(mask, np.array([[x, y]], dtype=float), -along)
    (back,) = widths(mask, np.array([[x, y]], dtype=float), along)
    assert max(found, back) == pytest.approx(7, abs=1.1)


def test_moving_the_ink_changes_nothing_and_no_ink_is_nothing():
    mask = bar(0.4, 6)
    assert np.allclose(quill(np.pad(mask, ((3, 9), (14, 2)))), quill(mask))
    assert not quill(np.zeros((40, 40), dtype=bool)).any()
    assert not quill(np.ones((90, 90), dtype=bool))[:, : WIDEST - 1].any()  # a blot has no width


def test_counts_of_two_pieces_add_up():
    one, two = bar(0.0, 5), bar(1.0, 8)
    together = np.concatenate([one, two], axis=1)
    assert np.allclose(quill_counts(together), quill_counts(one) + quill_counts(two))
