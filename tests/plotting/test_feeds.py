"""Feeds fitted to the planner: closer to the hand than the mean speed, within bounds, written as they are meant."""

import numpy as np
import pytest
from cursive import page
from hypothesis import given
from hypothesis import strategies as st

from handout import profiles
from handout.plotting import course, feeds, lookahead, plan

PROFILE = profiles.find("simulated", "plotter")


def worked_out(drawing):
    made = plan(drawing, PROFILE)
    lines = lookahead.blocks(made.course.points, made.course.stands, course.machine(PROFILE))
    return made.course, lines


def test_fitted_feeds_keep_time_where_mean_speeds_come_late():
    way, lines = worked_out(page(words=6))
    draws, wanted = way.draws, way.intended
    mean = np.where(draws, lines.length / np.maximum(wanted, 1e-9), 100.0)
    most = feeds.greatest(lines, 2000.0, 120.0)
    fitted = feeds.fit(lines, wanted, mean, draws, most, 15)

    def late(feed):
        return lookahead.run(lines, feed, 15).duration[draws].sum() / wanted[draws].sum() - 1

    assert late(mean) > 0.015
    assert abs(late(fitted)) < 0.3 * late(mean)
    assert (fitted[draws] <= most[draws] + 1e-9).all() and (fitted[draws] > 0).all()
    assert (fitted[~draws] == mean[~draws]).all()
    assert feeds.likeness(lines, wanted, lookahead.run(lines, fitted, 15), draws)[0] > 0.99


def test_curves_are_not_taken_faster_than_the_acceleration_allows():
    angle = np.linspace(0, 2 * np.pi, 90)
    points = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    lines = lookahead.blocks(points, np.zeros(89, dtype=bool), course.machine(PROFILE))
    most = feeds.greatest(lines, 2000.0, 500.0)[1:-1]
    assert most == pytest.approx(np.sqrt(2000 * 2**0.5 * 1.0), rel=0.01)
    assert feeds.greatest(lines, 2000.0, 20.0).max() == 20


def test_likeness_of_the_same_and_of_a_slower_motion():
    way, lines = worked_out(page(words=3))
    feed = np.full(len(lines.length), 40.0)
    motion = lookahead.run(lines, feed, 15)
    assert feeds.likeness(lines, motion.duration, motion, way.draws) == pytest.approx((1, 0, 1))
    correlation, rms, stretched = feeds.likeness(lines, way.intended, motion, way.draws)
    assert correlation < 0.9 and rms > 0.05 and stretched != pytest.approx(1, abs=0.01)


@given(st.floats(0, 500))
def test_feeds_are_written_to_a_tenth_or_whole(feed):
    minute = feeds.round_feed(np.array([feed]))[0]
    assert minute >= 1
    assert minute == pytest.approx(max(feed * 60, 1), rel=0.05 if minute < 10 else 0.006)
    assert float(f"{minute:.1f}") == minute
