"""Ligatures between glyphs that were not neighbours: which of them meet, and the way that both then take.

Source: seed 000, §6.4.
"""

from __future__ import annotations

import numpy as np

from handout.hand.scanned import NOBODY
from handout.values import Array, Indices
from handout.writing.scanned.forms import Connector, Form, along

_ALIKE, _APART = 0.12, 0.35  # x-heights between two ways: up to here they are blended, from here on not at all
_TANGENT = 0.2  # of a way, that its direction at an end is taken over
_COMPARED = 8  # places that two ways are compared at


def matches(first: Form, second: Form) -> tuple[tuple[int, int], ...]:
    """The exits of one form and the entries of the next that become one ligature: the closest in height, either way."""
    if not (first.exits and second.entries):
        return ()
    if len(first.exits) == len(second.entries) == 1:
        return ((0, 0),)
    exits = np.array([[way.height for way in first.exits]])
    entries = np.array([[way.height for way in second.entries]])
    return tuple((i, j) for i, j in enumerate(partners(exits, entries)[0].tolist()) if j != NOBODY)


def partners(exits: Array, entries: Array) -> Indices:
    """(n, k) int: which entry each exit matches, −1 for none, told by their heights (n, k) and (n, l); nan for none."""
    away = np.abs(exits[:, :, None] - entries[:, None, :])
    away[np.isnan(away)] = np.inf
    nearest, back = away.argmin(axis=2), away.argmin(axis=1)
    either_way = np.take_along_axis(back, nearest, axis=1) == np.arange(exits.shape[1])
    return np.where(either_way & ~np.isnan(exits), nearest, NOBODY)


def rises(first: Form, second: Form, pairs: tuple[tuple[int, int], ...]) -> Array:
    """(2 m,): by how much the second centre must stand over the first for every start, and every end, to meet."""
    differences = []
    for i, j in pairs:
        out, into = first.exits[i].xy, second.entries[j].xy
        differences += [out[0, 1] - into[0, 1], out[-1, 1] - into[-1, 1]]
    return np.array(differences)


def meets(out: Connector, into: Connector) -> tuple[float, float]:
    """By how much the second centre must stand to the right of the first for two ways to lie on each other, on the
    mean, and the deviation of that along them."""
    apart = along(out.xy, _COMPARED)[:, 0] - along(into.xy, _COMPARED)[:, 0]
    return float(apart.mean()), float(apart.std())


def smooth(t: Array) -> Array:
    """A weight that leaves 0 and reaches 1 without a slope, so that the way keeps both directions at its ends."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * t))


def blend(out: Connector, into: Connector, out_xy: Array, into_xy: Array, unit: float) -> tuple[Array, Array, Array]:
    """One way made of two.

    Parameters
    ----------
    out, into : the way as the letter on the left has it, and as the one on the right has it.
    out_xy, into_xy : (n, 2), (m, 2) float: where their vertices lie.
    unit : height of a small letter in the same unit.  Ways further apart than a share of it do not belong to one
        movement: a mean of them has waves that neither has, and the pen goes straight from the one to the other.

    Returns
    -------
    t : (k,) how far along each vertex is; `at` gives what else a way has there.
    xy : (k, 2); begins where `out` begins and ends where `into` ends, in their directions.
    radius : (k,)
    """
    t = out.along if len(out) >= len(into) else into.along
    weight = smooth(t)[:, None]
    ours = np.column_stack([at(out, out_xy, t), at(out, out.radius, t)])
    theirs = np.column_stack([at(into, into_xy, t), at(into, into.radius, t)])
    way = (1 - weight) * ours + weight * theirs
    share = _strained(ours[:, :2] - theirs[:, :2], unit)
    if share > 0:
        way[:, :2] += share * (_direct(ours[:, :2], theirs[:, :2], t) - way[:, :2])
    way[0], way[-1] = ours[0], theirs[-1]
    return t, way[:, :2], way[:, 2]


def _strained(apart: Array, unit: float) -> float:
    """0–1: how much of a way is left to the pen's own course, where two ways (n, 2) are so far apart."""
    away = float(np.hypot(*apart.T).mean()) / unit
    return float(np.clip((away - _ALIKE) / (_APART - _ALIKE), 0.0, 1.0))


def _direct(ours: Array, theirs: Array, t: Array) -> Array:
    """(n, 2): the cubic from the start of one way to the end of another that keeps both their directions."""
    start, end = ours[0], theirs[-1]
    reach = float(np.hypot(*(end - start)))
    k = max(int(np.searchsorted(t, _TANGENT)), 1)
    leaving, coming = ours[k] - start, end - theirs[-1 - k]
    leaving, coming = (reach * way / max(float(np.hypot(*way)), 1e-9) for way in (leaving, coming))
    u = t[:, None]
    return np.asarray(
        (2 * u**3 - 3 * u**2 + 1) * start
        + (u**3 - 2 * u**2 + u) * leaving
        + (3 * u**2 - 2 * u**3) * end
        + (u**3 - u**2) * coming
    )


def at(way: Connector, values: Array, t: Array) -> Array:
    """Values (n,) or (n, d) of a way's vertices at the fractions `t` of its length."""
    if values.ndim == 1:
        return np.interp(t, way.along, values)
    return np.column_stack([np.interp(t, way.along, column) for column in values.T])
