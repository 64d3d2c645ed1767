"""Pose libraries, and poses made of them: exact where a small case can be tried out, clear about what is missing."""

from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.motion import POSE_METHODS
from handout.motion.pose import library as libraries
from handout.motion.pose.features import FEATURES, filtered_velocities, resample_path
from handout.motion.pose.library import PoseLibrary, embed_channels, extract_channels, learn, level_pose, load, to_bytes
from handout.motion.pose.posing import anchors, pose_drawing, shape_stroke
from handout.motion.pose.synthesis import PoseCosts, PoseModel, PoseNeighbours, blend_segments, segments
from handout.values import Drawing, Page, Stroke

PAGE = Page(200.0, 200.0)


def loop(seed, n=60, at=(40.0, 40.0)):
    """A lively stroke of a few mm, y down, pressed the more the further down it goes."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, n)
    x = 8 * t + rng.normal(0, 1.0) * np.sin(2 * np.pi * t)
    y = 3 * np.sin(2 * np.pi * (1 + rng.uniform(0, 1)) * t)
    xy = np.column_stack([x, y]) + at
    down = np.gradient(y) / np.hypot(np.gradient(x), np.gradient(y))
    return t, xy, 0.5 + 0.3 * down, np.full(n, 0.5) + 0.1 * down, 0.3 * down, 1 + 0.2 * down


def recorded(seeds, **without):
    strokes = []
    for number, seed in enumerate(seeds):
        t, xy, pressure, tilt, azimuth, rotation = loop(seed, at=(30 + number % 7, 30 + number % 5))
        strokes.append(Stroke(t + 2 * number, xy, pressure, tilt, azimuth, rotation))
    return Drawing(tuple(replace(stroke, **without) for stroke in strokes), PAGE)


@pytest.fixture(scope="module")
def pose():
    return learn([recorded(range(12))], "an artist").library


def test_a_path_is_resampled_evenly():
    xy, at = resample_path(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 0.0], [3.0, 4.0]]), 0.5)
    assert len(xy) == 15
    np.testing.assert_allclose(np.hypot(*np.diff(xy, axis=0).T), 1.0)
    assert at[0] == 0 and at[-1] == 3 and (np.diff(at) > 0).all()
    assert len(resample_path(np.zeros((3, 2)), 0.5)[0]) == 1


@pytest.mark.parametrize(("name", "size"), [("velocities", 32), ("shape-contexts", 62)])
def test_features_tell_directions_and_ends_apart(name, size):
    line = np.column_stack([np.arange(80.0), np.zeros(80)])
    features, back = FEATURES[name](line), FEATURES[name](line[::-1])
    assert features.shape == (80, size)
    assert features[0, 0] == 0 and features[-1, 1] == 0 and features[40, 0] == features[40, 1] == 1
    assert np.linalg.norm(features[40] - back[40]) > 0.1
    assert FEATURES[name](line[:1]).shape == (1, size) and np.isfinite(FEATURES[name](line[:2])).all()


def test_a_tap_is_the_mean_of_the_velocities_that_there_are():
    line = np.column_stack([np.arange(50.0), 2 * np.arange(50.0)])
    taps = filtered_velocities(line)[25, 2:].reshape(-1, 2) / 0.3
    np.testing.assert_allclose(taps, np.tile([1.0, 2.0], (15, 1)), rtol=1e-5)
    first = filtered_velocities(line)[0, 2:].reshape(-1, 2) / 0.3
    assert (first[:7] == 0).sum() >= 12  # nothing before the beginning but what a triangle around it reaches
    np.testing.assert_allclose(first[8:], np.tile([1.0, 2.0], (7, 1)), rtol=1e-5)


def cheapest(near, model):
    """By trying all sequences, and all ways to read their steps; a sequence is ((number, step) …)."""
    library, costs, best = model.library, model.costs, np.inf
    n, k = near.number.shape
    for picks in product(range(k), repeat=n):
        numbers = [int(near.number[i, j]) for i, j in enumerate(picks)]
        kinds = []
        for a, b in pairwise(numbers):
            step = int(library.place[b] - library.place[a])
            same = b - a == step
            change = np.linalg.norm(library.pose[a] - library.pose[b])
            kinds.append([("jump", costs.jump + costs.change * change)])
            if same and step in (0, 1, 2):
                kinds[-1].append(("repeat", costs.repeat) if step == 0 else ("on", (0, 0, costs.skip)[step]))
        for way in product(*kinds):
            names = [name for name, _ in way]
            if any(a == b == "repeat" for a, b in pairwise(names)):
                continue
            lengths, length = [], 1
            for name in names:
                length = length + 1 if name != "jump" else (lengths.append(length) or 1)
            short = sum((costs.short + costs.least - m) ** 2 for m in [*lengths, length] if m < costs.least)
            own = costs.feature * sum(near.distance[i, j] for i, j in enumerate(picks))
            ends = costs.end * (library.place[numbers[0]] + library.samples_left[numbers[-1]])
            best = min(best, own + ends + short + sum(price for _, price in way))
    return best


def price(sequence, near, model):
    """What a sequence costs, its steps read in the cheapest way."""
    at = [int(np.flatnonzero(near.number[i] == number)[0]) for i, number in enumerate(sequence)]
    only = PoseNeighbours(near.distance[np.arange(len(at)), at][:, None], near.number[np.arange(len(at)), at][:, None])
    return cheapest(only, model)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(2, 4))
def test_the_optimal_sequence_is_the_cheapest_of_all(seed, n, k):
    rng = np.random.default_rng(seed)
    lengths = rng.integers(2, 6, 3)
    count = int(lengths.sum())
    channels = {"pressure": rng.random(count), "rotation": rng.normal(size=count)}
    library = PoseLibrary(rng.normal(size=(count, 2)), channels, lengths, 1.0)
    scale = rng.choice([0.2, 1.0, 5.0])
    costs = PoseCosts(
        rng.choice([1.0, 10.0]), 3.0, 2.0, 5.0 * scale, 10.0, 1.0, int(rng.integers(2, 5)), rng.choice([0.0, 2.0])
    )
    model = PoseModel(library, costs=costs)
    number = np.array([rng.permutation(min(count, 6))[:k] for _ in range(n)])
    near = PoseNeighbours(rng.random((n, k)) * 3, number)
    assert price(model.sequence(near), near, model) == pytest.approx(cheapest(near, model))


@pytest.mark.parametrize("features", FEATURES)
def test_a_stroke_of_the_library_gets_its_own_pose_back(pose, features):
    model = PoseModel(pose, features)
    xy, channels = pose.strokes()[4]
    for method in ("optimal", "closest"):
        back = extract_channels(model.pose(xy, method), pose.channels)
        for name, values in channels.items():
            np.testing.assert_allclose(back[name], values, atol=1e-6)


def test_neighbours_are_the_nearest_of_all(pose):
    model = PoseModel(pose, neighbours=7)
    xy = pose.strokes()[3][0] @ np.array([[1.1, 0.1], [0.0, 0.9]])
    near = model.nearest(xy)
    known = np.concatenate([filtered_velocities(part) for part, _ in pose.strokes()])
    apart = np.linalg.norm(filtered_velocities(xy)[:, None] - known, axis=2)
    np.testing.assert_allclose(near.distance, np.sort(apart, axis=1)[:, :7], atol=1e-4)


def test_optimal_is_of_longer_segments_than_closest(pose):
    model = PoseModel(pose)
    xy = resample_path(loop(99)[1], pose.unit)[0]
    near = model.nearest(xy)
    assert len(segments(model.sequence(near), pose)) < len(segments(near.number[:, 0], pose))


def test_segments_fade_into_each_other(pose):
    sequence = np.concatenate([np.arange(5, 20), pose.first_samples[3] + np.arange(8, 23)])
    values = np.arange(len(pose.xy), dtype=float)[:, None] * 0
    values[pose.first_samples[3] :] = 1.0
    made = blend_segments(sequence, values, pose)[:, 0]
    assert made[0] == 0 and made[-1] == 1 and (np.diff(made) >= 0).all()
    assert 0 < made[10] < made[14] < 0.5 < made[15] < made[19] < 1


def test_angles_are_blended_on_the_circle():
    near = {"rotation": np.array([3.1, -3.1])}
    middle = extract_channels(embed_channels(near).mean(axis=0, keepdims=True), near)["rotation"]
    assert abs(abs(middle[0]) - np.pi) < 1e-9


@pytest.mark.parametrize("names", ["pressure", "tilt", "azimuth", "tilt azimuth", "pressure rotation"])
def test_channels_come_back_from_the_point_they_are(names):
    rng = np.random.default_rng(1)
    channels = {n: rng.uniform(0.1, 1.0, 9) for n in names.split()}
    back = extract_channels(embed_channels(channels), channels)
    assert back.keys() == channels.keys()
    for name, values in channels.items():
        np.testing.assert_allclose(back[name], values)


def test_a_file_comes_back(pose):
    again = load(Path("a.pose"), to_bytes(pose))
    assert (again.title, again.unit, again.lengths.tolist()) == (pose.title, pose.unit, pose.lengths.tolist())
    np.testing.assert_allclose(again.xy, pose.xy, atol=0.01)
    for name, values in pose.channels.items():
        np.testing.assert_allclose(again.channels[name], values, atol=1e-3)


def test_damaged_files_are_named(pose, tmp_path):
    data = to_bytes(pose)
    for wrong in (b"", b"PK", data[:200], data[:-30]):
        with pytest.raises(InputError, match=r"a\.pose cannot be used"):
            load(Path("a.pose"), wrong)
    with pytest.raises(InputError, match="cannot be read"):
        load(tmp_path / "none.pose")


def test_strokes_longer_than_any_page_are_refused(pose):
    with pytest.raises(InputError, match="longer than any page"):
        load(Path("a.pose"), to_bytes(replace(pose, unit=9_000.0)))


def test_a_later_version_is_named(pose, monkeypatch):
    monkeypatch.setattr(libraries, "_VERSION", 2)
    data = to_bytes(pose)
    monkeypatch.undo()
    with pytest.raises(InputError, match="version 2, and this program reads handout-pose version 1"):
        load(Path("a.pose"), data)


def test_what_was_recorded_twice_is_kept_once():
    learned = learn([recorded([1, 2, 3]), recorded([3, 4])])
    assert len(learned.library.lengths) == 4
    assert learned.notes == ("1 stroke recorded twice: kept once.",)


def test_missing_channels():
    learned = learn([recorded([1, 2], tilt=None, azimuth=None, rotation=None)])
    assert list(learned.library.channels) == ["pressure"]
    made = pose_drawing(recorded([7]), PoseModel(learned.library)).strokes[0]
    assert made.pressure is not None and made.tilt is None and made.rotation is None


def test_constant_pressure_is_left_out():
    learned = learn([recorded([1, 2], pressure=np.full(60, 0.5))])
    assert list(learned.library.channels) == ["tilt", "azimuth", "rotation"]
    assert "The pressure never changes" in learned.notes[0]
    with pytest.raises(InputError, match=r"no pose to learn from these recordings\. The pressure never changes"):
        learn([recorded([1], pressure=np.full(60, 0.5), tilt=None, azimuth=None, rotation=None)])


def test_nothing_to_learn_is_named():
    with pytest.raises(InputError, match="neither pressure nor tilt"):
        learn([recorded([1], pressure=None, tilt=None, azimuth=None, rotation=None)])
    with pytest.raises(InputError, match="no stroke"):
        learn([Drawing((), PAGE)])


def test_a_library_of_one_stroke():
    library = learn([recorded([1])]).library
    for method, passes in product(POSE_METHODS, (0, 1, 2)):
        made = pose_drawing(recorded([5, 6]), PoseModel(library), method, passes=passes)
        assert len(made.strokes) == 2 and all(np.isfinite(s.pressure).all() for s in made.strokes)


@pytest.mark.slow
def test_a_library_of_ten_thousand_strokes():
    rng = np.random.default_rng(0)
    lengths = np.full(10_000, 4)
    library = PoseLibrary(
        np.cumsum(rng.normal(size=(40_000, 2)), axis=0), {"pressure": rng.random(40_000)}, lengths, 0.2
    )
    xy = np.cumsum(rng.normal(size=(30, 2)), axis=0)
    assert len(PoseModel(library).pose(xy)) == 30


def test_a_dot_gets_a_pose(pose):
    dot = Drawing((Stroke(np.array([0.0, 0.1]), np.array([[5.0, 5.0], [5.0, 5.001]])),), PAGE)
    for passes in (0, 1, 2):
        assert pose_drawing(dot, PoseModel(pose), passes=passes, height=3.0).strokes[0].pressure is not None


def test_a_straight_line_of_two_points_gets_samples_enough(pose):
    line = Drawing((Stroke(np.array([0.0, 1.0]), np.array([[5.0, 5.0], [25.0, 5.0]])),), PAGE)
    made = pose_drawing(line, PoseModel(pose), height=3.0).strokes[0]
    assert len(made.t) > 60
    np.testing.assert_allclose(made.xy[:, 1], 5.0)


def test_the_place_on_the_page_can_be_taken_out():
    rng = np.random.default_rng(2)
    xy = rng.uniform(0, 500, (400, 2))
    noise = 0.01 * rng.normal(size=400)
    x, y = xy.T / 500
    library = PoseLibrary(xy, {"rotation": 3.0 + 0.8 * x + 0.3 * y * y + noise}, np.full(10, 40), 0.2)
    level = level_pose(library).channels["rotation"]
    assert level.std() < 0.012
    assert level.mean() == pytest.approx(library.channels["rotation"].mean(), abs=0.01)


def test_a_stylised_stroke_is_held_at_its_anchors_and_keeps_the_movement():
    n = 80
    xy = np.column_stack([np.arange(n), np.zeros(n)]).astype(float)
    velocity = np.column_stack([np.ones(n), 0.3 * np.sin(np.arange(n) / 3) + 0.05])
    at = anchors(xy)
    made = shape_stroke(xy, velocity, at)
    drift = np.cumsum(velocity, axis=0)[-1, 1]
    assert abs(drift) > 3 > 1.5 > np.abs(made[at, 1]).max()
    assert np.corrcoef(np.diff(made[:, 1]), velocity[1:, 1])[0, 1] > 0.95


def test_the_least_squares_are_those_of_the_text():
    rng = np.random.default_rng(3)
    n = 12
    xy, velocity, at = rng.normal(size=(n, 2)), rng.normal(size=(n, 2)), np.array([0, 4, 11])
    rows, right = [], []
    for i in range(1, n):
        rows.append(np.eye(n)[i] - np.eye(n)[i - 1])
        right.append(velocity[i])
    for i in at:
        rows.append(0.5 * np.eye(n)[i])
        right.append(0.5 * xy[i])
        for j in range(max(i - 2, 1), min(i + 3, n - 1)):
            rows.append(np.sqrt(2) * (np.eye(n)[j - 1] - 2 * np.eye(n)[j] + np.eye(n)[j + 1]))
            right.append(np.sqrt(2) * (velocity[j + 1] - velocity[j]))
    dense = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
    np.testing.assert_allclose(shape_stroke(xy, velocity, at), dense, atol=1e-9)


def test_sharp_turns_and_curves_are_anchored():
    along, down = np.arange(30.0), np.arange(1.0, 30.0)
    corner = np.concatenate([np.column_stack([along, 0 * along]), np.column_stack([0 * down + 29, down])])
    at = anchors(corner)
    assert at.tolist() == [3, 29, 55]
    circle = 20 * np.column_stack([np.cos(np.linspace(0, 6, 120)), np.sin(np.linspace(0, 6, 120))])
    assert len(anchors(circle)) > 4
    assert len(anchors(np.zeros((1, 2)))) == 1


def test_unknown_methods_and_empty_drawings_are_named(pose):
    with pytest.raises(InputError, match="optimal, average, closest"):
        pose_drawing(recorded([1]), PoseModel(pose), "best")
    with pytest.raises(InputError, match="no stroke"):
        pose_drawing(Drawing((), PAGE), PoseModel(pose))


def test_a_flat_nib_keeps_its_edge(pose):
    stroke = replace(recorded([5]).strokes[0], nib=1.5, rotation=np.full(60, -0.7))
    nib = Drawing((stroke,), PAGE)
    made = pose_drawing(nib, PoseModel(pose)).strokes[0]
    assert made.nib == 1.5 and set(made.rotation.tolist()) == {-0.7} and np.ptp(made.pressure) > 0.1
