"""Pages through a calibration on their way to the printer, and what is said of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from handout.calibrating import ink_samples, store
from handout.calibrating.pen_reference import FrameReference, Kind, of_calibration
from handout.calibrating.store import Calibration
from handout.colour.table import Reach, apply, tell_loss
from handout.errors import InputError
from handout.inking.pen import Pen
from handout.values import Array, Raster

NONE = "none"
_OLD = 365  # days
_SAMPLED = 1500  # pixels of ink looked at, a page
_PAGES = 8  # pages looked at


def choose(printer: str, paper: str = "", asked: str = "") -> tuple[Calibration | None, list[str]]:
    """The calibration that pages go through, and what has to be said against it.

    Parameters
    ----------
    printer : str
    paper : str
        What is in the printer; empty: nobody knows.
    asked : str
        "none", a ``printer/paper``, or a file or folder of a calibration; empty: the printer's newest.

    Raises
    ------
    InputError
        What was asked for is not there.
    """
    if asked == NONE:
        return None, []
    calibration = _find_calibration(asked) if asked else store.newest(printer, paper) or store.newest(printer)
    return calibration, _collect_doubts(calibration, printer, paper) if calibration is not None else []


def pen_of(calibration: Calibration, hand: str, say: Callable[[str], object]) -> FrameReference:
    """What the frame of a calibration's chart says of a hand; what concerns its pages is said."""
    reference = of_calibration(calibration, hand)
    if reference.kind is not Kind.DRAWN:
        say(f"{'warning: ' if reference.doubtful and reference.kind is not Kind.CORRECTED else ''}{reference.sentence}")
    return reference


def _find_calibration(asked: str) -> Calibration:
    path = Path(asked)
    if path.exists():
        return store.load(path)
    printer, slash, paper = asked.partition("/")
    if path.suffix or not slash:
        raise InputError(
            f"calibration: {asked!r} is neither a file, nor none, nor one of the stored ones, such as epson/plain "
            "(see: handout calibrate show)."
        )
    return store.find_wanted(printer, paper)


def _collect_doubts(calibration: Calibration, printer: str, paper: str) -> list[str]:
    doubts, calibrated = [], calibration.printer
    if calibrated != store.key(printer):
        doubts.append(f"The calibration is of {calibrated}, and this is {store.key(printer)}: colours may be far off.")
    if paper and calibration.paper != store.key(paper):
        loaded = store.key(paper)
        doubts.append(
            f"The calibration was made on {calibration.paper}, and {loaded} is in the printer: colours are off by as "
            f"much as these papers differ. Calibrate it: handout calibrate wizard --printer {calibrated} "
            f"--paper {loaded}"
        )
    if (days := calibration.age()) > _OLD:
        doubts.append(
            f"The calibration is {days} days old; inks and print heads change: verify it (handout calibrate verify "
            f"--printer {calibration.printer}), or make a new one."
        )
    return doubts


@dataclass
class CalibratedInk:
    """Sends the ink of pages through a calibration (an `inking.device_pixels.Calibrate`), and keeps samples of it.

    reference : what the pen in the chart's frame says of the hand; None: nothing is known.
    hand, pen : whose ink is said to be in reach or out of it; an empty hand: that of the pages themselves.
    """

    calibration: Calibration
    reference: FrameReference | None = None
    hand: str = ""
    pen: Pen | None = None
    _seen: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._table = self.calibration.table()

    def __call__(self, raster: Raster) -> Raster:
        """The ink in device RGB; paper stays transparent."""
        if self.reference is not None and self.reference.match is not None:
            raster = self.reference.match.raster(raster)
        if len(self._seen) < _PAGES:
            samples = ink_samples.of_raster(np.asarray(raster.rgba), _SAMPLED)
            if len(samples):
                self._seen.append(samples)
        return apply(raster, self._table)

    def facts(self) -> dict[str, object]:
        """What ``--json`` prints: the calibration and what it cannot reach."""
        reach = self._reach
        return {
            "name": self.calibration.name, "made": self.calibration.date.isoformat(timespec="seconds"),
            "age_days": self.calibration.age(), "out_of_reach": round(reach.share_out, 4) if reach else 0.0,
            "lost": round(reach.mean, 2) if reach else 0.0,
            "pen": self.reference.facts() if self.reference is not None else None,
        }  # fmt: skip

    def tell_reach(self) -> str:
        """One sentence about the calibration, and how much of the ink it cannot reach."""
        reach = self._reach
        if reach is None:
            return f"{self.calibration.describe()}."
        whose = f"of {self.hand}" if self.hand else ""
        return f"{self.calibration.describe()}. {tell_loss(reach.share_out, reach.mean, whose)}"

    @cached_property
    def _reach(self) -> Reach | None:
        if self.hand:
            return ink_samples.reach_of(self.hand, self._table, self.reference, self.pen)
        if not self._seen:
            return None
        return ink_samples.reach_on_paper(np.concatenate(self._seen), self._table)
