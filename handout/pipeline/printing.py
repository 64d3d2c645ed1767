"""Envelopes from a table of addresses: it is read, every row is written and checked, and the pages are printed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import cast

import msgspec

from handout.calibrating import calibrated_ink
from handout.calibrating.calibrated_ink import CalibratedInk
from handout.errors import InputError
from handout.hand import library
from handout.pipeline import writing
from handout.pipeline.options import PictureOptions, PrintOptions, SheetOptions, WritingOptions, millimetres
from handout.pipeline.results import SILENT, Facts, Listener, Result, Tally
from handout.pipeline.writing import WritingTask
from handout.printing import journal, media, printers
from handout.printing.address_table import Addresses, read_addresses
from handout.printing.batch import BatchOptions, PageMaker, print_rows
from handout.printing.journal import Journal
from handout.printing.sending import Listener as BatchListener
from handout.printing.sending import PrintingStopped as PrintingStopped
from handout.printing.sending import Report as Report
from handout.profiles import Length, Nudge, Printer
from handout.sinks import write_drawing
from handout.values import Drawing, Raster
from handout.writing.layout import Layout

# said once before printing on a printer that no chart has been measured on
UNCALIBRATED = (
    "The colours are not calibrated for this printer and paper: the ink will look as the printer makes it, "
    "which may be lighter, darker or of another hue than the hand's own; handout calibrate wizard makes it match."
)
_MOST_NUDGE = 50.0  # mm, as in a profile
# options that change nothing on paper, and so make no other batch
_NOT_OF_THE_BATCH = {"dry_run", "resume", "again", "afresh", "page"}


@dataclass(frozen=True)
class Printed(Result):
    """What became of a table.

    destination : the queue or the printer.
    columns : how the table was read.
    calibration : what is known of the calibration that the pages went through, and a sentence on it.
    """

    report: Report
    tally: Tally
    seed: int
    hand: str
    destination: str
    columns: Facts
    calibration: Facts | None = None
    calibration_note: str = ""

    def facts(self) -> Facts:
        report = self.report
        return {
            **self.tally.facts(self.seed, self.hand, report.files),
            "rows": len(report.rows),
            "failed": [asdict(failure) for failure in report.failed],
            "jobs": [job.name for job in report.jobs],
            "warnings": list(report.warnings),
            "before": list(report.before),
            "unknown": [asdict(row) for row in report.unknown],
            "columns": self.columns,
            **({"notes": list(self.notes)} if self.notes else {}),
            **({"calibration": self.calibration} if self.calibration else {}),
        }


def print_(
    table: str | Path,
    printing: PrintOptions = PrintOptions(),
    writing_options: WritingOptions = WritingOptions(),
    picture: PictureOptions = PictureOptions(),
    *,
    listener: Listener = SILENT,
) -> Printed:
    """Address an envelope for every row of a table (CSV or .xlsx), and print it.

    Raises
    ------
    TableError, InputError
        The table cannot be read, or an option is wrong.
    PrinterError, PrintingStopped
        There is no such printer, or it failed in the middle of the batch.
    """
    profile = _printer(printing, writing_options)
    addresses = read_addresses(Path(table), printing.columns, printing.address, printing.no_name)
    listener.say(*(f"{table}: {note}." for note in addresses.notes))
    task = writing.prepare(writing_options, SheetOptions(printing.page, "0mm", 1), picture)
    profile = _fed(media.printer_for(task.layout.page, profile), printing)
    notes = writing.not_followed(task, picture, ink_shown=True)
    listener.note(*notes)
    record = _journal(Path(table), addresses, printing, writing_options, picture, task, profile)
    pages = _Pages(replace(task, seed=record.seed) if record.path else task)
    calibration = _calibration(printing, writing_options, pages, listener)
    x_height = None if writing_options.x_height is None else task.layout.x_height
    with record:
        report = print_rows(
            addresses,
            pages.maker(calibration, x_height),
            profile,
            task.layout.page,
            _batch_options(printing),
            journal=record,
            listener=BatchListener(_progress(listener), listener.say),
        )
    printed = Printed(
        report,
        pages.tally,
        pages.task.seed,
        task.hand.name,
        profile.queue or printing.printer,
        {**addresses.facts()},
        notes=tuple(notes),
    )
    if calibration is None or not calibration.pages:
        return printed
    return replace(printed, calibration=cast("Facts", calibration.facts()), calibration_note=calibration.said())


def _printer(printing: PrintOptions, writing_options: WritingOptions) -> Printer:
    """The printer that is asked for; slips and a missing file are refused before the table is read."""
    if writing_options.slips:
        raise InputError("slips: an envelope has to arrive, so addresses are written without slips; leave --slips out.")
    profile = printers.resolve(printing.printer, printing.queue)
    if profile.file and not profile.simulated and printing.dry_run is None:
        raise InputError(
            f"{printing.printer} writes a file: name it with --dry-run out.pdf, or name a printer with --printer."
        )
    return profile


def _fed(profile: Printer, printing: PrintOptions) -> Printer:
    """The printer with what the options say otherwise than its profile."""
    changes: dict[str, str | Nudge | None] = {
        "feed": printing.feed, "flap": printing.flap, "format": printing.format, "source": printing.tray
    }  # fmt: skip
    if printing.nudge is not None:
        parts = printing.nudge.split(",")
        if len(parts) != 2:
            raise InputError(f"nudge: {printing.nudge!r} is not two lengths; write it as --nudge 1.5mm,-0.5mm.")
        x, y = (millimetres(part, "nudge") for part in parts)
        if max(abs(x), abs(y)) > _MOST_NUDGE:
            raise InputError(f"nudge: {printing.nudge} moves the writing by more than {_MOST_NUDGE:g} mm.")
        changes["nudge"] = Nudge(x=Length(x), y=Length(y))
    return msgspec.structs.replace(profile, **{name: value for name, value in changes.items() if value})


def _journal(
    table: Path,
    addresses: Addresses,
    printing: PrintOptions,
    writing_options: WritingOptions,
    picture: PictureOptions,
    task: WritingTask,
    profile: Printer,
) -> Journal:
    """The journal of this batch: a new one, the one that is gone on with, or one in memory where nothing is printed.

    A hand that is no name or file leaves none either: nobody could say whether it is the same the next time.
    """
    dry_run = printing.dry_run is not None and not (profile.simulated and Path(printing.dry_run).suffix == "")
    if dry_run and (printing.resume or printing.afresh):
        raise InputError("--resume and --afresh are for printing: leave them out of a --dry-run.")
    hand = writing_options.hand
    if dry_run or not isinstance(hand, str):
        return Journal()
    if printing.resume and printing.afresh:
        raise InputError("--resume goes on with a batch, --afresh prints all of it again: give one of them.")
    look = {"pen": picture.pen, "pen_width": picture.pen_width, "ink": picture.ink}
    facts = {**_named(printing), **_named(writing_options), **look}
    facts |= {"page_name": printing.page, "columns": ",".join(printing.columns)}
    what = journal.batch(table, addresses, library.path(hand), facts)
    return journal.resume(what) if printing.resume else journal.begin(what, task.seed, afresh=printing.afresh)


def _named(options: PrintOptions | WritingOptions) -> dict[str, object]:
    """The options that change something on paper, by name."""
    names = (option.name for option in fields(options))
    return {name: getattr(options, name) for name in names if name not in _NOT_OF_THE_BATCH}


@dataclass
class _Pages:
    """Writes the addresses as they are asked for, and counts what was written."""

    task: WritingTask
    tally: Tally = field(default_factory=Tally)

    def maker(self, calibration: CalibratedInk | None, x_height: float | None) -> PageMaker:
        """How the batch comes by its pages."""
        about = {"seed": self.task.seed, "hand": self.task.hand.name}
        return PageMaker(self._write, self._ink, calibration, self._sink, x_height, about)

    def _write(self, text: str, layout: Layout, row: int) -> Drawing:
        wanted = self.task.layout
        spacing = wanted.line_spacing or layout.line_spacing
        layout = replace(layout, align=wanted.align, jitter=wanted.jitter, line_spacing=spacing)
        pages, drawings = writing.draw_pages(text, self.task, layout, row)
        self.tally += Tally.of(pages, drawings)
        return drawings[0]

    def _ink(self, drawing: Drawing, dpi: int) -> Raster:
        from handout.inking import pens

        return pens.ink(drawing, dpi, self.task.look.pen, pens.noise(drawing.about))

    def _sink(self, drawing: Drawing, path: Path) -> object:
        return write_drawing(drawing, path, self.task.look)


def _calibration(
    printing: PrintOptions, writing_options: WritingOptions, pages: _Pages, listener: Listener
) -> CalibratedInk | None:
    """The printer's calibration, if there is one and it is wanted; what is doubtful about it is said."""
    calibration, doubts = calibrated_ink.choose(printing.printer, printing.stock, printing.calibration)
    listener.say(*(f"warning: {doubt}" for doubt in doubts))
    if calibration is None:
        if printing.dry_run is None and not printing.calibration:
            listener.say(UNCALIBRATED)
        return None
    hand = writing_options.hand if isinstance(writing_options.hand, str) else pages.task.hand.name
    return CalibratedInk(calibration, calibrated_ink.pen_of(calibration, hand, listener.say), hand, pages.task.look.pen)


def _batch_options(printing: PrintOptions) -> BatchOptions:
    out = None if printing.dry_run is None else Path(printing.dry_run)
    return BatchOptions(printing.rows, printing.copies, printing.again, out)


def _progress(listener: Listener) -> Callable[[int, int, str], object]:
    return lambda done, total, stage: listener.progress(done / max(total, 1), f"{stage} {done}/{total}")
