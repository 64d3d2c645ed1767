"""Which glyphs of a scanned hand write a text: the cheapest sequence, perturbed so that no two come out alike.

Without variation the whole text is one chain, solved exactly.  With it each word is, given what was written before:
a glyph is the dearer the less long ago it was written, which no chain could know of itself.  All costs are in
`choice_costs`.

Source: seed 000, §6.2 (perturb-and-MAP).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from handout.values import Array, Indices
from handout.writing.choice import viterbi
from handout.writing.scanned.candidates import Candidates, TargetLetter, candidates_of
from handout.writing.scanned.choice_costs import WEIGHTS, UsageHistory
from handout.writing.scanned.glyph_index import GlyphIndex

_TRIES = 16  # times that a word is solved for having a glyph twice; real words are done after one or two


def choose(
    index: GlyphIndex,
    targets: Sequence[TargetLetter],
    rng: np.random.Generator,
    *,
    variation: float = 1.0,
    history: UsageHistory | None = None,
) -> Indices:
    """The glyphs that write a text.

    Parameters
    ----------
    index : GlyphIndex
    targets : sequence of TargetLetter
        In the order of the text.
    rng : numpy.random.Generator
        The same generator gives the same glyphs.
    variation : float ≥ 0
        0: the glyphs that go together best, always the same.  1: as the author varies.
    history : UsageHistory
        What was written before; what is written now is added.  Without it the text begins afresh.

    Returns
    -------
    (n,) int: numbers of glyphs of the hand.

    Raises
    ------
    MissingCharacters
        The hand has no glyph for some letters.
    """
    candidates = candidates_of(index, targets, rng if variation > 0 else None)
    parts = [part.numbers for part in solve(index, targets, candidates, rng, variation, history)]
    return np.concatenate([np.zeros(0, dtype=np.intp), *parts])


@dataclass(frozen=True, eq=False)
class Solved:
    """A part of a text that was solved as one chain.

    first : index of its first letter among the targets.
    numbers : (m,) int: the glyphs taken.
    noise, again : m of (k,) float: what was added to the costs of each letter's candidates.
    """

    first: int
    numbers: Indices
    noise: tuple[Array, ...]
    again: tuple[Array, ...]


def solve(
    index: GlyphIndex,
    targets: Sequence[TargetLetter],
    candidates: Sequence[Candidates],
    rng: np.random.Generator,
    variation: float,
    history: UsageHistory | None,
) -> Iterator[Solved]:
    """As `choose`, from `candidates`, part by part: the words of the text, or all of it without variation."""
    if not targets:
        return
    if variation <= 0:
        none = tuple(np.zeros(len(each.numbers)) for each in candidates)
        steps = _steps(index, targets, candidates)
        unary = [each.cost for each in candidates]
        unary[-1] = unary[-1] + index.transitions.cut(candidates[-1].numbers)
        yield Solved(0, _taken(candidates, viterbi(unary, steps)), none, none)
        return
    history = UsageHistory(len(index)) if history is None else history
    before: Indices | None = None
    for first, last in _words(targets):
        word_candidates = candidates[first:last]
        noise = tuple(variation * WEIGHTS.noise * _noise(rng, len(each.numbers)) for each in word_candidates)
        again = tuple(history.cost(each.numbers, i) for i, each in enumerate(word_candidates))
        unary = [each.cost + chance for each, chance in zip(word_candidates, noise, strict=True)]
        if before is not None:
            unary[0] = unary[0] + index.transitions.cost(before, word_candidates[0].numbers, parted=True)[0]
        unary[-1] = unary[-1] + index.transitions.cut(word_candidates[-1].numbers)
        numbers = _word(word_candidates, unary, again, _steps(index, targets[first:last], word_candidates))
        history.write(numbers)
        before = numbers[-1:]
        yield Solved(first, numbers, noise, again)


def _word(
    candidates: Sequence[Candidates], unary: Sequence[Array], again: Sequence[Array], steps: Sequence[Array]
) -> Indices:
    """The glyphs of one word.

    Where one comes twice, it is made dear in its later places, in `again`, and the word is solved anew.
    """
    for _ in range(_TRIES):
        path = viterbi([costs + more for costs, more in zip(unary, again, strict=True)], steps)
        numbers = _taken(candidates, path)
        twice = np.setdiff1d(np.arange(len(numbers)), np.unique(numbers, return_index=True)[1])
        if not len(twice):
            break
        for i in twice:
            again[i][path[i]] += WEIGHTS.again
    return numbers


def _steps(index: GlyphIndex, targets: Sequence[TargetLetter], candidates: Sequence[Candidates]) -> list[Array]:
    return [
        index.transitions.cost(a.numbers, b.numbers, left.word != right.word)
        for (a, b), (left, right) in zip(pairwise(candidates), pairwise(targets), strict=True)
    ]


def _taken(candidates: Sequence[Candidates], path: Sequence[int]) -> Indices:
    return np.array([each.numbers[k] for each, k in zip(candidates, path, strict=True)], dtype=np.intp)


def _words(targets: Sequence[TargetLetter]) -> Iterator[tuple[int, int]]:
    """Where each word begins and ends."""
    sizes = [len(list(word)) for _, word in groupby(targets, lambda target: target.word)]
    return pairwise([0, *np.cumsum(sizes).tolist()])


def _noise(rng: np.random.Generator, count: int) -> Array:
    """(count,) Gumbel noise for a cost that is minimised."""
    return -rng.gumbel(size=count)
