"""What a row of a table fills a letter with: its cells by the names of their columns, and how the row is made."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

from handout.merging.template import LetterTemplate
from handout.printing.address_rows import cell_names
from handout.printing.address_table import Addresses
from handout.printing.batch import MOST_COPIES
from handout.printing.column_names import SETTINGS, identifier
from handout.printing.columns import Column
from handout.printing.rows import TableRow
from handout.units import MOST_NAMED

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
        """Of all columns that have one, as `TableRow.cells` has them."""
        return tuple(name for name in cell_names(self.columns) if name)

    @cached_property
    def headers_by_name(self) -> Mapping[str, str]:
        """Name in a letter → header; columns of one header have their places in their names, and no other."""
        names: dict[str, str] = {}
        for header in self.headers:
            if name := identifier(header):
                names.setdefault(name, header)
        for column, header in zip(self.columns, cell_names(self.columns), strict=True):
            if header and column.role in _ROLES and _ROLES[column.role] not in self.repeated_names:
                names.setdefault(_ROLES[column.role], header)
        return names

    @cached_property
    def repeated_names(self) -> Mapping[str, Sequence[str]]:
        """A name that several columns have → the names that tell them apart."""
        own = [
            (identifier(column.header), name)
            for column, name in zip(self.columns, cell_names(self.columns), strict=True)
            if name != column.header
        ]
        return {name: [identifier(header) for each, header in own if each == name] for name, _ in own}

    def check(self, letter: LetterTemplate, table: str) -> None:
        """Refuse names of a letter that no column has, or several.

        Raises InputError: the message has the line of the letter.
        """
        for name, apart in self.repeated_names.items():
            if name in letter.names and name not in self.headers_by_name:
                raise letter.wrong(
                    name,
                    f"{table} has {len(apart)} columns called {name!r}, and the letter does not say which: write "
                    f"{' or '.join(f'{{{{ {each} }}}}' for each in apart)} for the one at that place, or give each a "
                    "name of its own",
                )
        letter.check(self.names, self.headers, table)

    @property
    def names(self) -> tuple[str, ...]:
        """What a letter may name."""
        return (*self.headers_by_name, *([ADDRESS] if ADDRESS not in self.headers_by_name else []))

    def used_headers(self, names: Sequence[str]) -> frozenset[str]:
        """The headers that some names of a letter, or headers, mean."""
        return frozenset(self.headers_by_name.get(name, name) for name in names)

    def values(self, row: TableRow) -> dict[str, str]:
        """Name → cell."""
        found = {name: row.cells.get(header, "") for name, header in self.headers_by_name.items()}
        found.setdefault(ADDRESS, "\n".join(row.lines))
        return found

    def manner(self, row: TableRow) -> RowManner:
        """How a row is made by its own columns."""
        named = zip(self.columns, cell_names(self.columns), strict=True)
        said = {column.role: row.cells.get(name, "") for column, name in named if column.role in SETTINGS}
        return RowManner(**{each.name: said.get(each.name, "") for each in fields(RowManner)})

    def says(self, setting: str) -> bool:
        """Whether a column says that of every row."""
        return any(column.role == setting for column in self.columns)


def count_copies(table: Addresses) -> Addresses:
    """The table with the number of copies that its rows ask for; what is no number is the row's problem.

    A row that asks for none is left out, which the notes say.
    """
    named = zip(table.columns, cell_names(table.columns), strict=True)
    column, name = next((each for each in named if each[0].role == "copies"), (None, ""))
    if column is None:
        return table
    rows, none = list[TableRow](), list[int]()
    for row in table:
        text = row.cells.get(name, "")
        if text.strip() == "0":
            none.append(row.number)
            continue
        number = int(text) if text.isascii() and text.isdecimal() and len(text) < 6 else 1 if not text else 0
        if 1 <= number <= MOST_COPIES:
            rows.append(replace(row, copies=number))
        else:
            said = f"the cell under {column.name} says {text[:20]!r}"
            problem = f"{said}, which is no number of copies from 0 to {MOST_COPIES}"
            rows.append(replace(row, problem=row.problem or problem))
    left = (f"{column.name} is 0 in {len(none)} of the rows, of which nothing is made",) if none else ()
    return replace(table, rows=tuple(rows), notes=(*table.notes, *left))


def tell_repeats(table: Addresses, used: Collection[str], *, once: bool) -> Addresses:
    """The table with a note on rows that are the same, of which with `once` only the first are kept.

    Rows are the same if their addresses are, how they are made, and the cells that a letter uses (`used`, headers);
    without addresses, if all their cells are.
    """
    named = zip(table.columns, cell_names(table.columns), strict=True)
    looked = sorted({*used, *(name for column, name in named if column.role in SETTINGS and column.role != "copies")})
    groups: dict[tuple[str, ...], list[int]] = {}
    for row in table:
        groups.setdefault(_identity(row, looked), []).append(row.number)
    again = {number for numbers in groups.values() for number in numbers[1:]}
    if not again:
        return table
    what = "only the first of them is made" if once else "each is made; --once makes only the first of them"
    note = f"rows {_name_groups([some for some in groups.values() if len(some) > 1])} are the same: {what}"
    kept = tuple(row for row in table if row.number not in again) if once else table.rows
    return replace(table, rows=kept, notes=(*table.notes, note))


def _name_groups(groups: Sequence[Sequence[int]]) -> str:
    """Groups of rows in a few words, however many and large they are."""
    listed = list[str]()
    for first, *rest in groups[:MOST_NAMED]:
        last = f"{len(rest) - MOST_NAMED} others" if len(rest) > MOST_NAMED + 1 else str(rest.pop())
        named = ", ".join(map(str, [first, *rest[:MOST_NAMED]]))
        listed.append(f"{named} and {last}")
    more = f", and {len(groups) - MOST_NAMED} others" if len(groups) > MOST_NAMED else ""
    return ", rows ".join(listed) + more


def _identity(row: TableRow, looked: Sequence[str]) -> tuple[str, ...]:
    """What rows that are the same have in common, but for case and spaces; one with a problem is told for that."""
    if row.problem:
        return (str(row.number),)
    cells = [row.cells.get(name, "") for name in looked] if row.lines else row.cells.values()
    return tuple(" ".join(text.casefold().split()) for text in (*row.lines, "", *cells))


def doubts(row: TableRow, headers: Sequence[str]) -> tuple[str, ...]:
    """What the user should look at in the cells that a letter writes: formulas that have not been worked out."""
    formulas = [header for header in headers if row.cells.get(header, "")[:1] == "="]
    return tuple(f"the cell under {header!r} is a formula, which is written as it stands" for header in formulas)
