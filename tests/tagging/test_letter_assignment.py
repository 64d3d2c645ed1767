"""Commas, tails, bars and dots follow the letter they belong to, wherever they lie."""

import itertools

import numpy as np
import pytest
from hypothesis import given as given_
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from handout.tagging.alignment import AlignedLine, Alignment, PageLetter
from handout.tagging.letter_assignment import _SETTINGS, LEAD, NOBODY, _fewest_cuts, assign_letters, by_letter
from handout.tagging.line_space import LineFrame, lines_at
from handout.values import LineGraph

FRAME = LineFrame((200.0,), 20.0)


def graph(strokes) -> tuple[LineGraph, list[np.ndarray]]:
    """Strokes in x-heights (u, up), a vertex a pixel; strokes that begin where another passes are joined to it."""
    places, edges, parts = [], [], []
    for stroke in strokes:
        ends = np.array(stroke, float)
        dense = [ends[:1]]
        for a, b in itertools.pairwise(ends):
            n = max(2, round(20 * float(np.linalg.norm(b - a))))
            dense.append(a + (b - a) * np.linspace(0, 1, n + 1)[1:, None])
        first = sum(len(p) for p in places)
        own = np.vstack(dense)
        numbers = np.arange(first, first + len(own))
        edges += list(itertools.pairwise(numbers))
        earlier = np.vstack(places) if places else np.zeros((0, 2))
        if len(earlier):
            away = np.linalg.norm(earlier - own[0], axis=1)
            if away.min() < 0.04:
                edges.append((int(away.argmin()), first))
        places.append(own)
        parts.append(numbers)
    xy = np.vstack(places)
    uv = np.column_stack([xy[:, 0] * 20, 200 - xy[:, 1] * 20])
    ones = np.ones(len(uv))
    return LineGraph(uv, ones, ones, uv, np.array(edges)), parts


def aligned(*letters: tuple[str, float, float]) -> Alignment:
    found = tuple(PageLetter(i, c, a * 20, b * 20, 1.0) for i, (c, a, b) in enumerate(letters))
    return Alignment((AlignedLine(0, FRAME, found, 1.0),))


def given(strokes, *letters):
    line, parts = graph(strokes)
    result = assign_letters(line, aligned(*letters), np.zeros(len(line), int))
    return result, [set(result.letter[p].tolist()) for p in parts]


def test_a_comma_under_its_neighbour_is_whole():
    _, found = given([[(0.1, 0.0), (0.9, 0.9)], [(0.95, 0.05), (0.7, -0.5)]], ("s", 0, 1), (",", 1.0, 1.3))
    assert found == [{0}, {1}]


def test_a_tail_under_the_next_letter_is_not_cut():
    g = [(0.9, 0.9), (0.1, 0.5), (0.9, 0.1), (0.9, -0.8), (1.8, -1.2)]
    n = [(1.2, 0.0), (1.2, 0.9), (1.9, 0.9), (1.9, 0.0)]
    _, found = given([g, n], ("g", 0, 1.05), ("n", 1.05, 2))
    assert found == [{0}, {1}]


def test_joined_letters_are_cut_once_before_their_columns_meet_in_what_joins_them():
    strokes = [[(0.1, 0.9), (0.2, 0.0), (1.0, 0.3), (1.3, 0.9), (1.4, 0.0), (1.9, 0.2)]]
    result, found = given(strokes, ("u", 0, 1), ("i", 1, 2))
    assert found == [{0, 1}] and len(result.joints) == 1
    line, _ = graph(strokes)
    a, b = line.uv[line.edges[result.joints[0]]] / 20
    assert min(a[0], b[0]) <= 1.0 - LEAD <= max(a[0], b[0])


def test_a_stem_along_the_border_is_not_cut_where_it_strays_over_it():
    # h runs out into i, whose stem leans a little into h's column before it comes back at the foot
    i = [(1.2, 0.95), (0.96, 0.3), (1.1, 0.05), (1.9, 0.3)]
    h = [(0.96, 0.3), (0.7, 0.05), (0.5, 0.9), (0.1, 0.0), (0.1, 1.8)]
    result, found = given([i, h], ("h", 0, 1), ("i", 1, 2))
    assert found[0] == {1} and 0 in found[1] and len(result.joints) == 1


def test_a_loop_that_leans_over_the_letter_before_is_the_ascenders():
    a = [(0.1, 0.9), (0.1, 0.1), (0.8, 0.1), (1.05, 0.5)]
    # from where the upstroke crosses the stem: up, round, and back to it
    loop = [(1.05, 0.5), (0.85, 1.5), (0.9, 2.1), (0.95, 2.1), (1.15, 1.5), (1.05, 0.5)]
    _, found = given([a, loop, [(1.05, 0.5), (1.15, 0.05), (1.9, 0.3)]], ("a", 0, 1), ("l", 1, 2))
    assert found[1] == {1} and found[2] == {1} and 0 in found[0]


def test_columns_are_followed_exactly_where_that_cuts_a_stroke_no_more_than_once():
    cost = np.array([[0.0, 1.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.0]])
    assert _fewest_cuts(cost).tolist() == [0, 0, 1, 1]


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given_(cost=arrays(np.float64, (6, 3), elements=st.floats(0, 0.05)))
def test_no_other_way_of_cutting_is_cheaper(cost):
    def price(way):
        return cost[np.arange(6), way].sum() + _SETTINGS.cut * np.count_nonzero(np.diff(way))

    best = min(price(np.array(way)) for way in itertools.product(range(3), repeat=6))
    assert price(_fewest_cuts(cost)) == pytest.approx(best)


def test_a_tail_of_a_joined_letter_follows_it():
    # g joined to n at the baseline, and its tail, below n, belongs to g although it lies in n's column
    g = [(0.9, 0.9), (0.9, -0.8), (1.7, -1.1)]
    join = [(0.9, 0.0), (1.3, 0.5), (1.3, 0.9), (1.8, 0.9), (1.9, 0.0)]
    _, found = given([g, join], ("g", 0, 1.05), ("n", 1.05, 2))
    assert found[0] == {0} and found[1] == {0, 1}


@pytest.mark.parametrize("dot", [0.45, 0.9, 1.15])
def test_a_dot_finds_its_i(dot):
    strokes = [[(0.5, 0.9), (0.5, 0.0)], [(1.1, 0.9), (1.1, 0.0), (1.9, 0.0), (1.9, 0.9)], [(dot, 1.4), (dot, 1.5)]]
    _, found = given(strokes, ("i", 0.2, 0.8), ("u", 0.8, 2))
    assert found[2] == {0}


def test_two_dots_over_one_of_two_letters_that_have_dots_are_shared():
    # both columns end too far to the right, so that both dots lie over the j
    strokes = [[(0.4, 0.9), (0.4, -0.5)], [(1.0, 0.9), (1.0, 0.0)], [(0.4, 1.4), (0.4, 1.5)], [(0.9, 1.4), (0.9, 1.5)]]
    _, found = given(strokes, ("j", 0, 0.95), ("i", 0.95, 1.5))
    assert found == [{0}, {1}, {0}, {1}]
    # a letter with an accent takes it from there, too
    assert given(strokes, ("j", 0, 0.95), ("é", 0.95, 1.5))[1] == [{0}, {1}, {0}, {1}]
    # a letter that has none stays without
    assert given(strokes, ("j", 0, 0.95), ("l", 0.95, 1.5))[1][2:] == [{0}, {0}]


def test_both_dots_of_a_colon_are_its_own():
    # the column of the letter before it ends too far to the right
    strokes = [[(0.1, 0.9), (0.9, 0.0)], [(1.25, 0.85), (1.25, 0.8)], [(1.15, 0.1), (1.15, 0.05)]]
    assert given(strokes, ("a", 0, 1.2), (":", 1.2, 1.5))[1] == [{0}, {1}, {1}]


def test_the_last_stroke_of_a_word_is_its_letters():
    _, found = given([[(0.1, 0.9), (0.2, 0.0), (2.4, 0.4)], [(3.1, 0.0), (3.2, 0.9)]], ("d", 0, 1), ("a", 3, 4))
    assert found == [{0}, {1}]


def test_quotation_marks_of_two_strokes_stay_together():
    strokes = [[(0.1, 1.9), (0.1, 1.6)], [(0.3, 1.9), (0.3, 1.6)], [(0.7, 0.9), (0.6, 0.1), (1.4, 0.3)]]
    _, found = given(strokes, ('"', 0, 0.5), ("e", 0.5, 1.5))
    assert found == [{0}, {0}, {1}]


def test_other_lines_and_absent_letters_get_nothing():
    line, _ = graph([[(0.1, 0.9), (0.9, 0.1)]])
    away = assign_letters(line, aligned(("a", 0, 1)), np.full(len(line), 5))
    assert (away.letter == NOBODY).all() and not len(away.joints)
    absent = Alignment((AlignedLine(0, FRAME, (PageLetter(0, "a", 0.0, 0.0, 0.1, False),), 0.0),))
    assert (assign_letters(line, absent, np.zeros(len(line), int)).letter == NOBODY).all()


def test_vertices_by_letter():
    result, _ = given([[(0.1, 0.9), (0.9, 0.1)], [(1.1, 0.9), (1.9, 0.1)]], ("a", 0, 1), ("b", 1, 2))
    groups = by_letter(result, 2)
    assert [set(result.letter[g].tolist()) for g in groups] == [{0}, {1}]
    assert np.array_equal(np.sort(groups[1]), result.vertices(1))


def test_the_owner_of_a_vertex_beside_its_ink():
    own = np.full((10, 10), -1)
    own[5, 5] = 3
    assert lines_at(own, np.array([[5.0, 5.0], [6.2, 5.9], [9.0, 9.0]])).tolist() == [3, 3, -1]
