"""Ways to a printer: a CUPS queue through ``lp``, an IPP printer, a folder, or a simulated queue."""

from __future__ import annotations

import difflib
import shutil
from collections.abc import Sequence
from pathlib import Path

import msgspec

from handout import profiles
from handout.errors import InputError, PrinterError, ProfileError
from handout.printing import media
from handout.printing.cups import NO_LP, WAY_OUT, CupsQueue, default, queues
from handout.printing.ipp import transport
from handout.printing.ipp.client import Client
from handout.printing.ipp.queue import IppQueue
from handout.printing.media import Feeding
from handout.printing.queue import FolderQueue, Queue, Say, Ticket
from handout.profiles import Length, Margins, Printer
from handout.values import Page

_FOLDER = "file:"


def ticket(profile: Printer, page: Page, title: str, name: str = "") -> Ticket:
    """The ticket of `page` on this printer, its media named as it is fed; `name` is for a file.

    Raises
    ------
    ProfileError
        The profile feeds from a tray that it does not list.
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

    Raises
    ------
    ProfileError
        Neither a queue nor a profile; the message lists the nearest profiles and the queues.
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

    Raises
    ------
    InputError
        A format that this way does not take, or an address that is none.
    PrinterError
        The printer does not answer; no print system, no such queue, or no default; the message says what there is
        and the way out.
    """
    if transport.is_address(profile.queue):
        return IppQueue(
            Client(transport.Transport(transport.parse_address(profile.queue)), say), say, format=profile.format
        )
    if profile.queue.startswith(_FOLDER):
        return FolderQueue(Path(profile.queue.removeprefix(_FOLDER) or "."), profile.format or "pdf")
    if profile.format not in ("", "pdf"):
        raise InputError(f"format: a CUPS queue takes pages as pdf, not as {profile.format}; leave --format out.")
    return _cups(profile)


def _cups(profile: Printer) -> CupsQueue:
    """The profile's CUPS queue, or the system's default where it names none."""
    if shutil.which("lp") is None:
        raise PrinterError(NO_LP)
    queue_names = queues()
    name = profile.queue or default()
    if not name:
        raise PrinterError(
            f"{profile.title} has no queue of its own and the system has no default; {_list_queues(queue_names)}: "
            f"name one with --printer QUEUE, or {WAY_OUT}."
        )
    if name.split("/")[0] not in {queue.split("/")[0] for queue in queue_names}:
        raise PrinterError(
            f"There is no print queue {name!r}; {_list_queues(queue_names)}: name another with --printer QUEUE, or "
            f"{WAY_OUT}."
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
