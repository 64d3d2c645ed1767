"""Asemic glyphs: the genetic algorithm and the tags made of its asemic."""

from itertools import combinations

import numpy as np
import pytest

from handout.errors import InputError
from handout.motion.styles import asemic, style
from handout.values import Page

PAGE = Page(148.0, 105.0)


@pytest.mark.parametrize("seed", range(5))
def test_no_two_targets_of_the_best_order_change_places_for_a_better_one(seed):
    places = asemic.scatter_targets(6, np.random.default_rng(seed))
    best = asemic.best_order(places)
    assert sorted(best.tolist()) == list(range(6))
    others = [best.copy() for _ in combinations(range(6), 2)]
    for other, pair in zip(others, combinations(range(6), 2), strict=True):
        other[list(pair)] = best[list(pair[::-1])]
    worth = asemic.fitness(np.array([best, *others]), places)
    assert worth.argmax() == 0 and worth[0] > asemic.fitness(np.arange(6)[None], places)[0]


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
