"""The rows of a table as addresses, and an account of what became of every cell of it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from handout.errors import TableError
from handout.printing import address, countries, selection
from handout.printing.address import Row
from handout.printing.columns import ADDRESS, LABEL, PEOPLE, PLACES, Column
from handout.printing.lexicon import KINDS, key

# of these an address has one: two that differ cannot both be written
_SINGLE = ("postcode", "city", "state", "country", "number", "place", "address")
_TOWNS = frozenset({"place", "postcode", "city", "address"})
_PARTS_OF_NAME = frozenset({"title", "name", "first", "middle", "last", "suffix"})
_PREFERRED = ("", "home", "shipping", "business", "other", "billing")
_ERROR = re.compile(r"#(N/A|REF!|VALUE!|NAME\?|DIV/0!|NULL!|NUM!|BEZUG!|WERT!|NV)\Z")
_FEW = 3  # rows whose short postal codes are questioned one by one

WAY_OUT = 'say what the columns hold with --columns "name=Guest(s),street=…"'


@dataclass
class Account:
    """What became of the columns of a table while its rows were made.

    written : places of the columns of which something was written; left : place of a column → rows in which what it
    holds was not; spared : kinds of address → rows in which an address of that kind was left for another one;
    codes : row → what is doubtful about the postal code of an address without a country, "" for nothing.
    """

    written: set[int] = field(default_factory=set)
    left: dict[int, list[int]] = field(default_factory=dict)
    spared: dict[str, list[int]] = field(default_factory=dict)
    codes: dict[int, str] = field(default_factory=dict)
    named: bool = False


def row(number: int, cells: Sequence[str], columns: Sequence[Column], wanted: str, account: Account) -> Row:
    """One row as an address; what became of its cells goes into the account.

    Parameters
    ----------
    wanted : kind of address that is preferred, "" for the usual order.

    Raises
    ------
    TableError
        Two columns hold the same thing, and differ.
    """
    by_header = _by_header(columns, cells)
    if any(cells[len(columns) :]):
        problem = (
            f"it has {len(cells)} cells where the header has {len(columns)}: "
            "put quotation marks round a cell that holds a delimiter"
        )
        return Row(number, (), (), problem, by_header)
    told = [(column, cell) for column, cell in zip(columns, cells, strict=False) if cell and column.role]
    broken = next((pair for pair in told if _ERROR.match(pair[1])), None)
    if broken is not None:
        return Row(number, (), (), f"the cell under {broken[0].name} holds the error {broken[1]}", by_header)
    kind, warnings = _kind(number, told, wanted, account)
    alone = kind != "" and _stands_alone(told)  # columns without a kind hold another address
    chosen = [pair for pair in told if _belongs(pair[0], kind, alone)]
    foreign = _foreign(kind, chosen, columns)
    chosen = [pair for pair in chosen if pair[0] not in foreign]
    for column in foreign:
        account.left.setdefault(column.number, []).append(number)
    _check_single(number, chosen)
    fields = _fields(chosen)
    lines, more, problem = address.lines(fields, _number_first(columns))
    if not problem:
        _settle(number, told, chosen, lines, account)
        if _has_name(fields, lines):
            account.named = True
        else:
            warnings.append("it has no name")
        account.codes[number] = countries.short_code(lines)
    return Row(number, lines, (*warnings, *more), problem, by_header)


def _by_header(columns: Sequence[Column], cells: Sequence[str]) -> dict[str, str]:
    """Every cell by its header; of several columns of one header each by header and place."""
    count = Counter(column.header for column in columns)
    named = (
        (column.header if count[column.header] == 1 else f"{column.header} ({column.number})", cell)
        for column, cell in zip(columns, cells, strict=False)
        if column.header
    )
    return dict(named)


def _kind(number: int, told: Sequence[tuple[Column, str]], wanted: str, account: Account) -> tuple[str, list[str]]:
    """Which of a row's addresses is written, and what to warn of; the others are noted."""
    full = list(dict.fromkeys(column.kind for column, _ in told if column.role in PLACES))
    full = [kind for kind in full if kind or len(full) == 1 or _stands_alone(told)]
    labels = {column.kind: KINDS.get(key(cell), key(cell)) for column, cell in told if column.role == LABEL}
    order = sorted(full, key=lambda kind: _PREFERRED.index(kind) if kind in _PREFERRED else len(_PREFERRED))
    asked = [kind for kind in order if wanted and wanted in (kind, labels.get(kind))]
    if not order:
        return "", []
    kind = (asked or order)[0]
    for other in order:
        if other != kind:
            account.spared.setdefault(labels.get(other) or other, []).append(number)
    if wanted and not asked and any(order):
        called = labels.get(kind) or kind or "other"
        return kind, [f"it has no {wanted} address: its {called} address is written"]
    return kind, []


def _stands_alone(told: Sequence[tuple[Column, str]]) -> bool:
    """Whether the columns without a kind hold an address by themselves."""
    return any(not column.kind and column.role in _TOWNS for column, _ in told)


def _belongs(column: Column, kind: str, alone: bool) -> bool:
    if column.role == LABEL:
        return False
    return column.kind == kind or (not column.kind and not (alone and column.role in ADDRESS))


def _foreign(kind: str, chosen: Sequence[tuple[Column, str]], columns: Sequence[Column]) -> list[Column]:
    """Columns without a kind that do not go with this one: an employer on a home address, another name on a parcel."""
    loose = [column for column, _ in chosen if not column.kind]
    own_name = kind and any(column.kind == kind and column.role in _PARTS_OF_NAME for column, _ in chosen)
    employed = kind == "home" and any(column.kind == "business" for column in columns)
    return [
        column
        for column in loose
        if (own_name and column.role in _PARTS_OF_NAME) or (employed and column.role in ("company", "attention"))
    ]


def _check_single(number: int, chosen: Sequence[tuple[Column, str]]) -> None:
    for role in _SINGLE:
        several = [(column, cell) for column, cell in chosen if column.role == role]
        if len({_same(role, cell) for _, cell in several}) > 1:
            named = " and ".join(f"{column.name} ({cell!r})" for column, cell in several)
            raise TableError(
                f"row {number}: the columns {named} both hold the {_called(role)}, and differ: leave one out, such as "
                f'--columns "none={several[-1][0].header}".'
            )


def _called(role: str) -> str:
    return {"postcode": "postal code", "number": "house number", "place": "town"}.get(role, role)


def _same(role: str, cell: str) -> str:
    country = countries.find(cell) if role == "country" else None
    return country.code if country else key(cell)


def _number_first(columns: Sequence[Column]) -> bool:
    roles = [column.role for column in columns]
    return "number" in roles and "street" in roles and roles.index("number") < roles.index("street")


def _fields(chosen: Sequence[tuple[Column, str]]) -> dict[str, list[str]]:
    """Role → cells in the order of the table, each once; names put together by person, shared cells taken apart."""
    fields: dict[str, list[str]] = {}
    for column, cell in chosen:
        assert column.role is not None and column.meaning is not None
        text, parts = cell, column.meaning.parts
        if column.role == "name" and parts[:2] in (("last", "first"), ("name", "first")):
            text = _turned(cell)
        if column.role == "place" and parts and not set(parts) & {other.role for other, _ in chosen}:
            split = address.place_parts(cell, parts)
            if split and "locality" not in split and "county" not in split:
                for role, value in split.items():
                    fields.setdefault(role, []).append(value)
                continue
        if text not in fields.get(column.role, []) or column.role in _PARTS_OF_NAME - {"name"}:
            fields.setdefault(column.role, []).append(text)
    people = _people(chosen)
    if len(people) > 1:
        fields = {role: cells for role, cells in fields.items() if role not in _PARTS_OF_NAME}
        fields["name"] = people
    return fields


def _turned(cell: str) -> str:
    """ "Lovelace, Ada" as it is spoken."""
    last, comma, first = (part.strip() for part in cell.partition(","))
    return f"{first} {last}" if comma and last and first and "," not in first else cell


def _people(chosen: Sequence[tuple[Column, str]]) -> list[str]:
    """The names of a row that has columns for several people: another begins where a part of a name comes again."""
    people: list[dict[str, list[str]]] = [{}]
    last = ""
    for column, cell in chosen:
        role = column.role or ""
        if role not in _PARTS_OF_NAME:
            continue
        again = role in people[-1] and role != last
        if (again and role != "title") or (role == "title" and set(people[-1]) - {"title"}) or role == last == "name":
            people.append({})
        people[-1].setdefault(role, []).append(cell if role != "name" else _spoken(column, cell))
        last = role
    return list(dict.fromkeys(name for one in people if (name := address.person(one))))


def _spoken(column: Column, cell: str) -> str:
    parts = column.meaning.parts if column.meaning else ()
    return _turned(cell) if parts[:2] in (("last", "first"), ("name", "first")) else cell


def _has_name(fields: dict[str, list[str]], lines: Sequence[str]) -> bool:
    if set(fields) & PEOPLE:
        return True
    # an address that came as a whole begins with a name, which has no number in it
    whole = "address" in fields and not set(fields) & address.TOLD
    return whole and len(lines) > 2 and not any(char.isdigit() for char in lines[0])


def _settle(
    number: int,
    told: Sequence[tuple[Column, str]],
    chosen: Sequence[tuple[Column, str]],
    lines: Sequence[str],
    account: Account,
) -> None:
    """Note which cells are in the lines, and which are not."""
    words = {key(word) for line in lines for word in re.findall(r"\w+", line)}
    for column, cell in told:
        if (column, cell) not in chosen:
            continue
        mended = cell.split(".")[0] if column.role == "postcode" else cell
        lost = [word for word in re.findall(r"\w+", mended) if key(word) and key(word) not in words]
        if lost and column.role != "country":
            account.left.setdefault(column.number, []).append(number)
        else:
            account.written.add(column.number)


def questioned(rows: Sequence[Row], account: Account) -> tuple[list[Row], list[str]]:
    """The rows with what is doubtful about their postal codes, or that once where it is the same of all of them."""
    doubts = {number: doubt for number, doubt in account.codes.items() if doubt}
    if len(doubts) > _FEW and len(doubts) == len(account.codes):
        numbers = [row.number for row in rows]
        return list(rows), [f"{_rows(sorted(doubts), numbers)}: {next(iter(doubts.values()))}"]
    return [
        replace(row, warnings=(*row.warnings, doubts[row.number])) if row.number in doubts else row for row in rows
    ], []


def notes(
    columns: Sequence[Column], cells: Sequence[Sequence[str]], account: Account, numbers: Sequence[int]
) -> list[str]:
    """What has to be said of a table as a whole, each a phrase."""
    said = []
    unused = [column.name for column in columns if column.role is None and holds(column, cells)]
    if unused:
        said.append(f"{'this column is' if len(unused) == 1 else 'these columns are'} not used: {', '.join(unused)}")
    for column in columns:
        if column.number in account.left:
            rows = _rows(account.left[column.number], numbers)
            said.append(f"what {column.name} holds is not written in {rows}: {_why(column)}")
    for kind, spared in account.spared.items():
        has = "has" if len(spared) == 1 else "have"
        choice = f"--address {kind} chooses it" if kind else "without --address it is"
        said.append(f"{_rows(spared, numbers)} {has} {_a(kind)} address too, which is not written; {choice}")
    if not any(column.role in ("street", "box", "address", "street2") for column in columns):
        said.append("no column is read as a street")
    return said


def holds(column: Column, cells: Iterable[Sequence[str]]) -> bool:
    """Whether a column has anything in any row."""
    return any(row[column.number - 1] for row in cells if len(row) >= column.number)


def _a(kind: str) -> str:
    if not kind:
        return "a plain"
    return f"{'an' if kind[0] in 'aeio' else 'a'} {kind}" if not kind.isdigit() else f"a number {kind}"


def _why(column: Column) -> str:
    if column.role == "title":
        return "it opens a letter"
    if column.role in ("company", "attention"):
        return "it belongs to the business address"
    return "other columns say it otherwise" if column.role in ADDRESS else "other columns hold the name"


def _rows(rows: Sequence[int], among: Sequence[int]) -> str:
    """Rows in a few words: runs of the table's own rows as ranges."""
    if len(rows) == 1:
        return f"row {rows[0]}"
    named = selection.ranges(rows, among)
    return f"rows {named}{rows[-1] if named.endswith('-') else ''}"


def rows_named(rows: Sequence[int]) -> str:
    """The same for rows that have no addresses."""
    return _rows(rows, range(1, rows[-1] + 2))
