"""Glyphs of a scanned hand taken off their pages: the line of each body, and the ways to its neighbours.

A form lies in line space with the glyph's centre at the origin, so that it can be set anywhere.

Source: seed 000, §6.3, §6.4.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array, Indices, readonly, readonly_indices
from handout.writing.scanned.tails import tails

_CLEAR = 0.25  # x-heights before the letter that a way led to, where a loose one ends: there is ink of that letter


@dataclass(frozen=True, eq=False)
class Way:
    """One ligature as one of its two glyphs has it, from the letter on the left to the one on the right.

    xy, radius : (n, 2), (n,) float, line space, from the glyph's centre.
    density : (n,) float.
    uv : (n, 2) float, pixels of the glyph's picture.
    anchor : the vertex of the form's body that the way begins (ends) at.
    own : how many of its vertices, counted from the anchor, belong to the glyph.
    loose : how many of them it has where nothing meets it; see `tails`.
    height : of its middle over the source's baseline, line space.
    """

    xy: Array
    radius: Array
    density: Array
    uv: Array
    anchor: int
    own: int
    loose: int
    height: float

    def __len__(self) -> int:
        return len(self.xy)

    @cached_property
    def along(self) -> Array:
        """(n,) float: how far each vertex is along the way, 0 to 1."""
        steps = np.hypot(*np.diff(self.xy, axis=0).T)
        run = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1e-12))])
        return np.asarray(run / run[-1])


@dataclass(frozen=True, eq=False)
class Form:
    """The line of one glyph; all lengths in line space, from its centre.

    xy, radius, density, uv, edges : as in `values.LineGraph`, of the body.
    entries, exits : the ways from the glyph before and to the glyph after, from the lowest upwards.
    """

    xy: Array
    radius: Array
    density: Array
    uv: Array
    edges: Indices
    entries: tuple[Way, ...]
    exits: tuple[Way, ...]

    @cached_property
    def whole(self) -> tuple[Array, Array]:
        """(n, 2), (n,): places and radii of all that is there where nothing joins it: its body, and its loose ways."""
        parts = [(self.xy, self.radius)]
        parts += [(way.xy[: way.loose], way.radius[: way.loose]) for way in self.exits]
        parts += [(way.xy[-way.loose :], way.radius[-way.loose :]) for way in self.entries]
        return np.concatenate([xy for xy, _ in parts]), np.concatenate([radius for _, radius in parts])


class Forms:
    """The forms of a hand, each taken off its page when it is first asked for.

    centre : (n, 2) float, line space of each glyph's own line: see `ScannedHand.centre`.
    marks : (n,) bool: what is neither a letter nor a digit.
    """

    def __init__(self, hand: ScannedHand) -> None:
        self.hand = hand
        self.centre = readonly([hand.centre(number) for number in range(len(hand.glyphs))], len(hand.glyphs), 2)
        self.marks = np.array([is_mark(glyph.letter) for glyph in hand.glyphs], dtype=bool)
        self._ways = _ways(hand)
        self._edges = _edges(hand)
        self._tails = tails(
            hand, self._ways, [_body(glyph.vertices, *self._near(i)) for i, glyph in enumerate(hand.glyphs)]
        )
        self._made: dict[int, Form] = {}

    def __len__(self) -> int:
        return len(self.centre)

    def __getitem__(self, number: int) -> Form:
        form = self._made.get(number)
        if form is None:
            form = self._made[number] = self._form(number)
        return form

    def _near(self, number: int) -> tuple[tuple[Indices, ...], tuple[Indices, ...]]:
        """The paths that come to a glyph, and those that leave it."""
        return self._ways.get(self.hand.glyphs[number].before, ()), self._ways.get(number, ())

    def _form(self, number: int) -> Form:
        glyph = self.hand.glyphs[number]
        entries, exits = self._near(number)
        body = _body(glyph.vertices, entries, exits)
        place, radius, density, uv = self._line(number, body)
        return Form(
            place,
            radius,
            density,
            uv,
            _within(self._edges[number], body, [*entries, *exits]),
            tuple(self._way(number, path, body, entering=True) for path in entries),
            tuple(self._way(number, path, body, entering=False) for path in exits),
        )

    def _line(self, number: int, vertices: Indices) -> tuple[Array, Array, Array, Array]:
        glyph = self.hand.glyphs[number]
        page = self.hand.pages[glyph.page]
        uv = page.graph.uv[vertices]
        place = page.to_line(glyph.line, uv) - self.centre[number]
        return place, page.graph.radius[vertices] / page.pitch, page.graph.density[vertices], uv

    def _way(self, number: int, path: Indices, body: Indices, *, entering: bool) -> Way:
        place, radius, density, uv = self._line(number, path)
        outwards = path[::-1] if entering else path
        theirs = ~np.isin(outwards, self.hand.glyphs[number].vertices)
        own = max(int(np.argmax(theirs)) if theirs.any() else len(path), 1)
        far = np.linalg.norm(place - place[0 if entering else -1], axis=1) > _CLEAR / self.hand.pitch
        loose = own + round(self._tails[0 if entering else 1] * max(int(far.sum()) - own, 0))
        height = float(place[[0, -1], 1].mean() + self.centre[number, 1])
        anchor = int(np.searchsorted(body, outwards[0]))
        return Way(place, radius, density, uv, anchor, own, loose, height)


def is_mark(letter: str) -> bool:
    """Whether a grapheme is punctuation or a symbol."""
    return bool(letter) and unicodedata.category(letter[0])[0] in "PS"


def _ways(hand: ScannedHand) -> Mapping[int, tuple[Indices, ...]]:
    """Glyph → the paths of its ligatures; what is part of two ligatures of one letter is that letter's body."""
    found = {}
    for number, glyph in enumerate(hand.glyphs):
        if glyph.ligatures:
            entries = [way.path for way in hand.glyphs[glyph.before].ligatures] if glyph.before >= 0 else []
            beyond = [way.path for way in hand.glyphs[glyph.after].ligatures]
            found[number] = tuple(_clear(way.path, entries, beyond) for way in glyph.ligatures)
    return found


def _clear(path: Indices, entries: list[Indices], beyond: list[Indices]) -> Indices:
    """A path without what it shares with the ligatures on the far sides of its two letters; two vertices at least."""
    first, last = 0, len(path) - 1
    for other in entries:
        first = max(first, *np.flatnonzero(np.isin(path, other)).tolist(), 0)
    for other in beyond:
        last = min(last, *np.flatnonzero(np.isin(path, other)).tolist(), last)
    if last <= first:
        first = min(first, len(path) - 2)
        last = first + 1
    return readonly_indices(path[first : last + 1], None)


def _body(vertices: Indices, entries: tuple[Indices, ...], exits: tuple[Indices, ...]) -> Indices:
    """The vertices of a glyph that are not on the way to another, with the ends of those ways; rising."""
    gone = [path[1:] for path in exits] + [path[:-1] for path in entries]
    ends = [path[0] for path in exits] + [path[-1] for path in entries]
    own = np.setdiff1d(vertices, np.concatenate(gone)) if gone else vertices
    return readonly_indices(np.union1d(own, np.array(ends, dtype=np.intp)), None)


def _within(edges: Indices, body: Indices, ways: list[Indices]) -> Indices:
    """(m, 2) edges between vertices of the body, by their place in it, without those of the ways."""
    at = np.minimum(np.searchsorted(body, edges), len(body) - 1)
    kept = at[(body[at] == edges).all(axis=1)]
    steps = {(int(a), int(b)) for path in ways for a, b in pairwise(path)}
    if steps:
        pairs = body[kept].tolist()
        kept = kept[[(a, b) not in steps and (b, a) not in steps for a, b in pairs]]
    return readonly_indices(kept.reshape(-1, 2), None, 2)


def _edges(hand: ScannedHand) -> list[Indices]:
    """The edges of the pages' graphs that lie within each glyph, by the vertices of its page."""
    found = [np.zeros((0, 2), dtype=np.intp)] * len(hand.glyphs)
    for number, page in enumerate(hand.pages):
        owner = np.full(len(page.graph), NOBODY)
        for i, glyph in enumerate(hand.glyphs):
            if glyph.page == number:
                owner[glyph.vertices] = i
        edges = page.graph.edges
        holder = np.where(owner[edges[:, 0]] == owner[edges[:, 1]], owner[edges[:, 0]], NOBODY)
        order = np.argsort(holder, kind="stable")
        bounds = np.searchsorted(holder[order], np.arange(len(hand.glyphs) + 1))
        for i, glyph in enumerate(hand.glyphs):
            if glyph.page == number:
                found[i] = edges[order[bounds[i] : bounds[i + 1]]]
    return found
