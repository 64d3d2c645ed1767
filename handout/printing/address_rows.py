"""Turns the rows of a table into addresses, and keeps an account of which columns were used."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace

from handout.errors import TableError
from handout.printing import address
from handout.printing.column_names import KINDS, SETTINGS, normalise
from handout.printing.columns import ADDRESS, LABEL, NAME_PARTS, PEOPLE, PLACES, Column
from handout.printing.rows import TableRow, name_rows

# of these an address has one: two that differ cannot both be written
_SINGLE = ("postcode", "city", "state", "country", "number", "place", "address")
_TOWNS = frozenset({"place", "postcode", "city", "address"})
_PREFERRED = ("", "home", "shipping", "business", "other", "billing")
_ERROR = re.compile(r"#(N/A|REF!|VALUE!|NAME\?|DIV/0!|NULL!|NUM!|BEZUG!|WERT!|NV)\Z")
_FEW = 3  # rows whose short postal codes are questioned one by one; set by eye
_CALLED = {"postcode": "postal code", "number": "house number", "place": "town"}

WAY_OUT = 'say what the columns hold with --columns "name=Guest(s),street=…"'


@dataclass(frozen=True)
class Cell:
    """A cell that is not empty, and its column, whose role is known."""

    column: Column
    text: str

    @property
    def role(self) -> str:
        return self.column.role or ""


@dataclass
class ColumnAccount:
    """What became of the columns of a table while its rows were made.

    written : places of the columns of which something was written; unwritten : place of a column → rows in which what
    it holds was not; other_addresses : kinds of address → rows in which an address of that kind was left for another
    one; code_doubts : row → what is doubtful about the postal code of an address without a country, "" for nothing.
    """

    written: set[int] = field(default_factory=set)
    unwritten: dict[int, list[int]] = field(default_factory=dict)
    other_addresses: dict[str, list[int]] = field(default_factory=dict)
    code_doubts: dict[int, str] = field(default_factory=dict)
    has_names: bool = False


def row(number: int, texts: Sequence[str], columns: Sequence[Column], wanted: str, account: ColumnAccount) -> TableRow:
    """Turn one row into an address; the account notes which of its cells were used.

    wanted : kind of address that is preferred, "" for the usual order.

    Raises TableError: two columns hold the same thing, and differ.
    """
    by_header = _name_cells(columns, texts)
    filled = [Cell(column, text) for column, text in zip(columns, texts, strict=False) if text]
    cells = [cell for cell in filled if cell.role not in ("", *SETTINGS)]
    problem = _unreadable(texts, columns, cells)
    if problem:
        return TableRow(number, (), (), problem, by_header)
    kind, warnings = _choose_kind(number, cells, wanted, account)
    chosen = _select_cells(kind, number, cells, columns, account)
    _check_single(number, chosen)
    fields = _collect_fields(chosen)
    roles = [column.role for column in columns]
    number_first = {"number", "street"} <= set(roles) and roles.index("number") < roles.index("street")
    lines, doubts, problem = address.lines(fields, number_first)
    if not problem:
        _note_written(number, chosen, lines, account)
        # an address that came as a whole begins with a name, which has no number in it
        whole = "address" in fields and not set(fields) & address.PARTS and len(lines) > 2
        if set(fields) & PEOPLE or (whole and not any(char.isdigit() for char in lines[0])):
            account.has_names = True
        else:
            warnings.append("it has no name")
        account.code_doubts[number] = address.short_code(lines)
    return TableRow(number, lines, (*warnings, *doubts), problem, by_header)


def cell_names(columns: Sequence[Column]) -> list[str]:
    """What each column is called in `TableRow.cells`: its header, with its place where others have it too."""
    count = Counter(column.header for column in columns)
    return [
        column.header if count[column.header] < 2 or not column.header else f"{column.header} ({column.number})"
        for column in columns
    ]


def _name_cells(columns: Sequence[Column], texts: Sequence[str]) -> dict[str, str]:
    """Every cell by the name of its column."""
    return {name: text for name, text in zip(cell_names(columns), texts, strict=False) if name}


def without_address(number: int, texts: Sequence[str], columns: Sequence[Column]) -> TableRow:
    """A row of which no address is wanted."""
    cells = [Cell(column, text) for column, text in zip(columns, texts, strict=False) if text]
    return TableRow(number, (), (), _unreadable(texts, columns, cells), _name_cells(columns, texts))


def _unreadable(texts: Sequence[str], columns: Sequence[Column], cells: Sequence[Cell]) -> str:
    """Why the cells of a row cannot be told apart or believed; empty if they can."""
    if any(texts[len(columns) :]):
        return (
            f"it has {len(texts)} cells where the header has {len(columns)}: "
            "put quotation marks round a cell that holds a delimiter"
        )
    broken = next((cell for cell in cells if _ERROR.match(cell.text)), None)
    return f"the cell under {broken.column.name} holds the error {broken.text}" if broken else ""


def _choose_kind(number: int, cells: Sequence[Cell], wanted: str, account: ColumnAccount) -> tuple[str, list[str]]:
    """Which of a row's addresses is written, and what to warn of; the others are noted."""
    kinds = _kinds_held(cells)
    if not kinds:
        return "", []
    labels = _read_labels(cells)
    matching = [kind for kind in kinds if wanted and wanted in (kind, labels.get(kind))]
    chosen = (matching or kinds)[0]
    for other in kinds:
        if other != chosen:
            account.other_addresses.setdefault(labels.get(other) or other, []).append(number)
    if wanted and not matching and any(kinds):
        called = labels.get(chosen) or chosen or "other"
        return chosen, [f"it has no {wanted} address: its {called} address is written"]
    return chosen, []


def _read_labels(cells: Sequence[Cell]) -> dict[str, str]:
    """Kind of address → the kind that a cell of its label says it is."""
    return {cell.column.kind: KINDS.get(key := normalise(cell.text), key) for cell in cells if cell.role == LABEL}


def _kinds_held(cells: Sequence[Cell]) -> list[str]:
    """The kinds of address that a row holds, the usual one first."""
    kinds = list(dict.fromkeys(cell.column.kind for cell in cells if cell.role in PLACES))
    if len(kinds) > 1 and not _complete_without_kind(cells):
        kinds = [kind for kind in kinds if kind]
    return sorted(kinds, key=lambda kind: _PREFERRED.index(kind) if kind in _PREFERRED else len(_PREFERRED))


def _complete_without_kind(cells: Sequence[Cell]) -> bool:
    """Whether the columns without a kind hold an address by themselves."""
    return any(not cell.column.kind and cell.role in _TOWNS for cell in cells)


def _select_cells(
    kind: str, number: int, cells: Sequence[Cell], columns: Sequence[Column], account: ColumnAccount
) -> list[Cell]:
    """The cells of the address that is written: those of its kind, and those without a kind that go with it.

    An employer does not go with a home address, nor another name with a parcel: that is noted.
    """
    fitting = [cell for cell in cells if cell.role != LABEL and cell.column.kind in ("", kind)]
    if not kind:
        return fitting
    if _complete_without_kind(cells):  # the columns without a kind hold another address
        fitting = [cell for cell in fitting if cell.column.kind or cell.role not in ADDRESS]
    foreign = _foreign_roles(kind, fitting, columns)
    for cell in fitting:
        if not cell.column.kind and cell.role in foreign:
            account.unwritten.setdefault(cell.column.number, []).append(number)
    return [cell for cell in fitting if cell.column.kind or cell.role not in foreign]


def _foreign_roles(kind: str, cells: Sequence[Cell], columns: Sequence[Column]) -> set[str]:
    """What columns without a kind may hold that does not belong on an address of this kind."""
    named = any(cell.column.kind == kind and cell.role in NAME_PARTS for cell in cells)
    employed = kind == "home" and any(column.kind == "business" for column in columns)
    return {*(NAME_PARTS if named else ()), *(("company", "attention") if employed else ())}


def _check_single(number: int, chosen: Sequence[Cell]) -> None:
    for role in _SINGLE:
        several = [cell for cell in chosen if cell.role == role]
        found = ((cell, address.find(cell.text) if role == "country" else None) for cell in several)
        if len({country.code if country else normalise(cell.text) for cell, country in found}) > 1:
            both = " and ".join(f"{cell.column.name} ({cell.text!r})" for cell in several)
            raise TableError(
                f"row {number}: the columns {both} both hold the {_CALLED.get(role, role)}, and differ: leave one out, "
                f'such as --columns "none={several[-1].column.number}".'
            )


def _collect_fields(chosen: Sequence[Cell]) -> dict[str, list[str]]:
    """Role → cells in the order of the table, each once; names put together by person, shared cells taken apart."""
    fields: dict[str, list[str]] = {}
    roles = {cell.role for cell in chosen}
    for cell in chosen:
        for role, text in _parts(cell, roles).items():
            if text not in fields.get(role, []) or role in NAME_PARTS - {"name"} or role != cell.role:
                fields.setdefault(role, []).append(text)
    people = _collect_people(chosen)
    if len(people) > 1:
        fields = {role: texts for role, texts in fields.items() if role not in NAME_PARTS}
        fields["name"] = people
    return fields


def _parts(cell: Cell, roles: set[str]) -> dict[str, str]:
    """Role → text of a cell: several of a town with its postal code that no other column holds."""
    parts = cell.column.parts
    if cell.role == "place" and parts and not set(parts) & roles:
        split = address.place_parts(cell.text, parts)
        if split and "locality" not in split and "county" not in split:
            return split
    return {cell.role: _write_out(cell)}


def _write_out(cell: Cell) -> str:
    """A cell as it is written on the envelope: "Lovelace, Ada" becomes "Ada Lovelace"."""
    last, comma, first = (part.strip() for part in cell.text.partition(","))
    turned = cell.column.surname_first and comma and last and first and "," not in first
    return f"{first} {last}" if turned else cell.text


def _collect_people(chosen: Sequence[Cell]) -> list[str]:
    """The names of a row that has columns for several people: another begins where a part of a name comes again."""
    people: list[dict[str, list[str]]] = [{}]
    last = ""
    for cell in chosen:
        role = cell.role
        if role not in NAME_PARTS:
            continue
        again = role in people[-1] and role != last
        if (again and role != "title") or (role == "title" and set(people[-1]) - {"title"}) or role == last == "name":
            people.append({})
        people[-1].setdefault(role, []).append(_write_out(cell))
        last = role
    return list(dict.fromkeys(name for person in people if (name := address.person(person))))


def _note_written(number: int, chosen: Sequence[Cell], lines: Sequence[str], account: ColumnAccount) -> None:
    """Note which cells are in the lines, and which are not."""
    written = {normalise(word) for line in lines for word in re.findall(r"\w+", line)}
    for cell in chosen:
        text = cell.text.split(".")[0] if cell.role == "postcode" else cell.text
        lost = [word for word in map(normalise, re.findall(r"\w+", text)) if word and word not in written]
        if lost and cell.role != "country":
            account.unwritten.setdefault(cell.column.number, []).append(number)
        else:
            account.written.add(cell.column.number)


def warn_of_codes(rows: Sequence[TableRow], account: ColumnAccount) -> tuple[list[TableRow], list[str]]:
    """The rows with warnings of doubtful postal codes; a doubt about all rows is one note instead."""
    doubts = {number: doubt for number, doubt in account.code_doubts.items() if doubt}
    if len(doubts) > _FEW and len(doubts) == len(account.code_doubts):
        numbers = [row.number for row in rows]
        return list(rows), [f"{name_rows(sorted(doubts), numbers)}: {next(iter(doubts.values()))}"]
    return [
        replace(row, warnings=(*row.warnings, doubts[row.number])) if row.number in doubts else row for row in rows
    ], []


def notes(
    columns: Sequence[Column],
    cells: Sequence[Sequence[str]],
    account: ColumnAccount,
    numbers: Sequence[int],
    elsewhere: Collection[int] = (),
) -> list[str]:
    """What has to be said of a table as a whole, each a phrase; `elsewhere` : places of columns that a letter uses."""
    phrases = []
    left = [column for column in columns if column.number not in elsewhere]
    unused = [column.name for column in left if column.role is None and holds(column, cells)]
    if unused:
        phrases.append(f"{'this column is' if len(unused) == 1 else 'these columns are'} not used: {', '.join(unused)}")
    for column in left:
        if column.number in account.unwritten:
            rows = name_rows(account.unwritten[column.number], numbers)
            phrases.append(f"what {column.name} holds is not written in {rows}: {_why_unwritten(column)}")
    for kind, others in account.other_addresses.items():
        has = "has" if len(others) == 1 else "have"
        choice = f"--address {kind} chooses it" if kind else "without --address it is"
        phrases.append(
            f"{name_rows(others, numbers)} {has} {_with_article(kind)} address too, which is not written; {choice}"
        )
    if not any(column.role in ("street", "box", "address", "street2") for column in columns):
        phrases.append("no column is read as a street")
    return phrases


def holds(column: Column, cells: Iterable[Sequence[str]]) -> bool:
    """Whether a column has anything in any row."""
    return any(row[column.number - 1] for row in cells if len(row) >= column.number)


def _with_article(kind: str) -> str:
    if not kind:
        return "a plain"
    return f"{'an' if kind[0] in 'aeio' else 'a'} {kind}" if not kind.isdigit() else f"a number {kind}"


def _why_unwritten(column: Column) -> str:
    if column.role == "title":
        return "it opens a letter"
    if column.role in ("company", "attention"):
        return "it belongs to the business address"
    return "other columns say it otherwise" if column.role in ADDRESS else "other columns hold the name"
