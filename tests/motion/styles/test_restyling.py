"""Drawings in other handstyles: their shape, their clock, what closes, and the drawings that hardly are any."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from handout.errors import InputError
from handout.motion.optimal_control import follow
from handout.motion.styles import broken_script, movement, style, targets
from handout.motion.styles.restyling import angle, join_targets, restyle
from handout.tables import Angle
from handout.values import ActionPlan, Drawing, Page, Stroke

PAGE = Page(100.0, 80.0)
STYLES = ("blackletter", "calm", "chancery", "fast-tag", "scrawl")


def stroke(xy, **notes):
    xy = np.asarray(xy, dtype=float)
    return Stroke(np.arange(len(xy)) * 0.01, xy, **notes)


def ring(radius=15.0, stretch=1.0, gap=0.0):
    a = np.linspace(-1.4, 2 * np.pi - 1.4 - gap, 150)
    return stroke(50 + radius * np.column_stack([stretch * np.cos(a), np.sin(a)]))


def restyled(drawing, name, seed=0, **changed):
    plain = style.find(name)
    given = {table: replace(getattr(plain, table), **values) for table, values in changed.items()}
    return restyle(drawing, replace(plain, **given), np.random.default_rng(seed))


def letters():
    """An n and a bar, as one hand draws them."""
    arch = np.array([[10, 20], [10, 30], [10, 40], [14, 27], [20, 21], [24, 30], [25, 40]], dtype=float)
    _, xy = follow(ActionPlan(arch, 0.1, 0.3))
    return Drawing((stroke(xy), stroke([[35, 20], [36, 40]])), PAGE)


@pytest.mark.parametrize("name", STYLES)
def test_has_times_widths_and_the_same_bytes_for_the_same_seed(name):
    from handout.sinks.svg import to_svg

    first, again = (restyled(letters(), name, seed=4, jitter={"size": 0.02}) for _ in range(2))
    assert to_svg(first) == to_svg(again)
    assert to_svg(first) != to_svg(restyled(letters(), name, seed=5, jitter={"size": 0.02}))
    clock = [s.t[[0, -1]].tolist() for s in first.strokes]
    assert all(a[1] < b[0] for a, b in pairwise(clock))
    assert all(s.width is not None and (s.width > 0).all() for s in first.strokes)
    assert first.about["style"] == name and first.timed


@pytest.mark.parametrize("name", STYLES)
@pytest.mark.parametrize("gap", [0.0, 0.15, -0.3])
def test_the_o_closes_in_every_style(name, gap):
    """The letter that the paper calls hard: where it ends lies on where it began, far within the width of its line."""
    made = restyled(Drawing((ring(gap=gap, stretch=0.8),), PAGE), name).strokes[0]
    away = np.linalg.norm(made.xy[: len(made.xy) // 2] - made.xy[-1], axis=1).min()
    assert away < 0.05 * float(np.max(made.width)) and away < 0.1


def test_a_calm_ring_is_round():
    made = restyled(Drawing((ring(),), PAGE), "calm", form={"stretch": 1.0}).strokes[0]
    radius = np.linalg.norm(made.xy - 50, axis=1)
    assert np.abs(radius / 15 - 1).max() < 0.03


def test_an_open_c_stays_open():
    made = restyled(Drawing((ring(gap=1.2),), PAGE), "calm").strokes[0]
    assert np.linalg.norm(made.xy[-1] - made.xy[0]) > 10


def test_blackletter_has_few_directions_and_calm_has_many():
    def share(name):
        made = restyled(Drawing((ring(),), PAGE), name).strokes[0]
        step = np.diff(made.xy, axis=0)
        size = np.hypot(*step.T)
        turned = np.degrees(np.arctan2(-step[:, 1], step[:, 0])) % 180
        near = (np.abs(turned[:, None] - [90, 38, 138]) < 4).any(axis=1)
        return float(size[near].sum() / size.sum())

    assert share("blackletter") > 0.9 and share("calm") < 0.3


def test_a_nib_is_thick_across_its_edge_and_thin_along_it():
    plain = style.find("chancery")
    t = np.linspace(0, 1, 50)
    along = np.outer(t, [np.cos(plain.brush.angle), -np.sin(plain.brush.angle)])
    across = along[:, ::-1] * [1, -1]
    thin, thick = (movement.widths(t, 10 * way, plain, 20.0) for way in (along, across))
    assert thick == pytest.approx(plain.brush.width * 20, rel=0.01)
    assert thin.max() < 0.12 * thick.min()


def test_speed_makes_thin_and_pull_makes_thick():
    t = np.linspace(0, 1, 200)
    tag = replace(style.find("fast-tag"), brush=replace(style.find("fast-tag").brush, taper=0.0))
    width = movement.widths(t, np.column_stack([20 * t**3, 0 * t]), tag, 20.0)
    assert width[190] < 0.6 * width[20]
    pointed = replace(tag, brush=replace(tag.brush, kind="pointed"))
    down, up = (movement.widths(t, np.column_stack([0 * t, s * 20 * t]), pointed, 20.0) for s in (1, -1))
    assert down.mean() > 3 * up.mean()


@settings(max_examples=20)
@given(degrees=st.floats(-40, 40))
def test_shear_leans_uprights_and_keeps_heights(degrees):
    made = restyled(
        Drawing((stroke([[50, 30], [50, 50]]),), PAGE), "calm", form={"shear": Angle(np.radians(degrees)), "stretch": 1}
    )
    way = made.strokes[0].xy[-1] - made.strokes[0].xy[0]
    assert way[0] / way[1] == pytest.approx(-np.tan(np.radians(degrees)), abs=1e-6)
    assert way[1] == pytest.approx(20, abs=0.2)


def test_words_lean_about_their_own_lines():
    page = [stroke([[50, y], [50, y + 10]], word=n) for n, y in enumerate((10, 30, 50))]
    made = restyled(Drawing(tuple(page), PAGE), "calm", form={"shear": Angle(0.5), "stretch": 1})
    assert np.allclose([s.xy[:, 0].mean() for s in made.strokes], 50, atol=0.01)


def test_more_smoothing_cuts_corners():
    corner = Drawing((stroke([[20, 60], [40, 20], [60, 60]]),), PAGE)

    def missed(smooth):
        xy = restyled(corner, "calm", movement={"smooth": smooth, "drawn_at": 0.3}).strokes[0].xy
        return float(np.linalg.norm(xy - [40, 20], axis=1).min())

    assert missed(0.2) < missed(0.4) < missed(0.7)


@pytest.mark.slow
def test_jitter_has_the_asked_size():
    line = Drawing((stroke(np.column_stack([np.linspace(20, 80, 61), 40 + 8 * np.sin(np.linspace(0, 9, 61))])),), PAGE)
    plain = restyled(line, "calm").strokes[0].xy
    height = targets.letter_height(line)
    middle = len(plain) // 2 // 20 * 20 + 10
    moved = [restyled(line, "calm", seed, jitter={"size": 0.03}).strokes[0].xy[middle] for seed in range(200)]
    assert np.std(np.array(moved) - plain[middle], axis=0) == pytest.approx(0.03 * height, rel=0.2)


def test_covariances_are_tied_to_one_oblique_shape():
    tied = movement.covariances(np.zeros(40, dtype=bool), style.find("fast-tag"), np.random.default_rng(0), ends=1.0)
    assert np.allclose(tied, tied[0])
    loose = replace(style.find("fast-tag").covariance, spread=0.5)
    varied = movement.covariances(
        np.zeros(400, dtype=bool), replace(style.find("fast-tag"), covariance=loose), np.random.default_rng(0), 1.0
    )
    size = varied[:, 0, 0] / tied[0, 0, 0]
    assert np.allclose(varied, size[:, None, None] * tied[0]) and np.log(size).std() == pytest.approx(0.5, rel=0.1)
    assert (np.linalg.eigvalsh(varied) > 0).all()


def test_ligatures_drop_targets_on_a_nearly_straight_way():
    first, second = np.array([[0.0, 0], [0, 10], [3, 14]]), np.array([[6.0, 18], [9, 10], [9, 0]])
    points, kept = join_targets([first, second], np.radians(150))
    assert kept.tolist() == [True, True, False, True, True, True] and len(points) == 5
    assert join_targets([first, second], np.pi)[1].all()
    assert angle(first[0], first[1], first[2]) == pytest.approx(np.pi - np.arctan2(3, 4))


def test_neighbours_join_where_the_style_joins():
    page = Drawing((stroke([[10, 20], [12, 40]]), stroke([[14, 40], [16, 20]]), stroke([[60, 20], [62, 40]])), PAGE)
    assert len(restyled(page, "scrawl").strokes) == 2
    assert len(restyled(page, "calm").strokes) == 3


def test_targets_are_extremes_corners_and_ends():
    found = targets.find(ring().xy, 30.0)
    assert found.ring and len(found.points) == 4
    assert np.allclose(np.sort(np.linalg.norm(found.points - 50, axis=1)), 15, atol=0.3)
    assert np.allclose(np.abs(found.points - 50).min(axis=1), 0, atol=1.5)
    square = targets.find(np.array([[10.0, 10], [40, 10], [40, 40], [10, 40], [10, 10]]), 30.0)
    assert not square.ring and square.corner.sum() == 3


def test_broken_paths_end_where_paths_end():
    a = np.linspace(0, 2.5, 100)
    path = 20 * np.column_stack([np.cos(a), np.sin(a)])
    directions = np.array([movement.vector(np.radians(d)) for d in (90, 38, -42)])
    corners = broken_script.break_path(path, np.zeros(0, dtype=int), directions, 2.0)
    assert np.allclose(corners[[0, -1]], path[[0, -1]], atol=1e-9)
    assert 3 <= len(corners) <= 7


@pytest.mark.parametrize("name", STYLES)
def test_drawings_that_hardly_are_any(name):
    dots = Drawing((stroke([[10, 10]]), stroke([[20, 20], [20, 20]])), PAGE)
    made = restyled(dots, name)
    assert len(made.strokes) == 2 and all(len(s.t) == 2 for s in made.strokes)
    for xy in ([[10, 10], [30, 20]], [[10, 10], [10.001, 10]], [[10, 10], [20, 10], [10, 10], [20, 10]]):
        made = restyled(Drawing((stroke(xy),), PAGE), name)
        assert np.isfinite(made.strokes[0].xy).all() and len(made.strokes) == 1
    with pytest.raises(InputError, match="no stroke"):
        restyled(Drawing((), PAGE), name)


def test_a_huge_stroke_takes_linear_time():
    a = np.linspace(0, 900, 60_000)
    made = restyled(
        Drawing((stroke(50 + np.column_stack([a / 30 * np.cos(a), a / 30 * np.sin(a)])),), PAGE), "fast-tag"
    )
    assert len(made.strokes) == 1 and len(made.strokes[0].t) > 10_000


def test_what_was_on_the_page_stays_on_it():
    wide = Drawing((stroke([[1, 40], [50, 30], [99, 40]]),), PAGE)
    made = restyled(wide, "scrawl")
    low, high = np.array(made.bounds[:2]), np.array(made.bounds[2:])
    assert (low >= 0).all() and (high <= [100, 80]).all()


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), name=st.sampled_from(STYLES), smooth=st.floats(0.05, 1), jitter=st.floats(0, 0.2))
def test_never_fails(seed, name, smooth, jitter):
    rng = np.random.default_rng(seed)
    strokes = [stroke(50 + rng.normal(size=(int(n), 2)).cumsum(axis=0)) for n in rng.integers(1, 40, 3)]
    made = restyled(Drawing(tuple(strokes), PAGE), name, seed, movement={"smooth": smooth}, jitter={"size": jitter})
    assert all(np.isfinite(s.xy).all() for s in made.strokes) and made.strokes
