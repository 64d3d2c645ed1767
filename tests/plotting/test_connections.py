"""Who is at a port: by its USB id, by its answers; one sentence where that is not clear."""

import re

import pytest

from handout import profiles
from handout.errors import PortError
from handout.plotting import connections, open_port, ports
from handout.plotting.dialects import dialect
from handout.plotting.ports import SerialDevice as Device
from handout.simulated.plotter.options import parse
from handout_lab.simulated import FaultyPlotter

SERVO = profiles.find("simulated", "plotter")
CH340, FTDI = (0x1A86, 0x7523), (0x0403, 0x6001)
NAMES = ("/dev/ttyUSB0", "/dev/ttyUSB1", "/dev/ttyACM0")


@pytest.fixture(autouse=True)
def quiet(monkeypatch):
    """Nobody announces himself on the network."""
    monkeypatch.setattr(connections, "find_announced", list)


class Nobody:
    """A port at which nobody answers; a modem echoes what it hears."""

    def __init__(self, echo=False):
        self.echo, self.heard = echo, b""

    def write(self, data):
        self.heard += data if self.echo else b""

    def read(self, timeout):
        said, self.heard = self.heard, b""
        return said

    def close(self):
        pass


def at(**who):
    """Opens ports by name."""

    def open_at(url, baud):
        made = who.get(url.rsplit("/", 1)[1])
        if made is None:
            raise PortError(f"{url} is in use")
        return made() if callable(made) else made

    return open_at


def grbl(options=""):
    return lambda: FaultyPlotter(SERVO, parse(options))


@pytest.mark.parametrize(
    ("options", "firmware"), [("", "1.1h.20190830"), ("variant=grblhal", "1.1f"), ("variant=fluidnc", "FluidNC")]
)
def test_a_grbl_is_known_by_its_version(options, firmware):
    answer = connections.identify("/dev/ttyUSB0", at(ttyUSB0=grbl(options)))
    assert answer.dialect == "grbl" and firmware in answer.firmware


@pytest.mark.parametrize("echo", [False, True])
def test_nobody_is_nobody(echo):
    assert connections.identify("/dev/ttyUSB0", at(ttyUSB0=lambda: Nobody(echo))) is None


def test_the_questions_are_harmless():
    port = grbl()()
    connections.ask(port, ["marlin", "ebb", "hpgl", "grbl"])
    assert port.paper.place == (0, 0, 0) and not port.executed_drawing().strokes and port.at_rest


@pytest.mark.parametrize(
    ("said", "name", "firmware"),
    [
        (b"EBBv13_and_above EB Firmware Version 2.8.1\r\n", "ebb", "EBBv13_and_above EB Firmware Version 2.8.1"),
        (b"FIRMWARE_NAME:Marlin 2.1.2 (x) SOURCE_CODE_URL:y\nok\n", "marlin", "Marlin 2.1.2 (x)"),
        (b"7475A\r", "hpgl", "7475A"),
    ],
)
def test_answers_of_the_others(said, name, firmware):
    question = dialect(name).question
    assert re.search(question.answer, said).group(1).decode() == firmware


def test_the_only_usb_port_is_taken_unasked():
    rows = [
        Device("/dev/ttyS0", "", None),
        Device(NAMES[1], "CH340", CH340),
        Device(NAMES[2], "EBB", (0x04D8, 0xFD92)),
    ]
    assert connections.find_port(SERVO, rows, at()) == NAMES[1]


def test_of_several_ports_the_one_that_answers_is_taken():
    rows = [Device(name, "", CH340) for name in NAMES]
    assert connections.find_port(SERVO, rows, at(ttyUSB0=Nobody, ttyACM0=grbl())) == NAMES[2]


@pytest.mark.parametrize(
    ("rows", "who", "said"),
    [
        ([], {}, "None of this computer's serial ports can be that of the plotter .Simulated A4 plotter"),
        ([Device("/dev/ttyS0", "", None)], {}, "None of this"),
        (
            [Device(NAMES[0], "", CH340), Device(NAMES[1], "", FTDI)],
            {},
            "none answers as .* /dev/ttyUSB0, /dev/ttyUSB1",
        ),
        (
            [Device(NAMES[0], "", CH340), Device(NAMES[1], "", FTDI)],
            {"ttyUSB0": grbl(), "ttyUSB1": grbl()},
            "Several plotters answer as .*: choose one of /dev/ttyUSB0, /dev/ttyUSB1 with --port",
        ),
    ],
)
def test_what_is_not_clear_is_said(rows, who, said):
    with pytest.raises(PortError, match=said):
        connections.find_port(SERVO, rows, at(**who))


def test_auto_is_an_address(monkeypatch):
    from serial.tools import list_ports

    monkeypatch.setattr(list_ports, "comports", lambda: [])
    with pytest.raises(PortError, match="None of this computer"):
        open_port("auto", SERVO)


def test_ports_are_told_with_their_usb_ids(monkeypatch):
    from serial.tools import list_ports
    from serial.tools.list_ports_common import ListPortInfo

    rows = [ListPortInfo(name) for name in (NAMES[1], "/dev/ttyS0")]
    rows[0].vid, rows[0].pid, rows[0].description = *CH340, "USB Serial"
    monkeypatch.setattr(list_ports, "comports", lambda: rows)
    assert ports.serial_devices() == [Device("/dev/ttyS0", "", None), Device(NAMES[1], "USB Serial", CH340)]
    assert [port.usb_text for port in ports.serial_devices()] == ["", "1a86:7523"]


@pytest.mark.parametrize(
    ("name", "spoken"),
    [("simulated", "grbl"), ("axidraw-v3", "ebb"), ("marlin-servo", "marlin"), ("hp-7475a", "hpgl")],
)
def test_every_dialect_is_told_from_the_others(name, spoken):
    port = FaultyPlotter(profiles.find(name, "plotter"))
    answer = connections.ask(port, ["grbl", "ebb", "marlin", "hpgl"])
    assert answer is not None and answer.dialect == spoken
    assert len(port.paper.trace) == 1  # nothing has moved


def test_the_only_port_is_asked_whoever_is_there():
    rows = [Device("/dev/ttyS0", "", None), Device(NAMES[0], "", CH340)]
    name, answer = connections.only_port(rows, at(ttyUSB0=grbl()))
    assert name == NAMES[0] and answer.dialect == "grbl"
    with pytest.raises(PortError, match="Nothing with a serial port is plugged in"):
        connections.only_port(rows[:1])
    several = [*rows, Device(NAMES[1], "", FTDI), Device(NAMES[2], "", CH340)]
    assert connections.only_port(several, at(ttyUSB0=Nobody, ttyACM0=grbl()))[0] == NAMES[2]  # the third is in use
    with pytest.raises(PortError, match=r"Several answer: choose one of /dev/ttyUSB0 \(1.1h.*/dev/ttyACM0 \(1.1f"):
        connections.only_port(several, at(ttyUSB0=grbl(), ttyACM0=grbl("variant=grblhal")))
    with pytest.raises(PortError, match=r"none answers: choose one of .* with --port"):
        connections.only_port(several, at(ttyUSB0=Nobody, ttyUSB1=Nobody))
