"""A calibration step by step: chart, scan, table, strip, its scan, store.  The caller shows what is asked for.

    PRINT ─ print_page → SCAN ─ take_scans → BUILD ─ build → STRIP ─ print_page → VERIFY ─ take_strip → STORE
                         ▲ └ refused: says what to do, keeps the pages that were good

A step that fails changes nothing, so that it can be tried again; the calibration is stored by the last step only.
What it has come to so far lies in a folder, so that nothing measured is lost and whoever comes later, a terminal or a
page, goes on with it.
"""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path

import msgspec
from msgspec.structs import replace

from handout import atomic, shipped
from handout.calibrating import calibrated_ink, pages, pen_reference, print_diagnosis, store, verification
from handout.calibrating import strip as strips
from handout.calibrating.pen_reference import FrameReference
from handout.calibrating.store import Calibration
from handout.calibrating.verification import Verification
from handout.colour import cgats
from handout.colour.chart import chart
from handout.colour.chart_files import ti3
from handout.colour.reading import ChartReading, ScanFinding, read_scans
from handout.colour.reading.pen_field import save as save_scribble
from handout.colour.report import report
from handout.errors import InputError, reported
from handout.profiles import Printer

_STATE = "state.json"


class Step(StrEnum):
    """What comes next."""

    PRINT = "print the chart"
    SCAN = "scan the chart"
    BUILD = "build the table"
    STRIP = "print the verification strip"
    VERIFY = "scan the verification strip"
    STORE = "store the calibration"
    DONE = "done"


_REQUESTS = {
    Step.PRINT: (
        "Load the paper that you will print on. Choose the quality and paper type that you will print with, and switch "
        "off colour management, enhancements and 'fit to page'."
    ),
    Step.SCAN: (
        "Let the ink dry for a quarter of an hour. Write a few words in the frame under the coloured fields, with the "
        "pen of the handwriting: they show how the scanner sees its ink. Lay the chart face down on the glass, and "
        "scan it in colour at 300 dpi, set as when the handwriting was scanned, with all automatic corrections "
        "switched off. Save it as TIFF or PNG."
    ),
    Step.BUILD: "The scans are good; the table is built of them.",
    Step.STRIP: "The verification strip is printed through the new table: load the same paper.",
    Step.VERIFY: "Let the strip dry, write in its frame too, and scan it just like the chart.",
    Step.STORE: "The calibration is stored.",
    Step.DONE: "The calibration is stored, and pages for this printer go through it from now on.",
}


class ScansRefused(InputError):
    """Scans that no calibration may be made of; `findings` give the reasons."""

    def __init__(self, findings: Sequence[ScanFinding], good_scans: int = 0, report_file: Path | None = None) -> None:
        refusals = " ".join(str(finding) for finding in findings if finding.severity == "refuse")
        scans, verb = ("scans", "are") if good_scans > 1 else ("scan", "is")
        safe = f" The {good_scans} good {scans} from before {verb} kept."
        shown = f" Pictures of what was found are in {report_file}." if report_file is not None else ""
        super().__init__(refusals + (safe if good_scans else "") + shown)
        self.findings = tuple(findings)


@dataclass(frozen=True)
class ChartScanned:
    """What was found in accepted scans.

    findings : warnings; missing : a sentence that names the pages still missing, or "".
    reference : the comparison of the pen in the chart's frame with the hand; None while pages are missing.
    """

    findings: tuple[ScanFinding, ...]
    missing: str = ""
    reference: FrameReference | None = None


@dataclass(frozen=True)
class CalibrationTask:
    """What is calibrated.

    profile : of the printer; printer, paper : what they are called in the store.
    sheet : "A4" or "letter"; pages : 1 or 2; None: what the printer's margins ask for.
    scanner : what the scanner is called.
    hand : whose ink verifies the calibration; the pages of a scanned one tell whether the chart was scanned alike.
    accept : calibrate with the print as it is, whatever is weak in it.
    """

    profile: Printer
    printer: str
    paper: str = store.PLAIN
    sheet: str = "A4"
    pages: int | None = None
    scanner: str = ""
    hand: str = ""
    accept: bool = False


class CalibrationState(msgspec.Struct, frozen=True):
    """As it is kept.

    step : what comes next; printer, paper : the names in the store; sheet, pages : of the chart; begun : when;
    scanner : how the scans are called; scans : names of the files that were taken, in the wizard's folder.
    """

    step: Step
    printer: str
    paper: str
    sheet: str
    pages: int
    begun: str
    scanner: str = ""
    scans: tuple[str, ...] = ()


class Wizard:
    """One calibration of a printer on a paper.

    state : what is known of it, on the disk when the method that changed it returns; resumed : whether an earlier run
    is gone on with.
    folder : holds the state, the scans that were taken, and what was made of them: `patches`, `built` (the calibration
    that is not stored yet), `report`.
    """

    def __init__(self, task: CalibrationTask, *, afresh: bool = False) -> None:
        """Begin a calibration, or go on with an unfinished one (`resumed`); `afresh` : begin in any case.

        Raises InputError: no such hand, another sheet, a chart that does not fit the printer's margins, or a name that
        none can have.
        """
        layout = pages.chart_for(task.profile, task.sheet, task.pages)
        self.task = task
        self.writer, self._paper = calibrated_ink.writer_of(task.hand)
        self.seen: ChartReading | None = None  # what the scans of the chart that were given last showed, good or not
        names = store.key(task.printer), store.key(task.paper)
        self.name, self.folder = "/".join(names), folder() / "--".join(names)
        self.patches, self.built = self.folder / "patches.ti3", self.folder / "built"
        self.report, self._scribble = self.folder / "report.html", self.folder / "scribble.npz"
        left = None if afresh else _read_state(self.folder)
        self.resumed = left is not None
        if left is None:
            remove(self.folder)  # of what was not removed to its end, nothing is taken for the new one's
            begun = datetime.now().astimezone().isoformat(timespec="minutes")
            left = CalibrationState(Step.PRINT, *names, layout.paper.name, len(layout.pages), begun, task.scanner)
        self.state = left
        self.chart = chart(left.sheet, pages=left.pages)

    @property
    def step(self) -> Step:
        """What comes next."""
        return self.state.step

    @property
    def request(self) -> str:
        """What the user has to do for the next step."""
        return _REQUESTS[self.step]

    @property
    def scans(self) -> list[Path]:
        """The scans that were taken."""
        return [self.folder / name for name in self.state.scans]

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom, mm, of the frame for the pen on what is scanned next."""
        if self.step is Step.VERIFY:
            return strips.last_strip(store.load(self.built)).page.scribble_field
        return self.chart.pages[0].scribble_field

    def check(self, what: str, *steps: Step) -> None:
        """Refuse what is not to be done now."""
        if self.step not in steps:
            raise InputError(f"{what} now: what comes next is to {self.step}.")

    def go(self, step: Step) -> None:
        """Note what comes next."""
        self._save(replace(self.state, step=step))

    def keep(self, scans: Sequence[Path]) -> None:
        """Take copies of scans along."""
        names = [f"scan-{n}{path.suffix.lower()}" for n, path in enumerate(scans, len(self.scans) + 1)]
        for path, name in zip(scans, names, strict=True):
            shutil.copy2(path, self.folder / name)
        self._save(replace(self.state, scans=(*self.state.scans, *names)))

    def print_page(self, out: Path | None = None) -> tuple[Path, ...]:
        """Print the chart or the strip, whichever comes next, or write it to `out` for the user to print; the files.

        What a simulated printer gets lies in the wizard's folder.

        Raises InputError, PrinterError: neither is to be printed now; it cannot be written, or the printer does not
        take it; the printer reaches next to nothing of the ink.
        """
        self.check("Nothing is to be printed", Step.PRINT, Step.STRIP)
        task, after = self.task, Step.SCAN if self.step is Step.PRINT else Step.VERIFY
        if self.step is Step.PRINT:
            printed = pages.chart_pages(self.chart, task.profile, self.name)
        else:
            built = store.load(self.built)
            printed = strips.pages_of(strips.prepare(built, task.hand, self.state.sheet), built, task.profile)
        if out is None and task.profile.simulated:
            self.go(self.step)  # which makes the folder
            out = self.page_file(after)
        files = pages.write(printed, out) if out is not None else ()
        if out is None:
            pages.send(printed, task.profile)
        self.go(after)
        return files

    def page_file(self, step: Step) -> Path:
        """Where the page lies that a simulated printer printed for a step."""
        return self.folder / f"{'strip' if step is Step.VERIFY else 'chart'}.pdf"

    def take_scans(self, scans: Sequence[Path]) -> ChartScanned:
        """Read scans of the chart together with those that were kept earlier, and keep them if they are good.

        Raises ScansRefused: something is wrong with them; scans kept earlier stay kept. InputError: a file that cannot
        be read.
        """
        reading, state = self._read_chart(scans), self.state
        pen = pen_reference.compare_scribble(reading.scribble, self.task.hand, self.writer)
        alike = (one for one in store.list_stored(state.printer, state.paper) if one.scanner == state.scanner)
        reading = self.seen = print_diagnosis.diagnose(reading, pen, next(alike, None), self.task.accept)
        self._report(reading)
        refusing = [finding for finding in reading.findings if finding.severity == "refuse"]
        missing = [finding for finding in refusing if finding.code == "page-missing"]
        if len(missing) < len(refusing) or not reading.sheets:
            raise ScansRefused(reading.findings, len(self.scans), self.report)
        self.keep(scans)
        warned = tuple(finding for finding in reading.findings if finding.severity == "warn")
        if missing:
            return ChartScanned(warned, missing[0].sentence)
        self._scribble.unlink(missing_ok=True)
        if reading.scribble is not None:
            save_scribble(reading.scribble, self._scribble)
        keywords = {"PRINTER": state.printer, "PAPER": state.paper, "SCANNER": state.scanner}
        cgats.write(self.patches, ti3(reading, {name: value for name, value in keywords.items() if value}))
        self.go(Step.BUILD)
        return ChartScanned(warned, reference=pen)

    def build(self, method: str = "forward") -> Calibration:
        """Build the table from the measured patches.

        Raises InputError: it is not to be built now; an unknown method, or patches that contradict each other: then the
        chart has to be scanned again.
        """
        self.check("No table is to be built", Step.BUILD)
        state, patches = self.state, store.read_patches(self.patches)
        built = store.build(self.built, patches, state.printer, state.paper, state.scanner, method)
        if self._scribble.is_file():
            built.keep_scribble(self._scribble, self.writer)
        self.go(Step.STRIP)
        return built

    def take_strip(self, scan: Path) -> Verification:
        """Read the scan of the strip; the next step is to store, unless the calibration improves nothing.

        Raises ScanRefused: it is not the strip, or not all of it. InputError: a file that cannot be read.
        """
        verified = verification.verify(store.load(self.built), [scan])
        if verified.helps:
            self.go(Step.STORE)
        return verified

    def store(self) -> Calibration:
        """Store the calibration and delete the wizard's folder.

        Raises InputError: nothing was built yet, or it cannot be written.
        """
        if self.step not in (Step.STRIP, Step.VERIFY, Step.STORE):
            raise InputError(f"Nothing can be stored yet: what comes next is to {self.step}.")
        built = store.load(self.built)
        self._report(self._read_chart(), built)
        built.keep_report(self.report)
        stored = store.add(built)
        remove(self.folder)
        self.state = replace(self.state, step=Step.DONE)
        return stored

    def go_back(self) -> None:
        """Return to scanning the chart, and forget the scans that were kept."""
        self._save(replace(self.state, step=Step.SCAN, scans=()))

    def _read_chart(self, scans: Sequence[Path] = ()) -> ChartReading:
        """The chart as the kept scans and some more show it."""
        return read_scans([*self.scans, *scans], self.chart, self._paper)

    def _report(self, reading: ChartReading, built: Calibration | None = None) -> None:
        more = verification.sections(built) if built is not None else []
        self.go(self.step)
        atomic.write(self.report, report(reading, f"Calibration of {self.name}", more).encode())

    def _save(self, state: CalibrationState) -> None:
        with reported(f"write {self.folder}"):
            self.folder.mkdir(parents=True, exist_ok=True)
        atomic.write(self.folder / _STATE, msgspec.json.format(msgspec.json.encode(state), indent=1))
        self.state = state


def folder() -> Path:
    """Where calibrations in progress are kept; it need not exist."""
    return shipped.own_folder("state") / "calibrating"


def remove(home: Path) -> None:
    """Remove the folder of a calibration; one that is broken off leaves nothing that could be gone on with."""
    with contextlib.suppress(OSError):
        (home / _STATE).unlink()
    shutil.rmtree(home, ignore_errors=True)


def _read_state(home: Path) -> CalibrationState | None:
    """What was left; None if there is nothing that can be gone on with."""
    try:
        state = msgspec.json.decode((home / _STATE).read_bytes(), type=CalibrationState)
    except (OSError, msgspec.MsgspecError):
        return None
    return state if all((home / name).is_file() for name in state.scans) else None
