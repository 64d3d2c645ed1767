"""The cells of a table file, as people and programs make them: delimited text, an Excel workbook, or contacts.

Both are read to the same `TableSheet`; what the columns mean is `columns`' business.  A new format is one more branch
of `read_sheet`.
"""

from __future__ import annotations

import csv
import datetime
import io
import re
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from handout import encodings, units
from handout.errors import TableError
from handout.printing import address, columns, contacts

if TYPE_CHECKING:
    from openpyxl.cell import Cell, MergedCell
    from openpyxl.worksheet.worksheet import Worksheet

# the first bytes of files that people give by mistake
_SIGNATURES = {
    b"\xd0\xcf\x11\xe0": "an old Excel workbook (.xls)",
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"%PDF": "a PDF document",
    b"\x1f\x8b": "a packed file",
}
_PACKED = b"PK\x03\x04"
_CONTACTS = re.compile(rb"(?:\xef\xbb\xbf)?\s*BEGIN:VCARD", re.IGNORECASE)
_DELIMITERS = ",;\t|"
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?\s*\Z', re.IGNORECASE)
_MOST_LINES = 20  # of a cell: no address has more, so that a quotation mark is missing
_SEARCHED = 12  # rows in which the header may be
# a cell in the quotes of a word processor
_CURLY = re.compile(r"(?P<before>(?:\A|[,;\t|\n])[ ]?)[“”„](?P<cell>[^“”„\n]*)[“”](?=[ ]?(?:[,;\t|\r\n]|\Z))")
_RULE = re.compile(r"\A:?(?:-{3,}|={3,}):?\Z")  # under the header of a table that is drawn with strokes
_KEPT_AS_TEXT = re.compile(r"""'(?=[\d+=])|="(?P<text>[^"]*)"\Z""")
_MOST_UNPACKED = 200_000_000  # bytes of a workbook; one of a hundred thousand addresses has about a tenth of that
_FORMAT_TOKEN = re.compile(r'"[^"]*"|\\.|.')
_FORMAT_BRACKETS = re.compile(r"\[[^\]]*\]|_.|\*.")


@dataclass(frozen=True)
class TableRecord:
    """One row of cells, as they are shown.

    lines : the physical lines it came from, counted from 0; unseen : invisible characters that are not in the cells.
    """

    cells: list[str]
    lines: range = range(0)
    unseen: tuple[str, ...] = ()

    @classmethod
    def from_cells(cls, texts: Iterable[str], lines: range = range(0)) -> TableRecord:
        """The record of some cells as the file has them."""
        own = list(texts)
        return cls(
            list(map(_shown_text, own)), lines, tuple(char for text in own for char in address.find_unseen(text))
        )

    @property
    def is_filled(self) -> bool:
        """Whether the row holds anything but ruled lines."""
        return any(_RULE.sub("", cell) for cell in self.cells)


@dataclass(frozen=True)
class TableSheet:
    """The records of a file, the first being row 1, and what has to be said of it.

    encoding : where it was guessed; odd : the lines that the guess concerns.
    """

    records: list[TableRecord]
    notes: tuple[str, ...] = ()
    encoding: str = ""
    odd: frozenset[int] = frozenset()


def read_sheet(path: Path) -> TableSheet:
    """The cells of a table: of a workbook (openpyxl), of a contacts file, or of delimited text.

    Raises TableError: no table, empty, damaged, or a quotation mark that is never closed.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise TableError(f"{path} cannot be read: {error.strerror or error}.") from error
    if data.startswith(_PACKED):
        return _read_workbook(path)
    if _CONTACTS.match(data):
        try:
            rows, notes = contacts.read_contacts(encodings.decode(data).text)
        except (encodings.NoText, TableError) as error:
            raise TableError(f"{path}: {error}") from error
        return TableSheet([TableRecord.from_cells(cells) for cells in rows], tuple(notes))
    kind = next((kind for signature, kind in _SIGNATURES.items() if data.startswith(signature)), None)
    if kind is not None:
        raise TableError(f"{path} is {kind}: save the table as CSV (UTF-8) and give that file.")
    return _read_delimited(path, data)


def _shown_text(cell: str) -> str:
    """A cell as it is shown: without the marks by which spreadsheets keep a number as text (``'01067``)."""
    return address.tidy(_KEPT_AS_TEXT.sub(lambda mark: mark.group("text") or "", cell.strip(), count=1))


def header_candidates(records: Sequence[TableRecord]) -> list[int]:
    """The rows, from 1, that may be the header: the first few that hold more than delimiters and ruled lines."""
    rows = [
        n for n, record in enumerate(records, 1) if any(_RULE.sub("", cell).strip(_DELIMITERS) for cell in record.cells)
    ]
    return rows[:_SEARCHED]


def _read_delimited(path: Path, data: bytes) -> TableSheet:
    """The records of delimited text (CSV); the delimiter is the one under which most headers are understood."""
    try:
        decoded = encodings.decode(data)
    except encodings.NoText as error:
        at = f", line {error.line}" if error.line else ""
        raise TableError(f"{path}{at}: no text: {error}; save the table as CSV (UTF-8) and give that file.") from error
    lines = list(io.StringIO(_CURLY.sub(r'\g<before>"\g<cell>"', decoded.text), newline=""))
    odd = decoded.odd
    if not any(line.strip() for line in lines):
        raise TableError(f"{path} is empty.")
    separator = _SEPARATOR_LINE.match(lines[0])
    if separator is not None:
        lines, odd = lines[1:], frozenset(n - 1 for n in odd)
    delimiters = separator.group(1) if separator else _DELIMITERS
    try:
        records, unclosed = max(
            (_read_records(lines, d) for d in delimiters), key=lambda parsed: _rate_records(parsed[0])
        )
    except TableError as error:
        raise TableError(f"{path}: {error}") from error
    if unclosed:
        raise TableError(f"{path}: row {unclosed}: a quotation mark is opened and never closed.")
    for n, record in enumerate(records, 1):
        longest = max((cell.count("\n") for cell in record.cells), default=0)
        if longest > _MOST_LINES:
            raise TableError(
                f"{path}: row {n}: a cell runs over {longest + 1} lines, more than {_MOST_LINES}: "
                "a quotation mark is probably missing in it."
            )
    return TableSheet(records, (), decoded.encoding if decoded.guessed else "", odd)


def _read_records(lines: list[str], delimiter: str) -> tuple[list[TableRecord], int]:
    """The records, and the row in which a quotation mark stays open to the end of the file (0: none)."""
    for strict in (True, False):
        # strict finds the open quote; what else it dislikes (`"Ada" Ltd`) is common and harmless
        reader = csv.reader(lines, delimiter=delimiter, strict=strict, skipinitialspace=True)
        records: list[TableRecord] = []
        try:
            start = 0
            for cells in reader:
                records.append(TableRecord.from_cells(cells, range(start, reader.line_num)))
                start = reader.line_num
            return records, 0
        except csv.Error as error:
            if "field larger" in str(error):
                raise TableError(
                    f"row {len(records) + 1}: a cell has more than {csv.field_size_limit()} characters: shorten it, or "
                    "close the quotation mark that is missing."
                ) from error
            if "unexpected end" in str(error) or not strict:
                return records, len(records) + 1
    raise AssertionError("unreachable")


def _rate_records(records: Sequence[TableRecord]) -> tuple[int, int, int]:
    """How well a delimiter suits: headers understood, columns, few rows longer than the first."""
    tops = header_candidates(records)
    if not tops:
        return (0, 0, 0)
    understood = max(sum(column.role is not None for column in columns.columns(records[n - 1].cells)) for n in tops)
    width = len(records[tops[0] - 1].cells)
    return understood, width, -sum(len(record.cells) > width for record in records)


def _read_workbook(path: Path) -> TableSheet:
    """The first table of the first visible sheet whose headers are understood, or that holds anything, of an .xlsx."""
    _check_package(path)
    try:
        import openpyxl
    except ImportError:
        raise TableError(
            f'{path} is an Excel workbook: install what reads it with pip install "handout-driver[excel]", or save '
            "the table as CSV (UTF-8)."
        ) from None
    try:
        values, formulas = (openpyxl.load_workbook(path, data_only=results) for results in (True, False))
    except Exception as error:  # openpyxl raises whatever the damage leads to
        raise TableError(f"{path} cannot be read as a workbook ({error}): save the table as CSV (UTF-8).") from error
    full = [sheet for sheet in values.worksheets if any(cell is not None for row in sheet.values for cell in row)]
    if not full:
        raise TableError(f"{path} is empty.")
    tables = (
        (sheet, _sheet_records(path, sheet, formulas[sheet.title]))
        for sheet in [sheet for sheet in full if sheet.sheet_state == "visible"] or full[:1]
    )
    sheet, records = _find_addressed(tables)
    _, top, _, bottom = _table_area(sheet)
    return TableSheet(records, tuple(_workbook_notes(sheet, [other.title for other in full], range(top, bottom + 1))))


def _find_addressed(tables: Iterator[tuple[Worksheet, list[TableRecord]]]) -> tuple[Worksheet, list[TableRecord]]:
    """The first sheet of which several headers are understood, and its rows; the first of all where there is none."""
    first = next(tables)
    return next((table for table in chain([first], tables) if _rate_records(table[1])[0] > 1), first)


def _sheet_records(path: Path, sheet: Worksheet, formulas: Worksheet) -> list[TableRecord]:
    """The rows of a sheet's first table, by their numbers; what is merged down several rows is said in each of them."""
    left, top, right, bottom = _table_area(sheet)
    merged = {
        (row, area.min_col): area.min_row
        for area in sheet.merged_cells.ranges
        for row in range(area.min_row, area.max_row + 1)
    }
    records = [TableRecord([]) for _ in range(top - 1)]
    for row in range(top, bottom + 1):
        cells = [sheet.cell(merged.get((row, place), row), place) for place in range(left, right + 1)]
        records.append(TableRecord.from_cells(_shown_cells(path, sheet, formulas, cells)))
    return records


def _shown_cells(path: Path, sheet: Worksheet, formulas: Worksheet, cells: Sequence[Cell | MergedCell]) -> list[str]:
    """Cells as they are shown; a formula has to have a result."""
    for cell in cells:
        if cell.value is None and formulas[cell.coordinate].data_type == "f":
            raise TableError(
                f"{path}: cell {cell.coordinate} of {sheet.title!r} is a formula without a result: open the "
                "workbook in a spreadsheet program, save it, and try again."
            )
    return [_shown_value(cell.value, cell.number_format) for cell in cells]


def _check_package(path: Path) -> None:
    """Refuse packed files that are no workbooks, or that would not fit into memory."""
    try:
        with zipfile.ZipFile(path) as package:
            names, size = set(package.namelist()), sum(part.file_size for part in package.infolist())
    except (OSError, zipfile.BadZipFile) as error:
        raise TableError(f"{path} is a damaged packed file ({error}): save the table as CSV (UTF-8).") from error
    if "xl/workbook.xml" not in names:
        kind = "an OpenDocument file" if "mimetype" in names else "a packed file, but no Excel workbook"
        raise TableError(f"{path} is {kind}: save the table as .xlsx or as CSV (UTF-8) and give that file.")
    if size > _MOST_UNPACKED:
        raise TableError(
            f"{path} unpacks to {size / 1e6:.0f} MB, more than {_MOST_UNPACKED / 1e6:.0f}: save it as CSV (UTF-8)."
        )


def _table_area(sheet: Worksheet) -> tuple[int, int, int, int]:
    """First column and row, last column and row: of the sheet's first table, or of all that is used."""
    from openpyxl.utils import range_boundaries

    areas = [range_boundaries(table.ref) for table in sheet.tables.values()]
    if not areas:
        return sheet.min_column, sheet.min_row, sheet.max_column, sheet.max_row
    left, top, right, bottom = (int(side or 1) for side in min(areas, key=lambda area: (area[1], area[0])))
    return left, top, right, bottom


def _workbook_notes(sheet: Worksheet, full: Sequence[str], rows: range) -> list[str]:
    others = [repr(title) for title in full if title != sheet.title]
    notes = [f"the sheet {sheet.title!r} is read, not {', '.join(others)}"] if others else []
    tables = list(sheet.tables)
    if len(tables) > 1:
        notes.append(f"the table {tables[0]!r} is read, not {', '.join(map(repr, tables[1:]))}")
    hidden = [str(n) for n in rows if sheet.row_dimensions[n].hidden]
    if hidden:
        notes.append(f"rows that the sheet hides are read as well: {', '.join(hidden[: units.MOST_NAMED])}")
    return notes


def _shown_value(value: object, number_format: str) -> str:
    """A cell's value as the sheet shows it, as far as that matters in an address: leading zeros above all."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, (int, float)):
        whole = int(value) if float(value).is_integer() else None
        return str(value) if whole is None else _zero_padded(whole, number_format or "") or str(whole)
    if isinstance(value, datetime.datetime) and value.time() == datetime.time():
        return value.date().isoformat()
    return str(value)


def _zero_padded(value: int, number_format: str) -> str:
    """A whole number in a format of zeros and signs ("00000", "D-"00000); empty for another format."""
    tokens = _FORMAT_TOKEN.findall(_FORMAT_BRACKETS.sub("", number_format.split(";")[0]))
    zeros = tokens.count("0")
    if zeros < 2 or value < 0 or any(token in "#?.,%Eemdyhs@/" for token in tokens):
        return ""
    digits, shown = list(str(value).zfill(zeros)), list[str]()
    for token in reversed(tokens):
        literal = token[1] if token.startswith("\\") else token.strip('"')
        shown += [digits.pop() if token == "0" else literal]
    return "".join([*digits, *reversed(shown)])
