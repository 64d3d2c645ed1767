import itertools

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage
from scribbles import coverage, lines_of, page, scan_of

from handout.errors import InputError
from handout.scanning import mask
from handout.scanning.density import find_density
from handout.scanning.graph_cut import Weights, least_cut, minimum_cut
from handout.scanning.inks import find_inks
from handout.scanning.mask import PENS, find_mask, guess_pen, signed_distance, smooth
from handout.scanning.scan import Scan

SIDE = 4
NUMBER = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
A = np.concatenate([NUMBER[:, :-1].ravel(), NUMBER[:-1].ravel()])
B = np.concatenate([NUMBER[:, 1:].ravel(), NUMBER[1:].ravel()])
LABELS = np.array(list(itertools.product([False, True], repeat=SIDE * SIDE)))


def least(cost, price):
    """The least energy of all 65,536 labellings."""
    return float((LABELS @ cost + (LABELS[:, A] != LABELS[:, B]) @ price).min())


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.1, 30))
def test_cut_is_the_least_of_all_labellings(seed, edge):
    rng = np.random.default_rng(seed)
    # multiples of 1/256, so that rounding to capacities loses nothing
    cost = np.rint(rng.normal(0, 8, SIDE * SIDE) * 256) / 256
    price = np.rint(rng.random(len(A)) * edge * 256) / 256
    found = minimum_cut(cost, A, B, price)
    energy = cost[found].sum() + price[found[A] != found[B]].sum()
    assert energy == pytest.approx(least(cost, price), abs=1e-9)


def terms_of(rgb, density, weights):
    """Costs of pixels and of edges as printed in the specification, one by one."""
    cost = [weights.paper if d == 0 else -weights.ink * min(d, 1) for d in density.ravel().tolist()]
    flat = rgb.reshape(-1, 3).astype(float)
    price = [
        weights.edge * weights.half / (weights.half + ((flat[a] - flat[b]) ** 2).sum())
        for a, b in zip(A, B, strict=True)
    ]
    return np.array(cost), np.array(price)


@pytest.mark.parametrize("seed", range(6))
def test_mask_of_a_page_is_the_least_of_all(seed):
    rng = np.random.default_rng(seed)
    rgb = rng.integers(0, 60, (4, 4, 3), dtype=np.uint8)
    density = np.where(rng.random((4, 4)) < 0.5, rng.random((4, 4)), 0).astype(np.float32)
    weights = Weights(8, 12, 9, 500)
    found = least_cut(rgb, density, np.ones((4, 4), dtype=bool), weights).ravel()
    cost, price = terms_of(rgb, density, weights)
    energy = cost[found].sum() + price[found[A] != found[B]].sum()
    assert energy <= least(cost, price) + 40 / 256  # capacities are rounded


def test_what_lies_outside_the_domain_is_paper():
    domain = np.zeros((9, 9), dtype=bool)
    domain[2:7, 2:7] = True
    density = np.ones((9, 9), dtype=np.float32)
    rgb = np.zeros((9, 9, 3), dtype=np.uint8)
    assert np.array_equal(least_cut(rgb, density, domain, Weights(8, 12, 1, 4)), domain)
    assert not least_cut(rgb, density, domain, Weights(8, 12, 64, 4)).any()  # its edge costs more than it is worth


def test_windows_do_not_change_the_answer(monkeypatch):
    scan = page(2)
    density = find_density(scan, find_inks(scan)).values
    domain = ndimage.binary_dilation(density > 0, iterations=2)
    whole = least_cut(scan.rgb, density, domain, PENS["fineliner"])
    monkeypatch.setattr("handout.scanning.graph_cut._TOGETHER", 500)
    assert np.array_equal(whole, least_cut(scan.rgb, density, domain, PENS["fineliner"]))


def read(scan, **options):
    inks = find_inks(scan)
    return find_mask(scan, inks, find_density(scan, inks), **options)


INK = coverage(lines_of(3, 80.0), 80.0, 40.0, 300.0)


@pytest.mark.slow
@pytest.mark.parametrize("pen", [*PENS, "hysteresis", None])
def test_mask_is_the_ink(pen, monkeypatch):
    if pen == "hysteresis":
        monkeypatch.setattr(mask, "cut_ink", lambda scan, density, weights: mask.hysteresis(density.values, density))
    found = read(scan_of(INK), pen=None if pen == "hysteresis" else pen).ink
    assert found[INK > 0.7].mean() > 0.995
    assert found[INK < 0.05].mean() < 0.002


def test_stroke_width_is_that_of_the_pen():
    for pen in (0.3, 0.9):
        mask = read(scan_of(coverage(lines_of(1, 60.0), 60.0, 20.0, 300.0, pen)))
        assert mask.stroke == pytest.approx(pen * 300 / 25.4, rel=0.2, abs=0.8)


def test_grain_tells_pens_apart():
    assert guess_pen(find_inks(scan_of(INK))) == "fineliner"
    rough = INK * np.clip(ndimage.gaussian_filter(np.random.default_rng(0).normal(0.8, 1.2, INK.shape), 1.2), 0.1, 1.2)
    assert guess_pen(find_inks(scan_of(rough.astype(np.float32), colour=(0.55, 0.55, 0.55)))) == "pencil"


def test_dust_and_streaks_go_and_full_stops_stay():
    ink = INK.copy()
    ink[450:452, 500:502] = 1  # dust
    ink[450:455, 600:605] = 1  # a full stop
    ink[:, 880:883] = np.maximum(ink[:, 880:883], 0.6)  # a streak of the scanner
    found = read(scan_of(ink)).ink
    assert not found[446:456, 495:507].any()
    assert found[451:454, 601:604].all()
    assert not found[5:40, 878:885].any()


def test_the_edge_of_the_sheet_round_a_corner_goes():
    ink = INK.copy()
    height, width = ink.shape
    for x in range(width):
        ink[height - 4 - x // 200, x] = 0.9
    ink[: height - 3, width - 9 : width - 7] = 0.9
    found = read(scan_of(ink)).ink
    assert not found[-12:].any()
    assert not found[:, -12:].any()
    assert found[INK > 0.7].mean() > 0.995


def test_too_coarse():
    fine = scan_of(INK)
    small = cv2.resize(fine.rgb, None, fx=1 / 5, fy=1 / 5, interpolation=cv2.INTER_AREA)
    with pytest.raises(InputError, match=r"pixels wide.*300 dpi"):
        read(Scan(small, 100.0))


def test_unknown_pen():
    with pytest.raises(InputError, match="--pen quill"):
        read(scan_of(INK), pen="quill")


def ring(width, size=160, rough=0.0):
    y, x = np.mgrid[:size, :size] - size / 2
    away = np.abs(np.hypot(x, y) - 55)
    bump = ndimage.gaussian_filter(np.random.default_rng(2).normal(size=(size, size)), 1.0)
    return away + rough * bump / bump.std() <= width / 2


def overlap(a, b):
    return (a & b).sum() / (a | b).sum()


@pytest.mark.parametrize("width", [6, 9, 14])
def test_smoothing_takes_out_jags(width):
    true, jagged = ring(width), ring(width, rough=0.8)
    assert overlap(smooth(jagged), true) > overlap(jagged, true) + 0.01
    assert overlap(smooth(true), true) > 0.985


def test_a_straight_line_stays_as_it_is():
    """With n̂·n̄ added, as printed, it would not."""
    bar = np.zeros((60, 60), dtype=bool)
    bar[25:34, 5:55] = True
    middle = (slice(None), slice(12, 48))
    assert np.array_equal(smooth(bar, passes=4)[middle], bar[middle])


def test_signed_distance():
    bar = np.zeros((30, 30), dtype=bool)
    bar[10:20] = True
    assert signed_distance(bar)[8:22, 5] == pytest.approx(
        [1.5, 0.5, -0.5, -1.5, -2.5, -3.5, -4.5, -4.5, -3.5, -2.5, -1.5, -0.5, 0.5, 1.5], abs=0.05
    )
