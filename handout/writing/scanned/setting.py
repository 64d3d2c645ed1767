"""Glyphs of a scanned hand set on a line: how far apart, how high, joined, and each a little bent.

Source: seed 000, §6.3, §6.4.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.values import Array, Indices, LineGraph, readonly, readonly_indices
from handout.writing.scanned.bending import Bend, bend
from handout.writing.scanned.forms import Form, Way
from handout.writing.scanned.joining import at, blend, matches
from handout.writing.scanned.manner import Manner

_TOUCH = 0.5  # of the two radii: a stroke that is cut ends so deep in the ink of the letter that it met


def gaps(
    manner: Manner, numbers: ArrayLike, new_word: ArrayLike, rng: np.random.Generator, variation: float = 1.0
) -> Array:
    """How far each glyph's centre stands to the right of the one before it.

    Parameters
    ----------
    numbers : (n,) int: glyphs of the hand, in the order of a text.
    new_word : (n,) bool: whether there is a space before each; what it says of the first is not looked at.
    variation : 0: the middle of what the two glyphs had in the source; 1: anywhere between.

    Returns
    -------
    (n − 1,) float, line space.

    Source: seed 000, §6.3.
    """
    glyphs, parted = _text(numbers, new_word)
    return manner.spacing.between(glyphs, parted, rng, variation)


def heights(
    manner: Manner, numbers: ArrayLike, new_word: ArrayLike, rng: np.random.Generator, variation: float = 1.0
) -> Array:
    """(n,) float, line space: how high the centres of one line's glyphs stand over its baseline; see `gaps`.

    Source: seed 000, §6.3.
    """
    glyphs, parted = _text(numbers, new_word)
    return manner.flow.over(glyphs, parted, rng, variation)


def bent(manner: Manner, numbers: ArrayLike, rng: np.random.Generator, variation: float = 1.0) -> list[Bend]:
    """How each of some glyphs (n,) is bent, never further than the author's own letters vary.

    variation : 0 not at all, 1 as much as is usual.
    """
    glyphs = readonly_indices(np.asarray(numbers, dtype=np.intp).reshape(-1), None)
    height = manner.flow.height
    return [bend(manner.forms[int(i)], int(i), manner.spread, float(height[i]), rng, variation) for i in glyphs]


def set_line(
    manner: Manner,
    numbers: ArrayLike,
    x: ArrayLike,
    y: ArrayLike,
    new_word: ArrayLike,
    bends: Sequence[Bend],
) -> list[LineGraph]:
    """The ink of one line.

    Parameters
    ----------
    numbers, new_word : see `gaps`.
    x, y : (n,) float, line space: where the glyphs' centres lie.
    bends : n, of the glyphs; see `bent`.

    Returns
    -------
    A graph a glyph: `xy` and `radius` in line space, `uv` in pixels of the glyph's own picture.  It has the glyph's
    body, and the whole of every ligature that joins it, which its neighbour has too, along the same way but with ink
    of its own.

    Source: seed 000, §6.4.
    """
    glyphs, parted = _text(numbers, new_word)
    centres = np.column_stack([readonly(x, len(glyphs)), readonly(y, len(glyphs))])
    forms = [manner.forms[int(number)] for number in glyphs]
    laid = [_Laid(form, bent, centre) for form, bent, centre in zip(forms, bends, centres, strict=True)]
    for first, second, apart in zip(laid[:-1], laid[1:], parted[1:], strict=True):
        _join(first, second, manner.spread.x_height, apart=bool(apart))
    for one in laid:
        one.lift()
    return [one.graph() for one in laid]


def _text(numbers: ArrayLike, new_word: ArrayLike) -> tuple[Indices, NDArray[np.bool_]]:
    glyphs = readonly_indices(np.asarray(numbers, dtype=np.intp).reshape(-1), None)
    parted = np.array(new_word, dtype=bool).reshape(-1)
    if len(parted) != len(glyphs):
        raise ValueError(f"{len(glyphs)} glyphs, but {len(parted)} times whether a word begins")
    return glyphs, parted


class _Laid:
    """A form while it is laid on its line: what has been made of it so far."""

    def __init__(self, form: Form, bent: Bend, centre: Array) -> None:
        self.form = form
        self._bent, self._centre = bent, centre
        self.xy = self.place(form.xy)
        self.free: list[Way] = []  # exits and entries that nothing has met
        self.barred: list[tuple[Array, Array]] = []
        self._parts = [(self.xy, form.radius, form.density, form.uv)]
        self._edges = [form.edges]
        self._count = len(form.xy)
        self._met: set[int] = set()

    def place(self, xy: Array) -> Array:
        """Where places (n, 2) from the form's centre are on the line."""
        return self._bent(xy) + self._centre

    def add(self, way: Way, line: tuple[Array, Array, Array, Array]) -> None:
        """A stroke from the anchor of a way outwards: xy, radius, density and uv of its vertices, the anchor first."""
        count = len(line[0]) - 1
        numbers = np.concatenate([[way.anchor], self._count + np.arange(count)])
        self._edges.append(np.column_stack([numbers[:-1], numbers[1:]]))
        xy, radius, density, uv = line
        self._parts.append((xy[1:], radius[1:], density[1:], uv[1:]))
        self._count += count
        self._met.add(id(way))

    def lift(self) -> None:
        """Ways that nothing has met are as long as loose ones are, up to the letter that they run into."""
        for way, outwards in self._loose():
            order = outwards[: way.loose]
            xy, radius = self.place(way.xy[order]), way.radius[order]
            kept = min((_clear(xy, radius, *body) for body in self.barred), default=len(order))
            self.add(way, (xy[:kept], radius[:kept], way.density[order][:kept], way.uv[order][:kept]))

    def _loose(self) -> Iterable[tuple[Way, Indices]]:
        for ways, step in ((self.form.entries, -1), (self.form.exits, 1)):
            for way in ways:
                if id(way) not in self._met:
                    yield way, np.arange(len(way))[::step]

    def graph(self) -> LineGraph:
        """All that was laid."""
        xy, radius, density, uv = (np.concatenate(values) for values in zip(*self._parts, strict=True))
        return LineGraph(xy, radius, density, uv, np.concatenate(self._edges))


def _join(first: _Laid, second: _Laid, x_height: float, *, apart: bool) -> None:
    """Ligatures of two neighbours, the whole of each for either; what stays loose may not run through the other."""
    for i, j in () if apart else matches(first.form, second.form):
        out, into = first.form.exits[i], second.form.entries[j]
        t, xy, radius = blend(out, into, first.place(out.xy), second.place(into.xy), x_height)
        first.add(out, (xy, radius, at(out, out.density, t), at(out, out.uv, t)))
        second.add(into, (xy[::-1], radius[::-1], at(into, into.density, t)[::-1], at(into, into.uv, t)[::-1]))
    first.barred.append((second.xy, second.form.radius))
    second.barred.append((first.xy, first.form.radius))


def _clear(xy: Array, radius: Array, body: Array, thick: Array) -> int:
    """How many vertices of a stroke there are before it is well within a body; one at least."""
    away = np.linalg.norm(xy[:, None] - body, axis=2) - _TOUCH * (radius[:, None] + thick)
    inside = (away < 0).any(axis=1)
    inside[0] = False
    return int(np.argmax(inside)) if inside.any() else len(xy)
