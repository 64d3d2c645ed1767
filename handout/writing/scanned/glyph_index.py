"""Indexes the glyphs of a scanned hand for choosing among them, once per hand.

`neighbours` finds which glyphs stood side by side on the pages, `residuals` measures how far each glyph departs from
the median of its letter, and `index_glyphs` collects all that choosing needs.  Arrays are indexed by the numbers of the
glyphs; lengths are in line space.

Source: seed 000, §6.2, §6.3; the residuals are this project's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.hand.measures import body_sizes
from handout.hand.places import PLACES, Place
from handout.hand.scanned import NOBODY, ScannedHand
from handout.values import Array, Indices, readonly, readonly_indices
from handout.writing.scanned.choice_costs import TransitionCosts, intrinsic_cost
from handout.writing.scanned.forms import along, ways


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The neighbours of every glyph on its line of the source.

    before, after : (n,) int: number of the glyph on either side, −1 for none.
    parted : (n,) bool: whether a space precedes the glyph.
    """

    before: Indices
    after: Indices
    parted: NDArray[np.bool_]

    def pairs(self, parted: bool) -> Indices:
        """(m, 2) int: all pairs with a space between them, or all without."""
        second = np.flatnonzero((self.before != NOBODY) & (self.parted == parted))
        return np.column_stack([self.before[second], second])

    def closes(self, second: Indices) -> NDArray[np.bool_]:
        """(n,) whether the words that begin with the glyphs `second` (n,) are the last of their lines."""
        last = second.copy()
        for _ in range(len(self.after)):
            following = self.after[last]
            on = (following != NOBODY) & ~self.parted[following]
            if not on.any():
                break
            last = np.where(on, following, last)
        return np.asarray(self.after[last] == NOBODY)


def neighbours(hand: ScannedHand, x: Array) -> Neighbours:
    """The neighbours of a hand's glyphs, whose centres are at `x` (n,) on their lines."""
    before = np.array([glyph.before for glyph in hand.glyphs], dtype=np.intp)
    after = np.array([glyph.after for glyph in hand.glyphs], dtype=np.intp)
    parted = np.zeros(len(before), dtype=bool)
    for first, second in _spaces(hand, x):
        after[first], before[second], parted[second] = second, first, True
    for array in (before, after, parted):
        array.flags.writeable = False
    return Neighbours(before, after, parted)


def _spaces(hand: ScannedHand, x: Array) -> Iterator[tuple[int, int]]:
    """Pairs of the last glyph of a word and the first of the next, where both are on one line."""
    starts: dict[tuple[int, int], list[int]] = {}
    for number, glyph in enumerate(hand.glyphs):
        if glyph.before == NOBODY and glyph.letter:
            starts.setdefault((glyph.page, glyph.line), []).append(number)
    for heads in starts.values():
        heads.sort(key=lambda number: x[number])
        for head, following in pairwise(heads):
            last = head
            while hand.glyphs[last].after != NOBODY:
                last = hand.glyphs[last].after
            # a word in which a letter was not found is in two pieces without a space between them
            apart = hand.glyphs[head].word != hand.glyphs[following].word or hand.glyphs[head].at < 0
            if apart and x[last] < x[following]:
                yield last, following


_FEW = 4  # glyphs of a letter, below which there is no median to compare with
_MOST = 2.5  # deviations at most: a glyph further off was misread


def residuals(hand: ScannedHand, bodies: Sequence[Indices]) -> Array:
    """(n, 4) float: height, slant, log thickness and density of bodies less their letter's median, in deviations.

    0 for letters with fewer than `_FEW` glyphs.
    """
    if not bodies:
        return readonly(np.zeros((0, 4)), 0, 4)
    size = np.array([len(body) for body in bodies])
    of, first = np.repeat(np.arange(len(size)), size), np.concatenate([[0], np.cumsum(size)])
    vertices = np.concatenate(list(bodies))
    graphs = [(hand.pages[glyph.page].graph, hand.pages[glyph.page].pitch) for glyph in hand.glyphs]
    both = list(zip(bodies, graphs, strict=True))
    radius = np.concatenate([graph.radius[body] / pitch for body, (graph, pitch) in both])
    density = np.concatenate([graph.density[body] for body, (graph, _) in both])
    _, height, _, slant = body_sizes(hand.placed(of, vertices), radius, first, 1 / hand.pitch).T
    begin = first[:-1]
    thick, dark = np.add.reduceat(radius, begin) / size, np.add.reduceat(density, begin) / size
    features = np.stack([height, slant, np.log(thick), dark], axis=1)
    departures = np.zeros_like(features)
    for letter in hand.letters:
        numbers = hand.of(letter)
        if len(numbers) >= _FEW:
            departures[numbers] = features[numbers] - np.median(features[numbers], axis=0)
    compared = departures[np.abs(departures).sum(axis=1) > 0]
    usual = 1.4826 * np.median(np.abs(compared), axis=0) + 1e-9 if len(compared) else np.ones(4)
    return readonly(np.clip(departures / usual, -_MOST, _MOST), len(size), 4)


_PLACES = 8  # along a ligature, at which two are compared


@dataclass(frozen=True, eq=False)
class GlyphIndex:
    """The glyphs of a hand with all that choosing among them needs.

    letters : (n) letter of each glyph; "" for one without a name.
    places : (n,) int: its place in its word, index in `hand.places.PLACES`.
    before, after : (n,) int: the glyphs beside it in its word, −1 for none.
    exits, entries : (n, k, 8, 2) float: places along each ligature to the glyph after, and from the one before, over
        the baseline; nan where there are fewer.
    residual : (n, 4) float: see `residuals`.
    intrinsic_cost : (n,) float: 0 unless its reading is doubtful, it has no body, or its size is odd.
    """

    hand: ScannedHand
    letters: tuple[str, ...]
    places: Indices
    before: Indices
    after: Indices
    exits: Array
    entries: Array
    residual: Array
    intrinsic_cost: Array

    def __len__(self) -> int:
        return len(self.letters)

    @cached_property
    def _of(self) -> dict[tuple[str, int], Indices]:
        numbers_of: dict[tuple[str, int], list[int]] = {}
        for number, key in enumerate(zip(self.letters, self.places.tolist(), strict=True)):
            numbers_of.setdefault(key, []).append(number)
        return {key: readonly_indices(numbers, None) for key, numbers in numbers_of.items()}

    def of(self, letter: str, place: Place | None = None) -> Indices:
        """(m,) int: the glyphs of a letter, of one place or of all, rising."""
        kinds = range(len(PLACES)) if place is None else (PLACES.index(place),)
        groups = [self._of[letter, kind] for kind in kinds if (letter, kind) in self._of]
        return readonly_indices(np.sort(np.concatenate(groups)) if groups else np.zeros(0), None)

    @cached_property
    def transitions(self) -> TransitionCosts:
        """The costs of writing one glyph after another."""
        return TransitionCosts(self.exits, self.entries, self.residual, self.after)


def index_glyphs(hand: ScannedHand) -> GlyphIndex:
    """The index of a hand's glyphs."""
    glyphs, count = hand.glyphs, len(hand.glyphs)
    inner = _inner(hand)
    bodies = [glyph.vertices[~inner[glyph.page][glyph.vertices]] for glyph in glyphs]
    whole = [body if len(body) else glyph.vertices for body, glyph in zip(bodies, glyphs, strict=True)]
    exits, entries = _ligatures(hand)
    return GlyphIndex(
        hand,
        tuple(glyph.letter for glyph in glyphs),
        readonly_indices([PLACES.index(glyph.place) for glyph in glyphs], count),
        readonly_indices([glyph.before for glyph in glyphs], count),
        readonly_indices([glyph.after for glyph in glyphs], count),
        exits,
        entries,
        residuals(hand, whole),
        readonly(intrinsic_cost(hand, bodies), count),
    )


def _inner(hand: ScannedHand) -> list[NDArray[np.bool_]]:
    """For each page, which vertices lie inside a ligature."""
    inner = [np.zeros(len(page.graph), dtype=bool) for page in hand.pages]
    for glyph in hand.glyphs:
        for way in glyph.ligatures:
            inner[glyph.page][way.path[1:-1]] = True
    return inner


def _ligatures(hand: ScannedHand) -> tuple[Array, Array]:
    """Places along the ligatures of each glyph to the next, and along those from the one before."""
    paths_of = ways(hand)
    most = max((len(paths) for paths in paths_of.values()), default=0)
    exits = np.full((len(hand.glyphs), max(1, most), _PLACES, 2), np.nan)
    entries = exits.copy()
    each = [(number, k, path) for number, paths in paths_of.items() for k, path in enumerate(paths)]
    size = np.array([len(path) for _, _, path in each], dtype=np.intp)
    of = np.repeat(np.array([number for number, _, _ in each], dtype=np.intp), size)
    places = hand.placed(of, np.concatenate([np.zeros(0, dtype=np.intp), *(path for _, _, path in each)]))
    for (number, k, _), way in zip(each, np.split(places, np.cumsum(size)[:-1]), strict=False):
        exits[number, k] = entries[hand.glyphs[number].after, k] = along(way, _PLACES)
    for array in (exits, entries):
        array.flags.writeable = False
    return exits, entries
