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
from typing import TypeAlias

import numpy as np

from handout.values import Array, Indices

VERSION = 1  # of what is kept of a hand; tests/hand/test_house_scanned.py says when to raise it
_ROUNDS = 15  # half a second for a page
# of each letter the numbers of its candidates and what they cost there beyond their own; likelihoods of the steps
Word: TypeAlias = tuple[list[Indices], list[Array], list[Array]]


def even_prices(words: Sequence[Word], letters: Sequence[str], cost: Array, weight: float, noise: float) -> Array:
    """(n,) of each glyph, 0 on average of those of a letter that may be written.

    words : that they are found on; letters, cost : (n,) of each glyph.
    weight : of each share of its letter, 1 where all are written as often; noise : scale of chance.
    """
    share = np.ones(len(cost))
    met = np.unique(np.concatenate([np.zeros(0, dtype=np.intp), *(each for word in words for each in word[0])]))
    names = np.array(letters)[met]
    groups = [met[names == name] for name in np.unique(names)]
    for _ in range(_ROUNDS):
        use = expected_use(words, cost + weight * share, noise)
        for group in groups:
            wanted = use[group] * (len(group) / use[group].sum())
            # Newton's step, as if each share fell by its own price alone
            share[group] += (wanted - share[group]) / (1 + weight / noise * np.maximum(wanted, share[group]))
    for group in groups:
        share[group] -= share[group].mean() - 1
    return np.asarray(weight * (share - 1))


def expected_use(words: Sequence[Word], cost: Array, noise: float) -> Array:
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
