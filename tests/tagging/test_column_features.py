"""Columns are described by the directions of strokes around them, whatever the pen."""

import cv2
import numpy as np
import pytest

from handout.tagging.line_space import _OFFSETS, ABOVE, COUNT, DIRECTIONS, HEIGHT, STEP, describe

ROWS = COUNT // DIRECTIONS // len(_OFFSETS)


def line(points, pen=3, width=200):
    image = np.zeros((HEIGHT, width), np.uint8)
    cv2.polylines(image, [np.array(points, np.int32)], False, 255, pen)
    return image


def by_direction(image, x):
    """(4,) how much of each direction lies in the window around x."""
    row = describe(image)[x // STEP].reshape(DIRECTIONS, -1).astype(float)
    return (row**2).sum(axis=1)


@pytest.mark.parametrize(
    ("points", "strongest"),
    [
        ([(100, ABOVE - 20), (100, ABOVE)], 2),
        ([(90, ABOVE - 10), (110, ABOVE - 10)], 0),
        ([(90, ABOVE), (110, ABOVE - 20)], 3),
        ([(90, ABOVE - 20), (110, ABOVE)], 1),
    ],
)
def test_each_direction_has_its_bin(points, strongest):
    found = by_direction(line(points), 100)
    others = np.delete(found, strongest)
    assert found[strongest] > 2 * others.max()


def test_the_width_of_the_pen_hardly_counts():
    thin, thick = (describe(line([(100, 20), (100, 70)], pen))[50].astype(float) for pen in (2, 7))
    other = describe(line([(80, ABOVE), (120, ABOVE)], 2))[50].astype(float)
    assert np.linalg.norm(thin - thick) < 0.5 * np.linalg.norm(thin - other)


def test_what_is_far_away_is_not_seen():
    features = describe(line([(100, 20), (100, 70)]))
    assert features.shape == (100, COUNT) and features.dtype == np.uint8
    assert not features[:30].any() and not features[-30:].any() and features[50].any()


def test_moving_a_line_moves_its_description():
    left, right = describe(line([(60, 30), (80, 60)])), describe(line([(100, 30), (120, 60)]))
    assert np.array_equal(left[15:50], right[35:70])


def test_an_image_of_another_height_is_refused():
    with pytest.raises(ValueError, match=str(HEIGHT)):
        describe(np.zeros((HEIGHT - 1, 50), np.uint8))
