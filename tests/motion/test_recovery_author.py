"""An author writes a letter the same way each time, and where the line does not tell, as the other times."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from inked import arc

from handout.motion.recovery.letter_line import Candidate, LetterLine
from handout.motion.recovery.stroke_order import StrokeOrderModel
from handout.motion.recovery.writer_habits import instance_of, learn_habit

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


def test_what_the_line_leaves_open_is_as_it_is_elsewhere():
    others = [bowl(0.0, 3.0, seed=k) for k in range(4)]
    odd = bowl(1.5, 0.0, seed=9)
    learnt = learn_habit([*others, odd])
    assert way(odd.candidates[0]) == BACK
    assert way(learnt.choose(odd, 4)) == FORTH
    assert [way(learnt.choose(one, k)) for k, one in enumerate(others)] == [FORTH] * 4
    # so is one that nothing was learnt from
    assert way(learnt.choose(bowl(1.5, 0.0, seed=11))) == FORTH


def test_what_the_line_tells_is_not_overruled():
    learnt = learn_habit([bowl(0.0, 3.0, seed=k) for k in range(4)])
    assert way(learnt.choose(bowl(15.0, 0.0, seed=9))) == BACK


def test_instances_explain_one_another():
    # half of them are nearly open, and alone would be followed wrongly
    pool = [bowl(0.0, 0.3, seed=k) for k in range(3)] + [bowl(4.0, 0.0, seed=k) for k in range(3, 6)]
    learnt = learn_habit(pool)
    assert {way(learnt.choose(one, k)) for k, one in enumerate(pool)} == {BACK}


def test_two_ways_of_one_author_live_side_by_side():
    pool = [bowl(0.0, 4.0, seed=k) for k in range(3)] + [bowl(4.0, 0.0, seed=k) for k in range(3, 6)]
    learnt = learn_habit(pool)
    assert [way(learnt.choose(one, k)) for k, one in enumerate(pool)] == [FORTH] * 3 + [BACK] * 3


def test_one_instance_tells_nothing_of_the_others():
    assert learn_habit([bowl(0.0, 1.0)]) is None
    assert learn_habit([]) is None


def test_no_instance_bears_witness_for_itself():
    pool = [bowl(0.0, 0.2, seed=k) for k in range(2)]
    learnt = learn_habit(pool)
    # it has only the other one to go by; asked for as a stranger it would find itself
    assert learnt.choose(pool[0], 0) is pool[0].candidates[0]
    assert set(learnt.owner.tolist()) == {0, 1}
    for k in range(2):
        assert learnt.share[learnt.owner == k].sum() == pytest.approx(1.0, abs=0.05)


@settings(deadline=None, max_examples=15)
@given(st.lists(st.floats(0, 4), min_size=2, max_size=5), st.floats(-3, 3))
def test_where_every_instance_agrees_nothing_changes(costs, wide):
    pool = [bowl(0.0, cost + 0.5, seed=k, wide=0.5 * 1.1**wide) for k, cost in enumerate(costs)]
    learnt = learn_habit(pool)
    assert all(learnt.choose(one, k) is one.candidates[0] for k, one in enumerate(pool))


def test_it_does_not_matter_which_glyph_is_asked_for_first(small_hand):
    some = [int(n) for letter in ("e", "n", "t") for n in small_hand.of(letter)]
    one, other = StrokeOrderModel(small_hand, ("house-quick",)), StrokeOrderModel(small_hand, ("house-quick",))
    there = {n: one.strokes_of(n)[0] for n in some}
    back = {n: other.strokes_of(n)[0] for n in reversed(some)}
    for n in some:
        assert there[n].delayed == back[n].delayed
        assert [s.tolist() for s in there[n].strokes] == [s.tolist() for s in back[n].strokes]
