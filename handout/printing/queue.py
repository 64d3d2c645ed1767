"""Tickets for pages, what every queue can do, and the queues that are folders.

Other ways to a printer are in `printers` (CUPS) and `ipp.queue`; a new one is a class that inherits `Queue`, which
`printers.open_queue` opens.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Protocol

from handout import atomic
from handout.errors import PrinterError, reported
from handout.values import Page

Say = Callable[[str], object]
_NO_SHEET = Page(0, 0)


@dataclass(frozen=True)
class Ticket:
    """What a queue is told about a page.

    title : of the job, without anybody's name.
    media : name of the sheet as it is fed.
    source : tray; empty for the printer's own choice.
    options : further ones, sent as they are.
    sheet : its size as it is fed, mm; the first side lies across the feed.
    type : kind of paper, ``"envelope"`` or empty; taken where the printer has it.
    name : for a file, without its ending.
    format : MIME type of the document, where the way to the printer asks for it.
    copies : always sent over IPP, because some printers otherwise make more than one.
    """

    title: str
    media: str
    source: str = ""
    options: Mapping[str, str] = field(default_factory=dict)
    sheet: Page = _NO_SHEET
    type: str = ""
    name: str = ""
    format: str = ""
    copies: int = 1


@dataclass(frozen=True)
class Outcome:
    """The outcome of a job.

    state : completed: it came out; failed: it did not and will not; waiting: the printer has it and may still print
        it; unknown: nobody can tell.
    why : a phrase, where there is something to say.
    job : the name of the job that was found, where only its title was known.
    """

    state: Literal["completed", "failed", "waiting", "unknown"]
    why: str = ""
    job: str = ""


class OutcomeUnknown(PrinterError):
    """The connection broke when the printer may already have taken a page."""


class Device(Protocol):
    """A printer or a plotter: says what became of the jobs that it has taken.

    name : what to call it in a message; keeps : whether it looks after what it has taken, through jams and restarts,
    until it is made.
    """

    @property
    def name(self) -> str: ...

    @property
    def keeps(self) -> bool: ...

    def follow(self, job: str, title: str) -> Outcome:
        """Wait until a job is over, or return at once where the queue keeps it and will print it by itself."""
        ...

    def outcome(self, job: str, title: str, earlier: Collection[str] = ()) -> Outcome:
        """What became of a job that was sent some time ago; `job` is empty where only its title is known.

        `earlier` are titles of jobs that were over before this one was begun.
        """
        ...

    def cancel(self, job: str, title: str) -> Outcome:
        """Stop the job that is in flight; what became of it."""
        ...


class Queue(ABC):
    """A `Device` that takes pages, one job each; by itself it takes every sheet, and has made it at once.

    format : of the documents it takes, a key of `documents.WRITERS`.
    """

    name: str
    format = "pdf"
    keeps = False

    def resolution(self, wanted: int) -> int:
        """The dpi of its pages, where the profile asks for `wanted`."""
        return wanted

    def check(self, ticket: Ticket) -> None:  # noqa: B027 - by itself it takes every sheet
        """Refuse an impossible sheet or tray before any work; raises HandoutError."""

    @abstractmethod
    def send(self, page: Path, ticket: Ticket) -> str:
        """Queue one page and return the job's name.

        Raises OutcomeUnknown: it may have been taken. PrinterError: it was certainly not.
        """

    def follow(self, job: str, title: str) -> Outcome:
        return Outcome("completed")

    @abstractmethod
    def outcome(self, job: str, title: str, earlier: Collection[str] = ()) -> Outcome:
        """See `Device`."""

    def cancel(self, job: str, title: str) -> Outcome:
        return self.outcome(job, title)


class FolderQueue(Queue):
    """A folder that receives each page as a file, as a printer would, called as the row is."""

    def __init__(self, folder: Path, format: str = "pdf") -> None:
        """Make the folder; `format` is a key of `documents.WRITERS`. Raises InputError: the folder cannot be made."""
        self._folder, self.name, self.format = folder, str(folder), format
        with reported(f"make the folder {folder}"):
            folder.mkdir(parents=True, exist_ok=True)

    def send(self, page: Path, ticket: Ticket) -> str:
        """Keep one page; the name of its file without the ending."""
        atomic.write(self._folder / f"{ticket.name}.{self.format}", page.read_bytes())
        return ticket.name

    def outcome(self, job: str, title: str, earlier: Collection[str] = ()) -> Outcome:
        """Whether its file is there, which is written whole or not at all; one never named was never written."""
        there = bool(job) and (self._folder / f"{job}.{self.format}").is_file()
        return Outcome("completed") if there else Outcome("failed", "its file is not there")


class SimulatedQueue(FolderQueue):
    """A queue that keeps each job as a PDF in a folder, with its ticket in ``jobs.jsonl``; it can jam on demand."""

    def __init__(self, folder: Path, jam_at: int = 0, go_on: bool = False) -> None:
        """`jam_at` is the number of the job, from 1, that it refuses; 0: it never does.

        With `go_on` the jobs that are there stay, and the numbers go on behind them.  Raises InputError: see above.
        """
        super().__init__(folder)
        self._jam_at = jam_at
        log = folder / "jobs.jsonl"
        self._log = log.read_text(encoding="utf-8").splitlines(keepends=True) if go_on and log.exists() else []

    def send(self, pdf: Path, ticket: Ticket) -> str:
        """Keep one job; PrinterError at the jam."""
        number = len(self._log) + 1
        if number == self._jam_at:
            raise PrinterError(f"The simulated printer {self._folder} has a paper jam at job {number}.")
        job = f"job-{number:03d}"
        atomic.write(self._folder / f"{job}.pdf", pdf.read_bytes())
        ticket_fields = {"title": ticket.title, "media": ticket.media, "source": ticket.source}
        entry = {"job": job, **ticket_fields, "options": dict(ticket.options)}
        self._log.append(json.dumps(entry, ensure_ascii=False) + "\n")
        atomic.write(self._folder / "jobs.jsonl", "".join(self._log).encode())
        return job

    def outcome(self, job: str, title: str, earlier: Collection[str] = ()) -> Outcome:
        """Whether a job of that title is in its log."""
        there = any(json.loads(entry)["title"] == title for entry in self._log)
        return Outcome("completed") if there else Outcome("failed", "the job is not there")
