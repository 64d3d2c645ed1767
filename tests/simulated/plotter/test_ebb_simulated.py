"""The simulated EBB, and what is worked out for it: accumulators tick by tick, queue, blocking, answers by version."""

import msgspec
import numpy as np
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles
from handout.plotting import open_port, plan
from handout.plotting.dialects import Timed
from handout.plotting.dialects.ebb import DIALECT as ebb
from handout.simulated.plotter import ebb_engine

PROFILE = profiles.find("axidraw-v3", "plotter")
FULL = 2**31


def board(query=""):
    port = open_port(f"sim:?{query}", PROFILE)
    assert port.read(0.1) == b""  # it has no greeting
    return port


def say(port, *commands, patience=0.3):
    port.write("".join(command + "\r" for command in commands).encode())
    data = b""
    while more := port.read(patience):
        data += more
    return data.decode()


def motors(port):
    """Times and steps of both motors."""
    t = np.array([time for time, _ in port.paper.trace])
    half = np.array([at[:2] for _, at in port.paper.trace])
    return t, np.stack([half[:, 0] + half[:, 1], half[:, 0] - half[:, 1]], axis=1) / 2


@pytest.mark.parametrize(
    ("version", "command", "answer"),
    [
        ("2.8.1", "V", "EBBv13_and_above EB Firmware Version 2.8.1\r\n"),
        ("2.8.1", "SM,10,5,5", "OK\r\n"),
        ("2.8.1", "qm", "QM,0,0,0,0\n\r"),
        ("2.8.1", "QS", "0,0\n\rOK\r\n"),
        ("2.8.1", "QG", "10\r\n"),
        ("2.8.1", "QC", "0394,0300\r\nOK\r\n"),
        ("2.8.1", "QE", "0,0\r\nOK\r\n"),
        ("2.8.1", "ES", "0,0,0,0,0\n\rOK\r\n"),
        ("2.2.8", "ES", "0\n\rOK\r\n"),
        ("3.0.0", "ES", "0\n\rOK\r\n"),
        ("2.8.1", "QP", "1\n\rOK\r\n"),
        ("2.8.1", "XX", "!8 Err: Unknown command 'XX:5858'\n\r"),
        ("3.0", "XX", "!8 Err: Unknown command 'XX:5858'\r\nOK\r\n"),
        ("2.6.5", "LT,10,1,1,1,1", "!8 Err: Unknown command 'LT:4C54'\n\r"),
        ("2.8.1", "LT,250,8589935,0,0,0", "OK\r\n"),
        ("2.5.2", "LM,1,1,1,1,1,1", "!8 Err: Unknown command 'LM:4C4D'\n\r"),
        ("2.2.9", "XM,1,1,1", "!8 Err: Unknown command 'XM:584D'\n\r"),
        ("2.8.1", "SM,1,26,0", "!0 Err: <axis1> step rate > 25K steps/second.\n\r"),
        ("2.8.1", "SM,1500,0,1", "!0 Err: <axis2> step rate < 1.31Hz.\n\r"),
        ("3.0.0", "SM,1500,0,1", "OK\r\n"),
        ("2.8.1", "SM,10", "!4 Err: Missing parameter(s)\n\r"),
        ("2.8.1", "SM,0,1,1", "!6 Err: Invalid parameter value\n\r"),
        ("2.8.1", "SM,10A,1", "!5 Err: Need comma next, found: 'A'\n\r"),
        ("2.8.1", "", ""),
    ],
)
def test_answers(version, command, answer):
    assert say(board(f"firmware={version}"), command, patience=3) == answer


def test_firmware_3_answers_in_one_form_if_it_is_told_to():
    port = board("firmware=3.0.0")
    say(port, "CU,10,1")
    heard = say(port, "V", "SM,10,5,5", "QS", "QM", "SM,10", patience=1)
    assert heard.split("\n")[:2] == ["V,EBBv13_and_above EB Firmware Version 3.0.0", "SM"]
    assert "QS,5,5\n" in say(port, "QS") and "SM,!4 Err: Missing parameter(s)\n" in heard


@pytest.mark.parametrize("version", ["2.2.7", "2.8.1", "3.0.0"])
def test_motion_at_constant_speed(version):
    port = board(f"firmware={version}")
    say(port, "SM,100,500,-250", patience=1)
    t, steps = motors(port)
    assert steps[-1].tolist() == [500, -250]
    moving = np.flatnonzero((steps != steps[0]).any(axis=1))
    assert t[-1] - t[moving[0]] == pytest.approx(0.099, abs=0.0002)
    middle = np.interp(t[moving[0]] + 0.05, t, steps[:, 0])
    assert middle == pytest.approx(255, abs=3)


def test_the_queue_fills_and_then_the_board_reads_no_more():
    port = board()
    port.write(b"SM,500,100,0\rSM,500,100,0\rSM,500,100,0\rQM\r")
    heard = b""
    while port.now < 0.5:
        heard += port.read(0.05)
    assert heard == b"OK\r\nOK\r\n"  # the third waits for the queue, the question behind it
    while port.now < 0.7:
        heard += port.read(0.05)
    assert heard == b"OK\r\n" * 3 + b"QM,1,1,0,1\n\r"


def test_a_longer_queue_from_firmware_3():
    port = board("firmware=3.0.0")
    assert say(port, "CU,4,5") == "OK\r\n"
    port.write(b"SM,500,100,0\r" * 7)
    heard = b""
    while port.now < 0.8:
        heard += port.read(0.05)
    assert heard.count(b"OK") == 6
    assert say(board("firmware=2.8.1"), "CU,4,5") == "OK\r\n"  # taken, without effect


def test_es_stops_at_once_and_the_count_stays_true():
    port = board()
    port.write(b"SM,1000,1000,500\rSM,1000,10,10\r")
    while port.now < 0.3:
        port.read(0.05)
    assert say(port, "ES").startswith("1,0,0,0,0")
    heard = say(port, "QS")
    one, two = (int(number) for number in heard.split("\n")[0].split(","))
    assert 200 < one < 400 and abs(two - one / 2) < 2
    assert motors(port)[1][-1].tolist() == [one, two] and port.at_rest


@pytest.mark.parametrize("clears", ["CU,51,0", "EM,1,1"])
def test_after_a_limit_switch_motion_is_ignored_until_that_is_cleared(clears):
    port = board("fault=alarm&after=1&firmware=3.0.2")
    say(port, "SM,100,300,0", "SM,100,300,0")
    at = port.paper.place
    say(port, "SM,100,300,0")
    assert port.paper.place == at
    say(port, clears, "SM,100,300,0")
    assert port.paper.place != at


def test_the_pen_arrives_when_its_servo_does():
    port = board()
    begun = port.now
    say(port, "SC,4,20641", "SC,5,15248", "SC,12,100", "SP,0,200", patience=2)
    told, value = port.paper.power[-1]
    assert value == 15248 and port.pen_is_down
    slow = (abs(15248 - 12000) / 100) * 0.024  # it stood at its own zero
    assert told == pytest.approx(begun + slow - PROFILE.pen.down_time, abs=0.03)


def test_motors_can_be_off_and_forget():
    port = board()
    say(port, "EM,1,1", "SM,10,50,50", patience=1)
    assert say(port, "QE").startswith("16,16") and say(port, "QS").startswith("50,50")
    say(port, "EM,0,0")
    assert say(port, "QE").startswith("0,0") and say(port, "QS").startswith("0,0")
    dead = board("motors=0")
    assert say(dead, "QC").startswith("0394,0150")
    say(dead, "SM,10,50,50", patience=1)
    assert dead.paper.place[:2] == (0, 0) and say(dead, "QS").startswith("50,50")


def ticks(command, signed, left, place):
    """LT one tick after the other, as it is documented; the steps at every tick."""
    _, count, r1, g1, r2, g2, *clear = (
        int(part) if part.lstrip("-").isdigit() else part for part in command.split(",")
    )
    track = []
    for motor, (rate, gain) in enumerate(((r1, g1), (r2, g2))):
        way = 1 if rate > 0 or (rate == 0 and gain >= 0) else -1
        if clear:
            left[motor] = FULL - 1 if signed and way < 0 else 0
        speed = (rate if signed else abs(rate)) - gain // 2
        steps = []
        for _ in range(count):
            speed += gain
            assert signed or 0 <= speed < FULL
            left[motor] += speed
            if not 0 <= left[motor] < FULL:
                place[motor] += way if not signed else (1 if speed > 0 else -1)
                left[motor] %= FULL
            steps.append(place[motor])
        track.append(steps)
    return np.array(track).T


@pytest.mark.parametrize("version", ["2.7.0", "3.0.0"])
def test_lt_comes_where_it_should_within_a_step(version):
    """A page's moves, tick by tick by another implementation, against the places they were meant to be."""
    fast = msgspec.structs.replace(PROFILE.limits, acceleration=profiles.Acceleration(5000))
    profile = msgspec.structs.replace(PROFILE, firmware=version, limits=fast)
    made = plan(page(words=2), profile)
    ends = [block for block in made.blocks if isinstance(block, Timed)][:260]
    left, place, worst, index = [0, 0], [0, 0], 0.0, 0
    for command in ebb.program(made.blocks, profile):
        text = command.data.decode().strip()
        if text[:2] not in ("LT", "SM") or index >= len(ends):
            continue
        block = made.blocks[command.done - 1]
        if isinstance(block, Timed):
            index += 1
            if text.startswith("LT"):
                ticks(text, version >= "3", left, place)
            meant = 80 * np.array([block.x + block.y, block.x - block.y])
            worst = max(worst, float(np.abs(meant - place).max()))
    assert index == 260 and worst < 1.0


@settings(max_examples=30)
@given(
    st.integers(1, 900),
    st.integers(0, FULL // 8),
    st.integers(-(10**5), 10**5),
    st.integers(0, FULL - 1),
    st.booleans(),
)
def test_all_ticks_at_once_are_the_same_as_one_after_the_other(count, rate, gain, begin, signed):
    gain = 2 * gain
    if not signed and (rate + gain // 2 < 0 or rate - gain // 2 + gain * count < 0):
        gain = 0
    left, place = [begin, begin], [0, 0]
    steps = ticks(f"LT,{count},{rate},{gain},{-rate},{-gain if signed else gain}", signed, left, place)
    move = ebb_engine.by_time(count, (rate, -rate), (gain, -gain if signed else gain), [begin, begin], signed)
    if not signed or abs(rate) + abs(gain) * count < FULL:
        assert (move.steps == steps).all() and list(move.after) == left


@pytest.mark.parametrize(("half", "expected"), [(True, 0.077), (False, 0.077)])
def test_lm_takes_the_time_its_documentation_says(half, expected):
    """Example 6: 500 to 800 steps a second over 50 steps takes 77 ms."""
    move = ebb_engine.by_steps((50, 0), (42950000, 0), (13400, 0), [0, 0], half)
    assert move.steps[-1].tolist() == [50, 0] and move.ticks * ebb_engine.TICK == pytest.approx(expected, abs=0.001)


def test_lt_does_what_its_documentation_says():
    """Example 3: 200 to 100 and 100 to 200 steps a second over half a second: 75 steps each."""
    move = ebb_engine.by_time(12500, (17179000, 8592000), (-687, 687), [0, 0], False)
    assert np.abs(move.steps[-1] - 75).max() <= 1
