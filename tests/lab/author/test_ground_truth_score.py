"""The judge says 1 of the truth itself, and less of everything else."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.hand.library import load
from handout.inking.pen import usual
from handout.page_sizes import page
from handout.writing.layout import Layout
from handout_lab.author import ground_truth_score
from handout_lab.author.simulate import Desk, simulate
from handout_lab.author.worn_flatbed import WornFlatbed


@pytest.fixture(scope="module")
def simulated():
    layout = Layout(page("90x30mm"), (6.0, 6.0, 6.0, 6.0), x_height=2.5)
    flatbed = replace(WornFlatbed.of_handwriting(), rotation=0.0, dust=0.0)
    desk = Desk(usual("plain"), layout=layout, flatbed=flatbed)
    return simulate("hollow minimum, quite", load("house-joined"), desk, rng=np.random.default_rng(7))


def chain(truth):
    """The true paths as a found graph."""
    places = np.concatenate([p.xy for p in truth.paths])
    starts = np.cumsum([0, *(len(p.xy) for p in truth.paths)])
    edges = [np.column_stack([np.arange(a, b - 1), np.arange(a + 1, b)]) for a, b in pairwise(starts)]
    return places, np.concatenate(edges)


@given(st.lists(st.booleans(), min_size=4, max_size=4), st.lists(st.booleans(), min_size=4, max_size=4))
def test_overlap_is_intersection_over_union(a, b):
    both, either = sum(x and y for x, y in zip(a, b, strict=True)), sum(x or y for x, y in zip(a, b, strict=True))
    wanted = both / either if either else 1.0
    assert ground_truth_score.overlap(np.array(a).reshape(2, 2), np.array(b).reshape(2, 2)) == pytest.approx(wanted)


def test_the_true_path_is_met(simulated):
    truth = simulated.truth
    places, edges = chain(truth)
    score = ground_truth_score.path(truth, places, edges)
    assert (score.recall, score.recall_all, score.precision) == (1.0, 1.0, 1.0)
    assert score.error < 0.2 * truth.pixel
    assert 0.3 < score.clear < 1
    assert not len(ground_truth_score.missed(truth, places, edges))


def test_a_path_beside_the_true_one_is_not(simulated):
    truth = simulated.truth
    places, edges = chain(truth)
    beside = ground_truth_score.path(truth, places + np.array([0.0, 0.2 / truth.pixel]), edges)
    assert beside.recall < 0.6
    assert beside.precision < 0.6
    near = ground_truth_score.path(truth, places + np.array([0.0, 0.03 / truth.pixel]), edges)
    assert near.recall == 1.0
    assert 0 < near.error <= 0.031


def test_half_a_path_meets_half(simulated):
    truth = simulated.truth
    places, edges = chain(truth)
    middle = np.median(places[:, 0])
    kept = edges[(places[edges][:, :, 0] < middle).all(axis=1)]
    left, half = places[np.unique(kept)], np.searchsorted(np.unique(kept), kept)
    score = ground_truth_score.path(truth, left, half)
    assert 0.35 < score.recall_all < 0.65
    assert score.precision > 0.95
    assert ground_truth_score.missed(truth, left, half)[:, 0].mean() > middle


def test_nothing_found_scores_nothing(simulated):
    none = ground_truth_score.path(simulated.truth, np.zeros((0, 2)), np.zeros((0, 2), dtype=int))
    assert (none.recall, none.recall_all) == (0.0, 0.0)


def test_letters_are_read_by_most_of_their_vertices(simulated):
    truth = simulated.truth
    places, _ = chain(truth)
    at = np.concatenate([p.of for p in truth.paths])
    said = [truth.by_index[int(i)].text for i in at]
    assert ground_truth_score.letters_right(truth, places, said) == 1.0
    assert ground_truth_score.letters_right(truth, places, [""] * len(said)) == 0.0
    first = truth.letters[0]
    wrong = ["#" if i == first.at else text for i, text in zip(at, said, strict=True)]
    assert ground_truth_score.letters_right(truth, places, wrong) == pytest.approx(1 - 1 / len(truth.letters))
    # a third of a letter taken for another one does not matter
    rng = np.random.default_rng(0)
    noisy = [text if rng.random() < 0.67 else "#" for text in said]
    assert ground_truth_score.letters_right(truth, places, noisy) > 0.9


def test_an_equal_letter_beside_is_another(simulated):
    truth = simulated.truth
    places, _ = chain(truth)
    at = np.concatenate([p.of for p in truth.paths])
    assert ground_truth_score.letters_identified(truth, places, at) == 1.0
    assert ground_truth_score.letters_identified(truth, places, np.full(len(at), -1)) == 0.0
    # the second l of "hollow" taken for the first
    swapped = np.where(at == 3, 2, at)
    assert (truth.by_index[2].text, truth.by_index[3].text) == ("l", "l")
    said = [truth.by_index[int(i)].text for i in swapped]
    assert ground_truth_score.letters_right(truth, places, said) == 1.0
    assert ground_truth_score.letters_identified(truth, places, swapped) == pytest.approx(1 - 1 / len(truth.letters))


def test_owners_of_places_off_the_page_are_none(simulated):
    owner = ground_truth_score.owners(simulated.truth, np.array([[-5.0, 3.0], [1e6, 3.0], [1.0, 1.0]]))
    assert owner.tolist() == [-1, -1, -1]


def test_splits_answer_for_one_each(simulated):
    truth = simulated.truth
    true = np.array([split.xy for split in truth.splits])
    assert len(true) >= 8
    exact = ground_truth_score.splits(truth, true)
    assert (exact.recall, exact.placed, exact.precision, exact.median) == (1.0, 1.0, 1.0, 0.0)
    off = ground_truth_score.splits(truth, true[:-2] + np.array([0.1 * truth.rule, 0.0]))
    assert off.recall == pytest.approx(1 - 2 / len(true))
    assert off.placed == off.recall
    assert off.median == pytest.approx(0.1)
    beyond = ground_truth_score.splits(truth, true + np.array([0.0, 0.2 * truth.rule]))
    assert beyond.placed < 0.5 < beyond.recall
    double = ground_truth_score.splits(truth, np.concatenate([true, true]))
    assert (double.recall, double.precision) == (1.0, 0.5)
    nothing = ground_truth_score.splits(truth, np.zeros((0, 2)))
    assert nothing.recall == 0.0
    assert np.isnan(nothing.median)


def test_the_true_matte_is_recomposed_without_halo(simulated):
    truth = simulated.truth
    alpha, paper = truth.alpha, truth.paper / 255
    cover = np.maximum(alpha, 1e-6)[..., None]
    ink = np.clip((simulated.image / 255 - (1 - cover) * paper) / cover, 0, 1)
    alpha = np.where(alpha > 0.05, alpha, 0)
    good = ground_truth_score.matte(simulated.image, truth, ink, alpha, paper)
    assert good.alpha < 0.02
    assert good.paper == 0.0
    assert good.halo < 0.002
    # white paper taken for ink
    around = np.where(truth.covered(0.05), 1.0, 0.0)
    white = ground_truth_score.matte(simulated.image, truth, simulated.image / 255, around, paper)
    assert white.recomposed < 1e-6
    assert white.halo > 0.05
    assert white.alpha > 0.1
    assert ground_truth_score.matte(simulated.image, truth, ink, 0.5 * alpha, paper).recomposed > 0.1
