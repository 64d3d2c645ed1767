"""The way to a machine: opened by its address, found by its USB id, by its announcement on a network, or by questions.

No question is one that a plotter of another dialect takes for a command to move. Moonraker, FluidNC and grblHAL
announce themselves by mDNS, so that they are found without asking anybody.

Sources: RFC 6762 and 6763 (mDNS, DNS-SD); Moonraker's documentation (zeroconf: ``_moonraker._tcp``); FluidNC's telnet
server, whose code adds ``_telnet._tcp``; that grblHAL announces itself likewise is assumed. Routers and printers
announce these as well: a page of the browser counts only where its name is that of a controller, a telnet until it
has been asked who it is.
"""

from __future__ import annotations

import contextlib
import importlib
import re
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple, cast

import msgspec

from handout.errors import DeviceError, InputError, PortError
from handout.plotting.dialects import DIALECTS, dialect
from handout.plotting.greetings import Clues, Fitting, KnownFirmware, narrow_profiles, recognise
from handout.plotting.network_ports import is_moonraker, is_network, open_moonraker, open_network
from handout.plotting.ports import Port, SerialDevice, SerialPort, TimedReader, serial_devices
from handout.profiles import Plotter

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


def find_announced(seconds: float = _LISTENS, wanted: int = 0, interfaces: list[str] | None = None) -> list[Announced]:
    """The machines that answer within some seconds, by their addresses.

    wanted : that many are enough (0: all are waited for); interfaces : addresses of this computer's to listen at.

    Raises PortError: zeroconf is not installed, or this computer is on no network.
    """
    try:
        import zeroconf  # noqa: F401
    except ImportError as error:
        raise PortError(_MISSING) from error
    # In a thread of its own: zeroconf takes the event loop of the thread that makes it, if that has one, as a server's
    # has; while that thread waits here, the loop stands still and nothing is ever heard.
    with ThreadPoolExecutor(1) as apart:
        return apart.submit(_hear_network, seconds, wanted, interfaces).result()


def _hear_network(seconds: float, wanted: int, interfaces: list[str] | None) -> list[Announced]:
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


_MOMENT = 0.25  # s
_WAKES = 2.5  # s a controller may take to start when its port is opened
_ANSWERS = 1.0  # s an answer may take


def open_port(url: str, profile: Plotter) -> Port:
    """Open the way to a machine.

    url : ``/dev/ttyUSB0``, ``COM3``; ``tcp://host:23``, ``ws://host:81``, ``moonraker://host`` (see `network_ports`);
        another address of pyserial's; ``auto``: the only serial port that the machine can be at; ``sim:`` for the
        simulated plotter, with options such as ``sim:?fault=alarm&after=40&buffer=64&realtime=1``.

    Raises PortError: it cannot be opened; the message says what to check and which serial ports there are. InputError:
    options the simulated plotter does not know, or no address.
    """
    if is_simulated(url):
        rest = url[4:]
        if rest and not rest.startswith("?"):
            raise InputError(f"{url}: options of the simulated plotter begin with a question mark: sim:?fault=jam")
        return cast(Port, _load_simulator().plotter(profile, rest[1:]))
    return _open_at(find_port(profile) if url == "auto" else url, profile.port.baud)


def _open_at(url: str, baud: int) -> Port:
    if is_moonraker(url):
        return open_moonraker(url)
    return open_network(url) if is_network(url) else SerialPort(url, baud)


def surroundings(url: str) -> AbstractContextManager[None]:
    """A slow disk or a busy processor that the address of a simulated plotter asks for (``sim:?disk=1s``)."""
    if not is_simulated(url):
        return contextlib.nullcontext()
    return cast(AbstractContextManager[None], _load_simulator().disturb_computer(url.partition("?")[2]))


def is_simulated(url: str) -> bool:
    return url == "sim" or url.startswith("sim:")


def _load_simulator() -> Any:
    """The room of the simulated plotter, which is loaded only for its own addresses."""
    return importlib.import_module("handout.simulated.plotter")


class MachineIdentity(NamedTuple):
    """Who answered: a dialect ("": none of ours), what the machine says it is, the firmware if it is known, and which
    profiles fit it."""

    dialect: str
    firmware: str
    known: KnownFirmware | None = None
    fitting: Fitting = Fitting(())


def ask(port: Port, dialects: Sequence[str], wakes: float = _WAKES) -> MachineIdentity | None:
    """Find out which of the dialects the machine at an open port speaks; None if it answers none of the questions.

    wakes : s it is given to start; what it says by itself is listened to.
    """
    data, reader = b"", TimedReader(port)
    while reader.time < wakes and not (b"Grbl" in data and b"\n" in data):
        data += reader.read(_MOMENT)
        if len(data) > 100_000:
            return None
    for name in (name for name in DIALECTS if name in dialects):
        question = dialect(name).question
        port.write(question.asked)
        data += b"\n" + (said := _listen(port))
        known = recognise(data.decode("ascii", "replace"))
        answer = question.answer.search(said)
        if known is not None and known.dialect in ("", *dialects):
            first = next((line.strip() for line in data.splitlines() if len(line.strip()) > 2), b"")
            words = answer.group(1) if answer else first
            return MachineIdentity(known.dialect, words.decode("ascii", "replace").strip(" :"), known)
        if known is None and answer is not None:
            return MachineIdentity(name, answer.group(1).decode("ascii", "replace").strip(" :"))
    return None


def _listen(port: Port) -> bytes:
    """The bytes of an answer, which ends with a moment of silence."""
    data, reader = b"", TimedReader(port)
    while reader.time < _ANSWERS and len(data) < 100_000:
        data += (more := reader.read(_MOMENT))
        if data and not more:
            break
    return data


def identify(url: str, open_at: Callable[[str, int], Port] = _open_at) -> MachineIdentity | None:
    """Find out who is at a port, of all dialects and at their usual speeds; None: nobody who answers.

    Raises PortError: the port cannot be opened.
    """
    if is_moonraker(url):
        speeds: dict[str, tuple[int, ...]] = {"klipper": (115200,)}
    else:  # on a network any speed is the same
        own = {name: dialect(name).question.bauds for name in DIALECTS}
        speeds = {name: (115200,) for name, bauds in own.items() if bauds} if is_network(url) else own
    bauds = sorted({baud for bauds in speeds.values() for baud in bauds}, key=lambda baud: baud != 115200)
    for baud in bauds:
        port = open_at(url, baud)
        try:
            wakes = 0.0 if is_moonraker(url) else _WAKES
            answer = ask(port, [name for name, bauds in speeds.items() if baud in bauds], wakes)
            if answer is not None:
                return answer._replace(fitting=_fitting(url, answer, port))
        finally:
            port.close()
    return None


def _fitting(url: str, answer: MachineIdentity, port: Port) -> Fitting:
    """The profiles that fit a machine, told by its other answers and by its port."""
    if answer.known is None or not answer.dialect:
        return Fitting(())
    said = ""
    for asked in dialect(answer.dialect).clues:
        port.write(asked)
        said += _listen(port).decode("ascii", "replace")
    device = next((one for one in serial_devices() if one.name == url), None)
    clues = Clues(said) if device is None else Clues(said, device.title, device.usb)
    return narrow_profiles(answer.known, answer.firmware, clues)


def find_port(
    profile: Plotter, ports: Sequence[SerialDevice] | None = None, open_at: Callable[[str, int], Port] = _open_at
) -> str:
    """Where the only machine is that a profile can be for: a serial port, by its USB id or else by who answers; without
    any, an address on the network, by what is announced there.

    Raises PortError: none, or several.
    """
    serial = bool(dialect(profile.dialect).question.bauds)
    boards = _find_candidates(profile, _usb_devices(ports)) if serial else []
    if not boards and (found := _on_network(profile.dialect)):
        return found
    if not boards and not serial:
        raise PortError(
            f"No Moonraker has announced itself on the network ({profile.title}): is it switched on, has its "
            "moonraker.conf [zeroconf], is zeroconf installed here (pip install 'handout-driver[network]')? Else "
            "name it with --port."
        )
    if not boards:
        raise PortError(
            f"None of this computer's serial ports can be that of the plotter ({profile.title}): is it plugged in and "
            "switched on? (See: handout devices list --ports.)"
        )
    if len(boards) == 1:
        return boards[0]
    answering = [name for name in boards if _speaks(name, profile, open_at)]
    if len(answering) == 1:
        return answering[0]
    names = ", ".join(answering or boards)
    reason = "Several plotters answer" if answering else "Several serial ports are there and none answers"
    raise PortError(f"{reason} as {profile.title} should: choose one of {names} with --port.")


def _on_network(language: str) -> str:
    """Where the only machine on the network is that can speak a language ("": any); "" if none has announced itself."""
    try:
        machines = [one for one in find_announced() if not language or one.dialect in ("", language)]
    except PortError:  # nobody can be heard
        return ""
    sure = [one for one in machines if one.dialect] or machines
    if len(sure) > 1:
        names = ", ".join(one.address for one in sure)
        raise PortError(f"Several machines have announced themselves: choose one of {names} with --port.")
    return sure[0].reached if sure else ""


def _usb_devices(ports: Sequence[SerialDevice] | None) -> list[SerialDevice]:
    return [port for port in (serial_devices() if ports is None else ports) if port.usb is not None]


def _find_candidates(profile: Plotter, devices: Sequence[SerialDevice]) -> list[str]:
    """Ports that a machine can be at: with an id that its dialect claims, or, if it claims none, that no other does."""
    claimed = {usb: name for name in DIALECTS for usb in dialect(name).usb}
    claims = profile.dialect if profile.dialect in claimed.values() else None
    return [device.name for device in devices if device.usb is not None and claimed.get(device.usb) == claims]


def only_port(
    ports: Sequence[SerialDevice] | None = None, open_at: Callable[[str, int], Port] = _open_at
) -> tuple[str, MachineIdentity | None]:
    """The only serial port with a USB id, and who is there; of several, the only one at which anybody answers; without
    any, the only machine that has announced itself on the network.

    Raises PortError: none, or several; a single one cannot be opened.
    """
    names = [port.name for port in _usb_devices(ports)]
    if not names and (found := _on_network("")):
        return found, identify(found, open_at)
    if not names:
        raise PortError("Nothing with a serial port is plugged in: is the plotter, and is it switched on?")
    if len(names) == 1:
        return names[0], identify(names[0], open_at)
    answers: dict[str, MachineIdentity] = {}
    for name in names:
        with contextlib.suppress(DeviceError):  # in use, or gone
            if (answer := identify(name, open_at)) is not None:
                answers[name] = answer
    if len(answers) == 1:
        return next(iter(answers.items()))
    who = "; ".join(f"{name} ({answer.firmware})" for name, answer in answers.items()) or ", ".join(names)
    reason = "Several answer" if answers else "Several serial ports are there and none answers"
    raise PortError(f"{reason}: choose one of {who} with --port.")


def _speaks(url: str, profile: Plotter, open_at: Callable[[str, int], Port]) -> bool:
    try:
        port = open_at(url, profile.port.baud)
    except PortError:  # in use, or not ours
        return False
    try:
        answer = ask(port, [profile.dialect], float(profile.port.start_up))
        return answer is not None and answer.dialect == profile.dialect
    except DeviceError:
        return False
    finally:
        port.close()


def limits(profile: Plotter) -> dict[str, float]:
    """What a machine can do and hold, by the names of the keys of its file; mm, mm/s, mm/s²."""
    keys = ("draw_speed", "travel_speed", "acceleration", "junction_deviation", "steps_per_mm")
    values = {f"limits.{key}": float(getattr(profile.limits, key)) for key in keys}
    values |= {"bed.width": float(profile.bed.width), "bed.height": float(profile.bed.height)}
    ports = msgspec.structs.asdict(profile.port)
    return values | {f"port.{key}": float(ports[key]) for key in ("buffer", "queue")}
