from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.inking import flow, pens, plain
from handout.inking.flow import Flow
from handout.inking.pen import PENS, TEXTURED, Pen, usual
from handout.values import Array, Drawing, Page, Stroke

PAGE = Page(24, 12, "slip")
REAL = [name for name in PENS if name != "plain"]


def test_every_pen_has_a_model():
    assert set(pens._MODELS) == set(PENS) - {"plain"} >= set(TEXTURED)


def line(y: float, pressure: float | None = 0.55, speed: float = 20.0, length: float = 18.0) -> Stroke:
    t = np.linspace(0, length / speed, 60)
    xy = np.stack([3 + speed * t, np.full(60, y)], axis=1)
    return Stroke(t, xy, pressure=None if pressure is None else np.full(60, pressure))


def zigzag() -> Stroke:
    """Comes to rest at both ends and at the turn in the middle, as a hand does."""
    u = (1 - np.cos(np.linspace(0, np.pi, 80))) / 2
    there = np.stack([3 + 15 * u, 3 + 2 * u], axis=1)
    back = np.stack([18 - 15 * u, 5 + 4 * u], axis=1)[1:]
    return Stroke(np.linspace(0, 1.6, 159), np.concatenate([there, back]), pressure=np.full(159, 0.55))


def drawn(*strokes: Stroke) -> Drawing:
    clock, moved = 0.0, []
    for stroke in strokes:
        moved.append(replace(stroke, t=stroke.t + clock))
        clock = float(moved[-1].t[-1]) + 1
    return Drawing(tuple(moved), PAGE, {"seed": 3, "page_number": 1})


def rng(seed: int = 5) -> np.random.Generator:
    return np.random.default_rng(seed)


def darkness(drawing: Drawing, model: str, dpi: float = 300, seed: int = 5) -> Array:
    """(h, w) in 0–1: 1 where no light comes back."""
    return 1 - pens.image(drawing, dpi, usual(model), rng(seed)).mean(axis=2) / 255


@pytest.mark.slow
@pytest.mark.parametrize("model", REAL)
def test_same_at_any_resolution(model: str) -> None:
    drawing = drawn(line(3, 0.4), line(6, 0.6), zigzag())
    means = [darkness(drawing, model, dpi).mean() for dpi in (300, 600, 1200)]
    assert means == pytest.approx([means[1]] * 3, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("model", REAL)
def test_gaps_are_in_the_same_places_at_any_resolution(model: str) -> None:
    drawing = drawn(line(3, 0.4), line(6, 0.6), zigzag())
    coarse, fine = darkness(drawing, model, 254), darkness(drawing, model, 508)
    boxed = fine.reshape(120, 2, 240, 2).mean(axis=(1, 3))
    inked = (coarse > 0.05) | (boxed > 0.05)
    assert np.abs(coarse - boxed)[inked].mean() < 0.04
    other = darkness(drawing, model, 254, seed=6)
    assert np.abs(coarse - boxed).mean() < np.abs(coarse - other).mean()


@pytest.mark.slow
@pytest.mark.parametrize("model", REAL)
def test_same_noise_same_pixels_and_other_noise_others(model: str) -> None:
    drawing = drawn(line(3), zigzag())
    first, second = (pens.image(drawing, 300, usual(model), pens.noise(drawing.about)) for _ in range(2))
    assert np.array_equal(first, second)
    other = pens.image(drawing, 300, usual(model), pens.noise({"seed": 4, "page_number": 1}))
    assert not np.array_equal(first, other)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["ballpoint", "fountain", "pencil"])
def test_pressure_gives_more_ink(model: str) -> None:
    # each is the mean of the same noise, so that only pressure differs
    shares = [darkness(drawn(line(6, p)), model).mean() for p in (0.2, 0.4, 0.6, 0.8, 1.0)]
    assert (np.diff(shares) > 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("model", ["ballpoint", "fineliner", "fountain", "pencil"])
def test_speed_gives_less_ink(model: str) -> None:
    shares = [darkness(drawn(line(6, 0.55, speed)), model).mean() for speed in (4, 12, 30, 90)]
    assert (np.diff(shares) < 0).all()


@pytest.mark.slow
@given(low=st.floats(0, 1), high=st.floats(0, 1), slow=st.floats(1, 200), fast=st.floats(1, 200))
@settings(deadline=None, max_examples=15)
def test_width_and_load_follow_pressure_and_speed(low: float, high: float, slow: float, fast: float) -> None:
    low, high = sorted((low, high))
    slow, fast = sorted((slow, fast))
    given = Flow(width_pressure=0.5, width_speed=0.1, load_pressure=0.9, load_speed=0.2)
    light, heavy = (flow.pieces(drawn(line(6, p)), 0.4, given, rng()) for p in (low, high))
    assert (light.radius <= heavy.radius + 1e-9).all() and (light.load <= heavy.load + 1e-9).all()
    calm, swift = (flow.pieces(drawn(line(6, 0.5, v)), 0.4, given, rng()) for v in (slow, fast))
    assert (swift.radius <= calm.radius + 1e-9).all() and (swift.load <= calm.load + 1e-9).all()


@pytest.mark.slow
@pytest.mark.parametrize("model", ["ballpoint", "fineliner", "fountain"])
def test_ink_pools_where_the_pen_turns(model: str) -> None:
    dark = np.mean([darkness(drawn(zigzag()), model, 300, seed) for seed in range(4)], axis=0)
    at = 300 / 25.4
    turn = dark[round(4.5 * at) : round(5.6 * at), round(17.4 * at) : round(18.4 * at)].max()
    middle = dark[round(3.4 * at) : round(4.6 * at), round(9.5 * at) : round(11.5 * at)]
    assert turn > np.median(middle.max(axis=0)) + 0.02


def test_strokes_end_in_pools_of_a_fineliner() -> None:
    mass = flow.pieces(drawn(zigzag()), 0.4, Flow(pool=1.5, bleed=0.3), rng())
    middle = len(mass.load) // 4
    assert mass.load[0] > 1.3 * mass.load[middle] and mass.load[-1] > 1.3 * mass.load[middle]
    assert mass.radius[0] > mass.radius[middle]


def test_a_fineliner_s_line_lives() -> None:
    """Its width and ink follow direction, speed and pressure; on a scan of a wet pen widths vary by 19 %."""
    slow, fast = line(3, None, speed=8.0), line(6, None, speed=60.0)
    t = np.linspace(0, 1, 60)
    down, up = (
        Stroke(t, np.stack([x + 4 * t * slope, y + way * 6 * t], axis=1))
        for x, slope, y, way in ((4, -0.9, 3, 1), (6, 0.9, 9, -1))
    )
    leaving = replace(line(9), pressure=np.r_[np.full(45, 0.55), np.linspace(0.55, 0.05, 15)])
    given = pens._MODELS["fineliner"].flow
    made = [flow.pieces(drawn(stroke), 0.36, given, rng()) for stroke in (slow, fast, down, up, leaving)]
    wide, full = ([float(np.median(getattr(one, name))) for one in made] for name in ("radius", "load"))
    assert wide[0] > 1.08 * wide[1] and full[0] > 1.15 * full[1]  # slow against fast
    assert abs(wide[2] / wide[3] - 1) > 0.08  # the tip is worn to a facet
    assert (
        made[4].radius[-4:].mean() < 0.9 * wide[4] and made[4].load[-4:].mean() < 0.7 * full[4]
    )  # it leaves in flight
    every = np.concatenate([one.radius for one in made])
    assert 0.08 < every.std() / every.mean() < 0.3


def resting(length: float = 12.0, y: float = 6.0) -> Stroke:
    """Sets out from rest and comes to rest, its pressure dwindling as that of a pen that is lifted."""
    u = (1 - np.cos(np.linspace(0, np.pi, 90))) / 2
    xy = np.stack([4 + length * u, np.full(90, y)], axis=1)
    return Stroke(np.linspace(0, 0.9, 90), xy, pressure=np.minimum(0.55, 0.1 + 4 * np.linspace(0.9, 0, 90)))


def test_a_fineliner_marks_where_it_lands_and_where_it_stays() -> None:
    mass = flow.pieces(drawn(*[resting(y=y) for y in np.linspace(1, 11, 40)]), 0.4, Flow(touch=0.3, stays=0.5), rng())
    wide, full = mass.radius.reshape(40, -1), mass.load.reshape(40, -1)
    middle = wide[:, wide.shape[1] // 2]
    landed, stayed = wide[:, 0] > 1.08 * middle, wide[:, -1] > 1.08 * middle
    assert 0.6 < landed.mean() < 0.95  # not every time
    assert 0.3 < stayed.mean() < 0.7 and full[stayed, -1].min() > full[:, full.shape[1] // 2].mean()
    flown = replace(line(6), pressure=np.r_[np.full(45, 0.55), np.linspace(0.55, 0.05, 15)])
    made = flow.pieces(drawn(*[flown] * 30), 0.4, Flow(touch=0.3, stays=1.0), rng()).radius.reshape(30, -1)
    assert (made[:, -1] == pytest.approx(0.2)) and made[:, 0].max() > 0.22  # it was not at rest when it was lifted


def test_a_fast_fineliner_skips_and_its_ink_is_not_even_from_word_to_word() -> None:
    calm, swift = (
        flow.pieces(drawn(*[line(y, 0.55, v) for y in np.linspace(1, 11, 60)]), 0.4, Flow(skip=0.7), rng()).load
        for v in (10.0, 60.0)
    )
    assert (calm < 0.6).mean() < 0.002 < (swift < 0.6).mean() < 0.08
    words = flow.pieces(drawn(*[line(6)] * 200), 0.4, Flow(level=0.15), rng()).load
    assert np.log(words).std() == pytest.approx(0.15, rel=0.25)
    assert np.abs(np.diff(np.log(words))).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("model", REAL)
def test_crossing_is_darker_than_either_line(model: str) -> None:
    up = replace(line(0), xy=np.stack([np.full(60, 12.0), np.linspace(10, 2, 60)], axis=1))
    dark = [darkness(drawn(*strokes), model, 300, 1) for strokes in ([line(6), up], [line(6)])]
    at = 300 / 25.4
    spot = np.s_[round(5.9 * at) : round(6.1 * at), round(11.9 * at) : round(12.1 * at)]
    assert dark[0][spot].mean() > dark[1][spot].mean() + 0.02


def test_noise_has_the_size_it_says() -> None:
    many = [line(float(y), 0.55, 20.0) for y in np.linspace(1, 11, 120)]
    rough = flow.pieces(drawn(*many), 0.4, Flow(drift=0.2, ragged=0.02), rng())
    assert np.log(rough.load).std() == pytest.approx(0.2, rel=0.2)
    edges = rough.radius - (rough.b.imag + rough.a.imag) / 2 + np.round((rough.a.imag) * 11.9) / 11.9
    assert edges.std() > 0 and rough.radius.std() == pytest.approx(0.02 / np.sqrt(2), rel=0.15)


def test_a_nib_draws_thin_along_its_edge() -> None:
    slope = -0.7
    along, across = (
        Stroke(np.array([0.0, 0.5]), np.array([[8, 6], [8 + 4 * np.cos(a), 6 + 4 * np.sin(a)]]))
        for a in (slope, slope + np.pi / 2)
    )
    thin, wide = (flow.pieces(drawn(s), 0.5, Flow(nib=0.3, slope=slope), rng()).radius[10] for s in (along, across))
    assert thin == pytest.approx(0.7 * wide, rel=0.01) and wide == pytest.approx(0.25, rel=0.01)


def test_own_width_of_a_stroke_is_kept() -> None:
    stroke = replace(line(6), width=np.full(60, 0.8))
    assert np.allclose(flow.pieces(drawn(stroke), 0.3, Flow(width_pressure=1.0, bleed=0.5), rng()).radius, 0.4)


@pytest.mark.slow
@pytest.mark.parametrize("model", PENS)
def test_raster_over_white_is_the_image(model: str) -> None:
    drawing = drawn(line(4), zigzag())
    raster = pens.ink(drawing, 200, usual(model), rng())
    rgba = raster.rgba / 255
    alpha = rgba[..., 3:]
    over = np.rint((1 - alpha + alpha * rgba[..., :3]) * 255)
    assert np.abs(over - pens.image(drawing, 200, usual(model), rng())).max() <= 1
    assert not raster.rgba[alpha[..., 0] == 0].any() and (alpha == 0).mean() > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("model", PENS)
def test_paper_without_ink_is_unchanged_and_ink_filters_it(model: str) -> None:
    drawing = drawn(line(6))
    height, width = plain.shape(drawing, 200, 0.3)
    paper = rng().integers(0, 256, (height, width, 3), dtype=np.uint8)
    kept = paper.copy()
    light = np.ones((height * width, 3))
    for at, passed in pens.pass_light(drawing, 200, usual(model), rng(2)):
        light[at] = passed
    bare = (light == 1).all(axis=1).reshape(height, width)
    on = pens.image(drawing, 200, usual(model), rng(2), paper)
    assert np.array_equal(paper, kept) and bare.any() and not bare.all()
    assert np.array_equal(on[bare], paper[bare])
    assert np.abs(on - paper * light.reshape(paper.shape)).max() <= 0.501
    assert (pens.image(drawing, 200, usual(model), rng(2), np.zeros_like(paper)) == 0).all()


@pytest.mark.parametrize("model", REAL)
def test_ink_is_of_the_colour_asked_for(model: str) -> None:
    pen = Pen(1.2, "#c02040", model)
    image = pens.image(drawn(line(6, 0.55)), 300, pen, rng())
    core = image[round(5.8 * 11.81) : round(6.2 * 11.81), 80:200].reshape(-1, 3).mean(axis=0)
    assert core[0] > 2 * core[1] and core == pytest.approx([0xC0, 0x20, 0x40], abs=50)


def test_dots_and_pages_without_strokes() -> None:
    dot = Stroke(np.array([0.0]), np.array([[12.0, 6.0]]))
    for model in REAL:
        assert darkness(drawn(dot), model)[65:77, 136:148].max() > 0.3
        assert not darkness(Drawing((), PAGE), model).any()
    beyond = replace(line(6), xy=line(6).xy + np.array([500.0, -80.0]))
    assert not darkness(drawn(beyond), "ballpoint").any()


@pytest.mark.parametrize(("width", "colour", "model"), [(0, "#000", "plain"), (0.3, "red", "plain"), (0.3, "#000", "")])
def test_refuses_a_pen_that_there_is_not(width: float, colour: str, model: str) -> None:
    with pytest.raises(InputError):
        Pen(width, colour, model)


def test_refuses_resolutions() -> None:
    with pytest.raises(InputError, match="dpi"):
        pens.image(drawn(line(6)), 5, usual("pencil"), rng())


@pytest.mark.parametrize("model", ["ballpoint", "fineliner", "fountain", "pencil"])
def test_a_dot_that_only_rests_is_seen(model):
    stroke = Stroke(np.array([0.0, 0.1]), np.array([[5.0, 5.0], [5.0, 5.0]]))
    page = pens.image(Drawing((stroke,), Page(10.0, 10.0)), 300, usual(model), np.random.default_rng(1))
    assert page.min() < 190


@pytest.mark.parametrize("model", ["fountain", "ballpoint", "fineliner", "pencil"])
def test_a_flat_nib_leaves_the_marks_of_its_edge(model: str) -> None:
    t = np.linspace(0, 1, 60)
    angle = -np.pi / 4
    across = Stroke(t, np.column_stack([10 + 6 * t, 10 + 6 * t]), rotation=np.full(60, angle), nib=4.0)
    along = Stroke(2 + t, np.column_stack([20 + 6 * t, 16 - 6 * t]), rotation=np.full(60, angle), nib=4.0)
    drawing = Drawing((across, along), Page(40, 30))
    cover = pens.ink(drawing, 150, Pen(0.4, "#202020", model), rng()).rgba[..., 3] > 51
    scale = 150 / 25.4
    yy, xx = np.nonzero(cover)
    x, y = (xx + 0.5) / scale, (yy + 0.5) / scale
    down, up = (x + y - 20) / np.sqrt(2), (x - y) / np.sqrt(2)
    first = x < 18.5
    # square ends: the mark is as long as the way, and as wide as the edge
    assert down[first].min() > -0.6 and down[first].max() < 6 * np.sqrt(2) + 0.6
    assert np.ptp(up[first]) == pytest.approx(4.0, abs=0.6)
    assert np.ptp(down[~first]) < 1.2


@pytest.mark.parametrize(
    ("given", "colour"),
    [("navy", "#000080"), (" RebeccaPurple ", "#663399"), ("rgb(1, 2, 255)", "#0102ff"), ("#AbC", "#AbC")],
)
def test_inks_go_by_the_names_that_css_has(given: str, colour: str) -> None:
    assert usual("ballpoint", colour=given).colour == colour


@pytest.mark.parametrize("given", ["transparent", "#00008000", "rgba(0, 0, 0, 10)", "nayv", "", "rgb(300, 0, 0)"])
def test_what_is_no_ink_is_refused_in_a_sentence(given: str) -> None:
    with pytest.raises(InputError, match=r"colour: .* (is not a colour|can be seen through)") as error:
        usual("ballpoint", colour=given)
    assert "navy" in str(error.value) and "\n" not in str(error.value)
