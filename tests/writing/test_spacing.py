"""Distances of letters: the source's own come back, others lie between what either letter had."""

from types import SimpleNamespace

import numpy as np
import pytest

from handout.writing.forms import Forms
from handout.writing.neighbours import neighbours
from handout.writing.spacing import _WORD_SHARES, WORDS, _sampled_gaps, _usual_gap, apart, kinds, side, sides
from handout.writing.variation import Chances
from tests.writing.lines_of_glyphs import gaps


def test_neighbours_of_the_source_have_their_own_distance(small_manner, small_lines):
    for line in small_lines:
        found = gaps(small_manner, line.numbers, line.new_word, np.random.default_rng(0), variation=0)
        assert np.allclose(found, np.diff(line.centre[:, 0]), atol=1e-12)


def test_words_stand_beside_each_other_once(small_hand, small_manner):
    near = small_manner.neighbours
    first, second = near.pairs(parted=True).T
    assert len(first) == 9  # 12 words on three lines
    for a, b in zip(first, second, strict=True):
        one, other = small_hand.glyphs[a], small_hand.glyphs[b]
        assert (one.line, one.word + 1, one.after, other.before) == (other.line, other.word, -1, -1)
    first, second = near.pairs(parted=False).T
    assert [small_hand.glyphs[a].after for a in first] == second.tolist()


def test_a_word_that_lost_a_letter_has_no_space_in_it(small_hand):
    from dataclasses import replace

    glyph = next(i for i, g in enumerate(small_hand.glyphs) if g.before >= 0 and g.after >= 0)
    one = small_hand.glyphs[glyph]
    glyphs = list(small_hand.glyphs)
    glyphs[one.before] = replace(glyphs[one.before], after=-1, ligatures=())
    glyphs[glyph] = replace(one, before=-1)
    hand = replace(small_hand, glyphs=tuple(glyphs))
    x = np.array([hand.centre(i)[0] for i in range(len(glyphs))])
    assert neighbours(hand, x).before[glyph] == -1


def test_estimates_bound_what_is_drawn():
    estimates = np.array([[0.1, 0.1, np.nan, np.nan], [0.3, np.nan, 0.2, np.nan]])
    mean, spread = np.full(4, 0.05), np.full(4, 0.02)
    rng = np.random.default_rng(3)
    drawn = np.array([_sampled_gaps(estimates, mean, spread, Chances.draw(rng, 4).gap, 1.0) for _ in range(2000)])
    low, high = drawn.min(axis=0), drawn.max(axis=0)
    assert 0.07 < low[0] < 0.1 < 0.3 < high[0] < 0.33  # widened a little
    assert drawn[:, 0].std() == pytest.approx((high[0] - low[0]) / 12**0.5, rel=0.05)  # and uniform
    assert low[1] == pytest.approx(0.1, abs=0.003) and high[2] == pytest.approx(0.2, abs=0.003)
    assert drawn[:, 3].mean() == pytest.approx(0.05, abs=0.002) and drawn[:, 3].std() == pytest.approx(0.02, rel=0.1)
    still = _sampled_gaps(estimates, mean, spread, Chances.draw(rng, 4).gap, 0.0)
    assert still == pytest.approx([0.2, 0.1, 0.2, 0.05])


def test_letters_neither_collide_nor_gape(small_manner, jumbles):
    """However wide they are, and whatever stood neighbours them: clearances are those that the author has."""
    space = small_manner.spacing
    centre = small_manner.forms.centre
    for numbers, new_word in jumbles:
        for seed in range(3):
            dx = gaps(small_manner, numbers, new_word, np.random.default_rng(seed), variation=1)
            first, second = numbers[:-1], numbers[1:]
            parted = kinds(small_manner.forms, first, second, new_word[1:])
            upright = dx - space.lean[second] + space.lean[first]
            clear = upright + space.sides.clearance(first, second, parted)
            low, high = space.gaps.low[parted], space.gaps.high[parted]
            strange = small_manner.neighbours.after[first] != second
            least = space.least[space.lifted(first, second, parted).astype(int)]
            assert (clear >= low - 1e-9)[strange].all()
            assert (clear <= high + 1e-9)[strange & (parted == 1)].all()
            for k in np.flatnonzero(strange & (parted != 1)):
                shift = np.array([dx[k], centre[second[k], 1] - centre[first[k], 1]])
                away = apart(small_manner.forms[int(first[k])], small_manner.forms[int(second[k])], shift)
                assert away > least[k] - 0.02
                assert clear[k] <= high[k] + 1e-9 or away < least[k] + 0.02


def test_only_the_shapes_decide_how_near_bodies_come(small_manner):
    """Clearance against every pair of points at one height."""
    sides, forms = small_manner.spacing.sides, small_manner.forms
    slant = forms.hand.pages[0].slant
    for a, b in ((3, 9), (14, 5), (8, 30)):
        one, other = forms[a], forms[b]
        reach = []
        for height in np.arange(-0.48, 1.13, 0.04):
            right = one.xy[:, 0] - slant * one.xy[:, 1] + one.radius
            left = other.xy[:, 0] - slant * other.xy[:, 1] - other.radius
            right = right[np.abs(one.xy[:, 1] + forms.centre[a, 1] - height) < 0.04]
            left = left[np.abs(other.xy[:, 1] + forms.centre[b, 1] - height) < 0.04]
            if len(right) and len(left):
                reach.append(left.min() - right.max())
        found = sides.clearance(np.array([a]), np.array([b]), np.array([0]))
        assert found == pytest.approx([min(reach)])


def test_the_same_seed_gives_the_same(small_manner, jumbles):
    numbers, new_word = jumbles[0]
    one, same, other = (gaps(small_manner, numbers, new_word, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


def test_few_glyphs(small_manner):
    rng = np.random.default_rng(0)
    assert gaps(small_manner, [], [], rng).shape == (0,)
    assert gaps(small_manner, [3], [True], rng).shape == (0,)


def test_ink_apart_is_seen_in_the_plane():
    dot = SimpleNamespace(xy=np.zeros((1, 2)), radius=np.array([0.1]))
    assert apart(dot, dot, np.array([0.3, 0.4])) == pytest.approx(0.3)


def test_punctuation_keeps_its_own_distance(small_manner):
    """A comma is told apart from letters: what it had before it is what it gets after a letter that never had one."""
    letters = [glyph.letter for glyph in small_manner.forms.hand.glyphs]
    comma, space = letters.index(","), small_manner.spacing
    first, second = np.array([3]), np.array([comma])
    assert kinds(small_manner.forms, first, second, np.array([False])) == 2
    edges = space.sides.edges[2]
    dx = gaps(small_manner, [3, comma], [True, False], np.random.default_rng(0), variation=0)
    gap = dx[0] - space.lean[comma] + space.lean[3] + edges[comma, 0] - edges[3, 1]
    before = small_manner.neighbours.before[comma]
    centre = small_manner.forms.centre[:, 0] - space.lean
    own = centre[comma] - centre[before] + edges[comma, 0] - edges[before, 1]
    assert gap == pytest.approx(own)


def test_gaps_between_words_are_drawn_from_all_of_the_page_s(small_manner):
    """Whatever the two glyphs had: a glyph that is written often brings no gap of its own along."""
    space = small_manner.spacing
    words = space.gaps.words
    assert len(words) and (np.diff(words) >= 0).all()
    first, second = small_manner.neighbours.pairs(parted=True).T
    numbers, new_word = np.array([first[0], second[3]]), np.array([True, True])
    found = []
    for seed in range(300):
        dx = gaps(small_manner, numbers, new_word, np.random.default_rng(seed))
        clear = dx - np.diff(space.lean[numbers]) + space.sides.clearance(numbers[:1], numbers[1:], np.array([1]))
        found.append(float(clear[0]))
    low, high = space.gaps.low[1], space.gaps.high[1]
    assert low - 1e-9 <= min(found) and max(found) <= high + 1e-9
    assert np.ptp(found) > 0.9 * np.ptp(np.percentile(words, _WORD_SHARES)), "and not from what one glyph had"


def test_the_last_word_of_a_line_is_known(small_manner):
    second = small_manner.neighbours.pairs(parted=True)[:, 1]
    assert small_manner.neighbours.closes(second).sum() == 3  # lines


def test_few_marks_are_no_rule():
    """One full stop far off among three is not what every third is written like."""
    assert _usual_gap(np.array([0.1, 0.12, 0.9]), 0.08) == pytest.approx((0.12, 0.08, 0.04, 0.2))


def test_one_full_stop_far_off_is_no_end_of_what_is_usual():
    """Of a page's 61 marks one stood 53 x-heights off, and full stops were written up to 4 behind their words."""
    clearances = np.append(np.linspace(0.2, 1.2, 59), 53.0)
    low, high = _usual_gap(clearances, 0.08)[2:]
    assert 0.2 <= low < 0.25 and 1.1 < high < 2.3
    assert _usual_gap(np.append(clearances, np.full(200, 0.5)), 0.08)[3] < 1.3, "of many the percentile tells"


def test_the_sides_of_all_glyphs_are_those_of_each(small_hand):
    forms, slant = Forms(small_hand), 0.1
    together = sides(forms, slant)
    for number in range(0, len(forms), 5):
        xy, radius = forms[number].whole
        upright = xy[:, 0] - slant * xy[:, 1]
        alone = side((upright - radius, upright + radius, xy[:, 1] + forms.centre[number, 1]), WORDS)
        assert (together.left[WORDS, number] == alone[0]).all() and (together.right[WORDS, number] == alone[1]).all()
        assert tuple(together.edges[WORDS, number]) == alone[2:]
