"""What became of a job, as far as the printer's word can be taken for it."""

from __future__ import annotations

from dataclasses import replace

from handout.printing.ipp import words
from handout.printing.ipp.client import Client, JobStatus
from handout.printing.ipp.words import JobState
from handout.printing.queue import Fate


def asked(client: Client, job: str, title: str) -> Fate:
    """Ask about an earlier job by its number, or by its title where `job` is empty.

    The title has to agree, because a printer may number anew when it is switched on.
    """
    if not job:
        status = client.find(title)
        return replace(judged(client, status), job=str(status.number) if status is not None else "")
    status = client.job(int(job))
    return judged(client, status if status is not None and status.name == title else None)


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
