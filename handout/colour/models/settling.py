"""The nodes of a table, settled so that what is interpolated between them is right where colours can be printed.

The exact inverse bends most at the surface of the gamut, where half of a cell's nodes cannot be printed and may take
any value, and in the dark, where colours far apart are seen almost alike.  All nodes are moved, as little as will do,
to where interpolated colours come out as wanted: Gauss–Newton on what is seen of them, each step a linear least
squares problem because interpolation is linear in the nodes.  Colours that come out worst count the more in the next
step, so that the largest difference falls too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from handout.colour import convert
from handout.colour.models import inverse
from handout.colour.models.forward import Forward
from handout.colour.tetrahedra import parts
from handout.values import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_GREYS, _WEIGHT = 256, 2.0  # the eye is more sensitive to greys (seed 000, Appendix K)
_STAY = 10.0  # ΔE per unit of device RGB: what moving a node costs
_STEPS, _ROUNDS = 3, 40  # of Gauss–Newton, and of conjugate gradients in each
_PUSH, _RIM = 0.02, (0.25, 0.75)  # device; cells of the table
_LIGHT = 0.25  # of a colour beyond what can be printed
_WORST, _MOST = 0.5, 2.5  # ΔE: a colour that is off by it counts twice; how much the worst may count


def settled(forward: Forward, nodes: Array, side: int) -> Array:
    """(side³, 3) nodes, device RGB, moved from `nodes`: the best of what `nodes` and the steps give."""
    mixing, wanted, weight = _samples(forward, side)
    best, least = nodes, np.inf
    for step in range(_STEPS + 1):
        error, steep = _missing(forward, mixing @ nodes, wanted)
        away = np.linalg.norm(error, axis=1)
        count = weight * np.minimum(np.hypot(1, away / _WORST), _MOST)
        cost = float(((count * away) ** 2).sum())
        if cost < least:
            best, least = nodes, cost
        if step < _STEPS:
            nodes = nodes + _moves(mixing, steep * count[:, None, None], error * count[:, None], nodes.shape)
    return np.asarray(best)


def _samples(forward: Forward, side: int) -> tuple[csr_matrix, Array, Array]:
    """The share of each node in samples of scanned colours (n, nodes), the evened L*a*b* that they should have (n, 3),
    and how much each counts (n,)."""
    from scipy.sparse import csr_matrix

    greys = np.repeat(np.linspace(0, 1, _GREYS)[:, None], 3, axis=1)
    seen = np.concatenate([forward.samples[1], forward.inside(greys)])
    rim, shown = _rim(forward, 1 / (side - 1))
    weight = np.repeat([1.0, _WEIGHT, _LIGHT], [len(forward.samples[1]), _GREYS, len(rim)])
    wanted = np.concatenate([convert.evened(convert.lab(seen)), shown])
    corners, shares = parts(side, np.ascontiguousarray(np.concatenate([seen, rim]).T))
    rows = np.tile(np.arange(len(wanted)), 4)
    where = (rows, np.concatenate(corners))
    return csr_matrix((np.concatenate(shares), where), shape=(len(wanted), side**3)), wanted, weight


def _moves(mixing: csr_matrix, steep: Array, error: Array, shape: tuple[int, ...]) -> Array:
    """How far nodes are moved (of `shape`): least squares of the (n, 3) `error` that is left and of the moves."""
    from scipy.sparse.linalg import LinearOperator, cg

    normal = np.einsum("nki,nkj->nij", steep, steep)

    def pull(moved: Array) -> Array:
        away = mixing @ moved.reshape(shape)
        back = mixing.T @ np.einsum("nij,nj->ni", normal, away)
        return np.asarray(back.ravel() + _STAY**2 * moved.ravel())

    square = mixing.multiply(mixing).T @ np.einsum("nii->ni", normal) + _STAY**2
    problem = LinearOperator((square.size, square.size), matvec=pull, dtype=np.float64)
    easier = LinearOperator(problem.shape, matvec=lambda moved: moved / square.ravel(), dtype=np.float64)
    force = mixing.T @ np.einsum("nki,nk->ni", steep, error)
    return np.asarray(cg(problem, force.ravel(), maxiter=_ROUNDS, rtol=1e-4, M=easier)[0].reshape(shape))


def _missing(forward: Forward, sent: Array, wanted: Array) -> tuple[Array, Array]:
    """(n, 3) how far evened L*a*b* of what is sent, cut to 0–1, is from what is wanted, and (n, 3, 3) how it changes
    with what is sent: not at all with a channel that is cut and should be cut even more."""
    within = np.clip(sent, 0, 1)
    seen = forward.inside(within)
    slopes = forward.slopes(within, seen)
    base, tiny = convert.evened(convert.lab(seen)), 1e-4
    turned = [(convert.evened(convert.lab(seen + tiny * axis)) - base) / tiny for axis in np.eye(3)]
    steep = np.einsum("nki,nij->nkj", np.stack(turned, axis=2), slopes)
    error = wanted - base
    asked = np.einsum("nki,nk->ni", steep, error)
    outward = (sent - within) * asked >= 0
    steep[np.broadcast_to(((sent != within) & outward)[:, None, :], steep.shape)] = 0
    return error, steep


def _rim(forward: Forward, cell: float) -> tuple[Array, Array]:
    """(n, 3) scanned colours a little beyond what can be printed, and (n, 3) evened L*a*b* of the nearest printable."""
    device, seen = forward.skin
    push = np.where(device == 0, -_PUSH, np.where(device == 1, _PUSH, 0.0))
    outward = forward(device + push) - seen
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    rim = seen + cell * np.resize(_RIM, len(seen))[:, None] * outward
    rim = rim[((rim >= 0) & (rim <= 1)).all(axis=1)]
    printed = inverse.printable(forward, rim)[0]
    return rim, convert.evened(convert.lab(forward.inside(printed)))
