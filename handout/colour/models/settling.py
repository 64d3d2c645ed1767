"""The nodes of a table, settled so that what is interpolated between them is right where colours can be printed.

The exact inverse bends most at the surface of the gamut, where half of a cell's nodes cannot be printed and may take
any value.  All nodes are moved, as little as will do, to where interpolated colours come out as wanted: a linear least
squares problem, because interpolation is linear in the nodes.
"""

from __future__ import annotations

import numpy as np

from handout.colour import convert
from handout.colour.models.forward import Forward, lattice
from handout.colour.tetrahedra import parts
from handout.values import Array

_GREYS, _WEIGHT = 256, 2.0  # the eye is more sensitive to greys (seed 000, Appendix K)
_STAY = 1.0  # ΔE per unit of device RGB: what moving a node costs
_ROUNDS = 40


def settled(forward: Forward, nodes: Array, side: int) -> Array:
    """(side³, 3) nodes, device RGB, moved from `nodes`."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.linalg import LinearOperator, cg

    greys = np.repeat(np.linspace(0, 1, _GREYS)[:, None], 3, axis=1)
    device = np.concatenate([lattice(len(forward.grid)), greys])
    seen = forward.inside(device)
    corners, shares = parts(side, np.ascontiguousarray(seen.T))
    rows = np.tile(np.arange(len(device)), 4)
    mixing = csr_matrix((np.concatenate(shares), (rows, np.concatenate(corners))), shape=(len(device), len(nodes)))
    steep = _looks(forward, device, seen)
    steep[-_GREYS:] *= _WEIGHT
    normal = np.einsum("nki,nkj->nij", steep, steep)

    def pull(moved: Array) -> Array:
        away = mixing @ moved.reshape(nodes.shape)
        back = mixing.T @ np.einsum("nij,nj->ni", normal, away)
        return np.asarray(back.ravel() + _STAY**2 * moved.ravel())

    error = np.einsum("nij,nj->ni", normal, device - mixing @ nodes)
    square = mixing.multiply(mixing).T @ np.einsum("nii->ni", normal) + _STAY**2
    problem = LinearOperator((nodes.size, nodes.size), matvec=pull, dtype=np.float64)
    easier = LinearOperator(problem.shape, matvec=lambda moved: moved / square.ravel(), dtype=np.float64)
    move = cg(problem, (mixing.T @ error).ravel(), maxiter=_ROUNDS, rtol=1e-4, M=easier)[0]
    return np.asarray(nodes + move.reshape(nodes.shape))


def _looks(forward: Forward, device: Array, seen: Array) -> Array:
    """(n, 3, 3): how the evened L*a*b* of what is seen changes with (n, 3) device RGB."""
    slopes = forward.slopes(device, seen)
    base, tiny = convert.evened(convert.lab(seen)), 1e-4
    turned = [(convert.evened(convert.lab(seen + tiny * axis)) - base) / tiny for axis in np.eye(3)]
    return np.asarray(np.einsum("nki,nij->nkj", np.stack(turned, axis=2), slopes))
