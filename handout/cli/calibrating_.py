"""The steps of `handout calibrate wizard` in a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from handout.cli import progress
from handout.errors import HandoutError

if TYPE_CHECKING:
    from handout.calibrating.calibration import Calibration
    from handout.calibrating.reference import Reference
    from handout.calibrating.session import Step
    from handout.calibrating.wizard import Wizard
    from handout.colour.reading import Finding
    from handout.simulated.print_and_scan import Loop

T = TypeVar("T")
_SIMULATED = {
    "PRINT": "The simulated printer prints it.", "SCAN": "The simulated flatbed scans it.",
    "BUILD": "The scan is good; the table is built of it.",
    "STRIP": "The simulated printer prints it through the table.",
    "VERIFY": "The simulated flatbed scans it.", "STORE": "The calibration is stored.",
}  # fmt: skip
_SHARES = {"PRINT": 0.0, "SCAN": 0.09, "BUILD": 0.29, "STRIP": 0.47, "VERIFY": 0.54, "STORE": 0.94}  # measured


class Run:
    """The wizard in a terminal: what it says is shown, what it needs is asked for."""

    def __init__(self, made: Wizard, loop: Loop | None, given: dict[str, Any], say: Callable[[str], None]) -> None:
        self.made, self.loop, self.given, self.say = made, loop, given, say
        self.stored: Calibration | None = None
        self.reference: Reference | None = None

    @property
    def share(self) -> float:
        """Of a simulated calibration, how much is done; 0 of one that waits for a person most of the time."""
        return 0.0 if self.loop is None else _SHARES[self.made.step.name]

    def step(self) -> None:
        """Do what comes next."""
        from handout.calibrating.session import Step

        now = self.made.step
        self.say(f"\n{list(Step).index(now) + 1}/{len(Step) - 1}  {now.value.capitalize()}")
        self.say(self.made.told if self.loop is None else _SIMULATED[now.name])
        steps: dict[Step, Callable[[], None]] = {
            Step.PRINT: self._print, Step.SCAN: self._scan, Step.BUILD: self._build, Step.STRIP: self._strip,
            Step.VERIFY: self._verify, Step.STORE: self._store,
        }  # fmt: skip
        steps[now]()

    def _print(self) -> None:
        self._printed(self.made.print_chart, "chart")

    def _strip(self) -> None:
        if self.given["no_verify"]:
            self._store()
            return
        self._printed(self.made.print_strip, "strip")

    def _printed(self, send: Callable[[Path | None], Sequence[Path]], name: str) -> None:
        folder = self.given["output"]
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
        elif self.loop is None:
            _enter("Press Enter when the paper is loaded")
        files = send(folder / f"{name}.pdf" if folder is not None else None)
        where = ", ".join(map(str, files)) or f"sent to {self.made.profile.queue or self.given['printer']}"
        self.say(f"The {name}: {where}.")

    def _scan(self) -> None:
        taken = self._until_good(lambda: self.made.take_scans(self._scans("chart")))
        self._findings(taken.findings)
        if taken.reference is not None:
            self.reference = taken.reference
            self.say(f"{'warning: ' if taken.reference.doubtful else ''}{taken.reference.said}")
        if taken.missing:
            self.say(taken.missing)

    def _build(self) -> None:
        made = self.made.build(self.given["method"])
        self.say(f"The table misses its own patches by ΔE00 {made.misses:.2f} on the mean.")

    def _verify(self) -> None:
        made = self._until_good(lambda: self.made.take_strip(self._scans("strip")[0]))
        for line in [*made.findings, *made.lines()]:
            self.say(line)
        if made.helps:
            return
        with progress.hidden():
            wanted = click.confirm("Store it all the same?", default=False, err=True)
        if wanted:
            self._store()
        else:
            self.made.back()

    def _store(self) -> None:
        self.stored = self.made.store()

    def _until_good(self, take: Callable[[], T]) -> T:
        """What `take` gives; a person at a terminal may try again."""
        while True:
            try:
                return take()
            except HandoutError as error:
                if self.loop is not None or not sys.stdin.isatty():
                    raise
                self.say(str(error))

    def _scans(self, name: str) -> list[Path]:
        """Scans of what was printed last."""
        work = self.made.session.folder / "incoming"
        work.mkdir(exist_ok=True)
        if self.loop is not None:
            return self.loop.scan(self.made.session.folder / f"{name}.pdf", work / f"{name}.tif", self.made.frame)
        if self.given["scanner"]:
            from handout.calibrating import scanner

            _enter(f"Press Enter when the {name} lies on the glass")
            self.say("Scanning …")
            return [scanner.scan(self.given["scanner"], self.made.chart.paper, work / f"{name}.tif")]
        with progress.hidden():
            return [Path(click.prompt(f"File with the scan of the {name}", err=True).strip().strip("'\""))]

    def _findings(self, findings: Sequence[Finding]) -> None:
        for one in findings:
            self.say(f"warning: {one}")


def _enter(request: str) -> None:
    with progress.hidden():
        click.prompt(request, default="", show_default=False, err=True)
