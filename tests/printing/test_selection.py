import pytest
from doubles import rows
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError
from handout.printing.rows import ranges, select


def numbers(text, count=12):
    return [row.number for row in select(rows(count), text)]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("", list(range(2, 14))), ("3-5,9", [3, 4, 5, 9]), ("9, 3 - 5", [3, 4, 5, 9]), ("11-", [11, 12, 13]),
        ("-4", [2, 3, 4]), ("12-99", [12, 13]), ("3,3-4,4", [3, 4]), ("7", [7]),
    ],
)  # fmt: skip
def test_rows_are_chosen_by_their_number_in_the_file(text, wanted):
    assert numbers(text) == wanted


@pytest.mark.parametrize("text", ["x", "3-5-7", "3,,4", "-", "3;4", "5-3", "1", "40-", "3.5", ",", "9" * 20])
def test_what_names_no_rows_is_refused(text):
    with pytest.raises(InputError, match="rows:"):
        numbers(text)


@pytest.mark.slow
@given(st.sets(st.integers(2, 20), min_size=1), st.sets(st.integers(2, 20)))
def test_ranges_can_be_read_again(wanted, others):
    among = sorted(wanted | others)
    table = [row for row in rows(19) if row.number in among]
    assert {row.number for row in select(table, ranges(wanted, among))} == wanted


def test_ranges_are_short():
    assert ranges([2, 3, 5, 6, 9], [2, 3, 4, 5, 6, 7, 8, 9, 10]) == "2-3,5-6,9"
    assert ranges([7, 8, 10], [2, 3, 7, 8, 10]) == "7-"
    assert ranges([], [2, 3]) == ""
