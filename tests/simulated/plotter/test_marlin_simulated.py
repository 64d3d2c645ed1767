"""The simulated Marlin does as Marlin does: numbers, checksums, queue, planner, signs of life; the plan knows it."""

import math

import msgspec
import numpy as np
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles
from handout.plotting import observation, open_port, plan, run

SERVO = profiles.find("marlin-servo", "plotter")
replace = msgspec.structs.replace


def hear(port, patience=0.5):
    data = b""
    while more := port.read(patience):
        data += more
    return data.decode().split("\n")[:-1] if data else []


def awake(url="sim:", profile=SERVO):
    port = open_port(url, profile)
    assert hear(port)[0] == "start"
    return port


def say(port, *lines, patience=0.5):
    port.write("".join(line + "\n" for line in lines).encode())
    return hear(port, patience)


def numbered(number, text):
    body = f"N{number} {text}"
    checksum = 0
    for char in body:
        checksum ^= ord(char)
    return f"{body}*{checksum}"


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        (numbered(1, "G90"), ["ok"]),
        ("N1 G90", ["Error:No Checksum with line number, Last Line: 0", "Resend: 1", "ok"]),
        ("N1 G90*1", ["Error:checksum mismatch, Last Line: 0", "Resend: 1", "ok"]),
        (numbered(2, "G90"), ["Error:Line Number is not Last Line Number+1, Last Line: 0", "Resend: 1", "ok"]),
        (numbered(50, "M110"), ["ok"]),
        ("M9999", ['echo:Unknown command: "M9999"', "ok"]),
        ("M280 P3 S20", ["Error:Servo 3 out of range", "ok"]),
        ("", []),
        ("; only words", []),
        ("G1 X1 ; and more", ["ok"]),
    ],
)
def test_answers(line, answer):
    assert say(awake(), line, patience=1) == answer


def test_numbers_go_on_from_where_they_were_set():
    port = awake()
    assert say(port, numbered(50, "M110"), numbered(51, "G90")) == ["ok", "ok"]
    assert say(port, numbered(51, "G90"))[1] == "Resend: 52"


def test_an_error_throws_away_what_was_received():
    port = awake()
    heard = say(port, "N1 G91*1", numbered(1, "G1X5F600"), numbered(2, "G1X6"))
    assert heard.count("ok") < 3 and "Resend: 1" in heard


def test_a_line_that_is_too_long_is_cut_silently():
    port = awake()
    assert say(port, "G1 F600 " + " " * 90 + "X50") == ["ok"]
    assert hear(port, 1) == [] and port.paper.place[0] == 0


def test_four_commands_and_fifteen_moves_are_held():
    port = awake()
    for index in range(15):
        assert say(port, f"G1X{(index + 1) * 10}F300", patience=0.05) == ["ok"]
    assert say(port, *(f"G1X{200 + index}" for index in range(3)), patience=0.05) == []
    assert len(port.firmware.reception.commands) == 3 and port.firmware.planner.full


def test_signs_of_life_every_two_seconds():
    heard = say(awake(), "G1X50F600", "M400", patience=4)  # 5 s
    assert heard == ["ok", "echo:busy: processing", "echo:busy: processing", "ok"]


def test_advanced_answers():
    port = awake()
    port.firmware.advanced = True
    assert say(port, numbered(1, "G1X5F600"), patience=0.05) == ["ok N1 P14 B3"]


def test_who_and_how():
    heard = say(awake("sim:?acceleration=500mm/s2"), "M115", "M503", "M114")
    assert any(line.startswith("FIRMWARE_NAME:Marlin 2") for line in heard) and "Cap:EMERGENCY_PARSER:0" in heard
    assert "echo:  M201 X500.00 Y500.00 Z200.00 E93.00" in heard
    assert any(line.startswith("X:0.00 Y:0.00 Z:0.00 E:0.00 Count X:0") for line in heard)


def test_killed_it_hears_nothing():
    port = awake()
    assert say(port, "G1X50F600", "M112")[-1] == "Error:Printer halted. kill() called!"
    assert say(port, "G1X1") == []


def test_a_lone_move_waits_for_company():
    port = awake()
    say(port, "G1X10F600", "M400", patience=2)
    begins = next(time for time, at in port.paper.trace if at[0] > 0)
    port = awake()
    say(port, "G1X3F600", "G1X6", "G1X10", "M400", patience=2)
    assert begins - next(time for time, at in port.paper.trace if at[0] > 0) == pytest.approx(0.1, abs=0.02)


def speeds(port):
    t, at = np.array([time for time, _ in port.paper.trace]), np.array([at for _, at in port.paper.trace]) / 80
    keep = np.diff(t) > 1e-9
    return np.hypot(*np.diff(at[:, :2], axis=0).T)[keep] / np.diff(t)[keep], np.diff(t)[keep]


def test_acceleration_is_along_the_path():
    port = awake()
    say(port, "G1X20Y20F9000", "G1X40Y40", "G1X60Y60", "M400", patience=3)
    v, dt = speeds(port)
    assert (np.abs(np.diff(v)) / dt[1:]).max() <= 1500 * 1.1  # whole steps; with axes of their own it would be 2121


def test_short_segments_in_a_curve_keep_the_acceleration():
    """Chords of four degrees: v²/R is at most the acceleration, of which junction deviation alone allows more."""
    port = awake()
    turn = np.radians(np.arange(0, 300, 4))
    circle = [f"G1X{5 - 5 * math.cos(a):.3f}Y{5 * math.sin(a):.3f}F9000" for a in turn]
    for line in [*circle, "M400"]:
        port.write((line + "\n").encode())
        while b"ok" not in port.read(5.0):
            pass
    v, _ = speeds(port)
    assert v.max() ** 2 / 5 == pytest.approx(1500, rel=0.1)


def test_slowly_when_the_queue_runs_low_unless_told_not_to():
    def seconds(*first):
        port = awake()
        say(port, *first)
        begin = port.now
        for index in range(40):
            port.write(f"G1X{(index + 1) * 0.5:.1f}F6000\n".encode())
            while b"ok" not in port.read(5.0):
                pass
        say(port, "M400", patience=0.01)
        return port.paper.trace[-1][0] - begin

    assert seconds() > 1.2 * seconds("M205B0")


@settings(max_examples=30, deadline=None)
@given(st.lists(st.binary(max_size=40), max_size=12))
def test_it_survives_anything(pieces):
    port = open_port("sim:", SERVO)
    for piece in pieces:
        port.write(piece)
        port.read(0.05)
    hear(port, 0.2)
    assert port.firmware.dead or port.now > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "rms"),
    [({"acceleration": 2000}, 0.03), ({"acceleration": 1000, "jerk": 10.0}, 0.09)],
    ids=["2.x", "jerk"],
)
def test_what_is_planned_is_executed(limits, rms):
    """The host's model and the simulated planner, which share no code, agree on time and speeds."""
    profile = replace(SERVO, limits=replace(SERVO.limits, **limits))
    drawing = page(words=4)
    made, port = plan(drawing, profile), open_port("sim:", profile)
    report = run(made, port, profile)
    found = observation.compare_strokes(drawing, port.executed_drawing())
    assert report.executed_s == pytest.approx(made.duration, rel=0.03)
    assert found.deviation < 0.06 and found.rms < rms
    predicted = observation.compare_strokes(made.intended_drawing(), made.predicted_drawing())
    assert found.rms == pytest.approx(predicted.rms, abs=0.01)
    assert report.stretched == pytest.approx(made.stretched, abs=0.01)
