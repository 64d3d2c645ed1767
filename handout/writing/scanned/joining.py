"""Ligatures between glyphs that were not neighbours: which of them meet, and the way that both then take.

Source: seed 000, §6.4.
"""

from __future__ import annotations

import numpy as np

from handout.values import Array
from handout.writing.scanned.forms import Form, Way


def matches(first: Form, second: Form) -> tuple[tuple[int, int], ...]:
    """The exits of one form and the entries of the next that become one ligature: the closest in height, either way."""
    if not (first.exits and second.entries):
        return ()
    if len(first.exits) == len(second.entries) == 1:
        return ((0, 0),)
    exits = np.array([way.height for way in first.exits])
    entries = np.array([way.height for way in second.entries])
    away = np.abs(exits[:, None] - entries)
    nearest, back = away.argmin(axis=1), away.argmin(axis=0)
    return tuple((i, int(j)) for i, j in enumerate(nearest) if back[j] == i)


def rises(first: Form, second: Form, pairs: tuple[tuple[int, int], ...]) -> Array:
    """(2 m,): by how much the second centre must stand over the first for every start, and every end, to meet."""
    found = []
    for i, j in pairs:
        out, into = first.exits[i].xy, second.entries[j].xy
        found += [out[0, 1] - into[0, 1], out[-1, 1] - into[-1, 1]]
    return np.array(found)


def smooth(t: Array) -> Array:
    """A weight that leaves 0 and reaches 1 without a slope, so that the way keeps both directions at its ends."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * t))


def blend(out: Way, into: Way, out_xy: Array, into_xy: Array) -> tuple[Array, Array, Array]:
    """One way made of two.

    Parameters
    ----------
    out, into : the way as the letter on the left has it, and as the one on the right has it.
    out_xy, into_xy : (n, 2), (m, 2) float: where their vertices lie.

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
    way[0], way[-1] = ours[0], theirs[-1]
    return t, way[:, :2], way[:, 2]


def at(way: Way, values: Array, t: Array) -> Array:
    """Values (n,) or (n, d) of a way's vertices at the fractions `t` of its length."""
    if values.ndim == 1:
        return np.interp(t, way.along, values)
    return np.column_stack([np.interp(t, way.along, column) for column in values.T])
