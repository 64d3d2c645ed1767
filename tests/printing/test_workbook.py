"""Excel workbooks as tables of addresses."""

import builtins
import zipfile

import pytest

from handout.errors import TableError
from handout.printing.address_table import read_addresses

openpyxl = pytest.importorskip("openpyxl")


def book(tmp_path, rows, at="A1", title="Gäste"):
    made = openpyxl.Workbook()
    sheet = made.active
    sheet.title = title
    start = sheet[at]
    for n, row in enumerate(rows):
        for m, value in enumerate(row):
            cell = sheet.cell(start.row + n, start.column + m)
            cell.value, cell.number_format = value if isinstance(value, tuple) else (value, "General")
    return made, tmp_path / "guests.xlsx"


def test_numbers_are_read_as_they_are_shown(tmp_path):
    rows = [
        ["Name", "Street", "Postcode", "City", "Country"],
        ["Käthe Ahl", "Weg 1", (1067, "00000"), "Dresden", "DE"],
        ["Ada", "1 Elm", (21381234, "00000\\-0000"), "Boston", None],
        ["Urs", "Weg 2", ("D-" and 8001, "General"), "Zürich", "CH"],
        ["Ben", "Weg 3", (1067, '"D-"00000'), "Dresden", "DE"],
        ["Eve", "Weg 4", 1067.0, "Dresden", "DE"],
    ]
    made, path = book(tmp_path, rows)
    made.save(path)
    found = read_addresses(path)
    codes = [row.cells["Postcode"] for row in found]
    assert codes == ["01067", "02138-1234", "8001", "D-01067", "1067"]
    assert "(01067)" in found[4].warnings[0] and [row.number for row in found] == [2, 3, 4, 5, 6]


def test_the_table_is_found_where_it_stands(tmp_path):
    made, path = book(tmp_path, [["Name", "Street", "City"], ["Ada", "1 Lane", "Ely"], ["Bob", "2 Lane", "Ely"]], "C4")
    made["Gäste"].row_dimensions[6].hidden = True
    made.create_sheet("Menü")["A1"] = "Soup"
    made.save(path)
    found = read_addresses(path)
    assert [row.number for row in found] == [5, 6] and found[0].lines == ("Ada", "1 Lane", "Ely")
    assert found.notes == (
        "the sheet 'Gäste' is read, not 'Menü'",
        "rows that the sheet hides are read as well: 6",
    )


def test_a_cover_is_passed_over_and_merged_cells_are_said_in_each_row(tmp_path):
    made, path = book(tmp_path, [["Wedding of Ada and Ben"]], title="Cover")
    table = made.create_sheet("Guests")
    for row in (["Name", "Street", "City"], ["Ada", "1 Lane", "Ely"], ["Bob", None, None]):
        table.append(row)
    table.merge_cells("B2:B3")
    table.merge_cells("C2:C3")
    made.save(path)
    found = read_addresses(path)
    assert [row.lines for row in found] == [("Ada", "1 Lane", "Ely"), ("Bob", "1 Lane", "Ely")]
    assert found.notes == ("the sheet 'Guests' is read, not 'Cover'",)


def test_a_table_that_the_sheet_defines(tmp_path):
    from openpyxl.worksheet.table import Table

    made, path = book(tmp_path, [["Name", "Street", "City"], ["Ada", "1 Lane", "Ely"]], "B3")
    made["Gäste"]["H9"] = "a note"
    made["Gäste"].add_table(Table(displayName="Guests", ref="B3:D4"))
    made.save(path)
    (row,) = read_addresses(path)
    assert row.number == 4 and row.lines == ("Ada", "1 Lane", "Ely")


def test_formulas_need_their_results(tmp_path):
    made, path = book(tmp_path, [["Name", "Street", "City"], ['=CONCATENATE("A","da")', "1 Lane", "Ely"]])
    made.save(path)
    with pytest.raises(TableError, match="cell A2 of 'Gäste' is a formula without a result: open the workbook"):
        read_addresses(path)


def test_without_openpyxl_the_way_to_it_is_said(tmp_path, monkeypatch):
    made, path = book(tmp_path, [["Name", "Street", "City"], ["Ada", "1 Lane", "Ely"]])
    made.save(path)
    load = builtins.__import__

    def missing(name, *rest, **more):
        if name == "openpyxl":
            raise ImportError
        return load(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(TableError, match=r'pip install "handout-driver\[excel\]", or save the table as CSV'):
        read_addresses(path)


def test_packed_files_that_are_no_workbooks(tmp_path):
    path = tmp_path / "a.xlsx"
    for name, words in (("mimetype", "an OpenDocument file"), ("Index/Document.iwa", "no Excel workbook")):
        with zipfile.ZipFile(path, "w") as packed:
            packed.writestr(name, "x")
        with pytest.raises(TableError, match=words):
            read_addresses(path)
    made, path = book(tmp_path, [])
    made.save(path)
    with pytest.raises(TableError, match="is empty"):
        read_addresses(path)
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(TableError, match="damaged"):
        read_addresses(path)


def test_heads_of_groups_are_read_as_in_csv(tmp_path):
    book = openpyxl.Workbook()
    for cells in (("Guest", None, "Address", None), ("Name", "Gift", "Street", "City"), ("Ann", "jam", "Way 1", "Ulm")):
        book.active.append(cells)
    book.active.merge_cells("A1:B1")
    book.save(tmp_path / "t.xlsx")
    assert [row.lines for row in read_addresses(tmp_path / "t.xlsx")] == [("Ann", "Way 1", "Ulm")]
