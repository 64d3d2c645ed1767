"""The planner's model against a second implementation of its rules that knows no formula of it: small steps of time."""

import dataclasses

import msgspec
import numpy as np
import pytest
import stepped
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles
from handout.plotting.planning import feed_segments, lookahead, toolpath

STEPS, ACCELERATION, RATE = (80.0, 100.0), (2000.0, 1500.0), (150.0, 120.0)
MACHINE = lookahead.Machine(
    np.array([*ACCELERATION, 200.0]), np.array([*RATE, 20.0]), np.array([*STEPS, 250.0]), 0.01, 15
)
PROFILE = profiles.find("simulated", "plotter")


def scribble(seed, n, sharp, size):
    """A path with n lines of about `size` mm that turns by about `sharp` rad, and feeds that change as a hand's do."""
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(0, sharp, n))
    length = size * rng.uniform(0.2, 2.0, n)
    xy = np.cumsum(length[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    feed = 60 * np.exp(np.cumsum(rng.normal(0, 0.25, n)) - 0.5)
    return np.concatenate([np.zeros((1, 3)), np.column_stack([xy, np.zeros(n)])]), np.clip(feed, 4, 200)


def modelled(points, feed, queue, deviation):
    lines = lookahead.blocks(points, np.zeros(len(feed), dtype=bool), dataclasses.replace(MACHINE, deviation=deviation))
    return lines, lookahead.run_planner(lines, feed, queue)


def stepped_through(points, feed, queue, deviation, line_time=0.0):
    program = [stepped.Line((x, y), speed) for (x, y, _), speed in zip(points[1:].tolist(), feed.tolist(), strict=True)]
    return stepped.execute(program, STEPS, ACCELERATION, RATE, deviation, queue, line_time)


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(
    st.integers(0, 10**6), st.integers(1, 30), st.sampled_from([0.15, 0.5]), st.sampled_from([0.15, 0.4]),
    st.sampled_from([3, 15]), st.sampled_from([0.01, 0.05]),
)  # fmt: skip
def test_times_speeds_and_places_are_those_of_small_steps(seed, n, sharp, size, queue, deviation):
    points, feed = scribble(seed, n, sharp, size)
    lines, motion = modelled(points, feed, queue, deviation)
    seen = stepped_through(points, feed, queue, deviation)
    begins = np.append(0.0, np.cumsum(motion.duration))
    assert np.array(seen.begins) == pytest.approx(begins, abs=2e-3)  # half of it is the last hundredth of a mm
    assert np.array(seen.entries[:-1]) == pytest.approx(motion.entry, abs=0.3)
    t, x, y, speed = np.array(seen.samples).T
    begun = np.array(seen.begins)
    row = np.clip(np.searchsorted(begun, t, side="right") - 1, 0, n - 1)
    since = t - begun[row]
    gone = motion.distance_travelled(row, np.minimum(since, motion.duration[row]))
    ends = lookahead.to_steps(points, MACHINE.steps)[:, :2]
    place = ends[row] + (gone / lines.length[row])[:, None] * (ends[row + 1] - ends[row])
    away = np.hypot(*(place - np.column_stack([x, y])).T)
    # within a line it can be ahead by what the speeds may differ, by a small step of time at its beginning and its end
    assert (away <= 0.3 * since + 2 * stepped.DT * speed + 2e-5).all()
    assert speed.max() <= motion.nominal.max() + 1e-6


def test_the_comparison_can_fail():
    points, feed = scribble(3, 40, 0.3, 0.3)
    seen = stepped_through(points, feed, 15, 0.01)
    for queue, deviation, slower in ((15, 0.012, 1.0), (15, 0.01, 0.98), (1, 0.01, 1.0)):
        wrong = modelled(points, slower * feed, queue, deviation)[1]
        assert np.abs(np.array(seen.entries[:-1]) - wrong.entry).max() > 0.6


def fed(points, feed, queue, line_time):
    """The model of a machine that gets its lines no faster than one in `line_time`; and its queue at every line."""
    n = len(feed)
    stands = np.arange(n) == 0
    draw = np.full(n, toolpath.DRAW, dtype=np.int8)
    none = np.zeros(n)
    way = toolpath.Toolpath(points, draw, np.zeros(n, dtype=int), none, stands, np.zeros(n + 1), np.array([0]), ())
    port = msgspec.structs.replace(PROFILE.port, queue=queue, line_time=line_time, baud=4_000_000)
    lines, motion = modelled(points, feed, queue, 0.01)
    have = feed_segments.depth(way, motion, msgspec.structs.replace(PROFILE, port=port))
    return way, have, lookahead.run_planner(lines, feed, have)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_lines_that_come_slowly_leave_less_to_look_ahead(seed):
    points, feed = scribble(seed, 40, 0.1, 0.5)
    way, have, motion = fed(points, feed, 4, 0.011)
    seen = stepped_through(points, feed, 4, 0.01, 0.011)
    assert have[4:-4].min() < 4 <= have.max()
    assert motion.duration.sum() == pytest.approx(seen.begins[-1], rel=0.01)
    assert feed_segments.find_least_queue(way, have, 4) == have[1:-4].min()


def test_a_queue_that_fills_in_time_is_always_full():
    points, feed = scribble(2, 40, 0.1, 0.4)
    way, have, motion = fed(points, feed, 15, 0.002)
    assert (have == np.minimum(15, 40 - np.arange(40))).all()
    assert feed_segments.find_least_queue(way, have, 15) == 15
    assert (motion.duration == modelled(points, feed, 15, 0.01)[1].duration).all()
