"""The steps of one calibration with the person at the printer and the scanner, or with simulated ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from handout.calibrating import scanner
from handout.calibrating.pen_reference import Reference
from handout.calibrating.session import Step
from handout.calibrating.store import Calibration
from handout.calibrating.wizard import Wizard
from handout.errors import HandoutError
from handout.pipeline.options import CalibrationOptions
from handout.pipeline.results import Listener

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


class Person(Protocol):
    """The user at the printer and the scanner."""

    def ready(self, request: str) -> None:
        """Wait until the user has done what is asked."""

    def scan_of(self, name: str) -> Path:
        """The file with the scan of "chart" or "strip"."""

    def agrees(self, question: str) -> bool:
        """Whether the user says yes; no is the usual answer."""

    def tries_again(self) -> bool:
        """Whether the user can scan again after a mistake."""


@dataclass
class GuidedCalibration:
    """The wizard's steps, each with what it asks of the person."""

    wizard: Wizard
    options: CalibrationOptions
    person: Person
    listener: Listener
    loop: Loop | None
    stored: Calibration | None = None
    reference: Reference | None = None

    def step(self) -> None:
        """Do what comes next."""
        now = self.wizard.step
        # a person takes most of the time of a real calibration, and nobody knows how long
        share, sentence = (0.0, self.wizard.request) if self.loop is None else _SIMULATED[now]
        self.listener.progress(share, now.value)
        self.listener.say(f"\n{list(Step).index(now) + 1}/{len(Step) - 1}  {now.value.capitalize()}", sentence)
        {
            Step.PRINT: self._print_chart, Step.SCAN: self._scan_chart, Step.BUILD: self._build,
            Step.STRIP: self._print_strip, Step.VERIFY: self._verify, Step.STORE: self._store,
        }[now]()  # fmt: skip

    def _print_chart(self) -> None:
        self._print(self.wizard.print_chart, "chart")

    def _print_strip(self) -> None:
        if self.options.no_verify:
            self._store()
        else:
            self._print(self.wizard.print_strip, "strip")

    def _print(self, send: Callable[[Path | None], Sequence[Path]], name: str) -> None:
        folder = self.options.output
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
        elif self.loop is None:
            self.person.ready("Press Enter when the paper is loaded")
        files = send(folder / f"{name}.pdf" if folder is not None else None)
        task = self.wizard.task
        where = ", ".join(map(str, files)) or f"sent to {task.profile.queue or task.printer}"
        self.listener.say(f"The {name}: {where}.")

    def _scan_chart(self) -> None:
        scanned = self._until_good(lambda: self.wizard.take_scans(self._scans("chart")))
        self.listener.say(*(f"warning: {finding}" for finding in scanned.findings))
        if scanned.reference is not None:
            self.reference = scanned.reference
            self.listener.say(scanned.reference.as_message())
        if scanned.missing:
            self.listener.say(scanned.missing)

    def _build(self) -> None:
        built = self.wizard.build(self.options.method)
        self.listener.say(f"The table misses its own patches by ΔE00 {built.misses:.2f} on the mean.")

    def _verify(self) -> None:
        verified = self._until_good(lambda: self.wizard.take_strip(self._scans("strip")[0]))
        self.listener.say(*verified.findings, *verified.lines())
        if verified.helps:
            return
        if self.person.agrees("Store it all the same?"):
            self._store()
        else:
            self.wizard.back()

    def _store(self) -> None:
        self.stored = self.wizard.store()

    def _until_good(self, take: Callable[[], T]) -> T:
        """What `take` gives; a person at a terminal may try again."""
        while True:
            try:
                return take()
            except HandoutError as error:
                if self.loop is not None or not self.person.tries_again():
                    raise
                self.listener.say(str(error))

    def _scans(self, name: str) -> list[Path]:
        """Scans of what was printed last."""
        work = self.wizard.session.folder / "incoming"
        work.mkdir(exist_ok=True)
        if self.loop is not None:
            printed = self.wizard.session.folder / f"{name}.pdf"
            return self.loop.scan(printed, work / f"{name}.tif", self.wizard.frame)
        if self.options.scanner:
            self.person.ready(f"Press Enter when the {name} lies on the glass")
            self.listener.say("Scanning …")
            return [scanner.scan(self.options.scanner, self.wizard.chart.paper, work / f"{name}.tif")]
        return [self.person.scan_of(name)]
