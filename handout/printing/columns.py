"""What the columns of an address table hold, by their names (`column_names`) or as the user says.

The user says it as ``name=Guest(s),street=2`` or ``1=name,2=street``.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from handout.errors import InputError
from handout.printing.column_names import (
    AMBIGUOUS_NAMES,
    AMBIGUOUS_NUMBERS,
    FILLERS,
    KINDS,
    LABELS,
    ROLE_NAMES,
    ROLES,
    WHOLE_ADDRESS,
    normalise,
)

# of a column that says which of several addresses its neighbours hold ("Address 1 - Label")
LABEL = "label"
# a table with at least one of these can be addressed
PLACES = frozenset({"street", "box", "place", "postcode", "city", "address"})
ADDRESS = PLACES | {"number", "street2", "extra", "locality", "state", "county", "country"}
PEOPLE = frozenset({"name", "first", "middle", "last", "company", "attention", "careof"})
_SPOKEN = frozenset({"name", "first", "middle", "last"})
NAME_PARTS = _SPOKEN | {"title", "suffix"}
EXAMPLE = '--columns "name=Guest(s),street=Street" (headers) or --columns "1=name,2=street,3=place" (places)'

_LONGEST_HEADER = 80  # characters; what is longer is a note or an address
_SHORTEST_PREFIX = 3  # letters; a word run together with another ("Gastname") has more
_MOST_WORDS = 8  # of a header that names several things with only spaces between
_PREFIXES = tuple(word for word in sorted((*KINDS, *FILLERS), key=len, reverse=True) if len(word) > _SHORTEST_PREFIX)
_PLURAL = re.compile(r"\((?:s|es|e|n|en|r|er|x|in|innen|i)\)", re.IGNORECASE)
_NUMBERED = re.compile(r"(?:address|adresse|dirección|indirizzo|adres)\s*(\d+)\s*[-–—:]\s*(\S.*)\Z", re.IGNORECASE)
_BETWEEN = re.compile(r"\s*[/,;&+|\n]\s*|\s+(?:-|and|or|und|oder|et|ou|y|e|o|en|of)\s+", re.IGNORECASE)
_WORDS = re.compile(r"[^\W_]+(?:['’.][^\W_]+)*\.?")
_CAMEL = re.compile(r"(?<=[a-zß-ÿ])(?=[A-Z])")
# the role of a column that holds several things → the roles that it may hold
_COMBINATIONS = (
    ("place", {"postcode", "city", "state", "county", "locality"}),
    ("street", {"street", "number", "extra", "street2", "box"}),
    ("name", NAME_PARTS | {"company", "attention"}),
    ("country", {"country", "state", "county"}),
    ("address", ADDRESS),
)
_NEXT_ASSIGNMENT = re.compile(r",(?=[^,=]+=)")
_UNUSED = frozenset({"none", "unused", "-"})


class Meaning(NamedTuple):
    """What a header says: a role, which of a person's addresses it belongs to, and the roles that share the column.

    kind : "" or "home", "business", "1" …; parts : in their order, where one column holds several things.
    """

    role: str
    kind: str = ""
    parts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Column:
    """A column of a table: its place from 1, its header, and its `Meaning`, without a role where that is not known."""

    number: int
    header: str
    role: str | None = None
    kind: str = ""
    parts: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What to call it in a message."""
        return repr(self.header) if self.header else f"number {self.number}"

    @property
    def surname_first(self) -> bool:
        """Whether its cells are names of the form "Lovelace, Ada"."""
        return self.role == "name" and self.parts[:2] in (("last", "first"), ("name", "first"))


@lru_cache(maxsize=4096)
def meaning(header: str) -> Meaning | None:
    """What a header means whatever other columns there are; None if that is not known."""
    if len(header) > _LONGEST_HEADER:
        return None
    singular = _PLURAL.sub("", header)
    simple = _find_listed(singular) or _find_numbered(singular) or _without_fillers(singular)
    if simple is not None and simple.role != "name":
        return simple
    parts = [part for part in _BETWEEN.split(singular) if part and normalise(part)]
    combined = _combine_names(parts) or _combine_names(_segments(singular), spaced=True)
    # of a name the order of its parts matters: "Name, Vorname"
    return combined if simple is None or (combined and combined.role == "name") else simple


def _find_listed(header: str) -> Meaning | None:
    """The meaning of a listed header; text in brackets, a final s and a final number may be left out of it."""
    for text in (header, re.sub(r"\(.*?\)", " ", header)):
        name = normalise(text)
        role = ROLES.get(name) or (ROLES.get(name.removesuffix("s")) if len(name) > 4 else None)
        role = role or (ROLES.get(name.rstrip("0123456789")) if name[:-1] else None)
        if role is not None and not (name not in ROLES and name[-1].isdigit() and role not in NAME_PARTS):
            return Meaning(role)
    return None


def _find_numbered(header: str) -> Meaning | None:
    """The meaning of a header such as "Address 1 - Street", of an address book with several addresses."""
    match = _NUMBERED.match(header.strip())
    if match is None:
        return None
    number, rest = match.groups()
    if normalise(rest) in LABELS:
        return Meaning(LABEL, number)
    part = meaning(rest)
    return part._replace(kind=number) if part and part.role in ADDRESS else None


def _words(header: str) -> list[str]:
    return _WORDS.findall(_CAMEL.sub(" ", header))


def _without_fillers(header: str) -> Meaning | None:
    """The meaning of a header without the words for whose or which address: "Guest name", "Home Street 2"."""
    words = _words(header)
    for i, word in enumerate(words):
        kind, rest = KINDS.get(normalise(word), ""), " ".join((*words[:i], *words[i + 1 :]))
        if not rest or not (kind or normalise(word) in FILLERS):
            continue
        sense = _find_listed(rest) or _without_fillers(rest)
        if sense is not None and normalise(rest) not in AMBIGUOUS_NUMBERS and _fits_kind(sense.role, kind):
            return sense._replace(kind=kind or sense.kind)
    name = normalise(header)
    for prefix in _PREFIXES:  # Lieferstraße, Gastname
        rest = name.removeprefix(prefix)
        if rest != name and rest in ROLES and rest not in AMBIGUOUS_NUMBERS:
            kind = KINDS.get(prefix, "")
            return Meaning(ROLES[rest], kind) if _fits_kind(ROLES[rest], kind) else None
    return None


def _fits_kind(role: str, kind: str) -> bool:
    # "business title" is a job, not a form of address; but a shipping or billing address has a name of its own
    return not kind or role in ADDRESS or (kind in ("shipping", "billing") and role in NAME_PARTS | {"company"})


def _combine_names(names: Sequence[str], spaced: bool = False) -> Meaning | None:
    """The meaning of a header that names several things: "City/State/Zip", or with `spaced` "City ST Zip"."""
    meanings = [sense for name in names if (sense := _find_listed(name) or _without_fillers(name)) is not None]
    roles = tuple(sense.role for sense in meanings)
    kinds = {sense.kind for sense in meanings if sense.kind}
    if len(roles) < max(len(names), 2) or len(kinds) > 1:
        return None
    if spaced and not (set(roles) <= ADDRESS or set(roles) <= _SPOKEN):
        return None
    role = _common_role(roles)
    return Meaning(role, kinds.pop() if kinds else "", roles) if role else None


def _common_role(roles: Sequence[str]) -> str | None:
    """The role of a column whose cells hold all of some roles; None where no role does."""
    several = set(roles)
    if len(several) == 1:
        return roles[0]
    if several <= {"company", "attention"}:
        return "company"
    if several & PEOPLE and several & (PLACES | {"street2"}):
        return "address"
    for role, members in _COMBINATIONS:
        if several <= members and (role in several or role in ("place", "name", "address")):
            return "title" if several <= {"title", "suffix"} else role
    return None


def _segments(header: str) -> list[str]:
    """The listed headers that a header is made of, with only spaces between them; empty if it is not."""
    words = _words(header)

    def split_words(start: int) -> list[str] | None:
        if start == len(words):
            return []
        for end in range(len(words), start, -1):
            text = " ".join(words[start:end])
            rest = split_words(end) if normalise(text) in ROLES else None
            if rest is not None:
                return [text, *rest]
        return None

    return (split_words(0) or []) if 1 < len(words) <= _MOST_WORDS else []


def columns(headers: Sequence[str]) -> list[Column]:
    """What each column holds; some headers mean something else beside certain other columns.

    "Nom", "Name" or "Nombre" beside a column for the first name is the last name, beside one for the last name it
    is the first name; "Adresse" beside columns for postcode or city is the street; "Region" is the state and
    "Ortsteil" the town where there is no other column for it.
    """
    row = [Column(n, header, *(meaning(header) or ())) for n, header in enumerate(headers, 1)]
    for kind in sorted({column.kind for column in row}):
        roles = {column.role for column in row if column.kind in ("", kind)}
        row = [_replace_role(column, _role_beside(column, roles)) if column.kind == kind else column for column in row]
    return [_replace_role(column, None) if _is_running_number(row, i) else column for i, column in enumerate(row)]


def _replace_role(column: Column, role: str | None) -> Column:
    """The column with another role, or without a meaning."""
    if role == column.role:
        return column
    return Column(column.number, column.header, *((role, column.kind) if role else ()))


def _role_beside(column: Column, roles: set[str | None]) -> str | None:
    """The role of a column, given the roles of all columns of the same kind of address."""
    name, simple = normalise(column.header), not column.parts
    match column.role:
        case "name" if simple and name in AMBIGUOUS_NAMES and ("first" in roles) != ("last" in roles):
            return "last" if "first" in roles else "first"
        case "address" if simple and "street" not in roles and {"postcode", "city", "place"} & roles:
            return "address" if name.endswith(WHOLE_ADDRESS) else "street"
        case "locality" if "city" not in roles:
            return "city"
        case "county":
            return "state" if "state" not in roles else None
    return column.role


def _is_running_number(row: Sequence[Column], i: int) -> bool:
    """Whether a column "Nr." counts the rows: only right beside the street is it taken for the house number."""
    near = {column.role for column in row[max(i - 1, 0) : i + 2]}
    return row[i].role == "number" and normalise(row[i].header) in AMBIGUOUS_NUMBERS and "street" not in near


def addressable(row: Iterable[Column]) -> bool:
    """Whether these columns can hold an address at all."""
    return any(column.role in PLACES for column in row)


def list_understood() -> str:
    """A few of the headers that are understood, for an error message."""
    return (
        "name, first name, last name, company, street, address 2, postal code, city, state, country or address "
        "(also in German, French, Spanish, Italian and Dutch: Straße, PLZ, Ort, code postal, ville, ciudad …)"
    )


@dataclass(frozen=True)
class ColumnAssignment:
    """What the user says of a column: its role, None to leave it out, and its header, or its place from 1."""

    role: str | None
    column: str

    @property
    def place(self) -> int:
        """The column's place; 0 where a header is given."""
        return int(self.column) if self.column.isdecimal() else 0


def read_assignments(texts: Sequence[str]) -> tuple[ColumnAssignment, ...]:
    """The assignments in the texts of the option ``--columns``.

    Raises InputError: not of the form, or a role that there is not.
    """
    assignments = []
    for pair in (part for text in texts for part in _NEXT_ASSIGNMENT.split(text) if part.strip()):
        left, sign, right = (part.strip() for part in pair.partition("="))
        if not sign or not left or not right:
            raise InputError(f"columns: {pair.strip()!r} does not say what a column holds; write it as {EXAMPLE}.")
        if left.isdecimal():
            left, right = right, left
        assignments.append(ColumnAssignment(None if left in _UNUSED else _role(left), right))
    return tuple(assignments)


def _role(word: str) -> str:
    """The role that a word names: a role itself, or a header of that meaning."""
    if word in ROLE_NAMES:
        return word
    sense = meaning(word)
    if sense is None or sense.kind:
        near = difflib.get_close_matches(word, ROLE_NAMES, 1, 0.5)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise InputError(f"columns: {word!r} is none of {', '.join(ROLE_NAMES)}, none{hint}")
    return sense.role


def names_any(assignments: Sequence[ColumnAssignment], headers: Sequence[str]) -> bool:
    """Whether one of the headers that are named stands in this row."""
    return any(not assignment.place and _places(assignment.column, headers) for assignment in assignments)


def assign(assignments: Sequence[ColumnAssignment], columns: Sequence[Column]) -> list[Column]:
    """The columns with the roles that the user assigns; other columns of those roles lose them.

    Raises InputError: a header or a place that the table does not have.
    """
    roles: dict[int, str | None] = {}
    headers = [column.header for column in columns]
    for assignment in assignments:
        places = _places(assignment.column, headers)
        if not places:
            named = ", ".join(repr(header) for header in headers if header) or "no headers"
            raise InputError(f"columns: the table has no column {assignment.column!r}; it has {len(headers)}: {named}.")
        roles |= dict.fromkeys(places, assignment.role)
    return [_assign_role(column, roles) for column in columns]


def _assign_role(column: Column, roles: dict[int, str | None]) -> Column:
    if column.number in roles:
        role = roles[column.number]
        return Column(column.number, column.header, role, parts=column.parts if role and column.role == role else ())
    return column if column.role not in set(roles.values()) else Column(column.number, column.header)


def _places(wanted: str, headers: Sequence[str]) -> list[int]:
    """The places, from 1, of all columns of that header; where there are none and it is a number, that place."""
    for same in (lambda text: " ".join(text.split()).casefold(), normalise):
        places = [n for n, header in enumerate(headers, 1) if header and same(header) == same(wanted)]
        if places:
            return places
    return [int(wanted)] if wanted.isdecimal() and 1 <= int(wanted) <= len(headers) else []
