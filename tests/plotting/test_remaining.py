"""A drawing cut at a place: the two halves are the whole, and nothing is in both."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.plotting.jobs.places import START, DrawnPlace, onward, remaining, take_drawn
from handout.values import Drawing, Page, Stroke

CHANNELS = ("pressure", "tilt", "azimuth", "rotation", "width")


@st.composite
def drawings(draw):
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    strokes, clock = [], 0.0
    for index in range(draw(st.integers(1, 4))):
        n = draw(st.integers(1, 12))
        t = clock + np.cumsum(rng.uniform(1e-3, 0.1, n))
        clock = t[-1]
        channels = {name: rng.uniform(0, 1, n) for name in CHANNELS if rng.random() < 0.3}
        strokes.append(Stroke(t, rng.uniform(0, 90, (n, 2)), word=index // 2, layer="abc"[index % 3], **channels))
    return Drawing(tuple(strokes), Page(100, 100), {"seed": 1})


@st.composite
def places(draw, drawing):
    """Before, between, on and behind the samples of any stroke, and behind the last."""
    at = draw(st.integers(0, len(drawing.strokes)))
    if at == len(drawing.strokes):
        return DrawnPlace(at)
    t = drawing.strokes[at].t
    anywhere = st.floats(float(t[0]) - 0.1, float(t[-1]) + 0.1)
    return DrawnPlace(at, draw(st.just(-np.inf) | anywhere | st.sampled_from(t.tolist())))


def samples(drawing):
    """(n, 4): word, time and place of every sample."""
    rows = [np.column_stack([np.full(len(s.t), s.word), s.t, s.xy]) for s in drawing.strokes]
    return np.concatenate([np.zeros((0, 4)), *rows])


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_drawn_and_left_are_the_whole_and_nothing_is_twice(data):
    whole = data.draw(drawings())
    place = data.draw(places(whole))
    before, after = take_drawn(whole, place), remaining(whole, place)
    assert before.pen_down + after.pen_down == pytest.approx(whole.pen_down)
    assert (before.page, before.about) == (after.page, after.about) == (whole.page, whole.about)
    broken = len(before.strokes) + len(after.strokes) - len(whole.strokes)
    assert broken in (0, 1)
    if not broken:
        assert (*before.strokes, *after.strokes) == whole.strokes
        return
    a, b, intact = before.strokes[-1], after.strokes[0], whole.strokes[place.stroke]
    assert a.t[-1] == b.t[0] == place.time and (a.xy[-1] == b.xy[0]).all()
    assert (a.word, a.layer) == (b.word, b.layer) == (intact.word, intact.layer)
    kept = np.concatenate([a.t[:-1], b.t[1:]])
    assert np.isin(intact.t, np.append(kept, place.time)).all() and np.isin(kept, intact.t).all()
    for name in CHANNELS:
        values = getattr(intact, name)
        assert (getattr(a, name) is None) == (getattr(b, name) is None) == (values is None)
        if values is not None:
            assert set(values.tolist()) <= set(getattr(a, name).tolist()) | set(getattr(b, name).tolist())


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.data())
def test_what_is_left_of_what_was_left(data):
    whole = data.draw(drawings())
    first = data.draw(places(whole))
    left = remaining(whole, first)
    second = data.draw(places(left)) if left.strokes else START
    place = onward(first, left, whole, second)
    at_once, in_turn = remaining(whole, place), remaining(left, second)
    assert len(at_once.strokes) == len(in_turn.strokes)
    assert samples(at_once) == pytest.approx(samples(in_turn), abs=1e-9)


def test_an_azimuth_goes_the_short_way_round():
    stroke = Stroke([0.0, 1.0], [[0, 0], [10, 0]], azimuth=np.array([3.1, -3.1]))
    (left,) = remaining(Drawing((stroke,), Page(20, 20)), DrawnPlace(0, 0.5)).strokes
    assert left.azimuth[0] == pytest.approx(np.pi, abs=0.01) and left.azimuth[1] == -3.1


def test_a_dot_is_drawn_or_not():
    dot = Stroke([1.0], [[5, 5]])
    page = Drawing((dot, dataclasses.replace(dot, t=[2.0])), Page(20, 20))
    assert len(remaining(page, START).strokes) == 2 and take_drawn(page, START).strokes == ()
    assert (
        remaining(page, DrawnPlace(1)).strokes == page.strokes[1:]
        and take_drawn(page, DrawnPlace(1)).strokes == page.strokes[:1]
    )
