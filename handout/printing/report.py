"""What became of a batch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from handout.errors import PrinterError


@dataclass(frozen=True)
class Failed:
    """A row that could not be done, and why."""

    row: int
    reason: str


@dataclass(frozen=True)
class Job:
    """A row that went to the queue, and the name of its job there."""

    row: int
    name: str


@dataclass(frozen=True)
class Report:
    """What became of a batch.

    rows : numbers of the rows that are done; failed : the others, with reasons; files : what was written;
    jobs : what was sent; warnings : sentences that name their row; before : rows that were done when the batch was
    gone on with; unknown : rows that were sent then and of which nobody can tell whether they came out.
    """

    rows: tuple[int, ...] = ()
    failed: tuple[Failed, ...] = ()
    files: tuple[Path, ...] = ()
    jobs: tuple[Job, ...] = ()
    warnings: tuple[str, ...] = ()
    before: tuple[int, ...] = ()
    unknown: tuple[Failed, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 all done, 4 some rows failed (or nobody knows of them) and the others were done, 2 none could be done."""
        if not self.failed and not self.unknown:
            return 0
        return 4 if self.rows or self.before or self.unknown else 2


class PrintingStopped(PrinterError):
    """The queue failed in the middle of a batch; `report` holds what was sent, `resume` the rows to ask for again."""

    def __init__(self, message: str, report: Report, resume: str) -> None:
        super().__init__(message)
        self.report = report
        self.resume = resume
