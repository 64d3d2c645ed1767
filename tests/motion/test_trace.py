"""Manuscripts to timed strokes."""

from itertools import pairwise

import numpy as np
import pytest

from handout.errors import InputError
from handout.hand.library import load
from handout.motion import ENGINES
from handout.motion.trace import trace
from handout.page_sizes import page
from handout.writing.compose import compose
from handout.writing.layout import Layout

TEXT = "thirteen lilies, Zoë"


def traced(name="house-joined", engine="optimal-control", seed=1, **options):
    hand, rng = load(name), np.random.default_rng(seed)
    (sheet,) = compose(TEXT, hand, Layout(page("A6")), rng)
    return sheet, trace(sheet, hand, rng, engine, **options)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["house-joined", "house-quick", "house-print"])
def test_strokes_pass_where_they_were_placed(name, engine):
    sheet, drawing = traced(name, engine)
    path = np.vstack([s.xy for s in drawing.strokes])
    points = np.vstack([s for line in sheet.lines for p in line.placed for s in p.strokes])
    near = np.sqrt(((points[:, None] - path[None]) ** 2).sum(-1)).min(axis=1)
    assert np.median(near) < 0.03 * sheet.x_height
    assert near.max() < 0.35 * sheet.x_height


@pytest.mark.parametrize("engine", ENGINES)
def test_time_runs_forward_and_strokes_begin_and_end_at_rest(engine):
    _, drawing = traced(engine=engine)
    ends = [(s.t[0], s.t[-1]) for s in drawing.strokes]
    assert all(b > a for a, b in ends)
    assert all(later[0] > earlier[1] for earlier, later in pairwise(ends))
    for stroke in drawing.strokes:
        if len(stroke.t) > 20 and stroke.speed.max() > 5:
            assert stroke.speed[0] < 0.15 * stroke.speed.max()
            assert stroke.speed[-1] < 0.15 * stroke.speed.max()


def test_dots_and_bars_follow_the_word_in_a_joined_hand():
    _, drawing = traced("house-joined")
    first = [s for s in drawing.strokes if s.word == 0]
    # thirteen: the body goes to the right, then bar and dot come back
    starts = [s.xy[0, 0] for s in first]
    assert min(starts[1:]) < max(s.xy[:, 0].max() for s in first[:1])
    assert {s.word for s in drawing.strokes} == {0, 1, 2}


def test_a_hand_writes_about_a_letter_a_second():
    for name in ("house-joined", "house-quick", "house-print"):
        sheet, drawing = traced(name)
        letters = sum(len(line.placed) for line in sheet.lines)
        assert 0.8 < letters / drawing.duration < 1.9, name


def test_speed_scales_time_and_nothing_else():
    _, slow = traced()
    _, quick = traced(speed=2.0)
    assert quick.duration == pytest.approx(slow.duration / 2)
    assert all(np.allclose(a.xy, b.xy) for a, b in zip(slow.strokes, quick.strokes, strict=True))


def test_pressure_is_heavier_pulling_down():
    _, drawing = traced()
    down, up = [], []
    for stroke in drawing.strokes:
        vy = np.gradient(stroke.xy[:, 1])
        middle = slice(8, -8)
        down += stroke.pressure[middle][vy[middle] > 0.05].tolist()
        up += stroke.pressure[middle][vy[middle] < -0.05].tolist()
    assert np.mean(down) > np.mean(up) + 0.05
    assert all((s.pressure >= 0).all() and (s.pressure <= 1).all() for s in drawing.strokes)


def test_unknown_engine_and_absurd_speed():
    with pytest.raises(InputError, match="optimal-control or sigma-lognormal"):
        traced(engine="magic")
    with pytest.raises(InputError, match="speed"):
        traced(speed=0.0)
