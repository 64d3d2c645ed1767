"""Choosing glyphs: what every chooser needs (the cheapest sequence, the costs of repetition), and that of drawn forms.

`Chooser` decides which form of each letter a drawn hand writes: one Viterbi pass a word, perturbed so that no two words
come out alike.  Its unary costs come from the place in the word and from how recently a form was used, its pairwise
costs from how the end of one glyph meets the start of the next.  Scanned glyphs are chosen in `scanned.choosing`.

Source: seed 000, §6.2 (perturb-and-MAP; the costs are this project's).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from handout.values import Array, Glyph, Hand, Indices
from handout.writing.text import Letter

_EXITS = {"low": 0, "high": 1, "lifted": 2}
_ENTRIES = {"low": 0, "high": 1, "free": 2, "lifted": 3}
# cost of exit (row) meeting entry (column); joined pairs are those of a joining exit with another entry than "lifted"
_MEET = np.array([[0.0, 5.0, 0.0, 0.0], [5.0, 0.0, 0.0, 0.0], [6.0, 7.0, 0.0, 0.0]])
_REUSE = 4.0  # cost of the form just used, falling with the letters written since
_MEMORY = 12.0  # letters after which a use is half forgotten
_HIGH_START = 5.0  # cost of a word that begins with the way in from a high exit
_TWIN = 6.0  # cost of the same form twice running, as in "ll"


def viterbi(unary: Sequence[Array], steps: Sequence[Array]) -> list[int]:
    """The cheapest sequence of states.

    Parameters
    ----------
    unary : n of (kᵢ,) float: costs of the states of each place.
    steps : n − 1 of (kᵢ, kᵢ₊₁) float: costs of going from each state of a place to each of the next.

    Returns
    -------
    n numbers of states; among equals the first.
    """
    best, back = unary[0], list[Indices]()
    for costs, step in zip(unary[1:], steps, strict=True):
        total = best[:, None] + step
        origin = total.argmin(axis=0)
        back.append(origin)
        best = total[origin, np.arange(len(costs))] + costs
    path = [int(best.argmin())]
    for origin in reversed(back):
        path.append(int(origin[path[-1]]))
    return path[::-1]


def fading_cost(age: Array, weight: float, forgotten: float) -> Array:
    """(k,): of using something again, from `weight` at once evenly down to 0 when `forgotten`: for many instances."""
    return np.asarray(weight * np.maximum(0.0, 1.0 - age / forgotten))


def halving_cost(age: Array, weight: float, half_life: float) -> Array:
    """(k,): the same, halved every `half_life`, never 0: for few forms, of which the least recent is the best."""
    return np.asarray(weight * 0.5 ** (age / half_life))


@dataclass(frozen=True, eq=False)
class _Forms:
    glyphs: tuple[Glyph, ...]
    exits: NDArray[np.intp]
    entries: NDArray[np.intp]
    forms: NDArray[np.intp]
    reluctance: Array
    favour: Array


class Chooser:
    """Chooses the glyphs of one text, word by word; remembers what it used.

    Parameters
    ----------
    hand : Hand
    rng : numpy.random.Generator
    variation : float
        Scale of the perturbation; 0 always takes the best form.
    """

    def __init__(self, hand: Hand, rng: np.random.Generator, variation: float = 1.0) -> None:
        self._hand = hand
        self._rng = rng
        self._variation = variation
        self._written = 0
        self._last: dict[tuple[str, int], int] = {}
        self._cache: dict[tuple[str, str, str, str], _Forms] = {}

    def word(self, letters: Sequence[Letter]) -> list[Glyph]:
        """The glyphs for the letters of one word (with its punctuation)."""
        options = self._options(letters)
        costs = [self._unary(candidates, place) for place, candidates in enumerate(options)]
        costs[0] = costs[0] + np.where(options[0].entries == _ENTRIES["high"], _HIGH_START, 0.0)
        steps = [_pairwise(left, right, self._variation) for left, right in pairwise(options)]
        chosen = [forms.glyphs[i] for forms, i in zip(options, viterbi(costs, steps), strict=True)]
        for glyph in chosen:
            self._last[glyph.letter, glyph.form] = self._written
            self._written += 1
        return chosen

    def _options(self, letters: Sequence[Letter]) -> list[_Forms]:
        bases = ["", *(letter.base for letter in letters), ""]
        return [
            self._candidates(base, place, before, after)
            for base, place, before, after in zip(bases[1:], runs(letters), bases, bases[2:], strict=False)
        ]

    def _candidates(self, letter: str, place: str, before: str, after: str) -> _Forms:
        key = (letter, place, before, after)
        if key not in self._cache:
            self._cache[key] = _gather(_possible(self._hand.glyphs[letter], letter, place, before, after))
        return self._cache[key]

    def _unary(self, candidates: _Forms, place: int) -> Array:
        if not self._variation:
            return -candidates.favour
        noise = np.log(-np.log(self._rng.uniform(1e-12, 1.0, len(candidates.glyphs))))
        written = self._written + place
        since = [written - self._last.get((g.letter, g.form), -1000) for g in candidates.glyphs]
        reuse = halving_cost(np.array(since), _REUSE, _MEMORY)
        return np.asarray(self._variation * noise + reuse - candidates.favour)


def runs(letters: Sequence[Letter]) -> list[str]:
    """For each letter, its place in its word: "start", "middle", "end" or "alone".

    The place of a small letter is counted among small letters: a capital, a digit or a quotation mark is not
    joined to it, so what follows starts afresh.
    """

    bases = ["", *(letter.base for letter in letters), ""]
    places = []
    for before_it, base, after_it in zip(bases, bases[1:], bases[2:], strict=False):
        same = str.islower if base.islower() else str.isalpha
        before, after = same(before_it) and before_it.isalpha(), same(after_it) and after_it.isalpha()
        places.append("middle" if before and after else "end" if before else "start" if after else "alone")
    return places


def _possible(glyphs: Sequence[Glyph], letter: str, place: str, before: str, after: str) -> list[Glyph]:
    """What may be written here: a small letter after a capital starts afresh or, if the capital joins, goes on."""
    fit = _fitting(glyphs, place, before, after)
    if letter.islower() and before.isupper():
        within = {"start": "middle", "alone": "end"}.get(place, place)
        fit += [g for g in _fitting(glyphs, within, before, after) if g.entry in ("low", "high")]
    if letter.isupper() and not after.islower():
        fit = [glyph for glyph in fit if glyph.exit == "lifted"] or fit
    return fit


def _fitting(glyphs: Sequence[Glyph], place: str, before: str, after: str) -> list[Glyph]:
    """The glyphs for a place and neighbours; of each kind of entry only the most particular."""
    beside = [
        glyph
        for glyph in glyphs
        if (not glyph.after or (before and before in glyph.after))
        and (not glyph.before or (after and after in glyph.before))
    ]
    fit = [glyph for glyph in beside if place in glyph.places] or beside or list(glyphs)
    best: dict[str, int] = {}
    for glyph in fit:
        best[glyph.entry] = max(best.get(glyph.entry, 0), glyph.rank)
    return [glyph for glyph in fit if glyph.rank == best[glyph.entry]]


def _gather(glyphs: Sequence[Glyph]) -> _Forms:
    return _Forms(
        tuple(glyphs),
        np.array([_EXITS[glyph.exit] for glyph in glyphs]),
        np.array([_ENTRIES[glyph.entry] for glyph in glyphs]),
        np.array([hash_form(glyph) for glyph in glyphs]),
        np.array([glyph.reluctance for glyph in glyphs]),
        np.array([glyph.favour for glyph in glyphs]),
    )


def hash_form(glyph: Glyph) -> int:
    """A number that two glyphs share exactly when they derive from one drawn form."""
    return ord(glyph.letter[0]) * 4096 + glyph.form


def _pairwise(left: _Forms, right: _Forms, variation: float) -> Array:
    cost: Array = _MEET[np.ix_(left.exits, right.entries)]
    joins = left.exits != _EXITS["lifted"]
    cost = cost + joins[:, None] * right.reluctance
    if variation:
        cost = cost + _TWIN * (left.forms[:, None] == right.forms)
    return cost
