"""The reader that has learnt an author's words."""

import numpy as np
import pytest

from handout.hand import library
from handout.hand.author_reader import own_words
from handout.reading import pictures
from handout.reading.adaptation import adapted


@pytest.fixture(scope="module")
def words():
    """Of a hand whose every a is meant as an o, and every o as an a."""
    swapped = str.maketrans("aoAO", "oaOA")
    hand = library.find("house-print-fountain")
    own = [word for word in own_words(hand) if pictures.known(word.text) and len(word.text) > 1][:80]
    reader = pictures.load()
    return [(word.text.translate(swapped), reader.features(word.picture)) for word in own]


def likely(reader, words):
    readings = [reader.reading(seen) for _, seen in words]
    return float(np.maximum(pictures.log_probabilities(readings, [text for text, _ in words]), -20.0).mean())


@pytest.mark.slow
def test_letters_that_an_author_writes_like_others_are_learnt(words):
    learnt, judged = words[::2], words[1::2]
    reader = pictures.load()
    knows = adapted(reader, [seen for _, seen in learnt], [text for text, _ in learnt])
    assert likely(knows, judged) > likely(reader, judged) + 1.0


def test_nothing_is_learnt_of_nothing():
    assert adapted(pictures.load(), [], []) is pictures.load()


def test_a_text_that_cannot_stand_there_teaches_nothing(words):
    reader = pictures.load()
    seen = words[0][1][:3]
    knows = adapted(reader, [seen], ["impossible"])
    np.testing.assert_allclose(knows.reading(seen).log_posteriors, reader.reading(seen).log_posteriors, atol=1e-3)
