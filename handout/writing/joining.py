"""Ligatures between glyphs that were not neighbours, and the ink of a line with them.

Which ways out of a letter and into the next meet, the way that both then take, and glyphs laid on their line with all
of their ways, met or loose.

Source: seed 000, §6.4.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from handout.hand.scanned import NOBODY
from handout.values import Array, Indices, LineGraph
from handout.writing.bending import Bend
from handout.writing.forms import Connector, GlyphLine, spread_evenly

_ALIKE, _APART = 0.12, 0.35  # x-heights between two ways: up to here they are blended, from here on not at all
_TANGENT = 0.2  # of a way, that its direction at an end is taken over
_COMPARED = 8  # places that two ways are compared at


def matches(first: GlyphLine, second: GlyphLine) -> tuple[tuple[int, int], ...]:
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


def rises(first: GlyphLine, second: GlyphLine, pairs: tuple[tuple[int, int], ...]) -> Array:
    """(2 m,): by how much the second centre must stand over the first for every start, and every end, to meet."""
    differences = []
    for i, j in pairs:
        out, into = first.exits[i].xy, second.entries[j].xy
        differences += [out[0, 1] - into[0, 1], out[-1, 1] - into[-1, 1]]
    return np.array(differences)


def meets(out: Connector, into: Connector) -> tuple[float, float]:
    """By how much the second centre must stand to the right of the first for two ways to lie on each other, on the
    mean, and the deviation of that along them."""
    ours, theirs = spread_evenly((out.xy, into.xy), _COMPARED)[:, :, 0]
    apart = ours - theirs
    return float(apart.mean()), float(apart.std())


def smooth(t: Array) -> Array:
    """A weight that leaves 0 and reaches 1 without a slope, so that the way keeps both directions at its ends."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * t))


def blend(out: Connector, into: Connector, out_xy: Array, into_xy: Array, unit: float) -> tuple[Array, Array, Array]:
    """One way made of two.

    out, into : the way as the letter on the left has it, and as the one on the right has it.
    out_xy, into_xy : (n, 2), (m, 2) float: where their vertices lie.
    unit : height of a small letter in the same unit.  Ways further apart than a share of it do not belong to one
        movement: a mean of them has waves that neither has, and the pen goes straight from the one to the other.

    Returns t : (k,) how far along each vertex is; `at` gives what else a way has there.
        xy : (k, 2); begins where `out` begins and ends where `into` ends, in their directions.
        radius : (k,)
    """
    t = out.share_along if len(out) >= len(into) else into.share_along
    weight = smooth(t)[:, None]
    ours = np.column_stack([at(out, out_xy, t), at(out, out.radius, t)])
    theirs = np.column_stack([at(into, into_xy, t), at(into, into.radius, t)])
    way = (1 - weight) * ours + weight * theirs
    # 0–1: how much of a way is left to the pen's own course, where two ways (n, 2) are so far apart
    away = float(np.hypot(*(ours[:, :2] - theirs[:, :2]).T).mean()) / unit
    share = float(np.clip((away - _ALIKE) / (_APART - _ALIKE), 0.0, 1.0))
    if share > 0:
        start, end, k = ours[0, :2], theirs[-1, :2], max(int(np.searchsorted(t, _TANGENT)), 1)
        reach = float(np.hypot(*(end - start)))
        leaving, coming = (
            reach * step / max(float(np.hypot(*step)), 1e-9) for step in (ours[k, :2] - start, end - theirs[-1 - k, :2])
        )
        way[:, :2] += share * (cubic(start, leaving, end, coming, t) - way[:, :2])
    way[0], way[-1] = ours[0], theirs[-1]
    return t, way[:, :2], way[:, 2]


def cubic(start: Array, leaving: Array, end: Array, coming: Array, at: Array) -> Array:
    """(n, 2): the cubic between two places (2,) with these directions (2,) at its ends; at : (n,), 0–1."""
    u = at[:, None]
    return np.asarray(
        (2 * u**3 - 3 * u**2 + 1) * start
        + (u**3 - 2 * u**2 + u) * leaving
        + (3 * u**2 - 2 * u**3) * end
        + (u**3 - u**2) * coming
    )


def at(way: Connector, values: Array, t: Array) -> Array:
    """Values (n,) or (n, d) of a way's vertices at the fractions `t` of its length."""
    if values.ndim == 1:
        return np.interp(t, way.share_along, values)
    return np.column_stack([np.interp(t, way.share_along, column) for column in values.T])


_TOUCH = 0.5  # of the two radii: a stroke that is cut ends so deep in the ink of the letter that it met


def set_line(
    forms: Sequence[GlyphLine],
    bends: Sequence[Bend],
    centres: Array,
    joints: Sequence[Sequence[tuple[Connector, Connector]]],
    x_height: float,
) -> list[LineGraph]:
    """The ink of one line.

    forms, bends : n, of its glyphs.
    centres : (n, 2) float, line space: where they lie.
    joints : n − 1: the ways out of each and into the next that become one ligature; none where there is a space.
    x_height : of the hand, line space.

    Returns a graph a glyph: `xy` and `radius` in line space, `uv` in pixels of the glyph's own picture.  It has the
    glyph's body, and the whole of every ligature that joins it, which its neighbour has too, along the same way but
    with ink of its own.

    Source: seed 000, §6.4.
    """
    laid = [_LaidForm(form, bent, centre) for form, bent, centre in zip(forms, bends, centres, strict=True)]
    for first, second, between in zip(laid[:-1], laid[1:], joints, strict=True):
        # ligatures of two neighbours, the whole of each for either
        for out, into in between:
            t, xy, radius = blend(out, into, first.place(out.xy), second.place(into.xy), x_height)
            first.add(out, (xy, radius, at(out, out.density, t), at(out, out.uv, t)))
            second.add(into, (xy[::-1], radius[::-1], at(into, into.density, t)[::-1], at(into, into.uv, t)[::-1]))
        first.obstacles.append((second.xy, second.form.radius))
        second.obstacles.append((first.xy, first.form.radius))
    for glyph in laid:
        glyph.lift()
    return [glyph.graph() for glyph in laid]


class _LaidForm:
    """A form while it is laid on its line: what has been made of it so far."""

    def __init__(self, form: GlyphLine, bent: Bend, centre: Array) -> None:
        self.form = form
        self._bent, self._centre = bent, centre
        self.xy = bent.of_form(form.xy) + centre
        self.free: list[Connector] = []  # exits and entries that nothing has met
        self.obstacles: list[tuple[Array, Array]] = []
        self._parts = [(self.xy, form.radius, form.density, form.uv)]
        self._edges = [form.edges]
        self._count = len(form.xy)
        self._joined: set[int] = set()

    def place(self, xy: Array) -> Array:
        """Where places (n, 2) from the form's centre are on the line."""
        return self._bent(xy) + self._centre

    def add(self, way: Connector, line: tuple[Array, Array, Array, Array]) -> None:
        """A stroke from the anchor of a way outwards: xy, radius, density and uv of its vertices, the anchor first."""
        count = len(line[0]) - 1
        numbers = np.concatenate([[way.anchor], self._count + np.arange(count)])
        self._edges.append(np.column_stack([numbers[:-1], numbers[1:]]))
        xy, radius, density, uv = line
        self._parts.append((xy[1:], radius[1:], density[1:], uv[1:]))
        self._count += count
        self._joined.add(id(way))

    def lift(self) -> None:
        """Ways that nothing has met are as long as loose ones are, up to the letter that they run into."""
        for way, outwards in self._unmet_connectors():
            order = outwards[: way.loose]
            xy, radius = self.place(way.xy[order]), way.radius[order]
            visible = min((_clear(xy, radius, *body) for body in self.obstacles), default=len(order))
            self.add(way, (xy[:visible], radius[:visible], way.density[order][:visible], way.uv[order][:visible]))

    def _unmet_connectors(self) -> Iterable[tuple[Connector, Indices]]:
        for ways, step in ((self.form.entries, -1), (self.form.exits, 1)):
            for way in ways:
                if id(way) not in self._joined:
                    yield way, np.arange(len(way))[::step]

    def graph(self) -> LineGraph:
        """All that was laid."""
        xy, radius, density, uv = (np.concatenate(values) for values in zip(*self._parts, strict=True))
        return LineGraph(xy, radius, density, uv, np.concatenate(self._edges))


def _clear(xy: Array, radius: Array, body: Array, thick: Array) -> int:
    """How many vertices of a stroke there are before it is well within a body; one at least."""
    away = np.linalg.norm(xy[:, None] - body, axis=2) - _TOUCH * (radius[:, None] + thick)
    inside = (away < 0).any(axis=1)
    inside[0] = False
    return int(np.argmax(inside)) if inside.any() else len(xy)
