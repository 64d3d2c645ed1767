"""Tables of colours as text: CGATS.5 (ANSI CGATS.5-2003, annex J) as measuring programs write it, and .ti1 .ti2 .ti3.

A file holds one table or several.  A table has keywords with values, names of fields, and sets (rows) of values.
What is read is written again with the same words and the same numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from handout import atomic
from handout.errors import InputError, reported
from handout.values import Array

_TOKEN = re.compile(r'"((?:[^"]|"")*)"|([^\s"]+)')
_NUMBER = re.compile(r"([+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan)\Z", re.ASCII)
_ENDS = {"BEGIN_DATA": "END_DATA", "BEGIN_DATA_FORMAT": "END_DATA_FORMAT"}
# fields and keywords of the standard, which need no declaration; others are declared by KEYWORD
_STANDARD = {
    "ORIGINATOR", "DESCRIPTOR", "CREATED", "MANUFACTURER", "PROD_DATE", "SERIAL", "MATERIAL", "INSTRUMENTATION",
    "MEASUREMENT_SOURCE", "PRINT_CONDITIONS", "FILE_DESCRIPTOR", "SAMPLE_BACKING", "FILTER", "POLARIZATION",
    "WEIGHTING_FUNCTION", "COMPUTATIONAL_PARAMETER", "TARGET_TYPE", "COLORANT", "TABLE_DESCRIPTOR", "TABLE_NAME",
}  # fmt: skip
_LARGEST = 1e6  # of what is measured of a colour: percent, XYZ or L*a*b*; what is beyond is damage


@dataclass(frozen=True)
class CgatsTable:
    """One table.

    kind : the word that it begins with: "CTI1", "CTI2", "CTI3", "CGATS.17" …
    keywords : pairs of a keyword and its value, in order; a keyword may come again.
    fields : names of the columns.
    rows : sets, each a value as text for every field.
    """

    kind: str
    keywords: tuple[tuple[str, str], ...]
    fields: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...] = field(repr=False)

    def __post_init__(self) -> None:
        if any(len(row) != len(self.fields) for row in self.rows):
            raise ValueError("every set of a table has a value for each field")
        words = (*(value for _, value in self.keywords), *(value for row in self.rows for value in row))
        if any(len(word.splitlines()) > 1 for word in words):
            raise ValueError("a value of a table stands on one line")

    def get(self, keyword: str) -> str | None:
        """The first value of a keyword; None if the table has it not."""
        return next((value for name, value in self.keywords if name == keyword), None)

    def numbers(self, *names: str) -> Array:
        """Columns as numbers, (sets, names).

        Raises InputError: no such field, or a value in it that is no number, or one beyond any colour.
        """
        for name in names:
            if name not in self.fields:
                raise InputError(f"The {self.kind} table has no field {name}; it has {', '.join(self.fields)}.")
        places = [self.fields.index(name) for name in names]
        columns = np.empty((len(self.rows), len(names)))
        for i, row in enumerate(self.rows):
            for k, place in enumerate(places):
                try:
                    columns[i, k] = float(row[place])
                except ValueError:
                    columns[i, k] = np.nan
                if not abs(columns[i, k]) <= _LARGEST:
                    what = f"{self.kind}: {names[k]} of set {i + 1} is {row[place]!r}"
                    raise InputError(f"{what}, which is no number that is measured.")
        return columns


def table(kind: str, keywords: Mapping[str, str], columns: Mapping[str, Sequence[str]]) -> CgatsTable:
    """A table of columns of text, all of one length; keywords that are not of the standard are declared before."""
    pairs = []
    for name, value in keywords.items():
        pairs += [] if name in _STANDARD else [("KEYWORD", name)]
        pairs.append((name, value))
    return CgatsTable(kind, tuple(pairs), tuple(columns), tuple(zip(*columns.values(), strict=True)))


def read_tables(path: Path) -> tuple[CgatsTable, ...]:
    """The tables of a file. Raises InputError: unreadable, or not CGATS; the message names the line."""
    with reported(f"read {path}"):
        data = path.read_bytes()
    if b"\0" in data:
        raise InputError(f"{path}, line 1: not a text file, so no table of colours: give a .ti1, .ti2, .ti3 or .txt.")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return parse(text, str(path))


def parse(text: str, source: str = "table") -> tuple[CgatsTable, ...]:
    """The tables of a text; `source` is what it is called in messages.

    Raises InputError: not CGATS; the message names the line.
    """
    words = _Words(text, source)
    tables: list[CgatsTable] = []
    while not words.is_done:
        tables.append(_parse_table(words, tables[-1] if tables else None))
    if not tables:
        raise InputError(f"{source}, line 1: the file is empty; a table begins with a word such as CTI3 or CGATS.17.")
    return tuple(tables)


def dumps(tables: Sequence[CgatsTable]) -> str:
    """The text of tables; `parse` gives the same tables again."""
    return "\n".join(_format_table(table) for table in tables)


def write(path: Path, tables: Sequence[CgatsTable]) -> None:
    """Write tables to a file. Raises InputError: it cannot be written."""
    atomic.write(path, dumps(tables).encode("utf-8"))


class _Words:
    """The words of a file one after the other, and the line that each is in."""

    def __init__(self, text: str, source: str) -> None:
        self.source = source
        self._lines = text.splitlines()
        self._words = list(self._split_words())
        self._next = 0

    def _split_words(self) -> Iterator[tuple[int, str, bool]]:
        for number, line in enumerate(self._lines, 1):
            if '"' in _TOKEN.sub("", line.split("#")[0] if line.lstrip().startswith("#") else line):
                raise self.wrong(number, "a quotation mark is not closed")
            for match in _TOKEN.finditer(line):
                if match.group(2) is not None and match.group(2).startswith("#"):
                    break
                if match.group(1) is not None:
                    yield number, match.group(1).replace('""', '"'), True
                else:
                    yield number, match.group(2), False

    @property
    def is_done(self) -> bool:
        return self._next >= len(self._words)

    @property
    def line(self) -> int:
        return self._words[min(self._next, len(self._words) - 1)][0] if self._words else 1

    def peek(self) -> tuple[int, str, bool] | None:
        return None if self.is_done else self._words[self._next]

    def take(self) -> str:
        self._next += 1
        return self._words[self._next - 1][1]

    def rest_of_line(self, line: int) -> list[str]:
        """All further words of a line."""
        texts: list[str] = []
        while (word := self.peek()) is not None and word[0] == line:
            texts.append(self.take())
        return texts

    def take_until(self, end: str, begun: int) -> list[tuple[int, str]]:
        """All words before `end`, each with its line."""
        words: list[tuple[int, str]] = []
        while (word := self.peek()) is not None:
            line, text, quoted = word
            self._next += 1
            if text == end and not quoted:
                return words
            words.append((line, text))
        raise self.wrong(begun, f"{end} is missing: the file is cut off; copy it again")

    def wrong(self, line: int, what: str) -> InputError:
        return InputError(f"{self.source}, line {line}: {what}.")


def _parse_table(words: _Words, before: CgatsTable | None) -> CgatsTable:
    kind = _parse_kind(words, before)
    keywords: list[tuple[str, str]] = []
    fields: tuple[str, ...] | None = before.fields if before is not None else None
    counts: dict[str, tuple[int, int]] = {}
    while (word := words.peek()) is not None:
        line, name, quoted = word
        words.take()
        if name == "BEGIN_DATA_FORMAT":
            fields = tuple(text for _, text in words.take_until(_ENDS[name], line))
            if not fields:
                raise words.wrong(line, "BEGIN_DATA_FORMAT names no field")
            if twice := [name for i, name in enumerate(fields) if name in fields[:i]]:
                raise words.wrong(line, f"the field {twice[0]} is named twice")
            at, wanted = counts.get("NUMBER_OF_FIELDS", (line, len(fields)))
            if wanted != len(fields):
                raise words.wrong(at, f"NUMBER_OF_FIELDS is {wanted}, and {len(fields)} are named at line {line}")
        elif name == "BEGIN_DATA":
            if fields is None:
                raise words.wrong(line, "BEGIN_DATA comes before any BEGIN_DATA_FORMAT, which names the fields")
            rows = _parse_rows(words, words.take_until(_ENDS[name], line), fields, counts)
            return CgatsTable(kind, tuple(keywords), fields, rows)
        elif quoted or not re.match(r"[A-Za-z]", name):
            raise words.wrong(line, f"{name!r} stands where a keyword should")
        else:
            values = words.rest_of_line(line)
            if name in ("NUMBER_OF_FIELDS", "NUMBER_OF_SETS"):
                counts[name] = (line, _parse_count(words, line, name, values))
            else:
                keywords.append((name, " ".join(values)))
    raise words.wrong(words.line, f"the {kind} table has no BEGIN_DATA: the file is cut off, or is no CGATS file")


def _parse_kind(words: _Words, before: CgatsTable | None) -> str:
    """The word that a table begins with; further tables of a file may go without."""
    word = words.peek()
    assert word is not None
    line, text, quoted = word
    following = words._words[words._next + 1 : words._next + 2]
    alone = not quoted and re.fullmatch(r"[A-Z][A-Z0-9._]*", text) and (not following or following[0][0] != line)
    if alone and text not in ("BEGIN_DATA_FORMAT", "BEGIN_DATA"):
        return words.take()
    if before is None:
        raise words.wrong(line, f"a table begins with a word such as CTI3 or CGATS.17, and this with {text[:40]!r}")
    return before.kind


def _parse_count(words: _Words, line: int, name: str, values: list[str]) -> int:
    if len(values) != 1 or not values[0].isdigit():
        raise words.wrong(line, f"{name} needs a whole number, and has {' '.join(values)[:40]!r}")
    return int(values[0])


def _parse_rows(
    words: _Words, values: list[tuple[int, str]], fields: tuple[str, ...], counts: Mapping[str, tuple[int, int]]
) -> tuple[tuple[str, ...], ...]:
    size = len(fields)
    lines: dict[int, int] = {}
    for line, _ in values:
        lines[line] = lines.get(line, 0) + 1
    # a set may go over several lines, but one that begins on a line of its own and is of another length is a slip
    if len(values) % size:
        line, count = next(((n, c) for n, c in lines.items() if c != size), (values[-1][0], len(values)))
        raise words.wrong(line, f"{count} values, and there are {size} fields ({', '.join(fields[:4])} …)")
    rows = tuple(tuple(text for _, text in values[i : i + size]) for i in range(0, len(values), size))
    at, wanted = counts.get("NUMBER_OF_SETS", (0, len(rows)))
    if wanted != len(rows):
        raise words.wrong(at, f"NUMBER_OF_SETS is {wanted}, and there are {len(rows)}")
    return rows


def _format_table(table: CgatsTable) -> str:
    lines = [table.kind, "", *(f"{name} {_quote_value(value)}" for name, value in table.keywords)]
    lines += [
        "",
        f"NUMBER_OF_FIELDS {len(table.fields)}",
        "BEGIN_DATA_FORMAT",
        " ".join(table.fields),
        "END_DATA_FORMAT",
    ]
    lines += ["", f"NUMBER_OF_SETS {len(table.rows)}", "BEGIN_DATA"]
    # ArgyllCMS takes the quotation marks of a column for its type: words have them throughout, numbers never
    columns = [
        list(map(str if all(map(_NUMBER.match, column)) else _quote_value, column))
        for column in zip(*table.rows, strict=True)
    ]
    lines += [" ".join(row) for row in zip(*columns, strict=True)]
    return "\n".join([*lines, "END_DATA", ""])


def _quote_value(value: str) -> str:
    return '"' + value.replace('"', '""') + '"'
