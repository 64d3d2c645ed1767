"""Letters and envelopes from a table: it is read, every row is written and checked, and the pages are printed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Self

import msgspec

from handout.calibrating import calibrated_ink
from handout.calibrating.calibrated_ink import CalibratedInk
from handout.calibrating.store import Calibration
from handout.errors import InputError
from handout.pipeline import merging, row_work
from handout.pipeline.merging import RowAccount, RowPages
from handout.pipeline.options import (
    MergeOptions,
    PictureOptions,
    PrintOptions,
    SheetOptions,
    TableOptions,
    WritingOptions,
    millimetres,
    seed_of,
)
from handout.pipeline.results import SILENT, Attendant, Delivery, Listener, Tally, Told
from handout.pipeline.texts import WritingTask, not_followed
from handout.printing import envelope, media, printers
from handout.printing.batch import SIMULATED, BatchOptions, PrinterWay, destinations, make_rows
from handout.printing.batch import RowsRefused as RowsRefused
from handout.printing.journal import Journal
from handout.printing.prepared import Destination
from handout.printing.queue import Say
from handout.printing.rows import name_rows
from handout.printing.sending import PrintingStopped as PrintingStopped
from handout.printing.sending import Report as Report
from handout.profiles import Length, Nudge, Printer, full
from handout.profiles import names as find_names
from handout.values import Page

# said once before printing on a printer that no chart has been measured on
UNCALIBRATED = (
    "The colours are not calibrated for this printer and paper: the ink will look as the printer makes it, "
    "which may be lighter, darker or of another hue than the hand's own; handout calibrate wizard makes it match."
)
_MOST_NUDGE = 50.0  # mm, as in a profile


@dataclass(frozen=True, kw_only=True)
class BatchDelivery(Delivery):
    """What became of a table.

    destination : the queue or the printer.
    calibration_note : a sentence on the calibration that the pages went through.
    letters : whether there are letters, besides envelopes or alone.
    """

    report: Report
    destination: str
    calibration_note: str = ""
    letters: bool = False

    @property
    def shares(self) -> str:
        """Which rows each of several devices made; "" of one."""
        devices = self.report.devices
        return ", ".join(f"{name}: {name_rows(rows)}" for name, rows in devices.items()) if len(devices) > 1 else ""


def rows_told(report: Report, tally: Tally, pages: RowPages, hand: str, notes: Sequence[str]) -> Told:
    """What ``--json`` prints of the rows of a batch."""
    return {
        **tally.facts(pages.seed, hand, report.files),
        "rows": len(report.rows),
        "failed": [asdict(failure) for failure in report.failed],
        "jobs": [job.name for job in report.jobs],
        **({"devices": report.devices} if len(report.devices) > 1 else {}),
        "warnings": list(report.warnings),
        "before": list(report.before),
        "unknown": [asdict(row) for row in report.unknown],
        "columns": {**pages.merge.table.facts()},
        **({"notes": list(notes)} if notes else {}),
    }


def print_(
    table: str | Path,
    printing: PrintOptions = PrintOptions(),
    writing_options: WritingOptions = WritingOptions(),
    picture: PictureOptions = PictureOptions(),
    merge: MergeOptions = MergeOptions(),
    *,
    attendant: Attendant = SILENT,
) -> BatchDelivery:
    """Print a letter, an envelope or both for every row of a table (CSV or .xlsx).

    merge : the letter, if there is one, and what goes on the envelope.
    attendant : is asked to put in other paper, where a printer has one tray for letters and envelopes.

    Raises TableError, InputError: the table or the letter cannot be read, or an option is wrong.
    Raises RowsRefused: there are letters, and some rows cannot be made: nothing was printed.
    Raises PrinterError, PrintingStopped: there is no such printer, or it failed in the middle of the batch.
    """
    profiles = _printers(printing, writing_options, merge)
    profile, apart = profiles[0], _find_envelope_printers(profiles[0], printing)
    merged = merging.read_merge(Path(table), printing, merge, attendant)
    sheet = SheetOptions(printing.page, merge.margin, merge.pages, "A4" if merged.with_letters else "DL")
    pages = RowPages(merged, writing_options, sheet, picture)
    fed = partial(_feed_printer, profile, apart[0] if apart else profile, printing, merged.with_letters)
    pages.seed, pages.fed = seed_of(writing_options.seed), fed
    task = pages.look()
    notes = not_followed(task, ink_shown=True)
    attendant.note(*notes)
    out = None if printing.dry_run is None else Path(printing.dry_run)
    options, record = merging.begin_batch(
        pages,
        printing,
        {"page_name": pages.sheet.page_name},
        envelopes_to=printing.envelopes_to,
        out=out,
        dry_run=out is not None and not _prints_into(out, printing),
    )
    calibrations = _Calibrations.choose(printing, attendant)
    pages.calibrated = calibrations.calibrate_ink
    if merged.with_envelopes:  # what is wrong for every row is said once
        envelope.address_layout(pages.envelope_page, 1, 1, pages.address_x_height)
    about = {"seed": pages.seed, "hand": task.hand.name}
    simulated = all(each.simulated for each in [*profiles, *apart])  # nobody is asked to feed those
    change = (lambda request: attendant.say(f"{request}.")) if simulated else partial(attendant.do, needed=False)
    way = PrinterWay(profile, fed, about, None, record.resumed, attendant.say, change)
    ways = (
        [_direct_way(way, task.layout.page, each) for each in profiles],
        [_direct_way(way, pages.envelope_page, a) for a in apart],
    )
    calibrations.say_whose(ways[1], attendant)
    with record, destinations(*ways, options, pages.sheets()) as place:
        report, account = make_all(pages, place, options, (printing, record), listener=attendant)
    notes = [*notes, *account.dropped]
    told = rows_told(report, account.tally, pages, task.hand.name, notes)
    through = calibrations.calibrate_ink(task, pages.hand_of(task)) if account.tally.pages else None
    return BatchDelivery(
        tally=account.tally,
        seed=pages.seed,
        files=tuple(report.files),
        told=told if through is None else {**told, "calibration": through.facts()},
        report=report,
        destination=", ".join(map(_name_place, [*profiles, *apart])),
        calibration_note="" if through is None else through.tell_reach(),
        letters=merged.with_letters,
        notes=tuple(notes),
    )


def _name_place(printer: Printer) -> str:
    """A printer, as the place that pages go to."""
    return printer.queue or (f"the folder {SIMULATED}/" if printer.simulated else printer.title)


def _printers(printing: PrintOptions, writing_options: WritingOptions, merge: MergeOptions) -> list[Printer]:
    """The printer that is asked for, at every queue; slips and a missing file are refused before the table is read."""
    if writing_options.slips and merge.letter is None:
        raise InputError("slips: an envelope has to arrive, so addresses are written without slips; leave --slips out.")
    queues = [printing.queue] if isinstance(printing.queue, str) else list(printing.queue)
    found = [printers.resolve(printing.printer, queue) for queue in queues or [""]]
    if found[0].file and not found[0].simulated and printing.dry_run is None:
        raise InputError(
            f"{printing.printer} writes a file: name it with --dry-run out.pdf, or name a printer with --printer."
        )
    return found


def _find_envelope_printers(profile: Printer, printing: PrintOptions) -> list[Printer]:
    """The printers for envelopes: profiles with queues of their own, or further queues of this profile."""
    names = find_names("printer")
    own = [
        name.endswith(".toml") or full(name) in names or f"printer-{name}" in names for name in printing.envelopes_to
    ]
    found = [
        printers.resolve(name) if profiled else printers.resolve(printing.printer, name)
        for name, profiled in zip(printing.envelopes_to, own, strict=True)
    ]
    if len({(each.title, each.dpi, each.margins) for each in found}) > 1:
        raise InputError("--envelopes-to: the printers of envelopes have to be of one make: name one, or its queues.")
    return found


def _direct_way(way: PrinterWay, page: Page, where: Printer) -> PrinterWay:
    """Direct a way to one of several printers, as it is fed with a page."""
    changes = {"queue": where.queue, "file": where.file, "simulated": where.simulated}
    fed = msgspec.structs.replace(way.fed(page), **changes)
    return replace(way, profile=fed, calibrated=where.title == way.profile.title)


def _feed_printer(profile: Printer, apart: Printer, printing: PrintOptions, with_letters: bool, page: Page) -> Printer:
    """The printer as it is fed with a page; `apart` : the one for envelopes beside letters.

    Options win over the profile.  Where there are letters, `--tray` and `--feed` are theirs: an envelope
    is fed as the profile says.
    """
    alone, envelope_page = not with_letters, media.is_envelope(page)
    changes: dict[str, str | Nudge | None] = {
        "feed": printing.feed if alone or not envelope_page else None,
        "flap": printing.flap if alone or envelope_page else None,
        "format": printing.format,
        "source": printing.tray if alone or not envelope_page else None,
    }
    if printing.nudge is not None:
        parts = printing.nudge.split(",")
        if len(parts) != 2:
            raise InputError(f"nudge: {printing.nudge!r} is not two lengths; write it as --nudge 1.5mm,-0.5mm.")
        x, y = (millimetres(part, "nudge") for part in parts)
        if max(abs(x), abs(y)) > _MOST_NUDGE:
            raise InputError(f"nudge: {printing.nudge} moves the writing by more than {_MOST_NUDGE:g} mm.")
        changes["nudge"] = Nudge(x=Length(x), y=Length(y))
    fed = media.printer_for(page, apart if with_letters and envelope_page else profile)
    return msgspec.structs.replace(fed, **{name: value for name, value in changes.items() if value})


def _prints_into(out: Path, printing: PrintOptions) -> bool:
    """Whether what a dry run names is the folder that a simulated printer prints into."""
    return out.suffix == "" and not printing.queue and printers.resolve(printing.printer).simulated


@dataclass(frozen=True)
class _Calibrations:
    """The printer's calibration, if there is one and it is wanted, for each hand of a batch."""

    calibration: Calibration | None

    @classmethod
    def choose(cls, printing: PrintOptions, listener: Listener) -> Self:
        """The calibration that is chosen; what is doubtful about it, or that there is none, is said."""
        calibration, doubts = calibrated_ink.choose(printing.printer, printing.stock, printing.calibration)
        listener.say(*(f"warning: {doubt}" for doubt in doubts))
        if calibration is None and printing.dry_run is None and not printing.calibration:
            listener.say(UNCALIBRATED)
        return cls(calibration)

    def say_whose(self, ways: Sequence[PrinterWay], listener: Listener) -> None:
        """Say to which printers pages go without a calibration."""
        titles = dict.fromkeys(way.profile.title for way in ways if self.calibration and not way.calibrated)
        listener.say(*(f"Pages for {title} are not corrected: the calibration is another's." for title in titles))

    def calibrate_ink(self, task: WritingTask, hand: str, say: Say = lambda sentence: None) -> CalibratedInk | None:
        """How the ink of a hand goes to the printer."""
        if self.calibration is None:
            return None
        return CalibratedInk(self.calibration, calibrated_ink.pen_of(self.calibration, hand, say), hand, task.look.pen)


def make_all(
    pages: RowPages,
    place: Destination,
    options: BatchOptions,
    run: tuple[TableOptions, Journal],
    *,
    drawn: bool = False,
    listener: Listener,
) -> tuple[Report, RowAccount]:
    """Make all rows of a batch, by as many processes as its options say; see `make_rows`.

    run : the options of the table, and the journal; drawn : see `row_work.RowWork`.
    """
    (table, record), account = run, RowAccount()
    work = row_work.row_work(pages, place.prepare, drawn)
    with row_work.open_workers(work, table.jobs, table.cluster, listener.say) as made:
        make, check = (row_work.count_made(made, account, listener.say, check) for check in (False, True))
        table_rows = pages.merge.table
        return make_rows(table_rows, make, place, options, record, tell=listener.progress, check=check), account
