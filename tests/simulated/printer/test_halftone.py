import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError
from handout.simulated import printer, spectra

coverages = st.lists(st.tuples(*[st.floats(0, 1)] * 4), min_size=1, max_size=6).map(np.array)


@given(coverages)
def test_shares_of_the_overlaps_are_a_partition(coverage):
    weights = printer.demichel(coverage)
    assert weights.shape == (len(coverage), 16) and (weights >= 0).all()
    assert weights.sum(axis=1) == pytest.approx(1)
    # what every ink covers alone or with others is its coverage
    assert weights @ printer.OVERLAPS == pytest.approx(coverage)


def test_one_ink_over_another_by_hand():
    # cyan 0.25 and magenta 0.5: bare 0.375, cyan 0.125, magenta 0.375, both 0.125
    weights = printer.demichel(np.array([[0.25, 0.5, 0, 0]]))[0]
    named = dict(zip(map(tuple, printer.OVERLAPS.astype(int)), weights, strict=True))
    assert named[0, 0, 0, 0] == pytest.approx(0.375) and named[1, 0, 0, 0] == pytest.approx(0.125)
    assert named[0, 1, 0, 0] == pytest.approx(0.375) and named[1, 1, 0, 0] == pytest.approx(0.125)


def test_mixture_is_yule_and_nielsens():
    overlaps = np.zeros((16, 1))
    overlaps[0], overlaps[8] = 0.81, 0.01  # bare paper and black: half and half
    half = np.array([[0, 0, 0, 0.5]])
    assert printer.mix_halftone(half, overlaps, 1.0) == pytest.approx(0.41)  # Neugebauer: the mean
    assert printer.mix_halftone(half, overlaps, 2.0) == pytest.approx(((0.9 + 0.1) / 2) ** 2)
    assert printer.mix_halftone(half, overlaps, 3.0) == pytest.approx(((0.81 ** (1 / 3) + 0.01 ** (1 / 3)) / 2) ** 3)


@given(coverages, st.floats(1, 10))
def test_solid_overlaps_are_themselves_whatever_the_factor(coverage, n):
    solid = (coverage > 0.5).astype(float)
    overlaps = printer.primaries(printer.PAPERS["white"].spectrum, 0.02, printer.transmittances())
    number = solid.astype(int) @ [1, 2, 4, 8]
    assert printer.mix_halftone(solid, overlaps, n) == pytest.approx(overlaps[number])


@given(coverages, st.floats(0, 0.25))
def test_dots_grow_in_the_middle_and_in_order(coverage, gain):
    grown = printer.grow_dots(coverage, gain)
    assert (grown >= coverage - 1e-12).all() and (grown <= 1 + 1e-12).all()
    assert (np.diff(printer.grow_dots(np.linspace(0, 1, 100), gain)) > -1e-12).all()
    assert printer.grow_dots(np.array([0.0, 0.5, 1.0]), gain) == pytest.approx([0, 0.5 + gain, 1])


def test_a_gain_that_turns_back_is_refused():
    with pytest.raises(ValueError, match=r"gain of 0\.3 is outside 0 to 0\.25"):
        printer.grow_dots(np.zeros((1, 4)), 0.3)


def test_black_replaces_part_of_the_grey():
    asked = printer.separate_inks(np.array([[0.0, 0, 0], [1, 1, 1], [0, 1, 1], [0.5, 0.5, 0.5]]))
    assert asked == pytest.approx(
        np.array([[0.5, 0.5, 0.5, 1], [0, 0, 0, 0], [1, 0, 0, 0], [0.375, 0.375, 0.375, 0.25]])
    )


@given(st.tuples(*[st.floats(0, 1)] * 3))
def test_what_is_asked_for_can_be_printed(rgb):
    asked = printer.separate_inks(np.array([rgb]))
    assert (asked >= -1e-12).all() and (asked <= 1).all() and asked.sum() <= 3


def test_white_is_white_and_lab_comes_back():
    white = spectra.xyz(np.ones((1, 31)))
    assert white[0] == pytest.approx([0.9642, 1, 0.8251], abs=2e-3)  # D50
    assert spectra.lab(white)[0] == pytest.approx([100, 0, 0], abs=1e-9)
    colours = np.array([[50.0, 20, -30], [5, 0, 0], [95, 0, -2]])
    assert spectra.lab(spectra.xyz_of_lab(colours)) == pytest.approx(colours)


@given(st.floats(20, 95), st.floats(-25, 25), st.floats(-25, 25))
def test_smooth_spectra_have_the_colour_that_was_asked_for(lightness, a, b):
    wanted = spectra.xyz_of_lab([[lightness, a, b]])
    assert spectra.xyz(spectra.smooth(wanted)) == pytest.approx(wanted)


def test_every_paper_is_a_paper():
    for paper in printer.PAPERS.values():
        assert spectra.lab(spectra.xyz(paper.spectrum)) == pytest.approx(paper.lab)
        assert 0.5 < paper.spectrum.min() <= paper.spectrum.max() < 1
        assert 0 <= paper.gain <= printer.GREATEST_GAIN and 0 <= paper.surface <= 0.1
    with pytest.raises(InputError, match=r"no paper 'whit' \(did you mean 'white'\?\)"):
        printer.find_paper("whit")
