"""Ways to a printer: a queue of CUPS through its commands ``lp`` and ``lpstat``, IPP, a folder, or a simulated one."""

from __future__ import annotations

import difflib
import os
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Collection, Sequence
from getpass import getuser
from pathlib import Path
from urllib.parse import quote

import msgspec

from handout import profiles
from handout.errors import InputError, PrinterError, ProfileError
from handout.printing import media
from handout.printing.ipp import transport
from handout.printing.ipp.client import Client
from handout.printing.ipp.queue import IppQueue, earlier_outcome
from handout.printing.ipp.transport import Transport, parse_address
from handout.printing.media import Feeding
from handout.printing.queue import FolderQueue, Outcome, OutcomeUnknown, Queue, Say, Ticket
from handout.profiles import Length, Margins, Printer
from handout.values import Page

_FOLDER = "file:"


def ticket(profile: Printer, page: Page, title: str, name: str = "") -> Ticket:
    """The ticket of `page` on this printer, its media named as it is fed; `name` is for a file.

    Raises ProfileError: the profile feeds from a tray that it does not list.
    """
    if profile.sources and profile.source and profile.source not in profile.sources:
        raise ProfileError(
            f"{profile.title}: source = {profile.source!r} is none of its sources: {', '.join(profile.sources)}."
        )
    sheet = Feeding.for_page(page, profile).sheet
    kind = "envelope" if media.is_envelope(page) else ""
    return Ticket(title, media.name(sheet), profile.source, profile.options, sheet, kind, name)


def resolve(name: str, queue: str = "") -> Printer:
    """The printer called `name`: an address, a queue of this computer, or a profile (``"epson"``: ``printer-epson``).

    A queue that shares its name with a profile, or that a profile names, is driven as that profile says; any other,
    and any address, with 600 dpi and a margin of 5 mm, which nearly every printer can keep.  A profile that is a file
    needs no queue.  With `queue` (a queue's name, ``ipp://…`` or ``file:FOLDER``) the pages go there.

    Raises ProfileError: neither a queue nor a profile; the message lists the nearest profiles and the queues.
    """
    names, name = profiles.names("printer"), profiles.full(name)
    if queue:
        return msgspec.structs.replace(resolve(name), queue=queue, file=False, simulated=False)
    if transport.is_address(name) or name.startswith(_FOLDER):
        return msgspec.structs.replace(_find_profile(name, names), queue=name)
    is_profile = name.endswith(".toml") or name in names or f"printer-{name}" in names
    profile = _printer(name) if is_profile else None
    if profile is not None and profile.file:
        return profile
    queue_names = queues()
    if name in queue_names:
        return msgspec.structs.replace(profile or _find_profile(name, names), queue=name)
    if profile is not None:
        return profile
    near = difflib.get_close_matches(f"printer-{name}", names, 3, 0.4) or names
    raise ProfileError(
        f"No printer is called {name!r}; the nearest profiles: {', '.join(near) or 'none'}; "
        f"{_list_queues(queue_names)} (see: handout devices list)."
    )


def open_queue(profile: Printer, say: Say = lambda message: None) -> Queue:
    """Open the queue that a profile's `queue` names: an address, a folder, or a CUPS queue, which must exist.

    Raises InputError: a format that this way does not take, or an address that is none. PrinterError: the printer does
    not answer; no print system, no such queue, or no default; the message says what there is and the way out.
    """
    if transport.is_address(profile.queue):
        return IppQueue(
            Client(transport.Transport(transport.parse_address(profile.queue)), say), say, format=profile.format
        )
    if profile.queue.startswith(_FOLDER):
        return FolderQueue(Path(profile.queue.removeprefix(_FOLDER) or "."), profile.format or "pdf")
    if profile.format not in ("", "pdf"):
        raise InputError(f"format: a CUPS queue takes pages as pdf, not as {profile.format}; leave --format out.")
    # the profile's CUPS queue, or the system's default where it names none
    if shutil.which("lp") is None:
        raise PrinterError(NO_LP)
    queue_names = queues()
    name = profile.queue or default()
    if not name:
        raise PrinterError(
            f"{profile.title} has no queue of its own and the system has no default; {_list_queues(queue_names)}: "
            f"name one (print: --queue, calibrate: --printer), or {WAY_OUT}."
        )
    if name.split("/")[0] not in {queue.split("/")[0] for queue in queue_names}:
        raise PrinterError(
            f"There is no print queue {name!r}; {_list_queues(queue_names)}: name another "
            f"(print: --queue, calibrate: --printer), or {WAY_OUT}."
        )
    return CupsQueue(name)


def _list_queues(queue_names: Sequence[str]) -> str:
    if not queue_names:
        return "no print queue was found on this computer (is the print system running?)"
    return f"queues on this computer: {', '.join(queue_names)}"


def _printer(name: str) -> Printer:
    profile = profiles.find(name, "printer")
    assert isinstance(profile, Printer)
    return profile


def _find_profile(queue: str, names: Sequence[str]) -> Printer:
    """The profile that names this queue, else one with margins that suit nearly any printer."""
    for profile in map(_printer, names):
        if profile.queue == queue:
            return profile
    edge = Length(5.0)
    return Printer(kind="printer", title=queue, dpi=600, margins=Margins(top=edge, right=edge, bottom=edge, left=edge))


WAY_OUT = "write a PDF instead (print: --dry-run out.pdf, calibrate: --printer pdf -o charts)"
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

        Raises OutcomeUnknown: ``lp`` does not come to an end, and CUPS does not know the job. PrinterError: ``lp`` is
        missing or refuses the job; the message holds its own words.
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
