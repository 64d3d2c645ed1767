import csv
import io
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import TableError
from handout.printing.address_table import read_addresses

HEADERS = ["Name", "Straße", "PLZ", "Ort", "Land"]


def table(tmp_path, text, encoding="utf-8", name="t.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return path


_word = st.text('abcXYZ 0123,;"-.éüßñøÅ', min_size=0, max_size=12).map(lambda t: " ".join(t.split()))
_cell = st.lists(_word.filter(bool), min_size=0, max_size=3).map("\n".join)
_row = st.lists(_cell, min_size=5, max_size=5).filter(lambda cells: any(cells))


@pytest.mark.slow
@settings(max_examples=60)
@given(
    rows=st.lists(st.one_of(_row, st.just([])), min_size=1, max_size=6).filter(any),
    delimiter=st.sampled_from(",;\t|"),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"]),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    quoting=st.sampled_from([csv.QUOTE_ALL, csv.QUOTE_MINIMAL]),
)
def test_any_table_comes_back_as_it_was(tmp_path_factory, rows, delimiter, encoding, end, quoting):
    stream = io.StringIO(newline="")
    if end == "\r":
        quoting = csv.QUOTE_ALL  # Python's writer would leave a lone newline without quotes
    writer = csv.writer(stream, delimiter=delimiter, lineterminator=end, quoting=quoting)
    writer.writerow(HEADERS)
    for row in rows:
        if row:
            writer.writerow(row)
        else:
            stream.write(end)
    path = table(tmp_path_factory.mktemp("t"), stream.getvalue(), encoding)
    found = read_addresses(path, nameless=True)
    wanted = {n: dict(zip(HEADERS, row, strict=True)) for n, row in enumerate(rows, 2) if row}
    assert {row.number: dict(row.cells) for row in found} == wanted


def test_rows_are_counted_as_a_spreadsheet_counts(tmp_path):
    path = table(tmp_path, 'name;street;city\n"Ada";"1 Lane\nBack door";Leeds\n\n;;\nBob;2 Lane;York\n')
    first, second = read_addresses(path)
    assert (first.number, second.number) == (2, 5)
    assert first.lines == ("Ada", "1 Lane", "Back door", "Leeds")


def test_the_header_may_stand_below_blank_rows_and_the_separator_line_does_not_count(tmp_path):
    (row,) = read_addresses(table(tmp_path, "sep=;\n\nName;Straße;Ort\nAda;Weg 1;Ulm\n"))
    assert row.number == 3
    assert row.lines == ("Ada", "Weg 1", "Ulm")


def test_windows_encoding_is_told_once_with_words_of_its_rows_only(tmp_path):
    text = "Name,Street,City\nJosé,1 Road,Rome\n".encode() + "Käthe,2 Road,Ulm\n".encode("cp1252") + b"Ada,3 Road,Ely\n"
    found = read_addresses(table(tmp_path, text))
    jose, kaethe, ada = found
    assert jose.lines[0] == "José" and kaethe.lines[0] == "Käthe"
    assert not any(row.warnings for row in (jose, kaethe, ada))
    assert found.notes == ("read as Windows-1252 because it is not UTF-8: check the accents in 'Käthe'",)


def test_the_encoding_is_told_of_the_right_row_below_cells_of_several_lines(tmp_path):
    text = 'sep=,\nName,Address\nAda,"é 1\nb\nc"\n\nBo,"Weg 1\nüx"\nCy,"é 2\nc"\n'.encode()
    found = read_addresses(table(tmp_path, text.replace("ü".encode(), b"\xfc")))
    _, bo, _ = found
    assert found.notes == ("read as Windows-1252 because it is not UTF-8: check the accents in 'üx'",)
    assert bo.lines == ("Bo", "Weg 1", "üx") and bo.number == 4


def test_a_single_column_of_whole_addresses(tmp_path):
    text = '﻿Address\r\n"Ada Lovelace\r\n12 St James\'s Square\r\nLondon\r\nSW1Y 4JH"\r\n"Bob\nWeg 1\n89073 Ulm"\r\n'
    first, second = read_addresses(table(tmp_path, text))
    assert first.lines == ("Ada Lovelace", "12 St James's Square", "London", "SW1Y 4JH")
    assert second.lines == ("Bob", "Weg 1", "89073 Ulm")


def test_an_address_on_one_line_is_broken_at_its_commas_and_says_so(tmp_path):
    text = 'Name;Address\nAda;"Weg 1, 89073 Ulm, Germany"\nBob;"5 Elm St, Springfield, IL 62704"\n'
    ada, bob = read_addresses(table(tmp_path, text))
    assert ada.lines == ("Ada", "Weg 1", "89073 Ulm", "Germany") and "commas" in ada.warnings[0]
    assert bob.lines == ("Bob", "5 Elm St", "Springfield IL 62704")


def test_a_row_without_an_address_fails_alone(tmp_path):
    text = "name,street,city,country,mail\nAda,1 Lane,Leeds,UK,\nBob,,,France,\n,,,,x@example.org\n"
    ada, bob, nobody = read_addresses(table(tmp_path, text))
    assert not ada.problem and ada.lines[-1] == "UNITED KINGDOM"
    assert "no street" in bob.problem and bob.lines == ()
    assert nobody.problem and nobody.number == 4


def test_a_row_longer_than_the_header_fails_alone(tmp_path):
    first, second = read_addresses(table(tmp_path, "name,street,city\nAda,1 Lane, flat 2,Leeds\nBob,2 Lane,York,,\n"))
    assert "4 cells" in first.problem and "quotation marks" in first.problem
    assert second.lines == ("Bob", "2 Lane", "York")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is empty"),
        (b"\xef\xbb\xbf\r\n  \r\n", "is empty"),
        (b";;\n;;\n", "is empty"),
        (b"name,street,city\n\n,,\n", "no rows below the header in row 1"),
        (b"PK\x03\x04\x14\x00\x06\x00rest", "damaged packed file"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "Excel"),
        (b"\x89PNG\r\n\x1a\n", "PNG"),
        (b"name,street\x00\x00\n", "save the table as CSV"),
        (b"\xff\xfen\x00a\x00m", "UTF-16"),
        (b'name,street,city\nAda,1 Lane,Ely\nBob,"2 Lane,York\nCy,3 Lane,Bath\n', "row 3: a quotation mark is opened"),
        (b"colour;size\nred;3\n", "'colour', 'size'"),
        (b"name;mail\nAda;a@example.org\n", "Straße"),
        (b"Ada,1 Lane,Ely\n", 'the table had no header: .* --columns "1=name,2=street,3=place"'),
        (b"street,city\n1 Lane,Ely\n", "no row has a name: .*--no-name"),
        (b"table,street,city\n1,1 Lane,Ely\n", "no row has a name; not understood: 'table': .*name=table.*--no-name"),
        (b"name,city,street,city\nAda,Ely,1 Lane,York\n", r"row 2: the columns 'city' \('Ely'\) and 'city' .* differ"),
    ],
)
def test_what_is_no_table_is_refused_in_one_sentence(tmp_path, data, words):
    path = table(tmp_path, data)
    with pytest.raises(TableError) as caught:
        read_addresses(path)
    assert re.search(words, str(caught.value)) and str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(TableError, match="No such file"):
        read_addresses(tmp_path / "none.csv")


def test_a_quote_that_swallows_rows_is_refused(tmp_path):
    swallowed = "\n".join(f"Name {n},Lane {n},York" for n in range(30))
    path = table(tmp_path, f'name,street,city\n"Bob" x,"Lane "1,York\nCy,"2 Lane\n{swallowed}\nDi,"3 Lane",Bath\n')
    with pytest.raises(TableError, match=r"row 3: a cell runs over \d+ lines"):
        read_addresses(path)


def test_sloppy_quotes_are_accepted(tmp_path):
    (row,) = read_addresses(table(tmp_path, 'name, street, city\n"Ada" Lovelace, "1 Lane, rear", Ely\n'))
    assert row.lines == ("Ada Lovelace", "1 Lane, rear", "Ely")


def test_an_address_of_commas_is_none(tmp_path):
    (row,) = read_addresses(table(tmp_path, "Address\n,\n"))
    assert not row.lines and row.problem == "there is no street, place or address in it"


@pytest.mark.slow
@settings(max_examples=60)
@given(
    st.binary(max_size=80), st.sampled_from([b"", b"name,street,city\n", b"\xff\xfe", b"Adresse;PLZ\n", b"Address\n"])
)
def test_any_bytes_are_rows_or_a_table_error(tmp_path_factory, data, before):
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_bytes(before + data)
    try:
        rows = read_addresses(path, nameless=True)
    except TableError:
        return
    assert rows and all(bool(row.lines) != bool(row.problem) for row in rows)
    assert all(line and "\n" not in line for row in rows for line in row.lines)


@pytest.mark.parametrize(
    "above",
    ["Guest,,Address,\n", "Guest,,Address\n", "Address\n", "A wedding,,,\n,,,\nGuest,,Address,\n", "Persons,,Home,\n"],
)
def test_heads_of_groups_above_the_header_are_no_header(tmp_path, above):
    text = f"{above}Name,Gift,Street,City\nAnn,jam,Way 1,Ulm\nBen,tea,Way 2,Bonn\n"
    rows = read_addresses(table(tmp_path, text))
    assert [row.lines for row in rows] == [("Ann", "Way 1", "Ulm"), ("Ben", "Way 2", "Bonn")]
    assert rows[0].cells["Gift"] == "jam" and "above the header" in rows.notes[0]
