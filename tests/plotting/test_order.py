"""Reordering: whole words only, never turned round, never longer."""

import numpy as np
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.plotting.planning.order import by_tour, by_travel, shorten_travel
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


@st.composite
def drawings(draw):
    numbers = st.floats(0, 100)
    lines = draw(st.lists(st.tuples(numbers, numbers, numbers, numbers), min_size=1, max_size=30))
    rings = draw(st.lists(st.tuples(numbers, numbers, st.floats(1, 20)), max_size=6))
    angle = np.linspace(0, 2 * np.pi, 25)
    found = [Stroke([0.0, 1.0], [[a, b], [c, d]], pressure=[0.25, 0.75]) for a, b, c, d in lines]
    for x, y, r in rings:
        circle = np.column_stack([x + r * np.cos(angle), y + r * np.sin(angle)])
        circle[-1] = circle[0]
        found.append(Stroke(np.arange(25.0), circle))
    return tuple(found)


def turned(stroke):
    return stroke.xy[::-1]


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(drawings(), st.booleans())
def test_a_drawing_keeps_its_strokes_and_its_way_is_not_longer(strokes, homing):
    home = np.array([0.0, 0.0]) if homing else None
    ordered = by_tour(strokes, home)
    assert len(ordered) == len(strokes)
    left = list(strokes)
    for stroke in ordered:
        same = [
            other
            for other in left
            if len(other.t) == len(stroke.t)
            and (
                (
                    len(stroke.t) == 2
                    and (np.array_equal(other.xy, stroke.xy) or np.array_equal(turned(other), stroke.xy))
                )
                or (len(stroke.t) > 2 and sorted(set(map(tuple, other.xy))) == sorted(set(map(tuple, stroke.xy))))
            )
        ]
        assert same, "a stroke that was not there"
        left = [other for other in left if other is not same[0]]
        assert (np.diff(stroke.t) > 0).all()
    assert travel_from(ordered, home) <= travel_from(strokes, home) + 1e-6


def travel_from(strokes, home):
    ends = 0.0 if home is None else sum(np.hypot(*(xy - home)) for xy in (strokes[0].xy[0], strokes[-1].xy[-1]))
    return travel(strokes) + ends


def test_what_belongs_to_samples_goes_with_them_when_a_stroke_is_turned():
    there = Stroke([0.0, 1.0], [[0, 0], [10, 0]])
    back = Stroke([0.0, 0.2, 1.0], [[0, 1], [4, 1], [10, 1]], pressure=[0.1, 0.2, 0.3])
    ordered = by_tour((there, back))
    (found,) = [stroke for stroke in ordered if stroke.pressure is not None]
    if found.xy[0, 0] == 10:
        assert found.pressure.tolist() == [0.3, 0.2, 0.1]
        assert np.diff(found.t) == pytest.approx([0.8, 0.2])
    assert travel(ordered) == pytest.approx(1.0)


def test_a_ring_is_begun_where_it_is_nearest():
    angle = np.linspace(0, 2 * np.pi, 101)
    ring = np.column_stack([50 + 20 * np.cos(angle), 50 + 20 * np.sin(angle)])
    ring[-1] = ring[0]
    strokes = (Stroke([0, 1], [[0, 50], [29, 50]]), Stroke(np.arange(101.0), ring), Stroke([0, 1], [[29, 51], [0, 51]]))
    assert travel(strokes) > 80
    assert travel(by_tour(strokes)) < 4


@pytest.mark.slow
def test_a_sheet_is_much_shorter_than_nearest_neighbours_make_it():
    rng = np.random.default_rng(3)
    start = rng.uniform(0, 100, (300, 2))
    strokes = tuple(Stroke([0, 1], np.array([a, a + rng.normal(0, 3, 2)])) for a in start)
    ends = np.array([[stroke.xy[0], stroke.xy[-1]] for stroke in strokes])
    left, at, way = list(range(len(strokes))), ends[0, 0], 0.0
    while left:
        gaps = np.hypot(*(ends[left] - at).transpose(2, 0, 1))
        index, end = np.unravel_index(gaps.argmin(), gaps.shape)
        way += gaps[index, end]
        at = ends[left.pop(index), 1 - end]
    assert travel(by_tour(strokes)) < 0.85 * way


def test_strokes_that_all_end_in_one_place():
    star = tuple(Stroke([0, 1], [[50, 50], [50 + np.cos(a), 50 + np.sin(a)]]) for a in np.linspace(0, 6, 300))
    assert travel(by_tour(star)) < travel(star)
    same = (Stroke([0, 1], [[1, 1], [2, 2]]),) * 500
    assert travel(by_tour(same)) == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("hand", ["house-joined", "house-print", "house-quick"])
def test_words_of_a_page_of_handwriting_save_a_tenth(hand):
    import handout

    loaded = handout.load(hand)
    text = "every morning she wrote a page before breakfast, quickly, and every evening she burned it " * 4
    layout = handout.Layout(handout.page("A5"))
    page_, *_ = handout.compose(text, loaded, layout, np.random.default_rng(1))
    drawing = handout.trace(page_, loaded, np.random.default_rng(1))
    assert travel(shorten_travel(drawing)) < 0.9 * travel(drawing.strokes)
