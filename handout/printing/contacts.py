"""Contacts files (vCard 2.1, 3.0 and 4.0), as address books and phones give them: names and addresses become a table.

Source: RFC 2426; RFC 6350, §3.4 for what a backslash escapes; versit, vCard 2.1, 1996.
"""

from __future__ import annotations

import contextlib
import quopri
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from handout.errors import TableError

_HEADERS = ("Title", "First name", "Middle name", "Last name", "Suffix", "Company", "PO box", "Apartment", "Street",
            "City", "State", "Postal code", "Country")  # fmt: skip
_NAME, _ADDRESS = (3, 1, 2, 0, 4), (6, 7, 8, 9, 10, 11, 12)  # the columns of the parts of N, and of ADR, in their order
_LAST, _COMPANY = 3, 5
_LINE = re.compile(r'(?:[\w-]+\.)?(?P<name>[\w-]+)(?P<more>(?:;(?:[^":;]|"[^"]*")*)*):(?P<value>.*)')
_QUOTED = re.compile(r"^[^:\n]*;[^:\n]*QUOTED-PRINTABLE[^:\n]*:(?:.*=\r?\n)+.*", re.MULTILINE | re.IGNORECASE)  # broken
_QUIET = frozenset({"VERSION", "FN", "PRODID", "UID", "REV", "KIND", "SORT-STRING", "NAME", "PROFILE"})


@dataclass(frozen=True)
class _Property:
    """A line of a card: its name, its parameters as they stand, the parts of its value."""

    name: str
    more: str
    parts: tuple[str, ...]

    @property
    def rank(self) -> int:
        """Which of several comes first: the preferred one, then that of the home."""
        more = self.more.upper()
        return 0 if "PREF" in more else 1 if "HOME" in more else 2


def read_contacts(text: str) -> tuple[list[list[str]], list[str]]:
    """The header and a row for each card, and what was left out of them, in phrases.

    Raises TableError: a card is not closed, or of another version.
    """
    rows, left = [list(_HEADERS)], Counter[str]()
    for card in _cards(text):
        version = next((prop.parts[0] for prop in card if prop.name == "VERSION"), "without a version")
        if version not in ("2.1", "3.0", "4.0"):
            raise TableError(f"card {len(rows)} is a vCard {version}: export the contacts as vCard 3.0 or 4.0.")
        row, names = _read_card(card)
        rows.append(row)
        left.update(names)
    several = left.pop("ADR", 0)
    dropped = ", ".join(f"{name} ({count})" for name, count in left.most_common())
    notes = [f"of the contacts names and addresses are read, not {dropped}"] if dropped else []
    if several:
        notes.append(
            f"of several addresses of a contact the preferred one is read, or that of the home, not {several} more"
        )
    used = [column for column in range(len(_HEADERS)) if any(row[column] for row in rows[1:])]
    return [[row[column] for column in used] for row in rows], notes


def _read_card(card: Sequence[_Property]) -> tuple[list[str], list[str]]:
    """The cells of a card, in the order of the headers, and the names of its properties that are left out."""
    row, left, kept = [""] * len(_HEADERS), list[str](), set[str]()
    for prop in sorted(card, key=lambda each: each.rank):
        columns = {"N": _NAME, "ADR": _ADDRESS, "ORG": (_COMPANY,)}.get(prop.name, ())
        if not columns or prop.name in kept:
            left += [prop.name] * (prop.name not in _QUIET)
            continue
        kept.add(prop.name)
        for column, part in zip(columns, prop.parts, strict=False):
            row[column] = part
    whole = next((prop.parts[0] for prop in card if prop.name == "FN"), "")
    if not any(row[column] for column in _NAME) and whole != row[_COMPANY]:
        row[_LAST] = whole
    return row, left


def _cards(text: str) -> Iterator[list[_Property]]:
    """The properties of each card; lines that go on are one, and a value is cut at its semicolons."""
    card: list[_Property] | None = None
    text = _QUOTED.sub(lambda line: line.group().replace("=\r\n", "").replace("=\n", ""), text)
    for number, line in enumerate(re.split(r"\r\n?|\n", re.sub(r"\r?\n[ \t]", "", text)), 1):
        match = _LINE.fullmatch(line.strip())
        name = match["name"].upper() if match else ""
        if name == "BEGIN":
            card = []
        elif name == "END" and card is not None:
            yield card
            card = None
        elif match and card is not None:
            parts = _split_value(match["value"], ";" if name != "FN" else "")
            quoted = "QUOTED-PRINTABLE" in match["more"].upper()
            card.append(
                _Property(
                    name, match["more"], tuple(_unquote(part, match["more"]) for part in parts) if quoted else parts
                )
            )
        elif line.strip():
            raise TableError(f"line {number} is no line of a contacts file: {line.strip()[:40]!r}.")
    if card is not None:
        raise TableError("the last card is not closed: the file is not whole.")


def _unquote(part: str, parameters: str) -> str:
    """A part of a quoted-printable value of vCard 2.1, in the CHARSET that is said, UTF-8 or else Windows-1252."""
    data, said = quopri.decodestring(part.encode()), re.search(r'CHARSET="?([\w-]+)', parameters, re.IGNORECASE)
    for codec in (said[1] if said else "utf-8", "utf-8"):
        with contextlib.suppress(UnicodeDecodeError, LookupError):
            return " ".join(data.decode(codec).split())
    return " ".join(data.decode("cp1252", "replace").split())


def _split_value(value: str, mark: str) -> tuple[str, ...]:
    """The parts between the marks that nothing escapes, plain; several values of a part stand in one cell."""
    parts = [""]
    for sign in re.findall(r"\\?.", value):  # in the order of the text: a backslash may itself be escaped
        if sign == mark:
            parts.append("")
        else:
            parts[-1] += " " if sign in (",", "\\n", "\\N") else sign[-1]
    return tuple(" ".join(part.split()) for part in parts)
