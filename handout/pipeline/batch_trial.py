"""A table before it is kept, as a page looks at it: what is odd of its rows, and the letter of one."""

from __future__ import annotations

import re
import tempfile
from dataclasses import replace
from pathlib import Path

from handout.errors import InputError
from handout.pipeline import merging
from handout.pipeline.options import BatchPlan
from handout.pipeline.results import SILENT, Facts
from handout.printing.rows import TableRow

_SHOWN = 3  # cells of a row by which it is known on the page
_MOST_TRIED = 500  # that are tried while the letter is written; the proof tries all
# what a command would be told to type, and a file that a letter on a page has not → what stands on the page
_AS_SHOWN = (
    (re.compile(r"(?:; [^;]*--[a-z].*?| or \{% if \w+ %\})(\.?)\Z"), r"\1"),
    (re.compile(r"\b(use) --[a-z-]+ or "), r"\1 "),
    (re.compile(r"letter\.(?:txt|md), (line \d+): "), r"\1 of the letter: "),
    # a gap as the page Letters from a table writes it
    (re.compile(r'{{ (\w+)\|default\("…"\) }}'), lambda gap: f"«{gap[1].replace('_', ' ')}, else …»"),
)


def try_table(table: Path, letter: str, markdown: bool, plan: BatchPlan, row: int | None = None) -> Facts:
    """A table before it is kept: its columns as a letter calls them, what is odd of its rows, the letter of one.

    Returns columns : `name`, which stands in gaps, and `header`; rows : `row`, `called`, `why` it is to be looked at,
        and `filled`, its letter.
        trouble : why the letter does not fit the table; no_envelopes : why no envelopes can be addressed.
        numbers : of all rows in the file.
        tried : the `row` that is asked for by its number, in place of all.

    Raises InputError: the table cannot be read.
    """
    with tempfile.TemporaryDirectory() as work:
        path = Path(work) / f"letter.{'md' if markdown else 'txt'}"
        path.write_text("-", encoding="utf-8")
        plain, wrong = _try_letter(table, plan, path, False)
        if plain is None:
            raise InputError(wrong)
        _, no_envelopes = _try_letter(table, plan, path, True)
        path.write_text(letter, encoding="utf-8")
        envelopes = plan.merge.with_envelopes and not no_envelopes
        merged, trouble = _try_letter(table, plan, path, envelopes) if letter.strip() else (None, "")
    merged, fields = merged or plain, plain.fields
    names = {header: name for name, header in reversed([*fields.headers_by_name.items()])}
    rows = list(merged.table)
    found = next((_try_row(merged, each, plan.writing.language) for each in rows if each.number == row), None)
    shown = [] if found else rows
    return {
        "columns": [{"name": names[header], "header": header} for header in fields.headers if header in names],
        "count": len(rows),
        "numbers": [each.number for each in shown],
        "rows": [_try_row(merged, each, plan.writing.language) for each in shown[:_MOST_TRIED]],
        "notes": [*map(as_shown, merged.table.notes)],
        "trouble": trouble,
        "no_envelopes": no_envelopes,
        "tried": found,
    }


def _try_letter(table: Path, plan: BatchPlan, path: Path, envelopes: bool) -> tuple[merging.MailMerge | None, str]:
    """A table with a letter, or why they do not fit."""
    options = replace(plan.merge, letter=path, alone=True, given=frozenset[str](), with_envelopes=envelopes)
    try:
        return merging.read_merge(table, plan.table, options, SILENT), ""
    except InputError as error:
        return None, as_shown(str(error).replace(f"{table}: ", "").replace(f"{table.parent}/", ""))


def as_shown(sentence: str) -> str:
    """A sentence as a page shows it, which has fields for what a command is told to type."""
    for typed, shown in _AS_SHOWN:
        sentence = typed.sub(shown, sentence)
    return sentence


def _try_row(merged: merging.MailMerge, row: TableRow, language: str) -> Facts:
    """A row, why it is to be looked at, and its letter as a text, `filled`, where that can be filled."""
    filled, why = "", [*([row.problem] if row.problem else []), *row.warnings]
    if merged.letter is not None:
        language = merged.language_of(merged.fields.manner(row), language)
        try:
            filled = f"{merged.head or ''}{merged.letter.fill(merged.fields.values(row), row.cells, language)}"
        except InputError as error:
            why.append(as_shown(str(error)))
    return {"row": row.number, "called": name_row(row), "why": why, "filled": filled}


def name_row(row: TableRow) -> str:
    """By what a row is known on the page."""
    return ", ".join([cell for cell in row.cells.values() if cell][:_SHOWN])
