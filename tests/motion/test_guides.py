"""Guides of the velocity, against a dense solution, and as the specification measured them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.motion.tracker import Guide, mean, tracker

TARGETS = np.random.default_rng(0).normal(size=(7, 2)) * 3


def ways(xy):
    """Length of the movement in x and in y."""
    return np.abs(np.diff(xy, axis=0)).sum(axis=0)


def dense(targets, smooth, grid, order, guide):
    """The same problem as one full system."""
    n = len(targets) * grid
    hessian, force = np.eye(2 * n), np.repeat(targets, grid, axis=0).ravel()
    difference = np.diff(np.eye(n), order, axis=0)
    hessian = hessian + np.kron((smooth * grid) ** (2 * order) * difference.T @ difference, np.eye(2))
    for t, precision in enumerate(guide.precisions(len(targets), grid)):
        step = np.zeros((2, 2 * n))
        step[:, 2 * t : 2 * t + 2], step[:, 2 * t + 2 : 2 * t + 4] = -np.eye(2), np.eye(2)
        hessian += step.T @ precision @ step
        if guide.wanted is not None:
            force = force + step.T @ precision @ (guide.wanted / grid)
    return np.linalg.solve(hessian, force).reshape(n, 2)


@pytest.mark.parametrize("mode", ["along", "avoid"])
@pytest.mark.parametrize("wanted", [None, np.array([1.0, 0.5])])
@pytest.mark.parametrize("order", [2, 4])
def test_equals_the_dense_solution(mode, wanted, order):
    guide = Guide(np.array([0.6, 0.8]), 0.3, mode, wanted)
    ours = mean(TARGETS, smooth=0.25, steps=10, order=order, ends="free", guide=guide)
    assert np.allclose(ours, dense(TARGETS, 0.25, 10, order, guide), atol=1e-7)


def test_along_damps_across_and_avoid_damps_along():
    free = ways(mean(TARGETS, smooth=0.25))
    level = np.array([1.0, 0.0])
    along = ways(mean(TARGETS, smooth=0.25, guide=Guide(level, 0.5, "along")))
    avoid = ways(mean(TARGETS, smooth=0.25, guide=Guide(level, 0.5, "avoid")))
    assert along[1] < 0.5 * free[1] and along[0] > 0.97 * free[0]
    assert avoid[0] < 0.5 * free[0] and avoid[1] == pytest.approx(free[1], rel=1e-9)


@settings(max_examples=25)
@given(angle=st.floats(-4, 4), weak=st.floats(0, 0.5), more=st.floats(0.05, 1))
def test_a_stronger_guide_damps_more(angle, weak, more):
    along = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-along[1], along[0]])

    def moved(strength):
        step = np.diff(mean(TARGETS, smooth=0.25, guide=Guide(along, strength)), axis=0)
        return float(((step @ across) ** 2).sum())

    assert moved(weak + more) < moved(weak)


def test_a_direction_for_each_target_and_no_strength():
    angles = np.linspace(0, 3, len(TARGETS))
    each = np.column_stack([np.cos(angles), np.sin(angles)])
    guided = mean(TARGETS, smooth=0.25, steps=10, ends="free", guide=Guide(each, 0.4))
    assert np.allclose(guided, dense(TARGETS, 0.25, 10, 4, Guide(each, 0.4)), atol=1e-7)
    assert np.allclose(mean(TARGETS, smooth=0.25, guide=Guide(each, 0.0)), mean(TARGETS, smooth=0.25), atol=1e-8)


def test_noise_is_of_the_asked_size_with_a_guide_too():
    solver = tracker(np.ones(6), smooth=0.25, guide=Guide(np.array([1.0, 0.0]), 0.4))
    rng = np.random.default_rng(1)
    at = np.array([solver.noise(rng, 2)[10::20] for _ in range(1500)])
    assert np.allclose(at[:, 2:4].std(axis=0), 1.0, atol=0.1)


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="unit vectors"):
        Guide(np.array([1.0, 1.0]), 0.3)
    with pytest.raises(ValueError, match="outside 0 to 100"):
        Guide(np.array([1.0, 0.0]), -1.0)
