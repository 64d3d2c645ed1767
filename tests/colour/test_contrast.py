"""An S-shaped contrast curve on the scan of a chart: seen where one is, and nothing else is taken for one."""

import itertools
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.colour.ink_match import apply_curve, chart_contrast, undo_curve
from handout.simulated.flatbed import Flatbed
from handout.simulated.printer import PAPERS, Inkjet
from handout_lab.offset_press import Measured

LEVELS = np.rint(np.linspace(0, 255, 8)) / 255
CUBE = np.array(list(itertools.product(LEVELS, repeat=3)))
# a measured press was not used to make the method, nor were other factors of Yule and Nielsen
PRINTERS = {name: partial(Inkjet, name) for name in PAPERS} | {
    "measured": Measured, "no spreading": partial(Inkjet, n=1.0), "much": partial(Inkjet, n=8.0, gain=0.05),
}  # fmt: skip
OTHER_SETTINGS = [{}, {"gamma": 2.2 / 0.75}, {"gamma": 1.6}, {"srgb": True}, {"black": -0.02, "white": 1.05}]


def seen(printer, **settings):
    noise = np.random.default_rng(1).normal(0, 0.001, CUBE.shape)
    return Flatbed(**settings).see(printer.reflectance(CUBE)) + noise


@pytest.mark.slow
@pytest.mark.parametrize("name", PRINTERS)
def test_a_contrast_is_seen_and_how_strong_it_is(name):
    printer = PRINTERS[name]()
    weak, strong, dark = (
        chart_contrast(CUBE, seen(printer, **settings))
        for settings in ({"contrast": 0.35}, {"contrast": 0.6}, {"contrast": 0.6, "gamma": 2.2 / 0.75})
    )
    assert 0.1 <= weak <= strong + 0.03 and weak <= 0.22 and 0.17 <= strong <= 0.28 and 0.17 <= dark <= 0.28


@pytest.mark.slow
@pytest.mark.parametrize("name", PRINTERS)
def test_nothing_else_is_taken_for_one(name):
    printer = PRINTERS[name]()
    assert [chart_contrast(CUBE, seen(printer, **settings)) for settings in OTHER_SETTINGS] == [0.0] * 5


def test_a_driver_that_mixes_inks_into_ramps_tells_nothing():
    mixing = np.array([[0.8, 0.15, 0.05], [0.1, 0.75, 0.15], [0.05, 0.2, 0.75]])
    managed = (0.05 + 0.9 * CUBE @ mixing.T) ** np.array([1.1, 1.6, 0.7])
    assert chart_contrast(CUBE, managed) == 0.0
    assert chart_contrast(CUBE[:40], managed[:40]) == chart_contrast(CUBE[:0], managed[:0]) == 0.0


@given(st.floats(-0.45, 0.45), st.floats(0, 1))
def test_a_curve_is_undone(strength, value):
    assert undo_curve(apply_curve(value, strength), strength) == pytest.approx(value, abs=2e-3)
    assert 0 <= apply_curve(value, strength) <= 1
