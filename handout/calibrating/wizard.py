"""A calibration step by step: chart, scan, table, strip, its scan, store.  The caller shows what is asked for.

    PRINT ─ print_chart → SCAN ─ take_scans → BUILD ─ build → STRIP ─ print_strip → VERIFY ─ take_strip → STORE
                          ▲ └ refused: says what to do, keeps the pages that were good

A step that fails changes nothing, so that it can be tried again; the calibration is stored by the last step only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from handout import atomic
from handout.calibrating import ink_samples, pages, pen_reference, print_diagnosis, store, verification
from handout.calibrating import strip as strips
from handout.calibrating.pen_reference import Reference
from handout.calibrating.session import Session, Step, open_session
from handout.calibrating.store import Calibration
from handout.calibrating.verification import Verification
from handout.colour import cgats
from handout.colour.chart import chart
from handout.colour.chart_files import ti3
from handout.colour.reading import Finding, Reading, read
from handout.colour.reading.pen_field import save as save_scribble
from handout.colour.report import report
from handout.errors import InputError
from handout.printing.queue import Queue
from handout.profiles import Printer

_REQUESTS = {
    Step.PRINT: (
        "Load the paper that you will print on. Choose the quality and paper type that you will print with, and switch "
        "off colour management, enhancements and 'fit to page'."
    ),
    Step.SCAN: (
        "Let the ink dry for a quarter of an hour. Write some words in the frame under the patches with the pen of the "
        "handwriting, as you write: only so can be seen what the scanner makes of its ink. Lay the chart on the glass, "
        "printed side down, and scan it in colour at 300 dpi with the settings of the handwriting's scan: no automatic "
        "exposure, colour or gamma. Save TIFF or PNG."
    ),
    Step.BUILD: "The scans are good; the table is built of them.",
    Step.STRIP: "The verification strip is printed through the new table: load the same paper.",
    Step.VERIFY: "Let the strip dry, write in its frame too, and scan it just like the chart.",
    Step.STORE: "The calibration is stored.",
    Step.DONE: "The calibration is stored, and pages for this printer go through it from now on.",
}


class ScansRefused(InputError):
    """Scans that no calibration may be made of; `findings` give the reasons."""

    def __init__(self, findings: Sequence[Finding], good_scans: int = 0, report_file: Path | None = None) -> None:
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

    findings: tuple[Finding, ...]
    missing: str = ""
    reference: Reference | None = None


@dataclass(frozen=True)
class Task:
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


class Wizard:
    """One calibration of a printer on a paper."""

    def __init__(self, task: Task, *, afresh: bool = False) -> None:
        """Begin a calibration, or go on with an unfinished one (`resumed`); `afresh` : begin in any case.

        Raises
        ------
        InputError
            No such hand, another sheet, or a chart that does not fit the printer's margins.
        """
        layout = pages.chart_for(task.profile, task.sheet, task.pages)
        self.task = task
        paper = ink_samples.paper_of(task.hand) if task.hand else None
        self._paper = None if paper is None else paper.tolist()
        self.writer = ink_samples.scanned_name(task.hand) if task.hand else ""
        self._done = False
        self.seen: Reading | None = None  # what the scans of the chart that were given last showed, good or not
        self.session: Session = open_session(
            task.printer, task.paper, layout.paper.name, len(layout.pages), task.scanner, afresh
        )
        state = self.session.state
        self.chart = chart(state.sheet, pages=state.pages)

    @property
    def step(self) -> Step:
        """What comes next."""
        return Step.DONE if self._done else self.session.state.step

    @property
    def resumed(self) -> bool:
        """Whether an earlier run is gone on with."""
        return self.session.resumed

    @property
    def request(self) -> str:
        """What the user has to do for the next step."""
        return _REQUESTS[self.step]

    @property
    def name(self) -> str:
        """``printer/paper``."""
        return f"{self.session.state.printer}/{self.session.state.paper}"

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom, mm, of the frame for the pen on what is scanned next."""
        if self.step is Step.VERIFY:
            return strips.last_strip(store.load(self.session.built)).page.scribble_field
        return self.chart.pages[0].scribble_field

    def print_chart(self, out: Path | None = None, queue: Queue | None = None) -> tuple[Path, ...]:
        """Print the chart, or write it to `out` for the user to print; the files written.

        Raises
        ------
        InputError, PrinterError
            It cannot be written, or the printer does not take it.
        """
        if (path := out or self._unprinted("chart", queue)) is not None:
            files = pages.write_chart(self.chart, self.task.profile, self.name, path)
        else:
            pages.send(pages.chart_pages(self.chart, self.task.profile, self.name), self.task.profile, queue)
            files = ()
        self.session.go(Step.SCAN)
        return files

    def take_scans(self, scans: Sequence[Path]) -> ChartScanned:
        """Read scans of the chart together with those that were kept earlier, and keep them if they are good.

        Raises
        ------
        ScansRefused
            Something is wrong with them; scans kept earlier stay kept.
        InputError
            A file that cannot be read.
        """
        reading = self._read(scans)
        pen = pen_reference.compared(reading.scribble, self.task.hand, self.writer)
        state = self.session.state
        before = print_diagnosis.last(state.printer, state.paper, state.scanner)
        reading = self.seen = print_diagnosis.diagnose(reading, pen, before, self.task.accept)
        self._report(reading)
        refusing = [finding for finding in reading.findings if finding.severity == "refuse"]
        missing = [finding for finding in refusing if finding.code == "page-missing"]
        if len(missing) < len(refusing) or not reading.sheets:
            raise ScansRefused(reading.findings, len(self.session.scans), self.session.report)
        self.session.keep(scans)
        warned = print_diagnosis.warned(reading.findings)
        if missing:
            return ChartScanned(warned, missing[0].sentence)
        self.session.scribble.unlink(missing_ok=True)
        if reading.scribble is not None:
            save_scribble(reading.scribble, self.session.scribble)
        keywords = {"PRINTER": state.printer, "PAPER": state.paper, "SCANNER": state.scanner}
        cgats.write(self.session.patches, ti3(reading, {name: value for name, value in keywords.items() if value}))
        self.session.go(Step.BUILD)
        return ChartScanned(warned, reference=pen)

    def build(self, method: str = "forward") -> Calibration:
        """Build the table from the measured patches.

        Raises
        ------
        InputError
            An unknown method, or patches that contradict each other: then the chart has to be scanned again.
        """
        state = self.session.state
        patches = store.read_patches(self.session.patches)
        built = store.build(self.session.built, patches, state.printer, state.paper, state.scanner, method)
        if self.session.scribble.is_file():
            built.keep_scribble(self.session.scribble, self.writer)
        self.session.go(Step.STRIP)
        return built

    def print_strip(self, out: Path | None = None, queue: Queue | None = None) -> tuple[Path, ...]:
        """Print the verification strip, or write it to `out`.

        Raises
        ------
        InputError, PrinterError
            The printer reaches next to nothing of the ink; it cannot be written, or the printer does not take it.
        """
        built = store.load(self.session.built)
        strip = strips.prepare(built, self.task.hand, self.session.state.sheet)
        printed = strips.pages_of(strip, built, self.task.profile)
        if (path := out or self._unprinted("strip", queue)) is not None:
            files = pages.write(printed, path)
        else:
            pages.send(printed, self.task.profile, queue)
            files = ()
        self.session.go(Step.VERIFY)
        return files

    def take_strip(self, scan: Path) -> Verification:
        """Read the scan of the strip; the next step is to store, unless the calibration improves nothing.

        Raises
        ------
        Refused
            It is not the strip, or not all of it.
        InputError
            A file that cannot be read.
        """
        verified = verification.verify(store.load(self.session.built), [scan])
        if verified.helps:
            self.session.go(Step.STORE)
        return verified

    def store(self) -> Calibration:
        """Store the calibration and delete the files of the session.

        Raises
        ------
        InputError
            Nothing was built yet, or it cannot be written.
        """
        if self.step not in (Step.STRIP, Step.VERIFY, Step.STORE):
            raise InputError(f"Nothing can be stored yet: what comes next is to {self.step}.")
        built = store.load(self.session.built)
        self._report(self._read(), built)
        built.keep_report(self.session.report)
        stored = store.add(built)
        self.session.close()
        self._done = True
        return stored

    def back(self) -> None:
        """Return to scanning the chart, and forget the scans that were kept."""
        self.session.forget()

    def _read(self, scans: Sequence[Path] = ()) -> Reading:
        """The chart as the kept scans and some more show it."""
        return read([*self.session.scans, *scans], self.chart, self._paper)

    def _report(self, reading: Reading, built: Calibration | None = None) -> None:
        more = verification.sections(built) if built is not None else []
        self.session.go(self.step)
        atomic.write(self.session.report, report(reading, f"Calibration of {self.name}", more).encode())

    def _unprinted(self, name: str, queue: Queue | None) -> Path | None:
        """The file that stands for a page of the simulated printer; None for other printers."""
        if queue is not None or not self.task.profile.simulated:
            return None
        self.session.go(self.step)
        return self.session.folder / f"{name}.pdf"
