import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scribbles import coverage, lines_of, scan_of

from handout.scanning.density import find_density
from handout.scanning.inks import find_inks
from handout.scanning.mask import find_mask
from handout.scanning.matting import fill_smooth, find_matte, least_opaque

INK = coverage(lines_of(2, 60.0), 60.0, 32.0, 300.0)
GREEN, YELLOW = np.array([15, 60, 25]), np.array([245, 215, 60])


def lay_over(matte, colour):
    """(h, w, 3) uint8: the ink on paper of a colour (3,) or (h, w, 3), 0-255."""
    alpha = matte.rgba[:, :, 3:].astype(np.float32) / 255
    return np.rint(matte.rgba[:, :, :3] * alpha + np.asarray(colour, dtype=np.float32) * (1 - alpha)).astype(np.uint8)


def matte_of(scan):
    inks = find_inks(scan)
    return find_matte(scan, find_mask(scan, inks, find_density(scan, inks)), inks)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6))
def test_any_colour_on_any_paper_comes_back(seed):
    rng = np.random.default_rng(seed)
    colour, paper = rng.integers(0, 256, (2, 200, 3), dtype=np.uint8)
    paper[:20], colour[20:40] = rng.choice([0, 255], (20, 3)), rng.choice([0, 255], (20, 3))
    colour[40:60] = paper[40:60]
    rgba = least_opaque(colour, paper).astype(float)
    alpha = rgba[:, 3:] / 255
    assert np.abs(rgba[:, :3] * alpha + paper * (1 - alpha) - colour).max() <= 1
    assert (rgba[40:60, 3] == 0).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_no_less_opaque_ink_would_do(seed):
    rng = np.random.default_rng(seed)
    colour, paper = rng.integers(0, 256, (2, 50, 3), dtype=np.uint8)
    alpha = least_opaque(colour, paper)[:, 3:].astype(float)
    less = np.maximum(alpha - 2, 1) / 255
    ink = (colour - (1 - less) * paper) / less
    assert (((ink < -1e-6) | (ink > 255 + 1e-6)).any(axis=1) | (alpha[:, 0] <= 2)).all()


@pytest.mark.slow
@pytest.mark.parametrize("level", [0.97, 0.80])
@pytest.mark.parametrize("noise", [0.002, 0.02])
def test_scan_comes_back_and_no_halo(level, noise):
    scan = scan_of(INK, paper=level, noise=noise)
    matte = matte_of(scan)
    assert np.abs(lay_over(matte, matte.paper).astype(int) - scan.rgb).max() <= 1
    inky = matte.rgba[:, :, 3] > 0
    for ground in (GREEN, YELLOW):
        # ink scaled from its paper is blue and dark: nothing may come out lighter than the new paper all over
        lighter = (lay_over(matte, ground).astype(int) > ground + 1).all(axis=2)
        assert not lighter[inky].any()
    far = np.zeros_like(inky)
    far[:, :20] = True
    assert (matte.rgba[far][:, 3] == 0).all()


def test_grey_ink_on_green_is_never_lighter():
    scan = scan_of(INK, colour=(0.2, 0.2, 0.2), noise=0.003)
    matte = matte_of(scan)
    for ground in (GREEN, YELLOW):
        assert ((lay_over(matte, ground).astype(int) - ground).sum(axis=2) <= 3 * 12).all()
    assert matte.rgba[INK > 0.9][:, 3].min() > 150


def test_light_ink_on_dark_paper():
    ground = np.full((*INK.shape, 3), 0.2)
    mixed = ground * (1 - INK[:, :, None]) + 0.9 * INK[:, :, None]
    base = scan_of(np.zeros_like(INK), paper=mixed, noise=0.005)
    matte = matte_of(base)
    assert np.abs(lay_over(matte, matte.paper).astype(int) - base.rgb).max() <= 1
    # no pixel darker than the new paper where the ink is lighter
    assert not (lay_over(matte, np.array([60, 60, 60])).astype(int) < 59).any()


def test_smooth_filling_follows_the_paper():
    y, x = np.mgrid[:120, :160]
    ramp = np.stack([200 - x // 4, 180 - y // 4, np.full_like(x, 150)], axis=2).astype(np.uint8)
    hole = np.zeros((120, 160), dtype=np.uint8)
    hole[40:60, 30:120] = 1
    spoilt = ramp.copy()
    spoilt[hole > 0] = 0
    assert np.abs(fill_smooth(spoilt, hole).astype(int) - ramp)[hole > 0].max() <= 8
    assert np.array_equal(fill_smooth(spoilt, hole)[hole == 0], ramp[hole == 0])
