"""Matching a printer's colours to the ink: the chart, its scans, the table, the verification strip, what is stored.

`calibrate` goes through all steps of the wizard with an attendant who prints and scans, `pipeline.calibration_desk`
through one at a time, as the studio's page asks; the other functions are the steps by themselves, and what is done
with stored calibrations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from handout import atomic
from handout.calibrating import (
    calibrated_ink,
    pages,
    pen_reference,
    print_diagnosis,
    scanner,
    store,
    strip,
    verification,
)
from handout.calibrating.pen_reference import FrameReference
from handout.calibrating.store import Calibration
from handout.calibrating.verification import Verification
from handout.calibrating.wizard import CalibrationTask, ScansRefused, Step, Wizard
from handout.colour import cgats, exports, report
from handout.colour.chart_files import ti3
from handout.colour.reading import pen_field
from handout.colour.reading import read_scans as read_chart
from handout.errors import HandoutError, InputError
from handout.pipeline.options import CalibrationOptions, CalibrationPlace, ChartOptions
from handout.pipeline.results import SILENT, Attendant, Delivery, Facts, Listener, Result
from handout.printing import printers
from handout.profiles import Printer

if TYPE_CHECKING:
    from handout.simulated.print_and_scan import Loop

T = TypeVar("T")

# the steps of a simulated calibration, and the share of its time at which each begins, measured on two cores
_SIMULATED = {
    Step.PRINT: (0.0, "The simulated printer prints it."),
    Step.SCAN: (0.09, "The simulated flatbed scans it."),
    Step.BUILD: (0.29, "The scan is good; the table is built of it."),
    Step.STRIP: (0.47, "The simulated printer prints it through the table."),
    Step.VERIFY: (0.54, "The simulated flatbed scans it."),
    Step.STORE: (0.94, "The calibration is stored."),
}


@dataclass(frozen=True, eq=False, kw_only=True)
class CalibrationDelivery(Delivery):
    """What was made of a calibration that is stored."""

    calibration: Calibration


def _tell_stored(calibration: Calibration, reference: FrameReference | None = None) -> CalibrationDelivery:
    """A calibration that was stored, and what the pen in the chart's frame says of the hand."""
    told = calibration.facts()
    pen = {} if reference is None else {"pen": {**told["pen"], **reference.facts()}}
    return CalibrationDelivery(calibration=calibration, told={**told, **pen})


def begin(place: CalibrationPlace, profile: Printer) -> Wizard:
    """The wizard of a calibration, which is begun, or gone on with. Raises InputError: as `Wizard`."""
    chart, options = place.chart, place.options
    name = options.scanner or options.scanner_name or ("simulated flatbed" if profile.simulated else "")
    task = CalibrationTask(
        profile, place.printer, place.paper, chart.sheet, chart.pages, name, options.hand, options.accept
    )
    return Wizard(task, afresh=options.afresh)


def simulated_loop(place: CalibrationPlace, profile: Printer) -> Loop | None:
    """The devices that print and scan where they are simulated; None for others.

    Raises InputError: a paper that they do not have, or an unknown fault.
    """
    if not profile.simulated:
        return None
    from handout.simulated.print_and_scan import make_loop

    return make_loop(profile, place.paper, place.options.faults, place.options.hand)


def scan_page(wizard: Wizard, name: str, loop: Loop | None) -> list[Path]:
    """Scan the page that was printed last: by the simulated scanner, or through SANE by the one of that name."""
    page = wizard.page_file(wizard.step)
    to = wizard.folder / "incoming" / f"{page.stem}.tif"
    to.parent.mkdir(parents=True, exist_ok=True)
    return loop.scan(page, to, wizard.frame) if loop else [scanner.scan(name, wizard.chart.paper, to)]


def calibrate(place: CalibrationPlace, attendant: Attendant = SILENT) -> CalibrationDelivery:
    """Calibrate a printer step by step; a run that was left is gone on with.

    Raises InputError, DeviceError: of any step; what was done before is kept.
    """
    profile = printers.resolve(place.printer)
    if profile.file and not profile.simulated and place.options.output is None:
        raise InputError(f"{place.printer} writes files: name a folder for chart and strip with -o.")
    loop = simulated_loop(place, profile)
    wizard = begin(place, profile)
    if wizard.resumed:
        begun = wizard.state.begun
        attendant.say(f"Going on with the calibration of {wizard.name} begun on {begun} (--afresh begins anew).")
    return _Guide(wizard, place.options, attendant, loop).lead()


@dataclass(frozen=True)
class _Guide:
    """Leads an attendant, or the simulated devices, through the wizard's steps."""

    wizard: Wizard
    options: CalibrationOptions
    attendant: Attendant
    loop: Loop | None

    def lead(self) -> CalibrationDelivery:
        """Do what comes next, until the calibration is stored."""
        wizard, say = self.wizard, self.attendant.say
        reference: FrameReference | None = None
        stored: Calibration | None = None
        while stored is None:
            now = wizard.step
            # a person takes most of the time of a real calibration, and nobody knows how long
            share, sentence = (0.0, wizard.request) if self.loop is None else _SIMULATED[now]
            self.attendant.progress(share, now.value)
            say(f"\n{list(Step).index(now) + 1}/{len(Step) - 1}  {now.value.capitalize()}", sentence)
            if now is Step.PRINT or (now is Step.STRIP and not self.options.no_verify):
                self._print_page()
            elif now is Step.SCAN:
                scanned = self._until_good(wizard.take_scans)
                reference = scanned.reference
                say(*(f"warning: {finding}" for finding in scanned.findings))
                say(*([reference.as_message()] if reference else []), *filter(None, [scanned.missing]))
            elif now is Step.BUILD:
                built = wizard.build(self.options.method)
                say(f"The table misses its own patches by ΔE00 {built.misses:.2f} on the mean.")
            elif now is Step.VERIFY:
                verified = self._until_good(lambda scans: wizard.take_strip(scans[0]))
                say(*verified.findings, *verified.lines())
                if not verified.helps and self.attendant.agrees("Store it all the same?"):
                    stored = wizard.store()
                elif not verified.helps:
                    wizard.go_back()
            else:
                stored = wizard.store()
        return _tell_stored(stored, reference)

    def _print_page(self) -> None:
        """Print what comes next, or write it into the folder that was named, and say where it is."""
        task, out, name = self.wizard.task, self.options.output, "chart" if self.wizard.step is Step.PRINT else "strip"
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
        elif self.loop is None:
            self.attendant.do("Load the paper", needed=False)
        files = self.wizard.print_page(out and out / f"{name}.pdf")
        where = ", ".join(map(str, files)) or f"sent to {task.profile.queue or task.printer}"
        self.attendant.say(f"The {name}: {where}.")

    def _until_good(self, take: Callable[[list[Path]], T]) -> T:
        """What `take` makes of scans of what was printed last; a person at a terminal may try again."""
        name = self.wizard.page_file(self.wizard.step).stem
        while True:
            try:
                if self.loop is None and not self.options.scanner:
                    return take([self.attendant.file_of(f"the scan of the {name}")])
                if self.loop is None:
                    self.attendant.do(f"Lay the {name} on the glass", needed=False)
                    self.attendant.say("Scanning …")
                return take(scan_page(self.wizard, self.options.scanner or "", self.loop))
            except HandoutError as error:
                if self.loop is not None or not self.attendant.watches:
                    raise
                self.attendant.say(str(error))


def print_chart(
    printer: str, paper: str = store.PLAIN, chart: ChartOptions | None = None, *, outputs: Sequence[Path] = ()
) -> Delivery:
    """Print the calibration chart, or write it to .pdf and .png files.

    Raises InputError, PrinterError: a printer that writes files and none is named; a file that cannot be written; a
    queue that refuses the page.
    """
    chart, profile = chart or ChartOptions(), printers.resolve(printer)
    if profile.file and not outputs:
        raise InputError(f"{printer} writes a file: name it with -o chart.pdf.")
    layout = pages.chart_for(profile, chart.sheet, chart.pages)
    printed = pages.chart_pages(layout, profile, f"{store.key(printer)}/{store.key(paper)}")
    files = tuple(path for output in outputs for path in pages.write(printed, output))
    jobs = () if files else pages.send(printed, profile)
    told = {"files": [*map(str, files)], "jobs": [*jobs], "pages": len(layout.pages), "dpi": profile.dpi}
    return Delivery(files=files, told=told)


def read_scans(
    scans: Sequence[Path],
    output: Path,
    *,
    report_file: Path | None = None,
    hand: str = "",
    accept: bool = False,
    listener: Listener = SILENT,
) -> Delivery:
    """Read scans of a chart into a .ti3 table; what the pen wrote in its frame lies beside it.

    Raises ScansRefused: no calibration may be made of them; the report is written all the same.
    Raises InputError: a file that cannot be read or written, or no such hand.
    """
    atomic.check_writable(output)
    writer, bare = calibrated_ink.writer_of(hand)
    reading = read_chart(scans, paper=bare)
    reference = pen_reference.compare_scribble(reading.scribble, hand, writer)
    reading = print_diagnosis.diagnose(reading, reference, accept=accept)
    if report_file is not None:
        report.write_report(report_file, reading)
    listener.say(*(f"{finding.severity}: {finding}" for finding in reading.findings))
    if not reading.usable:
        raise ScansRefused(reading.findings, report_file=report_file)
    listener.say(reference.as_message())
    cgats.write(output, ti3(reading))
    files: tuple[Path, ...] = (output,)
    if reading.scribble is not None:
        pen_field.save(reading.scribble, pen_field.file_beside(output))
        files = (output, pen_field.file_beside(output))
    findings = [finding.facts() for finding in reading.findings]
    told = {"patches": len(reading.device), "findings": findings, "files": [*map(str, files)], "pen": reference.facts()}
    return Delivery(files=files, told=told)


def build_table(
    patches: Path,
    printer: str,
    paper: str = store.PLAIN,
    *,
    scanner_name: str = "",
    method: str = "forward",
    listener: Listener = SILENT,
) -> CalibrationDelivery:
    """Build the table of patches (.ti3) and store it for a printer.

    Raises InputError: patches that no table can be made of, or an unknown method.
    """
    listener.progress(0.0, "building the table")
    built = store.build_stored(store.read_patches(patches), printer, paper, scanner_name, method)
    if pen_field.file_beside(patches).is_file():
        built.keep_scribble(pen_field.file_beside(patches), "")
    return _tell_stored(built)


@dataclass(frozen=True, eq=False, kw_only=True)
class Verified(CalibrationDelivery):
    """What a scanned verification strip said of a calibration."""

    verification: Verification


def verify(printer: str, paper: str, scans: Sequence[Path], *, report_file: Path | None = None) -> Verified:
    """Read the scan of the verification strip of a stored calibration; an empty paper: of the printer's newest.

    Raises InputError: no calibration or no strip of it, a scan that cannot be read, or that is of another page.
    """
    calibration = store.find_wanted(printer, paper)
    verified = verification.verify(calibration, scans)
    if report_file is not None:
        verification.write_report(calibration, report_file)
    return Verified(calibration=calibration, verification=verified, told=verified.facts())


def print_strip(
    printer: str, paper: str = "", *, hand: str = "", sheet: str = "A4", output: Path | None = None
) -> CalibrationDelivery:
    """Print the verification strip of a stored calibration, or write it to a .pdf or .png file.

    Raises InputError, PrinterError: no calibration, an ink of which the printer reaches next to nothing; a file that
    cannot be written, a queue that refuses the page.
    """
    calibration, profile = store.find_wanted(printer, paper), printers.resolve(printer)
    if profile.file and output is None:
        raise InputError(f"{printer} writes a file: name it with -o strip.pdf.")
    printed = strip.pages_of(strip.prepare(calibration, hand, sheet), calibration, profile)
    files = () if output is None else pages.write(printed, output)
    jobs = pages.send(printed, profile) if output is None else ()
    told = {"files": [*map(str, files)], "jobs": [*jobs], "calibration": calibration.name}
    return CalibrationDelivery(calibration=calibration, files=files, told=told)


@dataclass(frozen=True, eq=False)
class Stored(Result):
    """Stored calibrations, the newest first."""

    calibrations: tuple[Calibration, ...] = field(default=())

    def facts(self) -> Facts:
        return {"calibrations": [calibration.facts() for calibration in self.calibrations]}

    def lines(self) -> Iterator[str]:
        """A table for people."""
        for calibration in self.calibrations:
            misses = "" if calibration.misses is None else f", misses its patches by ΔE00 {calibration.misses:.2f}"
            origin = f"scanner {calibration.scanner or 'not named'}; {calibration.folder}"
            yield f"{calibration.describe()}: {calibration.method}{misses}, {origin}"
            facts = calibration.load_kept(store.VERIFICATION)
            for line in ["not verified"] if facts is None else verification.table_lines(facts):
                yield f"  {line}"


def stored_calibrations(printer: str = "", paper: str = "") -> Stored:
    """The stored calibrations, all or of a printer or a paper.

    Raises InputError: there is none of that printer and paper; the message lists what there is.
    """
    if printer:
        store.find_wanted(printer, paper)
    return Stored(tuple(store.list_stored(printer, paper)))


def export(printer: str, paper: str, kind: str, output: Path) -> CalibrationDelivery:
    """Write a stored calibration for other programs; `kind` is one of `colour.exports.FORMATS`.

    Raises InputError: no calibration, or a file that cannot be written.
    """
    calibration = store.find_wanted(printer, paper)
    atomic.check_writable(output)
    title = f"{calibration.name} {calibration.date:%Y-%m-%d}"
    table = calibration.table()
    source = exports.ExportSource(table, calibration.date, title, calibration.table_file, calibration.patches_file)
    atomic.write(output, exports.FORMATS[kind](source))
    return CalibrationDelivery(calibration=calibration, files=(output,), told={"files": [str(output)]})
