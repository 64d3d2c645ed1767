from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.inking import curves
from handout.values import Array, Stroke


def loop(t: Array) -> Array:
    """(n, 2) mm: letters of 3 mm at five loops a second."""
    phase = 2 * np.pi * 5 * t
    return np.stack([12 * t + 0.8 * np.sin(phase), -1.5 * np.cos(phase) + 0.3 * np.sin(2 * phase)], axis=1)


def off(curve: curves.Curve, t: Array, xy: Array) -> float:
    return float(np.hypot(*(curve.places_at(t) - xy).T).max())


@pytest.mark.parametrize("rate", [100, 133, 200, 500])
def test_few_curves_close_to_the_motion_itself(rate: float) -> None:
    t = np.arange(0, 2, 1 / rate)
    (curve,) = curves.fit([Stroke(t, loop(t))])
    fine = np.linspace(0, t[-1], 9999)
    assert off(curve, t, loop(t)) <= curves.TOLERANCE
    # between samples the motion is known only as well as they tell
    assert off(curve, fine, loop(fine)) < (0.02 if rate == 100 else 0.01)
    assert len(curve.t) - 1 < 2 * 5 * 12


@given(
    steps=st.lists(st.floats(1e-3, 1), min_size=1, max_size=60),
    seed=st.integers(0, 999),
    tolerance=st.sampled_from([0.001, 0.01, 0.3]),
)
def test_meets_its_knots_and_keeps_the_tolerance(steps: list[float], seed: int, tolerance: float) -> None:
    t = np.cumsum(steps)
    xy = np.random.default_rng(seed).normal(size=(len(t), 2)).cumsum(axis=0)
    (curve,) = curves.fit([Stroke(t, xy)], tolerance)
    assert off(curve, t, xy) <= tolerance + 1e-9
    at = np.searchsorted(t, curve.t)
    assert np.array_equal(curve.t, t[at]) and np.array_equal(curve.points[::3], xy[at])
    assert curve.t[0] == t[0] and curve.t[-1] == t[-1]


def test_a_smaller_tolerance_takes_more_curves() -> None:
    t = np.arange(0, 2, 1 / 200)
    counts = [len(curves.fit([Stroke(t, loop(t))], tolerance)[0].t) for tolerance in (0.001, 0.01, 0.1)]
    assert counts[0] > counts[1] > counts[2]


def test_strokes_do_not_touch_one_another() -> None:
    t = np.arange(0, 1, 1 / 200)
    strokes = [Stroke(t, loop(t)), Stroke(np.array([0.5]), np.array([[3.0, 4.0]])), Stroke(t + 2, loop(t) + 50)]
    together = curves.fit(strokes)
    for stroke, curve in zip(strokes, together, strict=True):
        (alone,) = curves.fit([stroke])
        assert np.array_equal(curve.points, alone.points) and np.array_equal(curve.t, alone.t)


def test_one_and_two_samples() -> None:
    dot, line = curves.fit([Stroke(np.array([3.0]), np.ones((1, 2))), Stroke(np.arange(2.0), np.eye(2))])
    assert dot.points.tolist() == [[1, 1]] and dot.places_at(np.array([0.0, 9.0])).tolist() == [[1, 1], [1, 1]]
    assert np.allclose(line.points, [[1, 0], [2 / 3, 1 / 3], [1 / 3, 2 / 3], [0, 1]])
    assert curves.fit([]) == []


def test_corners_are_not_overshot() -> None:
    # a polygon of which only the corners are known, some of them twice
    xy = np.array([[0, 0], [40, 0], [40.1, 0], [40.1, 0.1], [40.1, 30], [0, 30], [0, 29.9]], dtype=float)
    (curve,) = curves.fit([Stroke(np.arange(7.0), xy)])
    path = curve.places_at(np.linspace(0, 6, 2000))
    assert (path.min(axis=0) > xy.min(axis=0) - 0.1).all() and (path.max(axis=0) < xy.max(axis=0) + 0.1).all()


def test_beziers_of_several_curves_in_one_row() -> None:
    t = np.arange(0, 0.5, 1 / 200)
    fitted = curves.fit([Stroke(t, loop(t)), Stroke(np.array([0.9]), np.array([[3.0, 4.0]]))])
    row = curves.beziers(fitted)
    m = len(fitted[0].t) - 1
    assert row.control.shape == (4, m + 1) and row.stroke.tolist() == [0] * m + [1]
    assert np.array_equal(row.t[1, : m - 1], row.t[0, 1:m])
    assert np.allclose(row.control[:, m], 3 + 4j) and row.t[:, m].tolist() == [0.9, 0.9]
    assert np.allclose(row.control[3, : m - 1], row.control[0, 1:m])
    assert np.allclose(row.control[1, 0], complex(*fitted[0].points[1]))
