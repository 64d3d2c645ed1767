"""Excel workbooks (.xlsx): the first table of the first sheet that holds anything, its cells as they are shown."""

from __future__ import annotations

import datetime
import re
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handout.errors import TableError
from handout.printing.delimited import Record, Sheet, tidy

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

_MOST = 200_000_000  # bytes of a workbook unpacked; one of a hundred thousand addresses has about a tenth of that
_TOKEN = re.compile(r'"[^"]*"|\\.|.')
_BRACKETS = re.compile(r"\[[^\]]*\]|_.|\*.")


def sheet(path: Path) -> Sheet:
    """The records of a workbook; a row's place in them is its row in the sheet.

    Raises
    ------
    TableError
        No workbook, a damaged or an empty one, a formula without a result, or openpyxl is not installed.
    """
    _check(path)
    try:
        import openpyxl
    except ImportError:
        raise TableError(
            f'{path} is an Excel workbook: install what reads it with pip install "handout-driver[excel]", or save '
            "the table as CSV (UTF-8)."
        ) from None
    try:
        shown, formulas = (openpyxl.load_workbook(path, data_only=kept) for kept in (True, False))
    except Exception as error:  # openpyxl raises whatever the damage leads to
        raise TableError(f"{path} cannot be read as a workbook ({error}): save the table as CSV (UTF-8).") from error
    full = [one for one in shown.worksheets if any(cell is not None for row in one.values for cell in row)]
    if not full:
        raise TableError(f"{path} is empty.")
    chosen = next((one for one in full if one.sheet_state == "visible"), full[0])
    left, upper, right, lower = _area(chosen)
    records = [Record([]) for _ in range(upper - 1)]
    for n in range(upper, lower + 1):
        cells = [chosen.cell(n, column) for column in range(left, right + 1)]
        for cell in cells:
            if cell.value is None and formulas[chosen.title][cell.coordinate].data_type == "f":
                raise TableError(
                    f"{path}: cell {cell.coordinate} of {chosen.title!r} is a formula without a result: open the "
                    "workbook in a spreadsheet program, save it, and try again."
                )
        records.append(Record([tidy(_shown(cell.value, cell.number_format)) for cell in cells]))
    return Sheet(records, tuple(_notes(chosen, [one.title for one in full], upper, lower)))


def _check(path: Path) -> None:
    """Refuse packed files that are no workbooks, or that would not fit into memory."""
    try:
        with zipfile.ZipFile(path) as packed:
            names, size = set(packed.namelist()), sum(one.file_size for one in packed.infolist())
    except (OSError, zipfile.BadZipFile) as error:
        raise TableError(f"{path} is a damaged packed file ({error}): save the table as CSV (UTF-8).") from error
    if "xl/workbook.xml" not in names:
        kind = "an OpenDocument file" if "mimetype" in names else "a packed file, but no Excel workbook"
        raise TableError(f"{path} is {kind}: save the table as .xlsx or as CSV (UTF-8) and give that file.")
    if size > _MOST:
        raise TableError(f"{path} unpacks to {size / 1e6:.0f} MB, more than {_MOST / 1e6:.0f}: save it as CSV (UTF-8).")


def _area(chosen: Worksheet) -> tuple[int, int, int, int]:
    """First column and row, last column and row: of the sheet's first table, or of all that is used."""
    from openpyxl.utils import range_boundaries

    refs = [range_boundaries(one.ref) for one in chosen.tables.values()]
    found = min(refs, key=lambda area: (area[1], area[0]), default=None)
    if found is None:
        return chosen.min_column, chosen.min_row, chosen.max_column, chosen.max_row
    left, upper, right, lower = (int(side or 1) for side in found)
    return left, upper, right, lower


def _notes(chosen: Worksheet, full: list[str], upper: int, lower: int) -> list[str]:
    others = [repr(title) for title in full if title != chosen.title]
    notes = [f"the sheet {chosen.title!r} is read, not {', '.join(others)}"] if others else []
    tables = list(chosen.tables)
    if len(tables) > 1:
        notes.append(f"the table {tables[0]!r} is read, not {', '.join(map(repr, tables[1:]))}")
    hidden = [str(n) for n in range(upper, lower + 1) if chosen.row_dimensions[n].hidden]
    if hidden:
        notes.append(f"rows that the sheet hides are read as well: {', '.join(hidden[:12])}")
    return notes


def _shown(value: Any, form: str) -> str:
    """A cell's value as the sheet shows it, as far as that matters in an address: leading zeros above all."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, (int, float)):
        whole = int(value) if float(value).is_integer() else None
        return str(value) if whole is None else _digits(whole, form or "") or str(whole)
    if isinstance(value, datetime.datetime) and value.time() == datetime.time():
        return value.date().isoformat()
    return str(value)


def _digits(value: int, form: str) -> str:
    """A whole number in a format of zeros and signs ("00000", "D-"00000); empty for another format."""
    tokens = _TOKEN.findall(_BRACKETS.sub("", form.split(";")[0]))
    zeros = tokens.count("0")
    if zeros < 2 or value < 0 or any(token in "#?.,%Eemdyhs@/" for token in tokens):
        return ""
    digits = str(value).zfill(zeros)
    rest, made = list(digits), list[str]()
    for token in reversed(tokens):
        literal = token[1] if token.startswith("\\") else token.strip('"')
        made += [rest.pop() if token == "0" else literal]
    return "".join([*rest, *reversed(made)])
