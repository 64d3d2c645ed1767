"""The cheapest sequence of states is the cheapest of all."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.chains import viterbi


class Listed:
    """A step that hides its table."""

    def __init__(self, pairs):
        self.pairs = pairs

    def totals(self, costs):
        return (costs[:, None] + self.pairs).min(axis=0)

    def origin(self, costs, state):
        return int((costs + self.pairs[:, state]).argmin())


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(1, 4), min_size=1, max_size=5), st.integers(0, 2**32 - 1), st.booleans())
def test_the_cheapest_sequence_is_the_cheapest_of_all(sizes, seed, hidden):
    rng = np.random.default_rng(seed)
    unary = [rng.normal(size=k) for k in sizes]
    steps = [rng.normal(size=pair) for pair in pairwise(sizes)]

    def cost(path):
        between = sum(step[a, b] for step, a, b in zip(steps, path, path[1:], strict=False))
        return between + sum(own[k] for own, k in zip(unary, path, strict=True))

    path = viterbi(unary, [Listed(step) for step in steps] if hidden else steps)
    assert cost(path) == pytest.approx(min(cost(p) for p in product(*map(range, sizes))))


def test_among_equals_the_first_is_taken():
    assert viterbi([np.zeros(3)] * 4, [np.zeros((3, 3))] * 3) == [0, 0, 0, 0]
