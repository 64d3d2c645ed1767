"""Sends the pages of a batch, one job after the other, follows each to its end, and resumes interrupted batches."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from handout.errors import PrinterError
from handout.printing.journal import Journal, Piece
from handout.printing.queue import Outcome, OutcomeUnknown, Queue, Say
from handout.printing.rows import ranges


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
    """The outcome of a batch.

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


@dataclass(frozen=True)
class Listener:
    """Callbacks of a batch: `progress` gets (done, all, "check" or "send"), `say` gets sentences."""

    progress: Callable[[int, int, str], object] = lambda done, total, stage: None
    say: Say = lambda sentence: None


SILENT = Listener()


@dataclass
class Checked:
    """The outcome of the checks so far."""

    done: list[int] = field(default_factory=list)
    failed: list[Failed] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


@dataclass
class Remaining:
    """What is left of a batch.

    send : envelopes that are not at the printer; wait : those that it has and may still print; done : rows that came
    out; unknown : rows of which nobody can tell.
    """

    send: list[Piece] = field(default_factory=list)
    wait: list[Piece] = field(default_factory=list)
    done: list[int] = field(default_factory=list)
    unknown: list[Failed] = field(default_factory=list)


class Pages(Protocol):
    """Pages that are ready for a queue."""

    @property
    def queue(self) -> Queue: ...

    def send(self, number: int, title: str, name: str) -> str:
        """Hand the page of a row to the queue as a job of that title; the job's name there."""
        ...


def remaining(journal: Journal, queue: Queue, rows: Sequence[int], copies: int, again: Collection[int]) -> Remaining:
    """Work out what is left to do, from the journal and, where that does not tell, from the printer.

    Parameters
    ----------
    rows : the rows of the batch, by number.
    again : rows to print whatever became of them; not those that the printer may still print by itself.
    """
    todo = Remaining()
    for row in rows:
        outcomes = {(row, copy): _outcome(journal, queue, (row, copy)) for copy in range(1, copies + 1)}
        for piece, outcome in outcomes.items():
            if outcome.state == "waiting":
                todo.wait.append(piece)
            elif outcome.state == "failed" or row in again:
                todo.send.append(piece)
            elif outcome.state == "unknown":
                todo.unknown.append(Failed(row, outcome.why))
        if all(outcome.state == "completed" for outcome in outcomes.values()) and row not in again:
            todo.done.append(row)
    return todo


def _outcome(journal: Journal, queue: Queue, piece: Piece) -> Outcome:
    """Find out what became of an envelope, asking the printer if need be; "failed" if it was never sent."""
    step = journal.steps.get(piece)
    if step is None or step.state == "failed":
        return Outcome("failed")
    if step.state == "completed":
        return Outcome("completed")
    sent = f"it was sent as job {step.job}" if step.job else "it was being sent when the batch broke off"
    if step.state == "doubtful":
        return Outcome("unknown", f"{sent}, and {step.why}")
    outcome = queue.outcome(step.job, step.title, journal.earlier(piece))
    if outcome.job:
        journal.note(piece, "sent", job=outcome.job)
    if outcome.state in ("completed", "failed"):
        _note(journal, piece, outcome)
    return Outcome("unknown", f"{sent}, and {outcome.why}") if outcome.state == "unknown" else outcome


def send(
    pages: Pages,
    checked: Checked,
    todo: Remaining,
    copies: int,
    table: Sequence[int],
    journal: Journal,
    listener: Listener,
) -> tuple[Job, ...]:
    """Wait for jobs at the printer, then send the checked pages; a failure says what was sent and how to resume.

    Parameters
    ----------
    table : the numbers of all rows that can be addressed, so that the rest is named in few words.

    Raises
    ------
    PrintingStopped
        The queue refused a page, or did not print it.
    """
    failed = {failure.row for failure in checked.failed}
    run = _Run(pages, checked, copies, [n for n in table if n not in failed], journal)
    for piece in todo.wait:
        with run.stoppable(piece):
            _follow(pages.queue, journal, piece, journal.steps[piece].job)
    begun: set[int] = set()
    for piece in todo.send:
        if piece[0] not in checked.done:
            continue
        if piece[0] not in begun:
            listener.progress(len(begun), len(checked.done), "send")
        begun.add(piece[0])
        with run.stoppable(piece):
            run.send(piece)
    listener.progress(len(checked.done), len(checked.done), "send")
    return tuple(run.jobs)


def _follow(queue: Queue, journal: Journal, piece: Piece, job: str) -> None:
    """Wait for an envelope's job; PrinterError unless it is completed."""
    outcome = queue.follow(job)
    _note(journal, piece, outcome)
    if outcome.state == "failed":
        raise PrinterError(f"job {job} was not printed: {outcome.why}.")
    if outcome.state == "unknown":
        raise PrinterError(f"what became of job {job} cannot be told: {outcome.why}. Look whether the sheet is there.")
    if outcome.state == "waiting" and not queue.keeps:
        raise PrinterError(f"job {job} is not printed yet: {outcome.why}. Let it go on at the printer.")


def _note(journal: Journal, piece: Piece, outcome: Outcome) -> None:
    if outcome.state == "completed":
        journal.note(piece, "completed")
    elif outcome.state == "failed":
        journal.note(piece, "failed", why=outcome.why)
    elif outcome.state == "unknown":
        journal.note(piece, "doubtful", why=outcome.why)


@dataclass
class _Run:
    """A batch that is being sent; `whole`: the rows of its table that can be printed; `jobs`: what has gone."""

    pages: Pages
    checked: Checked
    copies: int
    whole: Sequence[int]
    journal: Journal
    jobs: list[Job] = field(default_factory=list)

    def send(self, piece: Piece) -> None:
        """Send one envelope; note it before it is sent, when it is sent, and when it is printed."""
        row, copy = piece
        title = self.journal.title(piece)
        self.journal.note(piece, "sending", title=title)
        try:
            job = self.pages.send(row, title, f"row-{row:03d}" + (f"-{copy}" if copy > 1 else ""))
        except OutcomeUnknown:
            raise
        except PrinterError as error:
            self.journal.note(piece, "failed", why=str(error))
            raise
        self.journal.note(piece, "sent", job=job)
        self.jobs.append(Job(row, job))
        _follow(self.pages.queue, self.journal, piece, job)

    @contextmanager
    def stoppable(self, piece: Piece) -> Iterator[None]:
        """Add to a failure of the queue, or to an interruption, which rows were sent and how to go on."""
        number = piece[0]
        try:
            yield
        except (PrinterError, KeyboardInterrupt) as error:
            if isinstance(error, KeyboardInterrupt):
                self._cancel(piece)
            sent = tuple(n for n in self.checked.done if n < number)
            rest = [n for n in self.checked.done if n >= number]
            resume = ranges(rest, self.whole)
            how = "the same command and --resume" if self.journal.path is not None else f"--rows {resume}"
            way_out = f"{self._what_went(sent, piece)}; go on with {how}."
            if isinstance(error, KeyboardInterrupt):
                error.add_note(f"Stopped at row {number}. {way_out}")
                raise
            reason = str(error) if self._begun(number) or self._in_doubt(piece) else "not sent"
            failed = tuple(Failed(n, reason if n == number else "not sent") for n in rest)
            warnings = tuple(self.checked.warnings)
            report = Report(sent, (*self.checked.failed, *failed), (), tuple(self.jobs), warnings)
            raise PrintingStopped(f"Row {number}: {error} {way_out}", report, resume) from error

    def _begun(self, number: int) -> int:
        """How many copies of a row have gone."""
        return sum(job.row == number for job in self.jobs)

    def _in_doubt(self, piece: Piece) -> bool:
        """Whether an envelope may have come out, as far as is known."""
        step = self.journal.steps.get(piece)
        return step is not None and step.state in ("sending", "sent", "doubtful")

    def _what_went(self, sent: Sequence[int], piece: Piece) -> str:
        """What was sent before a batch stopped, and what of the row at which it stopped."""
        row = piece[0]
        begun = self._begun(row)
        rows = f"{'Row' if len(sent) == 1 else 'Rows'} {ranges(sent, self.whole)}"
        went = f"{rows} {'was' if len(sent) == 1 else 'were'} sent" if sent else ""
        if begun and self.copies > 1:
            last = f"{begun} of {self.copies} copies of row {row}"
            return f"{went} and {last}" if went else f"{last} {'was' if begun == 1 else 'were'} sent"
        if self._in_doubt(piece):
            job = self.journal.steps[piece].job
            last = f"row {row} was sent as job {job}" if job else f"whether row {row} was sent is not known"
            return f"{went}, and {last}" if went else last[0].upper() + last[1:]
        return went or "Nothing was sent"

    def _cancel(self, piece: Piece) -> None:
        """Cancel the job in flight, if there is one, and note what became of it."""
        step = self.journal.steps.get(piece)
        if step is not None and step.state in ("sending", "sent"):
            outcome = self.pages.queue.cancel(step.job, step.title)
            if outcome.state in ("completed", "failed"):
                _note(self.journal, piece, outcome)
