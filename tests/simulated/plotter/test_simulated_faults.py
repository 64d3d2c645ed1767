"""Faults of single bytes, of the cable and of the power strike where they are told to, and can be made good."""

import contextlib
import signal

import numpy as np
import pytest

from handout import profiles
from handout.errors import PortError
from handout.plotting import open_port

PROFILE = profiles.find("simulated", "plotter")


def hear(port, patience=0.5):
    data = b""
    while more := port.read(patience):
        data += more
    return data.decode().split("\r\n")[:-1] if data else []


def awake(query):
    port = open_port(f"sim:?{query}", PROFILE)
    assert hear(port)[-1].startswith("Grbl")
    return port


def where(port):
    """What the controller believes, and where the carriage is, mm."""
    port.write(b"?")
    status = next(line for line in hear(port) if line.startswith("<"))
    believed = tuple(float(v) for v in status.split("MPos:")[1].split("|")[0].split(",")[:2])
    return believed, tuple(steps / 80 for steps in port.paper.place[:2])


@pytest.mark.parametrize(
    ("fault", "executed"),
    [
        ("lost-byte", b"G0X2\nG4P0\n"), ("doubled-byte", b"G0X112\nG4P0\n"), ("flipped-byte&bit=1", b"G0X32\nG4P0\n"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("pieces", [1, 3])
def test_a_byte_is_damaged_and_only_that_one(fault, executed, pieces):
    wrong, right = awake(f"fault={fault}&at=3"), awake("")
    program = b"G0X12\nG4P0\n"
    for part in np.array_split(np.frombuffer(program, np.uint8), pieces):
        wrong.write(part.tobytes())
    right.write(executed)
    assert hear(wrong, 3) == hear(right, 3) == ["ok", "ok"]
    assert where(wrong) == where(right)
    wrong.write(program)
    hear(wrong, 3)
    assert where(wrong)[0] == (12, 0)


def test_without_a_byte_the_end_of_a_line_is_struck():
    port = awake("fault=doubled-byte&after=1")
    port.write(b"G0X1\nG0X2\n")
    assert hear(port) == ["ok", "ok", "ok"]  # an empty line is answered too


def test_an_unplugged_plotter_goes_on_with_what_it_has():
    port = awake("fault=unplugged&at=17")
    port.write(b"G1X10F600\nX20\nX30\nX40\n")
    with pytest.raises(PortError):
        port.read(0.5)
    with pytest.raises(PortError):
        port.write(b"?")
    port.replug()
    port.write(b"\n")
    assert hear(port, 3) == ["ok"]
    assert where(port) == ((30, 0), (30, 0))  # "X30" had come when the cable was pulled, its end had not


def test_a_power_cut_stops_it_dead_and_it_forgets_where_it_is():
    port = awake("fault=power-cut&at=13")
    port.write(b"G1X10F600\n")
    assert hear(port, 0.5) == ["ok"]
    port.write(b"X20\nX30\n")
    assert hear(port, 20) == []
    port.write(b"?")
    assert hear(port, 20) == []  # silent from now on
    stood = port.paper.place[0] / 80
    assert 0 < stood < 10
    port.power_on()
    assert hear(port)[-1].startswith("Grbl")
    assert where(port) == ((0, 0), (stood, 0))
    port.stand_at_zero()
    assert where(port) == ((0, 0), (0, 0))
    port.write(b"G0X5\n")
    hear(port, 3)
    assert where(port) == ((5, 0), (5, 0))


def test_a_carriage_pushed_by_hand_deceives_the_controller():
    port = awake("")
    port.write(b"G0X10Y10\n")
    hear(port, 3)
    port.stand_at_zero()
    assert where(port) == ((10, 10), (0, 0))
    port.write(b"G92X0Y0\nG0X5\n")
    hear(port, 3)
    assert where(port) == ((15, 10), (5, 0))


def test_nothing_is_drawn_by_pushing():
    port = awake("")
    port.write(b"M3S90\nG4P0.2\nG1X10F600\nG4P0\n")
    hear(port, 5)
    port.power_on()
    port.stand_at_zero()
    (stroke,) = port.executed_drawing().strokes
    assert stroke.length == pytest.approx(10, abs=0.02)


def interrupted(port, monkeypatch):
    """Ctrl-C, while the machine obeys its next instruction."""
    obey = port.firmware.execute

    def execute(line):
        monkeypatch.undo()
        signal.raise_signal(signal.SIGINT)
        yield from obey(line)

    monkeypatch.setattr(port.firmware, "execute", execute)
    port.write(b"G0X12\nG4P0\n")


@pytest.fixture
def heard():
    """Ctrl-C is heard as in a terminal: it is ignored behind a shell's &."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heard")
def test_an_interrupt_does_not_reach_into_the_machine(monkeypatch):
    port = awake("")
    interrupted(port, monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        port.read(0.5)
    assert hear(port, 3) == ["ok", "ok"] and where(port)[1][0] == pytest.approx(12)


@pytest.mark.usefixtures("heard")
def test_a_machine_that_was_cut_off_within_is_lost(monkeypatch):
    port = awake("")
    monkeypatch.setattr("handout.signals.defer_signals", contextlib.nullcontext)  # as in another thread
    execute = port.firmware.execute
    interrupted(port, monkeypatch)
    assert port.firmware.execute != execute
    with pytest.raises(KeyboardInterrupt):
        port.read(0.5)
    with pytest.raises(PortError):
        port.read(0.5)
