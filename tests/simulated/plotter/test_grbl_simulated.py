"""The simulated plotter behaves as GRBL 1.1 does: replies, modes, motion, overflow, hold, reset, alarms."""

import contextlib
import math
import os
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from clocks import Clock
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles
from handout.errors import InputError, PortError
from handout.plotting import connections, open_port, plan, run
from handout.simulated import plotter as simulated_plotter
from handout.simulated.plotter.options import parse
from handout.simulated.plotter.planner import _ramp
from handout_lab.simulated import FaultyPlotter, faults
from handout_lab.simulated.faults import FAULTS

SERVO, ON_Z = profiles.find("simulated", "plotter"), profiles.find("grbl-z", "plotter")


def awake(profile=SERVO, url="sim:"):
    port = open_port(url, profile)
    heard = hear(port)
    assert heard[-1].startswith("Grbl 1.1h")
    return port


def hear(port, patience=0.5):
    data = b""
    while more := port.read(patience):
        data += more
    return data.decode().split("\r\n")[:-1] if data else []


def say(port, *lines, patience=0.5):
    port.write("".join(line + "\n" for line in lines).encode())
    return hear(port, patience)


def where(port):
    port.write(b"?")
    status = hear(port)[0]
    return tuple(float(v) for v in status.split("MPos:")[1].split("|")[0].split(",")[:2])


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("G1X1", "error:22"), ("G1X1F", "error:2"), ("12", "error:1"), ("$J=G91X1F100", "error:3"), ("$H", "error:5"),
        ("G2X1Y1I1", "error:20"), ("G0G1X1", "error:21"), ("G1X1X2F100", "error:25"), ("G4", "error:28"),
        ("G92", "error:26"), ("G80X1", "error:31"), ("X" + "1" * 90, "error:11"), ("", "ok"), ("(a comment)", "ok"),
        ("g1 x1 f100 ; and more", "ok"), ("G21 G90 G94 G17 G54", "ok"), ("M3 S40", "ok"), ("G4 P0", "ok"),
    ],
)  # fmt: skip
def test_answers(line, answer):
    assert say(awake(), line, patience=2) == [answer]


def test_an_error_changes_nothing():
    port = awake()
    assert say(port, "G91", "G1X1X2F100", "G90G2", "G0X5") == ["ok", "error:25", "error:20", "ok"]
    say(port, "G0X5", "G4P0")
    assert where(port) == (10, 0)  # still G91


def test_units_and_distances():
    port = awake()
    say(port, "G20G91", "G1X1Y2F100", "G21", "X1", "G90", "Y10", "G4P0", patience=60)
    assert where(port) == (pytest.approx(26.4, abs=0.01), 10)


def test_g92_moves_the_zero():
    port = awake()
    say(port, "G0X10Y10", "G92X0Y0", "G0X5", "G4P0", patience=5)
    assert where(port) == (15, 10)
    say(port, "G92.1", "G0X5", "G4P0", patience=5)
    assert where(port) == (5, 10)


def moving(port):
    """Times and x, mm, from where the first motion began."""
    trace = port.paper.trace
    first = next(at for at, (_, position) in enumerate(trace) if position != trace[0][1])
    return np.array([(t, steps[0] / 80) for t, steps in trace[first - 1 :]])


def test_a_straight_line_takes_the_time_of_a_trapezoid():
    port = awake()
    say(port, "G1X60F6000", "G4P0", patience=5)
    t, x = moving(port).T
    assert t[-1] - t[0] == pytest.approx(60 / 100 + 100 / 2000, rel=1e-6)
    speed = np.diff(x) / np.diff(t)
    assert speed.max() == pytest.approx(100, rel=0.01)
    assert np.abs(np.diff(speed)).max() <= 2000 * 0.011


def test_rapids_use_all_an_axis_can():
    port = awake()
    say(port, "G0X100Y100", "G4P0", patience=5)
    t, _ = moving(port).T
    speed, length = 150 * math.sqrt(2), 100 * math.sqrt(2)
    assert t[-1] - t[0] == pytest.approx(length / speed + speed / (2000 * math.sqrt(2)), rel=1e-4)


@given(st.floats(0.01, 50), st.floats(0, 100), st.floats(0, 100), st.floats(1, 150), st.floats(100, 5000))
def test_ramps_cover_their_line_within_their_acceleration(mm, u, v, nominal, a):
    u, v = min(u, nominal), min(v, nominal)
    v = min(v, math.sqrt(u * u + 2 * a * mm))
    ramp = _ramp(mm, u, v, nominal, a)
    t = np.linspace(0, ramp.time, 50)
    way, speed = np.array([ramp.state_at(float(x)) for x in t]).T
    assert way[0] == pytest.approx(0, abs=1e-9) and way[-1] == pytest.approx(mm, rel=1e-6)
    assert speed.max() <= nominal + 1e-6 and (np.diff(way) >= -1e-9).all()
    assert np.abs(np.diff(speed)).max() <= a * ramp.time / 49 * 1.001 + 1e-9


def test_sixty_lines_sent_blind_overflow_silently():
    port = awake()
    lines = [f"G1X{10 + index % 7}.125Y{20 + index % 5}.5F600" for index in range(60)]
    answers = say(port, *lines, patience=5)
    assert port.lost_bytes > 100
    assert answers.count("ok") < 50 and len(answers) < 60


def test_a_queue_of_fifteen_holds_back_the_sixteenth_ok():
    port = awake()
    for index in range(15):
        port.write(f"G1X{(index + 1) * 10}F300\n".encode())
        assert port.read(0.3).strip() == b"ok"
    port.write(b"X1\n")
    assert port.read(0.3) == b""
    port.write(b"?")
    assert b"Run|" in port.read(0.3) and port.firmware.queue.full


def test_hold_and_go_on():
    port = awake()
    port.write(b"G1X100F6000\n")
    port.read(0.3)
    port.write(b"!")
    port.read(0.5)
    port.write(b"?")
    assert b"Hold:0" in port.read(0.5)
    stood = where(port)
    port.read(2.0)
    assert where(port) == stood and 1 < stood[0] < 50
    port.write(b"~")
    hear(port, 3)
    assert where(port) == (100, 0)
    t, x = moving(port).T
    still = np.diff(t) > 0.1  # the hold
    speed = np.where(still, 0, np.diff(x) / np.diff(t))
    assert still.sum() == 1 and speed.min() >= 0 and np.abs(np.diff(speed)).max() <= 2000 * 0.011


def test_reset_while_moving_loses_the_place_and_locks():
    port = awake()
    say(port, "G1X100F6000", patience=0.2)
    port.write(b"\x18")
    heard = hear(port)
    assert heard[0] == "ALARM:3" and heard[-1] == "[MSG:'$H'|'$X' to unlock]"
    assert say(port, "G0X1", "$X", "G0X1") == ["error:9", "[MSG:Caution: Unlocked]", "ok", "ok"]


def test_reset_at_rest_is_harmless():
    port = awake()
    say(port, "G0X10", "G4P0")
    port.write(b"\x18")
    assert "ALARM" not in " ".join(hear(port))
    assert where(port) == (10, 0)


def test_the_end_of_an_axis_is_an_alarm_that_only_a_reset_ends():
    port = awake()
    assert say(port, "G0X500")[:2] == ["ALARM:1", "[MSG:Reset to continue]"]
    port.write(b"?$X\n")
    assert hear(port) == []
    port.write(b"\x18")
    assert hear(port)[-1] == "[MSG:'$H'|'$X' to unlock]"


def test_settings_and_sizes():
    port = awake(url="sim:?buffer=64&queue=8&acceleration=500mm/s2&speed=40mm/s")
    heard = say(port, "$$", "$I")
    assert "$120=500.000" in heard and "$110=2400.000" in heard and "$100=80.000" in heard
    assert "[OPT:V,8,64]" in heard and heard.count("ok") == 2


def test_homing():
    import msgspec

    port = open_port("sim:", msgspec.structs.replace(SERVO, homing=True))
    assert hear(port)[-1] == "[MSG:'$H'|'$X' to unlock]"
    assert say(port, "G0X1") == ["error:9"]
    assert say(port, "$H", "G0X1", patience=3) == ["ok", "ok"]


def test_a_servo_that_is_not_waited_for_loses_the_beginning():
    def drawn(*wait):
        port = awake()
        say(port, "G0X10Y10", "M3S90", *wait, "G1X40F6000", "G4P0", "M3S40", "G4P0.2", patience=3)
        return port.executed_drawing().strokes[0]

    assert drawn("G4P0.15").length == pytest.approx(30, abs=0.05)
    assert drawn("G4P0.05").length < 27


def test_a_pen_dragged_along_is_seen():
    port = awake()
    say(port, "M3S90", "G4P0.2", "G1X10F6000", "M3S40", "X40", "G4P0", patience=3)
    assert port.executed_drawing().strokes[0].length > 12


def test_pen_on_the_z_axis():
    port = awake(ON_Z)
    say(port, "G1Z2.5F900", "G1X10Y10F3000", "G1Z0F900", "G4P0", patience=3)
    assert port.pen_is_down
    say(port, "X20", "G1Z2.5", "G4P0", patience=3)
    assert not port.pen_is_down
    (stroke,) = port.executed_drawing().strokes
    assert stroke.length == pytest.approx(10, abs=0.02)
    assert stroke.xy[0] == pytest.approx([10, 210], abs=0.02)  # of a page as large as the bed


@pytest.mark.slow
def test_real_time_takes_its_time():
    begin = time.monotonic()
    port = awake(url="sim:?realtime=1")
    woke = port.now
    assert say(port, "G4P0.3", patience=0.1) == [] and hear(port, 0.4) == ["ok"]
    assert port.now - woke > 0.3 and time.monotonic() - begin > port.now - 0.01


def test_real_time_does_not_dawdle(monkeypatch):
    clock = [0.0]
    wall = SimpleNamespace(monotonic=lambda: clock[0], sleep=lambda s: clock.__setitem__(0, clock[0] + s))
    monkeypatch.setattr("handout.simulated.plotter.port.time", wall)
    port = awake(url="sim:?realtime=1")
    say(port, "G4P0.3")
    assert clock[0] == pytest.approx(port.now)
    clock[0] += 60.0  # whoever was away that long is not kept waiting
    say(port, "G4P0.3")
    assert clock[0] - 60.0 < port.now


@pytest.mark.parametrize("name", ["simulated", "axidraw-v3", "marlin-servo", "hp-7475a"])
def test_on_a_real_clock_it_draws_as_on_its_own(name):
    profile = profiles.find(name, "plotter")
    made = plan(page(words=1), profile)
    real, virtual = FaultyPlotter(profile, clock=Clock()), FaultyPlotter(profile)
    reports = [run(made, port, profile) for port in (real, virtual)]
    assert reports[0].executed_s == pytest.approx(reports[1].executed_s, rel=0.02)
    assert [len(s.t) for s in real.executed_drawing().strokes] == pytest.approx(
        [len(s.t) for s in virtual.executed_drawing().strokes], rel=0.02
    )


def test_on_a_real_clock_it_goes_on_while_nobody_speaks_to_it():
    clock = Clock()
    port = FaultyPlotter(SERVO, clock=clock)
    clock.sleep(3.0)
    hear(port)
    port.write(b"G21G90\nM3S%d\nG4P0.3\nG1X10F600\nX20\n" % SERVO.pen.down)
    clock.sleep(60.0)
    (stroke,) = port.executed_drawing().strokes if port.read(0.0).count(b"ok") == 5 else ()
    assert stroke.length == pytest.approx(20, abs=0.05) and 3.0 < stroke.t[0] < 4.0 and stroke.t[-1] < 8.0
    assert port.time == pytest.approx(clock.now) == pytest.approx(port.now)
    begin = clock.now
    assert port.read(0.5) == b"" and clock.now == pytest.approx(begin + 0.5)


def test_what_goes_wrong_around_it_lasts_as_long_as_it_is_used(monkeypatch):
    slept = []
    monkeypatch.setattr(faults.time, "sleep", slept.append)
    usual = os.fsync
    with connections.surroundings("sim:?disk=700ms&busy=1"), Path(os.devnull).open("rb") as nothing:
        with contextlib.suppress(OSError):
            os.fsync(nothing.fileno())
        assert slept == pytest.approx([0.7]) and os.fsync is not usual
    assert os.fsync is usual
    with connections.surroundings("/dev/ttyUSB0"), connections.surroundings("sim:"):
        assert os.fsync is usual
    with faults.busy_processor(1) as others:
        (other,) = others
        assert other.poll() is None
    assert other.poll() is not None


def test_a_closed_port_is_closed():
    port = awake()
    port.close()
    port.close()
    with pytest.raises(PortError):
        port.write(b"?")


@pytest.mark.parametrize(
    ("query", "said"),
    [
        ("fault=jamm", "did you mean jam"), ("after=x", "whole number"), ("buffer=3", "from 16 to"),
        ("late=5", "not a time"), ("colour=red", "has no option 'colour'"), ("acceleration=5", "not a acceleration"),
    ],
)  # fmt: skip
def test_options_that_mean_nothing_are_refused(query, said):
    with pytest.raises(InputError, match=said):
        open_port(f"sim:?{query}", SERVO)


def test_options():
    assert parse("") == parse("after=20")
    options = parse("fault=late&after=7&late=2s&latency=16ms&realtime=0&buffer=64")
    assert (options.fault, options.after, options.late, options.latency) == ("late", 7, 2.0, 0.016)
    assert options.buffer == 64 and options.realtime is False
    assert all(parse(f"fault={fault}").fault == fault for fault in FAULTS)


def test_every_fault_strikes_somewhere():
    rooms = (Path(module.__file__).parent for module in (faults, simulated_plotter))
    code = "".join(path.read_text(encoding="utf-8") for room in rooms for path in room.rglob("*.py"))
    assert [fault for fault in FAULTS if code.count(f'"{fault}"') < 2] == []


@settings(max_examples=40, deadline=None)
@given(st.lists(st.binary(max_size=40), max_size=12))
def test_it_survives_anything(pieces):
    port = open_port("sim:", SERVO)
    for piece in pieces:
        port.write(piece)
        port.read(0.05)
    hear(port, 0.2)
    port.write(b"\x18")
    assert any(line.startswith("Grbl") for line in hear(port, 1.0))
