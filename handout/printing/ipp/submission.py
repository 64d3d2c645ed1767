"""One page submitted to a printer once, whatever the connection and the printer's own server do meanwhile.

A printer that knows Create-Job and Send-Document gives the job its number before it has the page, so that it can be
asked about it with certainty.  Others are given the page at once (Print-Job) and asked for a job of the page's title.
That there is none says that the page was not taken only where the printer lists older jobs of ours: one that forgets
what is over, or has been switched off, lists none either.

Source: RFC 8011 §4.2.1, §4.2.4, §4.2.6, §4.3.1.  That an older job is remembered longer than a newer one by no printer
is own reasoning.
"""

from __future__ import annotations

from collections.abc import Callable

from handout.errors import PrinterError
from handout.printing.ipp.client import Client, JobReference, Operation, PrinterRefused, Search
from handout.printing.ipp.request import Capabilities
from handout.printing.ipp.status import DOUBTFUL, IppStatus, JobState
from handout.printing.ipp.transport import TransportError
from handout.printing.queue import OutcomeUnknown, Say, Ticket

PAUSES = (0.5, 1.0, 2.0)  # s, before asking what became of a page whose connection broke
_ATTEMPTS = 3  # of a page that is known not to have arrived
_STEPS = frozenset({Operation.CREATE_JOB, Operation.SEND_DOCUMENT})


class Submission:
    """A page on its way to a printer.

    gone : whether a part of the page at least may have left this computer.
    """

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

        Raises
        ------
        OutcomeUnknown
            It may have been taken.
        PrinterError
            It was certainly not.
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
        """The job that has the page; None if the page is not going to be printed.

        What arrived in part is stopped.
        """
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
