"""Words whose order of strokes the ink does not tell are told, in the drawing, in JSON and in a sentence."""

from dataclasses import replace

import numpy as np
import pytest

from handout.cli.sentences import tell_letters
from handout.motion.recovery import stroke_order
from handout.motion.recovery.letter_forms import HANDS
from handout.motion.trace import trace
from handout.pipeline.results import Tally
from handout.values import Page
from handout.writing.compose import compose
from handout.writing.layout import Layout


@pytest.fixture
def sheet(small_hand):
    layout = Layout(Page(190.0, 60.0, "slip"), x_height=small_hand.x_height)
    return next(iter(compose("ten net tenet", small_hand, layout, np.random.default_rng(1))))


def guess(monkeypatch, hand, numbers):
    """A model of the hand in which the orders of these glyphs are guessed, and of no others."""
    model = stroke_order.StrokeOrderModel(hand, HANDS)
    for number in range(len(hand.glyphs)):
        model._strokes[number] = replace(model.strokes_of(number)[0], guessed=number in numbers)
    monkeypatch.setitem(stroke_order._MODELS, (id(hand), HANDS), model)


def test_each_word_with_such_a_letter_is_told(sheet, small_hand, monkeypatch):
    letters = [placed for line in sheet.lines for placed in line.placed if placed.glyph.letter]
    first = [one for one in letters if one.word == letters[0].word]
    guess(monkeypatch, small_hand, {first[0].ink.number, first[1].ink.number})
    drawing = trace(sheet, small_hand, np.random.default_rng(1))
    told = drawing.about["order"]
    assert told[0] == {"word": "ten", "at": first[0].at, "order": "guessed", "letters": ["t", "e"]}
    tally = Tally.from_pages([sheet], [drawing])
    assert tally.facts(1, "small", [])["order"] == told
    sentence = " The ink does not tell the order of the strokes in"
    assert sentence in tell_letters(tally) and "among them ten: it is guessed" in tell_letters(tally)
    # a few words among many are in the JSON alone
    assert sentence not in tell_letters(replace(tally, characters=1000))


def test_where_the_ink_tells_nothing_is_said(sheet, small_hand, monkeypatch):
    guess(monkeypatch, small_hand, set())
    drawing = trace(sheet, small_hand, np.random.default_rng(1))
    assert "order" not in drawing.about
    tally = Tally.from_pages([sheet], [drawing])
    assert "order" not in tally.facts(1, "small", []) and "order" not in tell_letters(tally)
