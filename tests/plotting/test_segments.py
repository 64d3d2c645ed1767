"""Cutting paths into segments: true to the path, never too short, ends and turns kept."""

import numpy as np
from cursive import page, word
from hypothesis import given, settings
from hypothesis import strategies as st
from test_planning import hausdorff

from handout.plotting.observation import deviation_of
from handout.plotting.planning import segments
from handout.values import Stroke


def tracked(strokes):
    return segments.on_one_clock([s.t for s in strokes], [s.xy for s in strokes])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 6), st.sampled_from([50.0, 100.0, 200.0]), st.sampled_from([0.02, 0.05]))
def test_segments_follow_the_path(seed, loops, rate, deviation):
    t, xy = word(np.random.default_rng(seed), loops)
    cut = segments.cut_path(tracked([Stroke(t, xy)]), rate, 0.05, deviation)
    length = np.hypot(*np.diff(cut.xy, axis=0).T)
    assert length.min() >= 0.05 - 1e-9
    assert np.diff(cut.t).min() > 0
    assert deviation_of(Stroke(t, xy), Stroke(cut.t, cut.xy)) <= deviation + 0.05
    assert (cut.xy[0] == xy[0]).all() and np.allclose(cut.xy[-1], xy[-1])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 40), st.sampled_from([20.0, 100.0, 500.0]))
def test_of_the_smallest_curls_no_more_is_lost_than_a_segment_s_length(seed, n, rate):
    rng = np.random.default_rng(seed)
    heading = rng.choice([0.0, 0.3, np.pi / 2, np.pi], n).cumsum()
    step = rng.choice([0.0, 0.003, 0.03], n)[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    stroke = Stroke(np.cumsum(rng.choice([1e-4, 0.005, 0.01, 0.3], n)), np.cumsum(step, axis=0))
    cut = segments.cut_path(tracked([stroke]), rate, 0.04, 0.02)
    assert hausdorff(stroke.xy, cut.xy) <= 0.02 + 0.04 + 1e-9
    assert (np.hypot(*np.diff(cut.xy, axis=0).T) >= 0.04).all()
    assert (cut.xy[0] == stroke.xy[0]).all() and np.hypot(*(cut.xy[-1] - stroke.xy[-1])) < 0.04


def test_a_stroke_that_comes_back_is_no_dot():
    out_and_back = Stroke([0.0, 0.1, 0.2], [[0.0, 0.0], [0.07, 0.0], [0.0, 0.0]])
    assert segments.cut_path(tracked([out_and_back]), 100, 0.04, 0.02).xy.tolist() == out_and_back.xy.tolist()
    # nowhere is a breakpoint far enough from both ends: as far as it went
    nearly_back = Stroke([0.0, 0.1, 0.2], [[0.0, 0.0], [0.06, 0.0], [0.03, 0.0]])
    assert segments.cut_path(tracked([nearly_back]), 100, 0.04, 0.02).xy.tolist() == [[0.0, 0.0], [0.06, 0.0]]


def test_strokes_stay_apart():
    drawing = page(words=4)
    cut = segments.cut_path(tracked(drawing.strokes), 100, 0.05, 0.02)
    assert list(np.unique(cut.stroke)) == list(range(len(drawing.strokes)))
    for index, stroke in enumerate(drawing.strokes):
        mine = cut.xy[cut.stroke == index]
        assert np.allclose(mine[0], stroke.xy[0])
        if stroke.length > 0.05:
            assert np.allclose(mine[-1], stroke.xy[-1])
        else:
            assert len(mine) == 1


def test_about_as_many_as_asked_for():
    drawing = page(words=6)
    time = sum(s.t[-1] - s.t[0] for s in drawing.strokes)
    for rate in (60, 100):
        cut = segments.cut_path(tracked(drawing.strokes), rate, 0.05, 0.05)
        assert 0.8 * rate < len(cut.t) / time < 1.3 * rate


def test_a_sharp_corner_at_constant_speed_is_kept():
    t = np.linspace(0, 1, 101)
    xy = np.where(t[:, None] < 0.503, np.stack([t * 40, 0 * t], 1), np.stack([0 * t + 20.0, (t - 0.5) * 40], 1))
    cut = segments.cut_path(tracked([Stroke(t, xy)]), 30, 0.05, 0.02)
    assert np.hypot(*(cut.xy - [20.0, 0.0]).T).min() < 0.06


def test_turning_points_are_breakpoints():
    t = np.linspace(0, 1, 201)
    x = 3 * np.sin(2 * np.pi * 2.5 * t)  # to and fro on a line: each end is a cusp
    cut = segments.cut_path(tracked([Stroke(t, np.stack([x, 0 * t], 1))]), 37, 0.05, 0.02)
    for end in (0.1, 0.3, 0.5, 0.7, 0.9):
        near = np.abs(cut.t - end).argmin()
        assert abs(abs(cut.xy[near, 0]) - 3) < 0.01


def test_one_sample_is_one_breakpoint():
    cut = segments.cut_path(tracked([Stroke([0.0], [[3.0, 4.0]])]), 100, 0.05, 0.02)
    assert len(cut.t) == 1 and (cut.xy == [[3, 4]]).all()
