"""What was written is read: the level of an author, wrong glyphs that are chosen no more, and what is told of them."""

from dataclasses import replace

import numpy as np
import pytest

from handout.errors import InputError
from handout.hand import library
from handout.page_sizes import page
from handout.pipeline import rereading, writing
from handout.pipeline.options import WritingOptions
from handout.pipeline.rereading import SETTINGS, Doubt, _level, reread
from handout.pipeline.results import Tally
from handout.writing.compose import each_page
from handout.writing.layout import Layout

WORDS = ["tent", "net", "ten", "eel", "let", "tell", "nettle", "teeth", "tilt", "lint"] * 3


def test_words_that_surprise_as_their_letters_do_are_not_doubted():
    cost = {"t": 0.5, "e": 0.1, "n": 0.3, "l": 2.0, "h": 0.4, "i": 0.2}
    own = _level(WORDS, np.array([sum(cost[c] for c in word) for word in WORDS]), SETTINGS)
    assert own.letters["l"] > own.letters["t"] > own.letters["e"]
    assert abs(own.excess("tell", 4.6)) < 0.5
    assert own.excess("tent", 8.0) > own.bound > own.excess("tell", 4.6)


def test_a_hand_without_words_is_judged_by_the_reader_alone():
    assert _level([], np.zeros(0), SETTINGS).excess("ten", 3.0) == pytest.approx(3.0 / np.sqrt(3))


@pytest.mark.slow
def test_a_glyph_that_is_another_letter_is_written_no_more():
    hand = library.find("house-print-fountain")
    wrong = set(hand.of("o").tolist())
    lying = replace(hand, glyphs=tuple(replace(g, letter="t") if n in wrong else g for n, g in enumerate(hand.glyphs)))
    text = "that little tent stays tight at the street, but the latter gets tattered at night"

    def compose(prices):
        return list(each_page(text, lying, Layout(page("A5")), np.random.default_rng(3), prices=prices))

    _, before = reread(compose, lying, hand, tries=0)
    _, after = reread(compose, lying, hand)
    assert before
    assert len(after) < len(before)


@pytest.fixture
def doubting(monkeypatch):
    """Whatever is written, one word of it is doubted."""

    def doubt(compose, hand, author, tries=None):
        from handout.writing.choosing import Prices

        return compose(Prices()), [Doubt("ten", 1, 1, "tea", 0.01)]

    monkeypatch.setattr(rereading, "reread", doubt)


def test_doubts_are_told_once_and_refused_where_that_is_asked(doubting):
    task = writing.prepare(WritingOptions(hand="house-print-fountain", seed=1))
    _, sheets = writing.set_pages("ten", task)
    pages = [sheet.manuscript for sheet in sheets]
    told = [{"word": "ten", "page": 1, "line": 1, "reads_as": "tea", "probability": 0.01}]
    assert Tally.of(pages, []).facts(1, "x", [])["doubtful"] == told
    with pytest.raises(InputError, match="--strict: 1 word may be misread"):
        list(writing.set_pages("ten", replace(task, strict=True))[1])
