from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError
from handout.inking import plain
from handout.values import Array, Drawing, Page, Stroke

SQUARE = Page(20, 20, "square")


def line(angle: float, length: float = 10.0, t0: float = 0.0, **channels: Array) -> Stroke:
    """An evenly written line through the middle of the page."""
    t = np.linspace(0, 1, 21)
    along = np.array([math.cos(angle), math.sin(angle)])
    return Stroke(t0 + t, 10.03 + (t[:, None] - 0.5) * length * along, **channels)


def drawn(*strokes: Stroke) -> Drawing:
    return Drawing(strokes, SQUARE)


def area(cover: Array, dpi: float) -> float:
    """mm² of ink."""
    return float(cover.sum()) / 255 * (25.4 / dpi) ** 2


@pytest.mark.parametrize("dpi", [72, 150, 300, 600])
@pytest.mark.parametrize("angle", [0.0, 0.3, math.pi / 4, 1.3, math.pi / 2])
@pytest.mark.parametrize("width", [0.2, 0.5, 1.5])
def test_covers_the_area_of_the_line(dpi: float, angle: float, width: float) -> None:
    cover = plain.coverage(drawn(line(angle)), dpi, width=width, variation=0)
    expected = 10 * width + math.pi * width**2 / 4
    # a line thinner than a pixel has ends that are less than round
    assert area(cover, dpi) == pytest.approx(expected, rel=0.01 if width * dpi > 25.4 else 0.03)


def test_is_as_good_as_much_finer_pixels() -> None:
    t = np.linspace(0, 1, 200)
    xy = np.stack([4 + 12 * t, 10 + 5 * np.sin(9 * t)], axis=1)
    drawing = drawn(Stroke(t, xy))
    coarse = plain.coverage(drawing, 127, width=0.45).astype(float)
    fine = plain.coverage(drawing, 127 * 8, width=0.45).astype(float)
    boxed = fine.reshape(100, 8, 100, 8).mean(axis=(1, 3))
    difference = np.abs(coarse - boxed)
    assert difference.max() < 255 * 0.08 and difference.mean() < 0.15  # the most in tight bends


@pytest.mark.parametrize("width", [0.3, 1.0])
def test_width_of_the_line_across(width: float) -> None:
    cover = plain.coverage(drawn(line(0.0)), 300, width=width, variation=0)
    across = cover[:, cover.shape[1] // 2].sum() / 255 * 25.4 / 300
    assert across == pytest.approx(width, abs=0.003)


def test_crossing_and_retracing_add_no_ink_of_their_own() -> None:
    one, other = line(0.4), line(1.9, t0=2.0)
    single = [plain.coverage(drawn(s), 300, variation=0) for s in (one, other)]
    assert np.array_equal(plain.coverage(drawn(one, other), 300, variation=0), np.maximum(*single))
    again = replace(one, t=one.t + 2, xy=one.xy[::-1])
    twice = plain.coverage(drawn(one, again), 300, variation=0)
    assert np.abs(twice.astype(int) - single[0]).max() <= 1


def test_order_of_strokes_does_not_matter() -> None:
    first, second = line(0.4), line(1.9, t0=2.0)
    swapped = drawn(replace(second, t=second.t - 2), replace(first, t=first.t + 2))
    assert np.array_equal(plain.coverage(drawn(first, second), 200), plain.coverage(swapped, 200))


@given(dx=st.integers(-30, 30), dy=st.integers(-30, 30))
def test_moves_with_the_drawing(dx: int, dy: int) -> None:
    dpi = 127.0
    there = line(0.7, length=6)
    moved = replace(there, xy=there.xy + np.array([dx, dy]) * 25.4 / dpi)
    before, after = (plain.coverage(drawn(s), dpi).astype(int) for s in (there, moved))
    assert np.abs(np.roll(before, (dy, dx), axis=(0, 1)) - after).max() <= 1


def test_dots_are_round_and_visible() -> None:
    dot = Stroke(np.array([0.0]), np.array([[10.0, 10.0]]))
    cover = plain.coverage(drawn(dot), 600, width=0.5, variation=0)
    assert area(cover, 600) == pytest.approx(math.pi * 0.25**2, rel=0.02)
    assert np.array_equal(cover, cover.T) and cover.max() == 255
    assert plain.coverage(drawn(dot), 72, width=0.2).max() > 60


def test_width_follows_the_samples() -> None:
    wide = np.linspace(0.2, 1.4, 21)
    cover = plain.coverage(drawn(line(0.0, width=wide)), 600)
    columns = [round((5.03 + 10 * part) * 600 / 25.4) for part in (0.25, 0.5, 0.75)]
    across = cover[:, columns].sum(axis=0) / 255 * 25.4 / 600
    assert np.allclose(across, [0.5, 0.8, 1.1], atol=0.01)


@given(lower=st.floats(0, 1), higher=st.floats(0, 1), width=st.floats(0.1, 2), variation=st.floats(0, 1))
def test_more_pressure_is_never_thinner(lower: float, higher: float, width: float, variation: float) -> None:
    press = np.sort([lower, higher])
    stroke = Stroke(np.arange(2.0), np.zeros((2, 2)), pressure=press)
    thin, thick = plain.widths(stroke, width, variation)
    assert 0 < thin <= thick
    assert width * (1 - variation) - 1e-12 <= thin or thin == 0.02


@given(slow=st.floats(0, 300), fast=st.floats(0, 300), variation=st.floats(0, 0.9))
def test_more_speed_is_never_wider(slow: float, fast: float, variation: float) -> None:
    slow, fast = sorted([slow, fast])
    thick, thin = (
        plain.widths(Stroke(np.arange(3.0), np.arange(6.0).reshape(3, 2) * v / math.sqrt(8)), 0.4, variation, 30)[1]
        for v in (slow, fast)
    )
    assert thin <= thick + 1e-12


def test_own_width_counts_before_pressure_and_pressure_before_speed() -> None:
    both = line(0, width=np.full(21, 0.7), pressure=np.full(21, 1.0))
    assert np.allclose(plain.widths(both, 0.4), 0.7)
    assert np.allclose(plain.widths(replace(both, width=None), 0.4, 0.2), 0.48)
    assert np.allclose(plain.widths(line(0), 0.4, 0.2, pace=10), 0.4)
    assert np.allclose(plain.widths(line(0), 0.4, 0), 0.4)


def test_what_lies_off_the_page_is_left_out() -> None:
    half = plain.coverage(drawn(line(0.0, length=60)), 200, width=1, variation=0)
    assert area(half, 200) == pytest.approx(20.0, rel=0.01)
    away = Stroke(np.arange(3.0), np.array([[-1e7, 5.0], [1e7, -1e7], [30.0, 1e7]]))
    assert plain.coverage(drawn(replace(away, xy=away.xy + 1e8)), 200).sum() == 0
    assert plain.coverage(drawn(away), 200).shape == (157, 157)


def test_raster_and_image_agree() -> None:
    drawing = drawn(line(0.4), line(1.9, t0=2.0))
    raster = plain.ink(drawing, 300, colour=(0.2, 0.3, 0.4))
    assert raster.rgba.shape == (236, 236, 4) and raster.dpi == 300 and raster.origin == (0.0, 0.0)
    inked = raster.rgba[..., 3] > 0
    assert (raster.rgba[inked, :3] == np.rint([51, 76.5, 102])).all() and not raster.rgba[~inked].any()
    paper = (0.9, 0.8, 1.0)
    image = plain.shades((0.2, 0.3, 0.4), paper)[plain.coverage(drawing, 300)]
    assert np.abs(plain.flatten(raster, paper).astype(int) - image).max() <= 1
    assert image[0, 0].tolist() == [230, 204, 255] and image.min(axis=(0, 1)).tolist() == [51, 76, 102]


def test_flatten_takes_any_raster() -> None:
    rgba = np.zeros((3, 4, 4), np.float32)
    rgba[1, 2] = 1.0, 0.0, 0.5, 0.5
    raster = plain.ink(drawn(), 300)
    assert (plain.flatten(raster) == 255).all()
    flat = plain.flatten(replace(raster, rgba=rgba.transpose(1, 0, 2), rows=None), (0.0, 0.0, 1.0))
    assert flat[2, 1].tolist() == [128, 0, 191] and flat[0, 0].tolist() == [0, 0, 255]


def test_same_pixels_every_time() -> None:
    drawing = drawn(line(0.4), line(1.9, t0=2.0))
    assert np.array_equal(plain.ink(drawing, 300).rgba, plain.ink(drawing, 300).rgba)


@pytest.mark.parametrize(
    "options, says",
    [
        ({"dpi": 10}, "dpi"),
        ({"dpi": 1e9}, "dpi"),
        ({"dpi": float("nan")}, "dpi"),
        ({"dpi": 300, "width": 0.0}, "pen width"),
        ({"dpi": 300, "variation": 1.5}, "variation"),
    ],
)
def test_refuses(options: dict[str, float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        plain.ink(drawn(line(0)), **options)


def test_refuses_pages_of_too_many_pixels() -> None:
    with pytest.raises(InputError, match="gigapixels"):
        plain.coverage(Drawing((), Page(2000, 2000)), 4800)
