"""A queue of the print system of Linux and macOS, through its commands ``lp`` and ``lpstat``."""

from __future__ import annotations

import os
import re
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from handout.errors import PrinterError
from handout.printing.ipp import words
from handout.printing.queue import Fate, Ticket

WAY_OUT = "use --dry-run out.pdf to write a file instead"
NO_LP = f"The command lp is not installed (on Debian it is in the package cups-client): {WAY_OUT}."
_PATIENCE = 60.0
# seconds between attempts at a queue that says it is busy
_PAUSES = (1.0, 2.0, 4.0)
# how the reasons of a job begin that CUPS will not print any more
_GIVEN_UP = ("job-canceled", "aborted", "job-completed-with-errors", "document-format-error")
_REQUEST = re.compile(r"request id is (\S+)")


def lp_arguments(queue: str, pdf: Path, ticket: Ticket) -> list[str]:
    """The ``lp`` command line for one job.

    The media is always named, because without it CUPS makes every page a Letter; the profile's own options come
    last and so have the last word.
    """
    options = {"media": ticket.media, "print-scaling": "none"}
    if ticket.source:
        options["media-source"] = ticket.source
    pairs = [part for name, value in (options | dict(ticket.options)).items() for part in ("-o", f"{name}={value}")]
    return ["lp", "-d", queue, "-t", ticket.title, *pairs, "--", str(pdf)]


class CupsQueue:
    """A queue of the print system of Linux and macOS."""

    format = "pdf"
    keeps = True

    def __init__(self, name: str, wait: Callable[[float], object] = time.sleep) -> None:
        """`wait` is called with the seconds between attempts at a busy queue."""
        self.name = name
        self._wait = wait

    def resolution(self, wanted: int) -> int:
        """As wanted: CUPS makes of a page what the printer takes."""
        return wanted

    def check(self, ticket: Ticket) -> None:
        """Nothing: CUPS says what it does not like when it is sent."""

    def follow(self, job: str) -> Fate:
        """Nothing to wait for: CUPS prints by itself what it has taken."""
        return Fate("waiting")

    def fate(self, job: str, title: str) -> Fate:
        """What ``lpstat`` says of a job; one whose name is not known cannot be asked about."""
        done = _run(["lpstat", "-l", "-W", "all", "-o", self.name]) if job else None
        if done is None or done.returncode != 0:
            return Fate("unknown", "the queue cannot be asked about it")
        return _fate(done.stdout, job)

    def cancel(self, job: str, title: str) -> Fate:
        """Nothing: a job is in flight only until CUPS has taken it."""
        return self.fate(job, title)

    def send(self, pdf: Path, ticket: Ticket) -> str:
        """Queue one PDF with ``lp``; a busy queue is asked again for about seven seconds.

        Raises
        ------
        PrinterError
            ``lp`` is missing, does not answer, or refuses the job; the message holds its own words.
        """
        done = self._ask(lp_arguments(self.name, pdf, ticket))
        if done.returncode != 0:
            raise PrinterError(f"Queue {self.name!r} refused the page: {_words(done)}")
        found = _REQUEST.search(done.stdout)
        return found.group(1) if found else ""

    def _ask(self, command: Sequence[str]) -> subprocess.CompletedProcess[str]:
        for pause in (*_PAUSES, None):
            done = _run(command)
            if done is None:
                raise PrinterError(NO_LP)
            if done.returncode == 0 or "busy" not in done.stderr.lower() or pause is None:
                return done
            self._wait(pause)
        raise AssertionError("unreachable")


def _fate(listed: str, job: str) -> Fate:
    """What became of a job, from the long form of ``lpstat``: a line with its name, then lines that are indented."""
    alerts: list[str] | None = None
    for line in listed.splitlines():
        if not line[:1].isspace():
            if alerts is not None:
                break
            alerts = [] if line.split()[:1] == [job] else None
        elif alerts is not None and line.strip().startswith("Alerts:"):
            alerts = line.partition(":")[2].split()
    if alerts is None:
        return Fate("unknown", "the queue does not know the job any longer")
    if "job-completed-successfully" in alerts:
        return Fate("completed")
    if any(alert.startswith(_GIVEN_UP) for alert in alerts):
        return Fate("failed", words.reasons(alerts))
    return Fate("waiting", words.reasons(alerts))


def queues() -> list[str]:
    """The names of the print queues of this computer; none where there is no print system."""
    done = _run(["lpstat", "-e"])
    return sorted(done.stdout.split()) if done is not None and done.returncode == 0 else []


def default() -> str:
    """The system's default queue; empty where there is none."""
    done = _run(["lpstat", "-d"])
    if done is None or done.returncode != 0 or ":" not in done.stdout:
        return ""
    return done.stdout.partition(":")[2].strip()


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str] | None:
    """The command's result, its words in English; None where it is not installed."""
    english = {**os.environ, "LC_ALL": "C"}
    try:
        return subprocess.run(
            command, capture_output=True, text=True, errors="replace", env=english, timeout=_PATIENCE, check=False
        )
    except FileNotFoundError:
        return None
    except (subprocess.TimeoutExpired, OSError) as error:
        raise PrinterError(f"The command {command[0]} did not work: {error}; {WAY_OUT}.") from error


def _words(done: subprocess.CompletedProcess[str]) -> str:
    """What the command said of its failure, as one sentence."""
    said = " ".join(done.stderr.split()) or f"lp ended with status {done.returncode}"
    said = said.removeprefix("lp: ").removeprefix("Error - ")
    return said if said.endswith(".") else f"{said}."
