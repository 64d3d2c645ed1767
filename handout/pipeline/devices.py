"""Machines: those that have a profile, and who is plugged in."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from handout import profiles, shipped
from handout.errors import DeviceSilent
from handout.pipeline.plotting import machine
from handout.pipeline.results import SILENT, Listener, Result, Told
from handout.plotting import connections, open_port
from handout.plotting.connections import is_simulated
from handout.plotting.dialects import dialect
from handout.plotting.ports import serial_devices as serial_devices


@dataclass(frozen=True)
class DeviceEntry(Result):
    """A machine that has a profile: its name, "plotter" or "printer", its title, and the file."""

    name: str
    kind: str
    title: str
    file: Path


def list_devices() -> list[DeviceEntry]:
    """All known machines; the user's own files win over shipped ones of the same name."""
    files = shipped.files("devices", "*.toml")
    read = {name: profiles.read_profile(path) for name, path in files.items()}
    return [DeviceEntry(name, profile.kind, profile.title, files[name]) for name, profile in read.items()]


def on_network() -> list[connections.Announced]:
    """Machines that have announced themselves on the network; raises PortError where there is none, or no zeroconf."""
    return connections.find_announced()


def probe(port: str = "auto", device: str | None = None, listener: Listener = SILENT) -> Told:
    """Ask the plotter at a port who it is and what it can do; nothing moves.  What ``--json`` prints:

    limits : by the keys of profiles, if they were asked for.
    title : what the firmware is called, if it is known; profiles : the one that it has, or the two that it could have,
        the likeliest first; others : of its kind, less likely; why : what decided, "" if nothing did.

    device : its profile; None: all dialects are tried, and its limits are not asked for.

    Raises DeviceSilent: nobody answers in a language that is known.
    """
    if device is None and not is_simulated(port):
        return _identity_facts(*(connections.only_port() if port == "auto" else (port, connections.identify(port))))
    profile = machine(device or "simulated", port)
    opened = open_port(port, profile)
    try:
        controller = dialect(profile.dialect).connect(opened, profile, listener.say)
        answer = connections.ask(opened, [profile.dialect], wakes=0.0)
        machine_profile = controller.profile
    finally:
        opened.close()
    firmware = answer.firmware if answer else ""
    told = {"port": getattr(opened, "url", port), "dialect": profile.dialect, "firmware": firmware}
    return {**told, **({"limits": limits} if (limits := connections.limits(machine_profile)) else {})}


def _identity_facts(port: str, answer: connections.MachineIdentity | None) -> Told:
    """What is told of who is there."""
    if answer is None:
        raise DeviceSilent(
            f"Nobody at {port} answers in a language handout knows (GRBL, EBB, Marlin, HP-GL, Klipper): is the plotter "
            "switched on, is this its port?"
        )
    known = answer.known
    if known is not None and not known.dialect:
        raise DeviceSilent(
            f"{known.title} answers at {port} ({answer.firmware}), which handout does not speak: {known.advice}."
        )
    told = {"port": port, "dialect": answer.dialect, "firmware": answer.firmware}
    if known is None:
        return told
    fitting, others, why = answer.fitting
    return {**told, "title": known.title, "profiles": list(fitting), "others": list(others), "why": why}
