"""Plans: what they announce, where the pen is when, what they refuse."""

import dataclasses
import time

import msgspec
import numpy as np
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles
from handout.errors import InputError
from handout.plotting import observation, open_port, plan, run
from handout.plotting.dialects import MoveBlock, Pause, PenBlock
from handout.plotting.planning.plan import DEVIATION, find_shortest_segment
from handout.profiles import Acceleration
from handout.values import Drawing, Page, Stroke

PROFILE = profiles.find("simulated", "plotter")


def machine(**limits):
    return msgspec.structs.replace(PROFILE, limits=msgspec.structs.replace(PROFILE.limits, **limits))


def executed(drawing, profile, **how):
    made = plan(drawing, profile, **how)
    port = open_port("sim:", profile)
    report = run(made, port, profile)
    return made, report, port


@pytest.mark.slow
@pytest.mark.parametrize("acceleration", [1000, 2000, 5000])
@pytest.mark.parametrize("lift", ["simulated", "grbl-z"])
def test_the_page_is_drawn_as_it_was_announced(acceleration, lift):
    profile = profiles.find(lift, "plotter")
    limits = msgspec.structs.replace(profile.limits, acceleration=Acceleration(acceleration))
    profile = msgspec.structs.replace(profile, limits=limits)
    drawing = page(seed=acceleration, words=6)
    made, report, port = executed(drawing, profile)
    found = observation.compare_strokes(drawing, port.executed_drawing())
    assert found.deviation < 0.1
    assert report.executed_s == pytest.approx(made.duration, rel=0.05)
    assert found.stretched == pytest.approx(made.stretched, rel=0.01) == pytest.approx(report.stretched, rel=0.01)
    predicted = observation.compare_strokes(made.intended_drawing(), made.predicted_drawing())
    assert found.correlation == pytest.approx(predicted.correlation, abs=0.01)
    assert found.timed == pytest.approx(predicted.timed, abs=0.01)
    assert found.correlation > (0.94 if acceleration == 1000 else 0.99)


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([2.0, 3.0, 6.0]), st.sampled_from([0.5, 1.0, 2.0, "fast"]))
def test_the_path_is_kept_at_any_speed(seed, x_height, speed):
    drawing = page(seed=seed, words=3, x_height=x_height)
    made, report, port = executed(drawing, PROFILE, speed=speed)
    for stroke, drawn in zip(drawing.strokes, port.executed_drawing().strokes, strict=True):
        assert observation.deviation_of(stroke, drawn) < 0.1
    assert report.executed_s == pytest.approx(made.duration, rel=0.05)
    assert port.lost_bytes == 0


@pytest.mark.slow
def test_speed_is_a_multiple_of_the_hand():
    drawing = page(words=5)
    durations = [plan(drawing, machine(acceleration=Acceleration(20000)), speed=s).motion.duration for s in (1.0, 0.5)]
    draws = plan(drawing, PROFILE).toolpath.draws
    assert durations[1].sum() > durations[0].sum() * 1.3
    slow = plan(drawing, PROFILE, speed=0.5)
    assert slow.stretched == pytest.approx(1, abs=0.01)
    assert observation.compare_strokes(slow.intended_drawing(), slow.predicted_drawing()).correlation > 0.995
    fast = plan(drawing, PROFILE, speed="fast")
    assert fast.stretched < 0.9 and fast.duration < plan(drawing, PROFILE).duration
    assert draws.any()


def test_fast_stays_within_the_machine():
    made = plan(page(words=5), PROFILE, speed="fast")
    drawn = made.motion.nominal[made.toolpath.draws]
    assert drawn.max() <= PROFILE.limits.draw_speed + 0.02
    straight = Drawing((Stroke([0.0, 10.0], [[10.0, 10.0], [130.0, 10.0]]),), Page(148, 210))
    line = plan(straight, PROFILE, speed="fast")
    assert line.motion.duration[line.toolpath.draws].sum() == pytest.approx(120 / 120 + 120 / 2000, rel=0.02)


def test_blocks_tell_the_same_story():
    drawing = page(words=4)
    made = plan(drawing, PROFILE)
    pens = [block.down for block in made.blocks if isinstance(block, PenBlock)]
    assert pens == [False] + [True, False] * len(drawing.strokes)
    assert sum(isinstance(block, Pause) for block in made.blocks) == sum(s.length == 0 for s in drawing.strokes)
    assert len(made.begins) == len(made.blocks) and (np.diff(made.begins) >= -1e-9).all()
    moves = np.array([block[:2] for block in made.blocks if isinstance(block, MoveBlock)])
    assert (moves[-1] == [0, 0]).all()
    on_page = made.placement.to_page(moves[:-1])
    assert on_page.min(axis=0) == pytest.approx(made.bounds[:2], abs=0.01)
    assert on_page.max(axis=0) == pytest.approx(made.bounds[2:], abs=0.01)
    assert made.pen_down == pytest.approx(drawing.pen_down, rel=0.01)
    home = np.linalg.norm(drawing.strokes[0].xy[0] - [0, 210]) + np.linalg.norm(drawing.strokes[-1].xy[-1] - [0, 210])
    assert made.pen_up == pytest.approx(drawing.pen_up + home, rel=0.01)


def test_at_says_where_the_pen_is():
    drawing = page(words=3)
    made = plan(drawing, PROFILE)
    assert made.pen_at(-1.0) == made.pen_at(0.0) == (pytest.approx(0), pytest.approx(210), False)
    assert made.pen_at(made.duration + 1) == (pytest.approx(0), pytest.approx(210), False)
    predicted = made.predicted_drawing()
    for stroke in predicted.strokes:
        for t, (x, y) in zip(stroke.t[1:-1:7], stroke.xy[1:-1:7], strict=True):
            assert made.pen_at(float(t)) == (pytest.approx(x, abs=1e-6), pytest.approx(y, abs=1e-6), True)
    track = np.array([made.pen_at(t)[:2] for t in np.arange(0, made.duration, 0.01)])
    assert np.linalg.norm(np.diff(track, axis=0), axis=1).max() <= 150 * 0.01 * 1.001
    between = [(a.t[-1], b.t[0]) for a, b in zip(predicted.strokes, predicted.strokes[1:], strict=False)]
    assert not any(made.pen_at((a + b) / 2)[2] for a, b in between)


def test_predicted_is_what_the_simulated_plotter_does():
    drawing = page(words=6)
    made, _, port = executed(drawing, PROFILE)
    found = observation.compare_strokes(made.predicted_drawing(), port.executed_drawing())
    assert found.stretched == pytest.approx(1, abs=1e-3) and found.timed > 0.998 and found.deviation < 0.05


def test_a_page_too_small_for_the_writing_speed_is_stretched_not_distorted():
    slow = machine(acceleration=Acceleration(300))
    drawing = page(words=3)
    made, _, port = executed(drawing, slow)
    assert made.stretched > 1.5
    assert observation.compare_strokes(drawing, port.executed_drawing()).deviation < 0.1


def test_dots_rest_on_the_paper():
    dots = tuple(Stroke(np.array([i, i + 0.04]), np.array([[20.0 + i, 30.0]] * 2)) for i in range(3))
    single = Stroke([5.0], [[40.0, 40.0]])
    made, report, port = executed(Drawing((*dots, single), Page(100, 100)), PROFILE)
    assert [s.length for s in port.executed_drawing().strokes] == [0.0] * 4
    assert port.executed_drawing().strokes[3].xy == pytest.approx(np.array([[40, 40]]), abs=0.01)
    assert [block.seconds for block in made.blocks if isinstance(block, Pause)] == pytest.approx([0.04] * 3)
    assert report.executed_s == pytest.approx(made.duration, rel=0.05)
    assert made.stretched == 1.0


@pytest.mark.parametrize("speed", [1.0, "fast"])
@pytest.mark.parametrize("name", ["simulated", "grbl-z"])
def test_a_single_dot_at_zero(name, speed):
    profile = profiles.find(name, "plotter")
    made, report, port = executed(Drawing((Stroke([0.0], [[0.0, 210.0]]),), Page(148, 210)), profile, speed=speed)
    assert len(port.executed_drawing().strokes) == 1 and made.pen_up == made.pen_down == 0
    assert report.executed_s == pytest.approx(made.duration, abs=0.05) and made.pen_at(0.1)[:2] == (0, 210)


def test_order_travel_moves_words_only():
    drawing = page(seed=8, words=30)
    made = plan(drawing, PROFILE, order="travel")
    assert sorted(s.xy.tolist() for s in made.drawing.strokes) == sorted(s.xy.tolist() for s in drawing.strokes)
    assert made.pen_up <= plan(drawing, PROFILE).pen_up * 1.05
    assert plan(drawing, PROFILE).drawing.strokes == drawing.strokes


@st.composite
def awkward(draw):
    """Strokes nobody would write: rests, jumps, cusps, specks, repeated places."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    strokes, clock = [], 0.0
    for _ in range(draw(st.integers(1, 6))):
        n = draw(st.integers(1, 40))
        step = rng.choice([0.0, 0.005, 0.05, 0.3, 3.0], n) * draw(st.sampled_from([0.01, 0.3, 1.0]))
        heading = rng.choice([0.0, 0.3, np.pi / 2, np.pi], n).cumsum()
        xy = rng.uniform(40, 100, 2) + np.cumsum(
            step[:, None] * np.stack([np.cos(heading), np.sin(heading)], 1), axis=0
        )
        t = clock + np.cumsum(rng.choice([1e-4, 0.005, 0.01, 0.3], n))
        clock = t[-1] + 0.1
        strokes.append(Stroke(t, np.clip(xy, 1, 147)))
    return Drawing(tuple(strokes), Page(148, 210))


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(awkward(), st.sampled_from([1.0, 0.2, 5.0, "fast"]), st.sampled_from(["simulated", "grbl-z"]))
def test_awkward_strokes_are_drawn_all_the_same(drawing, speed, name):
    profile = profiles.find(name, "plotter")
    made, report, port = executed(drawing, profile, speed=speed)
    assert (made.motion.length[made.toolpath.draws] > 0).all() and np.isfinite(made.motion.duration).all()
    assert report.executed_s == pytest.approx(made.duration, rel=0.05, abs=0.05)
    for stroke, drawn in zip(drawing.strokes, port.executed_drawing().strokes, strict=True):
        assert hausdorff(stroke.xy, drawn.xy) < lost(profile, speed)


def lost(profile, speed):
    """How far a path may be from what is drawn of it, mm.

    A cut keeps within its deviation, and leaves out what is nearer to a breakpoint than a segment is long at least;
    "fast" cuts twice.  Then come whole micrometres, and up to a step in each axis.
    """
    allowed = (DEVIATION, DEVIATION / 2)[: 2 if speed == "fast" else 1]
    steps = np.sqrt(2) / profile.limits.steps_per_mm
    return sum(deviation + find_shortest_segment(profile) for deviation in allowed) + 0.001 + steps


def hausdorff(a, b):
    """By brute force, on dense points."""
    from scipy.spatial.distance import directed_hausdorff

    dense = [
        np.concatenate([p[:1], *(p[i] + np.linspace(0, 1, 40)[:, None] * (p[i + 1] - p[i]) for i in range(len(p) - 1))])
        for p in (a, b)
    ]
    return max(directed_hausdorff(*dense)[0], directed_hausdorff(*dense[::-1])[0])


@pytest.mark.parametrize("speed", [0, -1, 1000, float("nan"), "slow", None])
def test_speeds_that_mean_nothing_are_refused(speed):
    with pytest.raises(InputError, match="speed"):
        plan(page(words=1), PROFILE, speed=speed)


def test_nothing_to_draw_and_unknown_order_are_refused():
    with pytest.raises(InputError, match="nothing to plot"):
        plan(Drawing((), Page(100, 100)), PROFILE)
    with pytest.raises(InputError, match="order"):
        plan(page(words=1), PROFILE, order="random")


def test_a_slow_line_is_not_asked_for_more_than_it_carries():
    slow_line = msgspec.structs.replace(PROFILE, port=msgspec.structs.replace(PROFILE.port, baud=9600))
    drawing = page(words=3)
    made, report, port = executed(drawing, slow_line)
    drawn = made.toolpath.draws
    assert drawn.sum() / made.motion.duration[drawn].sum() < 9600 / 10 / 22
    assert made.stretched > 1.5 and port.lost_bytes == 0
    assert report.executed_s == pytest.approx(made.duration, rel=0.05)


def test_nothing_makes_a_machine_crawl():
    """Segments of a few steps at least, no more of them than it can read, none that lasts without need."""
    for speed, rate in ((0.3, 100), (1.0, 200), (3.0, 1000)):
        made = plan(page(words=6), msgspec.structs.replace(PROFILE, segment_rate=float(rate)), speed=speed)
        drawn = made.toolpath.draws
        steps, took = made.motion.length[drawn] * PROFILE.limits.steps_per_mm, made.motion.duration[drawn]
        assert steps.min() >= 2 and np.percentile(steps, 2) >= 3
        assert np.convolve(took, np.ones(8), "valid").min() > 8 * PROFILE.port.line_time
        assert min(block.feed for block in made.blocks if isinstance(block, MoveBlock)) >= 10
        assert (took <= 3 * made.target_time[drawn] + 0.05).all()


@pytest.mark.slow
def test_a_long_page_is_planned_in_a_few_seconds():
    drawing = page(seed=2, words=150, x_height=2.0, size=Page(210, 297, "A4"))
    assert sum(len(s.t) for s in drawing.strokes) > 30_000
    begin = time.process_time()
    made = plan(drawing, PROFILE)
    assert time.process_time() - begin < 5
    assert len(made.blocks) > 15_000


def test_planning_leaves_the_drawing_alone():
    drawing = page(words=2)
    assert dataclasses.replace(plan(drawing, PROFILE).drawing).strokes == drawing.strokes
