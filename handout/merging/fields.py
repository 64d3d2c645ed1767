"""What a row of a table fills a letter with: its cells by the names of their columns, and how the row is made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from handout.errors import InputError
from handout.printing.address_table import Addresses
from handout.printing.batch import MOST_COPIES
from handout.printing.column_names import SETTINGS, identifier
from handout.printing.columns import Column
from handout.printing.rows import Row

# role of a column → what a letter may call it whatever its header is
_ROLES = {
    **{role: role for role in ("name", "title", "suffix", "company", "street", "postcode", "city", "state", "country")},
    "first": "first_name",
    "last": "last_name",
    "middle": "middle_name",
}
ADDRESS = "address"  # the name of the lines of an address, where the table has one


@dataclass(frozen=True)
class RowManner:
    """How a row is made where its own columns say so, else "": hand, pen, language; `text` : its whole letter."""

    text: str = ""
    hand: str = ""
    pen: str = ""
    language: str = ""


@dataclass(frozen=True)
class Fields:
    """The columns of a table as a letter names them.

    Examples
    --------
    ``First name`` is ``first_name``, ``Straße/Nr.`` is ``strasse_nr``; a column that is understood as a first name is
    ``first_name`` too where no other is called so, and the lines of the address are ``address``.
    """

    columns: tuple[Column, ...]

    @cached_property
    def headers(self) -> tuple[str, ...]:
        """Of all columns that have one."""
        return tuple(column.header for column in self.columns if column.header)

    @cached_property
    def of(self) -> Mapping[str, str]:
        """Name in a letter → header."""
        names: dict[str, str] = {}
        for header in self.headers:
            if name := identifier(header):
                names.setdefault(name, header)
        for column in self.columns:
            if column.header and column.role in _ROLES:
                names.setdefault(_ROLES[column.role], column.header)
        return names

    @property
    def names(self) -> tuple[str, ...]:
        """What a letter may name."""
        return (*self.of, *([ADDRESS] if ADDRESS not in self.of else []))

    def used(self, names: Sequence[str]) -> frozenset[str]:
        """The headers that some names of a letter, or headers, mean."""
        return frozenset(self.of.get(name, name) for name in names)

    def values(self, row: Row) -> dict[str, str]:
        """Name → cell."""
        found = {name: row.cells.get(header, "") for name, header in self.of.items()}
        found.setdefault(ADDRESS, "\n".join(row.lines))
        return found

    def manner(self, row: Row) -> RowManner:
        """How a row is made by its own columns."""
        said = {column.role: row.cells.get(column.header, "") for column in self.columns if column.role in SETTINGS}
        return RowManner(**{name: said.get(name, "") for name in ("text", "hand", "pen", "language")})

    def says(self, setting: str) -> bool:
        """Whether a column says that of every row."""
        return any(column.role == setting for column in self.columns)


def counted(table: Addresses) -> Addresses:
    """The table with the number of copies that its rows ask for; what is no number is the row's problem.

    A row that asks for none is left out, which the notes say.
    """
    column = next((column for column in table.columns if column.role == "copies"), None)
    if column is None:
        return table
    rows, none = list[Row](), list[int]()
    for row in table:
        text = row.cells.get(column.header, "")
        if text.strip() == "0":
            none.append(row.number)
            continue
        try:
            rows.append(replace(row, copies=_copies(text, column)))
        except InputError as error:
            rows.append(replace(row, problem=row.problem or str(error)))
    left = (f"{column.name} is 0 in {len(none)} of the rows, of which nothing is made",) if none else ()
    return replace(table, rows=tuple(rows), notes=(*table.notes, *left))


def _copies(text: str, column: Column) -> int:
    """How many copies a cell asks for; an empty one for one."""
    number = int(text) if text.isascii() and text.isdecimal() and len(text) < 6 else 1 if not text else 0
    if not 1 <= number <= MOST_COPIES:
        raise InputError(
            f"the cell under {column.name} says {text[:20]!r}, which is no number of copies from 0 to {MOST_COPIES}"
        )
    return number


def doubts(row: Row, headers: Sequence[str]) -> tuple[str, ...]:
    """What the user should look at in the cells that a letter writes: formulas that have not been worked out."""
    formulas = [header for header in headers if row.cells.get(header, "")[:1] == "="]
    return tuple(f"the cell under {header!r} is a formula, which is written as it stands" for header in formulas)
