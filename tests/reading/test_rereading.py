"""What was written is read: few words are doubted, wrong glyphs are chosen no more, and what is told of them."""

from dataclasses import replace
from functools import partial

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
from handout.pipeline.rereading import Doubt, reread
from handout.pipeline.results import Tally
from handout.pipeline.texts import TextDocument, prepare
from handout.reading import misreading
from handout.writing.compose import each_page
from handout.writing.layout import Layout
from handout.writing.legibility import misread_shares
from handout.writing.word_layout import layout_model


@pytest.mark.slow
def test_few_words_of_an_author_are_doubted_but_under_other_texts():
    hand = library.find("house-joined-ballpoint")
    words = [word for word in own_words(hand) if len(word.text) > 2 and rereading.readable(word.text)][:300]
    readings = rereading.read([word.picture for word in words])
    weights, shares = misreading.load(len(readings[0])), misread_shares(hand)

    def told(texts):
        seen = [misreading.shares_seen(each, texts) for each in zip(*readings, strict=True)]
        wrong = []
        for word, *shown in zip(words, *seen, strict=True):
            before = weights.before(*(each[word.glyphs] for each in shares))
            wrong.append(1 - np.prod(1 - weights.misread(before, np.array(shown))))
        return np.mean(np.array(wrong) > weights.told)

    assert told([word.text for word in words]) < 0.07
    assert told([word.text[:-2] + ("e" if word.text[-2] != "e" else "o") + word.text[-1] for word in words]) > 0.7


@pytest.mark.slow
def test_a_glyph_that_is_another_letter_is_written_no_more():
    hand = library.find("house-print-fountain")
    wrong = set(hand.numbers_of_letter("o").tolist())
    lying = replace(hand, glyphs=tuple(replace(g, letter="t") if n in wrong else g for n, g in enumerate(hand.glyphs)))
    vet(hand), layout_model(hand), misread_shares(hand)
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


def test_a_letter_that_strangers_take_for_another_is_named_where_most_words_have_it():
    doubts = [Doubt(word, 1, 1, word.replace("n", "u"), "n", 0.4).facts() for word in ("nun", "ten")]
    tell = partial(replace, Tally.from_pages([], []))
    assert "May be misread: nun as uuu, ten as teu; other seeds" in tell_doubts(tell(doubtful=doubts))
    other = Doubt("at", 1, 2, "ot", "a", 0.5).facts()
    assert "ten as teu, at as ot (2 for n); other seeds" in tell_doubts(tell(doubtful=[*doubts, other]))
    assert not tell_doubts(tell(doubtful=[]))
