"""What choosing knows of a hand's glyphs, and what pairs of them cost."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.hand.scanned import ScannedHand
from handout.writing.scanned.learning import Distance, learn, mismatch
from handout.writing.scanned.meeting import _CUT, Meetings
from handout.writing.scanned.oddity import oddity
from handout.writing.scanned.stock import stock
from handout.writing.scanned.trees import Forest, grow, pair_features


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


def test_ligatures_have_their_places_on_both_sides(kept, small_hand):
    joined = 0
    for number, glyph in enumerate(small_hand.glyphs):
        ways = kept.exits[number][~np.isnan(kept.exits[number, :, 0, 0])]
        assert len(ways) == len(glyph.ligatures)
        line = small_hand.outline(number)
        other = small_hand.outline(glyph.after) if glyph.ligatures else line
        for way in ways:
            assert np.abs(line - way[0]).sum(axis=1).min() < 1e-12
            assert np.abs(other - way[-1]).sum(axis=1).min() < 1e-12
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
@given(st.lists(st.tuples(*[st.floats(-2, 2)] * 8), min_size=2, max_size=2), st.floats(-3, 3))
def test_a_mismatch_is_how_far_ways_on_one_baseline_are_apart(ways, shift):
    out, into = (np.array(row).reshape(4, 2) for row in ways)
    found = float(mismatch(out[None], into[None]))
    # along the line they may be moved, and neither is preferred
    assert found == pytest.approx(float(mismatch(out[None] + [shift, 0.0], into[None])), abs=1e-9)
    assert found == pytest.approx(float(mismatch(into[None], out[None])), abs=1e-9)
    assert float(mismatch(out[None], out[None])) == pytest.approx(0, abs=1e-12)
    # one over the other does not meet it
    assert float(mismatch(out[None] + [shift, 0.3], out[None])) == pytest.approx(0.3)
    level = abs((out - into)[:, 1].mean())
    assert found >= level - 1e-9


def test_of_several_ligatures_the_best_two_count():
    one, other, none = np.zeros((4, 2)), np.outer(np.arange(4), [0.0, 1.0]), np.full((4, 2), np.nan)
    assert mismatch(np.stack([one, other]), np.stack([other, none])) == 0
    assert mismatch(none[None], other[None]) == np.inf


def test_ligatures_that_meet_none_cost(kept):
    """A t whose bar goes over to the h is not for a letter that shows one way only."""
    meetings = kept.meetings
    exits = np.concatenate([kept.exits, np.full_like(kept.exits[:, :1], np.nan)], axis=1)
    number = int(np.flatnonzero(meetings.leaves & (kept.after >= 0))[0])
    exits[number, -1] = exits[number, 0]
    more = Meetings(kept.feature, exits, kept.entries, kept.density, kept.radius, kept.after, meetings._learned)
    single = (~np.isnan(kept.entries[:, :, 0, 0])).sum(axis=1) == 1
    others = np.flatnonzero(single & (np.arange(len(kept)) != kept.after[number]))
    one = np.array([number])
    assert (more.cost(one, others, False) > meetings.cost(one, others, False)).all()


def test_the_forest_tells_as_much_as_another_makers():
    from sklearn.ensemble import ExtraTreesRegressor

    rng = np.random.default_rng(0)
    one, other = rng.dirichlet(np.full(216, 0.3), (2, 4000)).astype(np.float32)
    pairs = pair_features(one, other)
    cost = 100 * pairs[:, :6].sum(axis=1, dtype=np.float64) + rng.normal(0, 0.3, 4000)
    made = ExtraTreesRegressor(32, max_depth=8, min_samples_leaf=5, max_features="sqrt", random_state=0)
    theirs = made.fit(pairs[:3000], cost[:3000]).predict(pairs[3000:])
    ours = grow(one[:3000], other[:3000], cost[:3000], rng).predict(one[3000:], other[3000:])
    missed = [np.sqrt(np.mean((told - cost[3000:]) ** 2)) for told in (ours, theirs, cost[:3000].mean())]
    assert missed[0] < 1.05 * missed[1] and missed[0] < 0.98 * missed[2]


def test_leaves_hold_the_means_of_what_came_to_them():
    rng = np.random.default_rng(2)
    one, other = rng.random((2, 400, 216)).astype(np.float32)
    cost = rng.random(400)
    forest = grow(one, other, cost, rng)
    assert forest.depth <= 8 and len(forest.first) == 32
    inner = forest.low != np.arange(len(forest.low))
    assert (forest.high[inner] == forest.low[inner] + 1).all() and (forest.low[inner] > np.flatnonzero(inner)).all()
    assert cost.min() <= forest.value.min() and forest.value.max() <= cost.max()
    alike = grow(one, other, np.full(400, 0.7), rng)
    assert alike.predict(one, other) == pytest.approx(np.full(400, 0.7))
    same = grow(one[:1].repeat(40, axis=0), other[:1].repeat(40, axis=0), cost[:40], rng)
    assert same.depth == 0, "nothing to ask where all pairs look the same"


def test_a_forest_learns_what_looks_tell_of_ligatures():
    rng = np.random.default_rng(1)
    feature = rng.dirichlet(np.full(216, 0.3), 120)
    rise = 10 * feature[:, 5]
    steps = np.stack([np.ones((120, 4)), np.outer(rise, np.linspace(0, 2, 4))], axis=2)[:, None]
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
