"""The device colour that gives a wanted scanned colour, by Gauss–Newton on the forward model; out of gamut, the
printable colour that looks nearest (ΔE00)."""

from __future__ import annotations

import numpy as np

from handout.colour import convert
from handout.colour.models.forward import Forward, missed
from handout.colour.tetrahedra import look_up
from handout.values import Array

_ROUNDS, _DONE = 10, 2e-4  # Gauss–Newton; scanned, at which a colour is met
_DAMPING = 1e-6  # of squared slopes
_LEAP, _BEYOND = 0.25, 0.5  # device: the longest step, and how far out of 0–1 a colour may go
_CANDIDATES = 8  # samples, near in evened L*a*b*, of which ΔE00 chooses
_SHELL = 1.8 / 32  # scanned: a little more than the diagonal of a cell of the usual table
_SEEN = 0.1  # ΔE00 below which nothing nearer is looked for
_CLEARLY = 0.1  # ΔE00 less that are lost, for which the exact inverse beyond the surface is given up
_FAR = 2.0  # ΔE00 within which the printable colour that looks nearest may lead to the exact inverse
_STEPS = (1 / 64, 1 / 128)  # device: of the refinement


def solve(forward: Forward, wanted: Array, start: Array) -> Array:
    """(n, 3) device RGB, unclamped, whose scanned RGB is (n, 3) `wanted`, from (n, 3) device RGB to `start` at."""
    device = start.copy()
    left = np.arange(len(device))
    for _ in range(_ROUNDS):
        within = np.clip(device[left], 0, 1)
        base = forward.inside(within)
        slopes = forward.slopes(within, base)
        error = wanted[left] - base - np.einsum("nij,nj->ni", slopes, device[left] - within)
        square = np.einsum("nji,njk->nik", slopes, slopes) + _DAMPING * np.eye(3)
        step = np.linalg.solve(square, np.einsum("nji,nj->ni", slopes, error)[..., None])[..., 0]
        device[left] = np.clip(device[left] + np.clip(step, -_LEAP, _LEAP), -_BEYOND, 1 + _BEYOND)
        left = left[np.abs(error).max(axis=1) > _DONE]
        if not len(left):
            break
    return device


def nearest(forward: Forward, wanted: Array) -> Array:
    """(n, 3) device RGB in 0–1 of the printable colours that look nearest to (n, 3) scanned RGB out of gamut.

    The nearest sample by ΔE00, then parabolas along each channel at two scales, on colours interpolated
    linearly: the foot of a distance hardly moves with what that is off.
    """
    from scipy.spatial import KDTree

    device, seen = forward.samples
    labs, aim = convert.lab(seen), convert.lab(wanted)
    near = KDTree(convert.evened(labs)).query(convert.evened(aim), k=_CANDIDATES)[1]
    far = convert.delta_e(labs[near], aim[:, None, :])
    rows, best = np.arange(len(aim)), far.argmin(axis=1)
    found, cost = device[near[rows, best]], far[rows, best]
    for step in _STEPS:
        found, cost = _refined(forward, aim, found, cost, step)
    return np.asarray(found)


def _refined(forward: Forward, aim: Array, device: Array, cost: Array, step: float) -> tuple[Array, Array]:
    """Each channel moved to the foot of the parabola through three squared differences, where that is better."""
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
    return convert.delta_e(look_up(forward.looks, device), aim)


def invert(forward: Forward, wanted: Array) -> Array:
    """(n, 3) device RGB of (n, 3) scanned RGB.

    In gamut, and out of it by less than a cell of a table, the exact inverse, unclamped, so that a table stays
    accurate up to the surface; farther out, the printable colour that looks nearest.  In the dark, where black ink
    takes over from the others, colours far apart are seen almost alike, and the way from the nearest sample may end
    outside the cube although the colour can be printed: where cutting to 0–1 loses anything, the search begins anew at
    the printable colour that looks nearest, and what loses clearly less is taken.
    """
    from scipy.spatial import KDTree

    device, seen = forward.samples
    away, which = KDTree(seen).query(wanted)
    out = np.array(device[which])
    close = away <= _SHELL
    out[close] = solve(forward, wanted[close], out[close])
    lost = np.where(close, 0.0, np.inf)
    lost[close] = missed(forward, out[close], wanted[close])
    off = np.flatnonzero(lost > _SEEN)
    if len(off):
        out[off] = _better(forward, wanted[off], out[off], lost[off])
    return out


def _better(forward: Forward, wanted: Array, found: Array, lost: Array) -> Array:
    """(n, 3) device RGB: `found`, which loses (n,) ΔE00 when it is cut, or what loses clearly less."""
    printed = nearest(forward, wanted)
    short = missed(forward, printed, wanted)
    near = short < np.minimum(lost, _FAR)
    again = printed.copy()
    again[near] = solve(forward, wanted[near], printed[near])
    least = missed(forward, again, wanted)
    best = np.where((least <= short)[:, None], again, printed)
    return np.where((np.minimum(least, short) < lost - _CLEARLY)[:, None], best, found)


def printable(forward: Forward, wanted: Array) -> tuple[Array, Array]:
    """The printable colours nearest to (n, 3) scanned RGB: (n, 3) device RGB in 0–1, and (n,) ΔE00 that is lost."""
    device = np.clip(invert(forward, wanted), 0, 1)
    lost = missed(forward, device, wanted)
    off = np.flatnonzero(lost > _SEEN)
    if len(off):
        other = nearest(forward, wanted[off])
        short = missed(forward, other, wanted[off])
        nearer = short < lost[off]
        device[off[nearer]], lost[off[nearer]] = other[nearer], short[nearer]
    return device, lost
