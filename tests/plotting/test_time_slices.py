"""Plans for machines that keep time: what is asked of the machine, and what of the hand is kept."""

import itertools
import time

import msgspec
import numpy as np
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st
from test_planning import awkward, hausdorff

from handout import profiles
from handout.plotting import observation, plan
from handout.plotting.dialects import Pause, PenBlock, Timed
from handout.plotting.planning import time_slices
from handout.plotting.planning.segments import Trajectory, on_one_clock
from handout.profiles import Acceleration
from handout.values import Drawing, Page, Stroke

PROFILE = profiles.find("axidraw-v3", "plotter")


def machine(**values):
    return msgspec.structs.replace(PROFILE, limits=msgspec.structs.replace(PROFILE.limits, **values))


def motors(blocks):
    """(n + 1, 2) steps of the motors at the ends of the timed moves, and (n,) s how long each takes."""
    moves = [block for block in blocks if isinstance(block, Timed)]
    xy = np.array([(0.0, 0.0), *((move.x, move.y) for move in moves)])
    return 80 * np.stack([xy.sum(axis=1), xy[:, 0] - xy[:, 1]], axis=1), np.array([move.seconds for move in moves])


def drawn(made):
    """Places of the ends of the drawn moves of every stroke, with their times."""
    way, end = made.toolpath, made.starts[:-1] + made.motion.duration
    xy, many = made.placement.to_page(way.points[:, :2]), np.bincount(way.stroke[way.draws], minlength=len(way.first))
    rows = zip(way.first, way.first + many, strict=True)
    return [Stroke(np.append(made.starts[a], end[a:b]), xy[a : b + 1]) for a, b in rows]


@pytest.mark.parametrize("acceleration", [800, 1524, 5000])
def test_no_more_is_asked_than_the_machine_can_do(acceleration):
    profile = machine(acceleration=Acceleration(acceleration))
    made = plan(page(words=6), profile)
    steps, seconds = motors(made.blocks)
    assert np.abs(np.diff(steps, axis=0) / seconds[:, None]).max() < 25_000
    assert seconds.min() >= 0.006 and np.allclose(seconds * 1000, np.rint(seconds * 1000))
    for stroke in drawn(made):
        if len(stroke.t) > 2:
            speed = np.diff(stroke.xy, axis=0) / np.diff(stroke.t)[:, None]
            gap = 0.5 * (np.diff(stroke.t)[1:] + np.diff(stroke.t)[:-1])
            asked = np.hypot(*np.diff(speed, axis=0).T) / gap
            assert asked.max() < 1.6 * acceleration  # turning and speeding up at once


def test_a_hand_within_the_limits_is_left_alone():
    drawing = page(words=6)
    made = plan(drawing, machine(acceleration=Acceleration(20000)))
    found = observation.compare_strokes(made.intended_drawing(), made.predicted_drawing())
    assert made.stretched == pytest.approx(1, abs=1e-4) and found.timed_rms < 5e-3 and found.timed > 0.999
    for stroke, there in zip(drawing.strokes, drawn(made), strict=True):
        if stroke.length:
            assert there.t[-1] - there.t[0] == pytest.approx(stroke.t[-1] - stroke.t[0], abs=1e-3)


def test_time_is_given_where_it_is_missing_and_nowhere_else():
    """A stroke that is quick only in its middle is as it was before and after."""
    t = np.arange(0, 3, 0.005)
    x = 20 + 10 * t + 15 * np.tanh((t - 1.5) / 0.06)
    drawing = Drawing((Stroke(t, np.stack([x, np.full_like(x, 40)], axis=1)),), Page(148, 210))
    path = time_slices.smooth_trajectory(on_one_clock([drawing.strokes[0].t], [drawing.strokes[0].xy]))
    slow = time_slices.slow_down(path, time_slices.motion_limits(machine(acceleration=Acceleration(1000))))
    longer = np.diff(slow.trajectory.t) / np.diff(path.trajectory.t)
    at = path.trajectory.t[1:]
    assert longer.max() > 1.3 and (longer >= 1 - 1e-9).all()
    calm = ((at > 0.3) & (at < 1.0)) | ((at > 2.0) & (at < 2.7))
    assert longer[calm].max() < 1.001
    speed = np.diff(slow.trajectory.xy[:, 0]) / np.diff(slow.trajectory.t)
    assert np.abs(np.diff(speed) / np.diff(slow.trajectory.t)[1:]).max() < 1200


def test_lines_slow_down_at_their_corners():
    square = np.array([[20, 20], [60, 20], [60, 60], [20, 60], [20, 20]], dtype=float)
    drawing = Drawing((Stroke(np.arange(5) * 0.4, square),), Page(148, 210))
    (stroke,) = drawn(plan(drawing, PROFILE))
    for corner in square[1:-1]:
        near = np.flatnonzero(np.hypot(*(stroke.xy - corner).T) < 0.02)
        assert len(near)
        speeds = np.hypot(*np.diff(stroke.xy, axis=0).T) / np.diff(stroke.t)
        assert speeds[near[0]] < 20 < speeds.max()
    assert observation.deviation_of(drawing.strokes[0], stroke) < 0.03


def test_fast_is_as_fast_as_motors_and_acceleration_allow():
    line = Drawing((Stroke([0.0, 10.0], [[10.0, 10.0], [110.0, 110.0]]),), Page(148, 210))
    made = plan(line, PROFILE, speed="fast")
    (stroke,) = drawn(made)
    speed = np.hypot(*np.diff(stroke.xy, axis=0).T) / np.diff(stroke.t)
    assert speed.max() == pytest.approx(220, rel=0.01)
    length = 100 * 2**0.5
    assert stroke.t[-1] - stroke.t[0] == pytest.approx(length / 220 + 220 / 1524, rel=0.05)


def test_travels_speed_up_and_brake():
    made = plan(page(words=2), PROFILE)
    steps, seconds = motors(
        itertools.takewhile(lambda block: not (isinstance(block, PenBlock) and block.down), made.blocks)
    )
    xy = np.stack([steps.sum(axis=1), steps[:, 0] - steps[:, 1]], axis=1) / 160
    speed = np.hypot(*np.diff(xy, axis=0).T) / seconds
    assert speed[0] < 40 and speed[-1] < 40 and speed.max() <= 165.001
    assert (np.abs(np.diff(speed)) / seconds[1:]).max() < 1.05 * 1524
    assert seconds.max() <= 0.038


def test_motors_turn_round_between_slices():
    made = plan(page(words=4), machine(acceleration=Acceleration(5000)))
    path = time_slices.smooth_trajectory(
        on_one_clock(
            [s.t for s in made.drawing.strokes], [made.placement.to_machine(s.xy) for s in made.drawing.strokes]
        )
    )
    mix = np.array([[1.0, 1.0], [1.0, -1.0]])
    starts = np.flatnonzero(np.diff(path.trajectory.stroke, prepend=-1))
    amiss = total = 0
    for index, stroke in enumerate(drawn(made)):
        if len(stroke.t) < 5:
            continue
        begin = path.trajectory.t[starts[index]]
        for a, b in itertools.pairwise(stroke.t - stroke.t[0] + begin):
            along = np.diff(path.places_at(np.linspace(a, b, 20)) @ mix.T, axis=0)
            total += 1
            amiss += bool((np.abs(along.sum(axis=0)) < 0.98 * np.abs(along).sum(axis=0) - 0.02).any())
    assert total > 100 and amiss < 0.02 * total


def test_blocks_and_at_tell_the_same_story():
    made = plan(page(words=4), PROFILE)
    pens = [block.down for block in made.blocks if isinstance(block, PenBlock)]
    assert pens == [False] + [True, False] * len(made.drawing.strokes)
    assert (np.diff(made.begins) >= -1e-9).all() and len(made.begins) == len(made.blocks)
    assert sum(isinstance(block, Pause) for block in made.blocks) == sum(s.length == 0 for s in made.drawing.strokes)
    for block, begin in zip(made.blocks, made.begins, strict=True):
        if isinstance(block, Timed):
            x, y, _ = made.pen_at(float(begin + block.seconds))
            assert (x, y) == pytest.approx((block.x, block.y), abs=1e-6)
    assert made.pen_at(made.duration + 1) == (pytest.approx(0), pytest.approx(0), False)
    total = sum(block.seconds for block in made.blocks if isinstance(block, (Timed, Pause)))
    total += sum(0.18 if down else 0.13 for down in pens)
    assert made.duration == pytest.approx(total, abs=1e-6)


@pytest.mark.slow
@settings(max_examples=30)
@given(awkward(), st.sampled_from([1.0, 0.2, 5.0, "fast"]), st.sampled_from(["corexy", "cartesian"]))
def test_awkward_strokes_are_planned_all_the_same(drawing, speed, gantry):
    profile = msgspec.structs.replace(PROFILE, bed=msgspec.structs.replace(PROFILE.bed, gantry=gantry))
    made = plan(drawing, profile, speed=speed)
    for stroke, there in zip(drawing.strokes, drawn(made), strict=True):
        assert hausdorff(stroke.xy, there.xy) < 0.15
        assert len(there.t) == 1 or (np.diff(there.t) >= 0.006 - 1e-9).all()


def test_a_path_is_followed_between_its_samples():
    t = np.linspace(0, 2, 401)
    circle = np.stack([50 + 5 * np.cos(5 * t), 50 + 5 * np.sin(5 * t)], axis=1)
    path = time_slices.smooth_trajectory(Trajectory(t[::2], circle[::2], np.zeros(201, dtype=int)))
    assert np.hypot(*(path.places_at(t) - circle).T)[4:-4].max() < 1e-3


def test_a_long_page_is_planned_in_a_few_seconds():
    drawing = page(seed=2, words=150, x_height=2.0, size=Page(210, 297, "A4"))
    begin = time.process_time()
    plan(drawing, profiles.find("axidraw-v3-a3", "plotter"))
    assert time.process_time() - begin < 5
