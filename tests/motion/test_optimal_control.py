import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.motion import optimal_control, tracker
from handout.motion.optimal_control import follow, smooth_path, targets_through
from handout.values import ActionPlan

# an n with a foot, on-curve points four a down-up cycle; and an o
ARCH = np.array([[0.1, 0.95], [0.08, 0.45], [0.09, 0], [0.2, 0.6], [0.44, 0.95], [0.54, 0.48], [0.62, 0], [0.82, 0.28]])
RING = np.array([[0.5, 0.95], [0.25, 1], [0, 0.5], [0.3, 0], [0.6, 0.5], [0.35, 0.98]])


def points(seed, m):
    return np.random.default_rng(seed).normal(size=(m, 2)).cumsum(axis=0)


def distance(places, path):
    """(m,) from each place to the nearest point of a finely sampled path."""
    return np.linalg.norm(places[:, None] - path[None], axis=2).min(axis=1)


@pytest.mark.parametrize("letter", [ARCH, RING])
@pytest.mark.parametrize("smooth", [0.2, 0.3, 0.36])
def test_passes_nearly_through_the_points(letter, smooth):
    t, xy = follow(ActionPlan(letter, 0.1, smooth))
    assert distance(letter, xy).max() < 0.02
    assert np.linalg.norm(xy[[0, -1]] - letter[[0, -1]], axis=1).max() < 5e-3
    assert len(t) == len(xy) == 20 * len(letter)


def test_targets_that_are_not_sought_backwards_miss_them():
    path = smooth_path(ARCH, smooth=0.3)
    assert distance(ARCH, path).max() > 0.04


@pytest.mark.parametrize("order", [2, 3, 4, 5])
def test_rests_exactly_at_both_ends_and_keeps_the_clock(order):
    t, xy = follow(ActionPlan(points(0, 9), 0.08, 0.3), order=order, steps=16)
    assert (xy[:order] == xy[0]).all() and (xy[-order:] == xy[-1]).all()
    assert np.allclose(np.diff(t), 0.08 / 16) and t[0] == 0
    assert t[-1] == pytest.approx(9 * 0.08 - 0.08 / 16)


def test_one_point_is_a_dwell():
    t, xy = follow(ActionPlan(np.array([[3.0, 4.0]]), 0.1, 0.3))
    assert t.tolist() == [0, 0.1]
    assert xy.tolist() == [[3, 4], [3, 4]]


def test_two_points_are_the_straight_movement_of_least_effort():
    _, xy = follow(ActionPlan(np.array([[1.0, 2.0], [5.0, -1.0]]), 0.1, 0.3), steps=50)
    part = (xy - [1, 2]) @ [4, -3] / 25
    u = np.linspace(0, 1, 100)
    assert np.allclose(xy, np.outer(part, [4, -3]) + np.array([1, 2]), atol=1e-12)
    assert np.allclose(part, 35 * u**4 - 84 * u**5 + 70 * u**6 - 20 * u**7, atol=1e-12)
    assert (np.diff(part) >= 0).all()


@pytest.mark.parametrize("m", [2, 3, 10, 150])
def test_points_that_coincide_stay_where_they_are(m):
    _, xy = follow(ActionPlan(np.full((m, 2), 4.0), 0.1, 0.3))
    assert np.allclose(xy, 4, atol=1e-12)


def test_a_repeated_point_is_a_corner():
    corner = np.array([[0, 0], [0, 0.5], [0, 1], [0.5, 1], [1, 1]])
    stopped = np.insert(corner, 2, corner[2], axis=0)
    nearest = [distance(corner[2:3], follow(ActionPlan(p, 0.1, 0.4))[1])[0] for p in (corner, stopped)]
    assert nearest[1] < 0.01

    def slowest(p):
        xy = follow(ActionPlan(p, 0.1, 0.4))[1]
        speed = np.linalg.norm(np.diff(xy, axis=0), axis=1)
        return speed[len(speed) // 4 : -len(speed) // 4].min()

    assert slowest(stopped) < 0.5 * slowest(corner)


@settings(max_examples=30, deadline=None)
@given(scale=st.floats(1e-3, 1e3), x=st.floats(-1e3, 1e3), angle=st.floats(-4, 4), m=st.integers(2, 12))
def test_moves_turns_and_grows_with_its_points(scale, x, angle, m):
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    _, xy = follow(ActionPlan(points(m, m), 0.1, 0.3))
    _, moved = follow(ActionPlan(points(m, m) @ turn.T + [x, -x], 0.1, 0.3))
    assert np.allclose(moved, xy @ turn.T + [x, -x], atol=1e-6 * scale + 1e-9)


@settings(max_examples=20, deadline=None)
@given(interval=st.floats(1e-3, 10), m=st.integers(1, 12))
def test_only_the_clock_depends_on_the_interval(interval, m):
    t, xy = follow(ActionPlan(points(m, m), 0.1, 0.3))
    slower, same = follow(ActionPlan(points(m, m), interval, 0.3))
    assert (same == xy).all()
    assert np.allclose(slower, t * interval / 0.1)


def test_written_backwards_it_is_the_same_path():
    _, xy = follow(ActionPlan(ARCH, 0.1, 0.3))
    _, back = follow(ActionPlan(ARCH[::-1], 0.1, 0.3))
    assert np.allclose(back[::-1], xy, atol=1e-7)


@settings(max_examples=40, deadline=None)
@given(smooth=st.floats(0.05, 1), order=st.integers(2, 5), m=st.integers(1, 200), steps=st.integers(6, 24))
def test_never_fails(smooth, order, m, steps):
    places = points(m, m)
    t, xy = follow(ActionPlan(places, 0.1, smooth), order=order, steps=steps, rng=np.random.default_rng(m), jitter=0.1)
    assert len(t) == len(xy) and np.isfinite(xy).all()
    room = 0.5 * np.ptp(places, axis=0).max() + 2
    assert (np.abs(xy - places.mean(axis=0)) <= np.abs(places - places.mean(axis=0)).max(axis=0) + room).all()


@pytest.mark.parametrize("smooth", [0.1, 0.3, 0.6])
def test_long_plans_are_solved_as_short_ones_are(monkeypatch, smooth):
    places = points(5, 60)
    whole = targets_through(places, smooth=smooth)
    monkeypatch.setattr(optimal_control, "_CACHED", 10)
    assert np.allclose(targets_through(places, smooth=smooth), whole, atol=1e-6)


def test_haste_cuts_what_care_reaches():
    """Targets sought at .30, played from .25 to .45: the more haste, the flatter the writing."""
    wave = np.column_stack([np.arange(13) * 0.3, np.tile([1.0, 0.0], 7)[:13]])
    heights = []
    for smooth in (0.25, 0.30, 0.36, 0.45):
        _, xy = follow(ActionPlan(wave, 0.1, smooth), baked_at=0.30)
        heights.append(np.ptp(xy[60:-60, 1]))
    assert heights == sorted(heights, reverse=True)
    assert heights[1] == pytest.approx(1, abs=0.05)
    assert heights[3] < 0.8


def test_round_covariances_that_are_alike_change_nothing_and_a_loose_target_is_cut():
    alike = np.broadcast_to(0.01 * np.eye(2), (8, 2, 2))
    _, xy = follow(ActionPlan(ARCH, 0.1, 0.3))
    _, same = follow(ActionPlan(ARCH, 0.1, 0.3, spread=alike))
    assert np.allclose(same, xy, atol=1e-7)
    loose = alike.copy()
    loose[4] *= 100
    _, cut = follow(ActionPlan(ARCH, 0.1, 0.3, spread=loose))
    assert distance(ARCH[4:5], cut)[0] > distance(ARCH[4:5], xy)[0] + 0.05


def test_singular_covariances_are_taken():
    singular = np.broadcast_to(np.diag([0.01, 0.0]), (8, 2, 2))
    _, xy = follow(ActionPlan(ARCH, 0.1, 0.3, spread=singular), rng=np.random.default_rng(1), jitter=1)
    assert np.isfinite(xy).all()


@pytest.mark.slow
@pytest.mark.parametrize("spread", [None, np.broadcast_to(np.diag([0.0004, 0.0001]), (8, 2, 2))])
def test_jitter_is_as_large_as_was_asked_for(spread):
    rng = np.random.default_rng(2)
    plan = ActionPlan(ARCH, 0.1, 0.3, spread=spread)
    _, xy = follow(plan)
    draws = np.stack([follow(plan, rng=rng, jitter=0.5)[1] - xy for _ in range(600)], axis=1)
    step = np.sqrt((np.diff(ARCH, axis=0) ** 2).sum() / 7)
    wanted = 0.5 * (np.array([0.02, 0.01]) if spread is not None else np.full(2, 0.05 * step))
    found = np.sqrt((tracker.centres(draws, 20) ** 2).mean(axis=1))
    assert np.allclose(found, wanted, rtol=0.05 + 4 / np.sqrt(2 * 600))
    assert np.allclose(found.mean(axis=0), wanted, rtol=0.05)


@pytest.mark.parametrize("m", [1, 2, 8])
def test_the_same_seed_gives_the_same_path(m):
    plan = ActionPlan(ARCH[:m], 0.1, 0.3, spread=np.broadcast_to(1e-4 * np.eye(2), (m, 2, 2)))
    paths = [follow(plan, rng=np.random.default_rng(seed), jitter=1)[1] for seed in (3, 3, 4)]
    assert (paths[0] == paths[1]).all()
    assert not np.allclose(paths[0], paths[2])


@pytest.mark.parametrize("options", [{"jitter": 1.0}, {"order": 7}, {"steps": 4}, {"baked_at": 9.0}])
def test_refuses_wrong_options(options):
    with pytest.raises(ValueError):
        follow(ActionPlan(ARCH, 0.1, 0.3), **options)


def test_refuses_a_plan_without_points():
    with pytest.raises(ValueError, match="at least one point"):
        follow(ActionPlan(np.zeros((0, 2)), 0.1, 0.3))


@pytest.mark.slow
def test_imports_nothing_heavy():
    code = "import sys, handout.motion.optimal_control, handout.motion.sigma_lognormal;"
    code += "print([m for m in ('scipy.signal', 'scipy.stats', 'scipy.interpolate', 'cv2') if m in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
