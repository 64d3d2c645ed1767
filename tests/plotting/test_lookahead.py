"""The host's model of the planner: against plain passes, textbook cases, and the simulated controller."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.plotting.planning import lookahead
from handout.simulated.plotter.planner import Axes, MoveQueue, Stepper

MACHINE = lookahead.Machine(
    np.array([2000.0, 1500.0, 200.0]), np.array([150.0, 120.0, 20.0]), np.array([80.0, 100.0, 250.0]), 0.01, 15
)


def polyline(seed, n, step=0.4):
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(0, 0.5, n))
    move = rng.uniform(0.1, 2.0, n)[:, None] * step * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    xy = np.concatenate([[[0.0, 0.0]], np.cumsum(move, axis=0)])
    return np.column_stack([xy, np.zeros(n + 1)]), rng.uniform(5, 130, n)


def test_a_line_from_rest_to_rest():
    a, v = np.array([2000.0]), np.array([100.0])
    zero = np.zeros(1)
    assert lookahead.trapezoid_time(np.array([40.0]), a, zero, zero, v) == pytest.approx(40 / 100 + 100 / 2000)
    assert lookahead.trapezoid_time(np.array([1.0]), a, zero, zero, v) == pytest.approx(2 * math.sqrt(1.0 / 2000))
    assert lookahead.trapezoid_time(zero, a, zero, zero, v) == 0


def passes(limit, gain):
    """The same rule as GRBL writes it: one pass back, one pass forward."""
    speed2 = list(limit)
    for i in range(len(gain) - 1, -1, -1):
        speed2[i] = min(speed2[i], speed2[i + 1] + gain[i])
    for i in range(len(gain)):
        speed2[i + 1] = min(speed2[i + 1], speed2[i] + gain[i])
    return np.array(speed2)


@given(st.lists(st.tuples(st.floats(0, 2e4), st.floats(0.1, 3e3)), min_size=1, max_size=60))
def test_reachable_speeds_are_those_of_two_passes(pairs):
    limit = np.array([0.0, *(p[0] for p in pairs)])
    gain = np.array([p[1] for p in pairs])
    limit[-1] = 0.0
    assert lookahead.reachable(limit, gain) == pytest.approx(passes(limit, gain), abs=1e-6)


@given(st.integers(0, 1000), st.integers(1, 20))
def test_a_queue_never_allows_more_than_seeing_everything(seed, queue):
    rng = np.random.default_rng(seed)
    limit, gain = rng.uniform(0, 1e4, 41), rng.uniform(10, 2000, 40)
    limit[[0, -1]] = 0
    seen, short = lookahead.reachable(limit, gain), lookahead.reachable(limit, gain, queue)
    assert (short <= seen + 1e-6).all()
    assert lookahead.reachable(limit, gain, 40) == pytest.approx(seen)
    for i in range(40):  # it can always stop at the end of what it sees
        assert short[i] <= gain[i : i + queue].sum() + 1e-6


def test_corners():
    def corner(degrees):
        turn = math.radians(degrees)
        after = np.array([[math.cos(turn), math.sin(turn), 0.0]])
        return lookahead.corner_speed2(np.array([[1.0, 0.0, 0.0]]), after, MACHINE)[0]

    assert corner(0) == np.inf
    assert corner(180) == 0
    speeds = [corner(angle) for angle in (5, 20, 45, 90, 150)]
    assert speeds == sorted(speeds, reverse=True)
    half = math.sqrt(0.5)  # a right angle: the acceleration across it is the lesser one along the bisector
    assert corner(90) == pytest.approx(1500 / half * 0.01 * half / (1 - half))


def executed(points, feed):
    """Duration of the whole, by the simulated controller's queue and stepper, fed as fast as it has room."""
    axes = Axes(MACHINE.steps.tolist(), MACHINE.rate.tolist(), MACHINE.acceleration.tolist(), MACHINE.deviation)
    queue = MoveQueue(axes, MACHINE.queue)
    ends = [0.0]
    stepper = Stepper(queue, lambda now, there: ends.append(now))
    waiting = list(zip(points[1:].tolist(), feed.tolist(), strict=True))
    while waiting or stepper.moving:
        while waiting and not queue.full:
            target, speed = waiting.pop(0)
            queue.add(tuple(target), speed)
            stepper.replan()
            stepper.prepare()
        stepper.start(ends[-1])
        if stepper.moving:
            stepper.finish_slice()
    return ends[-1], stepper.position


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 120))
def test_the_model_agrees_with_the_simulated_controller(seed, n):
    points, feed = polyline(seed, n)
    lines = lookahead.blocks(points, np.zeros(n, dtype=bool), MACHINE)
    motion = lookahead.run_planner(lines, feed, MACHINE.queue)
    took, there = executed(points, feed)
    assert motion.duration.sum() == pytest.approx(took, rel=1e-6)
    assert np.array(there) == pytest.approx(np.round(points[-1] * MACHINE.steps))


def test_the_agreement_can_fail():
    points, feed = polyline(3, 100)
    lines = lookahead.blocks(points, np.zeros(100, dtype=bool), MACHINE)
    took = executed(points, feed)[0]
    assert lookahead.run_planner(lines, 0.9 * feed, queue=15).duration.sum() > 1.02 * took
    sharper = dataclasses.replace(MACHINE, deviation=0.008)
    lines = lookahead.blocks(points, np.zeros(100, dtype=bool), sharper)
    assert lookahead.run_planner(lines, feed, 15).duration.sum() > 1.01 * took


def test_the_machine_rests_where_it_is_told_to():
    points, feed = polyline(5, 20)
    stands = np.zeros(20, dtype=bool)
    stands[[0, 7]] = True
    lines = lookahead.blocks(points, stands, MACHINE)
    motion = lookahead.run_planner(lines, feed, 15)
    assert motion.entry[7] == 0 and motion.leave[6] == 0 and motion.entry[8] > 0


@pytest.mark.slow
def test_travelled_follows_the_trapezoid():
    points, feed = polyline(9, 30, step=3.0)
    lines = lookahead.blocks(points, np.zeros(30, dtype=bool), MACHINE)
    motion = lookahead.run_planner(lines, feed, 15)
    for row in range(30):
        duration, length = motion.duration[row], lines.length[row]
        t = np.linspace(0, duration, 2001)
        way = np.array([motion.distance_travelled(row, float(time)) for time in t])
        speed = np.diff(way) / np.diff(t)
        assert way[0] == pytest.approx(0, abs=1e-9) and way[-1] == pytest.approx(length, rel=1e-6)
        assert speed.max() <= motion.nominal[row] * 1.0001
        assert np.abs(np.diff(speed) / np.diff(t)[1:]).max() <= lines.acceleration[row] * 1.01
