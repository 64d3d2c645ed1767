"""The chain of the paper: exact on short lines, and its features are those of the line graph."""

from itertools import product

import numpy as np
import pytest

from benchmarks.haines_2016 import _FLOOR, column_features, laid, log_probability
from handout.alphabet import LETTERS, SPACE
from handout.tagging.line_space import HEIGHT, STEP


def by_trying(log, letters):
    states = [LETTERS.index(SPACE)]
    for letter in letters:
        states += [LETTERS.index(letter), LETTERS.index(SPACE)]
    best = -np.inf
    for way in product(range(len(states)), repeat=len(log)):
        steps = np.diff(way)
        legal = way[0] in (0, 1) and way[-1] >= len(states) - 2
        legal = legal and all(s in (0, 1) or (s == 2 and way[i + 1] % 2) for i, s in enumerate(steps))
        if legal:
            best = max(best, sum(log[row, states[s]] for row, s in enumerate(way)))
    return best


@pytest.mark.slow
@pytest.mark.parametrize("letters", ["a", "ab", "no"])
@pytest.mark.parametrize("seed", range(3))
def test_it_equals_brute_force(letters, seed):
    log = np.random.default_rng(seed).normal(-2, 1, (6, len(LETTERS)))
    assert laid(log, letters).score == pytest.approx(by_trying(log, letters))


def test_clear_columns_are_cut_where_they_change():
    log = np.full((30, len(LETTERS)), -9.0)
    for row, letter in enumerate([SPACE] * 5 + ["a"] * 8 + ["b"] * 7 + [SPACE] * 10):
        log[row, LETTERS.index(letter)] = 0.0
    found = laid(log, "ab")
    assert (found.left / STEP).tolist() == [5, 13] and (found.right / STEP).tolist() == [13, 20]


def test_columns_have_features_where_there_is_ink():
    image = np.zeros((HEIGHT, 120), np.uint8)
    image[40:60, 50:53] = 255
    image[57:60, 50:80] = 255
    features = column_features(image)
    inky = np.flatnonzero(features.any(axis=1))
    assert features.shape == (60, 216)
    assert inky.min() >= 24 and inky.max() <= 40
    assert features[inky].sum(axis=1) == pytest.approx(np.ones(len(inky)), abs=1e-4)
    assert not column_features(np.zeros((HEIGHT, 60), np.uint8)).any()


class Forest:
    """Says 'a' to everything."""

    classes_ = np.array([LETTERS.index("a"), LETTERS.index("b")])

    def predict_proba(self, rows):
        return np.tile([1.0, 0.0], (len(rows), 1))


def test_without_ink_there_is_only_space():
    image = np.zeros((HEIGHT, 80), np.uint8)
    image[40:60, 40:43] = 255
    log = log_probability(Forest(), image)
    assert log[0].argmax() == LETTERS.index(SPACE) and log[20].argmax() == LETTERS.index("a")
    assert np.exp(log).sum(axis=1) == pytest.approx(np.ones(len(log)))
    assert np.exp(log[20, LETTERS.index("b")]) == pytest.approx(_FLOOR, rel=0.2)
