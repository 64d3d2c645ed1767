"""A queue of the print system of Linux and macOS, through its commands ``lp`` and ``lpstat``."""

from __future__ import annotations

import os
import re
import subprocess
import time
from collections.abc import Callable, Collection, Sequence
from getpass import getuser
from pathlib import Path
from urllib.parse import quote

from handout.errors import PrinterError
from handout.printing.ipp.client import Client
from handout.printing.ipp.queue import earlier_outcome
from handout.printing.ipp.transport import Transport, parse_address
from handout.printing.queue import Outcome, OutcomeUnknown, Queue, Ticket

WAY_OUT = "use --dry-run out.pdf to write a file instead"
NO_LP = f"The command lp is not installed (on Debian it is in the package cups-client): {WAY_OUT}."
_TIMEOUT = 60.0  # s that a command may take; set by eye
# s between attempts at a queue that says it is busy; set by eye
_PAUSES = (1.0, 2.0, 4.0)
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


class _TimedOut(PrinterError):
    """A command of the print system did not come to an end."""


class CupsQueue(Queue):
    """A queue of the print system of Linux and macOS, which makes of a page what the printer takes.

    It says what it does not like when a page is sent; a job is in flight only until it has taken it.
    """

    keeps = True

    def __init__(self, name: str, wait: Callable[[float], object] = time.sleep) -> None:
        """`wait` is called with the seconds between attempts at a busy queue."""
        self.name = name
        self._wait = wait

    def follow(self, job: str, title: str) -> Outcome:
        """Nothing to wait for: CUPS prints by itself what it has taken."""
        return Outcome("waiting")

    def outcome(self, job: str, title: str, earlier: Collection[str] = ()) -> Outcome:
        """What the print system says of a job, in IPP: ``lpstat`` does not tell printed from cancelled."""
        number = job.rpartition("-")[2]
        try:
            done = _run_command(["lpstat", "-H"])
            server = done.stdout.strip() if done is not None and done.returncode == 0 else ""
            # one that is reached through a socket in a folder listens on its port too
            host = server if server and not server.startswith("/") else "localhost:631"
            # CUPS tells of a job by its title to the person who sent it only
            address = parse_address(f"ipp://{host}/printers/{quote(self.name.split('/')[0])}")
            client = Client(Transport(address), wait=self._wait, user=getuser())
            return earlier_outcome(client, number if number[:1].isdigit() else "", title, earlier)
        except PrinterError:
            return Outcome("unknown", "the print system cannot be asked about it")

    def send(self, pdf: Path, ticket: Ticket) -> str:
        """Queue one PDF with ``lp``; a busy queue is asked again for about seven seconds.

        Raises
        ------
        OutcomeUnknown
            ``lp`` does not come to an end, and CUPS does not know the job.
        PrinterError
            ``lp`` is missing or refuses the job; the message holds its own words.
        """
        try:
            done = self._submit(lp_arguments(self.name, pdf, ticket))
        except _TimedOut as error:
            # a job may have been made all the same
            job = self.outcome("", ticket.title).job.partition("@")[0]
            if job:
                return f"{self.name}-{job}"
            raise OutcomeUnknown(f"{error} Whether the page was queued cannot be told.") from error
        if done.returncode != 0:
            reason = " ".join(done.stderr.split()) or f"lp ended with status {done.returncode}"
            reason = reason.removeprefix("lp: ").removeprefix("Error - ").removesuffix(".")
            raise PrinterError(f"Queue {self.name!r} refused the page: {reason}.")
        match = _REQUEST.search(done.stdout)
        return match.group(1) if match else ""

    def _submit(self, command: Sequence[str]) -> subprocess.CompletedProcess[str]:
        for pause in (*_PAUSES, None):
            done = _run_command(command)
            if done is None:
                raise PrinterError(NO_LP)
            if done.returncode == 0 or "busy" not in done.stderr.lower() or pause is None:
                return done
            self._wait(pause)
        raise AssertionError("unreachable")


def queues() -> list[str]:
    """The names of the print queues of this computer; none where there is no print system."""
    done = _run_command(["lpstat", "-e"])
    return sorted(done.stdout.split()) if done is not None and done.returncode == 0 else []


def default() -> str:
    """The system's default queue; empty where there is none."""
    done = _run_command(["lpstat", "-d"])
    if done is None or done.returncode != 0 or ":" not in done.stdout:
        return ""
    return done.stdout.partition(":")[2].strip()


def _run_command(command: Sequence[str]) -> subprocess.CompletedProcess[str] | None:
    """The command's result, its words in English; None where it is not installed."""
    english = {**os.environ, "LC_ALL": "C"}
    try:
        return subprocess.run(
            command, capture_output=True, text=True, errors="replace", env=english, timeout=_TIMEOUT, check=False
        )
    except FileNotFoundError:
        return None
    except subprocess.TimeoutExpired as error:
        raise _TimedOut(f"The command {command[0]} did not come to an end in {_TIMEOUT:g} s.") from error
    except OSError as error:
        raise PrinterError(f"The command {command[0]} did not work: {error}; {WAY_OUT}.") from error
