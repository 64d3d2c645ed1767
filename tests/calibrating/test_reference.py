"""The pen in the chart's frame: settings of the scanner that differ from those of the hand's scan, end to end."""

import json
from dataclasses import replace

import numpy as np
import pytest

from handout.calibrating import inks, loop, reference, store, through, verification
from handout.calibrating.reference import Kind
from handout.calibrating.wizard import Wizard
from handout.cli.main import main
from handout.colour import convert
from handout.colour.chart import chart
from handout.colour.ink_match import SAME
from handout.colour.reading import Scan, read
from handout.colour.reading.scribble import load, save
from handout.errors import InputError
from handout.printing.simulated import SETTINGS, Flatbed, Inkjet
from handout.values import Raster

HAND = "house-joined-ballpoint"
DPI = 200
FRAME = chart("A4").pages[0].scribble_field


@pytest.fixture(scope="session")
def with_words(sheet, profile):
    """The chart with a line of the hand's own writing in its frame."""
    return loop.simulated(profile, "white", hand=HAND)._written(sheet, FRAME)


def scanned(sheet, seed=4, dpi=DPI, **settings):
    return Scan(Flatbed(shading=0.0, **settings).scan(sheet, dpi, np.random.default_rng(seed)), (dpi, dpi))


@pytest.fixture(scope="session")
def readings(with_words):
    """The same chart, scanned with each of the settings."""
    return {name: read([scanned(with_words, **kw)]) for name, kw in ({"same": {}} | SETTINGS).items()}


def neutral(rgb, name):
    """L*a*b* of (n, 3) that a scan with the settings shows, as one with the usual settings would show them."""
    light = np.linspace(0, 1, 33)
    grid = np.stack(np.meshgrid(light, light, light, indexing="ij"), axis=-1).reshape(-1, 3) ** 2.2
    flatbed = Flatbed(**SETTINGS.get(name, {}))
    shown = flatbed.toned(grid, 1 / flatbed.gamma if not flatbed.middle else _power(name))
    from scipy.spatial import cKDTree

    near = cKDTree(shown).query(rgb, 8)
    weight = 1 / np.maximum(near[0], 1e-6)[..., None]
    return convert.lab(((grid ** (1 / 2.2))[near[1]] * weight).sum(axis=1) / weight.sum(axis=1))


POWERS = {}


def _power(name):
    return POWERS[name]


@pytest.mark.parametrize("name", ["same", "scanner-gamma", "scanner-automatic", "scanner-contrast", "scanner-srgb"])
def test_ink_that_is_wanted_is_the_pens_own_in_the_charts_scan(name, readings):
    reading = readings[name]
    known = reference.compared(reading.scribble, HAND)
    assert known.match is not None
    # what the scan of the chart shows of these very lines, pixel by pixel, is what the hand's pixels have to become
    first, other = reading.scribble, readings["same"].scribble
    assert first.picture.shape == other.picture.shape
    inked = (other.density.mean(axis=2) > 0.1) & (other.density.mean(axis=2) < 2)
    plain, shown = (np.asarray(one.picture[inked], dtype=np.float64) for one in (other, first))
    from_paper = reference.writing(reference_hand())[1]
    hand = plain / other.paper * from_paper
    mapped = known.match.colours(hand)
    off, before = (
        convert.delta_e(convert.lab(np.clip(one, 0, 1)), convert.lab(np.clip(shown, 0, 1))).mean()
        for one in (mapped, plain / other.paper * first.paper)
    )
    assert off < 2.6 and (name in ("same", "scanner-srgb", "scanner-contrast") or before > 4)


def reference_hand():
    from handout.hand.library import find

    return find(HAND)
