"""Scans of filled sheets to answers, and the table in which answers are kept.

A sheet is found by its marks, however it lies, and its code says whose it is.  An answer that is not plain is left
empty and doubtful, with a picture of its row: a person looks, and writes the answer into the table.
"""

from __future__ import annotations

import csv
import io
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.prompting.sheet_codes import read_codes
from handout.prompting.sheet_detection import rectify
from handout.prompting.sheet_layout import in_grey, register
from handout_lab.study import marks, sheets
from handout_lab.study.marks import Manner, Mark
from handout_lab.study.sheets import COVER, SheetRecord

_NAMED = "study-"  # before a study's name, which a spreadsheet would take for a number where it is as 375329e11892
PLAIN, DOUBTFUL = "plain", "doubtful"
_COLUMNS = ("study", "person", "questionnaire", "item", "answer", "state", "why", "picture")
_AROUND = 3.0  # mm of a row's picture above and below its boxes and snippet

Place = tuple[int, str, str]  # of an answer: person, questionnaire, item


@dataclass(frozen=True)
class Answer:
    """One row of somebody's sheet.

    item : its number, or what the cover asks; answer : what its box means, "" where that is doubtful.
    why : what made it doubtful, or was not plain; picture : the file of a picture of the row.
    """

    study: str
    person: int
    questionnaire: str
    item: str
    answer: str
    state: str = PLAIN
    why: str = ""
    picture: str = ""

    @property
    def place(self) -> Place:
        """What it answers."""
        return self.person, self.questionnaire, self.item


@dataclass(frozen=True, eq=False)
class ReadRow:
    """A row as it was read: what its boxes hold, None where they were not found; and its picture."""

    row: sheets.Row
    marks: tuple[Mark, ...] | None
    picture: NDArray[np.uint8] = field(repr=False)


@dataclass(frozen=True, eq=False)
class ReadSheet:
    """A sheet as it was read."""

    source: str
    record: SheetRecord
    rows: tuple[ReadRow, ...]


def read_sheet(picture: NDArray[np.uint8], source: str) -> ReadSheet:
    """Read one sheet in a scan or photograph, any way round.

    Parameters
    ----------
    picture : (h, w, 3) uint8
        From about 120 dpi.

    Raises
    ------
    InputError
        No sheet of a study, too few of its marks, or a code that cannot be read.
    """
    grey = in_grey(picture)
    registration = register(grey)
    if registration is None:
        raise InputError(f"{source}: no sheet of a study is on it; scan the whole sheet with its four corner marks.")
    found = read_codes(grey, registration, sheets.codes(registration.page), (sheets.CODE_VERSION,))
    record = next((known for data in found if (known := sheets.unpacked(data)) is not None), None)
    if record is None:
        raise InputError(
            f"{source}: neither code at the foot of the sheet can be read: scan it at 150 dpi or more (this has "
            f"{registration.dpi:.0f}), flat and clean; or it is a sheet of something else."
        )
    flat = rectify(picture, registration, marks.DPI)
    depth = marks.depth_of(flat)
    rows = sheets.rows(registration.page, record)
    return ReadSheet(source, record, tuple(_read(depth, flat, row) for row in rows))


def _read(depth: NDArray[np.float32], flat: NDArray[np.uint8], row: sheets.Row) -> ReadRow:
    held = marks.read_row(depth, row)
    unit = marks.DPI / 25.4
    above = sheets.above(row)
    top, foot = float(row.boxes[:, 1].min() - above - _AROUND), float(row.boxes[:, 3].max() + _AROUND)
    picture = flat[max(0, round(top * unit)) : round(foot * unit)]
    return ReadRow(row, None if held is None else tuple(held), picture)


def answers(read: Iterable[ReadSheet]) -> tuple[list[Answer], dict[Place, NDArray[np.uint8]]]:
    """What all sheets say, in order, and pictures of the rows that are doubtful.

    How somebody marks is told from all of his sheets.  A row that was scanned twice counts once.

    Raises
    ------
    InputError
        Sheets of several studies.
    """
    given: dict[Place, list[tuple[Answer, NDArray[np.uint8]]]] = defaultdict(list)
    for _, own in _by_person(read):
        asked = [row for sheet in own if sheet.record.kind != COVER for row in sheet.rows]
        how = marks.manner([row.marks for row in asked if row.marks is not None])
        for sheet in sorted(own, key=lambda one: one.record.page):
            for row in sheet.rows:
                answer = _answer(sheet.record, row, how)
                given[answer.place].append((answer, row.picture))
    found = [_agreed([answer for answer, _ in several]) for several in given.values()]
    return found, {one.place: given[one.place][-1][1] for one in found if one.state == DOUBTFUL}


def _by_person(read: Iterable[ReadSheet]) -> list[tuple[int, list[ReadSheet]]]:
    """The sheets of every person, in order."""
    by_person: dict[int, list[ReadSheet]] = defaultdict(list)
    studies = dict[str, str]()
    for sheet in read:
        by_person[sheet.record.person].append(sheet)
        studies.setdefault(sheet.record.study, sheet.source)
    if len(studies) > 1:
        named = ", ".join(f"{study} ({source})" for study, source in studies.items())
        raise InputError(f"These are sheets of several studies: {named}. Read those of each by themselves.")
    return sorted(by_person.items())


def _answer(record: SheetRecord, read: ReadRow, how: Manner) -> Answer:
    row = read.row
    name = ("P", row.questionnaire) if record.kind == COVER else (record.kind, str(row.number))
    if read.marks is None:
        return Answer(record.study, record.person, *name, "", DOUBTFUL, "its boxes were not found")
    decision = marks.decided(read.marks, how)
    if decision.box is None:
        return Answer(record.study, record.person, *name, "", DOUBTFUL, decision.why)
    return Answer(record.study, record.person, *name, row.answers[decision.box], PLAIN, decision.why)


def _agreed(several: Sequence[Answer]) -> Answer:
    """A row that may have been scanned several times: plain if none contradicts."""
    said = sorted({one.answer for one in several if one.answer})
    if len(said) > 1:
        why = f"scanned {len(several)} times: {', and '.join(said)}"
        return replace(several[0], answer="", state=DOUBTFUL, why=why)
    return next((one for one in several if one.answer), several[0])


def repeated(read: Iterable[ReadSheet]) -> dict[tuple[int, int], list[str]]:
    """(person, page) → its scans, where there are several."""
    found: dict[tuple[int, int], list[str]] = defaultdict(list)
    for sheet in read:
        found[sheet.record.person, sheet.record.page].append(sheet.source)
    return {place: scans for place, scans in sorted(found.items()) if len(scans) > 1}


def missing(read: Sequence[ReadSheet]) -> dict[int, list[int]]:
    """Person → pages of him that were not among the scans, for those of whom some were."""
    pages: dict[int, set[int]] = defaultdict(set)
    count = dict[int, int]()
    for sheet in read:
        pages[sheet.record.person].add(sheet.record.page)
        count[sheet.record.person] = sheet.record.pages
    lacking = {person: sorted(set(range(1, count[person] + 1)) - have) for person, have in sorted(pages.items())}
    return {person: gone for person, gone in lacking.items() if gone}


def to_csv(rows: Iterable[Answer]) -> bytes:
    """The table."""
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for row in rows:
        writer.writerow([_NAMED + row.study, *(getattr(row, name) for name in _COLUMNS[1:])])
    return stream.getvalue().encode("utf-8")


def from_csv(path: Path) -> list[Answer]:
    """The table again, with what a person wrote into it; parted by what his spreadsheet parts by.

    A row that is there twice, as where two tables were put together, counts once.

    Raises
    ------
    InputError
        It cannot be read, or a row is none, or is there with two answers.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path} is no table in UTF-8: give the one that `study read` wrote, saved as CSV in UTF-8."
        ) from error
    parted_by = max(",;\t", key=text.partition("\n")[0].count)
    table = csv.DictReader(io.StringIO(text, newline=""), delimiter=parted_by)
    if not set(_COLUMNS[:5]) <= set(table.fieldnames or ()):
        raise InputError(f"{path} lacks the columns {', '.join(_COLUMNS[:5])}: give what `handout study read` wrote.")
    found = dict[tuple[str, Place], Answer]()
    for row in table:
        if not any(row.get(name) for name in _COLUMNS):  # spreadsheets keep rows that were emptied
            continue
        answer = _checked(row, f"{path}, line {table.line_num}")
        before = found.setdefault((answer.study, answer.place), answer)
        if before.answer and answer.answer and before.answer != answer.answer:
            raise InputError(
                f"{path}, line {table.line_num}: person {answer.person} answers {answer.questionnaire} {answer.item} "
                f"twice, {before.answer} and {answer.answer}: leave one of the rows."
            )
        found[answer.study, answer.place] = before if before.answer else answer
    return list(found.values())


def _checked(row: Mapping[str, str | None], where: str) -> Answer:
    values = {name: (row.get(name) or "").strip() for name in _COLUMNS}
    values["study"] = values["study"].removeprefix(_NAMED)
    person, item = values["person"], values["item"]
    allowed: tuple[str, ...] = sheets.ANSWERS.get(values["questionnaire"], ()) if item.isdecimal() else ()
    if values["questionnaire"] == COVER:
        allowed = next((options for name, _, options in sheets.ABOUT if name == item), ())
    if not person.isdecimal() or not allowed:
        raise InputError(f"{where}: this is no answer of a study (person {person!r}, item {item!r}).")
    answer = {word: name for name, word in sheets.WORD.items()}.get(values["answer"].lower(), values["answer"].lower())
    if answer and answer not in allowed:
        raise InputError(f"{where}: {values['answer']!r} is not one of {', '.join(allowed)}; leave it empty for none.")
    item = str(int(item)) if item.isdecimal() else item
    return Answer(**{**values, "person": int(person), "item": item, "answer": answer})  # type: ignore[arg-type]
