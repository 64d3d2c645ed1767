"""Bars over several letters, and strokes that go to and fro between two."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from inked import line, strokes

from handout.motion.recovery.crossbars import WordCrossbars
from handout.motion.recovery.letter_tracing import trace_letter
from handout.motion.recovery.placed_strokes import PlacedGlyph, PlacedStroke, merge_interleaved_strokes, orient_loop
from handout.values import LineGraph

T, H = (0.0, 1.1), (1.0, 1.15)
STEMS = [[(0, 1.6), T], [T, (0, 0.1), (0.3, 0)], [(1.0, 2.1), H], [H, (1.0, 0)]]
LEFT, RIGHT = (-0.4, 1.08), (1.5, 1.175)
BAR = [[LEFT, T], [T, H], [H, RIGHT]]


def found(ways, letters="th", cut=0.5):
    """The bars of a word of two letters that are parted at some x."""
    one = line(ways)
    own = [np.flatnonzero((one.xy[:, 0] < cut) == left) for left in (True, False)]
    page = SimpleNamespace(
        graph=LineGraph(one.xy, one.radius, one.density, one.xy, one.edges),
        to_line=lambda row, uv: uv,
        pitch=1.0,
        x_height=1.0,
    )
    glyphs = [
        SimpleNamespace(letter=letter, page=0, line=0, vertices=vertices, before=k - 1, after=1 if k == 0 else -1)
        for k, (letter, vertices) in enumerate(zip(letters, own, strict=True))
    ]
    return one, WordCrossbars(SimpleNamespace(glyphs=glyphs, pages=[page]), {})[1]


def test_a_bar_over_two_letters_is_one():
    one, bars = found([*STEMS, *BAR])
    (bar,) = bars
    assert one.xy[bar.vertices[[0, -1]]] == pytest.approx(np.array([LEFT, RIGHT]))
    assert (np.diff(one.xy[bar.vertices, 0]) > 0).all()
    assert bar.loose == (True, True) and bar.glyph == 0
    assert not len(bar.before) and not len(bar.after)


def test_letters_without_bars_are_not_looked_at():
    assert found([*STEMS, *BAR], "lh")[1] == ()


def test_what_leads_to_the_stem_of_a_t_is_no_bar():
    # the letter before ends high and goes on to the t, whose bar is somewhere else
    o = [(-1.0, 0.1), (-1.0, 0.95), (-0.9, 1.0)]
    assert found([o, [(-1.0, 0.95), (-1.3, 0.6)], [(-0.9, 1.0), T], [(0, 1.6), T], [T, (0, 0)]], "ot", -0.5)[1] == ()


def test_a_bar_runs_on_over_the_ligature_that_hides_its_beginning():
    o = [(-1.0, 0.6), (-0.8, 1.02), (-0.4, 1.08), T]
    one, (bar,) = found([o, [(0, 1.6), T], [T, (0, 0)], [T, (1.0, 1.15)]], "ot", -0.6)
    assert one.xy[bar.vertices[0]] == pytest.approx(T) and bar.loose == (False, True)
    hidden = one.xy[bar.before]
    assert -0.45 < hidden[0, 0] < -0.3 and hidden[-1, 0] < 0
    assert (np.diff(hidden[:, 0]) > 0).all()


def test_a_bar_known_from_the_word_is_no_part_of_the_letter_it_crosses():
    h = line([[(0, 2), T], [T, (0, 0.6)], [(0, 0.6), (0, 0)], [LEFT, T], [T, (0.3, 1.12)],
              [(0, 0.6), (0.35, 0.85), (0.7, 0.5), (0.7, 0)]], through=[LEFT])  # fmt: skip
    bar = np.flatnonzero((h.xy[:, 1] > 1.05) & (h.xy[:, 1] < 1.13) & ((h.xy[:, 0] != 0) | (h.xy[:, 1] == T[1])))
    bar = bar[np.argsort(h.xy[bar, 0])]
    made = trace_letter(replace(h, foreign_bars=(bar,), bar_overlaps=((bar[:0], bar[:0]),)), "h")
    body, over = strokes(h, made)
    assert made.delayed == (False, True)
    assert over[[0, -1]] == pytest.approx(np.array([LEFT, (0.3, 1.12)]))
    assert body[0] == pytest.approx((0, 2)) and body[-1] == pytest.approx((0.7, 0))


def glyph(xy, chains, entries, strokes):
    graph = LineGraph(np.array(xy, dtype=float), np.ones(len(xy)), np.ones(len(xy)), np.zeros((len(xy), 2)), [[0, 1]])
    chains = [np.array(chain, dtype=np.intp) for chain in chains]
    laid = [PlacedStroke(np.array(own, dtype=np.intp), late, begin, end) for own, late, begin, end in strokes]
    return PlacedGlyph(SimpleNamespace(), graph, entries, chains, None, laid)


def pair(over):
    """A t whose body has a bit of the loop of the h after it, which is given the way up on its left or its right."""
    # t: comes up to the crossing 2, and on by way 0 (left) or 1 (right); the bit comes back and goes on by way 2
    t = glyph(
        [(0, 2), (0, 8), (3, 4), (2, 2), (4, 2), (2, 8), (4, 8)],
        [(2, 3), (2, 4), (5, 6)],
        0,
        [((0, 1, 2, 3), False, None, 0), ((6, 5, 2, 4), True, 2, 1)],
    )
    h = glyph(
        [(2, 2), (2.5, 0), (4, 2), (4, 8), (6, 8)],
        [(1, 0), (1, 2), (4, 3)],
        3,
        [((4, 3), False, None, 2), (over, False, over[0] // 2, over[-1] // 2)],
    )
    return t, h


@pytest.mark.parametrize("over", [(0, 1, 2), (2, 1, 0)])
def test_strokes_to_and_fro_between_two_letters_are_put_together(over):
    t, h = pair(over)
    merge_interleaved_strokes(t, h, {0: 0, 1: 1, 2: 2})
    assert len(t.strokes) == 1 and len(h.strokes) == 1
    (whole,) = h.strokes
    assert whole.begin == 0 and whole.end is None and not whole.delayed
    assert [list(own) for _, own in whole.then] == [[4, 2, 5, 6], [4]]
    assert [g is t for g, _ in whole.then] == [True, False]


def test_a_loop_over_two_letters_goes_up_on_its_right():
    t, h = pair((0, 1, 2))
    merge_interleaved_strokes(t, h, {0: 0, 1: 1, 2: 2})
    parts = [(t, t.strokes[0].vertices), (h, h.strokes[0].vertices[1:]), *h.strokes[0].then]
    before = np.concatenate([g.graph.xy[own] for g, own in parts])
    after = np.concatenate([g.graph.xy[own] for g, own in orient_loop(parts)])
    assert len(before) == len(after)
    assert after[[0, 1, -1]] == pytest.approx(before[[0, 1, -1]])
    top = int(after[:, 1].argmin())
    assert after[top - 1, 0] > after[top + 1, 0]
    again = np.concatenate([g.graph.xy[own] for g, own in orient_loop(orient_loop(parts))])
    assert again == pytest.approx(after)
