"""What a hand aimed at, found on the line it left."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.writing.bending import bend
from handout.writing.forms import targets


def line(*corners, step=0.01):
    """A polyline of vertices a step apart, and its edges."""
    parts = []
    for a, b in pairwise(corners):
        count = max(round(float(np.hypot(*np.subtract(b, a))) / step), 1)
        parts.append(np.asarray(a) + np.linspace(0, 1, count, endpoint=False)[:, None] * np.subtract(b, a))
    xy = np.concatenate([*parts, [corners[-1]]])
    return xy, np.full(len(xy), 0.012), np.column_stack([np.arange(len(xy) - 1), np.arange(1, len(xy))])


def test_ends_and_corners_are_targets_and_nothing_between_them():
    corners = [(0.0, 0.0), (0.1, 0.3), (0.2, 0.0), (0.3, 0.3)]
    found = targets(*line(*corners))
    away = np.hypot(*(found[:, None] - np.array(corners)[None]).transpose(2, 0, 1))
    assert len(found) == 4
    assert away.min(axis=0).max() < 0.03


def test_junctions_are_targets():
    xy, _, edges = line((0.0, 0.0), (0.4, 0.0))
    more = np.array([[0.2, 0.01 * k] for k in range(1, 25)])
    joint = np.column_stack([[20, *range(len(xy), len(xy) + 23)], range(len(xy), len(xy) + 24)])
    found = targets(np.concatenate([xy, more]), np.full(len(xy) + 24, 0.012), np.concatenate([edges, joint]))
    for place in ([0.0, 0.0], [0.4, 0.0], [0.2, 0.0], [0.2, 0.24]):
        assert np.hypot(*(found - place).T).min() < 0.02
    assert len(found) == 4


def test_a_dot_is_one_target():
    assert targets(np.zeros((1, 2)), np.array([0.02]), np.zeros((0, 2), dtype=np.intp)).tolist() == [[0.0, 0.0]]


@settings(max_examples=30, deadline=None)
@given(number=st.integers(0, 40), seed=st.integers(0, 10**6))
def test_targets_are_missed_each_by_its_own_and_never_far(small_manner, number, seed):
    form, spread = small_manner.forms[number], small_manner.spread
    made = bend(form, number, spread, 0.0, np.zeros(3), np.random.default_rng(seed), 1.0)
    assert np.abs(made.misses).max(initial=0.0) <= 2 * 0.06 * spread.x_height
    assert len(made.misses) == len(made.targets) == (len(form.targets) if len(made.waves) else 0)
    assert not len(made.misses) or len(np.unique(made.misses[:, 0])) == len(made.misses)
