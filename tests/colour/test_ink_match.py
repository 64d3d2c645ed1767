"""Lines of one pen in two scans: what settings make of its ink is found, whatever they are."""

import cv2
import numpy as np
import pytest

from handout.colour import conversions
from handout.colour.ink_match import Tone, density_of, match, strokes_in
from handout.simulated import spectra
from handout.simulated.flatbed import SETTINGS, Flatbed
from handout.simulated.printer import PAPERS
from handout.values import Raster

DPI = 300
LOBES = {"blue": ((600, 90, 0.6), (520, 120, 0.35)), "black": ((550, 400, 1.1),)}


def amount(seed, width):
    """(h, w) ink of wavy lines whose pressure changes, 1 where it is usual, at 1200 dpi."""
    rng = np.random.default_rng(seed)
    drawn = np.zeros((480, 3000), dtype=np.float32)
    for row in range(60, 440, 90):
        x = np.arange(40, 2960, 4)
        y = row + 25 * np.sin(x / rng.uniform(25, 40))
        press = 1 + 0.3 * np.sin(x / rng.uniform(150, 250) + rng.uniform(0, 6))
        for at in range(len(x) - 1):
            ends = [(round(16 * float(x[k])), round(16 * float(y[k]))) for k in (at, at + 1)]
            cv2.line(drawn, *ends, float(press[at]), width, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(drawn, (0, 0), 2.0)


def scan(ink, paper, amounts, flatbed, seed):
    """(h, w, 3) as a flatbed shows it, 0–1."""
    density = sum(h * np.exp(-0.5 * ((spectra.WAVELENGTHS - at) / wide) ** 2) for at, wide, h in LOBES[ink])
    levels = np.linspace(0, 2, 128)
    table = (PAPERS[paper].spectrum * 10 ** (-density * levels[:, None])) @ flatbed.bands
    seen = np.stack([np.interp(amounts, levels, table[:, k]) for k in range(3)], axis=-1).astype(np.float32)
    seen = cv2.resize(seen, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    noisy = np.clip(seen + np.random.default_rng(seed).normal(size=seen.shape) * 0.003, 0, 1)
    power = 0.33 if flatbed.middle else 1 / flatbed.gamma
    return np.rint(flatbed.apply_tone(noisy, power) * 255) / 255, flatbed.apply_tone(seen, power)


@pytest.mark.slow
@pytest.mark.parametrize("ink", LOBES)
@pytest.mark.parametrize("name", ["same", *SETTINGS])
def test_ink_becomes_what_the_charts_scan_shows_of_it(ink, name):
    hand, _ = scan(ink, "cream", amount(1, 20), Flatbed(), 1)
    chart, _ = scan(ink, "white", amount(2, 18), Flatbed(**SETTINGS.get(name, {})), 2)
    bare, other = (np.median(one.reshape(-1, 3), axis=0) for one in (hand, chart))
    contrast = 0.24 if name == "scanner-contrast" else 0.0  # as the patches of a chart show it
    found = match(density_of(hand, bare), bare, density_of(chart, other), other, DPI, contrast)
    assert found.same_ink and found.contrast_differs is (contrast > 0)
    # the hand's own lines, as the chart's scan would show them on the chart's paper
    _, given = scan(ink, "cream", amount(1, 20), Flatbed(), 1)
    _, wanted = scan(ink, "white", amount(1, 20), Flatbed(**SETTINGS.get(name, {})), 1)
    inked = density_of(given, bare).mean(axis=2) > 0.1
    off, before = (
        conversions.delta_e(conversions.lab(np.clip(one, 0, 1)), conversions.lab(wanted[inked])).mean()
        for one in (found.colours(given[inked].astype(float)), given[inked] / bare * other)
    )
    assert off < 1.2
    assert name != "scanner-contrast" or (not found.scans_alike and before > 1.9)
    if name in ("scanner-gamma", "scanner-automatic"):
        assert before > 4 and not found.scans_alike and found.lighter > 3


@pytest.mark.slow
@pytest.mark.parametrize("ink", LOBES)
def test_a_contrast_that_both_scans_have_is_no_difference(ink):
    steep = Flatbed(contrast=0.6)
    hand, given = scan(ink, "cream", amount(1, 20), steep, 1)
    chart, _ = scan(ink, "white", amount(2, 18), steep, 2)
    bare, other = (np.median(one.reshape(-1, 3), axis=0) for one in (hand, chart))
    found = match(density_of(hand, bare), bare, density_of(chart, other), other, DPI, 0.24)
    assert found.scans_alike and not found.contrast_differs
    _, wanted = scan(ink, "white", amount(1, 20), steep, 1)
    inked = density_of(given, bare).mean(axis=2) > 0.1
    off, shares = (
        conversions.delta_e(conversions.lab(np.clip(one, 0, 1)), conversions.lab(wanted[inked])).mean()
        for one in (found.colours(given[inked].astype(float)), given[inked] / bare * other)
    )
    # on another paper the same curve lies elsewhere
    assert off < 0.8 < shares


@pytest.mark.parametrize("contrasts", [(0.0, 0.0), (0.0, 0.2), (0.25, 0.25), (0.2, 0.0)])
def test_a_tone_rises_and_keeps_the_paper(contrasts):
    papers = np.array([[0.9, 0.85, 0.8], [0.95, 0.96, 0.97]])
    tone = Tone(np.array([0.7, 1.0, 1.4]), np.array([0.02, 0.0, -0.02]), papers, contrasts)
    shares = np.repeat(np.linspace(0.05, 1, 40)[:, None], 3, axis=1)
    made = tone(shares)
    assert np.allclose(made[-1], 1) and (np.diff(made, axis=0) > -1e-9).all()
    assert np.allclose(tone.density(-np.log(shares)), -np.log(made))


def test_paper_without_ink_has_no_lines():
    noise = np.random.default_rng(0).normal(0.9, 0.004, (200, 300, 3))
    assert strokes_in(density_of(noise, np.full(3, 0.9)), DPI) is None


def test_a_raster_lies_on_the_charts_paper_as_its_scan_would_show_it():
    hand, _ = scan("blue", "cream", amount(1, 20), Flatbed(), 1)
    chart, _ = scan("blue", "white", amount(2, 20), Flatbed(gamma=3.0), 2)
    bare, other = (np.median(one.reshape(-1, 3), axis=0) for one in (hand, chart))
    found = match(density_of(hand, bare), bare, density_of(chart, other), other, DPI)
    rgba = np.random.default_rng(3).uniform(0.1, 0.9, (5, 6, 4)).astype(np.float32)
    rgba[..., :3] *= 0.8
    rgba[0] = 0
    page = Raster(rgba, DPI)
    rgba, made = page.rgba / 255, found.raster(page).rgba / 255
    assert not made[0].any()
    laid = rgba[..., :3] * rgba[..., 3:] + (1 - rgba[..., 3:]) * bare
    shown = made[..., :3] * made[..., 3:] + (1 - made[..., 3:]) * other
    assert np.abs(shown[1:].reshape(-1, 3) - found.colours(laid[1:].reshape(-1, 3).astype(float))).max() < 1 / 255
