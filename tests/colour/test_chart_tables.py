"""Tables of the chart as text."""

from __future__ import annotations

import numpy as np
import pytest

from handout.colour import cgats
from handout.colour.chart import chart
from handout.colour.chart_files import DEVICE, ti1, ti2


@pytest.mark.parametrize("pages", [1, 2])
def test_tables_of_the_chart_are_read_again(pages: int) -> None:
    for tables in (ti1(chart(pages=pages)), ti2(chart(pages=pages))):
        assert cgats.parse(cgats.dumps(tables)) == tables


def test_columns_of_words_have_quotation_marks_and_numbers_none() -> None:
    columns = {"SAMPLE_ID": ["1", "2"], "SAMPLE_LOC": ["1", "A2"], "N": ["-1.5e-07", "nan"], "E": ["END_DATA", 'x "y"']}
    one = cgats.table("CTI2", {}, columns)
    written = cgats.dumps([one]).splitlines()
    assert written[-3:-1] == ['1 "1" -1.5e-07 "END_DATA"', '2 "A2" nan "x ""y"""']
    assert cgats.parse(cgats.dumps([one])) == (one,)


def test_a_ti1_tells_extremes_and_combinations_of_the_device() -> None:
    colours, extremes, combinations = ti1(chart())
    assert (extremes.get("DENSITY_EXTREME_VALUES"), combinations.get("DEVICE_COMBINATION_VALUES")) == ("8", "9")
    np.testing.assert_array_equal(extremes.numbers(*DEVICE), combinations.numbers(*DEVICE)[:8])
    assert extremes.numbers("INDEX")[:, 0].tolist() == list(range(8))
    assert colours.numbers(*DEVICE).shape == (760, 3)
