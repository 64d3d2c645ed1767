"""Machines that announce themselves on the network: Moonraker, FluidNC, grblHAL; found by mDNS, without asking anybody.

Sources: RFC 6762 and 6763 (mDNS, DNS-SD); Moonraker's documentation (zeroconf: ``_moonraker._tcp``); FluidNC's telnet
server, whose code adds ``_telnet._tcp``; that grblHAL announces itself likewise is assumed. Routers and printers
announce these as well: a page of the browser counts only where its name is that of a controller, a telnet until it
has been asked who it is.
"""

from __future__ import annotations

import re
import time
from concurrent.futures import ThreadPoolExecutor
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple

from handout.errors import PortError

_LISTENS = 3.0  # s; machines answer within a second, and a radio loses some
_ASKS = 2000  # ms that a machine may take to say where it is
_CONTROLLERS = re.compile(r"fluidnc|grbl|esp3d", re.IGNORECASE)
_TELNET, _PAGE, _MOONRAKER = (f"_{kind}._tcp.local." for kind in ("telnet", "http", "moonraker"))
_USUAL = {_TELNET: 23, _MOONRAKER: 7125}
_MISSING = "Machines on the network are found with the library zeroconf: pip install 'handout-driver[network]'."


class Announced(NamedTuple):
    """A machine that has announced itself.

    name : as it calls itself.  address : for ``--port``, by its name; reached : the same by its number, which every
    computer finds.  dialect : that it must speak, "" if it may be anybody.
    """

    name: str
    address: str
    reached: str
    dialect: str


def listen(seconds: float = _LISTENS, wanted: int = 0, interfaces: list[str] | None = None) -> list[Announced]:
    """The machines that answer within some seconds, by their addresses.

    wanted : that many are enough (0: all are waited for); interfaces : addresses of this computer's to listen at.

    Raises
    ------
    PortError
        zeroconf is not installed, or this computer is on no network.
    """
    try:
        import zeroconf  # noqa: F401
    except ImportError as error:
        raise PortError(_MISSING) from error
    # In a thread of its own: zeroconf takes the event loop of the thread that makes it, if that has one, as a server's
    # has; while that thread waits here, the loop stands still and nothing is ever heard.
    with ThreadPoolExecutor(1) as apart:
        return apart.submit(_listen, seconds, wanted, interfaces).result()


def _listen(seconds: float, wanted: int, interfaces: list[str] | None) -> list[Announced]:
    """`listen`, in a thread without an event loop."""
    from zeroconf import ServiceBrowser, Zeroconf

    heard: SimpleQueue[tuple[str, Any]] = SimpleQueue()

    def note(zeroconf: Zeroconf, service_type: str, name: str, state_change: object) -> None:
        if getattr(state_change, "name", "") != "Removed":
            heard.put((service_type, zeroconf.get_service_info(service_type, name, _ASKS)))

    try:
        zeroconf = Zeroconf(interfaces=interfaces) if interfaces else Zeroconf()
    except OSError as error:
        raise PortError(f"This computer is on no network ({error.strerror or error}).") from error
    try:
        browser = ServiceBrowser(zeroconf, [_MOONRAKER, _TELNET, _PAGE], handlers=[note])
        found = _collect_machines(heard, seconds, wanted)
        browser.cancel()
    finally:
        zeroconf.close()
    telnets = {machine.name for machine in found if machine.address.startswith("tcp:")}
    rows = [one for one in found if not (one.address.startswith("ws:") and one.name in telnets)]
    return sorted(rows, key=lambda machine: machine.address)


def _collect_machines(heard: SimpleQueue[tuple[str, Any]], seconds: float, wanted: int) -> list[Announced]:
    """The machines that are heard of within some seconds, each once; `wanted` are enough, if that is not 0."""
    found, end = dict[str, Announced](), time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0 and not (wanted and len(found) >= wanted):
        try:
            kind, info = heard.get(timeout=left)
        except Empty:
            break
        if info is not None and (machine := _machine(kind, info)) is not None:
            found[machine.address] = machine
    return list(found.values())


def _machine(kind: str, info: Any) -> Announced | None:
    """What an announcement stands for; None: no machine of ours."""
    host, places = str(info.server or "").rstrip("."), info.parsed_addresses()
    if not host or not host.isprintable() or not places:
        return None
    reached = f"[{places[0]}]" if ":" in places[0] else places[0]
    if kind == _PAGE:  # of a controller: its WebSocket is beside it
        known = _CONTROLLERS.search(f"{info.name} {host}")
        return Announced(host, f"ws://{host}:81", f"ws://{reached}:81", "grbl") if known else None
    scheme, dialect = ("tcp", "") if kind == _TELNET else ("moonraker", "klipper")
    if kind == _TELNET and _CONTROLLERS.search(f"{info.name} {host}"):
        dialect = "grbl"
    port = "" if info.port == _USUAL[kind] else f":{info.port}"
    return Announced(host, f"{scheme}://{host}{port}", f"{scheme}://{reached}{port}", dialect)
