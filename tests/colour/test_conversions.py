from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.colour import conversions

# from the data of Sharma, Wu and Dalal 2005, table 1: pairs 1, 4, 7, 9, 14, 17, 25, 33
PAIRS = [
    ((50.0, 2.6772, -79.7751), (50.0, 0.0, -82.7485), 2.0425),
    ((50.0, -1.3802, -84.2814), (50.0, 0.0, -82.7485), 1.0),
    ((50.0, 0.0, 0.0), (50.0, -1.0, 2.0), 2.3669),
    ((50.0, 2.49, -0.001), (50.0, -2.49, 0.0009), 7.1792),
    ((50.0, -0.001, 2.49), (50.0, 0.0011, -2.49), 4.7461),
    ((50.0, 2.5, 0.0), (73.0, 25.0, -18.0), 27.1492),
    ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ((6.7747, -0.2908, -2.4247), (5.8714, -0.0985, -2.2286), 0.6377),
]
COLOUR = st.tuples(*(st.floats(0, 1) for _ in range(3)))


@pytest.mark.parametrize(("one", "other", "difference"), PAIRS)
def test_ciede2000_of_the_published_pairs(one, other, difference) -> None:
    assert conversions.delta_e(np.array(one), np.array(other)) == pytest.approx(difference, abs=6e-5)


def test_as_colour_science_has_it() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
    rng = np.random.default_rng(3)
    rgb = rng.random((400, 3))
    lab = conversions.lab(rgb)
    xyz = colour.sRGB_to_XYZ(rgb)
    np.testing.assert_allclose(conversions.xyz(rgb), xyz, atol=2e-4)
    white = colour.sRGB_to_XYZ(np.ones(3))
    np.testing.assert_allclose(lab, colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(white)), atol=0.05)
    other = lab[rng.permutation(len(lab))]
    np.testing.assert_allclose(
        conversions.delta_e(lab, other), colour.delta_E(lab, other, method="CIE 2000"), atol=1e-9
    )


@given(COLOUR, COLOUR)
def test_difference_is_symmetric_and_nothing_for_the_same(one, other) -> None:
    a, b = conversions.lab(np.array(one)), conversions.lab(np.array(other))
    assert conversions.delta_e(a, a) == 0
    assert conversions.delta_e(a, b) == pytest.approx(conversions.delta_e(b, a), abs=1e-9)
    assert conversions.delta_e(a, b) >= 0


def test_white_black_and_evened_distances() -> None:
    np.testing.assert_allclose(conversions.lab(np.array([[1.0, 1, 1], [0, 0, 0]])), [[100, 0, 0], [0, 0, 0]], atol=1e-6)
    rng = np.random.default_rng(0)
    lab = conversions.lab(rng.random((300, 3)))
    near = lab + rng.normal(size=lab.shape)
    evened = np.linalg.norm(conversions.bend_chroma(lab) - conversions.bend_chroma(near), axis=1)
    plain = np.linalg.norm(lab - near, axis=1)
    wanted = conversions.delta_e(lab, near)
    assert np.corrcoef(evened, wanted)[0, 1] > np.corrcoef(plain, wanted)[0, 1] + 0.1
