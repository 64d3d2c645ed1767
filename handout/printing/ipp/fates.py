"""What became of a job, as far as the printer's word can be taken for it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

from handout.errors import PrinterError
from handout.printing.ipp import words
from handout.printing.ipp.client import Client, JobStatus
from handout.printing.ipp.words import JobState
from handout.printing.queue import Fate

_POLL, _STOPPING = 0.25, 15.0  # s: between questions about a job that is being stopped, and in all


def asked(client: Client, job: str, title: str, earlier: Collection[str], wait: Callable[[float], object]) -> Fate:
    """Ask about an earlier job by its number, or by its title where `job` is empty.

    The title has to agree, because a printer may number anew when it is switched on.

    Parameters
    ----------
    earlier : titles of jobs that were over before this one was begun: a printer that still lists one of them would
        list this one, so that, where it does not, this one never came.
    wait : called with seconds, where a job that lacks its page has to be stopped.
    """
    number = ""
    if job:
        status = client.job(int(job))
        status = status if status is not None and status.name == title else None
    else:
        search = client.find(title)
        status = search.job
        if status is None and search.over & set(earlier):
            return Fate("failed", "it did not arrive")
        number = str(status.number) if status is not None else ""
    if status is not None and status.lacking:  # whoever was sending the page has gone
        status = stopped(client, status, wait)
        if status is None:
            return Fate("failed", "its page did not arrive whole")
    return replace(judged(client, status), job=number)


def stopped(client: Client, job: JobStatus, wait: Callable[[float], object]) -> JobStatus | None:
    """Cancel a job and wait a little until it has ended; its last status, None where the printer forgets it at once.

    Raises
    ------
    PrinterError
        It does not end, or the printer does not answer.
    """
    client.cancel(job.number)
    waited = 0.0
    while waited < _STOPPING:
        status = client.job(job.number)
        if status is None or status.state.over:
            return status
        wait(_POLL)
        waited += _POLL
    raise PrinterError(f"{client.uri} does not stop job {job.number}: cancel it at the printer.")


def judged(client: Client, status: JobStatus | None) -> Fate:
    """What a job's status means for the sheet; None for a job that the printer does not know."""
    if status is None:
        return Fate("unknown", "the printer does not know the job (any longer)")
    why = words.reasons(status.reasons)
    if status.state in (JobState.CANCELED, JobState.ABORTED):
        now = words.reasons([reason for reason in client.abilities().reasons if words.stopping([reason])])
        return Fate("failed", ", ".join(part for part in (why or "the printer gave it up", now) if part))
    if status.state != JobState.COMPLETED:
        held = status.state == JobState.HELD
        return Fate("waiting", (f"it is held at the printer{': ' if why else ''}" if held else "") + why)
    if "job-completed-with-errors" in status.reasons:
        return Fate("unknown", "the printer says that it is done, but that there were errors")
    if words.jammed(client.abilities().reasons):
        return Fate("unknown", "the printer says that it is done, but also that the paper has jammed")
    return Fate("completed")
