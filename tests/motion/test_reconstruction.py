"""Plans of lognormal strokes from traces: how well they explain what built-in hands write, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import handout
from benchmarks import berio_2017
from handout.errors import InputError
from handout.motion.reconstruction import LognormalPlan, from_recording, from_shape, planned_page, recording_fit
from handout.motion.reconstruction.key_points import extent, resample_path, snr
from handout.sinks import plans
from handout.sources.plans import from_json
from handout.values import Drawing, Page, Stroke


def drawn(text: str, seed: int) -> Drawing:
    rng = np.random.default_rng(seed)
    hand = handout.load("house-print")
    layout = handout.Layout(handout.page("A6"), margin=(10, 10, 10, 10), x_height=4.0)
    return handout.trace(handout.compose(text, hand, layout, rng)[0], hand, rng)


@pytest.fixture(scope="module")
def written() -> Drawing:
    return drawn("Go, ex", 4)


@pytest.fixture(scope="module")
def moving():
    """Strokes of five writings together: what holds of nearly every stroke cannot be told from a dozen."""
    words = ("Goose", "xylem", "Goose", "xylem", "Goose")
    strokes = [stroke for seed, word in enumerate(words) for stroke in drawn(word, seed).strokes]
    return [stroke for stroke in strokes if extent(stroke.xy) > 1.0]


def shape_snr(xy, plan):
    t = np.linspace(plan.onset[0] - 0.1, plan.end + 0.3, 1200)
    return snr(resample_path(xy, 400), resample_path(plan.position_at(t), 400))


@pytest.mark.slow
def test_shapes_are_explained_far_better_than_by_the_published_method(moving):
    ours = np.array([shape_snr(stroke.xy, from_shape(stroke.xy)) for stroke in moving])
    theirs = np.array([shape_snr(stroke.xy, berio_2017.from_shape(stroke.xy)) for stroke in moving])
    assert np.median(ours) >= 42 and ours.min() >= 30
    assert np.median(ours - theirs) >= 10


@pytest.mark.slow
def test_recorded_movements_are_explained_with_few_strokes(moving):
    speeds, counts, chords = [], [], []
    for stroke in moving:
        plan = from_recording(stroke.t, stroke.xy)
        recording = recording_fit.prepare_recording(stroke.t, stroke.xy)
        wanted = np.column_stack([recording.velocity.real, recording.velocity.imag])
        speeds.append(snr(wanted, plan.velocity(recording.t), about_mean=False))
        counts.append(plan.strokes)
        chords.append(np.abs(plan.chords()).max() / extent(stroke.xy))
    assert len(speeds) > 25 and np.mean(np.array(speeds) >= 25) >= 0.95
    assert np.median(counts) <= 8
    assert np.median(chords) <= 2


@pytest.mark.slow
def test_a_long_movement_is_explained_a_window_at_a_time():
    t = np.arange(0, 4.0, 0.005)
    xy = np.column_stack([5 * t + np.sin(2 * np.pi * 4 * t), 1.5 * np.cos(2 * np.pi * 4 * t + 0.3)])
    plan = from_recording(t, xy)
    recording = recording_fit.prepare_recording(t, xy)
    wanted = np.column_stack([recording.velocity.real, recording.velocity.imag])
    assert plan.strokes > 20
    assert snr(wanted, plan.velocity(recording.t), about_mean=False) >= 20


@settings(deadline=None, max_examples=15)
@given(
    st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=3, max_size=5),
    st.floats(-0.8, 0.8),
    st.floats(0.2, 0.5),
)
def test_what_a_plan_draws_is_found_again(targets, theta, duration):
    targets = np.cumsum(np.array(targets), axis=0)
    chords = np.hypot(*np.diff(targets, axis=0).T)
    if chords.min() < 1.0:
        return
    k = len(targets) - 1
    plan = LognormalPlan(
        targets, 0.8 * duration * np.arange(k), np.full(k, duration), np.full(k, 0.1), np.full(k, theta), 0.0, 3.0
    )
    t = np.arange(-0.1, 0.8 * duration * (k - 1) + 1.3 * duration, 0.005)
    xy = plan.position_at(t)
    again = from_recording(t, xy)
    assert snr(xy, again.position_at(t)) >= 25
    assert again.strokes <= max(recording_fit._MOST, 2 * k)


def test_a_plan_says_what_it_is():
    plan = LognormalPlan([[0, 0], [1, 0], [1, 2]], [0, 0.2], [0.4, 0.4], [0.1, 0.1], [0.3, -0.2], 0, 1)
    assert plan.strokes == 2
    assert plan.dt == pytest.approx([0, 0.5])
    assert plan.position_at([5.0])[0] == pytest.approx([1, 2], abs=1e-9)
    t = np.linspace(-0.5, 2, 5001)
    assert np.trapezoid(plan.velocity(t), t, axis=0) == pytest.approx([1, 2], abs=1e-4)
    for wrong in ({"onset": [0]}, {"end": 0}, {"targets": np.zeros((0, 2))}):
        parts = {"targets": plan.targets, "onset": plan.onset, "duration": plan.duration} | {
            "asymmetry": plan.asymmetry, "theta": plan.theta, "start": 0.0, "end": 1.0
        }  # fmt: skip
        with pytest.raises(ValueError):
            LognormalPlan(**(parts | wrong))


@pytest.mark.slow
@pytest.mark.parametrize("timed", [True, False])
def test_a_page_of_plans_survives_json_and_draws_the_page(written, timed):
    page = planned_page.fit(written, timed=timed)
    again = from_json(plans.to_json(page))
    drawn = planned_page.drawing(again)
    assert len(drawn.strokes) == len(written.strokes) and again.timed is timed
    for one, two, stroke in zip(drawn.strokes, planned_page.drawing(page).strokes, written.strokes, strict=True):
        assert np.array_equal(one.xy, two.xy)
        assert one.word == stroke.word
        if extent(stroke.xy) > 1:
            assert snr(resample_path(stroke.xy, 300), resample_path(one.xy, 300)) >= (25 if timed else 28)
    picture = plans.fit_report(written, page)
    assert picture.count(b"<circle") == sum(len(f.plan.targets) for f in page.fits if f.plan.strokes)


def test_a_dot_is_a_plan_of_one_target():
    dot = Drawing((Stroke(np.array([0.0, 0.1]), np.array([[3.0, 4.0], [3.0, 4.01]])),), Page(50, 50))
    page = planned_page.fit(dot)
    assert page.fits[0].plan.strokes == 0
    assert planned_page.drawing(page).strokes[0].xy == pytest.approx(np.array([[3, 4.005]] * 21), abs=1e-9)
    assert b"<polyline" in plans.fit_report(dot, page)


def test_samples_minutes_apart_tell_only_a_shape(moving):
    stroke = moving[0]
    few = np.linspace(0, len(stroke.xy) - 1, 8).astype(int)
    slow = Stroke(np.linspace(0.0, 1700.0, 8), stroke.xy[few])
    alone = planned_page.fit(Drawing((slow,), Page(50, 50)))
    assert not alone.timed and alone.fits[0].plan.end < 60 and alone.fits[0].place > 28
    beside = planned_page.fit(Drawing((stroke, slow), Page(50, 50)))
    assert beside.timed and beside.fits[0].speed is not None and beside.fits[1].speed is None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda s: s.replace('"duration": 0.', '"duration": -0.', 1), "duration is not above 0"),
        (lambda s: s.replace('"onset"', '"onsett"', 1), "onsett"),
        (lambda s: s[: len(s) // 2], "not a page of plans"),
        (lambda s: s.replace('"end": ', '"end": -', 1), "Movement 1 cannot be used"),
        (lambda s: "{}", "not a page of plans"),
    ],
)
def test_changed_plans_that_cannot_be_are_named(moving, change, said):
    page = planned_page.fit(Drawing(tuple(moving[:1]), Page(100, 100)))
    text = plans.to_json(page).decode()
    with pytest.raises(InputError, match=said):
        from_json(change(text).encode())


def test_what_does_not_move_is_refused():
    with pytest.raises(ValueError, match="two different points"):
        from_shape(np.ones((5, 2)))
    with pytest.raises(ValueError, match="go somewhere"):
        from_recording(np.arange(5.0), np.ones((5, 2)))
