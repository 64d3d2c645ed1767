"""Letters drawn as graphs are written as people write them."""

from dataclasses import replace

import numpy as np
import pytest
from inked import arc, line, strokes
from scipy.interpolate import CubicSpline

from handout.motion.recovery.letter_line import LetterLine
from handout.motion.recovery.letter_tracing import trace_letter


def test_a_t_is_a_stem_and_then_its_bar():
    t = line([[(0, 1.8), (0, 1)], [(0, 1), (0, 0)], [(-0.4, 1), (0, 1)], [(0, 1), (0.4, 1)]])
    stem, bar = strokes(t, trace_letter(t, "t"))
    assert stem[0] == pytest.approx((0, 1.8)) and stem[-1] == pytest.approx((0, 0))
    assert bar[0] == pytest.approx((-0.4, 1)) and bar[-1] == pytest.approx((0.4, 1))
    assert trace_letter(t, "t").delayed == (False, False)


@pytest.mark.parametrize(
    "bends",
    [
        [(-0.23, 0), (-0.1, 0.4), (0.02, 0.68), (0.2, 0.8), (0.4, 0.85), (0.65, 0.87)],
        [(-0.14, 0.19), (-0.1, 0.5), (0, 0.8), (0.15, 0.97), (0.36, 1.02), (0.6, 1.05)],
        [(-0.2, 0), (-0.12, 0.4), (-0.05, 0.7), (0.05, 0.86), (0.25, 0.9), (0.65, 0.94)],
    ],
)
def test_an_r_begins_at_its_round_shoulder(bends):
    # where there is no cut the pen can begin at the tip of the arm alone, and go all the way back
    count = 60
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(bends, axis=0).T))])
    xy = CubicSpline(run, np.array(bends))(np.linspace(0, run[-1], count))
    chain = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    r = LetterLine(xy, np.full(count, 0.032), np.ones(count), chain, 1.0, baseline=0.0)
    (only,) = trace_letter(r, "r").strokes
    assert xy[only[0], 0] < 0.3 and only[-1] == count - 1


def test_a_bar_waits_where_the_pen_goes_on_to_the_next_letter():
    foot = [(0, 1), (0, 0), (0.3, 0.05), (0.6, 0.3)]
    t = line([[(0, 1.8), (0, 1)], foot, [(-0.4, 1), (0, 1)], [(0, 1), (0.4, 1)]], finish=[(0.6, 0.3)])
    found = trace_letter(t, "t")
    assert found.delayed == (False, True)
    assert strokes(t, found)[0][-1] == pytest.approx((0.6, 0.3))


def test_a_crossing_drawn_out_is_still_a_crossing():
    # the skeleton makes two forks of it, with a bridge along the stem
    t = line(
        [
            [(0, 1.8), (0, 1.04)],
            [(0, 1.04), (0, 0.98)],
            [(0, 0.98), (0, 0)],
            [(-0.5, 1.08), (0, 1.04)],
            [(0, 0.98), (0.5, 0.94)],
        ]
    )
    stem, bar = strokes(t, trace_letter(t, "t"))
    assert stem[[0, -1]] == pytest.approx(np.array([(0, 1.8), (0, 0)]))
    assert bar[[0, -1]] == pytest.approx(np.array([(-0.5, 1.08), (0.5, 0.94)]))


def test_an_x_is_two_straight_strokes():
    x = line([[(0, 1), (0.4, 0.5)], [(0.4, 0.5), (0.8, 0)], [(0.8, 1), (0.4, 0.5)], [(0.4, 0.5), (0, 0)]])
    found = {(tuple(s[0]), tuple(s[-1])) for s in strokes(x, trace_letter(x, "x"))}
    assert found == {((0.0, 1.0), (0.8, 0.0)), ((0.8, 1.0), (0.0, 0.0))}


def test_an_e_is_one_stroke_from_its_bar_round():
    loop = arc((0.5, 0.5), 0.5, 0, 180)
    e = line([[(0, 0.5), (1, 0.5), *loop[1:-1], (0, 0.5)], [(0, 0.5), *arc((0.5, 0.5), 0.5, 180, 315)[1:]]])
    (only,) = strokes(e, trace_letter(e, "e"))
    assert only[0] == pytest.approx((0, 0.5))
    assert only[3][0] > only[0][0] and only[3][1] == pytest.approx(0.5)
    assert only[-1] == pytest.approx(arc((0.5, 0.5), 0.5, 315, 315)[0])


def test_an_o_goes_anticlockwise_from_above():
    o = line([[*arc((0.5, 0.5), 0.5, 20, 379, 40)[:-1], arc((0.5, 0.5), 0.5, 20, 20)[0]]])
    (only,) = strokes(o, trace_letter(o, "o"))
    area = 0.5 * float((only[:-1, 0] * only[1:, 1] - only[1:, 0] * only[:-1, 1]).sum())
    assert area > 0 and only[0, 1] > 0.6


def test_the_stem_of_a_d_is_gone_up_and_down():
    top, low = (1.0, 0.8), (1.0, 0.25)
    bowl = [top, *arc((0.5, 0.5), 0.5, 60, 300, 20), low]
    d = line([bowl, [(1, 2), top], [top, low], [low, (1, 0)]])
    (only,) = strokes(d, trace_letter(d, "d"))
    assert only[0] == pytest.approx(top)
    assert only[1:].max(axis=0)[1] == pytest.approx(2)
    assert only[-1] == pytest.approx((1, 0))
    # once to the left round the bowl, up the whole stem, down again
    assert int((np.abs(only - (1.0, 2.0)).sum(axis=1) < 1e-9).sum()) == 1


def test_the_dot_of_an_i_is_last_and_late():
    i = line([[(0, 1), (0, 0)], [(0.05, 1.5), (0.07, 1.5)]])
    found = trace_letter(i, "i")
    assert strokes(i, found)[0][[0, -1]] == pytest.approx(np.array([(0, 1), (0, 0)]))
    assert found.delayed == (False, True)


def test_a_joined_letter_begins_and_ends_where_its_neighbours_are():
    # an n, entered at the foot of its stem: up and down the stem, and up again to its arch
    arch = [(0, 0.7), *arc((0.4, 0.6), 0.4, 150, 0, 8), (0.8, 0.1), (1.1, 0.2)]
    n = line([[(-0.5, 0.05), (0, 0)], [(0, 1), (0, 0.7)], [(0, 0.7), (0, 0)], arch], [(-0.5, 0.05)], [(1.1, 0.2)])
    (only,) = strokes(n, trace_letter(n, "n"))
    assert only[0] == pytest.approx((-0.5, 0.05)) and only[-1] == pytest.approx((1.1, 0.2))
    assert int((np.abs(only - (0.0, 1.0)).sum(axis=1) < 1e-9).sum()) == 1


def test_a_bar_from_the_letter_before_goes_through_and_is_late():
    crossed = (0.0, 1.1)
    h = line(
        [[(0, 2), crossed], [crossed, (0, 0.6)], [(0, 0.6), (0, 0)], [(-0.5, 1.1), crossed], [crossed, (0.3, 1.1)],
         [(0, 0.6), *arc((0.35, 0.5), 0.35, 150, 0, 8), (0.7, 0)]],
        through=[(-0.5, 1.1)],
    )  # fmt: skip
    level = np.flatnonzero(np.isclose(h.xy[:, 1], 1.1))
    h = replace(h, foreign_bars=(level[np.argsort(h.xy[level, 0])],))
    found = trace_letter(h, "h")
    body, bar = strokes(h, found)
    assert found.delayed == (False, True)
    assert bar[[0, -1]] == pytest.approx(np.array([(-0.5, 1.1), (0.3, 1.1)]))
    assert body[0] == pytest.approx((0, 2)) and body[-1] == pytest.approx((0.7, 0))


def test_a_sign_that_no_hand_has_is_written_all_the_same():
    sign = line([[(0, 0), (1, 0)], [(1, 0), (1, 1)]])
    (only,) = strokes(sign, trace_letter(sign, "\u2603"))
    assert len(only) == len(sign.xy)


@pytest.mark.parametrize(("letter", "begins"), [("t", True), ("p", False)])
def test_the_pen_leaves_the_foot_by_which_a_t_is_led_in_from_the_line(letter, begins):
    foot, fork, end = (-0.5, 0.05), (-0.05, 0.9), (0.6, 0.4)
    one = line([[foot, fork], [fork, (0, 1.5)], [fork, (0, 0.1), (0.25, 0.02), end]], finish=[end])
    found = strokes(one, trace_letter(replace(one, baseline=0.0), letter))
    assert any(stroke[0] == pytest.approx(foot) for stroke in found) == begins
    assert not any(stroke[-1] == pytest.approx(foot) for stroke in found)
