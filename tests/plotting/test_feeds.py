"""Feeds fitted to the planner: closer to the hand than the mean speed, within bounds, written as they are meant."""

import msgspec
import numpy as np
import pytest
from cursive import page
from hypothesis import given
from hypothesis import strategies as st

from handout import profiles
from handout.plotting import plan
from handout.plotting.planning import lookahead, toolpath
from handout.profiles import Acceleration

PROFILE = profiles.find("simulated", "plotter")


def worked_out(drawing):
    made = plan(drawing, PROFILE)
    lines = lookahead.blocks(made.toolpath.points, made.toolpath.stands, toolpath.machine_of(PROFILE))
    return made.toolpath, lines


def test_fitted_feeds_keep_time_where_mean_speeds_come_late():
    way, lines = worked_out(page(words=6))
    draws, wanted = way.draws, way.requested_time
    mean = np.where(draws, lines.length / np.maximum(wanted, 1e-9), 100.0)
    most = lookahead.greatest(lines, 2000.0, 120.0)
    fitted = lookahead.fit(lines, wanted, mean, draws, most, 15)

    def late(feed):
        return lookahead.run_planner(lines, feed, 15).duration[draws].sum() / wanted[draws].sum() - 1

    assert late(mean) > 0.015
    assert abs(late(fitted)) < 0.3 * late(mean)
    assert (fitted[draws] <= most[draws] + 1e-9).all() and (fitted[draws] > 0).all()
    assert (fitted[~draws] == mean[~draws]).all()
    took = lookahead.run_planner(lines, fitted, 15).duration
    assert np.corrcoef(lines.length[draws] / took[draws], lines.length[draws] / wanted[draws])[0, 1] > 0.99


def test_curves_are_not_taken_faster_than_the_acceleration_allows():
    angle = np.linspace(0, 2 * np.pi, 90)
    points = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    lines = lookahead.blocks(points, np.zeros(89, dtype=bool), toolpath.machine_of(PROFILE))
    most = lookahead.greatest(lines, 2000.0, 500.0)[1:-1]
    assert most == pytest.approx(np.sqrt(2000 * 2**0.5 * 1.0), rel=0.01)
    assert lookahead.greatest(lines, 2000.0, 20.0).max() == 20


def test_lost_time_is_made_up_nearby_and_only_there():
    """One segment that the machine cannot run in time: the stroke is in time all the same, far away nothing changes."""
    n = 120
    points = np.column_stack([np.linspace(0, 48, n + 1), np.zeros(n + 1), np.zeros(n + 1)])
    lines = lookahead.blocks(points, np.arange(n) == 0, toolpath.machine_of(PROFILE))
    easy = lookahead.run_planner(lines, np.full(n, 40.0), 15).duration
    wanted = np.where(np.arange(n) == 60, 0.4 * easy, easy)
    most, drawn = np.full(n, 60.0), np.ones(n, dtype=bool)
    feed = lookahead.fit(lines, wanted, np.zeros(n), drawn, most, 15)
    took = lookahead.run_planner(lines, feed, 15).duration
    late, lost = np.cumsum(took - wanted), took[60] - wanted[60]
    assert lost > 0.002  # it cannot be done
    assert abs(late[-1]) < 0.3 * lost and np.abs(late).max() < lost
    assert np.abs(took / wanted - 1)[np.abs(np.arange(n) - 60) > 3].max() < 0.05


def test_what_cannot_be_made_up_is_stretched_evenly():
    drawing = page(words=2)
    slow = msgspec.structs.replace(PROFILE.limits, acceleration=Acceleration(300.0))
    made = plan(drawing, msgspec.structs.replace(PROFILE, limits=slow))
    assert made.stretched > 1.5
    draws = made.toolpath.draws
    ratio = np.convolve(made.motion.duration[draws], np.ones(40), "valid") / np.convolve(
        made.target_time[draws], np.ones(40), "valid"
    )
    assert ratio.min() > 0.9  # nowhere hurried beyond the hand to make up for it


def test_nothing_drawn_needs_no_feeds():
    lines = lookahead.blocks(np.array([[0.0, 0, 0], [9, 0, 0]]), np.array([True]), toolpath.machine_of(PROFILE))
    assert lookahead.fit(lines, np.zeros(1), np.array([70.0]), np.array([False]), np.array([99.0]), 15) == [70.0]


@given(st.floats(0, 500))
def test_feeds_are_written_to_a_tenth_or_whole(feed):
    minute = lookahead.round_feed(np.array([feed]))[0]
    assert minute >= 1
    assert minute == pytest.approx(max(feed * 60, 1), rel=0.05 if minute < 10 else 0.006)
    assert float(f"{minute:.1f}") == minute
