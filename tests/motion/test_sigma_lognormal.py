import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.motion import optimal_control
from handout.motion import sigma_lognormal_model as lognormal
from handout.motion.sigma_lognormal import follow, pulses_through, virtual_chords
from handout.values import ActionPlan

ARCH = np.array([[0.1, 0.95], [0.08, 0.45], [0.09, 0], [0.2, 0.6], [0.44, 0.95], [0.54, 0.48], [0.62, 0], [0.82, 0.28]])
RING = np.array([[0.5, 0.95], [0.25, 1], [0, 0.5], [0.3, 0], [0.6, 0.5], [0.35, 0.98]])


def points(seed, m):
    return np.random.default_rng(seed).normal(size=(m, 2)).cumsum(axis=0)


def distance(places, path):
    """(m,) from each place to the nearest sample of a path."""
    return np.linalg.norm(places[:, None] - path[None], axis=2).min(axis=1)


def circle(turns, phase=0.0):
    """Points four a turn on the unit circle, counter-clockwise in x towards y."""
    angle = phase + np.arange(4 * turns + 1) * np.pi / 2
    return np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.slow
@pytest.mark.parametrize("m", [2, 3, 8, 60, 300])
@pytest.mark.parametrize("smooth", [0.1, 0.3, 0.36])
def test_passes_through_the_points_and_ends_on_the_last(m, smooth):
    places = points(m, m)
    _, xy = follow(ActionPlan(places, 0.1, smooth), steps=200 if m < 100 else 60)
    assert distance(places, xy).max() < 0.01 * np.ptp(places, axis=0).max()
    assert (xy[0] == places[0]).all() and (xy[-1] == places[-1]).all()


@settings(max_examples=40, deadline=None)
@given(m=st.integers(3, 60), smooth=st.floats(0.05, 1), seed=st.integers(0, 99))
def test_virtual_chords_lead_exactly_through_the_points(m, smooth, seed):
    places = points(seed, m)
    these = pulses_through(places, smooth)
    chords = virtual_chords(places, these)
    middle = these.time(0.0)
    between = np.broadcast_to(0.5 * (middle[1:] + middle[:-1]), (m - 1, m - 2))
    z = chords @ lognormal.arc(lognormal.share_within(these, between), these.theta[:, None])
    assert np.abs(z + places[0] @ [1, 1j] - places[1:-1] @ [1, 1j]).max() < 1e-9
    assert abs(chords.sum() - (places[-1] - places[0]) @ [1, 1j]) < 1e-9
    assert np.abs(chords).max() < 6 * np.abs(np.diff(places @ [1, 1j])).max()


@pytest.mark.parametrize("letter", [ARCH, RING])
def test_rests_at_both_ends_and_moves_between(letter):
    t, xy = follow(ActionPlan(letter, 0.1, 0.32), steps=100)
    speed = np.linalg.norm(np.diff(xy, axis=0), axis=1) / np.diff(t)
    assert speed[[0, -1]].max() < 0.01 * speed.max()
    assert speed[100:-100].min() > 0


@pytest.mark.parametrize("m", [1, 2, 3, 40])
@pytest.mark.parametrize("steps", [12, 20])
def test_has_the_clock_of_optimal_control(m, steps):
    plan = ActionPlan(points(m, m), 0.07, 0.3)
    ours, theirs = follow(plan, steps=steps)[0], optimal_control.follow(plan, steps=steps)[0]
    assert (ours == theirs).all()


@pytest.mark.parametrize("letter", [ARCH, RING])
def test_writes_what_optimal_control_writes(letter):
    """Two theories of one movement: the same letter to a fiftieth of its height, root mean square."""
    plan = ActionPlan(letter, 0.1, 0.32)
    ours, theirs = follow(plan, steps=60)[1], optimal_control.follow(plan, steps=60)[1]
    off = np.concatenate([distance(ours, theirs), distance(theirs, ours)])
    assert np.sqrt((off**2).mean()) < 0.02
    assert off.max() < 0.06


def test_a_circle_is_round():
    _, xy = follow(ActionPlan(circle(6), 0.1, 0.32))
    radius = np.linalg.norm(xy[160:-160], axis=1)
    assert np.abs(radius - 1).max() < 0.03
    assert np.allclose(pulses_through(circle(4), 0.32).theta[4:-4], np.pi / 4, atol=0.12)
    assert np.allclose(pulses_through(circle(4)[::-1], 0.32).theta[4:-4], -np.pi / 4, atol=0.12)


def test_a_straight_line_stays_straight():
    line = np.outer([0, 1, 2.5, 3, 4], [2, 1])
    _, xy = follow(ActionPlan(line, 0.1, 0.3))
    assert np.abs(xy @ [1, -2]).max() < 1e-9


def test_pulses_at_a_reversal_are_straight_and_shorter():
    stem = np.array([[0, 0], [0.5, 0], [1, 0.02], [0, 0], [0.2, -0.4], [0.6, -0.5]])
    these = pulses_through(stem, 0.32)
    smooth = pulses_through(stem * [1, 0] + np.arange(6)[:, None] * [1, 0.1], 0.32)
    assert np.abs(these.theta[1:3]).max() < 0.05
    lasting = these.time(3.0) - these.time(-3.0)
    usual = smooth.time(3.0) - smooth.time(-3.0)
    assert (lasting[1:3] < 0.9 * usual[1:3]).all()


def test_more_smoothness_overlaps_more():
    lasting = [np.diff([pulses_through(RING, s).time(d)[2] for d in (-3.0, 3.0)])[0] for s in (0.01, 0.2, 0.3, 1.0)]
    assert lasting == sorted(lasting)
    assert lasting[0] == pytest.approx(1 / 0.9)
    assert lasting[3] == pytest.approx(1 / 0.3)


def test_haste_cuts_what_care_reaches():
    wave = np.column_stack([np.arange(13) * 0.3, np.tile([1.0, 0.0], 7)[:13]])
    heights = [
        np.ptp(follow(ActionPlan(wave, 0.1, smooth), baked_at=0.25)[1][60:-60, 1]) for smooth in (0.25, 0.3, 0.36, 0.45)
    ]
    assert heights == sorted(heights, reverse=True)
    assert heights[0] == pytest.approx(1, abs=0.05)
    assert heights[3] < 0.85


@settings(max_examples=30, deadline=None)
@given(scale=st.floats(1e-3, 1e3), x=st.floats(-1e3, 1e3), angle=st.floats(-4, 4), m=st.integers(2, 12))
def test_moves_turns_and_grows_with_its_points(scale, x, angle, m):
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    _, xy = follow(ActionPlan(points(m, m), 0.1, 0.3))
    _, moved = follow(ActionPlan(points(m, m) @ turn.T + [x, -x], 0.1, 0.3))
    assert np.allclose(moved, xy @ turn.T + [x, -x], atol=1e-6 * scale + 1e-9)


def test_in_a_mirror_it_is_mirrored():
    _, xy = follow(ActionPlan(ARCH, 0.1, 0.3))
    _, mirrored = follow(ActionPlan(ARCH * [1, -1], 0.1, 0.3))
    assert np.allclose(mirrored, xy * [1, -1], atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(interval=st.floats(1e-3, 10), m=st.integers(1, 12))
def test_only_the_clock_depends_on_the_interval(interval, m):
    t, xy = follow(ActionPlan(points(m, m), 0.1, 0.3))
    slower, same = follow(ActionPlan(points(m, m), interval, 0.3))
    assert (same == xy).all()
    assert np.allclose(slower, t * interval / 0.1)


def test_one_point_is_a_dwell():
    t, xy = follow(ActionPlan(np.array([[3.0, 4.0]]), 0.1, 0.3))
    assert t.tolist() == [0, 0.1]
    assert xy.tolist() == [[3, 4], [3, 4]]


@pytest.mark.parametrize("m", [2, 3, 10])
def test_points_that_coincide_stay_where_they_are(m):
    _, xy = follow(ActionPlan(np.full((m, 2), 4.0), 0.1, 0.3))
    assert (xy == 4).all()


def test_a_repeated_point_is_reached():
    corner = np.array([[0, 0], [0, 0.5], [0, 1], [0, 1], [0.5, 1], [1, 1]])
    _, xy = follow(ActionPlan(corner, 0.1, 0.32), steps=60)
    assert distance(corner, xy).max() < 5e-3
    assert xy[:, 1].max() < 1.1 and xy[:, 0].min() > -0.1


@settings(max_examples=60, deadline=None)
@given(
    coordinates=st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=1, max_size=60),
    smooth=st.floats(0.02, 3),
    jitter=st.sampled_from([0.0, 0.5]),
)
def test_never_fails_nor_strays(coordinates, smooth, jitter):
    """Points on a coarse grid: many coincide, lie in line, or reverse."""
    places = np.array(coordinates, dtype=float)
    plan = ActionPlan(places, 0.1, smooth)
    _, xy = follow(plan, rng=np.random.default_rng(1), jitter=jitter)
    assert np.isfinite(xy).all()
    room = np.ptp(places, axis=0).max() + 1
    assert (xy > places.min(axis=0) - room).all() and (xy < places.max(axis=0) + room).all()


def test_jitter_displaces_the_points_as_much_as_was_asked_for():
    plan = ActionPlan(ARCH, 0.1, 0.3, spread=np.broadcast_to(np.diag([0.0004, 0.0001]), (8, 2, 2)))
    rng = np.random.default_rng(0)
    ends = np.stack([follow(plan, rng=rng, jitter=0.5)[1][[0, -1]] for _ in range(800)])
    assert np.allclose(ends.std(axis=0), [0.01, 0.005], rtol=0.12)


@pytest.mark.parametrize("m", [1, 2, 8])
def test_the_same_seed_gives_the_same_path(m):
    plan = ActionPlan(ARCH[:m], 0.1, 0.3, spread=np.broadcast_to(1e-4 * np.eye(2), (m, 2, 2)))
    paths = [follow(plan, rng=np.random.default_rng(seed), jitter=1)[1] for seed in (3, 3, 4)]
    assert (paths[0] == paths[1]).all()
    assert not np.allclose(paths[0], paths[2])


@pytest.mark.parametrize(
    "plan, options",
    [
        (ActionPlan(ARCH, 0.1, 0.3), {"jitter": 1.0}),
        (ActionPlan(ARCH, 0.1, 0.3), {"steps": 1}),
        (ActionPlan(np.zeros((0, 2)), 0.1, 0.3), {}),
    ],
)
def test_refuses_what_it_cannot_follow(plan, options):
    with pytest.raises(ValueError):
        follow(plan, **options)
