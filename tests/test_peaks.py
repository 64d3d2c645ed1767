import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.peaks import peaks

ROWS = st.lists(st.integers(0, 8), max_size=40).map(lambda row: np.array(row, dtype=np.float64) / 2)


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(ROWS, st.sampled_from([0.0, 0.5, 1.0, 2.5]), st.sampled_from([1, 2, 5]))
def test_peaks_are_those_of_scipy(row, prominence, apart):
    from scipy.signal import find_peaks  # not above: it takes .8 s of CPU, in every process of xdist

    expected, _ = find_peaks(row, prominence=prominence, distance=apart)
    np.testing.assert_array_equal(peaks(row, prominence=prominence, apart=apart), expected)


def test_a_peak_on_the_flank_of_a_higher_one_stands_out_only_as_far_as_the_dip_between_them():
    row = np.array([0.0, 5.0, 4.0, 4.5, 0.0])
    assert peaks(row, prominence=0.5).tolist() == [1, 3]
    assert peaks(row, prominence=0.6).tolist() == [1]


@pytest.mark.parametrize("row", [[], [1.0], [1.0, 2.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0, 3.0]])
def test_ends_are_no_peaks(row):
    assert peaks(np.array(row, dtype=np.float64), prominence=0.1).tolist() == []
