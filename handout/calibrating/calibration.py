"""One calibration: what is known of a printer and a paper as one scanner sees them, and the files that hold it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handout import atomic
from handout.errors import InputError

if TYPE_CHECKING:
    from handout.colour.reading import Scribble
    from handout.colour.table import ColourTable

ABOUT, TABLE, PATCHES = "about.json", "table.npz", "patches.ti3"
SCRIBBLE, _PEN = "scribble.npz", "pen.json"
_STRIP, _VERIFIED, _REPORT = "strip.json", "verification.json", "report.html"


@dataclass(frozen=True)
class Calibration:
    """What is known of one printer and paper as one scanner sees them.

    folder : where it is kept; None for a table that came as a file of its own.
    table_file : of the colour table.
    printer, paper, scanner, method : as they were named.
    made : when the table was built.
    misses : ΔE00 by which the model misses its own patches, on the mean; None where that is not known.
    """

    folder: Path | None
    table_file: Path
    printer: str
    paper: str
    made: datetime
    scanner: str = ""
    method: str = ""
    misses: float | None = None

    @property
    def name(self) -> str:
        """``printer/paper``."""
        return f"{self.printer}/{self.paper}"

    @property
    def patches_file(self) -> Path | None:
        """The CGATS table of the chart's patches."""
        return None if self.folder is None else self.folder / PATCHES

    def age(self, at: datetime | None = None) -> int:
        """Days since it was made."""
        return max(0, ((at or now()) - self.made).days)

    def table(self) -> ColourTable:
        """Its colour table; raises InputError."""
        from handout.colour.table import load

        return load(self.table_file)

    def described(self, at: datetime | None = None) -> str:
        """Name, date and age, as they are said in a message."""
        days = self.age(at)
        old = "made today" if days == 0 else f"{days} day{'s' if days > 1 else ''} old"
        return f"calibration {self.name} of {self.made:%Y-%m-%d} ({old})"

    def facts(self) -> dict[str, Any]:
        """What ``--json`` prints of it."""
        return {
            "printer": self.printer, "paper": self.paper, "made": self.made.isoformat(timespec="seconds"),
            "age_days": self.age(), "scanner": self.scanner, "method": self.method, "misses": self.misses,
            "folder": str(self.folder or self.table_file), "verification": self.verification(),
            "pen": {"written": self.scribble() is not None, "hand": self.pen_of()},
        }  # fmt: skip

    def strip(self) -> dict[str, Any] | None:
        """The strip that was made last for it, as `strip.Strip.facts` gives it."""
        return self._kept(_STRIP)

    def verification(self) -> dict[str, Any] | None:
        """What its strip showed, as `verification.Verification.facts` gives it."""
        return self._kept(_VERIFIED)

    def scribble(self) -> Scribble | None:
        """What was written in the chart's frame with a pen; None if nothing was.  Raises InputError."""
        if self.folder is None or not (self.folder / SCRIBBLE).is_file():
            return None
        from handout.colour.reading.pen_field import load

        return load(self.folder / SCRIBBLE)

    def pen_of(self) -> str:
        """The hand whose pen wrote in the chart's frame; empty if nobody said."""
        return str((self._kept(_PEN) or {}).get("hand", ""))

    def keep_scribble(self, path: Path, hand: str) -> None:
        """Take along what was written in the chart's frame with the pen of a hand."""
        assert self.folder is not None
        atomic.write(self.folder / SCRIBBLE, path.read_bytes())
        self._keep(_PEN, {"hand": hand})

    def keep_strip(self, facts: Mapping[str, Any]) -> None:
        """Remember a strip that is being printed."""
        self._keep(_STRIP, facts)

    def keep_verification(self, facts: Mapping[str, Any]) -> None:
        """Remember what a strip showed."""
        self._keep(_VERIFIED, facts)

    def keep_report(self, path: Path) -> None:
        """Take a report along."""
        assert self.folder is not None
        atomic.write(self.folder / _REPORT, path.read_bytes())

    @property
    def report(self) -> Path | None:
        """The report on its chart and strip, if there is one."""
        path = None if self.folder is None else self.folder / _REPORT
        return path if path is not None and path.is_file() else None

    def _kept(self, name: str) -> dict[str, Any] | None:
        if self.folder is None or not (self.folder / name).is_file():
            return None
        return read_json(self.folder / name)

    def _keep(self, name: str, facts: Mapping[str, Any]) -> None:
        if self.folder is None:
            raise InputError(
                f"{self.table_file} is a table by itself, to which nothing can be added: name the printer."
            )
        atomic.write(self.folder / name, json.dumps(dict(facts), indent=1).encode())


def read_json(path: Path) -> dict[str, Any]:
    """A file of a calibration; raises InputError."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read as part of a calibration: make a new one.") from error
    if not isinstance(found, dict):
        raise InputError(f"{path} cannot be read as part of a calibration: make a new one.")
    return found


def now() -> datetime:
    """The time, with its zone."""
    return datetime.now().astimezone()
