"""Asemic glyphs: the genetic algorithm and the tags made of its asemic."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.motion.styles import asemic, style
from handout.values import Page

PAGE = Page(148.0, 105.0)


@settings(max_examples=60)
@given(st.data(), st.integers(2, 9))
def test_crossover_keeps_permutations(data, m):
    a, b = (np.array(data.draw(st.permutations(range(m)))) for _ in range(2))
    low = data.draw(st.integers(0, m))
    high = data.draw(st.integers(low, m))
    child = asemic.crossover(a, b, low, high)
    assert sorted(child.tolist()) == list(range(m))
    assert child[low:high].tolist() == a[low:high].tolist()
    same = [at for at in (*range(low), *range(high, m)) if b[at] not in a[low:high]]
    assert child[same].tolist() == b[same].tolist()


@pytest.mark.parametrize("seed", range(5))
def test_finds_the_best_order_of_few_targets_or_nearly(seed):
    rng = np.random.default_rng(seed)
    places = asemic.scatter_targets(6, rng)
    best = asemic.fitness(np.array(list(permutations(range(6)))), places).max()
    found = asemic.fitness(asemic.best_order(places, rng)[None], places)[0]
    assert found >= 0.98 * best


def test_down_and_to_the_right_are_better():
    places = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    down, up, right, left = asemic.fitness(np.array([[0, 1], [1, 0], [0, 2], [2, 0]]), places)
    assert down > right > up == left


@pytest.mark.slow
@pytest.mark.parametrize("name", style.names())
def test_a_tag_fits_its_page_and_is_the_same_for_the_same_seed(name):
    first, again, other = (asemic.tag(5, style.find(name), PAGE, np.random.default_rng(s)) for s in (3, 3, 4))
    places = [np.concatenate([stroke.xy for stroke in one.strokes]).tobytes() for one in (first, again, other)]
    assert places[0] == places[1] != places[2]
    for stroke in first.strokes:
        side = stroke.width[:, None] / 2
        assert (stroke.xy - side >= -0.2).all() and (stroke.xy + side <= np.array([148, 105]) + 0.2).all()
    x, y, right, foot = first.bounds
    assert abs((x + right) / 2 - 74) < 3 and abs((y + foot) / 2 - 52.5) < 3


@pytest.mark.slow
def test_joined_styles_write_a_tag_in_one_go():
    counts = [len(asemic.tag(6, style.find(n), PAGE, np.random.default_rng(1)).strokes) for n in ("fast-tag", "calm")]
    assert counts == [1, 6]


@pytest.mark.slow
@pytest.mark.parametrize("letters", [1, 25])
def test_few_and_many_letters(letters):
    made = asemic.tag(letters, style.find("calm"), PAGE, np.random.default_rng(0))
    assert len(made.strokes) == letters


def test_what_cannot_be_is_named():
    for letters in (0, -1, 61):
        with pytest.raises(InputError, match="outside 1 to 60"):
            asemic.tag(letters, style.find("calm"), PAGE, np.random.default_rng(0))
    with pytest.raises(ValueError, match="outside 2 to 9"):
        asemic.glyph(10, np.random.default_rng(0))
