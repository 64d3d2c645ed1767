"""Simulated pages read back, letters parted where it can be seen, and the hands that ship."""

from itertools import pairwise

import numpy as np
import pytest

from handout.hand.library import load
from handout.prompting import corpus
from handout_lab.author import page_score
from handout_lab.author.ink_ownership import parted
from handout_lab.training import scanned_hands as shipping

HALF = 6  # samples from the last point of a letter to where it changes hands in motor time


def drawn(*corners, step=1.0):
    """Samples along straight pieces, `step` apart."""
    places = [np.array(corners[0], dtype=float)]
    for a, b in pairwise(corners):
        count = max(1, round(np.hypot(b[0] - a[0], b[1] - a[1]) / step))
        places += [np.add(a, np.subtract(b, a) * (i + 1) / count) for i in range(count)]
    return np.array(places)


def where(xy, of, line=3.0):
    """The place at which two letters part."""
    made = parted(xy, of, line)
    (i,) = np.flatnonzero(np.diff(made))
    assert made[0] == 0 and made[-1] == 1
    return xy[i : i + 2].mean(axis=0)


def test_letters_part_in_the_middle_of_a_clear_way():
    xy = drawn((0, 0), (100, 0))
    of = (np.arange(len(xy)) >= 40).astype(int)
    assert where(xy, of) == pytest.approx([39.5, 0], abs=1.0)


def test_letters_part_where_the_line_meets_a_stem():
    # along the ground to a stem, up it and down again, on: half way in motor time the pen is up on the stem
    xy = drawn((0, 0), (40, 0), (40, -40), (40, 0), (80, 0))
    of = (np.arange(len(xy)) >= 40 + 30).astype(int)
    assert where(xy, of) == pytest.approx([38, 0], abs=4)


def test_letters_part_where_the_line_leaves_a_stem():
    xy = drawn((0, 0), (40, 0), (40, -40), (40, 0), (80, 0))
    of = (np.arange(len(xy)) >= 40 + 40 + 12).astype(int)
    assert where(xy, of) == pytest.approx([42, 0], abs=4)


def test_a_stroke_of_one_letter_stays_whole():
    xy = drawn((0, 0), (40, 0), (40, -40), (40, 0))
    assert not parted(xy, np.zeros(len(xy), dtype=int), 3.0).any()


def test_a_page_is_read_back(small_page):
    truth = small_page.simulated.truth
    score = page_score.score(truth, small_page.made)
    assert score.identity <= score.right
    assert score.right > 0.9 and score.splits.placed > 0.7
    given = page_score.vertex_letters(small_page.made, [letter.at for letter in truth.letters])
    assert set(given.tolist()) <= {-1, *(letter.at for letter in truth.letters)}
    assert len(page_score.cuts(small_page.made)) == sum(len(glyph.ligatures) for glyph in small_page.made.glyphs)


def test_a_prompt_fills_its_pages():
    for recipe in shipping.RECIPES:
        hand = load(recipe.drawn)
        text = shipping.prompt(recipe, hand)
        assert set(corpus.PRINTABLE + shipping.ACCENTED) <= set(text)
        assert max(map(len, text.splitlines())) <= recipe.width
        assert len(text.splitlines()) % (len(text.splitlines()) // shipping.PAGES) == 0
