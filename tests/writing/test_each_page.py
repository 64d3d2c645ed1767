"""Pages that are written one by one: no more is written for one than it takes, and nothing else changes."""

import itertools

import numpy as np
import pytest

from handout.errors import MissingCharacters
from handout.hand.library import load
from handout.page_sizes import page
from handout.writing.compose import compose, each_page
from handout.writing.drawn_words import WordWriter
from handout.writing.layout import Layout

HAND = load("house-print")
SMALL = Layout(page("70x50mm"), (6.0,) * 4)
TEXT = "The quiet garden kept its colour. " * 12
MANY = TEXT + "\n  " + TEXT + "\n\n" + TEXT


def strokes(sheet):
    return [s for line in sheet.lines for placed in line.placed for s in placed.strokes]


def same(one, other):
    return all((a == b).all() for a, b in zip(strokes(one), strokes(other), strict=True))


def sheets(text=MANY, slips=0.0, **options):
    return each_page(text, HAND, SMALL, np.random.default_rng(4), slips=slips, **options)


@pytest.mark.slow
@pytest.mark.parametrize("text", [MANY, TEXT * 3], ids=["paragraphs", "one paragraph"])
def test_the_first_page_waits_for_no_word_behind_it(text, monkeypatch):
    written, word = [], WordWriter.word
    monkeypatch.setattr(
        WordWriter, "word", lambda self, forms, letters, rng: written.append(letters) or word(self, forms, letters, rng)
    )
    made = sheets(text)
    first = next(made)
    on_it = sum(len({placed.word for placed in line.placed}) for line in first.manuscript.lines)
    row = max(len(line.placed) for line in first.manuscript.lines)
    assert on_it < len(written) <= on_it + row and not first.last
    *_, last = made
    assert last.last and len(written) == len(text.split())


@pytest.mark.slow
@pytest.mark.parametrize("slips", [0.0, 30.0])
def test_pages_are_the_same_however_they_are_asked_for(slips):
    at_once = compose(MANY, HAND, SMALL, np.random.default_rng(4), slips=slips)
    assert len(at_once) > 3
    assert all(same(one.manuscript, two) for one, two in zip(sheets(slips=slips), at_once, strict=True))
    counted = sheets(slips=slips, pages=len(at_once))
    assert all(same(one.manuscript, two) for one, two in zip(counted, at_once, strict=True))


def test_a_page_goes_on_with_a_generator_of_its_own():
    rng = np.random.default_rng(4)
    made = list(each_page(MANY, HAND, SMALL, rng))
    assert all(sheet.rng is not rng for sheet in made)
    drawn = [sheet.rng.random() for sheet in made]
    assert len(set(drawn)) == len(drawn)
    again = sheets()
    assert [sheet.rng.random() for sheet in itertools.islice(again, 2)] == drawn[:2]


def test_what_a_hand_lacks_is_found_before_the_first_page():
    with pytest.raises(MissingCharacters, match=r"'ժ' \(line 4, character 409\)"):
        sheets(MANY + "ժ")
