"""What a calibration has come to so far, in a folder, so that nothing measured is lost and it can be gone on with."""

from __future__ import annotations

import contextlib
import json
import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path

from handout import atomic, shipped
from handout.calibrating import store
from handout.errors import InputError

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


@dataclass(frozen=True)
class State:
    """As it is kept.

    step : what comes next; printer, paper : the names in the store; sheet, pages : of the chart; begun : when;
    scanner : how the scans are called; scans : names of the files that were taken, in `Session.folder`.
    """

    step: Step
    printer: str
    paper: str
    sheet: str
    pages: int
    begun: str
    scanner: str = ""
    scans: tuple[str, ...] = ()


@dataclass
class Session:
    """The folder of one printer and paper.

    state : what is known of it; every change is on the disk when the method that made it returns.
    """

    folder: Path
    state: State
    resumed: bool = field(default=False)

    @property
    def patches(self) -> Path:
        """The .ti3 of the chart."""
        return self.folder / "patches.ti3"

    @property
    def scribble(self) -> Path:
        """What was written in the chart's frame; there only if something was."""
        return self.folder / "scribble.npz"

    @property
    def report(self) -> Path:
        """The report on the chart's scans."""
        return self.folder / "report.html"

    @property
    def built(self) -> Path:
        """The folder of the calibration that is not stored yet."""
        return self.folder / "built"

    @property
    def scans(self) -> list[Path]:
        """The scans that were taken."""
        return [self.folder / name for name in self.state.scans]

    def go(self, step: Step) -> None:
        """Note what comes next."""
        self._save(replace(self.state, step=step))

    def keep(self, scans: Sequence[Path]) -> None:
        """Take copies of scans along."""
        names = []
        for number, path in enumerate(scans, len(self.state.scans) + 1):
            names.append(f"scan-{number}{path.suffix.lower()}")
            shutil.copy2(path, self.folder / names[-1])
        self._save(replace(self.state, scans=(*self.state.scans, *names)))

    def forget(self) -> None:
        """Give up the scans that were taken, and what was made of them."""
        self._save(replace(self.state, step=Step.SCAN, scans=()))

    def close(self) -> None:
        """Remove the folder: what it held is stored."""
        _remove(self.folder)

    def _save(self, state: State) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"Cannot write {self.folder}: {error.strerror or error}.") from error
        atomic.write(self.folder / _STATE, json.dumps(asdict(state), indent=1).encode())
        self.state = state


def folder() -> Path:
    """Where calibrations in progress are kept; it need not exist."""
    return shipped.own_folder("state") / "calibrating"


def open_session(printer: str, paper: str, sheet: str, pages: int, scanner: str = "", afresh: bool = False) -> Session:
    """The session of a printer and paper: the one that was left, or a new one.

    Raises
    ------
    InputError
        A name that none can have.
    """
    home = folder() / f"{store.key(printer)}--{store.key(paper)}"
    left = None if afresh else _read(home)
    if left is not None:
        return Session(home, left, resumed=True)
    _remove(home)  # of what was not removed to its end, nothing is taken for the new one's
    begun = datetime.now().astimezone().isoformat(timespec="minutes")
    return Session(home, State(Step.PRINT, store.key(printer), store.key(paper), sheet, pages, begun, scanner))


def _remove(home: Path) -> None:
    """Remove the folder of a session; one that is broken off leaves nothing that could be gone on with."""
    with contextlib.suppress(OSError):
        (home / _STATE).unlink()
    shutil.rmtree(home, ignore_errors=True)


def _read(home: Path) -> State | None:
    """What was left; None if there is nothing that can be gone on with."""
    try:
        facts = json.loads((home / _STATE).read_text(encoding="utf-8"))
        state = State(**(facts | {"step": Step(facts["step"]), "scans": tuple(facts["scans"])}))
    except (OSError, ValueError, TypeError, KeyError):
        return None
    return state if all((home / name).is_file() for name in state.scans) else None
