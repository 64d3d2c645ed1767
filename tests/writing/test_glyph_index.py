"""What choosing knows of a hand's glyphs, and what pairs of them cost."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.hand.author_reader import find_odd_rarities
from handout.hand.scanned import ScannedHand
from handout.values import LineGraph
from handout.writing.glyph_index import (
    WEIGHTS,
    TransitionCosts,
    better_lent,
    blots,
    doubt,
    index_glyphs,
    mismatch,
    residuals,
)


@pytest.fixture(scope="module")
def kept(small_hand):
    return index_glyphs(small_hand)


def test_every_glyph_is_there(kept, small_hand):
    assert len(kept) == len(small_hand.glyphs)
    for letter in small_hand.letters:
        assert list(kept.of(letter)) == list(small_hand.numbers_of_letter(letter))
    for (letter, place), count in small_hand.instances.items():
        assert len(kept.of(letter, place)) == count
    assert len(kept.of("Q")) == len(kept.of("Q", "start")) == 0


def test_a_blot_is_dear_to_write(small_hand):
    number = int(small_hand.numbers_of_letter("e")[2])
    page, body = small_hand.pages[0], small_hand.body(number)
    radius = page.graph.radius.copy()
    radius[body[: len(body) // 2]] *= 3
    sheet = replace(page, graph=replace(page.graph, radius=radius))
    plain, blotted = blots(small_hand), blots(replace(small_hand, pages=(sheet,)))
    assert (plain >= 0).all() and blotted[number] > plain[number] + 0.3
    others = np.setdiff1d(small_hand.numbers_of_letter("n"), number)
    assert np.allclose(blotted[others], plain[others], atol=0.02)
    dear = index_glyphs(replace(small_hand, pages=(sheet,))).intrinsic_cost[number]
    assert dear > index_glyphs(small_hand).intrinsic_cost[number] + 3


def test_departures_are_those_from_a_letter_s_usual(small_hand):
    """An e that is thicker and fainter, and leans, stands out in that; letters of which there are few do not."""
    number = int(small_hand.numbers_of_letter("e")[2])
    page, body = small_hand.pages[0], small_hand.body(number)
    bodies = [small_hand.body(i) for i in range(len(small_hand.glyphs))]
    plain = residuals(small_hand, bodies)
    assert (plain[small_hand.numbers_of_letter("j")] == 0).all() and np.abs(plain).max() <= 2.5
    usual = np.median(plain[small_hand.numbers_of_letter("e")], axis=0)
    assert np.abs(usual).max() < 0.5
    graph = page.graph
    radius, density = graph.radius.copy(), graph.density.copy()
    radius[body], density[body] = 1.5 * radius[body], density[body] / 2
    uv = graph.uv.copy()
    foot = uv[body, 1].max()
    uv[body, 0] += 0.5 * (foot - uv[body, 1])
    other = replace(page, graph=LineGraph(graph.xy, radius, density, uv, graph.edges))
    changed = residuals(replace(small_hand, pages=(other,)), bodies)[number] - plain[number]
    assert changed[1] > 0.5 and changed[2] > 0.5 and changed[3] < -0.5


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
    within, parted = (kept.transitions.cost(numbers, numbers, apart) for apart in (False, True))
    first = np.flatnonzero(kept.after >= 0)
    assert (within[first, kept.after[first]] == 0).all() and (within >= 0).all()
    pairs = {(kept.letters[i], kept.letters[kept.after[i]]) for i in first.tolist()}
    torn = np.array([[WEIGHTS.apart + WEIGHTS.doubled * (a == b) if (a, b) in pairs else 0.0 for b in kept.letters]
                     for a in kept.letters])  # fmt: skip
    torn[first, kept.after[first]] = 0.0
    within = within - torn
    met = kept.transitions.has_exit[:, None] & kept.transitions.has_entry
    kept_on = parted - WEIGHTS.cut * (1.0 * kept.transitions.has_exit[:, None] + kept.transitions.has_entry)
    assert np.allclose(kept_on[met], within[met] / 2) and (kept_on[~met] <= within[~met] / 2 + 1e-6).all()
    # a block asked for by itself is the same
    block = index_glyphs(kept.hand).transitions.cost(numbers[3:7], numbers[:5], False)
    assert block == pytest.approx(within[3:7, :5] + torn[3:7, :5])


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


def test_letters_that_depart_alike_go_together(kept):
    meetings, departure = kept.transitions, kept.residual.copy()
    first, second = (int(number) for number in np.flatnonzero(np.abs(departure).sum(axis=1) > 0)[[0, 5]])
    one, other = np.array([first]), np.array([second])
    departure[second] = departure[first]
    alike = TransitionCosts(
        kept.exits, kept.entries, departure, kept.after, kept.leaving, kept.entered, kept.letters
    ).cost(one, other, False)
    departure[second] = -departure[first]
    unlike = TransitionCosts(
        kept.exits, kept.entries, departure, kept.after, kept.leaving, kept.entered, kept.letters
    ).cost(one, other, False)
    assert alike[0, 0] < unlike[0, 0] and alike[0, 0] <= meetings.cost(one, other, False)[0, 0]


def test_a_rare_letter_that_nobody_but_its_author_reads_costs_as_much_as_a_lent_one(small_hand):
    (number,) = small_hand.numbers_of_letter("p").tolist()
    glyphs = list(small_hand.glyphs)
    glyphs[number] = replace(glyphs[number], letter="k")
    wrong = replace(small_hand, glyphs=tuple(glyphs))
    assert not find_odd_rarities(small_hand)[number] and find_odd_rarities(wrong)[number]
    assert doubt(wrong)[number] >= WEIGHTS.lent and better_lent(wrong, "k") and not better_lent(small_hand, "p")


def test_a_pair_that_the_page_has_is_best_taken_from_it(kept):
    first = np.flatnonzero(kept.after >= 0)
    number = next(i for i in first.tolist() if len(kept.of(kept.letters[kept.after[i]])) > 1)
    others = kept.of(kept.letters[kept.after[number]])
    costs = kept.transitions.cost(np.array([number]), others, parted=False)[0]
    assert costs[others == kept.after[number]] + WEIGHTS.apart <= costs[others != kept.after[number]].min()


def test_of_several_ligatures_the_best_two_count():
    one, other, none = np.zeros((4, 2)), np.outer(np.arange(4), [0.0, 1.0]), np.full((4, 2), np.nan)
    assert mismatch(np.stack([one, other]), np.stack([other, none])) == 0
    assert mismatch(none[None], other[None]) == np.inf


def test_ligatures_that_meet_none_cost(kept):
    """A t whose bar goes over to the h is not for a letter that shows one way only."""
    meetings = kept.transitions
    exits = np.concatenate([kept.exits, np.full_like(kept.exits[:, :1], np.nan)], axis=1)
    number = int(np.flatnonzero(meetings.has_exit & (kept.after >= 0))[0])
    exits[number, -1] = exits[number, 0]
    more = TransitionCosts(exits, kept.entries, kept.residual, kept.after, kept.leaving, kept.entered, kept.letters)
    single = (~np.isnan(kept.entries[:, :, 0, 0])).sum(axis=1) == 1
    others = np.flatnonzero(single & (np.arange(len(kept)) != kept.after[number]))
    one = np.array([number])
    assert (more.cost(one, others, False) > meetings.cost(one, others, False)).all()


def test_a_hand_that_never_joins_is_told_by_looks(small_hand):
    lifted = tuple(replace(glyph, ligatures=()) for glyph in small_hand.glyphs)
    kept = index_glyphs(ScannedHand("p", "p", small_hand.pages, lifted))
    numbers = np.arange(len(kept))
    cost = kept.transitions.cost(numbers, numbers, False)
    assert np.isfinite(cost).all() and 0.05 < np.median(cost) < 1


@pytest.mark.slow
def test_doubtful_and_broken_glyphs_cost_more(small_hand):
    number = int(small_hand.numbers_of_letter("n")[0])
    glyphs = list(small_hand.glyphs)
    glyphs[number] = replace(glyphs[number], confidence=0.0)
    doubted = index_glyphs(replace(small_hand, glyphs=tuple(glyphs)))
    sure = index_glyphs(small_hand)
    assert doubted.intrinsic_cost[number] > sure.intrinsic_cost[number] + 1
    joined = next(i for i, g in enumerate(small_hand.glyphs) if g.ligatures and len(g.ligatures[0].path) > 4)
    glyphs[joined] = replace(glyphs[joined], vertices=np.sort(glyphs[joined].ligatures[0].path[1:3]))
    assert index_glyphs(replace(small_hand, glyphs=tuple(glyphs))).intrinsic_cost[joined] >= 3
