"""What setting is tested with: the layout_model of the small hand, and its lines in the order of writing."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest


@pytest.fixture(scope="session")
def small_manner(small_hand):
    from handout.writing.word_layout import layout_model

    return layout_model(small_hand)


@pytest.fixture(scope="session")
def small_lines(small_manner):
    """Every line of the source as it was written: glyphs, where a word begins, and where their centres are."""
    hand, centre = small_manner.forms.hand, small_manner.forms.centre
    found = []
    for line in range(len(hand.pages[0].baselines)):
        own = np.array([i for i, glyph in enumerate(hand.glyphs) if glyph.line == line])
        own = own[np.argsort([(hand.glyphs[i].word, hand.glyphs[i].at) for i in own], axis=0)[:, 1]]
        fresh = [True, *(hand.glyphs[a].after != b for a, b in pairwise(own))]
        found.append(SimpleNamespace(numbers=own, new_word=np.array(fresh), centre=centre[own]))
    return found


@pytest.fixture(scope="session")
def jumbles(small_manner):
    """Glyphs in an order that they never had, as words of five."""
    count = len(small_manner.forms)
    orders = [np.random.default_rng(seed).permutation(count)[:30] for seed in range(4)]
    return [(order, np.arange(len(order)) % 5 == 0) for order in orders]
