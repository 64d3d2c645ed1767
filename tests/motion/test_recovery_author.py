"""An author writes a letter the same way each time, and where the line does not tell, as the other times."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from inked import arc

from handout.motion.recovery.carried_strokes import carried_cost, carry_strokes
from handout.motion.recovery.letter_line import Candidate, LetterLine
from handout.motion.recovery.stroke_order import StrokeOrderModel, stroke_order_model
from handout.motion.recovery.writer_habits import Instance, WriterHabit, instance_of, learn_habit, measure_reordering
from handout.values import LineGraph, Moments

FORTH, BACK = "anticlockwise", "clockwise"


def bowl(forth: float, back: float, *, seed: int = 0, wide: float = 0.5):
    """A c, drawn a little otherwise each time, with what it costs to have been written forth and back."""
    rng = np.random.default_rng(seed)
    xy = np.array(arc((0.0, 0.5), 0.5, 50, 310, 40)) * (2 * wide, 1.0)
    xy = xy @ np.array([[1.0, 0.0], [0.1 * rng.normal(), 1.0]]) + 0.02 * rng.normal(size=2)
    count = len(xy)
    edges = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    line = LetterLine(xy, np.full(count, 0.08), np.ones(count), edges, 1.0)
    ways = [(forth, np.arange(count)), (back, np.arange(count)[::-1])]
    found = [Candidate((order,), cost, lambda: (False,)) for cost, order in sorted(ways, key=lambda way: way[0])]
    return instance_of(found, line, count)


def way(chosen: Candidate) -> str:
    (only,) = chosen.strokes
    return FORTH if only[0] < only[-1] else BACK


def chosen(learnt: WriterHabit, one: Instance, number: int = -1) -> Candidate:
    return one.candidates[int(learnt.weigh(one, number).argmin())]


def test_what_the_line_leaves_open_is_as_it_is_elsewhere():
    others = [bowl(0.0, 3.0, seed=k) for k in range(4)]
    odd = bowl(1.5, 0.0, seed=9)
    learnt = learn_habit([*others, odd])
    assert way(odd.candidates[0]) == BACK
    assert way(chosen(learnt, odd, 4)) == FORTH
    assert [way(chosen(learnt, one, k)) for k, one in enumerate(others)] == [FORTH] * 4
    # so is one that nothing was learnt from
    assert way(chosen(learnt, bowl(1.5, 0.0, seed=11))) == FORTH


def test_what_the_line_tells_is_not_overruled():
    learnt = learn_habit([bowl(0.0, 3.0, seed=k) for k in range(4)])
    assert way(chosen(learnt, bowl(15.0, 0.0, seed=9))) == BACK


def test_instances_explain_one_another():
    # half of them are nearly open, and alone would be followed wrongly
    pool = [bowl(0.0, 0.3, seed=k) for k in range(3)] + [bowl(4.0, 0.0, seed=k) for k in range(3, 6)]
    learnt = learn_habit(pool)
    assert {way(chosen(learnt, one, k)) for k, one in enumerate(pool)} == {BACK}


def test_two_ways_of_one_author_live_side_by_side():
    pool = [bowl(0.0, 4.0, seed=k) for k in range(3)] + [bowl(4.0, 0.0, seed=k) for k in range(3, 6)]
    learnt = learn_habit(pool)
    assert [way(chosen(learnt, one, k)) for k, one in enumerate(pool)] == [FORTH] * 3 + [BACK] * 3


def test_one_instance_tells_nothing_of_the_others():
    assert learn_habit([bowl(0.0, 1.0)]) is None
    assert learn_habit([]) is None


def test_no_instance_bears_witness_for_itself():
    pool = [bowl(0.0, 0.2, seed=k) for k in range(2)]
    learnt = learn_habit(pool)
    # it has only the other one to go by; asked for as a stranger it would find itself
    assert chosen(learnt, pool[0], 0) is pool[0].candidates[0]
    assert set(learnt.owner.tolist()) == {0, 1}
    for k in range(2):
        assert learnt.share[learnt.owner == k].sum() == pytest.approx(1.0, abs=0.05)


@settings(deadline=None, max_examples=15)
@given(st.lists(st.floats(0, 4), min_size=2, max_size=5), st.floats(-3, 3))
def test_where_every_instance_agrees_nothing_changes(costs, wide):
    pool = [bowl(0.0, cost + 0.5, seed=k, wide=0.5 * 1.1**wide) for k, cost in enumerate(costs)]
    learnt = learn_habit(pool)
    assert all(chosen(learnt, one, k) is one.candidates[0] for k, one in enumerate(pool))


def test_orders_are_apart_by_when_the_pen_is_where():
    forth, stem, bar = np.arange(20), np.arange(12), np.arange(12, 20)
    assert measure_reordering((forth,), (forth,)) == 0.0
    assert measure_reordering((forth,), (forth[::-1],)) == pytest.approx(0.5, abs=0.02)
    assert measure_reordering((stem, bar), (bar, stem)) > 0.4
    # going back to where it began a little earlier makes no other order
    assert measure_reordering((forth,), (np.concatenate([forth[1::-1], forth[1:]]),)) < 0.1


def test_an_order_is_guessed_where_another_costs_as_much(small_hand):
    model = StrokeOrderModel(small_hand, ("house-quick",))
    number = int(small_hand.numbers_of_letter("e")[0])
    line = model._letter_line(number)[0]
    model._habits["e"] = (), None
    forth = np.arange(len(line.xy))
    for more, order, guessed in ((0.0, forth[::-1], True), (9.0, forth[::-1], False), (0.0, forth, False)):
        found = [Candidate((way,), cost, lambda: ((False,), (False,))) for way, cost in ((forth, 0.0), (order, more))]
        assert model._choose(number, instance_of(found, line, len(line.xy))).guessed is guessed


def test_it_does_not_matter_which_glyph_is_asked_for_first(small_hand):
    some = [int(n) for letter in ("e", "n", "t") for n in small_hand.numbers_of_letter(letter)]
    one, other = StrokeOrderModel(small_hand, ("house-quick",)), StrokeOrderModel(small_hand, ("house-quick",))
    there = {n: one.strokes_of(n)[0] for n in some}
    back = {n: other.strokes_of(n)[0] for n in reversed(some)}
    for n in some:
        assert there[n].delayed == back[n].delayed
        assert [s.tolist() for s in there[n].strokes] == [s.tolist() for s in back[n].strokes]


def cross(*, wide: float = 1.0, lean: float = 0.0, foot: float = 0.0) -> LineGraph:
    """A t in pixels: its stem downwards, perhaps with a foot, then its bar, without a vertex in common."""
    stem = np.column_stack([np.full(41, 20.0), np.linspace(0.0, 60.0, 41)])
    bar = np.column_stack([np.linspace(5.0, 35.0, 21), np.full(21, 20.3)])
    ways = [np.vstack([stem, [(20.0 + foot * k, 60.0) for k in range(1, 11)]]) if foot else stem, bar]
    uv = np.concatenate(ways)
    uv = (uv + lean * uv[:, 1:] * (1, 0)) * (wide, 1)
    edges = [[i, i + 1] for i in range(len(uv) - 1) if i != len(ways[0]) - 1]
    return LineGraph(uv, np.full(len(uv), 2.0), np.ones(len(uv)), uv, np.array(edges))


@settings(deadline=None, max_examples=20)
@given(st.floats(0.7, 1.4), st.floats(-0.4, 0.4), st.booleans())
def test_strokes_are_carried_to_ink_that_is_alike(wide, lean, turned):
    told, other = cross(), cross(wide=wide, lean=lean)
    ways = [told.uv[41:][::-1] if turned else told.uv[41:], told.uv[:41]]
    found = carry_strokes(other, np.arange(62), ways, told.uv)
    bar, stem = (other.uv[way] for way in found.ways)
    assert found.apart < 0.03
    assert (bar[-1, 0] > bar[0, 0]) is not turned and stem[-1, 1] > stem[0, 1]
    assert set(np.concatenate(found.ways).tolist()) >= set(range(0, 62)) - {0, 40, 41, 61}


def test_strokes_go_on_over_ink_that_they_had_not_and_leave_none_out():
    told, other = cross(), cross(foot=1.2)
    ways = [told.uv[:41], told.uv[41:]]
    stem, bar = carry_strokes(other, np.arange(72), ways, told.uv).ways
    assert stem[-1] == 50 and len(bar) >= 19
    # a ring beside it belongs to neither
    angle = np.linspace(0, 2 * np.pi, 40)
    ring = np.column_stack([50 + 9 * np.cos(angle), 50 + 9 * np.sin(angle)])
    uv = np.vstack([told.uv, ring])
    edges = np.vstack([told.edges, np.column_stack([np.arange(62, 101), np.arange(63, 102)])])
    assert carry_strokes(LineGraph(uv, np.ones(102), np.ones(102), uv, edges), np.arange(102), ways, told.uv) is None


def test_what_is_carried_costs_its_lifts_and_its_unlikeness():
    one, two = (
        [np.array([(0.0, 1.0), (0.0, 0.0)])],
        [np.array([(0.0, 1.0), (0.0, 0.5)]), np.array([(0.0, 0.5), (0.0, 0.0)])],
    )
    assert carried_cost(one, one, 0.0, 1.0) == 0
    assert carried_cost(two, one, 0.0, 1.0) == -carried_cost(one, two, 0.0, 1.0) > 3
    assert carried_cost(one, one, 0.1, 1.0) > 1


def test_what_is_said_of_one_letter_is_weighed_for_all_of_its_name(small_hand):
    model, letter = stroke_order_model(small_hand, ("house-quick",)), "e"
    numbers = small_hand.numbers_of_letter(letter).tolist()
    before = {n: model.ways_of(n) for n in numbers}
    glyph = small_hand.glyphs[numbers[0]]
    said = tuple(way[::-1] for way, _ in before[numbers[0]])
    glyphs = tuple(replace(glyph, ways=said) if n == numbers[0] else g for n, g in enumerate(small_hand.glyphs))
    heir = model.heir(replace(small_hand, glyphs=glyphs))
    fresh = StrokeOrderModel(replace(small_hand, glyphs=glyphs), ("house-quick",))
    for n in numbers:
        assert [way.tolist() for way, _ in heir.ways_of(n)] == [way.tolist() for way, _ in fresh.ways_of(n)]
    assert [way.tolist() for way, _ in heir.ways_of(numbers[0])] == [way.tolist() for way in said]
    # the model itself is as it was, and so is one of other ink
    assert all(
        np.array_equal(a, b) for n in numbers for (a, _), (b, _) in zip(before[n], model.ways_of(n), strict=True)
    )
    glyphs = tuple(replace(g, vertices=g.vertices[1:]) if g is glyph else g for g in small_hand.glyphs)
    assert model.heir(replace(small_hand, glyphs=glyphs)) is None


def test_nothing_is_carried_to_letters_whose_writing_was_recorded(small_hand):
    (page,) = small_hand.pages
    glyphs = [replace(one, ways=(one.vertices,)) if one.letter == "n" else one for one in small_hand.glyphs]
    told = replace(small_hand, glyphs=tuple(glyphs))
    recorded = replace(told, pages=(replace(page, moments=Moments(times=np.arange(len(page.graph)) / 100)),))
    seen, known = (
        [len(StrokeOrderModel(hand, ())._carry_candidates(n)) for n in told.numbers_of_letter("n")]
        for hand in (told, recorded)
    )
    assert any(seen) and not any(known)
