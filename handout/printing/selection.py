"""Choosing rows of a table: ``3-7,9``, ``7-``."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from handout.errors import InputError
from handout.printing.address import Row

_PART = re.compile(r"(\d{1,9})?\s*(-)?\s*(\d{1,9})?\Z")


def select(rows: Sequence[Row], text: str) -> list[Row]:
    """The rows that `text` names by their numbers in the file, in the order of the file; all for "".

    Parameters
    ----------
    rows : sequence of Row
    text : str
        Numbers and ranges: ``"3-7,9"``; ``"7-"`` goes to the end, ``"-4"`` begins at the start.

    Raises
    ------
    InputError
        Not a list of rows, or a part of it that names no row of the table.
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
