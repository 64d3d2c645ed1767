"""A PDF form filled in by hand: its fields and the answers are checked, every form is written or plotted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout import atomic, units
from handout.errors import InputError, MissingCharacters
from handout.libraries import cv2
from handout.pdf_forms import answers as answering
from handout.pdf_forms import entries, filled
from handout.pdf_forms.answers import Answers
from handout.pdf_forms.entries import SETTINGS, FieldEntry, Filler, page_manuscript
from handout.pdf_forms.fields import Box, Field, PdfForm, read_form
from handout.pipeline import plotting, programs, texts
from handout.pipeline.options import FillOptions, PictureOptions, SheetOptions, WritingOptions
from handout.pipeline.results import SILENT, Attendant, Delivery, Facts, Listener, Result, Tally
from handout.pipeline.texts import STROKES, WritingTask
from handout.pipeline.writing import deliver, wanted_in
from handout.printing.rows import TableRow, select
from handout.printing.table_files import read_sheet
from handout.scanning.pdf_pages import drawn_page
from handout.sinks import FORMATS, check_outputs
from handout.values import Drawing, Manuscript

_MOST_NAMED = 20  # problems that a refusal lists
_PAGES_KEPT = 8  # pages of a form that are kept as pictures while its lines are looked for


@dataclass(frozen=True)
class FieldList(Result):
    """The fields of a form."""

    form: PdfForm

    def facts(self) -> Facts:
        pages = [{"width_mm": round(page.width, 2), "height_mm": round(page.height, 2)} for page in self.form.pages]
        return {
            "form": str(self.form.path),
            "pages": pages,
            "fields": [_field_facts(each) for each in self.form.fields],
        }

    @property
    def lines(self) -> list[str]:
        """One on each field: its name, what it takes, its page."""
        return [_describe_field(each) for each in self.form.fields]


def fields_of(form: str | Path) -> FieldList:
    """What a form asks for. Raises InputError: it cannot be read, or has no fields."""
    read = read_form(Path(form))
    return FieldList(read, notes=_notes(read))


def fill(
    form: str | Path,
    table: str | Path,
    outputs: Sequence[str | Path],
    filling: FillOptions = FillOptions(),
    writing_options: WritingOptions = WritingOptions(),
    picture: PictureOptions = PictureOptions(),
    *,
    listener: Listener = SILENT,
) -> Delivery:
    """Fill in a form for every row of a table, and write files.

    table : .csv or .xlsx: a row a form, whose columns are called like its fields; or the columns "field" and "value".
    outputs : .pdf is the form with the writing on it, .png its picture; others have the writing alone.

    Raises InputError: the form or the table cannot be read, or an answer cannot be written; nothing has been written
    then.
    """
    paths = [Path(name) for name in outputs]
    extra = programs.Programs(filling.device, paths).sinks
    check_outputs(paths, extra)
    work = _prepare_work(Path(form), Path(table), filling, writing_options, picture, listener)
    forms, tally, files, entries = work.forms, Tally(), list[Path](), 0
    named = {answers.row: _files(work.form, paths, answers.row if len(forms) > 1 else None) for answers in forms}
    check_outputs([file for each in named.values() for file in each.values()], extra)
    wanted = wanted_in(paths)
    with atomic.open_together() as opening:
        for number, answers in enumerate(forms):
            listener.progress(number / len(forms), f"filling in {number + 1}/{len(forms)}")
            drawings, told, count = work.draw(answers, wanted)
            tally += told
            entries += count
            for (path, page), file in named[answers.row].items():
                content = _content(work, answers, drawings, path, page, extra)
                if content is not None:
                    with opening(file) as stream:
                        stream.write(content)
                    files.append(file)
    return deliver(tally, work.task, files, work.notes, {"forms": len(forms), "entries": entries})


def plot_forms(
    form: str | Path,
    table: str | Path,
    port: str,
    filling: FillOptions = FillOptions(),
    writing_options: WritingOptions = WritingOptions(),
    *,
    attendant: Attendant = SILENT,
) -> plotting.Plotted:
    """Fill in a form for every row of a table with a plotter, sheet after sheet; pages without writing are left out.

    Raises InputError, DeviceError, KeyboardInterrupt: as `fill` and `plotting.plot`.
    """
    profile = plotting.machine(filling.device, port)
    work = _prepare_work(Path(form), Path(table), filling, writing_options, PictureOptions(), attendant)
    tally, drawings, blank, entries = Tally(), list[Drawing](), set[int](), 0
    for answers in work.forms:
        written, told, count = work.draw(answers, STROKES)
        tally += told
        entries += count
        drawings += written.values()
        blank |= set(range(len(work.form.pages))) - set(written)
    notes = work.notes
    if blank:
        which = ", ".join(str(page + 1) for page in sorted(blank))
        notes = (*notes, f"{form}: nothing is written on page {which}: lay in the others alone.")
    attendant.note(*notes)
    plotted = plotting.plot_drawings(drawings, profile, port, Path(form).name, attendant, fast=work.task.fast)
    return plotted.tell_as(deliver(tally, work.task, (), notes, {"forms": len(work.forms), "entries": entries}))


@dataclass
class _Work:
    """The forms of a call: what is written into each, and how."""

    form: PdfForm
    forms: Sequence[Answers]
    task: WritingTask
    filling: FillOptions
    notes: tuple[str, ...]
    _blank: dict[frozenset[str], bytes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        layout = self.task.layout

        @lru_cache(maxsize=_PAGES_KEPT)
        def picture(page: int) -> NDArray[np.uint8]:
            return self.picture(self.forms[0], page, entries.DPI)

        def rules(page: int, box: Box) -> tuple[float, ...]:
            return entries.rules(picture(page), box)

        self._filler = Filler(self.task.hand, layout.x_height, rules, layout.jitter)

    def blank(self, answers: Answers) -> bytes:
        """The form without the values that are answered."""
        names = frozenset(answers.values)
        if names not in self._blank:
            self._blank[names] = filled.blank(self.form, names)
        return self._blank[names]

    def picture(self, answers: Answers, page: int, dpi: float) -> NDArray[np.uint8]:
        """A page of that as pixels."""
        return drawn_page(self.form.path, page + 1, dpi, self.blank(answers))

    def entries(self, answers: Answers) -> list[FieldEntry]:
        """What is written into one form."""
        rng = np.random.default_rng([self.task.seed, answers.row, 1])
        return self._filler.entries(self.form.fields_by_name, answers.values, rng)

    def problems(self, answers: Answers) -> list[str]:
        """Phrases on answers that are too long for their fields, or that the hand cannot write."""
        entries = [entry for entry in self.entries(answers) if entry.layout is not None]
        layouts = [entry.layout for entry in entries if entry.layout is not None]
        phrases = list[str]()
        if not entries:
            return phrases
        try:
            sheets = texts.try_parts([entry.text for entry in entries], layouts, self.task, answers.row)
        except MissingCharacters:
            for entry, layout in zip(entries, layouts, strict=True):
                try:
                    texts.try_parts([entry.text], [layout], self.task, 0)
                except MissingCharacters as error:
                    phrases.append(f"{entry.field}: {str(error).rstrip('.')}")
            return phrases
        too_long: dict[str, str] = {}
        for entry, sheet in zip(entries, sheets, strict=True):
            if sheet is None or sheet.manuscript.x_height < SETTINGS.least_mm * entry.frame.scale:
                width, height = (side / entry.frame.scale for side in entry.frame.size)
                too_long[entry.field] = (
                    f"{entry.field}: {answering.quote_answer(entry.text)} is too long for its {width:.0f} x "
                    f"{height:.0f} mm, however small it is written"
                )
        return list(too_long.values())

    def draw(self, answers: Answers, wanted: frozenset[str]) -> tuple[dict[int, Drawing], Tally, int]:
        """One form in ink or strokes: its pages by their numbers, those without writing left out; how many entries."""
        entries = self.entries(answers)
        parts = [entry for entry in entries if entry.layout is not None]
        layouts = [entry.layout for entry in parts if entry.layout is not None]
        task, settings = self.task, dict[int, Manuscript]()
        if parts:
            task, sheets = texts.set_parts([entry.text for entry in parts], layouts, task, answers.row)
            settings = {id(entry): sheet.manuscript for entry, sheet in zip(parts, sheets, strict=True)}
        drawings, tally = dict[int, Drawing](), Tally()
        for number in dict.fromkeys(entry.page for entry in entries):
            rng = np.random.default_rng([self.task.seed, answers.row, 2, number])
            here = [(entry, settings.get(id(entry))) for entry in entries if entry.page == number]
            page, jitter = self.form.pages[number], task.layout.jitter
            manuscript = page_manuscript(page, here, task.hand, self.filling.mark, jitter, rng)
            about = {"title": self.form.path.name, "row": answers.row, "page_number": number + 1}
            drawings[number] = texts.draw(manuscript, task, rng, about, wanted)
            tally += Tally.from_pages([manuscript], [drawings[number]])
            if not self.filling.writing_only:
                drawings[number] = replace(drawings[number], beneath=partial(self._lay, answers, number))
        return drawings, tally, len(entries)

    def _lay(self, answers: Answers, page: int, paper: NDArray[np.uint8], dpi: float) -> NDArray[np.uint8]:
        """A page of the form in place of a paper (h, w, 3)."""
        ground, (height, width) = self.picture(answers, page, dpi), paper.shape[:2]
        if ground.shape[:2] == (height, width):
            return ground
        return np.asarray(cv2.resize(ground, (width, height), interpolation=cv2.INTER_LINEAR), dtype=np.uint8)


def _prepare_work(
    form: Path,
    table: Path,
    filling: FillOptions,
    writing_options: WritingOptions,
    picture: PictureOptions,
    listener: Listener,
) -> _Work:
    """All that is asked for, checked; what is wrong with it is listed by row and field."""
    if writing_options.slips:
        raise InputError("slips: forms are filled in without slips; leave --slips out.")
    if picture.paper != "none":
        raise InputError("--paper: the paper is the form; leave --paper out, or give --writing-only for none.")
    read = read_form(form)
    forms, problems = _answers(read, table, filling)
    task = texts.prepare(writing_options, SheetOptions("A4", "0mm"), picture)
    notes = (*_notes(read), *texts.not_followed(task, ink_shown=True))
    work = _Work(read, forms, task, filling, notes)
    for number, answers in enumerate(forms):
        listener.progress(0.3 * number / len(forms), f"checking {number + 1}/{len(forms)}")
        problems += [f"row {answers.row}: {phrase}" for phrase in work.problems(answers)]
    if problems:
        more = len(problems) - _MOST_NAMED
        listed = [*problems[:_MOST_NAMED], *([f"and {more} more"] if more > 0 else [])]
        raise InputError(f"{table}: nothing is filled in, since\n" + "\n".join(f"  {line}." for line in listed))
    return work


def _answers(form: PdfForm, table: Path, filling: FillOptions) -> tuple[list[Answers], list[str]]:
    """The answers of the rows that are asked for, and what is wrong with them."""
    header, rows = _rows(table, filling.rows)
    fields, problems = answering.match_columns(form, header, filling.columns)
    forms, understood = [], not problems
    for number, cells in rows:
        answers, wrong = answering.answers_of(fields, number, cells)
        wrong = [*wrong, *(answering.lacking(form, answers, wrong) if understood else ())]
        forms.append(answers)
        if not (answers.values or wrong):
            wrong = ["there is no answer in it"]
        problems += [f"row {number}: {phrase}" for phrase in wrong]
    if not forms:
        problems.append("there is no row with answers under the header")
    return forms, problems


def _rows(table: Path, wanted: str) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The header of a table, and the numbers and cells of the rows that are asked for."""
    records = [(number, record) for number, record in enumerate(read_sheet(table).records, 1) if record.is_filled]
    if not records:
        raise InputError(f"{table} is empty.")
    (top, first), *others = records
    if [title.strip().casefold() for title in first.cells] == ["field", "value"]:
        # one form, a line a field
        pairs = [(*record.cells, "", "")[:2] for _, record in others]
        return [field for field, _ in pairs], [(top + 1, [value for _, value in pairs])]
    chosen = {row.number for row in select([TableRow(number, ()) for number, _ in others], wanted)}
    return first.cells, [(number, record.cells) for number, record in others if number in chosen]


def _notes(form: PdfForm) -> tuple[str, ...]:
    return tuple(f"{form.path}: {note}." for note in form.notes)


def _files(form: PdfForm, paths: Sequence[Path], row: int | None) -> dict[tuple[Path, int | None], Path]:
    """The files of one form: by output and page (None: all pages in one file)."""
    files: dict[tuple[Path, int | None], Path] = {}
    for path in paths:
        stem = path.stem if row is None else f"{path.stem}-{row}"
        together = path.suffix.lower() == ".pdf"
        if together or len(form.pages) == 1:
            files[path, None if together else 0] = path.with_name(f"{stem}{path.suffix}")
            continue
        for page in range(len(form.pages)):
            files[path, page] = path.with_name(f"{stem}-{page + 1}{path.suffix}")
    return files


def _content(
    work: _Work,
    answers: Answers,
    drawings: Mapping[int, Drawing],
    path: Path,
    page: int | None,
    extra: Mapping[str, programs.PageSink],
) -> bytes | None:
    """One file of a form; None for a page without writing."""
    suffix, look = path.suffix.lower(), work.task.look
    if page is None:
        if not work.filling.writing_only:
            pages = {
                number: (FORMATS[".pdf"].write([each], look), each.ink is not None) for number, each in drawings.items()
            }
            return filled.fill_form(work.blank(answers), work.form, pages)
        every = [drawings.get(number) or Drawing((), sheet) for number, sheet in enumerate(work.form.pages)]
        return FORMATS[".pdf"].write(every, look)
    if page not in drawings:
        return None
    return FORMATS[suffix].write([drawings[page]], look) if suffix in FORMATS else extra[suffix](drawings[page])


def _field_facts(each: Field) -> Facts:
    """What `--json` prints of a field."""
    names = ("name", "kind", "label", "required", "read_only", "multiline", "cells", "longest", "value")
    every = {name: value for name, value in asdict(each).items() if name in names and value not in ("", None, False, 0)}
    choices: Facts = {"options": [shown for _, shown in each.options]} if each.options else {}
    places = [{"page": w.page + 1, "box_mm": [round(side, 2) for side in w.box]} for w in each.widgets]
    return {**every, **choices, "places": places}


def _describe_field(each: Field) -> str:
    """A field in one line."""
    left, top, right, bottom = each.widgets[0].box
    pages = ", ".join(str(page + 1) for page in dict.fromkeys(widget.page for widget in each.widgets))
    said = [each.kind if not each.multiline else "text of several lines", f"page {pages}"]
    said.append(f"{right - left:.0f} x {bottom - top:.0f} mm")
    if each.cells:
        said.append(f"{each.cells} cells")
    elif each.longest:
        said.append(f"at most {units.count(each.longest, 'character')}")
    if each.kind in ("radio", "choice") and each.options:
        said.append(f"one of {', '.join(shown for _, shown in each.options)}")
    said += ["required"] * each.required + ["locked"] * each.read_only
    said += [f"holds {each.value!r}"] if each.value else []
    label = f" ({each.label})" if each.label and each.label != each.name else ""
    return f"{each.name}{label}: {'; '.join(said)}"
