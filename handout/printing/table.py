"""Address tables as people have them: any of the usual delimiters, encodings and headers."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from handout.errors import TableError
from handout.printing import address, columns
from handout.printing.address import Row

_DELIMITERS = ",;\t"
# the first bytes of files that people give by mistake
_SIGNATURES = {
    b"PK\x03\x04": "a spreadsheet or another packed file",
    b"\xd0\xcf\x11\xe0": "an Excel workbook",
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"%PDF": "a PDF document",
    b"\x1f\x8b": "a packed file",
}
_BOMS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?\s*\Z', re.IGNORECASE)
_MOST_LINES = 20


@dataclass(frozen=True)
class _Record:
    """One row of cells; `lines` are the physical lines it came from, counted from 0."""

    cells: list[str]
    lines: range


def read_addresses(path: Path) -> list[Row]:
    """Read a CSV of addresses.

    The delimiter (comma, semicolon, tab), the encoding (UTF-8 with or without BOM, UTF-16 with BOM, otherwise
    Windows-1252, which the rows' warnings tell) and the meaning of the columns are found out.  Blank rows are
    skipped but counted; a row that cannot be addressed is returned with its `problem`.

    Raises
    ------
    TableError
        No text file, empty, no column that could hold an address, no rows, a quotation mark never closed.
    """
    lines, odd = _lines(path)
    separator = _SEPARATOR_LINE.match(lines[0])
    if separator is not None:
        lines, odd = lines[1:], {n - 1 for n in odd}
    records, headers, top = _table(path, lines, separator.group(1) if separator else _DELIMITERS)
    found = columns.roles(headers)
    if not columns.addressable(found):
        named = ", ".join(repr(h) for h in headers if h) or "none"
        raise TableError(
            f"{path}: row {top} names no column for an address; found: {named}; understood: {columns.understood()}."
        )
    below = [(n, record) for n, record in enumerate(records, 1) if n > top and any(map(address.tidy, record.cells))]
    if not below:
        raise TableError(f"{path}: there are no addresses below the header in row {top}.")
    return [_row(n, record, headers, found, bool(odd & set(record.lines))) for n, record in below]


def _table(path: Path, lines: list[str], delimiters: str) -> tuple[list[_Record], list[str], int]:
    """Records, headers and the number of the header's row."""
    records, unclosed = max((_records(lines, d) for d in delimiters), key=lambda found: _likelihood(found[0]))
    if unclosed:
        raise TableError(f"{path}: row {unclosed}: a quotation mark is opened and never closed.")
    for n, record in enumerate(records, 1):
        longest = max((cell.count("\n") for cell in record.cells), default=0)
        if longest > _MOST_LINES:
            raise TableError(
                f"{path}: row {n}: a cell runs over {longest + 1} lines, more than {_MOST_LINES}: "
                "a quotation mark is probably missing in it."
            )
    top = _header(records)
    if top is None:
        raise TableError(f"{path} is empty.")
    return records, [" ".join(address.tidy(cell).split()) for cell in records[top - 1].cells], top


def _lines(path: Path) -> tuple[list[str], set[int]]:
    """The file's lines with their ends, and the numbers (from 0) of those that are not UTF-8."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise TableError(f"{path} cannot be read: {error.strerror or error}.") from error
    data = _utf8(path, data)
    lines, odd = [], set()
    for n, line in enumerate(data.splitlines(keepends=True)):
        try:
            lines.append(line.decode("utf-8"))
        except UnicodeDecodeError:
            odd.add(n)
            lines.append(_windows(path, n, line))
    if not any(line.strip() for line in lines):
        raise TableError(f"{path} is empty.")
    return lines, odd


def _utf8(path: Path, data: bytes) -> bytes:
    """The text without its BOM, out of UTF-16 if it was in it."""
    for bom, encoding in _BOMS.items():
        if data.startswith(bom):
            try:
                data = data.decode(encoding).encode("utf-8")
            except UnicodeError as error:
                raise TableError(f"{path} begins as UTF-16 but is damaged: save it again as CSV (UTF-8).") from error
    kind = next((kind for signature, kind in _SIGNATURES.items() if data.startswith(signature)), None)
    if kind is None and re.search(rb"[\x00-\x08\x0e-\x1a]", data):
        kind = "no text file"
    if kind is not None:
        raise TableError(f"{path} is {kind}: save the table as CSV (UTF-8) and give that file.")
    return data.removeprefix(b"\xef\xbb\xbf")


def _windows(path: Path, n: int, line: bytes) -> str:
    try:
        return line.decode("cp1252")
    except UnicodeDecodeError as error:
        raise TableError(
            f"{path}: line {n + 1} is neither UTF-8 nor Windows-1252: save the table as CSV (UTF-8)."
        ) from error


def _records(lines: list[str], delimiter: str) -> tuple[list[_Record], int]:
    """The records, and the row in which a quotation mark stays open to the end of the file (0: none)."""
    for strict in (True, False):
        # strict finds the open quote; what else it dislikes (`"Ada" Ltd`) is common and harmless
        reader = csv.reader(lines, delimiter=delimiter, strict=strict, skipinitialspace=True)
        records: list[_Record] = []
        try:
            start = 0
            for cells in reader:
                records.append(_Record(cells, range(start, reader.line_num)))
                start = reader.line_num
            return records, 0
        except csv.Error as error:
            if "unexpected end" in str(error) or not strict:
                return records, len(records) + 1
    raise AssertionError("unreachable")


def _header(records: Sequence[_Record]) -> int | None:
    # a row of nothing but another delimiter is as blank as can be
    written = (any(address.tidy(cell).strip(_DELIMITERS) for cell in record.cells) for record in records)
    return next((n for n, told in enumerate(written, 1) if told), None)


def _likelihood(records: Sequence[_Record]) -> tuple[int, int, int]:
    """How well a delimiter suits: headers understood, columns, few rows longer than the header."""
    top = _header(records)
    if top is None:
        return (0, 0, 0)
    header = records[top - 1].cells
    known = sum(role is not None for role in columns.roles(header))
    return known, len(header), -sum(len(record.cells) > len(header) for record in records)


def _row(n: int, record: _Record, headers: list[str], roles: list[str | None], windows: bool) -> Row:
    cells = [address.tidy(cell) for cell in record.cells]
    by_header = {header: cell for header, cell in zip(headers, cells, strict=False) if header}
    if any(cells[len(headers) :]):
        problem = (
            f"it has {len(cells)} cells where the header has {len(headers)}: "
            "put quotation marks round a cell that holds a delimiter"
        )
        return Row(n, (), (), problem, by_header)
    fields: dict[str, list[str]] = {}
    for role, cell in zip(roles, cells, strict=False):
        if role is not None and cell:
            fields.setdefault(role, []).append(cell)
    number_first = "number" in roles and "street" in roles and roles.index("number") < roles.index("street")
    lines, warnings, problem = address.lines(fields, number_first)
    accented = next((word for cell in cells for word in cell.split() if not word.isascii()), "")
    if windows and accented:
        warnings.append(f"read as Windows-1252 because it is not UTF-8: check the accents in {accented!r}")
    return Row(n, lines, tuple(warnings), problem, by_header)
