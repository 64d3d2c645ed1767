"""A printer that is spoken to directly: pages sent, followed until they are out, and asked about later."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from pathlib import Path

from handout.errors import InputError, PrinterError
from handout.printing.documents import MIME
from handout.printing.ipp import words
from handout.printing.ipp.client import Client, JobStatus
from handout.printing.ipp.fates import asked, judged, stopped
from handout.printing.ipp.handover import PAUSES, Handover
from handout.printing.ipp.request import Request
from handout.printing.ipp.words import JobState
from handout.printing.queue import Fate, FateUnknown, Say, Ticket

# seconds: between questions about a job, and how long an unreachable printer is asked again
_POLL, _SLOWEST_POLL, _PATIENCE = 0.25, 2.0, 60.0
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
        self._handover: Handover | None = None
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
        """Print one page, once: where the way to the printer fails, it is asked before the page is sent again."""
        self._handover = Handover(self._client, self._abilities, self._request(ticket), self._say, self._wait)
        return str(self._handover.run(page.read_bytes()))

    def follow(self, job: str) -> Fate:
        """Wait until a job is over or held, saying what keeps the printer from it.

        Raises
        ------
        FateUnknown
            The printer has not answered for a minute, or could not for ten.
        """
        said, silent, pause = "", 0.0, _POLL
        while True:
            try:
                status = self._client.job(int(job))
                if status is None or status.state.over or _held(status):
                    return judged(self._client, status)
                complaint, silent = self._complaint(status), 0.0
            except PrinterError as error:
                if silent >= _PATIENCE or getattr(error, "passing", False):
                    raise FateUnknown(f"{error} What became of job {job} cannot be told.") from error
                if not silent:
                    self._say(f"{error} Asking again for a minute.")
                silent += pause
                complaint = said
            if complaint != said and complaint:
                self._say(f"Job {job} waits: {complaint}.")
            said = complaint
            self._wait(pause)
            pause = min(pause * 1.5, _SLOWEST_POLL)

    def fate(self, job: str, title: str, earlier: Collection[str] = ()) -> Fate:
        """Ask about an earlier job."""
        return asked(self._client, job, title, earlier, self._wait)

    def cancel(self, job: str, title: str) -> Fate:
        """Stop a job, found by its name if its number is not known, and wait a little until it has stopped."""
        try:
            if not job:
                self._wait(PAUSES[0])  # what had been sent of it may still be on its way
            status = self._client.job(int(job)) if job else self._client.find(title).job
            if status is None and not job and not (self._handover and self._handover.gone):
                return Fate("failed", "it did not arrive")
            if status is not None and not status.state.over:
                status = stopped(self._client, status, self._wait)
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
    return status.state == JobState.HELD and "resources-are-not-ready" not in status.reasons and not status.lacking


def _because(reasons: tuple[str, ...]) -> str:
    said = words.reasons(reasons)
    return f": {said}" if said else ""
