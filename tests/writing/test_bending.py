"""A glyph written again is bent, and never further than its author's own go."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.writing.bending import bend, measure, unbent


def bent(manner, number, seed, variation):
    height = float(manner.forms.centre[number, 1])
    rng = np.random.default_rng(seed)
    return bend(manner.forms[number], number, manner.spread, height, rng.standard_normal(3), rng, variation)


def test_no_variation_is_no_bend(small_manner):
    for number in range(len(small_manner.forms)):
        xy = small_manner.forms[number].xy
        assert np.array_equal(bent(small_manner, number, 1, 0)(xy), xy)
    assert np.array_equal(unbent()(xy), xy)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(number=st.integers(0, 40), seed=st.integers(0, 10**6), variation=st.floats(0.1, 20))
def test_a_bend_stays_within_what_the_letter_has(small_manner, number, seed, variation):
    form, spread = small_manner.forms[number], small_manner.spread
    size = measure(bent(small_manner, number, seed, variation)(form.xy), form.radius, spread.x_height)
    assert (size >= spread.low[number] - 1e-6).all() and (size <= spread.high[number] + 1e-6).all()


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(number=st.integers(0, 40), seed=st.integers(0, 10**6), variation=st.floats(0.1, 20))
def test_a_bend_is_smooth_and_never_folds(small_manner, number, seed, variation):
    made = bent(small_manner, number, seed, variation)
    u, v = np.meshgrid(np.linspace(-0.8, 0.8, 25), np.linspace(-0.8, 0.8, 25))
    xy, step = np.column_stack([u.ravel(), v.ravel()]), 1e-5
    right, up = ((made(xy + d) - made(xy - d)) / (2 * step) for d in ([step, 0.0], [0.0, step]))
    # nothing is squeezed to less than half at usual variation, and nothing turned over at any
    least = 0.45 if variation <= 1 else 0.1
    assert (right[:, 0] * up[:, 1] - right[:, 1] * up[:, 0]).min() > least
    # directions change no faster than a wave longer than two small letters lets them
    ahead = (made(xy + np.array([0.01 + step, 0.0])) - made(xy + np.array([0.01 - step, 0.0]))) / (2 * step)
    assert np.abs(ahead - right).max() < 0.06


def test_the_baseline_stays_where_it_is(small_manner):
    """The affine part turns about the foot of the centre, so that a letter does not leave its line."""
    for number in range(0, 40, 5):
        made = bent(small_manner, number, 3, 1.0)
        foot = np.array([[0.0, -small_manner.forms.centre[number, 1]]])
        reach = np.abs(made.pushes).sum() + 1e-9
        assert np.abs(made(foot) - foot).max() <= reach < 0.05


def test_bends_differ_and_grow(small_manner):
    moved = {}
    for variation in (0.3, 1.0):
        away = [
            np.abs(
                bent(small_manner, number, seed, variation)(small_manner.forms[number].xy)
                - small_manner.forms[number].xy
            ).max()
            for number in range(40)
            for seed in range(3)
        ]
        moved[variation] = np.median(away)
    assert 0 < moved[0.3] < moved[1.0] < 0.1
    xy = small_manner.forms[3].xy
    assert not np.allclose(bent(small_manner, 3, 1, 1)(xy), bent(small_manner, 3, 2, 1)(xy), atol=1e-4)


def test_ranges_are_the_author_s(small_hand, small_manner):
    spread = small_manner.spread
    for number, glyph in enumerate(small_hand.glyphs):
        own = spread.size[small_hand.numbers_of_letter(glyph.letter)]
        assert (spread.low[number] <= spread.size[number]).all() and (spread.size[number] <= spread.high[number]).all()
        if len(own) >= 5:
            assert (spread.low[number] >= own.min(axis=0) - 1e-9).all()
            assert (spread.high[number] <= own.max(axis=0) + 1e-9).all()


def test_sizes_are_upright():
    x, y = np.meshgrid(np.linspace(0, 0.2, 9), np.linspace(0, 0.4, 17))
    box = np.column_stack([x.ravel(), y.ravel()])
    leaning = box + box[:, 1:] * [0.5, 0.0]
    size = measure(leaning, np.zeros(len(box)), 0.3)
    assert size == pytest.approx([np.log(0.2), np.log(0.4), np.log(0.5), 0.5])
    assert measure(leaning * 0.2, np.full(len(box), 0.001), 0.3)[3] == 0, "a dot has no slant"
