"""Address tables as people have them: CSV of any delimiter and encoding, workbooks, address books, with any header."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from handout import units
from handout.errors import TableError
from handout.printing import address_rows, rows
from handout.printing.address_rows import ColumnAccount
from handout.printing.column_names import KINDS, SETTINGS, normalise
from handout.printing.columns import (
    LABEL,
    Column,
    ColumnAssignment,
    addressable,
    assign,
    columns,
    list_understood,
    names_any,
    read_assignments,
)
from handout.printing.rows import TableRow
from handout.printing.table_files import TableRecord, TableSheet, header_candidates, read_sheet


@dataclass(frozen=True)
class Addresses(Sequence[TableRow]):
    """The rows of a table, and how it was read.

    used : header of a column → its role; unused : headers of the columns of which nothing is written; notes : what
    has to be said of the table as a whole, each a phrase; columns : as they were understood.
    """

    rows: tuple[TableRow, ...]
    used: tuple[tuple[str, str], ...] = ()
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    columns: tuple[Column, ...] = ()

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, at: Any) -> Any:
        return self.rows[at]

    def facts(self) -> dict[str, list[str] | list[dict[str, str]]]:
        """What `--json` prints of it."""
        return {
            "used": [{"column": header, "as": role} for header, role in self.used],
            "unused": list(self.unused),
            "notes": list(self.notes),
        }


@dataclass(frozen=True)
class _Headed:
    """A sheet whose columns are known; `header` is the row of their names, 0 if there is none."""

    path: Path
    sheet: TableSheet
    header: int
    columns: Sequence[Column]
    notes: tuple[str, ...] = ()


def read_addresses(
    path: Path, columns: Sequence[str] = (), address: str = "", nameless: bool = False, elsewhere: Collection[str] = ()
) -> Addresses:
    """Read a table of addresses: delimited text (CSV), or an Excel workbook where openpyxl is installed.

    The delimiter (comma, semicolon, tab, stroke), the encoding (a guess is told in the notes), the header
    and the meaning of the columns are found out; what is not used is told there, too.  Blank rows are skipped but
    counted; a row that cannot be addressed is returned with its `problem`.

    columns : what columns hold, where the headers do not say it: ``"name=Guest(s)"``, ``"1=name,2=street"``.
    address : which of several addresses of a row is written: ``"home"``, ``"business"``, ``"2"`` …
    nameless : whether a table without any name may be.
    elsewhere : names, in the cells of rows, of columns that a letter uses.

    Raises TableError: no table, empty, no column that could hold an address, no rows, no names, a quotation mark never
        closed, two columns for one thing that differ.
    Raises InputError: `columns` names what the table does not have.
    """
    table = _read_table(path, columns)
    if not addressable(table.columns):
        raise TableError(_explain_unaddressable(table))
    records, notes = _records_below(table)
    kind = _find_kind(address, table.columns)
    return _build_addresses(replace(table, notes=(*table.notes, *notes)), records, kind, nameless, elsewhere)


def read_rows(path: Path, columns: Sequence[str] = ()) -> Addresses:
    """Read a table of which no address is wanted, as `read_addresses` reads one: its rows have cells and no lines.

    Raises TableError, InputError: as there, but for what concerns addresses.
    """
    table = _read_table(path, columns)
    records, notes = _records_below(table)
    rows_ = tuple(address_rows.without_address(n, record.cells, table.columns) for n, record in records)
    return Addresses(rows_, notes=(*table.sheet.notes, *table.notes, *notes), columns=tuple(table.columns))


def _read_table(path: Path, columns: Sequence[str]) -> _Headed:
    """The table with its columns, as the headers and the user say."""
    assignments = read_assignments(columns)
    table = _find_header(path, read_sheet(path), assignments)
    return replace(table, columns=assign(assignments, table.columns))


def _find_header(path: Path, sheet: TableSheet, assignments: Sequence[ColumnAssignment]) -> _Headed:
    """The table with its header found: the row that the user names columns of, the first, or the likeliest."""
    candidates = header_candidates(sheet.records)
    if not candidates:
        raise TableError(f"{path} is empty.")
    columns_of = {n: columns([_one_line(cell) for cell in sheet.records[n - 1].cells]) for n in candidates}
    header = _header_row(columns_of, assignments)
    if not header:
        width = max(len(record.cells) for record in sheet.records)
        note = f"there is no header: row {candidates[0]} is the first address"
        return _Headed(path, sheet, 0, [Column(n, "") for n in range(1, width + 1)], (note,))
    above = [n for n in candidates if n < header]
    verb = "is" if len(above) == 1 else "are"
    skipped = (f"{rows.name_rows(above)} above the header {verb} not read",) if above else ()
    return _Headed(path, sheet, header, columns_of[header], skipped)


def _header_row(columns_of: Mapping[int, Sequence[Column]], assignments: Sequence[ColumnAssignment]) -> int:
    """The header among the rows that may be it, by their numbers; 0 where the user tells columns by their places."""
    candidates = _drop_group_heads(columns_of)
    named = [n for n, row in columns_of.items() if names_any(assignments, [column.header for column in row])]
    likely = [n for n in candidates if _like_a_header(columns_of[n])]
    # a place that is only left out says nothing of what the others hold
    by_place = {bool(assignment.place) for assignment in assignments if assignment.role} == {True}
    if by_place and not named and likely[:1] != candidates[:1]:
        return 0
    first = candidates[:1] if addressable(columns_of[candidates[0]]) else []
    return (named or first or likely or candidates)[0]


def _drop_group_heads(columns_of: Mapping[int, Sequence[Column]]) -> list[int]:
    """The rows but for those that head groups of the columns that the row below names: they have gaps, and say less."""

    def size(n: int) -> tuple[int, int]:
        row = columns_of[n]
        return sum(bool(column.header) for column in row), sum(column.role is not None for column in row)

    heads = {n for n in columns_of if n + 1 in columns_of and _like_a_header(columns_of[n + 1])}
    heads = {n for n in heads if all(here < below for here, below in zip(size(n), size(n + 1), strict=True))}
    return [n for n in columns_of if n not in heads]


def _like_a_header(row: Sequence[Column]) -> bool:
    """Whether a row names columns of an address, and more than one."""
    return addressable(row) and sum(column.role is not None for column in row) > 1


def _one_line(cell: str) -> str:
    return " ".join(cell.split())


def _records_below(table: _Headed) -> tuple[list[tuple[int, TableRecord]], list[str]]:
    """The rows below the header with their numbers, and what has to be said of those that are skipped."""
    header = [column.header for column in table.columns if column.header]
    records, repeated = [], []
    for n, record in enumerate(table.sheet.records, 1):
        if n <= table.header:
            continue
        if table.header and [text for cell in record.cells if (text := _one_line(cell))] == header:
            repeated.append(n)
        elif record.is_filled:
            records.append((n, record))
    if not records:
        where = f"below the header in row {table.header}" if table.header else "in it"
        raise TableError(f"{table.path}: there are no rows {where}.")
    notes = [*_encoding_note(table.sheet, records), *_header_notes(table, repeated), *_unseen_note(records)]
    return records, notes


def _header_notes(table: _Headed, repeated: Sequence[int]) -> Iterator[str]:
    """Notes on a header that comes again in some rows, and on one of which nothing is known: it may be a row itself."""
    if repeated:
        verb = "is" if len(repeated) == 1 else "are"
        yield f"the header comes again in {rows.name_rows(repeated)}, which {verb} skipped"
    if table.header and all(column.role is None for column in table.columns):
        named = ", ".join(column.header for column in table.columns[: units.MOST_NAMED] if column.header)
        below = "if it is a row like those below, write headings above it"
        yield f"row {table.header} is taken for the headings, none of which is known ({named}): {below}"


def _encoding_note(sheet: TableSheet, records: Sequence[tuple[int, TableRecord]]) -> Iterator[str]:
    """A note on the encoding that was guessed, with some words that show whether it is right."""
    guessed = (record for _, record in records if sheet.encoding and sheet.odd & set(record.lines))
    words = dict.fromkeys(word for record in guessed for cell in record.cells for word in cell.split())
    if accented := [repr(word) for word in words if not word.isascii()]:
        check = ", ".join(accented[: units.MOST_NAMED])
        yield f"read as {sheet.encoding} because it is not UTF-8: check the accents in {check}"


def _unseen_note(records: Sequence[tuple[int, TableRecord]]) -> Iterator[str]:
    """A note on the invisible characters of some rows, where there are any."""
    chars = list(dict.fromkeys(char for _, record in records for char in record.unseen))
    if chars:
        where = rows.name_rows([n for n, record in records if record.unseen])
        yield f"what is invisible in {where} is not written: {', '.join(chars[: units.MOST_NAMED])}"


def _build_addresses(
    table: _Headed, records: Sequence[tuple[int, TableRecord]], kind: str, nameless: bool, elsewhere: Collection[str]
) -> Addresses:
    account = ColumnAccount()
    addressed = []
    for n, record in records:
        try:
            addressed.append(address_rows.row(n, record.cells, table.columns, kind, account))
        except TableError as error:
            raise TableError(f"{table.path}: {error}") from None
    addressed, doubts = address_rows.warn_of_codes(addressed, account)
    if not account.has_names and not nameless and any(row.lines for row in addressed):
        raise TableError(_explain_nameless(table))
    cells, numbers = [record.cells for _, record in records], [row.number for row in addressed]
    named = zip(table.columns, address_rows.cell_names(table.columns), strict=True)
    places = {column.number for column, name in named if name in elsewhere}
    notes = address_rows.notes(table.columns, cells, account, numbers, places)
    used, unused = _used_and_unused(table.columns, cells, account, places)
    return Addresses(
        tuple(addressed),
        tuple((_column_title(column), str(column.role or "letter")) for column in used),
        tuple(map(_column_title, unused)),
        (*table.sheet.notes, *table.notes, *notes, *doubts),
        tuple(table.columns),
    )


def _used_and_unused(
    columns: Sequence[Column], cells: Sequence[Sequence[str]], account: ColumnAccount, elsewhere: Collection[int]
) -> tuple[list[Column], list[Column]]:
    """The columns of which something is written (or would be, were they not empty), and the others with content."""
    filled = {column.number for column in columns if address_rows.holds(column, cells)}
    used, unused = [], []
    for column in columns:
        empty = column.role and column.number not in filled
        said = column.role in (LABEL, *SETTINGS) or column.number in elsewhere
        if said or column.number in account.written or empty:
            used.append(column)
        elif column.header or column.number in filled:
            unused.append(column)
    return used, unused


def _column_title(column: Column) -> str:
    return column.header or f"column {column.number}"


def _find_kind(address: str, columns: Sequence[Column]) -> str:
    """The kind of address that is asked for, as the columns have it.

    Raises TableError: the table has one address a row, or none of that kind.
    """
    if not address:
        return ""
    kinds = list(dict.fromkeys(column.kind for column in columns if column.kind))
    wanted = KINDS.get(normalise(address), normalise(address))
    if wanted in kinds or any(column.role == LABEL for column in columns):
        return wanted
    has = f"has {', '.join(kinds)}" if kinds else "has one address a row"
    raise TableError(f"address: the table {has}, and no {address!r}.")


def _explain_unaddressable(table: _Headed) -> str:
    """Why no address can be read, and the way out."""
    if not table.header:
        return f"{table.path}: none of the columns that --columns names holds a street, a place or an address."
    headers = [column.header for column in table.columns if column.header]
    named = ", ".join(map(repr, headers)) or "none"
    where = f"{table.path}: row {table.header} names no column for an address"
    if any(char.isdigit() for header in headers for char in header):
        guesses = ("name", "street", "place")[: len(table.columns)]
        places = ",".join(f"{n}={guess}" for n, guess in enumerate(guesses, 1))
        return (
            f"{where}; it looks like an address itself, as if the table had no header: write one above it, or say what "
            f'the columns hold by their places, such as --columns "{places}".'
        )
    return f"{where}; found: {named}; understood: {list_understood()}; or {address_rows.WAY_OUT}."


def _explain_nameless(table: _Headed) -> str:
    unknown = [column for column in table.columns if column.role is None and column.header]
    hint = f"; not understood: {', '.join(column.name for column in unknown)}" if unknown else ""
    return (
        f"{table.path}: no row has a name{hint}: say which column holds it, such as --columns "
        f'"name={unknown[0].header if unknown else 1}", or write addresses without names with --no-name.'
    )
