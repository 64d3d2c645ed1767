"""The device colour that gives a wanted scanned colour, and the nodes of a table that interpolates such colours well.

`invert` solves the forward model by Gauss–Newton; out of gamut it takes the printable colour that looks nearest (ΔE00).
`optimised_nodes` then moves the nodes of a table: the exact inverse bends most at the surface of the gamut, where half
of a cell's nodes cannot be printed and may take any value, and in the dark, where colours far apart are seen almost
alike.  All nodes are moved, as little as will do, to where interpolated colours come out as wanted: Gauss–Newton on
what is seen of them, each step a linear least-squares problem because interpolation is linear in the nodes.  Colours
that come out worst count more in the next step, so that the largest difference falls too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from handout.colour import conversions
from handout.colour.models.forward import Forward, look_up, measure_misses, parts
from handout.libraries import sparse, spatial
from handout.values import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


@dataclass(frozen=True)
class InversionSettings:
    """How device values are found for a colour, and the nearest where none prints it."""

    rounds: int = 10  # of Gauss–Newton, at most
    done: float = 2e-4  # scanned: error at which a colour is met
    damping: float = 1e-6  # of squared slopes
    leap: float = 0.25  # device: the longest step
    beyond: float = 0.5  # device: how far out of 0–1 a colour may go
    candidates: int = 8  # samples, near in evened L*a*b*, of which ΔE00 chooses
    shell: float = 1.8 / 32  # scanned: a little more than the diagonal of a cell of the usual table
    seen: float = 0.1  # ΔE00 below which nothing nearer is looked for
    clearly: float = 0.1  # the exact inverse beyond the surface is given up where that loses less by so much ΔE00
    far: float = 2.0  # ΔE00 within which the printable colour that looks nearest may lead to the exact inverse
    steps: tuple[float, float] = (1 / 64, 1 / 128)  # device: of the refinement


SETTINGS = InversionSettings()


def solve(forward: Forward, wanted: Array, start: Array) -> Array:
    """(n, 3) device RGB, unclamped, whose scanned RGB is (n, 3) `wanted`, from (n, 3) device RGB to `start` at."""
    device = start.copy()
    left = np.arange(len(device))
    for _ in range(SETTINGS.rounds):
        within = np.clip(device[left], 0, 1)
        base = forward.inside(within)
        slopes = forward.slopes(within, base)
        error = wanted[left] - base - np.einsum("nij,nj->ni", slopes, device[left] - within)
        square = np.einsum("nji,njk->nik", slopes, slopes) + SETTINGS.damping * np.eye(3)
        step = np.linalg.solve(square, np.einsum("nji,nj->ni", slopes, error)[..., None])[..., 0]
        device[left] = np.clip(
            device[left] + np.clip(step, -SETTINGS.leap, SETTINGS.leap), -SETTINGS.beyond, 1 + SETTINGS.beyond
        )
        left = left[np.abs(error).max(axis=1) > SETTINGS.done]
        if not len(left):
            break
    return device


def nearest(forward: Forward, wanted: Array) -> Array:
    """(n, 3) device RGB in 0–1 of the printable colours that look nearest to (n, 3) scanned RGB out of gamut.

    The nearest sample by ΔE00, then parabolas along each channel at two scales, on colours interpolated
    linearly: the foot of a distance hardly moves with what that is off.
    """
    device, scanned = forward.samples
    labs, aim = conversions.lab(scanned), conversions.lab(wanted)
    near = spatial.KDTree(conversions.bend_chroma(labs)).query(conversions.bend_chroma(aim), k=SETTINGS.candidates)[1]
    far = conversions.delta_e(labs[near], aim[:, None, :])
    rows, best = np.arange(len(aim)), far.argmin(axis=1)
    device_best, cost = device[near[rows, best]], far[rows, best]
    for step in SETTINGS.steps:
        device_best, cost = _refine_channels(forward, aim, device_best, cost, step)
    return np.asarray(device_best)


def _refine_channels(forward: Forward, aim: Array, device: Array, cost: Array, step: float) -> tuple[Array, Array]:
    """Move each channel to the foot of the parabola through three squared differences, where that is better."""
    for channel in range(3):
        move = np.zeros(3)
        move[channel] = step
        below, above = (_cost(forward, aim, np.clip(device + way * move, 0, 1)) ** 2 for way in (-1, 1))
        bend = below + above - 2 * cost**2
        shift = np.where(bend > 1e-9, (below - above) / (2 * np.maximum(bend, 1e-9)), np.sign(below - above))
        moved = np.clip(device + np.clip(shift, -1, 1)[:, None] * move, 0, 1)
        reached = _cost(forward, aim, moved)
        better = reached < cost
        device, cost = np.where(better[:, None], moved, device), np.where(better, reached, cost)
    return device, cost


def _cost(forward: Forward, aim: Array, device: Array) -> Array:
    return conversions.delta_e(look_up(forward.looks, device), aim)


def invert(forward: Forward, wanted: Array) -> Array:
    """(n, 3) device RGB of (n, 3) scanned RGB.

    In gamut, and out of it by less than a cell of a table, the exact inverse, unclamped, so that a table stays
    accurate up to the surface; farther out, the printable colour that looks nearest.  In the dark, where black ink
    takes over from the others, colours far apart are seen almost alike, and the way from the nearest sample may end
    outside the cube although the colour can be printed: where cutting to 0–1 loses anything, the search begins anew at
    the printable colour that looks nearest, and what loses clearly less is taken.
    """
    device, scanned = forward.samples
    # those farther out all become what `_improve` finds: their nearest sample, slow to find, is not looked for
    away, which = spatial.KDTree(scanned).query(wanted, distance_upper_bound=SETTINGS.shell)
    out, close = np.zeros_like(wanted), away <= SETTINGS.shell
    out[close] = solve(forward, wanted[close], device[which[close]])
    lost = np.where(close, 0.0, np.inf)
    lost[close] = measure_misses(forward, out[close], wanted[close])
    off = np.flatnonzero(lost > SETTINGS.seen)
    if len(off):
        out[off] = _improve(forward, wanted[off], out[off], lost[off])
    return out


def _improve(forward: Forward, wanted: Array, current: Array, lost: Array) -> Array:
    """(n, 3) device RGB: `found`, which loses (n,) ΔE00 when it is cut, or what loses clearly less."""
    printed = nearest(forward, wanted)
    short = measure_misses(forward, printed, wanted)
    near = short < np.minimum(lost, SETTINGS.far)
    again = printed.copy()
    again[near] = solve(forward, wanted[near], printed[near])
    least = measure_misses(forward, again, wanted)
    best = np.where((least <= short)[:, None], again, printed)
    return np.where((np.minimum(least, short) < lost - SETTINGS.clearly)[:, None], best, current)


def printable(forward: Forward, wanted: Array) -> tuple[Array, Array]:
    """The printable colours nearest to (n, 3) scanned RGB: (n, 3) device RGB in 0–1, and (n,) ΔE00 that is lost."""
    device = np.clip(invert(forward, wanted), 0, 1)
    lost = measure_misses(forward, device, wanted)
    off = np.flatnonzero(lost > SETTINGS.seen)
    if len(off):
        other = nearest(forward, wanted[off])
        short = measure_misses(forward, other, wanted[off])
        nearer = short < lost[off]
        device[off[nearer]], lost[off[nearer]] = other[nearer], short[nearer]
    return device, lost


@dataclass(frozen=True)
class InverseSettings:
    """How the nodes of the table are moved so that colours between them come out right."""

    greys: int = 256  # that are fitted besides the samples
    weight: float = 2.0  # of each: the eye is more sensitive to greys (seed 000, Appendix K)
    stay: float = 10.0  # ΔE per unit of device RGB: what moving a node costs
    newton_steps: int = 2  # of Gauss–Newton
    cg_rounds: int = 40  # of conjugate gradients, in each step
    push: float = 0.02  # device
    rim: tuple[float, float] = (0.25, 0.75)  # cells of the table
    light: float = 0.25  # of a colour beyond what can be printed
    worst: float = 0.5  # ΔE: a colour that is off by it counts twice
    most: float = 2.5  # how much the worst may count


FIT = InverseSettings()


def optimised_nodes(forward: Forward, nodes: Array, side: int) -> Array:
    """(side³, 3) nodes, device RGB, moved from `nodes`: the best of what `nodes` and the steps give."""
    mixing, wanted, weight = _samples(forward, side)
    best, least = nodes, np.inf
    for step in range(FIT.newton_steps + 1):
        error, steep = _residual(forward, mixing @ nodes, wanted)
        away = np.linalg.norm(error, axis=1)
        count = weight * np.minimum(np.hypot(1, away / FIT.worst), FIT.most)
        cost = float(((count * away) ** 2).sum())
        if cost < least:
            best, least = nodes, cost
        if step < FIT.newton_steps:
            nodes = nodes + _solve_moves(mixing, steep * count[:, None, None], error * count[:, None], nodes.shape)
    return np.asarray(best)


def _samples(forward: Forward, side: int) -> tuple[sparse.csr_matrix, Array, Array]:
    """The share of each node in samples of scanned colours (n, nodes), the evened L*a*b* that they should have (n, 3),
    and how much each counts (n,)."""
    greys = np.repeat(np.linspace(0, 1, FIT.greys)[:, None], 3, axis=1)
    scanned = np.concatenate([forward.samples[1], forward.inside(greys)])
    rim, shown = _rim(forward, 1 / (side - 1))
    weight = np.repeat([1.0, FIT.weight, FIT.light], [len(forward.samples[1]), FIT.greys, len(rim)])
    wanted = np.concatenate([conversions.bend_chroma(conversions.lab(scanned)), shown])
    corners, shares = parts(side, np.ascontiguousarray(np.concatenate([scanned, rim]).T))
    rows = np.tile(np.arange(len(wanted)), 4)
    where = (rows, np.concatenate(corners))
    return sparse.csr_matrix((np.concatenate(shares), where), shape=(len(wanted), side**3)), wanted, weight


def _solve_moves(mixing: csr_matrix, steep: Array, error: Array, shape: tuple[int, ...]) -> Array:
    """How far nodes are moved (of `shape`): least squares of the (n, 3) `error` that is left and of the moves."""
    from scipy.sparse.linalg import LinearOperator, cg

    normal = np.einsum("nki,nkj->nij", steep, steep)

    def pull(moved: Array) -> Array:
        away = mixing @ moved.reshape(shape)
        back = mixing.T @ np.einsum("nij,nj->ni", normal, away)
        return np.asarray(back.ravel() + FIT.stay**2 * moved.ravel())

    square = mixing.multiply(mixing).T @ np.einsum("nii->ni", normal) + FIT.stay**2
    problem = LinearOperator((square.size, square.size), matvec=pull, dtype=np.float64)
    easier = LinearOperator(problem.shape, matvec=lambda moved: moved / square.ravel(), dtype=np.float64)
    force = mixing.T @ np.einsum("nki,nk->ni", steep, error)
    return np.asarray(cg(problem, force.ravel(), maxiter=FIT.cg_rounds, rtol=1e-4, M=easier)[0].reshape(shape))


def _residual(forward: Forward, sent: Array, wanted: Array) -> tuple[Array, Array]:
    """(n, 3) how far evened L*a*b* of what is sent, cut to 0–1, is from what is wanted, and (n, 3, 3) how it changes
    with what is sent: not at all with a channel that is cut and should be cut even more."""
    within = np.clip(sent, 0, 1)
    scanned = forward.inside(within)
    slopes = forward.slopes(within, scanned)
    base, tiny = conversions.bend_chroma(conversions.lab(scanned)), 1e-4
    turned = [(conversions.bend_chroma(conversions.lab(scanned + tiny * axis)) - base) / tiny for axis in np.eye(3)]
    steep = np.einsum("nki,nij->nkj", np.stack(turned, axis=2), slopes)
    error = wanted - base
    asked = np.einsum("nki,nk->ni", steep, error)
    outward = (sent - within) * asked >= 0
    steep[np.broadcast_to(((sent != within) & outward)[:, None, :], steep.shape)] = 0
    return error, steep


def _rim(forward: Forward, cell: float) -> tuple[Array, Array]:
    """(n, 3) scanned colours a little beyond what can be printed, and (n, 3) evened L*a*b* of the nearest printable."""
    device, scanned = forward.skin
    push = np.where(device == 0, -FIT.push, np.where(device == 1, FIT.push, 0.0))
    outward = forward(device + push) - scanned
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    rim = scanned + cell * np.resize(FIT.rim, len(scanned))[:, None] * outward
    rim = rim[((rim >= 0) & (rim <= 1)).all(axis=1)]
    printed = printable(forward, rim)[0]
    return rim, conversions.bend_chroma(conversions.lab(forward.inside(printed)))
