"""What a printer is told of a page, and what every way to a printer can do."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Protocol

from handout.errors import PrinterError
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
    type : kind of paper, ``"envelope"`` or empty.
    name : for a file, without its ending.
    """

    title: str
    media: str
    source: str = ""
    options: Mapping[str, str] = field(default_factory=dict)
    sheet: Page = _NO_SHEET
    type: str = ""
    name: str = ""


@dataclass(frozen=True)
class Fate:
    """What became of a job.

    state : completed: it came out; failed: it did not and will not; waiting: the printer has it and may still print
        it; unknown: nobody can tell.
    why : a phrase, where there is something to say.
    job : the name of the job that was found, where only its title was known.
    """

    state: Literal["completed", "failed", "waiting", "unknown"]
    why: str = ""
    job: str = ""


class FateUnknown(PrinterError):
    """The way to the printer broke after it may have taken a page."""


class Queue(Protocol):
    """Takes pages, one job each.

    name : what to call it in a message; format : of the documents it takes, a key of `formats.WRITERS`; keeps :
    whether it looks after what it has taken, through jams and restarts, until it is printed.
    """

    @property
    def name(self) -> str: ...

    @property
    def format(self) -> str: ...

    @property
    def keeps(self) -> bool: ...

    def resolution(self, wanted: int) -> int:
        """The dpi at which a page is made for it, where the profile says `wanted`."""
        ...

    def check(self, ticket: Ticket) -> None:
        """Refuse, before any work, a sheet or a tray that cannot be; raises HandoutError."""
        ...

    def send(self, page: Path, ticket: Ticket) -> str:
        """Queue one page and return the job's name.

        Raises
        ------
        FateUnknown
            It may have been taken.
        PrinterError
            It was certainly not.
        """
        ...

    def follow(self, job: str) -> Fate:
        """Wait until a job is over, or return at once where the queue keeps it and will print it by itself."""
        ...

    def fate(self, job: str, title: str, earlier: Collection[str] = ()) -> Fate:
        """What became of a job that was sent some time ago; `job` is empty where only its title is known.

        `earlier` are titles of jobs that were over before this one was begun.
        """
        ...

    def cancel(self, job: str, title: str) -> Fate:
        """Stop the job that is in flight; what became of it."""
        ...
