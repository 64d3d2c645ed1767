from __future__ import annotations

import numpy as np
import pytest
from formula_printers import dull, dull_table

from handout.colour import conversions
from handout.colour.table import ColourTable, reach, swatches
from handout.errors import InputError

# they rest on scans that take seconds to make
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def table() -> ColourTable:
    return dull_table(33)


def test_what_is_out_of_reach_is_told(table: ColourTable) -> None:
    sent = 0.1 + 0.8 * np.random.default_rng(0).random((60, 3))
    black = np.full((20, 3), 0.02)
    found = reach(np.concatenate([dull(sent), black]), table)
    assert found.share_out == pytest.approx(20 / 80)
    assert found.lost[:60].max() < 0.2
    # the darkest that the formula prints is 0.12 in all channels
    darkest = conversions.delta_e(conversions.lab(np.full(3, 0.12)), conversions.lab(black[0]))
    assert found.mean == pytest.approx(darkest, abs=0.4)
    assert str(found).startswith(
        "This printer cannot print 25% of the ink, and prints the nearest colour instead: off by "
    )


def test_all_in_reach(table: ColourTable) -> None:
    found = reach(dull(np.full((3, 3), 0.4)), table)
    assert (found.share_out, found.mean) == (0, 0)
    assert str(found) == "This printer can print all of the ink (within ΔE00 1)."


def test_swatches_show_wanted_over_printed(table: ColourTable) -> None:
    wanted = np.array([[0.5, 0.5, 0.45], [0.0, 0.0, 0.3]])
    sheet = swatches(reach(wanted, table))
    assert sheet.shape == (108, 114, 3)
    np.testing.assert_array_equal(sheet[10, 20], [128, 128, 115])
    assert np.abs(sheet[80, 20].astype(int) - [128, 128, 115]).max() <= 1
    np.testing.assert_array_equal(sheet[10, 80], [0, 0, 76])
    assert (sheet[80, 80] > sheet[10, 80]).any()


@pytest.mark.parametrize(
    "samples", [np.zeros((0, 3)), np.zeros((4, 2)), np.full((4, 3), 255.0), np.full((2, 3), np.nan)]
)
def test_samples_that_are_no_colours_are_refused(samples, table: ColourTable) -> None:
    with pytest.raises(InputError, match="samples of ink must be"):
        reach(samples, table)
