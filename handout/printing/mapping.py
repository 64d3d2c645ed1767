"""What the user says the columns of a table hold: ``name=Guest(s),street=2`` or ``1=name,2=street``."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass

from handout.errors import InputError
from handout.printing.columns import Column, Meaning, role
from handout.printing.lexicon import NAMES, key

_NEXT = re.compile(r",(?=[^,=]+=)")
_UNUSED = frozenset({"none", "unused", "-"})
EXAMPLE = '--columns "name=Guest(s),street=Street" (headers) or --columns "1=name,2=street,3=place" (places)'


@dataclass(frozen=True)
class Assignment:
    """A role, None for a column that is left out, and the column that is meant: its header, or its place from 1."""

    role: str | None
    column: str

    @property
    def place(self) -> int:
        """The column's place; 0 where a header is given."""
        return int(self.column) if self.column.isdecimal() else 0


def read(texts: Sequence[str]) -> tuple[Assignment, ...]:
    """The assignments in the texts of the option.

    Raises
    ------
    InputError
        Not of the form, or a role that there is not.
    """
    found = []
    for pair in (part for text in texts for part in _NEXT.split(text) if part.strip()):
        left, sign, right = (part.strip() for part in pair.partition("="))
        if not sign or not left or not right:
            raise InputError(f"columns: {pair.strip()!r} does not say what a column holds; write it as {EXAMPLE}.")
        if left.isdecimal():
            left, right = right, left
        found.append(Assignment(None if left in _UNUSED else _role(left), right))
    return tuple(found)


def _role(word: str) -> str:
    found = role(word)
    if found is None:
        near = difflib.get_close_matches(word, NAMES, 1, 0.5)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise InputError(f"columns: {word!r} is none of {', '.join(NAMES)}, none{hint}")
    return found


def names_any(given: Sequence[Assignment], headers: Sequence[str]) -> bool:
    """Whether one of the headers that are named stands in this row."""
    return any(not one.place and _find(one.column, headers) for one in given)


def apply(given: Sequence[Assignment], columns: Sequence[Column]) -> list[Column]:
    """The columns with what the user says; other columns of a role that is given lose it.

    Raises
    ------
    InputError
        A header or a place that the table does not have.
    """
    said: dict[int, str | None] = {}
    headers = [column.header for column in columns]
    for one in given:
        numbers = _find(one.column, headers)
        if not numbers:
            named = ", ".join(repr(header) for header in headers if header) or "no headers"
            raise InputError(f"columns: the table has no column {one.column!r}; it has {len(headers)}: {named}.")
        said |= dict.fromkeys(numbers, one.role)
    taken = set(said.values())
    return [_with(column, said, taken) for column in columns]


def _with(column: Column, said: dict[int, str | None], taken: set[str | None]) -> Column:
    if column.number in said:
        role = said[column.number]
        parts = column.meaning.parts if column.meaning and column.meaning.role == role else ()
        return Column(column.number, column.header, Meaning(role, parts=parts) if role else None)
    return column if column.role not in taken else Column(column.number, column.header)


def _find(wanted: str, headers: Sequence[str]) -> list[int]:
    """The places of a column, from 1: every one of that header, else the one at that place."""
    for same in (lambda text: " ".join(text.split()).casefold(), key):
        found = [n for n, header in enumerate(headers, 1) if header and same(header) == same(wanted)]
        if found:
            return found
    return [int(wanted)] if wanted.isdecimal() and 1 <= int(wanted) <= len(headers) else []
