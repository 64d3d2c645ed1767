"""A printer that is spoken to directly: pages sent, followed until they are out, and asked about later."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from handout.errors import InputError, PrinterError
from handout.printing.formats import MIME
from handout.printing.ipp import words
from handout.printing.ipp.client import Client, JobStatus
from handout.printing.ipp.fates import asked, judged
from handout.printing.ipp.link import LinkError
from handout.printing.ipp.request import Request
from handout.printing.ipp.words import JobState
from handout.printing.queue import Fate, FateUnknown, Say, Ticket

# seconds: between questions about a job, how long an unreachable printer is asked again, and a cancelled job awaited
_POLL, _SLOWEST_POLL, _PATIENCE, _CANCELLING = 0.25, 2.0, 60.0, 15.0
_LOST = (0.5, 1.0, 2.0)  # pauses before asking what became of a page whose connection broke
_ATTEMPTS = 3  # of a page that is known not to have arrived
_FORMATS = ("pdf", "pwg", "urf")  # in the order of preference


class IppQueue:
    """An IPP printer as a queue."""

    keeps = False

    def __init__(
        self,
        client: Client,
        say: Say = lambda message: None,
        wait: Callable[[float], object] = time.sleep,
        format: str = "",
    ) -> None:
        """Ask the printer what it can do; `format` is one that the user insists on.

        Raises
        ------
        PrinterError
            It cannot be reached, accepts no jobs, or prints none of the formats that can be made.
        """
        self._client, self._say, self._wait = client, say, wait
        self.name = client.uri
        self._abilities = client.abilities()
        self.format = self._choose(format)
        accepting = self._abilities.message.all("printer-is-accepting-jobs")
        if accepting and not accepting[0].value:
            raise PrinterError(f"{self.name} accepts no jobs at present{_because(self._abilities.reasons)}.")

    def _choose(self, wanted: str) -> str:
        known = self._abilities.formats
        able = [name for name in _FORMATS if MIME[name] in known or (name == "pdf" and not known)]
        if wanted and wanted not in able:
            raise InputError(f"format: {self.name} prints no {wanted}; it prints {', '.join(able) or 'none of ours'}.")
        if not able:
            raise PrinterError(f"{self.name} prints neither PDF nor PWG Raster nor URF, only {', '.join(known)}.")
        return wanted or able[0]

    def resolution(self, wanted: int) -> int:
        """For PDF the profile's; for raster one that the printer takes."""
        if self.format == "pwg":
            return self._abilities.raster_dpi(wanted)
        return self._abilities.urf_dpi(wanted) if self.format == "urf" else wanted

    def check(self, ticket: Ticket) -> None:
        """Ask the printer whether it takes such a sheet from such a tray, and say what it complains of now."""
        self._client.validate(self._request(ticket), self._abilities)
        complaint = words.reasons(self._abilities.reasons)
        if complaint:
            self._say(f"{self.name} says: {complaint}.")

    def send(self, page: Path, ticket: Ticket) -> str:
        """Print one page; one that the printer has not received whole is sent again, twice at the most."""
        document = page.read_bytes()
        for attempt in range(1, _ATTEMPTS + 1):
            try:
                return str(self._client.print(self._request(ticket), self._abilities, document))
            except LinkError as error:
                found = self._after_a_break(ticket.title, error)
                if found is not None:
                    return str(found)
                if attempt == _ATTEMPTS:
                    raise PrinterError(f"{error} The page did not arrive in {attempt} attempts.") from error
                self._say(f"{error} The page did not arrive; sending it again.")
        raise AssertionError("unreachable")

    def _after_a_break(self, title: str, error: LinkError) -> int | None:
        """The number of the job that a broken connection has left behind; None if the page is not going to be printed.

        What arrived in part is stopped.
        """
        job, answered = None, False
        for pause in _LOST:
            self._wait(pause)
            try:
                job, answered = self._client.find(title), True
                break
            except PrinterError:
                continue
        if not answered:
            if not error.handed_over:
                raise PrinterError(f"{error} The page did not arrive whole, so it is not going to be printed.")
            raise FateUnknown(f"{error} Whether the page arrived cannot be told.") from error
        if job is None or job.state in (JobState.CANCELED, JobState.ABORTED):
            return None
        if error.handed_over:
            return job.number
        self._client.cancel(job.number)
        return None

    def follow(self, job: str) -> Fate:
        """Wait until a job is over or held, saying what keeps the printer from it.

        Raises
        ------
        FateUnknown
            The printer has not answered for a minute.
        """
        said, silent, pause = "", 0.0, _POLL
        while True:
            try:
                status = self._client.job(int(job))
                complaint = self._complaint(status)
                silent = 0.0
            except LinkError as error:
                if silent >= _PATIENCE:
                    raise FateUnknown(f"{error} What became of job {job} cannot be told.") from error
                if not silent:
                    self._say(f"{error} Asking again for a minute.")
                silent += pause
                status, complaint = None, said
            else:
                if status is None or status.state.over or _held(status):
                    return judged(self._client, status)
            if complaint != said and complaint:
                self._say(f"Job {job} waits: {complaint}.")
            said = complaint
            self._wait(pause)
            pause = min(pause * 1.5, _SLOWEST_POLL)

    def fate(self, job: str, title: str) -> Fate:
        """Ask about an earlier job."""
        return asked(self._client, job, title)

    def cancel(self, job: str, title: str) -> Fate:
        """Stop a job, found by its name if its number is not known, and wait a little until it has stopped."""
        try:
            if not job:
                self._wait(_LOST[0])  # what had been sent of it may still be on its way
            status = self._client.job(int(job)) if job else self._client.find(title)
            if status is None and not job:
                return Fate("failed", "it did not arrive")
            if status is None or status.state.over:
                return judged(self._client, status)
            self._client.cancel(status.number)
            waited = 0.0
            while waited < _CANCELLING and status is not None and not status.state.over:
                self._wait(_POLL)
                waited += _POLL
                status = self._client.job(status.number)
            return judged(self._client, status)
        except PrinterError as error:
            return Fate("unknown", str(error).rstrip("."))

    def _complaint(self, status: JobStatus | None) -> str:
        """What stands between a job and its end; empty while the printer is at work."""
        if status is None or status.state.over:
            return ""
        own = words.reasons([reason for reason in self._client.abilities().reasons if words.stopping([reason])])
        if own or status.state == JobState.PROCESSING:
            return own
        return words.reasons([reason for reason in status.reasons if reason != "printer-stopped"])

    def _request(self, ticket: Ticket) -> Request:
        # the kind of paper belongs to the sheet in IPP, and is an option beside it for a CUPS queue
        options = dict(ticket.options)
        kind = options.pop("media-type", ticket.type)
        sheet, format = ticket.sheet, MIME[self.format]
        size = (sheet.width, sheet.height)
        return Request(ticket.title, format, *size, ticket.source, ticket.media, kind, options=options)


def _held(status: JobStatus) -> bool:
    # a printer may also hold a job until the sheet it asks for has been put in: that is waited for
    return status.state == JobState.HELD and "resources-are-not-ready" not in status.reasons


def _because(reasons: tuple[str, ...]) -> str:
    said = words.reasons(reasons)
    return f": {said}" if said else ""
