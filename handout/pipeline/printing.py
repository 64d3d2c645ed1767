"""Letters and envelopes from a table: it is read, every row is written and checked, and the pages are printed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Self

import msgspec

from handout.calibrating import calibrated_ink
from handout.calibrating.calibrated_ink import CalibratedInk
from handout.calibrating.store import Calibration
from handout.errors import InputError
from handout.pipeline import merging
from handout.pipeline.options import (
    MergeOptions,
    PictureOptions,
    PrintOptions,
    SheetOptions,
    WritingOptions,
    millimetres,
)
from handout.pipeline.results import SILENT, Attendant, Listener
from handout.pipeline.row_work import BatchDelivery, make_all
from handout.pipeline.texts import WritingTask, not_followed
from handout.printing import envelope, media, printers
from handout.printing.batch import SIMULATED, PrinterWay, destinations
from handout.printing.batch import RowsRefused as RowsRefused
from handout.printing.queue import Say
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
    sheet = SheetOptions(printing.page, merge.margin, merge.pages)
    pages = merging.open_rows(table, printing, merge, (writing_options, sheet, picture), attendant)
    merged, out = pages.merge, None if printing.dry_run is None else Path(printing.dry_run)
    fed = partial(_feed_printer, profile, apart[0] if apart else profile, printing, merged.with_letters)
    pages.fed = fed
    task = pages.look()
    notes = not_followed(task, ink_shown=True)
    attendant.note(*notes)
    # unless it names the folder that a simulated printer prints into
    dry_run = out is not None and (out.suffix != "" or bool(printing.queue) or not profile.simulated)
    options, record = merging.begin_batch(
        pages, printing, {}, envelopes_to=printing.envelopes_to, out=out, dry_run=dry_run
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
        made = make_all(pages, place, options, (printing, record), notes=notes, listener=attendant)
    made = replace(made, destination=", ".join(map(_name_place, [*profiles, *apart])))
    through = calibrations.calibrate_ink(task, pages.hand_of(task)) if made.tally.pages else None
    if through is None:
        return made
    return replace(made, told={**made.told, "calibration": through.facts()}, calibration_note=through.tell_reach())


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
