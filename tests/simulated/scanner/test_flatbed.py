import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import InputError
from handout.simulated.flatbed import Flatbed, smooth_field
from handout.simulated.printer import Inkjet
from handout_lab.author.worn_flatbed import WornFlatbed, bends

IDEAL, WORN = Flatbed.ideal(), WornFlatbed.ideal()
DPI = 100


def rng(seed=0):
    return np.random.default_rng(seed)


def chequers(side=8, rows=30, columns=24):
    """A page of even squares of device RGB, and their colours."""
    colours = rng(4).integers(0, 256, (rows, columns, 3), dtype=np.uint8)
    return colours.repeat(side, axis=0).repeat(side, axis=1), colours


@pytest.fixture(scope="module")
def sheet():
    return Inkjet().print_page(chequers()[0], DPI)


@pytest.fixture(scope="module")
def plain():
    """A white sheet with a black square."""
    page = np.full((400, 300, 3), 255, dtype=np.uint8)
    page[150:250, 100:200] = 0
    return Inkjet().print_page(page, DPI)


@pytest.fixture(scope="module")
def wanted(sheet):
    return IDEAL.scan(sheet, DPI, rng())


def test_an_ideal_scan_shows_every_pixel_as_its_patch(sheet, wanted):
    page, _ = chequers()
    patches = Inkjet().scan_patches(page.reshape(-1, 3) / 255).reshape(page.shape)
    assert wanted.dtype == np.uint8 and wanted.shape == page.shape
    assert np.abs(wanted - 255 * patches).max() < 0.51
    deep = replace(IDEAL, bits=16).scan(sheet, DPI, rng())
    assert deep.dtype == np.uint16 and np.abs(deep / 65535 - patches).max() < 2e-5


@given(st.sampled_from([50, 75, 150, 200, 250]))
@settings(max_examples=5, deadline=None)
def test_patches_have_their_colour_at_any_resolution(dpi):
    page, colours = chequers(side=32, rows=6, columns=5)
    scanned = IDEAL.scan(Inkjet().print_page(page, DPI), dpi, rng())
    assert scanned.shape[:2] == (round(192 * dpi / DPI), round(160 * dpi / DPI))
    side = 32 * dpi / DPI
    at = [((np.arange(n) + 0.5) * side).astype(int) for n in colours.shape[:2]]
    patches = 255 * Inkjet().scan_patches(colours.reshape(-1, 3) / 255).reshape(colours.shape)
    assert np.abs(scanned[np.ix_(*at)] - patches).max() < 0.6


def test_the_same_state_is_the_same_picture_and_another_is_not(sheet):
    worn = WornFlatbed(shading=0.1, flare=0.05, glare=0.2, warp=1, dust=20, border=2, bits=16)
    one, same, other = (worn.scan(sheet, DPI, rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


@pytest.mark.parametrize(
    "change",
    [
        {"crosstalk": 0.2}, {"gamma": 1.8}, {"black": 0.1}, {"white": 0.8}, {"automatic": True}, {"blur": 0.3},
        {"noise": 0.02}, {"shading": 0.1}, {"flare": 0.1}, {"glare": 0.3}, {"rotation": 0.02}, {"offset": (1, 2)},
        {"warp": 2.0}, {"dust": 200.0}, {"grey": True}, {"jpeg": 30}, {"lid": 0.3, "border": 3}, {"crop": (1, 0, 0, 2)},
    ],
    ids=lambda change: next(iter(change)),
)  # fmt: skip
def test_every_parameter_shows(sheet, wanted, change):
    picture = replace(WORN, **change).scan(sheet, DPI, rng(7))
    assert picture.shape != wanted.shape or np.abs(picture.astype(int) - wanted).max() > 5


def dark(picture):
    return picture[..., 1] < 120


def middle(picture, dpi=DPI):
    return np.argwhere(dark(picture)).mean(axis=0)[::-1] * 25.4 / dpi


def test_the_sheet_lies_where_it_is_laid(plain):
    moved = replace(IDEAL, offset=(2.54, 5.08)).scan(plain, DPI, rng())
    assert middle(moved) - middle(IDEAL.scan(plain, DPI, rng())) == pytest.approx([2.54, 5.08], abs=0.02)
    assert dark(moved).sum() == pytest.approx(1e4, rel=0.02)


@pytest.mark.parametrize("quarter", [1, 2, 3])
def test_a_sheet_may_lie_on_its_side(sheet, wanted, quarter):
    turned = replace(IDEAL, rotation=quarter * math.pi / 2).scan(sheet, DPI, rng())
    # clockwise, as seen from above
    assert np.array_equal(turned, np.rot90(wanted, -quarter))


def test_the_place_does_not_depend_on_the_resolution(plain):
    worn = WornFlatbed(skew=0.02, slack=2, warp=2, noise=0, blur=0)
    low, high = (middle(worn.scan(plain, dpi, rng(3)), dpi) for dpi in (100, 200))
    assert low == pytest.approx(high, abs=0.1)


@given(st.integers(0, 1000), st.floats(0.1, 5))
@settings(max_examples=20, deadline=None)
def test_warp_is_as_great_as_it_is_said_to_be(seed, most):
    u = np.linspace(0, 1, 41)
    size = np.hypot(*(smooth_field(field, u, u) for field in bends(most, rng(seed))))
    assert size.max() == pytest.approx(most)


def test_noise_is_as_strong_as_it_is_said_to_be(plain):
    lightness = replace(IDEAL, gamma=1.0, noise=0.01, bits=16).scan(plain, DPI, rng())[:140, :, 1] / 65535
    level = lightness.mean()
    assert lightness.std() == pytest.approx(0.01 * math.sqrt(0.1 + 0.9 * level), rel=0.03)


def test_flare_lifts_black_among_white_and_glare_clips(plain):
    clean = IDEAL.scan(plain, DPI, rng())
    flare = replace(WORN, flare=0.1).scan(plain, DPI, rng())
    assert flare[200, 150, 1] > clean[200, 150, 1] + 5
    assert (replace(WORN, glare=0.5).scan(plain, DPI, rng()) == 255).any()


def test_shading_takes_what_it_is_said_to(plain):
    even = replace(IDEAL, gamma=1.0, bits=16)
    share = replace(even, shading=0.2).scan(plain, DPI, rng(2)) / even.scan(plain, DPI, rng(2))
    assert share.max() == pytest.approx(1, abs=0.003) and share.min() == pytest.approx(0.8, abs=0.003)


def test_automatic_levels_clip_paper_and_change_the_greys(plain):
    picture = replace(WORN, automatic=True).scan(plain, DPI, rng())
    assert np.median(picture) == 255 and picture.min() == 0


def test_blur_spreads_an_edge(plain):
    soft = replace(IDEAL, blur=0.5, gamma=1.0, bits=16).scan(plain, DPI, rng())[200, :, 1].astype(float)
    edge = -np.diff(soft[60:140])
    sigma = math.sqrt(np.average((np.arange(79) - np.average(np.arange(79), weights=edge)) ** 2, weights=edge))
    assert sigma * 25.4 / DPI == pytest.approx(0.5, rel=0.05)


def test_crop_takes_from_its_edges(sheet, wanted):
    cut = replace(WORN, crop=(2.54, 5.08, 7.62, 0)).scan(sheet, DPI, rng())
    assert np.array_equal(cut, wanted[10:-30, :-20])
    with pytest.raises(InputError, match="leaves nothing"):
        replace(WORN, crop=(100, 0, 100, 0)).scan(sheet, DPI, rng())


@pytest.mark.parametrize(
    ("given_", "said"),
    [
        ({"noise": 1}, "noise 1 is outside 0 to 0.2"), ({"white": 0.1}, r"white 0\.1 is outside"),
        ({"bits": 12}, "12 bits: use 8 or 16"), ({"bits": 16, "jpeg": 80}, "use 8 for JPEG"),
        ({"rotation": math.nan}, "finite"), ({"crop": (-1, 0, 0, 0)}, "crop"), ({"blur": math.nan}, "blur nan"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(given_, said):
    with pytest.raises(InputError, match=said):
        WornFlatbed(**given_)


@pytest.mark.parametrize("dpi", [49, 1201, math.nan])
def test_resolutions_that_ink_onlyner_has_are_refused(sheet, dpi):
    with pytest.raises(InputError, match="outside 50 to 1200"):
        IDEAL.scan(sheet, dpi, rng())
