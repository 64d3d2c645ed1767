import numpy as np
import pytest
import scribbles

from handout.scanning.page_layout import find_gutter

DPI = 150.0


def columns(*widths, gap=14.0, lean=0.0, lines=5):
    """Ink of columns of writing side by side."""
    parts = [scribbles.coverage(scribbles.lines_of(lines, w, fall=lean), w, 12.0 + 9.0 * lines, DPI) for w in widths]
    between = np.zeros((len(parts[0]), round(max(gap - 16, 0) / 25.4 * DPI)))  # the columns have margins of 8 mm
    return np.concatenate([x for part in parts for x in (part, between)][:-1], axis=1) > 0.5


@pytest.mark.parametrize("lean", [0.0, 0.02])
def test_an_open_book_is_seen(lean):
    found = find_gutter(columns(90.0, 90.0, gap=22.0, lean=lean), DPI)
    assert found.lines == (5, 5)
    assert found.at == pytest.approx(93, abs=8) and found.width > 12


def test_one_column_has_no_gutter():
    assert find_gutter(columns(160.0), DPI) is None
    assert find_gutter(np.zeros((500, 400), dtype=bool), DPI) is None


def test_two_lines_beside_each_other_are_no_columns():
    assert find_gutter(columns(80.0, 80.0, gap=22.0, lines=2), DPI) is None
