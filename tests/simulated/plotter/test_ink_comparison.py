"""The judge of ink on paper must see what is missing and what is doubled, and nothing else."""

import numpy as np
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles
from handout.plotting import open_port, plan, run
from handout.plotting.jobs.places import DrawnPlace, remaining, take_drawn
from handout.values import Drawing, Page, Stroke
from handout_lab.ink_comparison import compare

PROFILE = profiles.find("simulated", "plotter")
DRAWING = page(words=4)


def arc(stroke):
    return np.append(0.0, np.cumsum(np.hypot(*np.diff(stroke.xy, axis=0).T)))


@pytest.fixture(scope="module")
def plotted():
    """The drawing as the machine draws it."""
    port = open_port("sim:", PROFILE)
    run(plan(DRAWING, PROFILE), port, PROFILE)
    return port.executed_drawing()


def test_all_of_it(plotted):
    told = compare(DRAWING, plotted.strokes)
    assert (told.missing, told.doubled, told.stray, told.dots) == (0, 0, 0, 0)
    assert told.deviation < 0.07 and told.gap < 0.1
    again = compare(DRAWING, [*plotted.strokes, *plotted.strokes])
    assert again.doubled == pytest.approx(DRAWING.pen_down, rel=0.01) and again.missing == 0


def test_each_stroke_that_is_missing(plotted):
    for index, stroke in enumerate(DRAWING.strokes):
        told = compare(DRAWING, [s for at, s in enumerate(plotted.strokes) if at != index])
        assert told.missing == pytest.approx(stroke.length, abs=0.05) and told.doubled == 0
        assert told.dots == (stroke.length == 0)


@pytest.mark.slow
@settings(max_examples=60)
@given(data=st.data())
def test_pieces(plotted, data):
    """Cut the executed strokes anywhere, leave a gap or draw twice, and the judge finds the length."""
    index = data.draw(st.sampled_from([k for k, s in enumerate(DRAWING.strokes) if s.length > 8]))
    stroke = plotted.strokes[index]
    t = data.draw(st.floats(0.1, 0.9)) * (stroke.t[-1] - stroke.t[0]) + stroke.t[0]
    dt = data.draw(st.floats(-0.08, 0.08)) * (stroke.t[-1] - stroke.t[0])
    one = Drawing((stroke,), DRAWING.page)
    first, second = take_drawn(one, DrawnPlace(0, t)), remaining(one, DrawnPlace(0, t + dt))
    others = [s for at, s in enumerate(plotted.strokes) if at != index]
    told = compare(DRAWING, [*others, *first.strokes, *second.strokes])
    intended, clock = DRAWING.strokes[index], stroke.t - stroke.t[0]
    share = np.interp([t - stroke.t[0], t + dt - stroke.t[0]], clock, arc(stroke)) / arc(stroke)[-1]
    length = float(abs(np.diff(share)[0])) * intended.length
    assert told.stray == 0 and told.dots == 0 and told.deviation < 0.1
    if dt < 0:
        assert told.missing == 0 and told.doubled == pytest.approx(length, rel=0.1, abs=0.25)
    elif length > 0.35:
        assert told.doubled < 0.05 and told.missing == pytest.approx(length, rel=0.1, abs=0.25)
    else:
        assert told.doubled < 0.05 and told.missing < 0.6


def test_a_line_that_goes_back_on_itself():
    t = np.linspace(0, 1, 101)
    there_and_back = Stroke(t, np.stack([50 - 40 * np.abs(2 * t - 1), np.full(101, 20.0)], axis=1))
    drawing = Drawing((there_and_back,), Page(100, 40))
    assert compare(drawing, drawing.strokes).missing == 0
    half = take_drawn(drawing, DrawnPlace(0, 0.5)).strokes
    told = compare(drawing, half)
    assert told.missing == pytest.approx(40, abs=0.1) and told.doubled == 0 and told.stray == 0
    both = compare(drawing, [*half, *half])
    assert both.missing + both.doubled == pytest.approx(80, abs=0.2) or both.missing == both.doubled == 0


def test_what_nobody_meant(plotted):
    slip = Stroke([0.0, 1.0], [[5, 5], [9, 8]])
    told = compare(DRAWING, [*plotted.strokes, slip])
    assert told.stray == pytest.approx(5) and told.missing == 0
    stroke = plotted.strokes[0]
    shortcut = Stroke(stroke.t[[0, -1]], stroke.xy[[0, -1]])
    told = compare(DRAWING, [shortcut, *plotted.strokes[1:]])
    assert told.stray > 1 and told.missing == pytest.approx(DRAWING.strokes[0].length, abs=0.05)
    moved = [Stroke(s.t, s.xy + np.array([0.2, 0.0])) for s in plotted.strokes]
    assert 0.15 < compare(DRAWING, moved).deviation < 0.3
