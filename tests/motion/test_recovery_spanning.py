"""Bars over several letters."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from inked import line, strokes

from handout.motion.recovery.crossbars import WordCrossbars
from handout.motion.recovery.letter_tracing import trace_letter
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


def test_a_bar_may_be_bent_where_both_its_ends_are_loose():
    left, right, below = (-0.8, 1.47), (0.9, 1.47), (1.5, 0)
    ways = [[(0, 1.6), T], [T, (0, 0.1), (0.3, 0)], [left, T], [T, right]]
    one, (bar,) = found([*ways, [(1.5, 1.0), below]], "tl", 1.2)
    assert one.xy[bar.vertices[[0, -1]]] == pytest.approx(np.array([left, right]))
    # one that leads to the next letter goes straight
    one, bars = found([*ways, [right, below]], "tl", 1.2)
    assert all(one.xy[bar.vertices[-1]] != pytest.approx(right) for bar in bars)


def test_a_bar_goes_on_where_its_ink_failed_beside_the_stem():
    ways = [[(0, 1.6), T], [T, (0, 0.1), (0.3, 0)], [LEFT, (-0.06, 1.095)], [T, (0.5, 1.14)]]
    one, (bar,) = found([*ways, [(1.0, 1.0), (1.0, 0)]], "tl", 0.8)
    assert one.xy[bar.vertices[[0, -1]]] == pytest.approx(np.array([LEFT, (0.5, 1.14)]))
