"""What was written is read: the level of an author, wrong glyphs that are chosen no more, and what is told of them."""

from dataclasses import replace

import numpy as np
import pytest

from handout.cli.sentences import tell_doubts
from handout.errors import InputError
from handout.hand import library
from handout.hand.author_reader import own_words
from handout.hand.learnt import known_values, remember
from handout.hand.vetting import vet
from handout.page_sizes import page
from handout.pipeline import rereading
from handout.pipeline.options import WritingOptions
from handout.pipeline.rereading import SETTINGS, Doubt, StrangerReader, _normal, reread, stranger_reader, surprises
from handout.pipeline.results import Tally
from handout.pipeline.texts import TextDocument, prepare
from handout.writing import legibility
from handout.writing.compose import each_page
from handout.writing.layout import Layout
from handout.writing.legibility import misreadings
from handout.writing.word_layout import layout_model

USUAL = StrangerReader(0.5, 2.0, 0.45)


def test_the_more_a_word_surprises_the_more_it_is_doubted():
    doubts = [USUAL.wrong("tent", surprise, 0.05) for surprise in (0.0, 2.0, 5.0, 12.0, 30.0)]
    assert doubts == sorted(doubts)
    assert doubts[0] < 0.001 < 0.99 < doubts[-1]
    assert USUAL.wrong("tent", 6.0, 0.2) > USUAL.wrong("tent", 6.0, 0.05)
    # the same surprise says less of a longer word, and of an author who is hard to read
    assert USUAL.wrong("tentatively", 6.0, 0.05) < USUAL.wrong("tent", 6.0, 0.05)
    assert replace(USUAL, right=1.2).wrong("tent", 6.0, 0.05) < USUAL.wrong("tent", 6.0, 0.05)


def test_what_says_nothing_leaves_what_was_thought_before():
    at_the_border = np.expm1((USUAL.right + USUAL.misspelt) / 2) * np.sqrt(4)
    assert USUAL.wrong("tent", float(at_the_border), 0.05) == pytest.approx(0.05)


def test_wrong_transcripts_say_nothing_of_an_author():
    words = np.random.default_rng(1).normal(0.6, 0.3, 200)
    spoilt = np.where(np.arange(200) % 25 == 0, 3.0, words)
    assert _normal(spoilt) == pytest.approx(_normal(words), abs=0.06)
    assert _normal(words) == pytest.approx((0.6, 0.3), abs=0.06)


@pytest.mark.slow
def test_few_words_of_an_author_are_doubted_but_under_other_texts():
    """Some that he scribbled are misread by strangers, and told if they were written: 5 of 100 of this hand."""
    hand = library.find("house-joined-ballpoint")
    own = stranger_reader(hand)
    words = [word for word in own_words(hand) if len(word.text) > 2 and rereading.readable(word.text)][:300]
    readings = own.read([word.picture for word in words])
    right = [word.text for word in words]
    wrong = [text[:-2] + ("e" if text[-2] != "e" else "o") + text[-1] for text in right]
    p_right, p_wrong = (
        [own.wrong(text, surprise, 0.05) for text, surprise in zip(texts, surprises(readings, texts), strict=True)]
        for texts in (right, wrong)
    )
    assert np.mean(np.array(p_right) > SETTINGS.told) < 0.07
    assert np.mean(np.array(p_wrong) > SETTINGS.told) > 0.7


def test_a_hand_without_words_is_judged_as_usual():
    hand = library.find("house-print-fountain")
    silent = stranger_reader(replace(hand, glyphs=()))
    usual = rereading._OF_TWO if silent.second else (SETTINGS.right, SETTINGS.misspelt, SETTINGS.spread)
    assert (silent.right, silent.misspelt, silent.spread) == usual


@pytest.mark.slow
def test_a_glyph_that_is_another_letter_is_written_no_more():
    hand = library.find("house-print-fountain")
    wrong = set(hand.numbers_of_letter("o").tolist())
    lying = replace(hand, glyphs=tuple(replace(g, letter="t") if n in wrong else g for n, g in enumerate(hand.glyphs)))
    stranger_reader(hand), vet(hand), layout_model(hand), misreadings(hand)
    remember(lying, known_values(hand))  # nobody else notices
    text = "that little tent stays tight at the street, but the latter gets tattered at night-time"

    def compose(proofread):
        return each_page(text, lying, Layout(page("A5")), np.random.default_rng(3), proofread=proofread)

    _, before, plain = reread(compose, lying, hand, tries=0)
    sheets, after, words = reread(compose, lying, hand)
    assert before
    assert len(after) < len(before)
    assert "".join(word.text for word in words) == "".join(word.text for word in plain) == text.replace(" ", "")
    # what was read is what is written
    written = [placed.ink.number for sheet in sheets for line in sheet.manuscript.lines for placed in line.placed]
    assert written == np.concatenate([word.numbers for word in words]).tolist()
    assert all(one.wrong <= other.wrong for one, other in zip(words, plain, strict=True))


@pytest.fixture
def doubting(monkeypatch):
    """Whatever is written, one word of it is doubted."""

    def doubt(compose, hand, author, tries=None):
        return list(compose(None)), [Doubt("ten", 1, 1, "tea", "n", 0.01)], []

    monkeypatch.setattr(rereading, "reread", doubt)


@pytest.mark.slow
def test_doubts_are_told_once_and_refused_where_that_is_asked(doubting):
    task = prepare(WritingOptions(hand="house-print-fountain", seed=1))
    _, sheets = TextDocument("ten", task).set_pages()
    pages = [sheet.manuscript for sheet in sheets]
    (told,) = Tally.from_pages(pages, []).facts(1, "x", [])["doubtful"]
    left, top, right, bottom = told.pop("box")
    assert told == {"word": "ten", "page": 1, "line": 1, "reads_as": "tea", "letter": "n", "probability": 0.01}
    assert 0 < left < right < pages[0].page.width / 2 and 0 < top < bottom < pages[0].page.height / 2
    with pytest.raises(InputError, match="--strict: 1 word may be misread"):
        list(TextDocument("ten", replace(task, strict=True)).set_pages()[1])


@pytest.mark.slow
def test_words_with_unclear_letters_are_told_where_they_are_the_authors(monkeypatch):
    monkeypatch.setattr(legibility, "unclear_letters", lambda hand: {"n": 0.9, "q": 0.7})
    task = prepare(WritingOptions(hand="house-print-fountain", seed=1))
    pages = [sheet.manuscript for sheet in TextDocument("nun ten tea", task).set_pages()[1]]
    tally = Tally.from_pages(pages, [])
    assert tally.facts(1, "x", [])["unclear"] == [{"word": word, "letters": ["n"]} for word in ("nun", "ten")]
    assert "Strangers mostly take n of this hand for other letters; 2 words with them" in tell_doubts(tally)
    lent = Tally.from_pages([replace(pages[0], about={})], [])
    assert "unclear" not in lent.facts(1, "x", []) and not tell_doubts(lent)
