"""Sends the pages of a batch, one job after the other, follows each to its end, and resumes interrupted batches.

A page goes to a device (a `queue.Queue`, a printer or a plotter) exactly once: before it is sent the journal says so,
and what became of a page whose end was not seen is asked of the device by the title of its job.
"""

from __future__ import annotations

import itertools
import re
import threading
from abc import abstractmethod
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from handout.errors import HandoutError, PrinterError
from handout.printing.journal import Journal, Piece, PieceStep, State
from handout.printing.prepared import Destination
from handout.printing.queue import Device, Outcome, OutcomeUnknown
from handout.printing.rows import name_rows, ranges
from handout.progress import Tell


@dataclass(frozen=True)
class Failed:
    """A row that could not be done, and why."""

    row: int
    reason: str


@dataclass(frozen=True)
class Job:
    """A row that went to a device, and the name of its job there."""

    row: int
    name: str
    device: str = ""


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
    def devices(self) -> dict[str, list[int]]:
        """Which rows went to each device, in the order in which it made them."""
        made: dict[str, dict[int, None]] = {}
        for job in self.jobs:
            made.setdefault(job.device, {})[job.row] = None
        return {name: list(rows) for name, rows in made.items()}

    def complaints(self) -> Iterator[str]:
        """Why rows failed, those behind each other of which the same is said together."""
        for reason, failures in itertools.groupby(self.failed, key=lambda failure: failure.reason):
            yield f"{name_rows([failure.row for failure in failures])}: {reason}"

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


def tell_rows(tell: Tell, stage: str, done: int, total: int) -> None:
    """Say how many rows of a batch are done with a stage: "make", "check" or "send"."""
    tell(done / max(total, 1), f"{stage} {done}/{total}")


@dataclass
class Checked:
    """What has become of rows so far.

    wanted : all that are to be made now, as they stand in the table; said : warnings that are of no row.
    """

    wanted: list[int] = field(default_factory=list)
    done: list[int] = field(default_factory=list)
    failed: list[Failed] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    _warned: dict[str, tuple[list[int], str]] = field(default_factory=dict)

    def warn(self, row: int, phrases: Iterable[str]) -> None:
        """Keep what has to be said of a row."""
        for phrase in phrases:
            key = _LENGTH.sub("", phrase)
            rows, worst = self._warned.get(key, ([], phrase))
            rows.append(row)
            self._warned[key] = rows, min(worst, phrase, key=_length)

    @property
    def warnings(self) -> list[str]:
        """What has to be said, each once with the rows that it is of; where lengths differ, the worst is named."""
        return [*(f"{name_rows(rows)}: {phrase}" for rows, phrase in self._warned.values()), *self.said]


_LENGTH = re.compile(r"-?\d+\.\d(?= mm)")


def _length(phrase: str) -> float:
    found = _LENGTH.search(phrase)
    length = float(found.group()) if found else 0.0
    return -length if "beyond" in phrase else length


@dataclass
class Remaining:
    """What is left of a batch.

    fresh : rows of which nothing was sent yet; send : of the others, pieces that are not at the device; wait : those
    that it has and may still make; done : rows of which all came out; unknown : pieces of which nobody can tell.
    """

    fresh: list[int] = field(default_factory=list)
    send: list[Piece] = field(default_factory=list)
    wait: list[Piece] = field(default_factory=list)
    done: list[int] = field(default_factory=list)
    unknown: list[Failed] = field(default_factory=list)

    @property
    def rows(self) -> set[int]:
        """The rows of which pages have to be made."""
        return {*self.fresh, *(piece.row for piece in self.send)}


class Spool(Destination):
    """A destination whose pages are sent to a device (`queue`)."""

    queue: Device

    @property
    def devices(self) -> list[Device]:
        """The only one."""
        return [self.queue]

    @abstractmethod
    def sheets(self, pieces: Iterable[Piece]) -> Iterator[Sequence[Piece]]:
        """The pieces as they are made, in order and as soon as they can be: those that share a sheet are one job."""

    @abstractmethod
    def ready(self, sheet: Sequence[Piece]) -> None:
        """Have the paper for a sheet put in, where it is not that of the sheet before; nothing has been sent yet."""

    @abstractmethod
    def send(self, sheet: Sequence[Piece], title: str) -> str:
        """Hand a sheet to the queue as a job of that title; the job's name there."""

    def send_rows(self, taken: Iterable[Sequence[Piece]], run: BatchRun, tell: Tell) -> tuple[Job, ...]:
        """Wait for jobs at the device, then send pages as they are taken; a failure says what was sent, how to resume.

        taken : all pieces of each row, as soon as it is made; none of one that cannot be.

        Raises PrintingStopped: the queue refused a page, or did not print it.
        """
        for begun in jobs_of(run.todo.wait, run.journal):
            with run.stoppable(self.queue, begun):
                follow(self.queue, run.journal, begun)
            run.drop_pieces(begun)
        total = len(run.checked.wanted)
        sheets = iter(self.sheets(itertools.chain.from_iterable(map(run.begin, taken))))
        while True:
            with run.stoppable(self.queue):
                sheet = next(sheets, None)
            if sheet is None:
                break
            tell_rows(tell, "send", run.begun_rows, total)
            with run.stoppable(self.queue, sheet):
                run.send(self, sheet)
        tell_rows(tell, "send", total, total)
        return tuple(run.jobs)


def remaining(
    journal: Journal, devices: Sequence[Device], rows: Sequence[int], copies: Mapping[int, int], again: Collection[int]
) -> Remaining:
    """Work out what is left to do, from the journal and, where that does not tell, from the device that has it.

    rows : the rows of the batch, by number; copies : of each row.
    again : rows to make whatever became of them; not those that the device may still make by itself.
    """
    todo = _unbegun_rows(journal, devices, rows, again)
    for row in rows:
        if row not in journal.parts:
            continue
        outcomes = []
        for piece in pieces(row, copies[row], journal.parts[row]):
            outcome = _ask_outcome(journal, devices, piece)
            if outcome.state == "failed" and journal.lost:  # or begun, or once more, in a line that is damaged
                journal.note(piece, "doubtful", why=journal.why_unknown)
                outcome = Outcome("unknown", journal.why_unknown)
            outcomes.append(outcome)
            if outcome.state == "waiting":
                todo.wait.append(piece)
            elif outcome.state == "failed" or row in again:
                todo.send.append(piece)
            elif outcome.state == "unknown":
                todo.unknown.append(Failed(row, f"{piece.part}: {outcome.why}" if piece.part else outcome.why))
        if all(outcome.state == "completed" for outcome in outcomes) and row not in again:
            todo.done.append(row)
    return todo


def _unbegun_rows(
    journal: Journal, devices: Sequence[Device], rows: Sequence[int], again: Collection[int]
) -> Remaining:
    """The rows of which nothing is known to be sent.

    One device makes rows in their order, so that of these the first may be lost in damaged lines (`batch.make_rows`);
    of several any.
    """
    todo = Remaining(fresh=[row for row in rows if row not in journal.parts])
    names = {*(device.name for device in devices), *(step.device for step in journal.steps.values())}
    if journal.lost and len(names) > 1:
        todo.unknown = [Failed(row, journal.why_unknown) for row in todo.fresh if row not in again]
        todo.fresh = [row for row in todo.fresh if row in again]
    return todo


def pieces(row: int, copies: int, parts: Sequence[str]) -> list[Piece]:
    """All pieces of a row, in order."""
    return [Piece(row, copy, part) for copy in range(1, copies + 1) for part in parts]


def device_of(step: PieceStep, devices: Sequence[Device]) -> Device | None:
    """The device that has a page: the only one, whatever it is called now; None if it is not among several."""
    named = (device for device in devices if step.device in ("", device.name))
    return devices[0] if len(devices) == 1 else next(named, None)


def _ask_outcome(journal: Journal, devices: Sequence[Device], piece: Piece) -> Outcome:
    step = journal.steps.get(piece, PieceStep("failed"))
    if step.state in ("failed", "completed"):
        return Outcome(step.state)
    sent = f"it was sent as job {step.number}" if step.job else "it was being sent when the batch broke off"
    if step.state == "doubtful":
        return Outcome("unknown", f"{sent}, and {step.why}" if step.title else step.why)
    device = device_of(step, devices)
    # a plotter knows of the plots of all; of what is not finished only the device itself can tell
    asked = devices if device is None else [device]
    outcomes = [each.outcome(step.job, step.title, journal.earlier(piece)) for each in asked]
    outcome = next((each for each in outcomes if each.state == "completed"), outcomes[0])
    if device is None and outcome.state != "completed":
        return Outcome("unknown", f"{sent} to {step.device}, which is not among the devices now: name it, too")
    if outcome.job:
        journal.note(piece, "sent", job=outcome.job)
    if outcome.state in ("completed", "failed"):
        note_outcome(journal, [piece], outcome)
    return Outcome("unknown", f"{sent}, and {outcome.why}") if outcome.state == "unknown" else outcome


def jobs_of(waiting: Iterable[Piece], journal: Journal) -> list[list[Piece]]:
    """The pieces of each job that a device has."""
    jobs: dict[tuple[str, str], list[Piece]] = {}
    for piece in waiting:
        step = journal.steps[piece]
        jobs.setdefault((step.job, step.title), []).append(piece)
    return list(jobs.values())


def follow(queue: Device, journal: Journal, sheet: Sequence[Piece]) -> None:
    """Wait for the job of a sheet; PrinterError unless it is completed."""
    step = journal.steps[sheet[0]]
    outcome, job = queue.follow(step.job, step.title), step.number
    note_outcome(journal, sheet, outcome)
    if outcome.state == "failed":
        raise PrinterError(f"job {job} was not printed: {outcome.why}.")
    if outcome.state == "unknown":
        raise PrinterError(f"what became of job {job} cannot be told: {outcome.why}. Look whether the sheet is there.")
    if outcome.state == "waiting" and not queue.keeps:
        raise PrinterError(f"job {job} is not printed yet: {outcome.why}. Let it go on at the printer.")


def note_outcome(journal: Journal, sheet: Sequence[Piece], outcome: Outcome) -> None:
    """Keep what became of a sheet; of one that waits there is nothing new."""
    states: dict[str, State] = {"completed": "completed", "failed": "failed", "unknown": "doubtful"}
    for piece in sheet if outcome.state in states else ():
        why = {} if outcome.state == "completed" else {"why": outcome.why}
        journal.note(piece, states[outcome.state], **why)


@dataclass
class BatchRun:
    """A batch that is being sent.

    checked : what has become of the rows that are made; table : the rows of its table that can be made, as far as was
    known, so that the rest is named in few words; todo : what was left of it.
    left : of every row what has not gone yet; made : all pieces of the rows that are made; jobs : what has gone.
    """

    checked: Checked
    table: Sequence[int]
    journal: Journal
    todo: Remaining
    left: dict[int, set[Piece]] = field(default_factory=dict)
    made: dict[int, Sequence[Piece]] = field(default_factory=dict)
    jobs: list[Job] = field(default_factory=list)
    begun: dict[int, int] = field(default_factory=dict)  # row → how many pieces of it have gone
    lock: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self) -> None:
        self.fresh = set(self.todo.fresh)
        for piece in (*self.todo.send, *self.todo.wait):
            self.left.setdefault(piece.row, set()).add(piece)

    @property
    def begun_rows(self) -> int:
        return len(self.begun)

    def begin(self, every: Sequence[Piece]) -> list[Piece]:
        """Of a row that is taken, all of whose pieces these are, what is to be sent."""
        if not every:
            return []
        row = every[0].row
        self.made[row] = every
        if row in self.fresh:
            self.left[row] = set(every)
        return [piece for piece in every if piece in self.left[row]]

    @property
    def whole(self) -> list[int]:
        """The rows of its table that can be made, as far as is known."""
        failed = {failure.row for failure in self.checked.failed}
        return [number for number in self.table if number not in failed]

    def drop_pieces(self, sheet: Sequence[Piece]) -> None:
        """These need no more."""
        with self.lock:
            for piece in sheet:
                self.left[piece.row].discard(piece)
                self.begun[piece.row] = self.begun.get(piece.row, 0) + 1

    def send(self, spool: Spool, sheet: Sequence[Piece]) -> None:
        """Send one sheet; note it before it is sent, when it is sent, and when it is made."""
        spool.ready(sheet)
        device, title = spool.queue.name, self.journal.title(sheet[0])
        for row in dict.fromkeys(piece.row for piece in sheet):
            self.journal.parts[row] = tuple(dict.fromkeys(piece.part for piece in self.made[row]))
        for piece in sheet:
            self.journal.note(piece, "sending", title=title, device=device)
        try:
            job = spool.send(sheet, title)
        except OutcomeUnknown:
            raise
        except PrinterError as error:
            note_outcome(self.journal, sheet, Outcome("failed", str(error)))
            raise
        for piece in sheet:
            self.journal.note(piece, "sent", job=job)
            self.jobs.append(Job(piece.row, job, device))
        self.drop_pieces(sheet)
        follow(spool.queue, self.journal, sheet)

    @contextmanager
    def stoppable(self, device: Device, sheet: Sequence[Piece] = ()) -> Iterator[None]:
        """Add to a failure of the device, or to an interruption, which rows were sent and how to go on.

        sheet : that is being sent; none while the next is being made.
        """
        try:
            yield
        except KeyboardInterrupt as interruption:
            if sheet:
                self.cancel(device, sheet)
            sent, rest = self.split_rows(sheet)
            interruption.add_note(f"Stopped{self._name_row(sheet, rest, ' at row')}. {self.way_out(sheet, sent, rest)}")
            raise
        except HandoutError as error:
            sent, rest = self.split_rows(sheet)
            in_doubt = bool(sheet) and (self.begun.get(sheet[0].row) or self._in_doubt(sheet[0]))
            failed = tuple(Failed(n, str(error) if in_doubt and n == sheet[0].row else "not sent") for n in rest)
            where = self._name_row(sheet, rest, "Row")
            message = f"{where}{': ' if where else ''}{error} {self.way_out(sheet, sent, rest)}"
            raise self.broken_off(message, sent, failed) from error

    def broken_off(self, message: str, sent: Sequence[int], failed: Sequence[Failed]) -> PrintingStopped:
        """The error that says what was sent, and which rows were not."""
        told, warnings = (*self.checked.failed, *failed), tuple(self.checked.warnings)
        report = Report(tuple(sent), told, (), tuple(self.jobs), warnings, unknown=tuple(self.todo.unknown))
        return PrintingStopped(message, report, ranges([failure.row for failure in failed], self.whole))

    def split_rows(self, sheet: Sequence[Piece] = ()) -> tuple[tuple[int, ...], list[int]]:
        """The rows that are sent, and those that are not when this sheet fails."""
        here, failed = {piece.row for piece in sheet}, {failure.row for failure in self.checked.failed}
        sent = tuple(n for n in self.checked.done if n in self.made and n not in here and not self.left.get(n))
        ended = {*sent, *failed}
        return sent, [n for n in self.checked.wanted if n not in ended]

    def list_unmade(self, rest: Sequence[int]) -> list[int]:
        """These rows, and those that a device had begun before and then failed, in the order of the table."""
        left = {*rest, *(piece.row for piece in self.todo.wait if piece in self.left[piece.row])}
        return [number for number in self.table if number in left]

    def _name_row(self, sheet: Sequence[Piece], rest: Sequence[int], word: str) -> str:
        """The row that was being sent or made, behind a word; "" if there was none."""
        number = sheet[0].row if sheet else next((n for n in rest if n not in self.made), 0)
        return f"{word} {number}" if number else ""

    def way_out(self, sheet: Sequence[Piece], sent: Sequence[int], rest: Sequence[int]) -> str:
        rows = ranges(rest, self.whole)
        how = "the same command and --resume" if self.journal.path is not None else f"--rows {rows}"
        return f"{self._what_went(sent, sheet)}; go on with {how}."

    def is_begun(self, piece: Piece) -> bool:
        """Whether a piece was made, or may have come out, as far as is known."""
        step = self.journal.steps.get(piece)
        return step is not None and step.state != "failed"

    def _in_doubt(self, piece: Piece) -> bool:
        """Whether a piece may have come out, as far as is known."""
        step = self.journal.steps.get(piece)
        return step is not None and step.state in ("sending", "sent", "doubtful")

    def _what_went(self, sent: Sequence[int], sheet: Sequence[Piece]) -> str:
        """What was sent before a batch stopped, and what of the rows that it had begun."""
        row = sheet[0].row if sheet else 0
        went = [f"{_rows(sent, self.whole)} {'was' if len(sent) == 1 else 'were'} sent"] if sent else []
        parted = [n for n in self.begun if n != row and n not in sent]
        went += [f"a part of {_rows(parted, self.whole).lower()}"] if parted else []
        went += self._what_of(sheet) if sheet else []
        if not went:
            return "Nothing was sent"
        text = " and ".join(went)
        return f"{text[0].upper()}{text[1:]}{'' if ' sent' in text else ' was sent'}"

    def _what_of(self, sheet: Sequence[Piece]) -> list[str]:
        """What was sent of the row of this sheet."""
        row = sheet[0].row
        begun, every = self.begun.get(row, 0), self.made.get(row, ())
        if begun and len(every) > 1:
            kind = "copies" if len({piece.part for piece in every}) == 1 else "sheets"
            return [f"{begun} of {len(every)} {kind} of row {row}"]
        if self._in_doubt(sheet[0]):
            job = self.journal.steps[sheet[0]].number
            return [f"row {row} was sent as job {job}" if job else f"whether row {row} was sent is not known"]
        return []

    def cancel(self, device: Device, sheet: Sequence[Piece]) -> None:
        """Cancel the job in flight, if there is one, and note what became of it."""
        step = self.journal.steps.get(sheet[0])
        if step is not None and step.state in ("sending", "sent"):
            outcome = device.cancel(step.job, step.title)
            if outcome.state in ("completed", "failed"):
                note_outcome(self.journal, sheet, outcome)


def _rows(numbers: Sequence[int], whole: Sequence[int]) -> str:
    return f"{'Row' if len(numbers) == 1 else 'Rows'} {ranges(numbers, whole)}"
