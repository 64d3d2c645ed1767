"""The layout model of a scanned hand, and glyphs set on a line by it: spaced, raised, joined, each a little bent.

Distances are drawn for letters as they were written in the source.  A letter that is bent wider, or stands higher,
would come nearer to its neighbours than any two of the author's do: `resolve_collisions` moves them apart again.

Source: seed 000, §6.3, §6.4.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.hand.scanned import ScannedHand
from handout.values import Array, Indices, LineGraph, readonly, readonly_indices
from handout.writing.scanned.bending import Bend, Spread, bend, spread
from handout.writing.scanned.forms import Connector, Form, Forms
from handout.writing.scanned.glyph_index import Neighbours, neighbours
from handout.writing.scanned.heights import HeightModel, height_model
from handout.writing.scanned.joining import at, blend, matches
from handout.writing.scanned.spacing import (
    LETTERS,
    WORDS,
    Side,
    SpacingModel,
    apart,
    kinds,
    letters_at_gap,
    nearness,
    side,
    spacing_model,
)


@dataclass(frozen=True, eq=False)
class LayoutModel:
    """Forms of a hand's glyphs, and how it places and varies them."""

    forms: Forms
    neighbours: Neighbours
    spacing: SpacingModel
    heights: HeightModel
    spread: Spread

    def reach(self, numbers: Indices, bends: Sequence[Bend]) -> Array:
        """(n, 2) float, line space: how far the ink of bent glyphs goes left (negative) and right of their centres.

        Strokes count that are its own part of a ligature: where it is joined, the next letter has more of it.
        """
        reaches = [_reach(self.forms[int(number)], bend) for number, bend in zip(numbers, bends, strict=True)]
        return np.array(reaches).reshape(-1, 2)


def layout_model(hand: ScannedHand) -> LayoutModel:
    """The layout_model of a hand; takes about a third of a second for a page of a thousand letters."""
    forms = Forms(hand)
    near = neighbours(hand, forms.centre[:, 0])
    return LayoutModel(forms, near, spacing_model(forms, near), height_model(forms, near), spread(forms))


def _reach(form: Form, bend: Bend) -> tuple[float, float]:
    xy, radius = form.whole
    xy = bend(xy)
    return float((xy[:, 0] - radius).min()), float((xy[:, 0] + radius).max())


_TOUCH = 0.5  # of the two radii: a stroke that is cut ends so deep in the ink of the letter that it met


def gaps(
    model: LayoutModel, numbers: ArrayLike, new_word: ArrayLike, rng: np.random.Generator, variation: float = 1.0
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
    glyphs, parted = _checked_text(numbers, new_word)
    return model.spacing.between(glyphs, parted, rng, variation)


def heights(
    model: LayoutModel, numbers: ArrayLike, new_word: ArrayLike, rng: np.random.Generator, variation: float = 1.0
) -> Array:
    """(n,) float, line space: how high the centres of one line's glyphs stand over its baseline; see `gaps`.

    Source: seed 000, §6.3.
    """
    glyphs, parted = _checked_text(numbers, new_word)
    return model.heights.heights_of(glyphs, parted, rng, variation)


def bent(model: LayoutModel, numbers: ArrayLike, rng: np.random.Generator, variation: float = 1.0) -> list[Bend]:
    """How each of some glyphs (n,) is bent, never further than the author's own letters vary.

    variation : 0 not at all, 1 as much as is usual.
    """
    glyphs = readonly_indices(np.asarray(numbers, dtype=np.intp).reshape(-1), None)
    height = model.heights.height
    return [bend(model.forms[int(i)], int(i), model.spread, float(height[i]), rng, variation) for i in glyphs]


def set_line(
    model: LayoutModel,
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
    glyphs, parted = _checked_text(numbers, new_word)
    centres = np.column_stack([readonly(x, len(glyphs)), readonly(y, len(glyphs))])
    forms = [model.forms[int(number)] for number in glyphs]
    laid = [_LaidForm(form, bent, centre) for form, bent, centre in zip(forms, bends, centres, strict=True)]
    for first, second, separate in zip(laid[:-1], laid[1:], parted[1:], strict=True):
        _join(first, second, model.spread.x_height, apart=bool(separate))
    for glyph in laid:
        glyph.lift()
    return [glyph.graph() for glyph in laid]


def _checked_text(numbers: ArrayLike, new_word: ArrayLike) -> tuple[Indices, NDArray[np.bool_]]:
    glyphs = readonly_indices(np.asarray(numbers, dtype=np.intp).reshape(-1), None)
    parted = np.array(new_word, dtype=bool).reshape(-1)
    if len(parted) != len(glyphs):
        raise ValueError(f"{len(glyphs)} glyphs, but {len(parted)} times whether a word begins")
    return glyphs, parted


class _LaidForm:
    """A form while it is laid on its line: what has been made of it so far."""

    def __init__(self, form: Form, bent: Bend, centre: Array) -> None:
        self.form = form
        self._bent, self._centre = bent, centre
        self.xy = self.place(form.xy)
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


def _join(first: _LaidForm, second: _LaidForm, x_height: float, *, apart: bool) -> None:
    """Ligatures of two neighbours, the whole of each for either; what stays loose may not run through the other."""
    for i, j in () if apart else matches(first.form, second.form):
        out, into = first.form.exits[i], second.form.entries[j]
        t, xy, radius = blend(out, into, first.place(out.xy), second.place(into.xy), x_height)
        first.add(out, (xy, radius, at(out, out.density, t), at(out, out.uv, t)))
        second.add(into, (xy[::-1], radius[::-1], at(into, into.density, t)[::-1], at(into, into.uv, t)[::-1]))
    first.obstacles.append((second.xy, second.form.radius))
    second.obstacles.append((first.xy, first.form.radius))


def _clear(xy: Array, radius: Array, body: Array, thick: Array) -> int:
    """How many vertices of a stroke there are before it is well within a body; one at least."""
    away = np.linalg.norm(xy[:, None] - body, axis=2) - _TOUCH * (radius[:, None] + thick)
    inside = (away < 0).any(axis=1)
    inside[0] = False
    return int(np.argmax(inside)) if inside.any() else len(xy)


_COLLISION_PUSHES = 3  # that two letters are moved apart by: one sideways takes them less far apart than it is long


def resolve_collisions(
    spacing: SpacingModel, numbers: Indices, new_word: NDArray[np.bool_], apart: Array, y: Array, bends: Sequence[Bend]
) -> Array:
    """How far each glyph's centre stands to the right of the one before it, where they are bent and at their heights.

    Parameters
    ----------
    numbers : (n,) int; new_word : (n,) bool: see `gaps`.
    apart : (n − 1,) float, line space: the same of glyphs that are as they were in the source.
    y : (n,) float, line space: how high the centres stand.
    bends : n, of the glyphs.

    Returns
    -------
    (n − 1,) float, line space.
    """
    if len(numbers) < 2:
        return apart
    first, second = numbers[:-1], numbers[1:]
    kind = kinds(spacing.forms, first, second, new_word[1:])
    sourced = spacing.sourced(first, second, kind)
    glyphs = [
        _BentGlyph(spacing, int(number), bend, float(height))
        for number, bend, height in zip(numbers, bends, y, strict=True)
    ]
    away = apart + spacing.sides.clearance(first, second, kind) + np.diff([glyph.shifted for glyph in glyphs])
    for k, of in enumerate(kind.tolist()):
        away[k] -= nearness(glyphs[k].side(of), glyphs[k + 1].side(of))
        for _ in range(_COLLISION_PUSHES if of != WORDS and not sourced[k] else 0):
            shift = np.array([away[k], y[k + 1] - y[k]])
            short = spacing.least - glyphs[k].apart(glyphs[k + 1], shift)
            if short <= 0:
                break
            away[k] += short
    for k in np.flatnonzero(~sourced & (kind == WORDS)).tolist():
        before, after = letters_at_gap(new_word, k)
        begin, end = int(before[-1]), int(after[-1]) + 1
        upright = np.concatenate([[0.0], np.cumsum(away[begin : end - 1])]) - spacing.slant * y[begin:end]
        right = max(upright[i - begin] + glyphs[i].edges[1] for i in before)
        left = min(upright[i - begin] + glyphs[i].edges[0] for i in after)
        away[k] += max(spacing.gaps.word - (left - right), 0.0)
    return np.asarray(away)


class _BentGlyph:
    """A glyph bent, at its height on the line.

    shifted : how much further right the slant takes its centre than at its height in the source.
    """

    def __init__(self, spacing: SpacingModel, number: int, bend: Bend, y: float) -> None:
        self._form, self._bend, self._y, self._slant = spacing.forms[number], bend, y, spacing.slant
        self._sides: dict[int, Side] = {}
        self.shifted = spacing.slant * (y - float(spacing.forms.centre[number, 1]))

    def side(self, kind: int) -> Side:
        """What `sides.Sides` has of a glyph in a pair of this kind, from its centre."""
        if kind not in self._sides:
            xy, radius = (self._body.xy, self._body.radius) if kind == LETTERS else self._whole
            upright = xy[:, 0] - self._slant * xy[:, 1]
            self._sides[kind] = side((upright - radius, upright + radius, xy[:, 1] + self._y), kind)
        return self._sides[kind]

    @property
    def edges(self) -> tuple[float, float]:
        """How far its ink goes to either side, upright, where it begins or ends a word."""
        return self.side(WORDS)[2:]

    def apart(self, other: _BentGlyph, shift: Array) -> float:
        """See `spacing.apart`."""
        return apart(self._body, other._body, shift)

    @cached_property
    def _body(self) -> Form:
        return replace(self._form, xy=self._bend(self._form.xy))

    @cached_property
    def _whole(self) -> tuple[Array, Array]:
        xy, radius = self._form.whole
        return self._bend(xy), radius
