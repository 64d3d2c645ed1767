"""The operations of IPP that printing a page needs: one method each.

Source: RFC 8011 §4 (operations), §5 (attributes); PWG 5100.7 (media-col), PWG 5100.13 (print-scaling).
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from handout.errors import PrinterError
from handout.printing.ipp.message import (
    Attribute,
    AttributeGroup,
    Message,
    MessageTag,
    Value,
    attribute,
    decode,
    encode,
)
from handout.printing.ipp.request import (
    DOUBTFUL,
    RETRYABLE,
    Capabilities,
    IppStatus,
    JobState,
    job_attributes,
    name_sheets,
    phrase,
)
from handout.printing.ipp.transport import Transport, TransportError
from handout.printing.queue import Ticket

_USER = "handout"  # nobody's name is told to the printer; the same one every time, so that a job may be cancelled
_JOB_ATTRIBUTES = ("job-id", "job-name", "job-state", "job-state-reasons", "time-at-creation")

Say = Callable[[str], object]


# s, set by eye: the first pause (each is twice as long as the one before), the longest, and how long in all
_FIRST, _LONGEST, _BOUND = 0.5, 10.0, 600.0
_POLL, _STOPPING = 0.25, 15.0  # s, set by eye: between questions about a job that is being stopped, and in all


class Operation(IntEnum):
    """The operations that are used."""

    PRINT_JOB = 0x0002
    VALIDATE_JOB = 0x0004
    CREATE_JOB = 0x0005
    SEND_DOCUMENT = 0x0006
    CANCEL_JOB = 0x0008
    GET_JOB_ATTRIBUTES = 0x0009
    GET_JOBS = 0x000A
    GET_PRINTER_ATTRIBUTES = 0x000B


# a page goes with these only once: whether it was taken has to be found out before it goes again
_PAGE_OPERATIONS = (Operation.PRINT_JOB, Operation.SEND_DOCUMENT)


class Backoff:
    """Pauses between attempts at a printer that cannot answer now, ever longer, up to a bound."""

    def __init__(self, wait: Callable[[float], object], say: Callable[[str], object]) -> None:
        """`wait` is called with seconds; `say` is told once that there is something to wait for."""
        self._wait, self._say = wait, say
        self._pause, self._waited = _FIRST, 0.0

    def pause(self, why: str, after: float | None = None) -> bool:
        """Wait before the next attempt; False, and no waiting, where the bound has been or would be passed.

        why : what is said the first time, a sentence.
        after : s that the printer asks for; otherwise ever longer pauses.
        """
        seconds = self._pause if after is None else max(after, _FIRST)
        if self._waited >= _BOUND or (after is not None and self._waited + after > _BOUND):
            return False
        if not self._waited:
            self._say(why)
        self._wait(seconds)
        self._waited += seconds
        if after is None:
            self._pause = min(2 * self._pause, _LONGEST)
        return True


class PrinterRefused(PrinterError):
    """The printer answered that it will not do it; `code` is its status."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class JobReference(NamedTuple):
    """What tells a job from all others: number, name, and when it was made, s of the printer's up-time, 0: not known.

    A number alone does not: a printer that is switched off and on hands its numbers out anew, and to others too.
    """

    number: int
    name: str
    created: int = 0

    @classmethod
    def from_text(cls, job: str, name: str) -> JobReference:
        """A job as a journal has it: ``"17@3600"``, or ``"17"`` where the printer does not tell when."""
        number, _, created = job.partition("@")
        return cls(int(number), name, int(created or 0))

    def __str__(self) -> str:
        return f"{self.number}@{self.created}" if self.created else str(self.number)


@dataclass(frozen=True)
class JobStatus:
    """A job as the printer tells of it: number, name, state, the reasons for that, and when it was made (`created`)."""

    number: int
    name: str
    state: JobState
    reasons: tuple[str, ...]
    created: int = 0

    @property
    def reference(self) -> JobReference:
        """It, told from all others."""
        return JobReference(self.number, self.name, self.created)

    def is_of(self, job: JobReference, sure: bool) -> bool:
        """Whether this is that job; `sure` : what the printer keeps to itself does not count for it."""
        told = self.created > 0 and job.created > 0
        if self.name not in ("", job.name) or (told and self.created != job.created):
            return False
        return bool(self.name) or told or not sure

    @property
    def lacking(self) -> bool:
        """Whether it still waits for its page, or for the rest of it."""
        return not self.state.is_over and bool({"job-incoming", "job-data-insufficient"} & set(self.reasons))


@dataclass(frozen=True)
class Search:
    """What a printer lists of the jobs of one name.

    job : the newest of them, None if there is none; over : names of all finished jobs that it lists.
    """

    job: JobStatus | None
    over: frozenset[str] = frozenset()


class Client:
    """The operations of one printer."""

    def __init__(
        self,
        transport: Transport,
        say: Say = lambda message: None,
        wait: Callable[[float], object] = time.sleep,
        user: str = _USER,
    ) -> None:
        """`say` is told when the printer has to be waited for; `wait` is called with the seconds."""
        self._transport, self._say, self._wait, self._user = transport, say, wait, user
        self._numbers = itertools.count(1)
        self._version = (2, 0)

    @property
    def uri(self) -> str:
        """The printer's address."""
        return self._transport.address.uri

    def capabilities(self) -> Capabilities:
        """What the printer can do, and how it is (Get-Printer-Attributes).

        Raises PrinterError: it cannot be reached or refuses.
        """
        wanted = attribute("requested-attributes", MessageTag.KEYWORD, "all")
        return Capabilities(self._ask(Operation.GET_PRINTER_ATTRIBUTES, (wanted,)))

    def validate(self, ticket: Ticket, capabilities: Capabilities) -> None:
        """Ask whether the printer would take such a page (Validate-Job); nothing is printed.

        Raises PrinterRefused: it would not; the message says what it does not do, and which sheets it has.
        """
        if Operation.VALIDATE_JOB not in capabilities.operations:
            return
        try:
            self._ask(Operation.VALIDATE_JOB, _describe_document(ticket), job_attributes(ticket, capabilities))
        except PrinterRefused as error:
            if "media" not in str(error):
                raise
            raise PrinterRefused(f"{error} {name_sheets(ticket, capabilities)}".strip(), error.code) from error

    def print(self, ticket: Ticket, capabilities: Capabilities, document: bytes) -> int:
        """Print a document (Print-Job); the number of the job.

        Raises PrinterRefused: the printer does not take it: nothing is printed, unless the status is one of `DOUBTFUL`.
        TransportError: the connection broke, or what answers HTTP has failed: what became of the page is not known.
        """
        job = job_attributes(ticket, capabilities)
        return self._job_number(self._ask(Operation.PRINT_JOB, _describe_document(ticket), job, document))

    def create(self, ticket: Ticket, capabilities: Capabilities) -> int:
        """Begin a job (Create-Job), which prints nothing before it has its document; its number."""
        about = tuple(entry for entry in _describe_document(ticket) if entry.name != "document-format")
        return self._job_number(self._ask(Operation.CREATE_JOB, about, job_attributes(ticket, capabilities)))

    def send(self, number: int, ticket: Ticket, document: bytes) -> None:
        """Give a job that has been begun its only document (Send-Document); raises as `print` does."""
        about = (
            _number(number),
            attribute("document-format", MessageTag.MIME_TYPE, ticket.format),
            attribute("last-document", MessageTag.BOOLEAN, True),
        )
        self._ask(Operation.SEND_DOCUMENT, about, document=document)

    def backoff(self) -> Backoff:
        """New pauses for waiting between two requests."""
        return Backoff(self._wait, self._say)

    def _job_number(self, answer: Message) -> int:
        number = answer.find_all("job-id", MessageTag.JOB)
        if not number or not isinstance(number[0].value, int):
            raise TransportError(f"{self.uri} took a page without giving its job a number.", handed_over=True)
        return number[0].value

    def job(self, job: JobReference, sure: bool = False) -> JobStatus | None:
        """What became of a job (Get-Job-Attributes); None where the printer does not know it (any longer).

        sure : whether it has to be told by its name or time that it is this one, not only nothing else.
        """
        wanted = attribute("requested-attributes", MessageTag.KEYWORD, *_JOB_ATTRIBUTES)
        try:
            answer = self._ask(Operation.GET_JOB_ATTRIBUTES, (_number(job.number), wanted))
        except PrinterRefused as error:
            if error.code in (IppStatus.NOT_FOUND, IppStatus.GONE):
                return None
            raise
        return next((status for status in _jobs(answer) if status.is_of(job, sure)), None)

    def find(self, name: str) -> Search:
        """The newest job of that name (Get-Jobs), among those that wait and those that are over.

        Raises PrinterError: the printer does not tell.
        """
        named: list[JobStatus] = []
        over: frozenset[str] = frozenset()
        for which in ("not-completed", "completed"):
            asked = (
                attribute("requested-attributes", MessageTag.KEYWORD, *_JOB_ATTRIBUTES),
                attribute("which-jobs", MessageTag.KEYWORD, which),
            )
            listed = _jobs(self._ask(Operation.GET_JOBS, asked))
            named += [job for job in listed if job.name == name]
            over = frozenset(job.name for job in listed if job.name != name)
        return Search(max(named, key=lambda job: job.number, default=None), over)

    def cancel(self, number: int) -> None:
        """Stop a job (Cancel-Job); one that is over already stays as it is."""
        try:
            self._ask(Operation.CANCEL_JOB, (_number(number),))
        except PrinterRefused as error:
            if error.code not in (IppStatus.NOT_POSSIBLE, IppStatus.NOT_FOUND):
                raise

    def cancel_and_wait(self, job: JobReference) -> JobStatus | None:
        """Cancel a job that is there and wait until it has ended; its last status, None where the printer forgets it.

        Raises PrinterError: it does not end, or the printer does not answer.
        """
        self.cancel(job.number)
        waited = 0.0
        while waited < _STOPPING:
            status = self.job(job)
            if status is None or status.state.is_over:
                return status
            self._wait(_POLL)
            waited += _POLL
        raise PrinterError(f"{self.uri} does not stop job {job.number}: cancel it at the printer.")

    def _ask(
        self, operation: Operation, about: tuple[Attribute, ...], job: tuple[Attribute, ...] = (), document: bytes = b""
    ) -> Message:
        """One operation, repeated while the printer says that it cannot answer now."""
        backoff = self.backoff()
        while True:
            try:
                answer = self._request(operation, about, job, document)
            except TransportError as error:
                if (
                    error.retryable
                    and operation not in _PAGE_OPERATIONS
                    and backoff.pause(f"{error} Waiting.", error.after)
                ):
                    continue
                raise
            retryable = answer.code in RETRYABLE and (operation not in _PAGE_OPERATIONS or answer.code not in DOUBTFUL)
            if answer.code == IppStatus.VERSION_NOT_SUPPORTED and self._version > (1, 1):
                self._version = (1, 1)
            elif not (
                retryable and backoff.pause(f"{self.uri} {phrase(answer.code).removeprefix('it ')}; waiting for it.")
            ):
                break
        if answer.code >= 0x0100:
            raise PrinterRefused(f"{self.uri} refused: {_explain_refusal(answer)}.", answer.code)
        return answer

    def _request(
        self, operation: Operation, about: tuple[Attribute, ...], job: tuple[Attribute, ...], document: bytes
    ) -> Message:
        head = (
            attribute("attributes-charset", MessageTag.CHARSET, "utf-8"),
            attribute("attributes-natural-language", MessageTag.LANGUAGE, "en"),
            attribute("printer-uri", MessageTag.URI, self.uri),
            # RFC 8011 §4.1.5: the number of a job follows the printer's address at once
            *(entry for entry in about if entry.name == "job-id"),
            attribute("requesting-user-name", MessageTag.NAME, self._user),
            *(entry for entry in about if entry.name != "job-id"),
        )
        groups = (AttributeGroup(MessageTag.OPERATION, head), *([AttributeGroup(MessageTag.JOB, job)] if job else []))
        request = next(self._numbers)
        data = self._transport.post(encode(Message(operation, groups, request, self._version)), document)
        try:
            answer, _ = decode(data)
        except PrinterError as error:
            raise TransportError(f"{self.uri} answers what is no IPP. {error}", handed_over=True) from error
        if answer.request != request:
            raise TransportError(f"{self.uri} answered another question than was asked.", handed_over=True)
        return answer


def _describe_document(ticket: Ticket) -> tuple[Attribute, ...]:
    """The attributes of a document and of its job."""
    return (
        attribute("job-name", MessageTag.NAME, ticket.title),
        attribute("document-format", MessageTag.MIME_TYPE, ticket.format),
        # without this a printer may take another sheet than was asked for, and say so only afterwards
        attribute("ipp-attribute-fidelity", MessageTag.BOOLEAN, True),
    )


def _number(job: int) -> Attribute:
    return attribute("job-id", MessageTag.INTEGER, job)


def _jobs(answer: Message) -> list[JobStatus]:
    jobs = []
    for group in answer.groups:
        if group.tag == MessageTag.JOB:
            job = Message(0, (group,))
            code = _int(job.find_all("job-state"))
            state = JobState(code) if code in set(JobState) else JobState.PENDING
            reasons = tuple(str(value.value) for value in job.find_all("job-state-reasons"))
            # RFC 8011 §5.3.14: none of before it was switched on
            created = max(_int(job.find_all("time-at-creation")), 0)
            number, name = _int(job.find_all("job-id")), text(job.find_all("job-name"))
            jobs.append(JobStatus(number, name, state, reasons, created))
    return jobs


def _int(values: tuple[Value, ...]) -> int:
    return values[0].value if values and isinstance(values[0].value, int) else 0


def text(values: tuple[Value, ...]) -> str:
    """The first of some values as text; a text with a language (RFC 8010 §3.9) without its language."""
    if not values:
        return ""
    value = values[0].value
    if isinstance(value, bytes) and values[0].tag in (MessageTag.NAME_WITH_LANGUAGE, MessageTag.TEXT_WITH_LANGUAGE):
        start = 2 + int.from_bytes(value[:2], "big") + 2
        return value[start:].decode("utf-8", "replace")
    return str(value)


def _explain_refusal(answer: Message) -> str:
    """The status in words, what exactly was not supported, and the printer's own sentence."""
    reasons = [phrase(answer.code)]
    names = [
        entry.name for group in answer.groups if group.tag == MessageTag.UNSUPPORTED_GROUP for entry in group.attributes
    ]
    if names:
        reasons.append(f"it does not support what was asked for as {', '.join(names)}")
    message = text(answer.find_all("status-message", MessageTag.OPERATION)).strip().rstrip(".")
    if message and not message.startswith("successful"):
        reasons.append(f"in its words: {message}")
    return "; ".join(reasons)
