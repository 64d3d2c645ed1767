"""The rows of an address table: what one is, and the choice of some of them by number (``3-7,9``, ``7-``)."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from handout.errors import InputError

_PART = re.compile(r"(\d{1,9})?\s*(-)?\s*(\d{1,9})?\Z")


@dataclass(frozen=True)
class TableRow:
    """One row of an address table.

    number : as a spreadsheet counts, the header being row 1.
    lines : what is written, from the name to the country; empty if there is nothing to address.
    warnings : what the user should look at, each a phrase to stand after "row 5:".
    problem : why the row cannot be addressed; empty if it can.
    cells : every cell by its header, as found in the file.
    copies : how often the row is made, where it says so itself.
    """

    number: int
    lines: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    problem: str = ""
    cells: Mapping[str, str] = field(default_factory=dict)
    copies: int = 1


def select(rows: Sequence[TableRow], text: str) -> list[TableRow]:
    """The rows that `text` names by their numbers in the file, in the order of the file; all for "".

    text : numbers and ranges: ``"3-7,9"``; ``"7-"`` goes to the end, ``"-4"`` begins at the start.

    Raises InputError: not a list of rows, or a part of it that names no row of the table.
    """
    if not text.strip():
        return list(rows)
    wanted: set[int] = set()
    for part in text.split(","):
        first, last = _bounds(part.strip(), text)
        inside = {row.number for row in rows if first <= row.number <= last}
        if not inside:
            numbers = [row.number for row in rows]
            have = f"{numbers[0]} to {numbers[-1]}" if numbers else "none"
            raise InputError(f"rows: {part.strip()!r} names no row of the table, which has addresses in rows {have}.")
        wanted |= inside
    return [row for row in rows if row.number in wanted]


def _bounds(part: str, text: str) -> tuple[int, int]:
    match = _PART.match(part)
    if match is None or not (match.group(1) or match.group(3)):
        raise InputError(f"rows: {text!r} is not a list of rows; write it as 3-7,9 (or 7- for row 7 to the end).")
    first = int(match.group(1) or 0)
    last = int(match.group(3) or 10**9) if match.group(2) else first
    if first > last:
        raise InputError(f"rows: {part!r} runs backwards; write {last}-{first}.")
    return first, last


def ranges(numbers: Collection[int], among: Sequence[int]) -> str:
    """Row numbers as `select` reads them: runs within `among` become ranges, one that reaches its end stays open."""
    parts: list[str] = []
    run: list[int] = []
    for number in (*sorted(among), None):
        if number is not None and number in numbers:
            run.append(number)
        elif run:
            to_end = number is None and len(among) > 1
            parts.append(f"{run[0]}-" if to_end else f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}")
            run = []
    return ",".join(parts)


def name_rows(numbers: Sequence[int], among: Sequence[int] | None = None) -> str:
    """Rows in a few words: runs of the table's rows, or of `among`, as ranges."""
    if len(numbers) == 1:
        return f"row {numbers[0]}"
    text = ranges(numbers, range(1, numbers[-1] + 2) if among is None else among)
    return f"rows {text}{numbers[-1] if text.endswith('-') else ''}"
