"""What choosing knows of a hand's glyphs, and what pairs of them cost."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.hand.scanned import ScannedHand
from handout.writing.scanned.learning import Distance, Forest, as_arrays, learn, mismatch
from handout.writing.scanned.meeting import _CUT
from handout.writing.scanned.oddity import oddity
from handout.writing.scanned.stock import stock


@pytest.fixture(scope="module")
def kept(small_hand):
    return stock(small_hand)


def test_every_glyph_is_there(kept, small_hand):
    assert len(kept) == len(small_hand.glyphs)
    for letter in small_hand.letters:
        assert list(kept.of(letter)) == list(small_hand.of(letter))
    for (letter, place), count in small_hand.instances.items():
        assert len(kept.of(letter, place)) == count
    assert len(kept.of("Q")) == len(kept.of("Q", "start")) == 0


def test_means_are_those_of_the_bodies(kept, small_hand):
    page = small_hand.pages[0]
    for number in range(len(kept)):
        body = small_hand.body(number)
        assert kept.density[number] == pytest.approx(page.graph.density[body].mean(), abs=0.05)
        assert kept.radius[number] == pytest.approx(page.graph.radius[body].mean() / page.pitch, rel=0.1)


def test_features_are_shares_and_of_the_glyph_alone(kept, small_hand):
    assert np.allclose(kept.feature.sum(axis=1), 1) and (kept.feature >= 0).all()
    # a full stop goes nowhere; a comma's feature is not a letter's
    alike = [np.abs(kept.feature[a] - kept.feature[b]).sum() for a in kept.of("e") for b in kept.of("e") if a < b]
    other = [np.abs(kept.feature[a] - kept.feature[b]).sum() for a in kept.of("e") for b in kept.of("i")]
    assert np.median(alike) < np.median(other)


def test_ligatures_have_their_steps_on_both_sides(kept, small_hand):
    joined = 0
    for number, glyph in enumerate(small_hand.glyphs):
        steps = kept.exits[number][~np.isnan(kept.exits[number, :, 0])]
        assert len(steps) == len(glyph.ligatures)
        for step, way in zip(steps, glyph.ligatures, strict=True):
            assert step == pytest.approx(way.end - way.start)
            joined += 1
        if glyph.after >= 0:
            assert np.array_equal(kept.exits[number], kept.entries[glyph.after], equal_nan=True)
    assert joined > 5


def test_neighbours_in_the_source_are_free_and_spaces_count_half(kept):
    numbers = np.arange(len(kept))
    within, parted = (kept.meetings.cost(numbers, numbers, apart) for apart in (False, True))
    first = np.flatnonzero(kept.after >= 0)
    assert (within[first, kept.after[first]] == 0).all() and (within >= 0).all()
    lifted = kept.meetings.leaves[:, None] == kept.meetings.comes
    kept_on = parted - _CUT * (1.0 * kept.meetings.leaves[:, None] + kept.meetings.comes)
    assert np.allclose(kept_on[lifted], within[lifted] / 2) and (kept_on[~lifted] < within[~lifted] / 2).all()
    # a block asked for by itself is the same
    assert np.array_equal(stock(kept.hand).meetings.cost(numbers[3:7], numbers[:5], False), within[3:7, :5])


@settings(max_examples=80, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-2, 2)] * 4), min_size=2, max_size=2))
def test_a_mismatch_is_the_least_over_all_shifts(ends):
    (s1, e1), (s2, e2) = (np.array(row).reshape(2, 2) for row in ends)

    # with s and e of the second seen from its own side: its start meets the end of the first
    def apart(shift):
        return np.linalg.norm(s1 - (s2 + shift)) + np.linalg.norm(e1 - (e2 + shift))

    found = float(mismatch((e1 - s1)[None], (e2 - s2)[None]))
    assert found == pytest.approx(apart((s1 + e1 - s2 - e2) / 2), abs=1e-9)
    rng = np.random.default_rng(0)
    assert all(apart(shift) >= found - 1e-9 for shift in rng.normal(0, 1.5, (50, 2)))


def test_of_several_ligatures_the_best_two_count():
    none = [np.nan, np.nan]
    assert mismatch(np.array([[1.0, 0], [0, 1]]), np.array([[0, 1.0], none])) == 0
    assert mismatch(np.array([none]), np.array([[0.0, 1]])) == np.inf


def test_the_forest_predicts_as_its_makers_does():
    from sklearn.ensemble import ExtraTreesRegressor

    rng = np.random.default_rng(0)
    one, other = rng.random((2, 300, 216)).astype(np.float32)
    pairs = np.concatenate([one + other, np.abs(one - other)], axis=1)
    made = ExtraTreesRegressor(8, max_depth=6, random_state=0).fit(pairs, pairs[:, 3] + pairs[:, 300])
    forest = as_arrays([tree.tree_ for tree in made.estimators_])
    assert np.allclose(forest.predict(one, other), made.predict(pairs), atol=1e-5)


def test_a_forest_learns_what_looks_tell_of_ligatures():
    rng = np.random.default_rng(1)
    feature = rng.dirichlet(np.full(216, 0.3), 120)
    rise = 10 * feature[:, 5]
    steps = np.stack([np.ones(120), rise], axis=1)[:, None]
    forest = learn(feature, steps, steps)
    assert isinstance(forest, Forest)
    one, other = rng.integers(0, 120, (2, 500))
    own = feature.astype(np.float32)
    guessed, true = forest.predict(own[one], own[other]), np.abs(rise[one] - rise[other])
    assert np.corrcoef(guessed, true)[0, 1] > 0.6
    again = learn(feature, steps, steps)
    assert np.array_equal(again.predict(own[one], own[other]), guessed)


def test_a_hand_that_never_joins_is_told_by_looks(small_hand):
    lifted = tuple(replace(glyph, ligatures=()) for glyph in small_hand.glyphs)
    kept = stock(ScannedHand("p", "p", small_hand.pages, lifted))
    assert isinstance(learn(kept.feature, kept.exits, kept.entries), Distance)
    numbers = np.arange(len(kept))
    cost = kept.meetings.cost(numbers, numbers, False)
    assert np.isfinite(cost).all() and 0.05 < np.median(cost) < 1


def test_doubtful_and_broken_glyphs_cost_more(small_hand):
    number = int(small_hand.of("n")[0])
    glyphs = list(small_hand.glyphs)
    glyphs[number] = replace(glyphs[number], confidence=0.1)
    doubted = stock(replace(small_hand, glyphs=tuple(glyphs)))
    sure = stock(small_hand)
    assert doubted.doubt[number] > sure.doubt[number] + 1
    joined = next(i for i, g in enumerate(small_hand.glyphs) if g.ligatures and len(g.ligatures[0].path) > 4)
    glyphs[joined] = replace(glyphs[joined], vertices=np.sort(glyphs[joined].ligatures[0].path[1:3]))
    assert stock(replace(small_hand, glyphs=tuple(glyphs))).doubt[joined] >= 3


def test_half_a_glyph_is_odd(small_hand):
    bodies = [small_hand.body(number) for number in range(len(small_hand.glyphs))]
    number = int(small_hand.of("n")[1])
    whole = oddity(small_hand, bodies)[number]
    x = small_hand.pages[0].graph.uv[bodies[number], 0]
    bodies[number] = bodies[number][x <= np.quantile(x, 0.15)]
    assert oddity(small_hand, bodies)[number] > whole + 0.2
