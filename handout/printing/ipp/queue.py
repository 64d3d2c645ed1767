"""An IPP printer as a queue: sends pages, follows them until they are printed, and asks about earlier ones.

A page is submitted once, whatever the connection and the printer's own server do meanwhile.  A printer that knows
Create-Job and Send-Document gives the job its number before it has the page, so that it can be asked about it with
certainty.  Others are given the page at once (Print-Job) and asked for a job of the page's title.  That there is none
says that the page was not taken only where the printer lists older jobs of ours: one that forgets what is over, or has
been switched off, lists none either.

Source: RFC 8011 §4.2.1, §4.2.4, §4.2.6, §4.3.1.  That an older job is remembered longer than a newer one by no printer
is own reasoning.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path

from handout.errors import InputError, PrinterError
from handout.printing.documents import MIME
from handout.printing.ipp.client import Client, JobReference, JobStatus, Operation, PrinterRefused, Search
from handout.printing.ipp.request import (
    DOUBTFUL,
    Capabilities,
    IppStatus,
    JobState,
    blocks_output,
    is_jammed,
    reason_phrase,
)
from handout.printing.ipp.transport import TransportError
from handout.printing.queue import Outcome, OutcomeUnknown, Queue, Say, Ticket

PAUSES = (0.5, 1.0, 2.0)  # s, before asking what became of a page whose connection broke
_ATTEMPTS = 3  # of a page that is known not to have arrived
_STEPS = frozenset({Operation.CREATE_JOB, Operation.SEND_DOCUMENT})


class Submission:
    """A page on its way to a printer; gone : whether a part of the page at least may have left this computer."""

    def __init__(
        self, client: Client, capabilities: Capabilities, ticket: Ticket, say: Say, wait: Callable[[float], object]
    ) -> None:
        """`wait` is called with the seconds before a question is asked again."""
        self._client, self._capabilities, self._ticket = client, capabilities, ticket
        self._say, self._wait = say, wait
        self._in_steps = capabilities.operations >= _STEPS
        self._job: JobReference | None = None  # that has been begun
        self.gone = False

    def hand_over(self, document: bytes) -> JobReference:
        """Hand the page over; the job that has it.

        Raises OutcomeUnknown: it may have been taken. PrinterError: it was certainly not.
        """
        backoff, attempts = self._client.backoff(), 0
        while True:
            try:
                self._job, self.gone = None, not self._in_steps
                if not self._in_steps:
                    return self._reference(self._client.print(self._ticket, self._capabilities, document))
                self._job = self._reference(self._client.create(self._ticket, self._capabilities))
                self.gone = True
                self._client.send(self._job.number, self._ticket, document)
                return self._job
            except (TransportError, PrinterRefused) as failure:
                error = _as_doubtful(failure)
            waited = error.retryable and backoff.pause(f"{error} Waiting for it.", error.after)
            job = self._job_if_taken(error)
            if job is not None:
                return job
            attempts += not waited
            if attempts == _ATTEMPTS or (error.retryable and not waited):
                tried = f" in {attempts} attempts" if attempts > 1 else ""
                raise PrinterError(f"{error} The page did not arrive{tried}.") from error
            if not waited:
                self._say(f"{error} The page did not arrive; sending it again.")

    def _reference(self, number: int) -> JobReference:
        """A job that was just made, with when it was made, if the printer tells."""
        job = JobReference(number, self._ticket.title)
        try:
            status = self._client.job(job)
        except PrinterError:
            return job
        return job if status is None else job._replace(created=status.created)

    def _job_if_taken(self, error: TransportError) -> JobReference | None:
        """The job that has the page; None if the page is not going to be printed. What arrived in part is stopped."""
        search = self._search(error)
        job = search.job
        if job is None and self._job is not None:
            job = self._client.job(self._job)  # a printer may keep the names of jobs to itself
        if job is None:
            refused = error.retryable and not self._in_steps
            if not self.gone or not error.handed_over or refused or self._remembers_jobs(search):
                return None
            raise OutcomeUnknown(
                f"{error} Whether the page arrived cannot be told: the printer lists no job of its name, and none of "
                "earlier pages either."
            ) from error
        if job.state in (JobState.CANCELED, JobState.ABORTED):
            return None
        if self.gone and error.handed_over and not job.lacking:
            return job.reference
        ended = self._client.cancel_and_wait(job.reference)
        return job.reference if ended is not None and ended.state == JobState.COMPLETED else None

    def _search(self, error: TransportError) -> Search:
        for pause in PAUSES:
            self._wait(pause)
            try:
                return self._client.find(self._ticket.title)
            except TransportError as silence:
                if silence.retryable:
                    break
            except PrinterError:
                continue
        if not (self.gone and error.handed_over):
            raise PrinterError(f"{error} The page did not arrive whole, so it is not going to be printed.") from error
        raise OutcomeUnknown(f"{error} Whether the page arrived cannot be told.") from error

    def _remembers_jobs(self, search: Search) -> bool:
        """Whether the printer lists finished jobs of ours by their names."""
        ours = self._ticket.title.split()[0]
        return any(name.split()[:1] == [ours] for name in search.over)


def _as_doubtful(failure: TransportError | PrinterRefused) -> TransportError:
    """A failure after which the page may have been taken; one after which it certainly was not is raised again."""
    if isinstance(failure, TransportError):
        return failure
    if failure.code not in DOUBTFUL:
        raise failure
    return TransportError(str(failure), handed_over=True, retryable=failure.code == IppStatus.TEMPORARY_ERROR)


# s, set by eye: between questions about a job, and how long an unreachable printer is asked again
_POLL, _SLOWEST_POLL, _PATIENCE = 0.25, 2.0, 60.0
_SLOWER = 1.5  # each pause to the one before
_FORMATS = ("pdf", "pwg", "urf")  # in the order of preference


class IppQueue(Queue):
    """An IPP printer as a queue."""

    def __init__(
        self,
        client: Client,
        say: Say = lambda message: None,
        wait: Callable[[float], object] = time.sleep,
        format: str = "",
    ) -> None:
        """Ask the printer what it can do; `format` is one that the user insists on.

        Raises PrinterError: it cannot be reached, accepts no jobs, or prints none of the formats that can be made.
        """
        self._client, self._say, self._wait = client, say, wait
        self._submission: Submission | None = None
        self.name = client.uri
        self._capabilities = client.capabilities()
        formats = self._capabilities.formats
        able = [name for name in _FORMATS if MIME[name] in formats or (name == "pdf" and not formats)]
        if format and format not in able:
            raise InputError(f"format: {self.name} prints no {format}; it prints {', '.join(able) or 'none of ours'}.")
        if not able:
            raise PrinterError(f"{self.name} prints neither PDF nor PWG Raster nor URF, only {', '.join(formats)}.")
        self.format = format or able[0]
        accepting = self._capabilities.message.find_all("printer-is-accepting-jobs")
        if accepting and not accepting[0].value:
            why = reason_phrase(self._capabilities.reasons)
            raise PrinterError(f"{self.name} accepts no jobs at present{': ' if why else ''}{why}.")

    def resolution(self, wanted: int) -> int:
        """For PDF the profile's; for raster one that the printer takes."""
        if self.format == "pwg":
            return self._capabilities.raster_dpi(wanted)
        return self._capabilities.urf_dpi(wanted) if self.format == "urf" else wanted

    def check(self, ticket: Ticket) -> None:
        """Ask the printer whether it takes such a sheet from such a tray, and say what it complains of now."""
        self._client.validate(self._request(ticket), self._capabilities)
        complaint = reason_phrase(self._capabilities.reasons)
        if complaint:
            self._say(f"{self.name} says: {complaint}.")

    def send(self, page: Path, ticket: Ticket) -> str:
        """Print one page, once: where the way to the printer fails, it is asked before the page is sent again."""
        self._submission = Submission(self._client, self._capabilities, self._request(ticket), self._say, self._wait)
        return str(self._submission.hand_over(page.read_bytes()))

    def follow(self, job: str, title: str) -> Outcome:
        """Wait until a job is over or held, saying what keeps the printer from it.

        Raises OutcomeUnknown: the printer has not answered for a minute, or could not for ten.
        """
        complaint, silence, pause = "", 0.0, _POLL
        wanted = JobReference.from_text(job, title)
        while True:
            try:
                status = self._client.job(wanted)
                if status is None or status.state.is_over:
                    return outcome_of(self._client, status)
                # a job may also be held until the sheet that it asks for has been put in: that is waited for
                unfed = status.lacking or "resources-are-not-ready" in status.reasons
                if status.state == JobState.HELD and not unfed:
                    return outcome_of(self._client, status)
                latest, silence = self._complaint(status), 0.0
            except PrinterError as error:
                if silence >= _PATIENCE or (isinstance(error, TransportError) and error.retryable):
                    raise OutcomeUnknown(f"{error} What became of job {wanted.number} cannot be told.") from error
                if not silence:
                    self._say(f"{error} Asking again for a minute.")
                silence += pause
                latest = complaint
            if latest and latest != complaint:
                self._say(f"Job {wanted.number} waits: {latest}.")
            complaint = latest
            self._wait(pause)
            pause = min(pause * _SLOWER, _SLOWEST_POLL)

    def outcome(self, job: str, title: str, earlier: Collection[str] = ()) -> Outcome:
        """Ask about an earlier job."""
        return earlier_outcome(self._client, job, title, earlier)

    def cancel(self, job: str, title: str) -> Outcome:
        """Stop a job, found by its name if its number is not known, and wait a little until it has stopped."""
        try:
            if not job:
                self._wait(PAUSES[0])  # what had been sent of it may still be on its way
            sought = JobReference.from_text(job, title) if job else None
            status = self._client.job(sought, sure=True) if sought else self._client.find(title).job
            if status is None and not job and not (self._submission and self._submission.gone):
                return Outcome("failed", "it did not arrive")
            if status is not None and not status.state.is_over:
                status = self._client.cancel_and_wait(status.reference)
            return outcome_of(self._client, status)
        except PrinterError as error:
            return Outcome("unknown", str(error).rstrip("."))

    def _complaint(self, status: JobStatus) -> str:
        """What keeps a job from ending; empty while the printer works."""
        blocking = _blocking_phrase(self._client)
        if blocking or status.state == JobState.PROCESSING:
            return blocking
        return reason_phrase([reason for reason in status.reasons if reason != "printer-stopped"])

    def _request(self, ticket: Ticket) -> Ticket:
        """The ticket as IPP has it: the kind of paper belongs to the sheet, and is an option beside it for CUPS."""
        options = dict(ticket.options)
        kind = options.pop("media-type", ticket.type)
        return replace(ticket, format=MIME[self.format], type=kind, options=options)


def earlier_outcome(client: Client, job: str, title: str, earlier: Collection[str]) -> Outcome:
    """Ask about an earlier job by its number, name and time, or by its title where `job` is empty.

    earlier : titles of jobs that were over before this one was begun: a printer that still lists one of them would list
        this one, so that, where it does not, this one never came.
    """
    number = ""
    if job:
        status = client.job(JobReference.from_text(job, title), sure=True)
    else:
        search = client.find(title)
        status = search.job
        if status is None and search.over & set(earlier):
            return Outcome("failed", "it did not arrive")
        number = str(status.reference) if status is not None else ""
    if status is not None and status.lacking:  # whoever was sending the page has gone
        status = client.cancel_and_wait(status.reference)
        if status is None:
            return Outcome("failed", "its page did not arrive whole")
    return replace(outcome_of(client, status), job=number)


def outcome_of(client: Client, status: JobStatus | None) -> Outcome:
    """What a job's status means for the sheet; None for a job that the printer does not know."""
    if status is None:
        return Outcome("unknown", "the printer does not know the job (any longer)")
    why = reason_phrase(status.reasons)
    if status.state in (JobState.CANCELED, JobState.ABORTED):
        phrases = (why or "the printer gave it up", _blocking_phrase(client))
        return Outcome("failed", ", ".join(phrase for phrase in phrases if phrase))
    if status.state != JobState.COMPLETED:
        held = status.state == JobState.HELD
        return Outcome("waiting", (f"it is held at the printer{': ' if why else ''}" if held else "") + why)
    if "job-completed-with-errors" in status.reasons:
        return Outcome("unknown", "the printer says that it is done, but that there were errors")
    if is_jammed(client.capabilities().reasons):
        return Outcome("unknown", "the printer says that it is done, but also that the paper has jammed")
    return Outcome("completed")


def _blocking_phrase(client: Client) -> str:
    """Why the printer cannot be printing now; empty if it can."""
    return reason_phrase([reason for reason in client.capabilities().reasons if blocks_output([reason])])
