import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from references import dense_batch, dense_covariance, riccati

from handout.motion import covariance, tracker
from handout.motion.banded import factorise
from handout.motion.tracker import mean, sample

# order → steps for which the band is solved as it is, not on a coarser grid
STEPS = {2: 25, 3: 25, 4: 25, 5: 15}


class UnitNoise:
    """Stands for a generator: all its normal numbers are 0 but one, so that a linear map can be read off."""

    def __init__(self, index):
        self.index, self.given = index, 0

    def standard_normal(self, shape):
        values = np.zeros(int(np.prod(shape)))
        if self.given <= self.index < self.given + len(values):
            values[self.index - self.given] = 1.0
        self.given += len(values)
        return values.reshape(shape)


def columns(draw):
    """The matrix of a linear map of white noise."""
    found = []
    while True:
        noise = UnitNoise(len(found))
        column = draw(noise)
        if len(found) >= noise.given:
            return np.stack(found, axis=-1)
        found.append(column)


def problem(seed, m, d=2):
    rng = np.random.default_rng(seed)
    targets = rng.normal(size=(m, d)).cumsum(axis=0)
    shape = rng.normal(size=(m, d, d)) * 0.1
    return targets, shape @ np.swapaxes(shape, 1, 2) + 1e-3 * np.eye(d)


@pytest.mark.parametrize("order", STEPS)
@pytest.mark.parametrize("smooth", [0.15, 0.25])
def test_equals_the_riccati_recursion(order, smooth):
    targets, covariances = problem(order, 60)
    ours = mean(targets, covariances, smooth=smooth, steps=STEPS[order], order=order, ends="fixed")
    theirs = riccati(targets, covariance.settle_covariances(covariances, targets), smooth, STEPS[order], order)
    assert np.abs(ours - theirs).max() <= 1e-6 * np.ptp(targets, axis=0).max()


def test_riccati_equals_the_dense_batch_where_that_still_works():
    targets, covariances = problem(1, 6)
    assert np.allclose(
        riccati(targets, covariances, 0.25, 10, 3), dense_batch(targets, covariances, 0.25, 10, 3), atol=1e-7
    )


@pytest.mark.parametrize("ends", ["free", "rest"])
@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_mean_equals_the_dense_solution(ends, dimensions):
    targets, covariances = problem(2, 7, dimensions)
    precision, _ = tracker.relative(covariance.settle_covariances(covariances, targets))
    weights = np.repeat(precision, 10, axis=0)
    force = np.einsum("tij,tj->ti", weights, np.repeat(targets, 10, axis=0))
    dense = dense_covariance(weights, 3.0**8, 4, ends) @ force.reshape(-1)
    ours = mean(targets, covariances, smooth=0.3, steps=10, ends=ends)
    assert np.allclose(ours, dense.reshape(-1, dimensions), atol=1e-7)


def test_covariances_that_are_alike_and_round_are_as_none():
    targets, _ = problem(3, 9)
    alike = np.broadcast_to(0.04 * np.eye(2), (9, 2, 2))
    assert np.allclose(mean(targets, smooth=0.3), mean(targets, alike, smooth=0.3), atol=1e-7)


@pytest.mark.parametrize("ends", ["free", "rest", "fixed"])
@pytest.mark.parametrize("dimensions", [1, 2])
def test_noise_of_the_chain_has_the_covariance_of_the_posterior(ends, dimensions):
    _, covariances = problem(4, 4, dimensions)
    precision, _ = tracker.relative(covariances)
    weights = np.repeat(precision, 10, axis=0)
    start, end = {"free": ("free", "free"), "rest": ("rest", "rest"), "fixed": ("fixed", "free")}[ends]
    chain = factorise(weights, 3.0**8, 4, start, end)
    root = columns(lambda rng: chain.noise(rng, dimensions)).reshape(40 * dimensions, -1)
    dense = dense_covariance(weights, 3.0**8, 4, ends)
    assert np.abs(root @ root.T - dense).max() <= 1e-6 * dense.max()


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["free", "rest", "fixed"])
@pytest.mark.parametrize("order", [2, 4, 5])
@pytest.mark.parametrize("smooth", [0.1, 0.3, 0.4])
def test_samples_have_the_wanted_covariance_at_the_centres(ends, order, smooth):
    """Read off the linear map itself, so that there is no chance in it; steps 11 have a sample at each centre."""
    targets, covariances = problem(5, 5)
    settled = covariance.settle_covariances(covariances, targets)
    path = mean(targets, covariances, smooth=smooth, steps=11, order=order, ends=ends)

    def draw(rng):
        return sample(targets, covariances, rng, smooth=smooth, steps=11, order=order, ends=ends, jitter=0.5) - path

    at = tracker.centres(columns(draw), 11)
    found = np.einsum("mik,mjk->mij", at, at)
    assert np.allclose(found, 0.25 * settled, rtol=0.05, atol=0.02 * np.abs(settled).max())
    deviation, wanted = (np.sqrt(np.einsum("mii->mi", c)) for c in (found, 0.25 * settled))
    assert np.abs(deviation / wanted - 1).max() < 0.05


def test_samples_of_long_chains_are_as_loose_as_wanted_everywhere():
    rng = np.random.default_rng(6)
    _, covariances = problem(6, 70)
    precision, size = tracker.relative(covariances)
    solver = tracker.tracker(precision, smooth=0.3)
    draws = size * np.stack([solver.noise(rng, 2) for _ in range(400)], axis=1)
    at = tracker.centres(draws, 20)
    ratio = np.sqrt((at**2).mean(axis=1) / np.einsum("mii->mi", covariances))
    assert abs(ratio.mean() - 1) < 0.01
    assert ratio.min() > 0.85 and ratio.max() < 1.15  # four standard errors of 400 draws


def test_the_size_of_the_noise_does_not_depend_on_the_steps():
    deviations = []
    for steps in (8, 16, 32):
        solver = tracker.tracker(np.ones(12), smooth=0.25, steps=steps)
        posterior = solver.bandwidth_gain() * np.sqrt(solver._centre_covariances[4:8])
        deviations.append(posterior)
    assert np.allclose(deviations, 1, atol=0.02)


@settings(max_examples=60, deadline=None)
@given(
    smooth=st.floats(0.05, 1),
    order=st.integers(2, 5),
    m=st.integers(1, 200),
    steps=st.integers(6, 30),
    ends=st.sampled_from(["free", "rest", "fixed"]),
    seed=st.integers(0, 99),
)
def test_no_chain_is_too_stiff(smooth, order, m, steps, ends, seed):
    targets, covariances = problem(seed, m)
    path = sample(
        targets, covariances, np.random.default_rng(0), smooth=smooth, order=order, steps=steps, ends=ends, jitter=0.1
    )
    assert path.shape == (m * steps, 2)
    assert np.isfinite(path).all()
    extent = np.ptp(targets, axis=0).max() + 1
    assert (path > targets.min(axis=0) - extent).all() and (path < targets.max(axis=0) + extent).all()


def test_the_coarser_grid_of_a_stiff_chain_changes_little(monkeypatch):
    targets, _ = problem(7, 12)
    fine = mean(targets, smooth=0.4)
    monkeypatch.setattr(tracker, "STIFFEST", 1e8)
    assert tracker.tracker(np.ones(12), smooth=0.4).grid < 20
    coarse = mean(targets, smooth=0.4)
    assert coarse.shape == fine.shape
    assert np.abs(coarse - fine).max() < 0.01 * np.ptp(targets, axis=0).max()


@settings(max_examples=30, deadline=None)
@given(scale=st.floats(1e-3, 1e3), x=st.floats(-1e3, 1e3), angle=st.floats(-4, 4), seed=st.integers(0, 99))
def test_moves_turns_and_grows_with_its_targets(scale, x, angle, seed):
    targets, covariances = problem(seed, 8)
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = mean(targets @ turn.T + [x, -x], turn @ covariances @ turn.T, smooth=0.3)
    assert np.allclose(moved, mean(targets, covariances, smooth=0.3) @ turn.T + [x, -x], atol=1e-5 * scale + 1e-9)


@pytest.mark.parametrize("ends", ["fixed", "rest"])
def test_a_start_at_rest_is_at_rest_exactly(ends):
    targets, covariances = problem(8, 6)
    path = mean(targets, covariances, smooth=0.3, order=4, ends=ends)
    assert (path[:4] == path[0]).all()
    if ends == "fixed":
        assert (path[0] == targets[0]).all()
    else:
        assert (path[-4:] == path[-1]).all()


@pytest.mark.parametrize("ends", ["free", "rest", "fixed"])
def test_one_target_and_targets_that_coincide_are_constant(ends):
    assert (mean([[2.0, 3.0]], smooth=0.3, ends=ends) == [2, 3]).all()
    assert np.allclose(mean(np.full((5, 2), 7.0), smooth=0.3, ends=ends), 7, atol=1e-12)


def test_a_target_that_is_exact_in_one_direction_is_met_in_that_direction():
    targets = np.array([[0, 0], [1, 1.0], [2, 0], [3, 1], [4, 0]])
    singular = np.broadcast_to(np.diag([0.01, 0]), (5, 2, 2))
    error, usual = (np.abs(tracker.centres(mean(targets, c, smooth=0.5), 20) - targets)[1:4] for c in (singular, None))
    assert error[:, 1].max() < 0.25 * usual[:, 1].max()


@pytest.mark.parametrize(
    "wrong",
    [
        {"order": 1},
        {"order": 6},
        {"steps": 4},
        {"smooth": 0.0},
        {"smooth": 5.0},
        {"targets": [[np.nan, 0]]},
        {"targets": np.zeros((0, 2))},
        {"covariances": np.ones((3, 3, 3))},
        {"covariances": -np.broadcast_to(np.eye(2), (3, 2, 2))},
    ],
)
def test_refuses_what_it_cannot_follow(wrong):
    given = {"targets": np.eye(3)[:, :2], "smooth": 0.3} | wrong
    with pytest.raises(ValueError):
        mean(**given)
