"""Reordering: whole words only, never turned round, never longer."""

import numpy as np
from cursive import page
from hypothesis import given
from hypothesis import strategies as st

from handout.plotting.order import by_travel
from handout.values import Drawing, Page, Stroke


def travel(strokes):
    return Drawing(tuple(strokes), Page(200, 200)).pen_up


@st.composite
def strokes(draw):
    places = draw(st.lists(st.tuples(*[st.floats(0, 100)] * 4, st.integers(-1, 6)), min_size=1, max_size=25))
    return tuple(Stroke([0.0, 1.0], [[a, b], [c, d]], word=word) for a, b, c, d, word in places)


@given(strokes())
def test_words_keep_together_and_in_order_and_the_way_is_not_longer(given_strokes):
    ordered = by_travel(given_strokes)
    assert sorted(map(id, ordered)) == sorted(map(id, given_strokes))
    before = {id(stroke): at for at, stroke in enumerate(given_strokes)}
    words = [stroke.word if stroke.word >= 0 else ("alone", id(stroke)) for stroke in ordered]
    runs = [word for at, word in enumerate(words) if at == 0 or words[at - 1] != word]
    for word in set(words):
        places = [before[id(stroke)] for stroke, of in zip(ordered, words, strict=True) if of == word]
        assert places == sorted(places)
    if ordered != given_strokes:
        assert len(runs) == len(set(runs))
        assert travel(ordered) < travel(given_strokes)


def test_shuffled_words_are_brought_back_near_each_other():
    drawing = page(seed=4, words=30)
    by_word = {}
    for stroke in drawing.strokes:
        by_word.setdefault(stroke.word, []).append(stroke)
    mixed = [stroke for word in np.random.default_rng(0).permutation(30) for stroke in by_word[int(word)]]
    assert travel(by_travel(tuple(mixed))) < 0.7 * travel(mixed)


def test_one_word_stays_as_it_is():
    drawing = page(words=1)
    assert by_travel(drawing.strokes) == drawing.strokes
