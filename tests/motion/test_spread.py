import numpy as np
import pytest

from handout.motion import covariance
from handout.values import ActionPlan


def test_semi_tied_covariances_share_their_shape():
    basis = np.array([[2.0, 1.0], [0.0, 1.0]])
    first, second = covariance.tie_covariances(basis, [1.0, 4.0])
    assert np.allclose(first, basis @ basis.T)
    assert np.allclose(second, 4 * first)


def test_a_plan_without_covariances_has_circles_in_proportion_to_its_step():
    plan = ActionPlan(np.array([[0, 0], [2.0, 0], [2, 2]]), 0.1, 0.3)
    assert np.allclose(covariance.plan_covariances(plan), (0.05 * 2) ** 2 * np.eye(2))
    assert not covariance.plan_covariances(ActionPlan(np.ones((3, 2)), 0.1, 0.3)).any()


def test_only_what_cannot_be_inverted_is_lifted():
    targets = np.array([[0, 0], [10.0, 0], [10, 1]])
    given = np.stack([np.eye(2), np.diag([1.0, 0.0]), np.zeros((2, 2))])
    settled = covariance.settle_covariances(given, targets)
    assert (settled[0] == given[0]).all()
    assert np.allclose(settled[1], np.diag([1, 1e-7]), rtol=1e-9, atol=0)
    assert np.allclose(settled[2], 1e-7 * np.eye(2), rtol=1e-9, atol=0)


@pytest.mark.parametrize("wrong", [np.eye(2), np.full((1, 2, 2), np.nan), np.array([[[1.0, 2], [2, 1]]])])
def test_refuses_what_is_no_covariance(wrong):
    with pytest.raises(ValueError):
        covariance.settle_covariances(wrong, np.zeros((1, 2)))


def test_draws_have_their_covariances():
    cos, sin = np.cos([0.5, -1.0]), np.sin([0.5, -1.0])
    columns = np.array([[cos, -sin], [sin, cos]]).transpose(2, 0, 1) * np.array([[3.0, 1.0], [0.5, 0.0]])[:, None]
    covariances = columns @ columns.transpose(0, 2, 1)  # of ellipses with those half axes, turned
    rng = np.random.default_rng(0)
    draws = np.stack([covariance.draw(covariances, rng) for _ in range(4000)])
    found = np.einsum("kmi,kmj->mij", draws, draws) / len(draws)
    assert np.abs(found - covariances).max() < 0.6
    assert np.allclose(covariance.root(covariances) @ covariance.root(covariances), covariances)
