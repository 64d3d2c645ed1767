"""Machines that announce themselves: over this computer's loopback, and what is made of each announcement."""

import asyncio
import json
import socket
import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from urllib.parse import urlsplit

import pytest
from click.testing import CliRunner

from handout import profiles
from handout.cli.devices_ import command
from handout.errors import PortError
from handout.plotting import connections
from handout.plotting.connections import Announced

MOONRAKER = Announced("mainsailos.local", "moonraker://mainsailos.local", "moonraker://10.0.0.5", "klipper")
TELNET = Announced("box.local", "tcp://box.local", "tcp://10.0.0.6", "")
FLUIDNC = Announced("fluidnc.local", "tcp://fluidnc.local", "tcp://10.0.0.7", "grbl")
KLIPPER, SERVO = (profiles.find(name, "plotter") for name in ("klipper-servo", "grbl-servo"))


@pytest.mark.slow
def test_who_announces_himself_is_found():
    """Over the loopback, until the two that are wanted are heard; also where the caller's thread has an event loop."""
    from zeroconf import ServiceInfo, Zeroconf

    here = ["127.0.0.1"]

    def announce():
        machine = Zeroconf(interfaces=here)
        for kind, host, port in (("_moonraker", "mainsailos", 7125), ("_telnet", "fluidnc", 2323)):
            kind = f"{kind}._tcp.local."
            at = [socket.inet_aton(here[0])]
            info = ServiceInfo(kind, f"{host}.{kind}", port, addresses=at, server=f"{host}.local.")
            machine.register_service(info, cooperating_responders=True)  # nobody else has its name: none is asked
        return machine

    async def heard():
        return connections.find_announced(60.0, wanted=2, interfaces=here)

    with ThreadPoolExecutor(1) as apart:  # a thread without a loop, for zeroconf would use that and wait for it
        machine = apart.submit(announce).result()
        found = apart.submit(asyncio.run, heard()).result()
        apart.submit(machine.close).result()
    assert found == [
        Announced("mainsailos.local", "moonraker://mainsailos.local", "moonraker://127.0.0.1", "klipper"),
        Announced("fluidnc.local", "tcp://fluidnc.local:2323", "tcp://127.0.0.1:2323", "grbl"),
    ]


@pytest.mark.parametrize(
    ("kind", "name", "host", "address"),
    [
        ("_http", "FluidNC", "fluidnc.local.", "ws://fluidnc.local:81"),
        ("_http", "grblHAL", "grblhal.local.", "ws://grblhal.local:81"),
        ("_http", "HP LaserJet", "npi1234.local.", None),
        ("_telnet", "router", "router.local.", "tcp://router.local"),
        ("_moonraker", "Moonraker", "voron.local.", "moonraker://voron.local:80"),
        ("_moonraker", "Moonraker", "", None),
        ("_moonraker", "Moonraker", "\x1b[2Jvoron.local.", None),  # it would be obeyed by a terminal
    ],
)
def test_what_an_announcement_stands_for(kind, name, host, address):
    info = SimpleNamespace(
        name=name, server=host, port=23 if kind == "_telnet" else 80, parsed_addresses=lambda: ["10.0.0.5"]
    )
    found = connections._machine(f"{kind}._tcp.local.", info)
    assert (found and found.address) == address
    info.parsed_addresses = lambda: ["fd00::5"]
    found = connections._machine(f"{kind}._tcp.local.", info)
    assert found is None or urlsplit(found.reached).hostname == "fd00::5"


@pytest.fixture
def on_air(monkeypatch):
    """What is announced on the network."""
    machines = []
    monkeypatch.setattr(connections, "find_announced", lambda: machines)
    return machines


def test_the_only_one_that_fits_is_taken_where_no_serial_port_can_be_it(on_air):
    on_air += [MOONRAKER, TELNET, FLUIDNC]
    usb = [connections.SerialDevice("/dev/ttyUSB0", "", (0x1A86, 0x7523))]
    assert connections.find_port(KLIPPER, []) == connections.find_port(KLIPPER, usb) == "moonraker://10.0.0.5"
    assert connections.find_port(SERVO, []) == "tcp://10.0.0.7"
    assert connections.find_port(SERVO, usb) == "/dev/ttyUSB0"


def test_several_are_named_and_none_is_said(on_air):
    with pytest.raises(PortError, match=r"No Moonraker has announced itself .*--port"):
        connections.find_port(KLIPPER, [])
    on_air += [MOONRAKER, MOONRAKER._replace(address="moonraker://voron.local")]
    with pytest.raises(PortError, match=r"choose one of moonraker://mainsailos.local, moonraker://voron.local"):
        connections.find_port(KLIPPER, [])


def test_the_command_lists_them(on_air):
    on_air += [MOONRAKER, TELNET]
    told = CliRunner().invoke(command, ["list", "--network"])
    assert told.exit_code == 0 and "moonraker://mainsailos.local  klipper" in told.output
    rows = json.loads(CliRunner().invoke(command, ["list", "--network", "--json"]).output)["network"]
    assert rows[1] == {"port": "tcp://box.local", "reached": "tcp://10.0.0.6", "dialect": None}
    on_air.clear()
    assert "announced itself" in CliRunner().invoke(command, ["list", "--network"]).output


def test_zeroconf_is_an_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "zeroconf", None)
    with pytest.raises(PortError, match=r"pip install 'handout-driver\[network\]'"):
        connections.find_announced()
