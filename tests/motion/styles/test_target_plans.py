"""Several references in their own frames are one: the product of their Gaussians, as tracking both would have it."""

import numpy as np
import pytest

from handout.motion.styles.target_plans import TargetPlan, TargetReference, fuse_references
from handout.motion.tracker import mean
from handout.values import Page


def test_tracking_two_references_is_tracking_their_product():
    rng = np.random.default_rng(1)
    places = rng.uniform(0, 50, (6, 2))
    roots = rng.normal(size=(2, 6, 2, 2))
    spreads = roots @ np.swapaxes(roots, 2, 3) + 0.3 * np.eye(2)
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    one, two = (
        TargetReference(places, spreads[0]),
        TargetReference(places + 3, spreads[1], 1.5 * turn, np.array([4.0, -2.0])),
    )
    together, ellipses = fuse_references([one, two])

    def cost(xy):
        total = 0.0
        for reference in (one, two):
            at, around = reference.on_page()
            off = xy - at
            total += np.einsum("mi,mij,mj->m", off, np.linalg.inv(around), off)
        return total

    least = cost(together)
    for _ in range(20):
        step = rng.normal(0, 0.5, (6, 2))
        more = np.einsum("mi,mij,mj->m", step, np.linalg.inv(ellipses), step)
        np.testing.assert_allclose(cost(together + step), least + more, rtol=1e-9)
    assert mean(together, ellipses, smooth=0.25).shape[1] == 2


def test_targets_are_parted_where_the_pen_is_lifted():
    plan = TargetPlan((TargetReference(np.arange(10.0).reshape(5, 2)),), Page(10.0, 10.0), (1, 1, 4))
    assert [len(xy) for xy, _ in plan.parts()] == [2, 3] and not plan.has_ellipses
    with pytest.raises(ValueError, match="same number"):
        fuse_references([])
