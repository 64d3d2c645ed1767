"""Which glyphs strangers take for others, put in words of letters that never stood beside them."""

from dataclasses import replace

import numpy as np
import pytest

from handout.completion.completed_hand import complete_hand
from handout.errors import InputError
from handout.hand.boundaries import mend_boundaries
from handout.hand.learnt import known_values as learnt_of
from handout.writing.glyph_index import WEIGHTS, better_lent, index_glyphs
from handout.writing.legibility import made_words, misreadings, prefer_legible, unclear_letters


def test_made_words_have_every_letter_about_as_often_and_none_twice(small_hand):
    words = list(made_words(small_hand, np.random.default_rng(1)))
    times = np.bincount(np.concatenate(words), minlength=len(small_hand.glyphs))
    letters = [glyph.letter for glyph in small_hand.glyphs]
    assert all(len(set(word)) == len(word) >= 3 for word in words)
    assert {letters[n] for n in np.flatnonzero(times == 0)} <= {letter for letter in letters if not letter.isalnum()}
    assert np.median(times[times > 0]) >= 6


def test_what_is_called_another_letter_is_misread_and_dear(small_hand):
    number = int(small_hand.numbers_of_letter("e")[0])
    glyphs = list(small_hand.glyphs)
    glyphs[number] = replace(glyphs[number], letter="h")
    lying = replace(small_hand, glyphs=tuple(glyphs))
    before, after = misreadings(small_hand), misreadings(lying)
    assert before[number] < 0.5 < 0.8 < after[number]
    assert index_glyphs(lying).intrinsic_cost[number] > 0.8 * WEIGHTS.misread
    others = np.delete(np.arange(len(before)), number)
    assert np.abs(before - after)[others].mean() < 0.2


def test_a_letter_is_told_of_which_every_glyph_is_misread(small_hand):
    wrong = set(small_hand.numbers_of_letter("n").tolist())
    lying = tuple(
        replace(glyph, letter="k") if number in wrong else glyph for number, glyph in enumerate(small_hand.glyphs)
    )
    assert "k" not in unclear_letters(small_hand)
    assert unclear_letters(replace(small_hand, glyphs=lying))["k"] > 0.9


def test_what_is_wished_legible_is_dearer_where_it_is_misread_and_lent_where_its_own_read_worse(small_hand):
    worst = "s"  # strangers misread it most of the letters that are not doubtful anyhow
    numbers = small_hand.numbers_of_letter(worst)
    dull = set(numbers.tolist()) - {int(numbers[misreadings(small_hand)[numbers].argmax()])}
    hand = replace(
        small_hand, glyphs=tuple(replace(g, letter="") if n in dull else g for n, g in enumerate(small_hand.glyphs))
    )
    wished = prefer_legible(hand, 1.0)
    assert prefer_legible(hand, 1.0) is wished and learnt_of(wished) == learnt_of(hand)
    dearer = index_glyphs(wished).intrinsic_cost - index_glyphs(hand).intrinsic_cost
    np.testing.assert_allclose(dearer, WEIGHTS.legible * misreadings(hand))
    assert not better_lent(hand, worst) and better_lent(wished, worst)
    completed, (lent,) = complete_hand(wished, worst)
    assert lent.letter == worst and "as its own read worse" in lent.source and completed.legible == 1.0
    for wish in (-0.1, 1.1):
        with pytest.raises(InputError, match=r"legible: .* is outside 0"):
            prefer_legible(hand, wish)


def test_of_a_hand_without_letters_nothing_is_told(small_hand):
    unnamed = tuple(replace(glyph, letter="", before=-1, after=-1, ligatures=()) for glyph in small_hand.glyphs[:4])
    for glyphs in ((), unnamed):
        silent = replace(small_hand, glyphs=glyphs)
        assert not misreadings(silent).any() and unclear_letters(silent) == {}
        assert mend_boundaries(silent)[1] == 0
