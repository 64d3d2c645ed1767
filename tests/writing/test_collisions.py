"""Distances hold for letters as they are written: bent, at their heights, with what hangs over."""

import numpy as np
import pytest

from handout.writing.bending import unbent
from handout.writing.spacing import LETTERS, apart, kinds, letters_at_gap, resolve_collisions
from tests.writing.lines_of_glyphs import bent, gaps, heights


def _set(manner, numbers, new_word, seed):
    rng = np.random.default_rng(seed)
    dx = gaps(manner, numbers, new_word, rng)
    y, bends = heights(manner, numbers, new_word, rng), bent(manner, numbers, rng)
    return dx, y, bends, resolve_collisions(manner.spacing, numbers, new_word, dx, y, bends)


def test_what_is_not_bent_stays(small_manner, jumbles):
    numbers, new_word = jumbles[0]
    dx = gaps(small_manner, numbers, new_word, np.random.default_rng(0))
    y = small_manner.heights.height[numbers]
    found = resolve_collisions(small_manner.spacing, numbers, new_word, dx, y, [unbent()] * len(numbers))
    assert (found >= dx - 1e-9).all() and found == pytest.approx(dx, abs=0.03)


def test_bent_letters_do_not_run_into_each_other(small_manner, jumbles):
    """Nearer than nearly all of the author's: without being moved some are."""
    space, forms, before, after = small_manner.spacing, small_manner.forms, [], []
    for numbers, new_word in jumbles:
        dx, y, bends, found = _set(small_manner, numbers, new_word, 1)
        kind = kinds(forms, numbers[:-1], numbers[1:], new_word[1:])
        least = space.least[space.lifted(numbers[:-1], numbers[1:], kind).astype(int)]
        for k in np.flatnonzero(kind == LETTERS):
            one, other = (_at(forms[int(numbers[i])], bends[i]) for i in (k, k + 1))
            for apart_by, told in ((dx, before), (found, after)):
                told.append(apart(one, other, np.array([apart_by[k], y[k + 1] - y[k]])) - least[k])
    assert min(after) > -1e-3 > min(before)


def test_bars_do_not_hang_over_the_gap_between_words(small_manner, jumbles):
    space, forms = small_manner.spacing, small_manner.forms
    for numbers, new_word in jumbles:
        _, y, bends, dx = _set(small_manner, numbers, new_word, 2)
        x = np.concatenate([[0.0], np.cumsum(dx)]) - space.slant * y
        ends = []
        for i, number in enumerate(numbers):
            xy, radius = forms[int(number)].whole
            upright = bends[i](xy) @ (1.0, -space.slant) + x[i]
            ends.append(((upright - radius).min(), (upright + radius).max()))
        for k in np.flatnonzero(new_word[1:]):
            before, after = letters_at_gap(new_word, int(k))
            assert min(ends[i][0] for i in after) - max(ends[i][1] for i in before) > space.gaps.word - 1e-9


def test_what_hangs_is_of_the_two_words_alone():
    new_word = np.array([True, True, False, False, True, True])
    for k, left, right in ((0, [0], [1, 2]), (3, [3, 2], [4]), (4, [4], [5])):
        before, after = letters_at_gap(new_word, k)
        assert before.tolist() == left and after.tolist() == right


def _at(form, bend):
    from dataclasses import replace

    return replace(form, xy=bend(form.xy))
