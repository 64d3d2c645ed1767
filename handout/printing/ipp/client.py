"""The operations of IPP that printing a page needs: one method each.

Source: RFC 8011 §4 (operations), §5 (attributes); PWG 5100.7 (media-col), PWG 5100.13 (print-scaling).
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from handout.errors import PrinterError
from handout.printing.ipp import words
from handout.printing.ipp.link import Link, LinkError
from handout.printing.ipp.message import Attribute, Group, Message, Tag, Value, attribute, decode, encode
from handout.printing.ipp.patience import Patience
from handout.printing.ipp.request import Abilities, Request, job_attributes
from handout.printing.ipp.words import JobState, Status

_USER = "handout"  # nobody's name is told to the printer; the same one every time, so that a job may be cancelled
_OF_JOBS = ("job-id", "job-name", "job-state", "job-state-reasons")

Say = Callable[[str], object]


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
_TAKING = (Operation.PRINT_JOB, Operation.SEND_DOCUMENT)


class Refused(PrinterError):
    """The printer answered that it will not do it; `code` is its status."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True)
class JobStatus:
    """A job as the printer tells of it: its number there, name, state, and the reasons for the state."""

    number: int
    name: str
    state: JobState
    reasons: tuple[str, ...]

    @property
    def lacking(self) -> bool:
        """Whether it still waits for its page, or for the rest of it."""
        return not self.state.over and bool({"job-incoming", "job-data-insufficient"} & set(self.reasons))


@dataclass(frozen=True)
class Search:
    """What a printer lists of the jobs of one name.

    job : the newest of them, None if there is none; over : names of all finished jobs that it lists.
    """

    job: JobStatus | None
    over: frozenset[str] = frozenset()


class Client:
    """One printer, asked and told."""

    def __init__(
        self,
        link: Link,
        say: Say = lambda message: None,
        wait: Callable[[float], object] = time.sleep,
        user: str = _USER,
    ) -> None:
        """`say` is told when the printer has to be waited for; `wait` is called with the seconds."""
        self._link, self._say, self._wait, self._user = link, say, wait, user
        self._numbers = itertools.count(1)
        self._version = (2, 0)

    @property
    def uri(self) -> str:
        """The printer's address."""
        return self._link.where.uri

    def abilities(self) -> Abilities:
        """What the printer can do, and how it is (Get-Printer-Attributes).

        Raises
        ------
        PrinterError
            It cannot be reached or refuses.
        """
        wanted = attribute("requested-attributes", Tag.KEYWORD, "all")
        return Abilities(self._ask(Operation.GET_PRINTER_ATTRIBUTES, (wanted,)))

    def validate(self, request: Request, abilities: Abilities) -> None:
        """Ask whether the printer would take such a page (Validate-Job); nothing is printed.

        Raises
        ------
        Refused
            It would not; the message says what it does not do.
        """
        if Operation.VALIDATE_JOB not in abilities.operations:
            return
        self._ask(Operation.VALIDATE_JOB, _about(request), job_attributes(request, abilities))

    def print(self, request: Request, abilities: Abilities, document: bytes) -> int:
        """Print a document (Print-Job); the number of the job.

        Raises
        ------
        Refused
            The printer does not take it: nothing is printed, unless the status is one of `words.DOUBTFUL`.
        LinkError
            The connection broke, or what answers HTTP has failed: what became of the page is not known.
        """
        job = job_attributes(request, abilities)
        return self._taken(self._ask(Operation.PRINT_JOB, _about(request), job, document))

    def create(self, request: Request, abilities: Abilities) -> int:
        """Begin a job (Create-Job), which prints nothing before it has its document; its number."""
        about = tuple(one for one in _about(request) if one.name != "document-format")
        return self._taken(self._ask(Operation.CREATE_JOB, about, job_attributes(request, abilities)))

    def send(self, number: int, request: Request, document: bytes) -> None:
        """Give a job that has been begun its only document (Send-Document); raises as `print` does."""
        about = (
            _number(number),
            attribute("document-format", Tag.MIME_TYPE, request.format),
            attribute("last-document", Tag.BOOLEAN, True),
        )
        self._ask(Operation.SEND_DOCUMENT, about, document=document)

    def patience(self) -> Patience:
        """For whoever has to wait for the printer between two requests."""
        return Patience(self._wait, self._say)

    def _taken(self, answer: Message) -> int:
        number = answer.all("job-id", Tag.JOB)
        if not number or not isinstance(number[0].value, int):
            raise LinkError(f"{self.uri} took a page without giving its job a number.", handed_over=True)
        return number[0].value

    def job(self, number: int) -> JobStatus | None:
        """What became of a job (Get-Job-Attributes); None where the printer does not know it (any longer)."""
        wanted = attribute("requested-attributes", Tag.KEYWORD, *_OF_JOBS)
        try:
            answer = self._ask(Operation.GET_JOB_ATTRIBUTES, (_number(number), wanted))
        except Refused as error:
            if error.code in (Status.NOT_FOUND, Status.GONE):
                return None
            raise
        return next(iter(_jobs(answer)), None)

    def find(self, name: str) -> Search:
        """The newest job of that name (Get-Jobs), among those that wait and those that are over.

        Raises
        ------
        PrinterError
            The printer does not tell.
        """
        found: list[JobStatus] = []
        over: frozenset[str] = frozenset()
        for which in ("not-completed", "completed"):
            asked = (
                attribute("requested-attributes", Tag.KEYWORD, *_OF_JOBS),
                attribute("which-jobs", Tag.KEYWORD, which),
            )
            listed = _jobs(self._ask(Operation.GET_JOBS, asked))
            found += [job for job in listed if job.name == name]
            over = frozenset(job.name for job in listed if job.name != name)
        return Search(max(found, key=lambda job: job.number, default=None), over)

    def cancel(self, number: int) -> None:
        """Stop a job (Cancel-Job); one that is over already stays as it is."""
        try:
            self._ask(Operation.CANCEL_JOB, (_number(number),))
        except Refused as error:
            if error.code not in (Status.NOT_POSSIBLE, Status.NOT_FOUND):
                raise

    def _ask(
        self, operation: Operation, about: tuple[Attribute, ...], job: tuple[Attribute, ...] = (), document: bytes = b""
    ) -> Message:
        """One operation, again and again while the printer says that it cannot answer now."""
        patience = self.patience()
        while True:
            try:
                answer = self._once(operation, about, job, document)
            except LinkError as error:
                if error.passing and operation not in _TAKING and patience.pause(f"{error} Waiting.", error.after):
                    continue
                raise
            passing = answer.code in words.PASSING and (operation not in _TAKING or answer.code not in words.DOUBTFUL)
            if answer.code == Status.VERSION_NOT_SUPPORTED and self._version > (1, 1):
                self._version = (1, 1)
            elif not (passing and patience.pause(f"{self.uri} {_busy(answer.code)}; waiting for it.")):
                break
        if answer.code >= 0x0100:
            raise Refused(f"{self.uri} refused: {_why(answer)}.", answer.code)
        return answer

    def _once(
        self, operation: Operation, about: tuple[Attribute, ...], job: tuple[Attribute, ...], document: bytes
    ) -> Message:
        head = (
            attribute("attributes-charset", Tag.CHARSET, "utf-8"),
            attribute("attributes-natural-language", Tag.LANGUAGE, "en"),
            attribute("printer-uri", Tag.URI, self.uri),
            # RFC 8011 §4.1.5: the number of a job follows the printer's address at once
            *(one for one in about if one.name == "job-id"),
            attribute("requesting-user-name", Tag.NAME, self._user),
            *(one for one in about if one.name != "job-id"),
        )
        groups = (Group(Tag.OPERATION, head), *([Group(Tag.JOB, job)] if job else []))
        request = next(self._numbers)
        data = self._link.post(encode(Message(operation, groups, request, self._version)), document)
        try:
            answer, _ = decode(data)
        except PrinterError as error:
            raise LinkError(f"{self.uri} answers what is no IPP. {error}", handed_over=True) from error
        if answer.request != request:
            raise LinkError(f"{self.uri} answered another question than was asked.", handed_over=True)
        return answer


def _busy(code: int) -> str:
    return words.status(code).removeprefix("it ")


def _about(request: Request) -> tuple[Attribute, ...]:
    """What an operation is told of a document and of its job."""
    return (
        attribute("job-name", Tag.NAME, request.title),
        attribute("document-format", Tag.MIME_TYPE, request.format),
        # without this a printer may take another sheet than was asked for, and say so only afterwards
        attribute("ipp-attribute-fidelity", Tag.BOOLEAN, True),
    )


def _number(job: int) -> Attribute:
    return attribute("job-id", Tag.INTEGER, job)


def _jobs(answer: Message) -> list[JobStatus]:
    found = []
    for group in answer.groups:
        if group.tag == Tag.JOB:
            one = Message(0, (group,))
            number, state = _int(one.all("job-id")), _int(one.all("job-state"))
            reasons = tuple(str(value.value) for value in one.all("job-state-reasons"))
            known = JobState(state) if state in set(JobState) else JobState.PENDING
            found.append(JobStatus(number, text(one.all("job-name")), known, reasons))
    return found


def _int(values: tuple[Value, ...]) -> int:
    return values[0].value if values and isinstance(values[0].value, int) else 0


def text(values: tuple[Value, ...]) -> str:
    """The first of some values as text; a text with a language (RFC 8010 §3.9) without its language."""
    if not values:
        return ""
    held = values[0].value
    if isinstance(held, bytes) and values[0].tag in (Tag.NAME_WITH_LANGUAGE, Tag.TEXT_WITH_LANGUAGE):
        skipped = 2 + int.from_bytes(held[:2], "big") + 2
        return held[skipped:].decode("utf-8", "replace")
    return str(held)


def _why(answer: Message) -> str:
    """The status in words, what exactly was not supported, and the printer's own sentence."""
    said = [words.status(answer.code)]
    names = [one.name for group in answer.groups if group.tag == Tag.UNSUPPORTED_GROUP for one in group.attributes]
    if names:
        said.append(f"it does not support what was asked for as {', '.join(names)}")
    own = text(answer.all("status-message", Tag.OPERATION)).strip().rstrip(".")
    if own and not own.startswith("successful"):
        said.append(f"in its words: {own}")
    return "; ".join(said)
