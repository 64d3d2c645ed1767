"""What evens out how often the glyphs of a hand are written: a price of each, by how often it would be written.

A few glyphs that read best would else write most of a page, and a page of few glyphs is further from its author's than
one of many, whichever they are.  A glyph is dearer by a fixed weight for each share that it has beyond its fair one
among those of its letter, and cheaper where it has less.  Shares and prices depend on each other: they are found
together, on words of letters that follow one another as on the hand's pages, once for each hand.  The text that is
written then changes nothing in them, as a count of what it has had so far would.

Source: own method; chances of glyphs by the forward-backward algorithm (Baum et al. 1970).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice, pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from handout.hand.places import places
from handout.values import Array, Indices
from handout.writing.legibility import made_words

if TYPE_CHECKING:
    from handout.writing.glyph_index import GlyphIndex

VERSION = 1  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
_WORDS, _ROUNDS = 400, 15  # half a second for a page
_MOST = 64  # candidates of a letter: time
_DEAREST = 60.0  # of a step: beyond that all are as unlikely
# of each letter the numbers of its candidates and what they cost there beyond their own; likelihoods of the steps
_Word: TypeAlias = tuple[list[Indices], list[Array], list[Array]]


def even_prices(index: GlyphIndex, weight: float, noise: float) -> Array:
    """(n,) of each glyph, 0 on average of those of a letter that may be written.

    index : without such prices.
    weight : of each share of its letter, 1 where all are written as often; noise : scale of chance.
    """
    words = list(_words(index, noise))
    letters, share = np.array(index.letters), np.ones(len(index))
    met = np.unique(np.concatenate([np.zeros(0, dtype=np.intp), *(each for word in words for each in word[0])]))
    groups = [met[letters[met] == letter] for letter in np.unique(letters[met])]
    for _ in range(_ROUNDS):
        use = expected_use(words, index.intrinsic_cost + weight * share, noise)
        for group in groups:
            wanted = use[group] * (len(group) / use[group].sum())
            # Newton's step, as if each share fell by its own price alone
            share[group] += (wanted - share[group]) / (1 + weight / noise * np.maximum(wanted, share[group]))
    for group in groups:
        share[group] -= share[group].mean() - 1
    return np.asarray(weight * (share - 1))


def expected_use(words: Sequence[_Word], cost: Array, noise: float) -> Array:
    """(n,): how often each glyph is expected in some words, where a choice is as likely as e^(−its cost / noise)."""
    use = np.zeros(len(cost))
    for numbers, more, steps in words:
        costs = [cost[each] + further for each, further in zip(numbers, more, strict=True)]
        likely = [np.exp((each.min() - each) / noise) for each in costs]
        ahead = likely[:1]
        for step, each in zip(steps, likely[1:], strict=True):
            reached = (ahead[-1] @ step) * each
            ahead.append(reached / reached.sum())
        behind = np.ones(len(numbers[-1]))
        for i in reversed(range(len(numbers))):
            chance = ahead[i] * behind
            use[numbers[i]] += chance / chance.sum()
            if i:
                behind = steps[i - 1] @ (behind * likely[i])
                behind /= behind.max()
    return use


def _words(index: GlyphIndex, noise: float) -> list[_Word]:
    """Words that nobody wrote, of letters as the hand's pages have them."""
    found = list[_Word]()
    for made in islice(made_words(index.hand, np.random.default_rng(0)), _WORDS):
        spelling = [index.letters[number] for number in made]
        each = [index.all_candidates(*target) for target in zip(spelling, places(spelling), strict=True)]
        numbers = [candidates.numbers[:_MOST] for candidates in each]
        more = [
            candidates.cost[: len(some)] - index.intrinsic_cost[some]
            for candidates, some in zip(each, numbers, strict=True)
        ]
        more[-1] = more[-1] + index.ending(numbers[-1])
        steps = [index.steps(one, other, varied=True) for one, other in pairwise(numbers)]
        found.append((numbers, more, [np.exp(-np.minimum(step, _DEAREST) / noise) for step in steps]))
    return found
