"""Matching a printer's colours to the ink: the chart, its scans, the table, the verification strip, what is stored.

`calibrate` goes through all steps with a `Person` who prints and scans; the other functions are the steps by
themselves, and what is done with stored calibrations.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from handout import atomic
from handout.calibrating import ink_samples, pages, pen_reference, print_diagnosis, store, strip, verification
from handout.calibrating.pen_reference import Reference
from handout.calibrating.session import Step
from handout.calibrating.store import Calibration
from handout.calibrating.verification import Verification
from handout.calibrating.wizard import ScansRefused, Task, Wizard
from handout.colour import cgats, exports, report
from handout.colour.chart_files import ti3
from handout.colour.reading import Reading, pen_field
from handout.colour.reading import read as read_chart
from handout.errors import InputError
from handout.pipeline.guided_calibration import GuidedCalibration, Person
from handout.pipeline.options import CalibrationOptions, ChartOptions
from handout.pipeline.results import SILENT, Facts, Listener, Result
from handout.printing import printers


@dataclass(frozen=True, eq=False)
class Calibrated(Result):
    """A calibration that was stored, and what the pen in the chart's frame says of the hand."""

    calibration: Calibration
    reference: Reference | None = None

    def facts(self) -> Facts:
        facts: Facts = self.calibration.facts()
        if self.reference is not None:
            facts["pen"] = {**self.calibration.facts()["pen"], **self.reference.facts()}
        return facts


def calibrate(
    printer: str,
    paper: str = store.PLAIN,
    chart: ChartOptions | None = None,
    options: CalibrationOptions | None = None,
    *,
    person: Person,
    listener: Listener = SILENT,
) -> Calibrated:
    """Calibrate a printer step by step; a run that was left is gone on with.

    Raises
    ------
    InputError, DeviceError
        Of any step; what was done before is kept.
    """
    chart, options = chart or ChartOptions(), options or CalibrationOptions()
    profile = printers.resolve(printer)
    if profile.file and not profile.simulated and options.output is None:
        raise InputError(f"{printer} writes files: name a folder for chart and strip with -o.")
    loop = None
    if profile.simulated:
        from handout.simulated.print_and_scan import simulated

        loop = simulated(profile, paper, options.faults, options.hand)
    scanner_name = options.scanner or options.scanner_name or ("simulated flatbed" if loop else "")
    task = Task(profile, printer, paper, chart.sheet, chart.pages, scanner_name, options.hand, options.accept)
    wizard = Wizard(task, afresh=options.afresh)
    if wizard.resumed:
        begun = wizard.session.state.begun
        listener.say(f"Going on with the calibration of {wizard.name} begun on {begun} (--afresh begins anew).")
    run = GuidedCalibration(wizard, options, person, listener, loop)
    while wizard.step is not Step.DONE:
        run.step()
    assert run.stored is not None
    return Calibrated(run.stored, run.reference)


@dataclass(frozen=True)
class ChartWritten(Result):
    """A chart that was printed or written."""

    files: tuple[Path, ...]
    jobs: tuple[str, ...]
    pages: int
    dpi: int


def print_chart(
    printer: str, paper: str = store.PLAIN, chart: ChartOptions | None = None, *, outputs: Sequence[Path] = ()
) -> ChartWritten:
    """Print the calibration chart, or write it to .pdf and .png files.

    Raises
    ------
    InputError, PrinterError
        A printer that writes files and none is named; a file that cannot be written; a queue that refuses the page.
    """
    chart, profile = chart or ChartOptions(), printers.resolve(printer)
    if profile.file and not outputs:
        raise InputError(f"{printer} writes a file: name it with -o chart.pdf.")
    layout = pages.chart_for(profile, chart.sheet, chart.pages)
    name = f"{store.key(printer)}/{store.key(paper)}"
    files = tuple(path for output in outputs for path in pages.write_chart(layout, profile, name, output))
    jobs = () if files else pages.send(pages.chart_pages(layout, profile, name), profile)
    return ChartWritten(files, jobs, len(layout.pages), profile.dpi)


@dataclass(frozen=True, eq=False)
class ChartRead(Result):
    """A chart whose scans were read into a table of patches."""

    reading: Reading
    reference: Reference
    files: tuple[Path, ...]

    def facts(self) -> Facts:
        findings = [finding.facts() for finding in self.reading.findings]
        files = list(map(str, self.files))
        return {
            "patches": len(self.reading.device), "findings": findings, "files": files, "pen": self.reference.facts()
        }  # fmt: skip


def read_scans(
    scans: Sequence[Path],
    output: Path,
    *,
    report_file: Path | None = None,
    hand: str = "",
    accept: bool = False,
    listener: Listener = SILENT,
) -> ChartRead:
    """Read scans of a chart into a .ti3 table; what the pen wrote in its frame lies beside it.

    Raises
    ------
    ScansRefused
        No calibration may be made of them; the report is written all the same.
    InputError
        A file that cannot be read or written, or no such hand.
    """
    atomic.check_writable(output)
    bare = ink_samples.paper_of(hand) if hand else None
    reading = read_chart(scans, paper=None if bare is None else bare.tolist())
    reference = pen_reference.compared(reading.scribble, hand, ink_samples.scanned_name(hand) if hand else "")
    reading = print_diagnosis.diagnose(reading, reference, accept=accept)
    if report_file is not None:
        report.write_report(report_file, reading)
    listener.say(*(f"{finding.severity}: {finding}" for finding in reading.findings))
    if not reading.usable:
        raise ScansRefused(reading.findings, report_file=report_file)
    listener.say(reference.as_message())
    cgats.write(output, ti3(reading))
    if reading.scribble is None:
        return ChartRead(reading, reference, (output,))
    pen_field.save(reading.scribble, pen_field.file_beside(output))
    return ChartRead(reading, reference, (output, pen_field.file_beside(output)))


def build_table(
    patches: Path,
    printer: str,
    paper: str = store.PLAIN,
    *,
    scanner_name: str = "",
    method: str = "forward",
    listener: Listener = SILENT,
) -> Calibrated:
    """Build the table of patches (.ti3) and store it for a printer.

    Raises
    ------
    InputError
        Patches that no table can be made of, or an unknown method.
    """
    listener.progress(0.0, "building the table")
    built = store.build_stored(store.read_patches(patches), printer, paper, scanner_name, method)
    if pen_field.file_beside(patches).is_file():
        built.keep_scribble(pen_field.file_beside(patches), "")
    return Calibrated(built)


@dataclass(frozen=True, eq=False)
class Verified(Result):
    """What a scanned verification strip said of a calibration."""

    calibration: Calibration
    verification: Verification

    def facts(self) -> Facts:
        return self.verification.facts()


def verify(printer: str, paper: str, scans: Sequence[Path], *, report_file: Path | None = None) -> Verified:
    """Read the scan of the verification strip of a stored calibration; an empty paper: of the printer's newest.

    Raises
    ------
    InputError
        No calibration or no strip of it, a scan that cannot be read, or that is of another page.
    """
    calibration = store.wanted(printer, paper)
    verified = verification.verify(calibration, scans)
    if report_file is not None:
        verification.write_report(calibration, report_file)
    return Verified(calibration, verified)


@dataclass(frozen=True, eq=False)
class StripPrinted(Result):
    """A verification strip that was printed or written."""

    calibration: Calibration
    files: tuple[Path, ...]
    jobs: tuple[str, ...]

    def facts(self) -> Facts:
        files = list(map(str, self.files))
        return {"files": files, "jobs": list(self.jobs), "calibration": self.calibration.name}


def print_strip(
    printer: str, paper: str = "", *, hand: str = "", sheet: str = "A4", output: Path | None = None
) -> StripPrinted:
    """Print the verification strip of a stored calibration, or write it to a .pdf or .png file.

    Raises
    ------
    InputError, PrinterError
        No calibration, an ink of which the printer reaches next to nothing; a file that cannot be written, a queue
        that refuses the page.
    """
    calibration, profile = store.wanted(printer, paper), printers.resolve(printer)
    if profile.file and output is None:
        raise InputError(f"{printer} writes a file: name it with -o strip.pdf.")
    printed = strip.pages_of(strip.prepare(calibration, hand, sheet), calibration, profile)
    if output is not None:
        return StripPrinted(calibration, pages.write(printed, output), ())
    return StripPrinted(calibration, (), pages.send(printed, profile))


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
            yield f"{calibration.described()}: {calibration.method}{misses}, {origin}"
            facts = calibration.verification()
            for line in ["not verified"] if facts is None else verification.table_lines(facts):
                yield f"  {line}"


def stored_calibrations(printer: str = "", paper: str = "") -> Stored:
    """The stored calibrations, all or of a printer or a paper.

    Raises
    ------
    InputError
        There is none of that printer and paper; the message lists what there is.
    """
    if printer:
        store.wanted(printer, paper)
    return Stored(tuple(store.every(printer, paper)))


@dataclass(frozen=True, eq=False)
class Exported(Result):
    """A calibration that was written for another program."""

    calibration: Calibration
    file: Path

    def facts(self) -> Facts:
        return {"files": [str(self.file)]}


def export(printer: str, paper: str, kind: str, output: Path) -> Exported:
    """Write a stored calibration for other programs; `kind` is one of `colour.exports.FORMATS`.

    Raises
    ------
    InputError
        No calibration, or a file that cannot be written.
    """
    calibration = store.wanted(printer, paper)
    atomic.check_writable(output)
    title = f"{calibration.name} {calibration.date:%Y-%m-%d}"
    table = calibration.table()
    source = exports.Source(table, calibration.date, title, calibration.table_file, calibration.patches_file)
    atomic.write(output, exports.FORMATS[kind](source))
    return Exported(calibration, output)
