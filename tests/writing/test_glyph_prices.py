"""Prices that even out how often glyphs are written: they do, on texts that they were not found on."""

from dataclasses import replace

import numpy as np
import pytest

from handout.writing.choosing import GlyphChooser
from handout.writing.glyph_index import WEIGHTS, index_glyphs
from handout.writing.glyph_prices import expected_use
from handout.writing.text import Letter

WORDS = ("ten hen men the tin net eat then fine line seen often tent hat mat in mine an inn teen " * 6).split()


def test_glyphs_are_written_more_evenly_on_a_text_of_its_own(small_hand):
    kept = index_glyphs(small_hand)
    times = []
    for index in (replace(kept, even_price=np.zeros(len(kept))), kept):
        chooser = GlyphChooser(index, np.random.default_rng(1))
        numbers = np.concatenate([chooser.word([Letter(part, (), 0) for part in word]).numbers for word in WORDS])
        times.append(np.bincount(numbers, minlength=len(kept)))
    assert (times[1] ** 2).sum() < (times[0] ** 2).sum()
    for letter in "ent":
        assert np.ptp(kept.even_price[kept.of(letter)]) > WEIGHTS.often / 2


def test_expected_use_is_that_of_all_ways():
    """Of a word of two letters with two glyphs each, counted out."""
    cost, steps = np.array([0.0, 1.0, 0.5, 0.0]), np.array([[0.2, 2.0], [1.0, 0.0]])
    likely = np.exp(-(cost[:2, None] + cost[2:] + steps))
    likely /= likely.sum()
    word = ([np.array([0, 1]), np.array([2, 3])], [np.zeros(2), np.zeros(2)], [np.exp(-steps)])
    assert expected_use([word], cost, 1.0) == pytest.approx([*likely.sum(axis=1), *likely.sum(axis=0)])
