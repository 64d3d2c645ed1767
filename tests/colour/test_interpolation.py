from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.colour.models.forward import lattice, look_up, parts

RNG = np.random.default_rng(1)
NODES = RNG.normal(size=(9, 9, 9, 3)).astype(np.float32)


def test_at_the_nodes_it_is_the_table() -> None:
    np.testing.assert_array_equal(look_up(NODES, lattice(9)), NODES.reshape(-1, 3))


@pytest.mark.parametrize("side", [2, 9, 33])
def test_linear_functions_are_exact(side: int) -> None:
    slope, base = RNG.normal(size=(3, 3)), RNG.normal(size=3)
    nodes = (lattice(side) @ slope + base).reshape(side, side, side, 3).astype(np.float32)
    colours = RNG.random((20_000, 3))
    np.testing.assert_allclose(look_up(nodes, colours), colours @ slope + base, atol=2e-6)


def test_as_trilinear_along_the_edges_of_a_cell_and_between_its_corners_elsewhere() -> None:
    from scipy.ndimage import map_coordinates

    along = np.column_stack([RNG.random(100), RNG.integers(0, 9, 100) / 8, RNG.integers(0, 9, 100) / 8])
    trilinear = np.stack([map_coordinates(NODES[..., c], along.T * 8, order=1) for c in range(3)], axis=1)
    np.testing.assert_allclose(look_up(NODES, along), trilinear, atol=1e-5)
    anywhere = RNG.random((500, 3))
    value = look_up(NODES, anywhere)
    cell = np.minimum((anywhere * 8).astype(int), 7)
    corners = np.stack([NODES[tuple((cell + np.array(d)).T)] for d in np.ndindex(2, 2, 2)])
    assert (value >= corners.min(axis=0) - 1e-5).all() and (value <= corners.max(axis=0) + 1e-5).all()


@given(st.lists(st.tuples(*(st.floats(-0.5, 1.5, width=32) for _ in range(3))), min_size=1, max_size=8))
def test_shares_are_of_a_simplex_around_the_colour(colours) -> None:
    asked = np.array(colours, dtype=np.float64).T
    corners, shares = parts(17, asked)
    assert min(share.min() for share in shares) >= -1e-12
    np.testing.assert_allclose(sum(shares), 1, atol=1e-12)
    met = sum(share[:, None] * lattice(17)[corner] for corner, share in zip(corners, shares, strict=True))
    np.testing.assert_allclose(met, np.clip(asked.T, 0, 1), atol=1e-12)
