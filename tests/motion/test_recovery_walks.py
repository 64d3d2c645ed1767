"""Walks over networks, whatever these look like."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from inked import line

from handout.motion.recovery.letter_tracing import trace_letter
from handout.motion.recovery.network import build_network, chain_vertices
from handout.motion.recovery.traversal import beam_search

PLACES = st.tuples(st.integers(0, 3), st.integers(0, 3)).map(lambda p: (p[0] * 0.6, p[1] * 0.6))
WAYS = st.lists(
    st.tuples(PLACES, PLACES).filter(lambda way: way[0] != way[1]), min_size=1, max_size=7, unique_by=frozenset
)


def edges_of(stroke):
    return [frozenset(pair) for pair in zip(stroke[:-1].tolist(), stroke[1:].tolist(), strict=True)]


@settings(max_examples=40)
@given(WAYS)
def test_every_branch_is_passed_and_none_more_than_thrice(ways):
    one = line(ways)
    net = build_network(one.xy, one.radius, one.density, one.edges)
    for walk in beam_search(net, 1.0, most=4, width=12):
        passed = [end >> 1 for stroke in walk.strokes for end in stroke]
        assert set(passed) == set(range(len(net.branches)))
        # crossings drawn out may be passed more often
        often = np.bincount(passed)
        assert (often[net.length >= 5] <= 3).all()


@settings(max_examples=40)
@given(WAYS, st.sampled_from("abehtx?"))
def test_strokes_go_along_the_line_without_a_leap(ways, letter):
    one = line(ways)
    own = {frozenset(pair) for pair in one.edges.tolist()}
    written = trace_letter(one, letter)
    steps = [step for stroke in written.strokes for step in edges_of(stroke)]
    assert own <= set(steps)
    assert len(written.delayed) == len(written.strokes)
    leaps = [step for step in steps if step not in own]
    # what is not along the line bridges a little failed ink
    far = [float(np.hypot(*np.subtract(*one.xy[list(step)]))) for step in leaps if len(step) == 2]
    assert max(far, default=0) < 1.0


@settings(max_examples=25)
@given(WAYS)
def test_the_cheapest_walk_is_first_and_costs_are_of_the_walk(ways):
    one = line(ways)
    net = build_network(one.xy, one.radius, one.density, one.edges)
    found = beam_search(net, 1.0, most=6, width=16)
    assert [w.cost for w in found] == sorted(w.cost for w in found)
    assert len({w.strokes for w in found}) == len(found)


def test_the_effort_grows_with_the_line_no_faster_than_it_is_long():
    # a comb of thirty teeth: all its orders could never be tried
    teeth = [[(0.5 * k, 0.0), (0.5 * k, 1.0)] for k in range(30)]
    back = [[(0.5 * k, 0.0), (0.5 * k + 0.5, 0.0)] for k in range(29)]
    one = line([*teeth, *back])
    net = build_network(one.xy, one.radius, one.density, one.edges)
    (walk, *_) = beam_search(net, 1.0, most=1, width=8)
    assert {end >> 1 for stroke in walk.strokes for end in stroke} == set(range(len(net.branches)))


def test_a_short_gap_in_the_ink_is_written_over():
    one = line([[(0, 1), (0, 0.55)], [(0, 0.45), (0, 0)]])
    net = build_network(one.xy, one.radius, one.density, one.edges)
    (walk, *_) = beam_search(net, 1.0)
    assert len(walk.strokes) == 1
    assert chain_vertices(net, walk.strokes[0]).tolist()[0] in (0, len(one.xy) - 1)
