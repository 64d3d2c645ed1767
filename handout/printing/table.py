"""Address tables as people have them: CSV of any delimiter and encoding, workbooks, address books, with any header."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, overload

from handout.errors import TableError
from handout.printing import delimited, filing, mapping
from handout.printing.address import Row
from handout.printing.columns import LABEL, Column, addressable, columns, understood
from handout.printing.delimited import Record, Sheet
from handout.printing.filing import Account
from handout.printing.lexicon import KINDS, key

# the first bytes of files that people give by mistake
_SIGNATURES = {
    b"\xd0\xcf\x11\xe0": "an old Excel workbook (.xls)",
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"%PDF": "a PDF document",
    b"\x1f\x8b": "a packed file",
}
_PACKED = b"PK\x03\x04"


@dataclass(frozen=True)
class Addresses(Sequence[Row]):
    """The rows of a table, and how it was read.

    used : header of a column → its role; unused : headers of the columns of which nothing is written; notes : what
    has to be said of the table as a whole, each a phrase.
    """

    rows: tuple[Row, ...]
    used: tuple[tuple[str, str], ...] = ()
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    @overload
    def __getitem__(self, at: int) -> Row: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[Row, ...]: ...

    def __getitem__(self, at: int | slice) -> Row | tuple[Row, ...]:
        return self.rows[at]

    def facts(self) -> dict[str, Any]:
        """What `--json` prints of it."""
        return {
            "used": [{"column": header, "as": role} for header, role in self.used],
            "unused": list(self.unused),
            "notes": list(self.notes),
        }


def read_addresses(path: Path, columns: Sequence[str] = (), address: str = "", nameless: bool = False) -> Addresses:
    """Read a table of addresses: delimited text (CSV), or an Excel workbook where openpyxl is installed.

    The delimiter (comma, semicolon, tab, stroke), the encoding (a guess is told in the rows' warnings), the header
    and the meaning of the columns are found out; what is not used is told in the notes.  Blank rows are skipped but
    counted; a row that cannot be addressed is returned with its `problem`.

    Parameters
    ----------
    path : Path
    columns : sequence of str
        What columns hold, where the headers do not say it: ``"name=Guest(s)"``, ``"1=name,2=street"``.
    address : str
        Which of several addresses of a row is written: ``"home"``, ``"business"``, ``"2"`` …
    nameless : bool
        Whether a table without any name may be.

    Raises
    ------
    TableError
        No table, empty, no column that could hold an address, no rows, no names, a quotation mark never closed, two
        columns for one thing that differ.
    InputError
        `columns` names what the table does not have.
    """
    given = mapping.read(columns)
    sheet = _sheet(path)
    top, found, notes = _header(path, sheet, given)
    found = mapping.apply(given, found)
    if not addressable(found):
        raise TableError(_unknown(path, sheet, top, found))
    kept = [(n, one) for n, one in enumerate(sheet.records, 1) if n > top and any(one.cells)]
    again = [n for n, one in kept if top and _same(one, found)]
    below = [(n, one) for n, one in kept if n not in again and delimited.filled(one)]
    if again:
        notes.append(
            f"the header comes again in {filing.rows_named(again)}, which {'is' if len(again) == 1 else 'are'} skipped"
        )
    if not below:
        where = f"below the header in row {top}" if top else "in it"
        raise TableError(f"{path}: there are no addresses {where}.")
    wanted = _wanted(address, found)
    return _addresses(path, sheet, found, below, wanted, nameless, notes)


def _addresses(
    path: Path,
    sheet: Sheet,
    found: Sequence[Column],
    below: Sequence[tuple[int, Record]],
    wanted: str,
    nameless: bool,
    notes: Sequence[str],
) -> Addresses:
    account = Account()
    made = []
    for n, record in below:
        try:
            row = filing.row(n, record.cells, found, wanted, account)
        except TableError as error:
            raise TableError(f"{path}: {error}") from None
        made.append(_with_encoding(row, sheet, record))
    rows, doubts = filing.questioned(made, account)
    if not account.named and not nameless and any(row.lines for row in rows):
        raise TableError(_nameless(path, found))
    numbers = [row.number for row in rows]
    said = [*sheet.notes, *notes, *filing.notes(found, [one.cells for _, one in below], account, numbers), *doubts]
    cells = [one.cells for _, one in below]
    used = [one for one in found if one.role == LABEL or one.number in account.written or _empty(one, cells)]
    unused = [one for one in found if one not in used and (one.header or filing.holds(one, cells))]
    return Addresses(
        tuple(rows),
        tuple((one.header or f"column {one.number}", str(one.role)) for one in used),
        tuple(one.header or f"column {one.number}" for one in unused),
        tuple(said),
    )


def _empty(column: Column, cells: Sequence[Sequence[str]]) -> bool:
    return column.role is not None and not filing.holds(column, cells)


def _with_encoding(row: Row, sheet: Sheet, record: Record) -> Row:
    accented = next((word for cell in record.cells for word in cell.split() if not word.isascii()), "")
    if not (sheet.encoding and accented and sheet.odd & set(record.lines)):
        return row
    said = f"read as {sheet.encoding} because it is not UTF-8: check the accents in {accented!r}"
    return replace(row, warnings=(*row.warnings, said))


def _sheet(path: Path) -> Sheet:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise TableError(f"{path} cannot be read: {error.strerror or error}.") from error
    if data.startswith(_PACKED):
        from handout.printing import workbook

        return workbook.sheet(path)
    kind = next((kind for signature, kind in _SIGNATURES.items() if data.startswith(signature)), None)
    if kind is not None:
        raise TableError(f"{path} is {kind}: save the table as CSV (UTF-8) and give that file.")
    return delimited.sheet(path, data)


def _header(path: Path, sheet: Sheet, given: Sequence[mapping.Assignment]) -> tuple[int, list[Column], list[str]]:
    """The row of the header, 0 if there is none, the columns, and what has to be said of that."""
    tops = delimited.candidates(sheet.records)
    if not tops:
        raise TableError(f"{path} is empty.")
    cells = {top: [_line(cell) for cell in sheet.records[top - 1].cells] for top in tops}
    found = {top: columns(row) for top, row in cells.items()}
    named = [top for top in tops if mapping.names_any(given, cells[top])]
    likely = [top for top in tops if addressable(found[top]) and sum(one.role is not None for one in found[top]) > 1]
    if not named and given and all(one.place for one in given) and likely[:1] != tops[:1]:
        width = max(len(record.cells) for record in sheet.records)
        return (
            0,
            [Column(n, "") for n in range(1, width + 1)],
            [f"there is no header: row {tops[0]} is the first address"],
        )
    top = (named or (tops[:1] if addressable(found[tops[0]]) else likely) or tops)[0]
    above = [n for n in tops if n < top]
    said = (
        [f"{filing.rows_named(above)} above the header {'is' if len(above) == 1 else 'are'} not read"] if above else []
    )
    return top, found[top], said


def _line(cell: str) -> str:
    return " ".join(cell.split())


def _same(record: Record, found: Sequence[Column]) -> bool:
    """Whether a row is the header once more."""
    cells = [_line(cell) for cell in record.cells]
    return [cell for cell in cells if cell] == [column.header for column in found if column.header]


def _wanted(address: str, found: Sequence[Column]) -> str:
    """The kind of address that is asked for, as the columns have it.

    Raises
    ------
    TableError
        The table has one address a row, or none of that kind.
    """
    if not address:
        return ""
    kinds = list(dict.fromkeys(column.kind for column in found if column.kind))
    wanted = KINDS.get(key(address), key(address))
    if wanted in kinds or any(column.role == LABEL for column in found):
        return wanted
    has = f"has {', '.join(kinds)}" if kinds else "has one address a row"
    raise TableError(f"address: the table {has}, and no {address!r}.")


def _unknown(path: Path, sheet: Sheet, top: int, found: Sequence[Column]) -> str:
    """Why no address can be read, and the way out."""
    if not top:
        return f"{path}: none of the columns that --columns names holds a street, a place or an address."
    headers = [column.header for column in found if column.header]
    named = ", ".join(map(repr, headers)) or "none"
    if any(char.isdigit() for header in headers for char in header):
        say = ",".join(f"{n}={guess}" for n, guess in enumerate(("name", "street", "place")[: len(found)], 1))
        return (
            f"{path}: row {top} names no column for an address; it looks like an address itself, as if the table had "
            f'no header: write one above it, or say what the columns hold by their places, such as --columns "{say}".'
        )
    return (
        f"{path}: row {top} names no column for an address; found: {named}; understood: {understood()}; or "
        f"{filing.WAY_OUT}."
    )


def _nameless(path: Path, found: Sequence[Column]) -> str:
    unused = [column.name for column in found if column.role is None and column.header]
    told = f"; not understood: {', '.join(unused)}" if unused else ""
    return (
        f"{path}: no row has a name{told}: say which column holds it, such as --columns "
        f'"name={next((column.header for column in found if column.role is None and column.header), 1)}", '
        "or write addresses without names with --no-name."
    )
