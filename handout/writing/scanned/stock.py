"""What choosing needs to know of every glyph of a scanned hand, worked out once.

All arrays are over the numbers of the hand's glyphs.  Lengths are in line space.

Source: seed 000, §6.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handout.hand.places import PLACES, Place
from handout.hand.scanned import DOUBTFUL, ScannedGlyph, ScannedHand
from handout.values import Array, Indices, readonly, readonly_indices
from handout.writing.scanned.departing import departures
from handout.writing.scanned.forms import along, ways
from handout.writing.scanned.meeting import Meetings
from handout.writing.scanned.oddity import oddity

_DOUBT = 1.0  # cost of a glyph just under the bound of doubt; twice that for one that is nowhere near sure
_BROKEN = 3.0  # cost of a glyph without a body
_PLACES = 8  # along a ligature, that two are compared at


@dataclass(frozen=True, eq=False)
class Stock:
    """The glyphs of a hand, as those who choose among them see them.

    letters : (n) what each glyph is; "" for one that has no name.
    places : (n,) int: its place in its word, index in `hand.scanned.PLACES`.
    before, after : (n,) int: the glyphs beside it in its word, −1 for none.
    exits, entries : (n, k, 8, 2) float: places along each ligature to the glyph after, and from the one before, over
        the baseline; nan where there are fewer.
    departure : (n, 4) float: see `departing.departures`.
    doubt : (n,) float: cost of writing it, 0 unless its reading is doubtful, its ink is not all there or its size odd.
    """

    hand: ScannedHand
    letters: tuple[str, ...]
    places: Indices
    before: Indices
    after: Indices
    exits: Array
    entries: Array
    departure: Array
    doubt: Array

    def __len__(self) -> int:
        return len(self.letters)

    @cached_property
    def _of(self) -> dict[tuple[str, int], Indices]:
        found: dict[tuple[str, int], list[int]] = {}
        for number, key in enumerate(zip(self.letters, self.places.tolist(), strict=True)):
            found.setdefault(key, []).append(number)
        return {key: readonly_indices(numbers, None) for key, numbers in found.items()}

    def of(self, letter: str, place: Place | None = None) -> Indices:
        """(m,) int: the glyphs of a letter, of one place or of all, rising."""
        kinds = range(len(PLACES)) if place is None else (PLACES.index(place),)
        found = [self._of[letter, kind] for kind in kinds if (letter, kind) in self._of]
        return readonly_indices(np.sort(np.concatenate(found)) if found else np.zeros(0), None)

    @cached_property
    def meetings(self) -> Meetings:
        """What it costs to write one glyph after another."""
        return Meetings(self.exits, self.entries, self.departure, self.after)


def stock(hand: ScannedHand) -> Stock:
    """What there is to choose from in a hand."""
    glyphs, count = hand.glyphs, len(hand.glyphs)
    inner = _inner(hand)
    bodies = [glyph.vertices[~inner[glyph.page][glyph.vertices]] for glyph in glyphs]
    whole = [body if len(body) else glyph.vertices for body, glyph in zip(bodies, glyphs, strict=True)]
    exits, entries = _ligatures(hand)
    return Stock(
        hand,
        tuple(glyph.letter for glyph in glyphs),
        readonly_indices([PLACES.index(glyph.place) for glyph in glyphs], count),
        readonly_indices([glyph.before for glyph in glyphs], count),
        readonly_indices([glyph.after for glyph in glyphs], count),
        exits,
        entries,
        departures(hand, whole),
        readonly(_doubt(glyphs, bodies) + oddity(hand, whole), count),
    )


def _inner(hand: ScannedHand) -> list[NDArray[np.bool_]]:
    """For each page, which vertices are on the way from one letter to another."""
    inner = [np.zeros(len(page.graph), dtype=bool) for page in hand.pages]
    for glyph in hand.glyphs:
        for way in glyph.ligatures:
            inner[glyph.page][way.path[1:-1]] = True
    return inner


def _ligatures(hand: ScannedHand) -> tuple[Array, Array]:
    """Places along the ligatures of each glyph to the next, and along those from the one before."""
    found = ways(hand)
    most = max((len(paths) for paths in found.values()), default=0)
    exits = np.full((len(hand.glyphs), max(1, most), _PLACES, 2), np.nan)
    entries = exits.copy()
    each = [(number, k, path) for number, paths in found.items() for k, path in enumerate(paths)]
    size = np.array([len(path) for _, _, path in each], dtype=np.intp)
    of = np.repeat(np.array([number for number, _, _ in each], dtype=np.intp), size)
    places = hand.placed(of, np.concatenate([np.zeros(0, dtype=np.intp), *(path for _, _, path in each)]))
    for (number, k, _), way in zip(each, np.split(places, np.cumsum(size)[:-1]), strict=False):
        exits[number, k] = entries[hand.glyphs[number].after, k] = along(way, _PLACES)
    for array in (exits, entries):
        array.flags.writeable = False
    return exits, entries


def _doubt(glyphs: Sequence[ScannedGlyph], bodies: Sequence[Indices]) -> Array:
    cost = np.zeros(len(glyphs))
    for i, glyph in enumerate(glyphs):
        if glyph.confidence < DOUBTFUL:
            cost[i] += _DOUBT * (2 - glyph.confidence / DOUBTFUL)
        if not len(bodies[i]):
            cost[i] += _BROKEN
    return cost
