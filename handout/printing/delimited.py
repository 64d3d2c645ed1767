"""Delimited text as programs and people make it: records of cells, whatever the delimiter, the quotes and the ends."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from handout import encodings
from handout.errors import TableError
from handout.printing import address, columns

DELIMITERS = ",;\t|"
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?\s*\Z', re.IGNORECASE)
_MOST_LINES = 20
_SEARCHED = 12  # rows in which the header may be
# a cell in the quotes of a word processor
_CURLY = re.compile(r"(?P<before>(?:\A|[,;\t|\n])[ ]?)[“”„](?P<cell>[^“”„\n]*)[“”](?=[ ]?(?:[,;\t|\r\n]|\Z))")
_RULE = re.compile(r"\A:?(?:-{3,}|={3,}):?\Z")  # under the header of a table that is drawn with strokes
_MARKED = re.compile(r"""'(?=[\d+=])|="(?P<text>[^"]*)"\Z""")


@dataclass(frozen=True)
class Record:
    """One row of cells, as they are shown; `lines` are the physical lines it came from, counted from 0."""

    cells: list[str]
    lines: range = range(0)


@dataclass(frozen=True)
class Sheet:
    """The records of a file, the first being row 1, and what has to be said of it.

    encoding : where it was guessed; odd : the lines that the guess concerns.
    """

    records: list[Record]
    notes: tuple[str, ...] = ()
    encoding: str = ""
    odd: frozenset[int] = frozenset()


def tidy(cell: str) -> str:
    """A cell as it is shown: without the marks by which spreadsheets keep a number as text (``'01067``)."""
    return address.tidy(_MARKED.sub(lambda found: found.group("text") or "", cell.strip(), count=1))


def sheet(path: Path, data: bytes) -> Sheet:
    """The records in the bytes of a file.

    Raises
    ------
    TableError
        No text, empty, or a quotation mark that is never closed.
    """
    try:
        decoded = encodings.decode(data)
    except encodings.NoText as error:
        at = f", line {error.line}" if error.line else ""
        raise TableError(f"{path}{at}: no text: {error}; save the table as CSV (UTF-8) and give that file.") from error
    lines = list(io.StringIO(_CURLY.sub(r'\g<before>"\g<cell>"', decoded.text), newline=""))
    odd = decoded.odd
    if not any(line.strip() for line in lines):
        raise TableError(f"{path} is empty.")
    separator = _SEPARATOR_LINE.match(lines[0])
    if separator is not None:
        lines, odd = lines[1:], frozenset(n - 1 for n in odd)
    delimiters = separator.group(1) if separator else DELIMITERS
    records, unclosed = max((_records(lines, d) for d in delimiters), key=lambda found: _likelihood(found[0]))
    if unclosed:
        raise TableError(f"{path}: row {unclosed}: a quotation mark is opened and never closed.")
    for n, record in enumerate(records, 1):
        longest = max((cell.count("\n") for cell in record.cells), default=0)
        if longest > _MOST_LINES:
            raise TableError(
                f"{path}: row {n}: a cell runs over {longest + 1} lines, more than {_MOST_LINES}: "
                "a quotation mark is probably missing in it."
            )
    return Sheet(records, (), decoded.encoding if decoded.guessed else "", odd)


def _records(lines: list[str], delimiter: str) -> tuple[list[Record], int]:
    """The records, and the row in which a quotation mark stays open to the end of the file (0: none)."""
    for strict in (True, False):
        # strict finds the open quote; what else it dislikes (`"Ada" Ltd`) is common and harmless
        reader = csv.reader(lines, delimiter=delimiter, strict=strict, skipinitialspace=True)
        records: list[Record] = []
        try:
            start = 0
            for cells in reader:
                records.append(Record([tidy(cell) for cell in cells], range(start, reader.line_num)))
                start = reader.line_num
            return records, 0
        except csv.Error as error:
            if "unexpected end" in str(error) or not strict:
                return records, len(records) + 1
    raise AssertionError("unreachable")


def written(record: Record) -> bool:
    """Whether a row holds anything: one of nothing but delimiters or ruled lines is blank."""
    return any(_RULE.sub("", cell).strip(DELIMITERS) for cell in record.cells)


def filled(record: Record) -> bool:
    """Whether a row below the header holds anything."""
    return any(_RULE.sub("", cell) for cell in record.cells)


def candidates(records: Sequence[Record]) -> list[int]:
    """The rows, from 1, that may be the header: the first few that are written."""
    return [n for n, record in enumerate(records, 1) if written(record)][:_SEARCHED]


def _likelihood(records: Sequence[Record]) -> tuple[int, int, int]:
    """How well a delimiter suits: headers understood, columns, few rows longer than the first."""
    tops = candidates(records)
    if not tops:
        return (0, 0, 0)
    known = max(sum(column.meaning is not None for column in columns.columns(records[n - 1].cells)) for n in tops)
    width = len(records[tops[0] - 1].cells)
    return known, width, -sum(len(record.cells) > width for record in records)
