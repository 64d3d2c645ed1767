"""What is found wrong with a scan, in words that say what to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from handout.errors import InputError

_SHOWN = 8  # patches that a sentence names

Severity = Literal["refuse", "warn"]


@dataclass(frozen=True)
class ScanFinding:
    """One thing that is wrong, or may be.

    code : names the kind of fault, for programs: "mirrored", "cropped" …
    severity : "refuse": no calibration may be made of it; "warn": it may, but less well.
    sentence : what is wrong, and what to do.
    where : the file, and its page if it holds several.
    patches : the patches that it concerns, by their names on the chart.
    """

    code: str
    severity: Severity
    sentence: str
    where: str = ""
    patches: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.where}: {self.sentence}" if self.where else self.sentence

    def facts(self) -> dict[str, str]:
        """What ``--json`` prints of it."""
        return {"code": self.code, "severity": self.severity, "sentence": str(self)}


def list_names(names: Iterable[str]) -> str:
    """List names of patches for a sentence: the first few, and how many more."""
    every = list(names)
    more = f" and {len(every) - _SHOWN} more" if len(every) > _SHOWN else ""
    return ", ".join(every[:_SHOWN]) + more


class ScanRefused(InputError):
    """A scan that cannot be read at all; `finding` says why."""

    def __init__(self, finding: ScanFinding) -> None:
        super().__init__(str(finding))
        self.finding = finding


def make_refusal(code: str, sentence: str, where: str) -> ScanRefused:
    """The error for one fault that leaves nothing to read."""
    return ScanRefused(ScanFinding(code, "refuse", sentence, where))
