"""The distributions of variation."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.hand.library import load
from handout.values import Glyph
from handout.writing.drawn_words import LEAST_ROOM, WordWriter, change_of_room, slur_stroke
from handout.writing.text import Letter
from handout.writing.variation import LETTER_MEMORY, TREMOR, USUAL, Drift, tremor, warp


@settings(max_examples=20, deadline=None)
@given(st.floats(0.01, 2.0), st.floats(0.0, 0.95), st.integers(0, 1000))
def test_drift_has_its_deviation_and_its_memory(sd, memory, seed):
    drift = Drift(sd, memory, rng := np.random.default_rng(seed))
    values = np.array([drift.draw_next(rng) for _ in range(6000)])
    assert abs(values.std() / sd - 1) < 0.3
    assert abs(np.corrcoef(values[1:], values[:-1])[0, 1] - memory) < 0.1


def test_a_walk_is_correlated_as_wide_as_it_says_and_goes_on():
    rng = np.random.default_rng(0)
    drifts = [Drift(0.5, LETTER_MEMORY, rng) for _ in range(4000)]
    walks = np.array([np.concatenate([drift.walk(rng, 6), drift.walk(rng, 6)]) for drift in drifts])
    assert np.allclose(walks.std(axis=0), 0.5, rtol=0.06)
    for at in (3, 5):  # within a walk, and from one to the next
        assert abs(np.corrcoef(walks[:, at], walks[:, at + 1])[0, 1] - LETTER_MEMORY) < 0.05


def test_heights_wander_on_from_word_to_word():
    hand, rng = load("house-print"), np.random.default_rng(2)
    writer, form = WordWriter(hand, rng, 1.0), hand.glyphs["o"][0]
    words = [writer.word([form] * 4, [Letter("o", (), i) for i in range(4)], rng) for _ in range(1500)]
    inked = [[np.vstack(glyph.strokes)[:, 1] for glyph in word.glyphs] for word in words]
    heights = np.array([np.mean([np.ptp(y) for y in letters]) for letters in inked])
    feet = np.array([np.mean([y.min() for y in letters]) for letters in inked])
    for of_words, least in ((heights, 0.45), (feet, 0.75)):  # -.04 to .03 where each word begins anew
        assert np.corrcoef(of_words[1:], of_words[:-1])[0, 1] > least


def test_a_warp_is_smooth_and_of_its_size():
    rng = np.random.default_rng(0)
    places = rng.uniform(0, 10, (400, 2))
    moved = np.array([warp(places, rng, 0.03, 1.6, 3.4) for _ in range(300)])
    assert abs(moved.std() / 0.03 - 1) < 0.1
    near = warp(np.array([[1.0, 1.0], [1.01, 1.0]]), rng, 0.03, 1.6, 3.4)
    assert np.abs(near[0] - near[1]).max() < 0.003


def test_a_tremor_is_of_its_size_slow_and_at_rest_at_both_ends():
    rng, rate = np.random.default_rng(0), 140.0
    shaken = np.array([tremor(rng, 700, rate, 0.02) for _ in range(40)])
    assert np.abs(shaken[:, [0, -1]]).max() == 0
    assert abs(shaken[:, 100:-100].std() / 0.02 - 1) < 0.06
    power = np.square(np.abs(np.fft.rfft(shaken, axis=1))).mean(axis=(0, 2))
    hertz = np.fft.rfftfreq(700, 1 / rate)
    assert power[hertz > 3 * TREMOR].sum() < 1e-3 * power.sum()
    assert power[(hertz > 0.7 * TREMOR) & (hertz < TREMOR)].sum() > 0.1 * power.sum()
    assert not tremor(rng, 50, rate, 0.0).any()
    assert tremor(rng, 1, rate, 0.02).shape == (1, 2)


def test_scaling_scales_everything():
    assert all(value == 0 for value in astuple(USUAL.scale_by(0.0)))
    assert astuple(USUAL.scale_by(2.0)) == tuple(2 * value for value in astuple(USUAL))


@given(st.integers(1, 12), st.floats(0.0, 0.3), st.integers(0, 1000))
def test_slurring_keeps_ends_and_straight_ways_and_shrinks_the_rest(n, share, seed):
    stroke = np.random.default_rng(seed).normal(size=(n, 2))
    short = slur_stroke(stroke, share)
    assert np.array_equal(short[[0, -1]], stroke[[0, -1]])
    assert (
        np.linalg.norm(np.diff(short, axis=0), axis=1).sum()
        <= np.linalg.norm(np.diff(stroke, axis=0), axis=1).sum() + 1e-9
    )
    straight = np.linspace([0.0, 1.0], [2.0, -1.0], n)
    assert np.allclose(slur_stroke(straight, share), straight)
    assert np.array_equal(slur_stroke(stroke, 0.0), stroke)


def test_letters_that_are_not_joined_neither_touch_nor_gape():
    stem = Glyph("l", (np.array([[0.1, 2.0], [0.1, 1.0], [0.1, 0.0]]),), (False,), 0.1)
    low = Glyph("o", (np.array([[0.1, 1.0], [0.4, 0.5], [0.1, 0.0]]),), (False,), 0.3)
    assert change_of_room(stem, stem, 0.1, 1.2) == pytest.approx(LEAST_ROOM - 0.1)
    assert change_of_room(stem, stem, 0.3, 1.2) == 0.0
    assert change_of_room(stem, stem, 0.7, 1.2) == pytest.approx(-0.3)
    assert change_of_room(stem, stem, 0.7, 0.6) == pytest.approx(LEAST_ROOM - 0.7)
    barred = Glyph("t", (*stem.strokes, np.array([[-0.3, 1.0], [0.5, 1.0]])), (False, True), 0.1, after="l")
    assert change_of_room(stem, barred, 0.1, 1.2) == 0.0
    # an o reaches under nothing: what counts is the height where both have ink
    assert change_of_room(low, stem, 0.3, 1.2) == pytest.approx(LEAST_ROOM, abs=0.05)
    # as broad as it is written
    assert change_of_room(low, stem, 0.3, 1.2, (0.5, 1.0)) == pytest.approx(LEAST_ROOM - 0.2, abs=0.05)


def test_a_rising_stroke_meets_a_letter_that_it_is_not_joined_to():
    stem = Glyph("l", (np.array([[0.1, 2.0], [0.1, 1.0], [0.1, 0.0]]),), (False,), 0.1)
    rising = Glyph("u", (np.array([[0.1, 1.0], [0.1, 0.0], [0.5, 0.4]]),), (False,), 0.3, exit="low")
    assert change_of_room(rising, stem, 0.3, 1.2) == pytest.approx(0.1, abs=0.05)
    # one at the height of an o would make a d of it
    assert change_of_room(replace(rising, exit="high"), stem, 0.3, 1.2) == pytest.approx(LEAST_ROOM + 0.1, abs=0.05)
