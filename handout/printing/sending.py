"""The pages of a batch, one job after the other, each followed to its end; what is left of one that broke off."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from handout.errors import PrinterError
from handout.printing.destination import Spool
from handout.printing.journal import Journal, Piece
from handout.printing.queue import Outcome, OutcomeUnknown, Queue
from handout.printing.report import Failed, Job, PrintingStopped, Report
from handout.printing.rows import ranges

Tell = Callable[[int, int, str], object]


@dataclass
class Checked:
    """The outcome of the checks so far."""

    done: list[int] = field(default_factory=list)
    failed: list[Failed] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


@dataclass
class Left:
    """What is left of a batch.

    send : envelopes that are not at the printer; wait : those that it has and may still print; done : rows that came
    out; unknown : rows of which nobody can tell.
    """

    send: list[Piece] = field(default_factory=list)
    wait: list[Piece] = field(default_factory=list)
    done: list[int] = field(default_factory=list)
    unknown: list[Failed] = field(default_factory=list)


def left(journal: Journal, queue: Queue, rows: Sequence[int], copies: int, again: Collection[int]) -> Left:
    """What a run has to do, by its journal and, where that does not know, by the printer.

    Parameters
    ----------
    rows : the rows of the batch, by number.
    again : rows to print whatever became of them; not those that the printer may still print by itself.
    """
    found = Left()
    for row in rows:
        outcomes = {(row, copy): _outcome(journal, queue, (row, copy)) for copy in range(1, copies + 1)}
        for piece, outcome in outcomes.items():
            if outcome.state == "waiting":
                found.wait.append(piece)
            elif outcome.state == "failed" or row in again:
                found.send.append(piece)
            elif outcome.state == "unknown":
                found.unknown.append(Failed(row, outcome.why))
        if all(outcome.state == "completed" for outcome in outcomes.values()) and row not in again:
            found.done.append(row)
    return found


def _outcome(journal: Journal, queue: Queue, piece: Piece) -> Outcome:
    """What became of an envelope; "failed" for one that never was sent.  What the printer tells is noted."""
    step = journal.steps.get(piece)
    if step is None or step.state == "failed":
        return Outcome("failed")
    if step.state == "completed":
        return Outcome("completed")
    at = f"it was sent as job {step.job}" if step.job else "it was being sent when the batch broke off"
    if step.state == "doubtful":
        return Outcome("unknown", f"{at}, and {step.why}")
    outcome = queue.outcome(step.job, step.title, journal.earlier(piece))
    if outcome.job:
        journal.note(piece, "sent", job=outcome.job)
    if outcome.state in ("completed", "failed"):
        _note(journal, piece, outcome)
    return Outcome("unknown", f"{at}, and {outcome.why}") if outcome.state == "unknown" else outcome


def send(
    spool: Spool, checked: Checked, todo: Left, copies: int, table: Sequence[int], journal: Journal, tell: Tell
) -> tuple[Job, ...]:
    """Wait for what the printer has, send what passed its checks; a failure says what went and how to go on.

    Raises
    ------
    PrintingStopped
        The queue refused a page, or did not print it.
    """
    jobs: list[Job] = []
    whole = [n for n in table if n not in {failed.row for failed in checked.failed}]
    pieces = [piece for piece in todo.send if piece[0] in checked.done]
    for piece in todo.wait:
        with _resumable(piece, copies, checked, jobs, whole, journal, spool.queue):
            _follow(spool.queue, journal, piece, journal.steps[piece].job)
    for n, piece in enumerate(pieces):
        if piece[0] not in {before for before, _ in pieces[:n]}:
            tell(len({row for row, _ in pieces[:n]}), len(checked.done), "send")
        with _resumable(piece, copies, checked, jobs, whole, journal, spool.queue):
            _one(spool, journal, piece, jobs)
    tell(len(checked.done), len(checked.done), "send")
    return tuple(jobs)


def _one(spool: Spool, journal: Journal, piece: Piece, jobs: list[Job]) -> None:
    """One envelope: noted before it goes, when it has gone, and when it is out."""
    row, copy = piece
    title = journal.title(piece)
    journal.note(piece, "sending", title=title)
    try:
        job = spool.send(row, title, f"row-{row:03d}" + (f"-{copy}" if copy > 1 else ""))
    except OutcomeUnknown:
        raise
    except PrinterError as error:
        journal.note(piece, "failed", why=str(error))
        raise
    journal.note(piece, "sent", job=job)
    jobs.append(Job(row, job))
    _follow(spool.queue, journal, piece, job)


def _follow(queue: Queue, journal: Journal, piece: Piece, job: str) -> None:
    """Wait for an envelope's end; PrinterError where it is not a good one."""
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


@contextmanager
def _resumable(
    piece: Piece,
    copies: int,
    checked: Checked,
    jobs: list[Job],
    whole: Sequence[int],
    journal: Journal,
    queue: Queue,
) -> Iterator[None]:
    """Turns a queue's failure, and adds to an interruption, the rows that went and those that did not."""
    number = piece[0]
    try:
        yield
    except (PrinterError, KeyboardInterrupt) as error:
        if isinstance(error, KeyboardInterrupt):
            _stop(queue, journal, piece)
        sent = tuple(n for n in checked.done if n < number)
        rest = [n for n in checked.done if n >= number]
        resume = ranges(rest, whole)
        begun = sum(job.row == number for job in jobs)
        how = "the same command and --resume" if journal.path is not None else f"--rows {resume}"
        told = f"{_went(sent, whole, journal, piece, (begun, copies))}; go on with {how}."
        if isinstance(error, KeyboardInterrupt):
            error.add_note(f"Stopped at row {number}. {told}")
            raise
        here = str(error) if begun or _in_doubt(journal, piece) else "not sent"
        failed = tuple(Failed(n, here if n == number else "not sent") for n in rest)
        report = Report(sent, (*checked.failed, *failed), (), tuple(jobs), tuple(checked.warnings))
        raise PrintingStopped(f"Row {number}: {error} {told}", report, resume) from error


def _in_doubt(journal: Journal, piece: Piece) -> bool:
    """Whether an envelope may have come out, as far as is known."""
    step = journal.steps.get(piece)
    return step is not None and step.state in ("sending", "sent", "doubtful")


def _went(sent: Sequence[int], whole: Sequence[int], journal: Journal, piece: Piece, copies: tuple[int, int]) -> str:
    """What was sent before a batch stopped, and what of the row at which it stopped; `copies` are (begun, all)."""
    (row, _), (begun, wanted) = piece, copies
    rows = f"{'Row' if len(sent) == 1 else 'Rows'} {ranges(sent, whole)}"
    went = f"{rows} {'was' if len(sent) == 1 else 'were'} sent" if sent else ""
    if begun and wanted > 1:
        here = f"{begun} of {wanted} copies of row {row}"
        return f"{went} and {here}" if went else f"{here} {'was' if begun == 1 else 'were'} sent"
    if _in_doubt(journal, piece):
        job = journal.steps[piece].job
        here = f"row {row} was sent as job {job}" if job else f"whether row {row} was sent is not known"
        return f"{went}, and {here}" if went else here[0].upper() + here[1:]
    return went or "Nothing was sent"


def _stop(queue: Queue, journal: Journal, piece: Piece) -> None:
    """Cancel the job in flight, if there is one, and note what became of it."""
    step = journal.steps.get(piece)
    if step is not None and step.state in ("sending", "sent"):
        outcome = queue.cancel(step.job, step.title)
        if outcome.state in ("completed", "failed"):
            _note(journal, piece, outcome)
