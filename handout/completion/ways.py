"""Letters of the built-in hands as ways of the pen, and how such a way is bent onto a letter that an author wrote.

A way is a letter's strokes in their order, sampled evenly, upright, in x-heights, y up from the baseline.  Bent onto a
glyph it stays in order, so that places on the author's letter are known by what the pen does there; that needs neither
the order of the author's strokes nor his letter to be cut cleanly from its neighbours.

Source: own method; the iterated nearest places are those of Besl and McKay 1992.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from handout.hand.drawn import Hand
from handout.hand.library import load
from handout.hand.scanned import ScannedHand
from handout.inking.pen_replacement import directions
from handout.libraries import interpolate
from handout.values import Array, Glyph
from handout.writing.specimen import forms

HANDS = ("house-print", "house-joined", "house-quick")
STEP = 0.1  # x-heights between places of a way
_FORMS = 6  # of a letter in one hand, those that it favours: time
_PLACES = 160  # of a glyph that are looked at: time
_TURN = 0.25  # x-heights that a place counts as further away across the way than along it
_ROUNDS = 8
_STIFF = (8.0, 0.8)  # against bending, in the first and in the last round; by eye on two people's letters
_STRETCH = 0.05  # of that, against stretching
_STAY = 0.03  # against moving at all
_FAR = 0.2  # x-heights: a place that far from the other line counts half
BEND = 0.15  # of the length of the bends, that a fit costs beside the ink it leaves uncovered
_LEFT = 0.12  # x-heights over its lowest place, from where on a way up leads to the next letter; by eye
# what the built-in hands' letters rise over small ones, times this: six people (csafe w0154 w0394 w0238 w0076, cvl 0002
# 0013) write a t that rises 1.6 to 3.1 times as far over them as one made after their other letters did
_TALLER = {"t": 1.8}
_OUT, _OFF = 0.2, 2.5  # x-heights that a part is over small letters or below the baseline; times it is made longer
_CENTRING = 3  # rounds of moving a way along the line


@dataclass(frozen=True, eq=False)
class FormWay:
    """One form of a letter.

    hand : its number in `HANDS`; xy : (n, 2); first : (k + 1,) where each stroke begins, and n.
    leaving : the stroke that ends on the way up to the next letter, or -1.
    last : the last stroke that is written with the word.
    """

    letter: str
    hand: int
    xy: Array
    first: tuple[int, ...]
    leaving: int = -1
    last: int = 0

    def strokes(self, xy: Array) -> list[Array]:
        """Places (n, 2), stroke by stroke."""
        return np.split(xy, self.first[1:-1])

    def split_strokes(self, strokes: Sequence[Array]) -> list[Array]:
        """Its strokes when it was bent, without the way up to the next letter."""
        cut = list(strokes)
        if self.leaving >= 0:
            last = cut[self.leaving]
            rising = np.append(np.diff(last[:, 1]) > 0, True)
            bottom = int(np.flatnonzero(~rising)[-1]) + 1 if not rising.all() else 0
            over = np.flatnonzero(last[bottom:, 1] > last[bottom, 1] + _LEFT)
            if len(over) and bottom:
                cut[self.leaving] = last[: bottom + int(over[0])]
        return cut

    @cached_property
    def unit_vectors(self) -> Array:
        """(n, 2) unit vectors along the way; 0 for dots."""
        return self.tangents(self.xy)

    def tangents(self, xy: Array) -> Array:
        """(n, 2) unit vectors along places (n, 2) of the way when it is bent."""
        every = [np.gradient(x, axis=0) if len(x) > 1 else np.zeros((1, 2)) for x in self.strokes(xy)]
        way = np.concatenate(every)
        return np.asarray(way / np.maximum(np.hypot(*way.T), 1e-9)[:, None])

    @cached_property
    def stiffness(self) -> tuple[Array, Array]:
        """Twice (n, n): what the squares of bends and of moves cost."""
        n = len(self.xy)
        bends = np.zeros((n, n))
        for a, b in zip(self.first[:-1], self.first[1:], strict=True):
            for order, weight in ((1, _STRETCH), (2, 1.0)):
                if b - a > order:
                    change = np.diff(np.eye(b - a), order, axis=0)
                    bends[a:b, a:b] += weight * change.T @ change
        return bends, _STAY * np.eye(n)


@lru_cache(maxsize=2000)
def _forms_of(letter: str) -> Sequence[tuple[int, Glyph]]:
    """The forms of a character of the built-in hands, with the number of their hand, hand after hand."""
    found = list[tuple[int, Glyph]]()
    for number, name in enumerate(HANDS):
        hand: Hand = load(name)
        best = sorted(forms(hand.glyphs.get(letter, ())), key=lambda glyph: -glyph.favour)[:_FORMS]
        found += [(number, glyph) for glyph in best]
    return found


def count(letter: str) -> int:
    """How many forms there are of a letter."""
    return len(_forms_of(letter))


@lru_cache(maxsize=2000)
def way(letter: str, number: int) -> FormWay:
    """A form of a letter by its number."""
    hand, glyph = _forms_of(letter)[number]
    taller = _TALLER.get(letter, 1.0)
    over = [np.maximum(stroke[:, 1] - 1, 0.0) for stroke in glyph.strokes]
    raised = [
        np.column_stack([x[:, 0], x[:, 1] + (taller - 1) * up]) for x, up in zip(glyph.strokes, over, strict=True)
    ]
    strokes = [evenly(stroke, STEP) for stroke in raised]
    first = tuple(np.cumsum([0, *map(len, strokes)]).tolist())
    last = glyph.last_main
    return FormWay(letter, hand, np.concatenate(strokes), first, last if glyph.exit == "low" else -1, last)


def evenly(points: Array, step: float) -> Array:
    """(m, 2): a curve through points (n, 2), sampled evenly; a point stays one."""
    lengths = np.hypot(*np.diff(points, axis=0).T) if len(points) > 1 else np.zeros(0)
    moves = lengths > 1e-6
    if not moves.any():
        return np.array(points[:1])
    along = np.concatenate([[0.0], np.cumsum(lengths[moves])])
    at = np.linspace(0, along[-1], max(3, round(along[-1] / step) + 1))
    return np.asarray(interpolate.CubicSpline(along, points[np.concatenate([[True], moves])])(at))


@dataclass(frozen=True, eq=False)
class AuthorGlyph:
    """A glyph of an author as a way is bent onto it.

    xy : (m, 2) places of its line, upright x-heights, x = 0 the middle of its own ones.
    along : (m, 2) unit vectors along the line; 0 at crossings.
    own : (m,) whether they are the letter's own, not its ligatures'.
    """

    xy: Array
    along: Array
    own: NDArray[np.bool_]


def take_glyph(hand: ScannedHand, number: int) -> AuthorGlyph:
    """A glyph of a hand."""
    glyph = hand.glyphs[number]
    page = hand.pages[glyph.page]
    ink = page.graph.take(glyph.vertices)
    x, y = page.to_line(glyph.line, ink.uv).T * (page.pitch / page.x_height)
    upright = np.column_stack([x - page.slant * y, y])
    own = np.isin(glyph.vertices, hand.body(number))
    way = directions(replace(ink, xy=upright))
    some = np.unique(np.linspace(0, len(upright) - 1, _PLACES).astype(np.intp))
    own = own if own[some].any() else np.ones(len(own), dtype=bool)
    upright = upright - [float(np.median(upright[own, 0])), 0.0]
    return AuthorGlyph(upright[some], way[some], own[some])


def measure_squares(a: Array, b: Array) -> Array:
    """(n, m): squared distances of places (n, d) from places (m, d)."""
    return np.asarray(np.maximum((a * a).sum(axis=1)[:, None] + (b * b).sum(axis=1) - 2 * a @ b.T, 0.0))


def _turning(xy: Array, along: Array) -> Array:
    """(n, 4): places with the directions of their lines, of which both ways are one."""
    u, v = along.T
    return np.column_stack([xy, _TURN * (u * u - v * v), _TURN * 2 * u * v])


def measure_distance(xy: Array, along: Array, glyph: AuthorGlyph) -> float:
    """x-heights that a line (n, 2) and a glyph's own lie apart on the average, when best moved along the line."""
    line, other = _turning(xy, along), _turning(glyph.xy, glyph.along)
    line[:, 0] -= np.median(line[:, 0])
    squares = measure_squares(line, other)
    for _ in range(_CENTRING):
        line[:, 0] += _aside(line, other, squares, glyph.own)
        squares = measure_squares(line, other)
    return float(0.5 * (np.sqrt(squares.min(axis=1)).mean() + np.sqrt(squares.min(axis=0)[glyph.own]).mean()))


def _aside(line: Array, other: Array, squares: Array, own: NDArray[np.bool_]) -> float:
    """How far a line lies to the left of another, by what is nearest to what."""
    there, back = squares.argmin(axis=1), squares.argmin(axis=0)
    return float(np.median(np.concatenate([other[there, 0] - line[:, 0], (other[:, 0] - line[back, 0])[own]])))


@dataclass(frozen=True, eq=False)
class BentWay:
    """A way bent onto a glyph.

    bent : (n, 2) its places; cost : x-heights, what is left uncovered of either, and how far it was bent.
    """

    bent: Array
    cost: float


def _scale_height(xy: Array, other: Array) -> Array:
    """Places (n, 2) whose parts over small letters, and below the baseline, reach as far as the heights of another.

    What lies far off draws a line no further: without this, ends that are much further out are not found.
    """
    y = xy[:, 1].copy()
    for beyond, there in ((np.maximum(y - 1, 0.0), float(other.max()) - 1), (np.minimum(y, 0.0), float(other.min()))):
        here = float(beyond[np.abs(beyond).argmax()])
        if abs(here) > _OUT and there / here > 0:
            y += (float(np.clip(there / here, 1 / _OFF, _OFF)) - 1) * beyond
    return np.column_stack([xy[:, 0], y])


def fit(way: FormWay, glyph: AuthorGlyph) -> BentWay:
    """Bend a way onto a glyph: near the ink that it covers, smoothly, and not far from its own places."""
    start = _scale_height(way.xy - [float(np.median(way.xy[:, 0])), 0.0], glyph.xy[glyph.own, 1])
    other = _turning(glyph.xy, glyph.along)
    for _ in range(_CENTRING):
        line = _turning(start, way.unit_vectors)
        start[:, 0] += _aside(line, other, measure_squares(line, other), glyph.own)
    bends, moves = way.stiffness
    own, bent, n = np.flatnonzero(glyph.own), start, len(start)
    for stiff in np.geomspace(*_STIFF, _ROUNDS):
        squares = measure_squares(_turning(bent, way.tangents(bent)), other)
        there, back = squares.argmin(axis=1), squares[:, own].argmin(axis=0)
        weight = 1 / (1 + squares[np.arange(n), there] / _FAR**2)
        pull = weight[:, None] * (glyph.xy[there] - start)
        covering = n / len(own) / (1 + squares[back, own] / _FAR**2)
        weight = weight + np.bincount(back, covering, n)
        for axis in (0, 1):
            pull[:, axis] += np.bincount(back, covering * (glyph.xy[own, axis] - start[back, axis]), n)
        bent = start + np.linalg.solve(stiff * bends + moves + np.diag(weight), pull)
    squares = measure_squares(bent, glyph.xy)
    left = 0.5 * (np.sqrt(squares.min(axis=1)).mean() + np.sqrt(squares.min(axis=0)[own]).mean())
    away = bent - start
    return BentWay(bent, float(left + BEND * np.sqrt((away * away).sum(axis=1).mean())))
