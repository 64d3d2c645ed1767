"""Glyphs that are cut wrongly, told by their stems and by what most of their letter look like."""

import numpy as np

from handout.writing.scanned.outlier_cost import _likeness_cost, _lost_stem_cost, _stem_top


def _sizes(tops: list[float], feet: list[float]) -> np.ndarray:
    return np.column_stack([np.ones(len(tops)), tops, feet, np.ones(len(tops))])


def test_an_l_without_its_stem_is_dear_even_where_a_third_have_lost_it() -> None:
    cost = _lost_stem_cost("l", _sizes([2.2, 2.1, 2.3, 2.2, 0.9, 1.0], [0.0] * 6), np.zeros(6))
    assert (cost[:4] <= 0).all() and (cost[4:] > 3).all()


def test_a_letter_that_has_no_stem_is_not_short() -> None:
    assert not _lost_stem_cost("a", _sizes([1.0, 0.2], [0.0, 0.0]), np.zeros(2)).any()


def test_a_g_without_its_tail_is_dear() -> None:
    cost = _lost_stem_cost("g", _sizes([1.0] * 5, [-1.0, -1.1, -0.9, -1.0, 0.0]), np.zeros(5))
    assert (cost[:4] <= 0).all() and cost[4] > 6


def test_the_dot_of_an_i_is_none_of_its_stem() -> None:
    assert _stem_top(np.r_[np.linspace(0, 1, 30), 1.5, 1.52]) == 1.0
    assert _stem_top(np.linspace(0, 1.6, 40)) == 1.6


def test_glyphs_that_are_like_only_each_other_are_strange() -> None:
    rng = np.random.default_rng(3)
    right, wrong, others = (rng.normal(0, 0.1, (n, 6)) for n in (12, 3, 12))
    wrong[:, 0] += 3
    others[:, 1] += 3
    looks, own = np.concatenate([right, wrong, others]), np.arange(27) < 15
    cost = _likeness_cost(looks, np.square(looks).sum(axis=1), own)
    assert cost[12:].min() > 2 and np.median(cost[:12]) <= 0
