"""Columns as a letter names them, and what a row says of how it is made."""

import pytest

from handout.errors import InputError
from handout.merging.fields import Fields, RowManner, count_copies, doubts, tell_repeats
from handout.merging.template import LetterTemplate
from handout.printing.address_table import read_addresses, read_rows
from handout.printing.column_names import identifier

TABLE = "Vorname,Nachname,Straße/Nr.,PLZ,Ort,Geschenk,Stück,Schrift\nAnna,Maß,Weg 1,89073,Ulm,=SUM(A1),2,house-print\n"


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "people.csv"
    path.write_text(TABLE, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("header", "name"),
    [
        ("First name", "first_name"),
        ("Straße/Nr.", "strasse_nr"),
        ("Größe (cm)", "grosse_cm"),
        ("2nd guest", "c2nd_guest"),
    ],
)
def test_a_header_as_a_name(header, name):
    assert identifier(header) == name


def test_columns_are_named_by_header_and_by_what_they_mean(path):
    table = read_addresses(path)
    fields = Fields(table.columns)
    values = fields.values(table[0])
    assert values["vorname"] == values["first_name"] == "Anna" and values["last_name"] == "Maß"
    assert values["address"] == "Anna Maß\nWeg 1\n89073 Ulm"
    assert fields.used_headers(["first_name", "geschenk"]) == {"Vorname", "Geschenk"}


def test_a_row_says_how_it_is_made(path):
    table = count_copies(read_rows(path, ["copies=Stück,hand=Schrift"]))
    (row,) = table
    assert row.copies == 2 and row.lines == () and row.problem == ""
    assert Fields(table.columns).manner(row) == RowManner(hand="house-print")
    assert Fields(table.columns).says("hand") and not Fields(table.columns).says("text")
    assert doubts(row, ["Geschenk", "Ort"]) == (
        "the cell under 'Geschenk' is a formula, which is written as it stands",
    )


def test_copies_that_are_no_number_are_the_row_s_problem(path):
    path.write_text("name,copies\nAnna,two\nBen,0\nCleo,\nDan,1e9\n", encoding="utf-8")
    table = count_copies(read_rows(path, ["copies=copies"]))
    assert [(row.number, row.copies, bool(row.problem)) for row in table] == [(2, 1, True), (4, 1, False), (5, 1, True)]
    assert "says 'two', which is no number of copies from 0 to 100" in table[0].problem
    assert any("of which nothing is made" in note for note in table.notes)


def test_a_setting_is_no_part_of_the_address(path):
    table = read_addresses(path, ["copies=Stück", "hand=Schrift"], elsewhere=["Geschenk"])
    assert table[0].lines == ("Anna Maß", "Weg 1", "89073 Ulm") and table.unused == () and table.notes == ()


def test_a_role_that_there_is_not_names_the_settings_too(path):
    with pytest.raises(InputError, match=r"hnd.* did you mean hand"):
        read_rows(path, ["hnd=Schrift"])


def test_two_columns_of_one_name_are_told_apart_by_their_places(tmp_path):
    path = tmp_path / "two.csv"
    path.write_text("Name,Street,City,Gift,Gift,Copies,Copies\nAnn,Way 1,Ulm,jam,,3,\n", encoding="utf-8")
    rows = read_addresses(path, ("6=copies",))
    fields = Fields(rows.columns)
    with pytest.raises(InputError, match=r"l.txt, line 1: two.csv has 2 columns called 'gift'.*gift_4.*gift_5"):
        fields.check(LetterTemplate("Thanks for {{ gift }}", "l.txt"), "two.csv")
    fields.check(
        letter := LetterTemplate("Thanks for {{ gift_4 }} and {{ row['Gift (5)']|default('all') }}", "l.txt"), "two.csv"
    )
    assert letter.fill(fields.values(rows[0]), rows[0].cells) == "Thanks for jam and all"
    assert count_copies(rows)[0].copies == 3


@pytest.mark.parametrize("once", [True, False])
def test_rows_that_are_the_same_are_told_and_may_be_made_once(tmp_path, once):
    path = tmp_path / "again.csv"
    path.write_text(
        "No,Name,Street,City,Gift\n1,Ann,Way 1,Ulm,jam\n2,Ben,Way 2,Ulm,\n3,ann , Way  1,Ulm,jam\n4,Ann,Way 1,Ulm,tea\n"
    )
    for rows, used, same in (
        (read_addresses(path), (), "rows 2, 4 and 5"),
        (read_addresses(path), ("Gift",), "rows 2 and 4"),
    ):
        found = tell_repeats(rows, used, once=once)
        assert same in found.notes[-1] and ("--once" in found.notes[-1]) is not once
        again = {int(n) for n in same.replace(",", "").split() if n.isdecimal()} - {2} if once else set()
        assert [row.number for row in found] == [n for n in (2, 3, 4, 5) if n not in again]
    assert tell_repeats(read_rows(path), (), once=once).notes == read_rows(path).notes
