"""Sending pages to a printer: a CUPS queue through ``lp``, or a simulated queue that keeps what it gets."""

from __future__ import annotations

import difflib
import json
import os
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import msgspec

from handout import atomic, profiles
from handout.errors import InputError, PrinterError, ProfileError
from handout.printing import media
from handout.profiles import Length, Margins, Printer
from handout.values import Page

_WAY_OUT = "use --dry-run out.pdf to write a file instead"
_NO_LP = f"The command lp is not installed (on Debian it is in the package cups-client): {_WAY_OUT}."
_PATIENCE = 60.0
# seconds between attempts at a queue that says it is busy
_PAUSES = (1.0, 2.0, 4.0)
_REQUEST = re.compile(r"request id is (\S+)")


@dataclass(frozen=True)
class Ticket:
    """What a queue is told about a page: a title without anybody's name, the sheet, the tray, further options."""

    title: str
    media: str
    source: str = ""
    options: Mapping[str, str] = field(default_factory=dict)


class Queue(Protocol):
    """Takes pages, one job each."""

    @property
    def name(self) -> str:
        """What to call it in a message."""
        ...

    def send(self, pdf: Path, ticket: Ticket) -> str:
        """Queue one PDF and return the job's name; raises PrinterError."""
        ...


def ticket(profile: Printer, page: Page, title: str) -> Ticket:
    """The ticket of `page` on this printer, its media named as it is fed.

    Raises
    ------
    ProfileError
        The profile feeds from a tray that it does not list.
    """
    if profile.sources and profile.source and profile.source not in profile.sources:
        raise ProfileError(
            f"{profile.title}: source = {profile.source!r} is none of its sources: {', '.join(profile.sources)}."
        )
    sheet = media.turned_page(page, media.turn_for(page, profile))
    return Ticket(title, media.name(sheet), profile.source, profile.options)


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

    def __init__(self, name: str, wait: Callable[[float], object] = time.sleep) -> None:
        """`wait` is called with the seconds between attempts at a busy queue."""
        self.name = name
        self._wait = wait

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
                raise PrinterError(_NO_LP)
            if done.returncode == 0 or "busy" not in done.stderr.lower() or pause is None:
                return done
            self._wait(pause)
        raise AssertionError("unreachable")


class SimulatedQueue:
    """A queue that keeps each job as a PDF in a folder, with its ticket in ``jobs.jsonl``; it can jam on demand."""

    def __init__(self, folder: Path, jam_at: int = 0) -> None:
        """`jam_at` is the number of the job, from 1, that it refuses; 0: it never does.

        Raises
        ------
        InputError
            The folder cannot be made.
        """
        self._folder = folder
        self._jam_at = jam_at
        self._log: list[str] = []
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"Cannot make the folder {folder}: {error.strerror or error}.") from error

    @property
    def name(self) -> str:
        """The folder."""
        return str(self._folder)

    def send(self, pdf: Path, ticket: Ticket) -> str:
        """Keep one job; PrinterError at the jam."""
        number = len(self._log) + 1
        if number == self._jam_at:
            raise PrinterError(f"The simulated printer {self._folder} has a paper jam at job {number}.")
        job = f"job-{number:03d}"
        atomic.write(self._folder / f"{job}.pdf", pdf.read_bytes())
        entry = {"job": job, **msgspec.to_builtins(ticket)}
        self._log.append(json.dumps(entry, ensure_ascii=False) + "\n")
        atomic.write(self._folder / "jobs.jsonl", "".join(self._log).encode())
        return job


def queues() -> list[str]:
    """The names of the print queues of this computer; none where there is no print system."""
    done = _run(["lpstat", "-e"])
    return sorted(done.stdout.split()) if done is not None and done.returncode == 0 else []


def resolve(name: str) -> Printer:
    """The printer called `name`: a queue of this computer, else a profile (``"epson"`` is ``printer-epson``).

    A queue that shares its name with a profile, or that a profile names, is driven as that profile says; any other
    with 600 dpi and a margin of 5 mm, which nearly every printer can keep.  A profile that is a file needs no queue.

    Raises
    ------
    ProfileError
        Neither a queue nor a profile; the message lists the nearest profiles and the queues.
    """
    known = profiles.names("printer")
    is_profile = name.endswith(".toml") or name in known or f"printer-{name}" in known
    profile = _printer(name) if is_profile else None
    if profile is not None and profile.file:
        return profile
    found = queues()
    if name in found:
        return msgspec.structs.replace(profile or _driven(name, known), queue=name)
    if profile is not None:
        return profile
    near = difflib.get_close_matches(f"printer-{name}", known, 3, 0.4) or known
    raise ProfileError(
        f"No printer is called {name!r}; the nearest profiles: {', '.join(near) or 'none'}; {_here(found)} "
        "(see: handout devices list)."
    )


def open_queue(profile: Printer) -> CupsQueue:
    """The CUPS queue of a printer, or the system's default where the profile names none; checked to exist.

    Raises
    ------
    PrinterError
        No print system, no such queue, or no default; the message says what there is and the way out.
    """
    if shutil.which("lp") is None:
        raise PrinterError(_NO_LP)
    found = queues()
    name = profile.queue or _default()
    if not name:
        raise PrinterError(
            f"{profile.title} has no queue of its own and the system has no default; {_here(found)}: "
            f"name one with --printer QUEUE, or {_WAY_OUT}."
        )
    if name.split("/")[0] not in {queue.split("/")[0] for queue in found}:
        raise PrinterError(
            f"There is no print queue {name!r}; {_here(found)}: name another with --printer QUEUE, or {_WAY_OUT}."
        )
    return CupsQueue(name)


def _here(found: Sequence[str]) -> str:
    if not found:
        return "no print queue was found on this computer (is the print system running?)"
    return f"queues on this computer: {', '.join(found)}"


def _printer(name: str) -> Printer:
    profile = profiles.find(name, "printer")
    assert isinstance(profile, Printer)
    return profile


def _driven(queue: str, known: Sequence[str]) -> Printer:
    """The profile that names this queue, else one that fits nearly any printer."""
    for profile in map(_printer, known):
        if profile.queue == queue:
            return profile
    edge = Length(5.0)
    return Printer(kind="printer", title=queue, dpi=600, margins=Margins(top=edge, right=edge, bottom=edge, left=edge))


def _default() -> str:
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
        raise PrinterError(f"The command {command[0]} did not work: {error}; {_WAY_OUT}.") from error


def _words(done: subprocess.CompletedProcess[str]) -> str:
    """What the command said of its failure, as one sentence."""
    said = " ".join(done.stderr.split()) or f"lp ended with status {done.returncode}"
    said = said.removeprefix("lp: ").removeprefix("Error - ")
    return said if said.endswith(".") else f"{said}."
