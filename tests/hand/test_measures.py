"""What a scanned hand measures."""

from dataclasses import replace

import numpy as np
import pytest

from handout.hand import file, library, measures
from handout.hand.letter_classes import FULL_ASCENDERS, X_HEIGHT


def test_lengths_are_of_letters(small_hand):
    unit = measures.x_height(small_hand)
    assert unit == pytest.approx(small_hand.x_height / small_hand.pages[0].pitch)
    assert 1.3 * unit <= measures.capital_height(small_hand) <= 3.5 * unit
    width = small_hand.x_height / measures.x_height_in_half_widths(small_hand)
    assert measures.half_width(small_hand) == pytest.approx(width, rel=0.1)
    tops = [small_hand.outline(i)[:, 1].max() for i, g in enumerate(small_hand.glyphs) if g.letter in FULL_ASCENDERS]
    assert measures.ascender_height(small_hand) == pytest.approx(np.median(tops))


def test_joins_are_counted_within_words(small_hand):
    joins = measures.joins(small_hand)
    assert joins.joined == sum(bool(glyph.ligatures) for glyph in small_hand.glyphs)
    assert 0 < joins.share <= 1
    assert measures.Joins(0, 0).share == 0


def test_letters_of_the_other_case_are_told_by_their_size():
    """On pages of a hand that had no part in setting the bounds: .93 of those planted, and hardly a right one."""
    hand = file.load(library.scanned_file("house-print-fountain"))
    cased = [i for i, glyph in enumerate(hand.glyphs) if glyph.letter and glyph.letter.lower() in "ckopsuvwxz"]
    assert measures.contradicted_cases(hand)[cased].mean() < 0.005
    planted, glyphs = cased[::13], list(hand.glyphs)
    for i in planted:
        glyphs[i] = replace(glyphs[i], letter=glyphs[i].letter.swapcase())
    found = measures.contradicted_cases(replace(hand, glyphs=tuple(glyphs)))
    assert found[planted].mean() > 0.92
    assert found[np.setdiff1d(cased, planted)].mean() < 0.01
    assert not np.delete(found, cased).any()


def test_letters_that_hold_ink_of_the_next_line_are_told(small_hand):
    """The stem under a g that runs into it, and the letter over it; and no letter as it was written."""
    assert not measures.reaching_lines(small_hand).any()
    glyphs = small_hand.glyphs
    over = next(i for i, glyph in enumerate(glyphs) if glyph.line == 0 and glyph.letter)
    below = next(i for i, glyph in enumerate(glyphs) if glyph.line == 1 and glyph.letter == "m")
    both = np.union1d(glyphs[over].vertices, glyphs[below].vertices)
    for taker in (over, below):
        lying = replace(
            small_hand, glyphs=tuple(replace(g, vertices=both) if i == taker else g for i, g in enumerate(glyphs))
        )
        assert np.flatnonzero(measures.reaching_lines(lying)).tolist() == [taker]


def test_letters_that_hold_a_bar_of_their_neighbour_are_told(small_hand):
    """An r with the bar of the t before it; and hardly a letter as it was written."""
    assert measures.outsized_letters(small_hand).mean() < 0.02
    glyphs, names = small_hand.glyphs, [glyph.letter for glyph in small_hand.glyphs]
    tall = next(i for i, name in enumerate(names) if name in FULL_ASCENDERS)
    page, line = glyphs[tall].page, glyphs[tall].line
    taker = next(
        i
        for i, g in enumerate(glyphs)
        if g.letter in X_HEIGHT and names.count(g.letter) > 4 and (g.page, g.line) == (page, line)
    )
    both = np.union1d(glyphs[tall].vertices, glyphs[taker].vertices)
    given = replace(
        small_hand, glyphs=tuple(replace(g, vertices=both) if i == taker else g for i, g in enumerate(glyphs))
    )
    assert measures.outsized_letters(given)[taker]


def test_accented_letters_without_their_accent_are_told(small_hand):
    def renamed(letter, name):
        glyphs = tuple(replace(g, letter=name) if g.letter == letter else g for g in small_hand.glyphs)
        return measures.unmarked_letters(replace(small_hand, glyphs=glyphs))

    letters = np.array([glyph.letter for glyph in small_hand.glyphs])
    assert not measures.unmarked_letters(small_hand).any()
    assert renamed("e", "è")[letters == "e"].mean() > 0.95
    assert renamed("i", "í")[letters == "i"].mean() < 0.05  # it has its dot
    assert not renamed("e", "ę").any()  # its mark hangs below


def test_where_bare_letters_are_high_a_high_letter_has_no_accent(small_hand):
    pages = tuple(replace(page, x_height=page.x_height / 1.35) for page in small_hand.pages)
    es = [i for i, glyph in enumerate(small_hand.glyphs) if glyph.letter == "e"]
    middling = [es[0], es[4]]  # 1.25 and 1.31 high now; the others .97 to 1.47
    glyphs = tuple(replace(g, letter="è") if i in middling else g for i, g in enumerate(small_hand.glyphs))
    assert measures.unmarked_letters(replace(small_hand, pages=pages, glyphs=glyphs))[middling].all()
