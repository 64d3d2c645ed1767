"""The haste knob."""

import numpy as np
import pytest

from handout.errors import InputError
from handout.hand.library import load, names
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.writing.compose import compose
from handout.writing.layout import Layout

TEXT = "running home in the morning, minimum of trouble"


def written(hand):
    rng = np.random.default_rng(1)
    (sheet,) = compose(TEXT, hand, Layout(page("A4"), jitter=0.0), rng)
    return sheet, trace(sheet, hand, rng, jitter=0.0)


def test_none_is_the_hand_itself():
    hand = load("house-joined")
    assert hand.with_haste(0.0) is hand


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_haste_is_quicker_broader_flatter_and_more_slanted(name):
    hand = load(name)
    careful, usual, hurried = (written(hand.with_haste(h))[1] for h in (-1.0, 0.0, 1.0))
    assert careful.duration > usual.duration > hurried.duration

    def size(drawing):
        left, top, right, bottom = drawing.bounds
        return (right - left) / (bottom - top)

    assert size(careful) < size(usual) < size(hurried)
    assert hand.with_haste(1.0).slant > hand.slant > hand.with_haste(-1.0).slant


def test_words_flatten_towards_their_end():
    def heights(haste):
        sheet, _ = written(load("house-print").with_haste(haste))
        word = [p for p in sheet.lines[0].placed if p.word == 0]
        tops = [max(np.ptp(s[:, 1]) for s in p.strokes) for p in word if p.glyph.letter in "n"]
        return tops[-1] / tops[0]

    assert heights(1.0) < heights(0.0)


@pytest.mark.parametrize("haste", [-1.01, 2.0, float("nan")])
def test_bounds(haste):
    with pytest.raises(InputError, match="haste"):
        load("house-print").with_haste(haste)
