"""The letters that a text asks of a scanned hand, and the glyphs that may be written for each.

Source: seed 000, §6.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handout.errors import MissingCharacters
from handout.hand.places import Place
from handout.values import Array, Indices, readonly, readonly_indices
from handout.writing.scanned.choice_costs import WEIGHTS, candidate_cost
from handout.writing.scanned.glyph_index import GlyphIndex

_MOST_NAMED = 20  # characters that a complaint lists


@dataclass(frozen=True)
class TargetLetter:
    """One letter that is to be written.

    letter : a grapheme.
    place : in its word.
    word : number of its word in the text, rising.
    at : where it stands in the text, graphemes from 0.
    """

    letter: str
    place: Place
    word: int
    at: int


def substitute_letter(index: GlyphIndex, letter: str) -> str:
    """The letter whose glyphs are written for `letter`: itself, or the small letter for a missing capital, or ""."""
    if letter and len(index.of(letter)):
        return letter
    lower_case = letter.lower()
    return lower_case if letter and lower_case != letter and len(index.of(lower_case)) else ""


def check_letters(index: GlyphIndex, targets: Sequence[TargetLetter]) -> None:
    """Check that every letter has a glyph, or that of another letter.

    Raises
    ------
    MissingCharacters
        Some have none; the message lists them with their places.
    """
    missing: dict[str, list[int]] = {}
    for target in targets:
        if not substitute_letter(index, target.letter):
            missing.setdefault(target.letter, []).append(target.at)
    if missing:
        named = ", ".join(f"'{letter}' ({_places(at)})" for letter, at in list(missing.items())[:_MOST_NAMED])
        more = f", and {len(missing) - _MOST_NAMED} others" if len(missing) > _MOST_NAMED else ""
        raise MissingCharacters(
            f"The hand {index.hand.name} has no glyph of {named}{more}: use another hand, or scan a page with them."
        )


def _places(at: Sequence[int]) -> str:
    named = ", ".join(str(place + 1) for place in at[:3])
    more = f" and {len(at) - 3} more" if len(at) > 3 else ""
    return f"character{'s' if len(at) > 1 else ''} {named} of the text{more}"


ENOUGH = 8  # exact matches from which on no others are asked
_MOST = 64  # candidates of a place: time
_DRAWN = 24  # the same where a hand has more good ones than that: other ones each time, or the same few would be taken


@dataclass(frozen=True, eq=False)
class Candidates:
    """Glyphs that may stand in one place.

    numbers : (k,) int.
    cost : (k,) float ≥ 0.
    """

    numbers: Indices
    cost: Array


def candidates_of(
    index: GlyphIndex, targets: Sequence[TargetLetter], rng: np.random.Generator | None = None
) -> list[Candidates]:
    """The candidates of every target letter.

    Parameters
    ----------
    rng : numpy.random.Generator, optional
        Draws the candidates where there are many; without it they are the best, always the same.

    Raises
    ------
    MissingCharacters
        Some letters have none.
    """
    check_letters(index, targets)
    kinds = {(target.letter, target.place) for target in targets}
    every = {kind: _all_candidates(index, *kind) for kind in kinds}
    if rng is None:
        few = {
            kind: _subset(candidates, np.arange(min(len(candidates.numbers), _MOST)))
            for kind, candidates in every.items()
        }
        return [few[target.letter, target.place] for target in targets]
    return [_sampled(every[target.letter, target.place], rng) for target in targets]


def _all_candidates(index: GlyphIndex, letter: str, place: Place) -> Candidates:
    """All glyphs that might do, the best first."""
    substitute = substitute_letter(index, letter)
    numbers = index.of(substitute, place)
    if (index.intrinsic_cost[numbers] < WEIGHTS.elsewhere).sum() < ENOUGH:
        numbers = index.of(substitute)
    cost = candidate_cost(index.intrinsic_cost[numbers], index.places[numbers], place)
    order = np.argsort(cost, kind="stable")
    return Candidates(
        readonly_indices(numbers[order], None),
        readonly(cost[order] + WEIGHTS.other_case * (substitute != letter), None),
    )


def _sampled(candidates: Candidates, rng: np.random.Generator) -> Candidates:
    good = int(np.searchsorted(candidates.cost, candidates.cost[0] + WEIGHTS.elsewhere))
    if good <= _MOST:
        return _subset(candidates, np.arange(min(len(candidates.numbers), _MOST)))
    return _subset(candidates, rng.choice(good, _DRAWN, replace=False))


def _subset(candidates: Candidates, which: Indices) -> Candidates:
    rising = which[np.argsort(candidates.numbers[which])]
    return Candidates(readonly_indices(candidates.numbers[rising], None), readonly(candidates.cost[rising], None))
