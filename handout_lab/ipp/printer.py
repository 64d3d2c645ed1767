"""A simulated IPP printer: a server on this computer that takes pages as a real printer does, and fails on demand.

It speaks IPP 1.1 and 2.0 (Get-Printer-Attributes, Validate-Job, Print-Job, Create-Job, Send-Document,
Get-Job-Attributes, Get-Jobs, Cancel-Job), knows envelopes and custom sizes, keeps every document that it "prints" byte
for byte, and refuses what it does not have.  ``python -m handout_lab.ipp printed`` runs one until Ctrl-C;
``--help`` names its faults.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from http.server import ThreadingHTTPServer
from pathlib import Path
from types import TracebackType
from typing import Any

from handout import atomic
from handout.printing.documents import MIME
from handout.printing.ipp.client import Operation
from handout.printing.ipp.message import (
    Attribute,
    AttributeGroup,
    Message,
    MessageTag,
    Range,
    Resolution,
    Value,
    attribute,
)
from handout.printing.ipp.request import IppStatus, JobState
from handout_lab.ipp.server import Broken, handler

FAILURES = tuple(f"{when}{how}" for how in ("500", "503", "drop", "error", "text") for when in ("", "done-"))
_TRAYS, _TYPES = ("auto", "rear", "main"), ("stationery", "envelope")
# mm, the shorter side first, and the custom sizes: least and greatest
_SIZES = ((110, 220), (114, 162), (162, 229), (104.775, 241.3), (210, 297), (148, 210))
_CUSTOM = ((90, 216), (140, 360))
_SAME = 20  # 1/100 mm: sizes nearer than this are the same
_ENDINGS = {mime: ending for ending, mime in MIME.items()}
_BAD_REQUEST, _BAD_FORMAT, _OTHER_OPERATION = 0x0400, 0x040A, IppStatus.OPERATION_NOT_SUPPORTED


_STEPS = (Operation.CREATE_JOB, Operation.SEND_DOCUMENT)


@dataclass(frozen=True)
class Faults:
    """What goes wrong at the simulated printer; jobs are counted from 1, and 0 is none."""

    busy: int = 0  # so many print requests are refused as busy first
    empty_at: int = 0  # the job at which the tray is empty
    cleared_after: float = 0.0  # s until somebody fills the tray or takes out what has jammed; 0: nobody (see `clear`)
    jam_at: int = 0  # the job that jams and is given up
    hold_at: int = 0  # the job that is held
    lie_at: int = 0  # the job that jams and yet is called completed
    lost_at: int = 0  # the job in whose document the connection breaks before the printer knows of it
    torn_at: int = 0  # the same, and the printer keeps the beginning
    restart_at: int = 0  # the job at which it is switched off and on (see `restart`)
    unanswered_at: int = 0  # the job that is taken and printed, with the connection broken before the answer
    fail_at: int = 0  # the request, of whatever kind, from which requests fail
    fail_for: int = 1  # how many in a row
    # how, one of `FAILURES`: an HTTP status; "drop" breaks the connection, "error" is an internal error of IPP, "text"
    # an answer that is no IPP; with "done-" before it what was asked is done first
    fail_as: str = "500"
    retry_after: float = -1.0  # s that it wants to be left alone after a 503; -1: it does not say
    simple: bool = False  # it knows Print-Job only, not Create-Job and Send-Document
    slow: float = 0.0  # s before every answer
    printing: float = 0.02  # s that a sheet takes
    forgetful: bool = False  # jobs are forgotten when they are over
    old: bool = False  # it speaks IPP 1.1 only
    no_envelopes: bool = False  # it takes A4 and A5 only
    formats: tuple[str, ...] = ("application/pdf", "image/pwg-raster", "image/urf")  # what it prints


@dataclass
class SimulatedJob:
    """A job as the printer keeps it: what it was told, and what it received."""

    number: int
    name: str
    format: str
    attributes: tuple[Attribute, ...]
    document: bytes
    state: JobState = JobState.PROCESSING
    reasons: tuple[str, ...] = ("job-printing",)
    since: float = 0.0
    stage: str = "whole"  # of its document: "lacking", "whole"
    created: int = 1  # s of the printer's up-time


class SimulatedPrinter:
    """The printer; a context that runs its server on a free port of this computer, or on `port`.

    Without the context it can be asked by `answer` alone.

    jobs : everything that it was given since it was switched on, in order; printed : what came out of it.
    """

    def __init__(
        self,
        folder: Path | None = None,
        faults: Faults | None = None,
        port: int = 0,
        path: str = "/ipp/print",
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """`folder` receives what is printed, called job-001.pdf and so on; without one it is in memory only.

        `clock` tells the time, s.
        """
        self.faults = faults or Faults()
        self.jobs: list[SimulatedJob] = []
        self.printed: list[SimulatedJob] = []
        self.received = 0  # pages that were sent and not refused as busy, broken ones included
        self.requests = 0  # of every kind
        self._clock, self._on = clock, clock()
        self._folder, self._path, self._stopped = folder, path, 0.0
        self._reasons: tuple[str, ...] = ("none",)
        self._lock = threading.RLock()
        self._port = port
        self._server: ThreadingHTTPServer | None = None

    @property
    def uri(self) -> str:
        """Where it is."""
        port = self._server.server_port if self._server is not None else self._port
        return f"ipp://127.0.0.1:{port}{self._path}"

    def __enter__(self) -> SimulatedPrinter:
        self._server = ThreadingHTTPServer(("127.0.0.1", self._port), handler(self, self._path))
        self._server.daemon_threads = True
        threading.Thread(target=self._server.serve_forever, args=(0.02,), daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._server is not None:
            self._server.shutdown()
            self._server.server_close()

    def clear(self) -> None:
        """Fill the tray and take out what has jammed: what waits goes on."""
        with self._lock:
            self.faults, self._reasons = replace(self.faults, empty_at=0), ("none",)

    def restart(self, foreign: int = 0, state: JobState = JobState.COMPLETED) -> None:
        """Switch it off and on: it forgets its jobs and numbers anew; so many of other people come before ours."""
        with self._lock:
            self._on, self.jobs, self._reasons = self._clock(), [], ("none",)
            for number in range(1, foreign + 1):
                self.jobs.append(SimulatedJob(number, f"Invoice {number}", "application/pdf", (), b"", state))

    def break_now(self, request: Message) -> Callable[[int], int] | None:
        """For a print request whose connection is to break: bytes of the document announced → bytes still read."""
        if request.code not in (Operation.PRINT_JOB, Operation.SEND_DOCUMENT) or self.faults.busy > 0:
            return None
        number = self.received + 1
        return (lambda length: length // 2) if number in (self.faults.lost_at, self.faults.torn_at) else None

    def torn(self, request: Message, document: bytes) -> None:
        """The connection broke in the middle of a document."""
        with self._lock:
            self.received += 1
            job = self._job_asked_for(request)
            if self.received == self.faults.torn_at:
                job = job or self._new_job(request)
                job.document, job.stage = document, "whole"
                job.state, job.reasons = JobState.ABORTED, ("aborted-by-system",)

    def answer(self, request: Message, document: bytes) -> Message | Broken | None:
        """What it says to a request; None if the connection breaks instead."""
        if self.faults.slow:
            time.sleep(self.faults.slow)
        with self._lock:
            self._advance()
            if self.faults.old and request.version > (1, 1):
                return _message(request, IppStatus.VERSION_NOT_SUPPORTED)
            self.requests += 1
            failing = self.faults.fail_at <= self.requests < self.faults.fail_at + self.faults.fail_for
            if not (self.faults.fail_at and failing):
                return self._carry_out(request, document)
            how = self.faults.fail_as.removeprefix("done-")
            if how != self.faults.fail_as:
                self._carry_out(request, document)
                self._advance()
            return self._failure(request, how)

    def _failure(self, request: Message, how: str) -> Message | Broken | None:
        if how == "drop":
            return None
        if how == "error":
            return _message(request, IppStatus.INTERNAL_ERROR)
        if how == "text":
            return Broken(200, body=b"Hello")
        after = {"Retry-After": f"{self.faults.retry_after:g}"} if self.faults.retry_after >= 0 else {}
        return Broken(int(how), after if how == "503" else {})

    def _carry_out(self, request: Message, document: bytes) -> Message | None:
        does: dict[int, Callable[[], Message | None]] = {
            Operation.GET_PRINTER_ATTRIBUTES: lambda: _message(request, IppStatus.OK, self._attributes()),
            Operation.VALIDATE_JOB: lambda: self._refusal(request) or _message(request, IppStatus.OK),
            Operation.PRINT_JOB: lambda: self._print(request, document),
            Operation.CREATE_JOB: lambda: self._create(request),
            Operation.SEND_DOCUMENT: lambda: self._receive(request, document),
            Operation.GET_JOB_ATTRIBUTES: lambda: self._report_job(request),
            Operation.GET_JOBS: lambda: self._list_jobs(request),
            Operation.CANCEL_JOB: lambda: self._cancel(request),
        }
        unknown = request.code not in does or (self.faults.simple and request.code in _STEPS)
        return _message(request, _OTHER_OPERATION) if unknown else does[request.code]()

    def _print(self, request: Message, document: bytes) -> Message | None:
        refusal = self._busy(request) or self._refusal(request)
        return refusal or self._accept(request, self._new_job(request), document)

    def _create(self, request: Message) -> Message:
        refusal = self._busy(request) or self._refusal(request)
        if refusal is not None:
            return refusal
        job = self._new_job(request)
        job.state, job.reasons, job.stage = JobState.HELD, ("job-data-insufficient",), "lacking"
        return _message(request, IppStatus.OK, _job_group(job))

    def _receive(self, request: Message, document: bytes) -> Message | None:
        job = self._job_asked_for(request)
        if job is None or job.stage != "lacking":
            return _message(request, IppStatus.NOT_FOUND if job is None else IppStatus.NOT_POSSIBLE)
        return self._accept(request, job, document)

    def _accept(self, request: Message, job: SimulatedJob, document: bytes) -> Message | None:
        """A document for a job; what is answered."""
        self.received += 1
        job.document, job.format = document, str(_first(request, "document-format", ""))
        job.state, job.reasons, job.stage, job.since = JobState.PROCESSING, ("job-printing",), "whole", self._clock()
        return None if self.received == self.faults.unanswered_at else _message(request, IppStatus.OK, _job_group(job))

    def _busy(self, request: Message) -> Message | None:
        if self.faults.busy <= 0:
            return None
        self.faults = replace(self.faults, busy=self.faults.busy - 1)
        return _message(request, IppStatus.BUSY)

    def _new_job(self, request: Message) -> SimulatedJob:
        attributes = next((group.attributes for group in request.groups if group.tag == MessageTag.JOB), ())
        name, kind = (str(_first(request, key, "")) for key in ("job-name", "document-format"))
        up = int(self._clock() - self._on) + 1
        job = SimulatedJob(len(self.jobs) + 1, name, kind, attributes, b"", since=self._clock(), created=up)
        self.jobs.append(job)
        return job

    def _advance(self) -> None:
        """Bring every job on by the time that has gone."""
        after = self.faults.cleared_after
        if self._reasons != ("none",) and after and self._clock() - self._stopped >= after:
            self.clear()
        for job in self.jobs:
            if job.state.is_over or job.state == JobState.HELD or job.stage == "lacking":
                continue
            waited, f = self._clock() - job.since, self.faults
            if job.number == f.restart_at:
                self.faults = replace(f, restart_at=0)
                self.restart(job.number)
                return
            if job.number == f.hold_at:
                job.state, job.reasons = JobState.HELD, ("job-hold-until-specified",)
            elif self._reasons != ("none",):
                job.state, job.reasons, job.since = JobState.STOPPED, ("printer-stopped",), self._clock()
            elif job.number == f.empty_at:
                self._stop("media-empty-error")
            elif job.number == f.jam_at:
                job.state, job.reasons = JobState.ABORTED, ("aborted-by-system",)
                self._stop("media-jam-error")
            elif waited >= f.printing:
                self._finish(job)
            elif job.state == JobState.STOPPED:
                job.state, job.reasons = JobState.PROCESSING, ("job-printing",)

    def _stop(self, reason: str) -> None:
        self._reasons, self._stopped = (reason,), self._clock()

    def _finish(self, job: SimulatedJob) -> None:
        job.state, job.reasons = JobState.COMPLETED, ("job-completed-successfully",)
        if job.number == self.faults.lie_at:
            self._stop("media-jam-error")
            return
        self.printed.append(job)
        if self._folder is not None:
            self._folder.mkdir(parents=True, exist_ok=True)
            atomic.write(self._folder / f"job-{job.number:03d}.{_ENDINGS.get(job.format, 'prn')}", job.document)

    def _report_job(self, request: Message) -> Message:
        job = self._job_asked_for(request)
        return (
            _message(request, IppStatus.NOT_FOUND) if job is None else _message(request, IppStatus.OK, _job_group(job))
        )

    def _list_jobs(self, request: Message) -> Message:
        over = _first(request, "which-jobs", "not-completed") == "completed"
        jobs = [job for job in self.jobs if job.state.is_over == over and not (over and self.faults.forgetful)]
        return _message(request, IppStatus.OK, *(_job_group(job) for job in jobs))

    def _cancel(self, request: Message) -> Message:
        job = self._job_asked_for(request)
        if job is None:
            return _message(request, IppStatus.NOT_FOUND)
        if job.state.is_over:
            return _message(request, IppStatus.NOT_POSSIBLE)
        job.state, job.reasons = JobState.CANCELED, ("job-canceled-by-user",)
        return _message(request, IppStatus.OK)

    def _job_asked_for(self, request: Message) -> SimulatedJob | None:
        number = _first(request, "job-id", 0)
        wanted = next((job for job in self.jobs if job.number == number), None)
        return None if wanted is not None and wanted.state.is_over and self.faults.forgetful else wanted

    def _refusal(self, request: Message) -> Message | None:
        """Why a page cannot be printed; None if it can."""
        if _first(request, "document-format", self.faults.formats[0]) not in self.faults.formats:
            return _message(request, _BAD_FORMAT)
        column = request.find_all("media-col", MessageTag.JOB)
        if not column or not isinstance(column[0].value, tuple):
            return _message(request, _BAD_REQUEST)
        media = Message(0, (AttributeGroup(MessageTag.JOB, column[0].value),))
        size = _first(media, "media-size", ())
        sides = [_first(Message(0, (AttributeGroup(MessageTag.JOB, size),)), f"{axis}-dimension", 0) for axis in "xy"]
        wrong = not self._has_size(sides[0], sides[1]) or _first(media, "media-source", "auto") not in _TRAYS
        wrong = wrong or _first(media, "media-type", "stationery") not in _TYPES
        if not wrong:
            return None
        return _message(
            request,
            IppStatus.NOT_SUPPORTED,
            AttributeGroup(MessageTag.UNSUPPORTED_GROUP, (Attribute("media-col", column),)),
        )

    def _has_size(self, across: int, along: int) -> bool:
        sizes = [tuple(sorted((round(a * 100), round(b * 100)))) for a, b in self._sizes()]
        short, long = sorted((across, along))
        fits = any(abs(short - a) <= _SAME and abs(long - b) <= _SAME for a, b in sizes)
        (least, most), (short_least, long_most) = _CUSTOM
        custom = least * 100 <= short <= short_least * 100 and most * 50 <= long <= long_most * 100
        return fits or (custom and not self.faults.no_envelopes)

    def _sizes(self) -> tuple[tuple[float, float], ...]:
        return _SIZES[4:] if self.faults.no_envelopes else _SIZES

    def _attributes(self) -> AttributeGroup:
        """Its attributes."""
        state = 5 if self._reasons == ("none",) else 3
        resolutions = (Resolution(300, 300), Resolution(600, 600))
        sizes = [
            [
                attribute(f"{axis}-dimension", MessageTag.INTEGER, round(mm * 100))
                for axis, mm in zip("xy", sides, strict=True)
            ]
            for sides in self._sizes()
        ]
        return AttributeGroup(
            MessageTag.PRINTER,
            (
                attribute("printer-uri-supported", MessageTag.URI, self.uri),
                attribute("printer-name", MessageTag.NAME, "Simulated"),
                attribute("printer-state", MessageTag.ENUM, state),
                attribute("printer-state-reasons", MessageTag.KEYWORD, *self._reasons),
                attribute("printer-up-time", MessageTag.INTEGER, int(self._clock() - self._on) + 1),
                attribute("printer-is-accepting-jobs", MessageTag.BOOLEAN, True),
                attribute(
                    "ipp-versions-supported", MessageTag.KEYWORD, *(("1.1",) if self.faults.old else ("1.1", "2.0"))
                ),
                attribute(
                    "operations-supported",
                    MessageTag.ENUM,
                    *(o for o in Operation if not (self.faults.simple and o in _STEPS)),
                ),
                attribute("document-format-supported", MessageTag.MIME_TYPE, *self.faults.formats),
                attribute("media-col-supported", MessageTag.KEYWORD, "media-size", "media-source", "media-type"),
                attribute("media-size-supported", MessageTag.COLLECTION, *sizes),
                attribute("media-source-supported", MessageTag.KEYWORD, *_TRAYS),
                attribute("media-type-supported", MessageTag.KEYWORD, *_TYPES),
                attribute("print-scaling-supported", MessageTag.KEYWORD, "auto", "none"),
                attribute("sides-supported", MessageTag.KEYWORD, "one-sided"),
                attribute("copies-supported", MessageTag.RANGE, Range(1, 99)),
                attribute("print-quality-supported", MessageTag.ENUM, 3, 4, 5),
                attribute("pwg-raster-document-resolution-supported", MessageTag.RESOLUTION, *resolutions),
                attribute("urf-supported", MessageTag.KEYWORD, "V1.4", "RS300-600", "SRGB24"),
            ),
        )


def _job_group(job: SimulatedJob) -> AttributeGroup:
    return AttributeGroup(
        MessageTag.JOB,
        (
            attribute("job-id", MessageTag.INTEGER, job.number),
            attribute("job-name", MessageTag.NAME, job.name),
            attribute("job-state", MessageTag.ENUM, job.state),
            attribute("job-state-reasons", MessageTag.KEYWORD, *job.reasons),
            attribute("time-at-creation", MessageTag.INTEGER, job.created),
        ),
    )


def _first(request: Message, name: str, otherwise: Any) -> Any:
    values: tuple[Value, ...] = request.find_all(name)
    return values[0].value if values else otherwise


def _message(request: Message, code: int, *groups: AttributeGroup) -> Message:
    head = AttributeGroup(
        MessageTag.OPERATION,
        (
            attribute("attributes-charset", MessageTag.CHARSET, "utf-8"),
            attribute("attributes-natural-language", MessageTag.LANGUAGE, "en"),
        ),
    )
    return Message(code, (head, *groups), request.request, min(request.version, (2, 0)))
