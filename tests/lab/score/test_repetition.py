"""The repetition measure."""

import numpy as np

from handout_lab.score.repetition import components, repetition


def page(shapes):
    import cv2

    grey = np.full((60 * len(shapes) // 10 + 120, 700), 255, np.uint8)
    for i, points in enumerate(shapes):
        corner = np.array([20 + 65 * (i % 10), 20 + 60 * (i // 10)])
        cv2.polylines(grey, [np.int32(points * 40 + corner)], False, 0, 3)
    return grey


def scribbles(n, seed):
    rng = np.random.default_rng(seed)
    return [np.cumsum(rng.normal(0, 1, (8, 2)), axis=0) for _ in range(n)]


def normal(points):
    low, high = points.min(0), points.max(0)
    return (points - low) / (high - low)


def test_different_shapes_do_not_repeat_and_copies_do():
    shapes = [normal(s) for s in scribbles(30, 1)]
    assert repetition(page(shapes)) < 0.1
    assert repetition(page(shapes[:10] * 3)) > 0.9


def test_half_the_page_repeated():
    shapes = [normal(s) for s in scribbles(30, 2)]
    score = repetition(page([shapes[0]] * 15 + shapes[:15]))
    assert 0.4 < score < 0.7


def test_dots_do_not_count_and_an_empty_page_scores_nothing():
    grey = page([normal(s) for s in scribbles(10, 3)])
    before = len(components(grey))
    grey[-15:-10, 10:690:20] = 0
    grey[-15:-10, 11:691:20] = 0
    assert len(components(grey)) == before
    assert repetition(np.full((50, 50), 255, np.uint8)) == 0.0
