"""Tables of colours: what is written is read again, and what is wrong is said with its line."""

import string

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.colour import cgats, chart_files, conversions
from handout.colour.chart import chart
from handout.colour.reading import ChartReading
from handout.errors import InputError

GOOD = """CTI3

DESCRIPTOR "A ""test"" of it"
KEYWORD "DEVICE_CLASS"
DEVICE_CLASS "OUTPUT"   # a remark
NUMBER_OF_FIELDS 4
BEGIN_DATA_FORMAT
SAMPLE_ID SAMPLE_LOC RGB_R
 RGB_G
END_DATA_FORMAT
NUMBER_OF_SETS 2
BEGIN_DATA
1 "A 1" 0 100.000
2\tA2 1e-3 -7
END_DATA
"""
OWN = {"BEGIN_DATA", "END_DATA", "BEGIN_DATA_FORMAT", "END_DATA_FORMAT", "NUMBER_OF_SETS", "NUMBER_OF_FIELDS"}
LETTERS = string.ascii_uppercase
NAMES = st.builds(str.__add__, st.sampled_from(LETTERS), st.text(LETTERS + "_", min_size=1, max_size=11))
NAMES = NAMES.filter(lambda name: name not in OWN)
VALUES = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Zl", "Zp")), max_size=20)


@st.composite
def tables(draw):
    fields = draw(st.lists(NAMES, min_size=1, max_size=5, unique=True))
    rows = draw(st.lists(st.tuples(*[VALUES] * len(fields)), max_size=6))
    keywords = draw(st.lists(st.tuples(NAMES, VALUES), max_size=5))
    return cgats.CgatsTable("CTI3", tuple(keywords), tuple(fields), tuple(rows))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.lists(tables(), min_size=1, max_size=3))
def test_what_is_written_is_read_again(some):
    text = cgats.dumps(some)
    assert cgats.parse(text) == tuple(some)
    assert cgats.dumps(cgats.parse(text)) == text


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_numbers_come_back_exactly(values):
    one = cgats.table("CTI3", {"DEVICE_CLASS": "OUTPUT"}, {"RGB_R": [repr(v) for v in values]})
    assert cgats.parse(cgats.dumps([one]))[0].numbers("RGB_R")[:, 0].tolist() == values


def test_a_table_as_programs_write_it():
    (table,) = cgats.parse(GOOD)
    assert table.kind == "CTI3"
    assert table.get("DESCRIPTOR") == 'A "test" of it'
    assert table.get("DEVICE_CLASS") == "OUTPUT"
    assert table.get("MISSING") is None
    assert table.rows[0] == ("1", "A 1", "0", "100.000")
    assert table.numbers("RGB_R", "RGB_G").tolist() == [[0, 100], [0.001, -7]]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("1 \"A 1\" 0 100.000", "1 \"A 1\" 0"), "t.ti3, line 13: 3 values, and there are 4 fields"),
        (("NUMBER_OF_SETS 2", "NUMBER_OF_SETS 3"), "t.ti3, line 11: NUMBER_OF_SETS is 3, and there are 2"),
        (("NUMBER_OF_SETS 2", "NUMBER_OF_SETS two"), "t.ti3, line 11: NUMBER_OF_SETS needs a whole number"),
        (("NUMBER_OF_FIELDS 4", "NUMBER_OF_FIELDS 5"), "t.ti3, line 6: NUMBER_OF_FIELDS is 5, and 4 are named"),
        (("END_DATA\n", ""), "t.ti3, line 12: END_DATA is missing: the file is cut off"),
        (("END_DATA_FORMAT", ""), "t.ti3, line 7: END_DATA_FORMAT is missing"),
        (("RGB_G", "RGB_R"), "t.ti3, line 7: the field RGB_R is named twice"),
        (("\"OUTPUT\"", "\"OUTPUT"), "t.ti3, line 5: a quotation mark is not closed"),
        (("CTI3", "42 hello"), "t.ti3, line 1: a table begins with a word such as CTI3"),
        (("NUMBER_OF_FIELDS 4", "4711 oops"), "t.ti3, line 6: '4711' stands where a keyword should"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_line(change, said):
    with pytest.raises(InputError) as error:
        cgats.parse(GOOD.replace(*change, 1), "t.ti3")
    assert str(error.value).startswith(said)


def test_files_that_are_none(tmp_path):
    path = tmp_path / "x.ti3"
    for data, said in ((b"", "the file is empty"), (b"II*\0\0\0", "not a text file")):
        path.write_bytes(data)
        with pytest.raises(InputError, match=said):
            cgats.read_tables(path)
    with pytest.raises(InputError, match="No such file"):
        cgats.read_tables(tmp_path / "none.ti3")


def test_a_field_that_is_not_there_and_a_word_for_a_number():
    (table,) = cgats.parse(GOOD)
    with pytest.raises(InputError, match="no field LAB_L; it has SAMPLE_ID"):
        table.numbers("LAB_L")
    with pytest.raises(InputError, match="SAMPLE_LOC of set 1 is 'A 1', which is no number"):
        table.numbers("SAMPLE_LOC")
    for wild in ("nan", "inf", "1e300"):
        (table,) = cgats.parse(GOOD.replace("100.000", wild))
        with pytest.raises(InputError, match=f"'{wild}', which is no number that is measured"):
            table.numbers("RGB_R", "RGB_G")


def test_a_reading_is_stored_whole(tmp_path):
    rng = np.random.default_rng(0)
    device = chart("A4").colours
    reading = ChartReading(chart("A4"), device, rng.random(device.shape), rng.random(len(device)) / 100, ())
    cgats.write(tmp_path / "r.ti3", chart_files.ti3(reading, {"PRINTER": "X"}))
    tables = cgats.read_tables(tmp_path / "r.ti3")
    assert (tables[0].get("COLOR_REP"), tables[0].get("DEVICE_CLASS")) == ("iRGB_XYZ", "OUTPUT")
    assert tables[0].get("PRINTER") == "X"
    for stored, was in zip(
        chart_files.from_ti3(tables), (reading.device, reading.scanned, reading.deviation), strict=True
    ):
        assert np.abs(stored - was).max() < 1e-15
    with pytest.raises(InputError, match="no numbers of a scan"):
        chart_files.from_ti3(cgats.parse(GOOD))


def test_xyz_of_srgb():
    # white of D50 as the ICC has it, and 18 % grey
    white, grey = conversions.xyz_d50(np.array([[1.0, 1, 1], [0.4613561, 0.4613561, 0.4613561]]))
    assert white.tolist() == pytest.approx([96.42, 100.0, 82.49], abs=0.05)
    assert grey[1] == pytest.approx(18.0, abs=0.01)
