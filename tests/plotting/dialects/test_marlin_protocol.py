"""The dialect of Marlin: what is written, what is understood, what may still wait in its queue."""

import re

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout import profiles
from handout.plotting import plan
from handout.plotting.dialects import MoveBlock, Pause, PenBlock
from handout.plotting.dialects.marlin import DIALECT as marlin
from handout.plotting.dialects.marlin import protocol
from handout.plotting.dialects.marlin.controller import PlannerQueue

SERVO, ON_Z = profiles.find("marlin-servo", "plotter"), profiles.find("creality-ender-3", "plotter")
BLOCKS = [
    PenBlock(False), MoveBlock(10, 20, 6000), PenBlock(True), Pause(0.05), MoveBlock(10.5, 20, 900),
    MoveBlock(10.5, 20.25, 900), PenBlock(False),
    MoveBlock(40, 20, 6000), PenBlock(True),
]  # fmt: skip


def written(blocks, profile):
    lines = b"".join(command.data for command in protocol.program(blocks, profile)).decode().split()
    return lines[len(protocol.MODES) + (profile.bed.zero == "here") : -1]


def test_a_servo_waits_for_the_moves_before_it():
    assert written(BLOCKS, SERVO) == [
        "M400", "M280P0S40", "G4P150", "G1X10Y20F6000", "M400", "M280P0S90", "G4P200", "G4P50", "G1X10.5F900",
        "G1Y20.25", "M400", "M280P0S40", "G4P150", "G1X20.333Y20.167F6000", "G1X30.167Y20.083", "G1X40Y20",
        "M400", "M280P0S90", "G4P200",
    ]  # fmt: skip


def test_a_z_axis_moves_in_its_turn():
    assert written(BLOCKS[:5], ON_Z) == ["G1Z2F300", "G1X10Y20F6000", "G1Z0F300", "G4P50", "G1X10.5F900"]


def test_a_pen_follows_the_pressure():
    pressed = [PenBlock(True), MoveBlock(1, 1, 600, -0.1), MoveBlock(2, 1, 600, -0.1), MoveBlock(3, 1, 600, -0.2)]
    assert written(pressed, ON_Z)[1:] == ["G1X1Y1Z-0.1F600", "G1X2", "G1X3Z-0.2"]


def test_own_commands_lift_the_pen_and_are_not_trusted_to_keep_anything():
    pen = msgspec.structs.replace(SERVO.pen, lift="command", up_command=("M42 P4 S0",), down_command=("M42 P4 S255",))
    lines = written(
        [MoveBlock(5, 5, 600), PenBlock(True), MoveBlock(5, 6, 600)], msgspec.structs.replace(SERVO, pen=pen)
    )
    assert lines == ["G1X5Y5F600", "M400", "M42", "P4", "S255", "G4P200", "G1X5Y6F600"]


def test_commands_say_what_is_done_with_them():
    done = [command.done for command in protocol.program(BLOCKS, SERVO)]
    assert done == sorted(done) and done[-1] == len(BLOCKS)
    before = [command.done for command in protocol.program(BLOCKS, SERVO) if b"X20.333" in command.data]
    assert before == [7]  # the first third of a move is not the move


@given(st.integers(1, 10**7), st.text(st.characters(codec="ascii", exclude_characters="\n\r*"), max_size=60))
def test_a_line_is_framed_with_the_xor_of_its_bytes(number, text):
    line = protocol.frame_line(number, text.encode())
    body, _, checksum = line.rpartition(b"*")
    sum_ = 0
    for byte in body:
        sum_ ^= byte
    assert line.endswith(b"\n") and line.count(b"\n") == 1 and int(checksum) == sum_
    assert body.startswith(b"N%d " % number)


def test_a_known_line():
    assert protocol.frame_line(3, b"T0\n") == b"N3 T0*57\n"  # the example of the protocol's description


@given(st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500), st.floats(1, 60000)), max_size=30))
def test_moves_are_read_back_as_they_were_meant(moves):
    state = {"X": None, "Y": None, "F": None}
    lines = [command.data for command in protocol.program([MoveBlock(*move) for move in moves], ON_Z)]
    blocks = [MoveBlock(*move) for move in moves]
    for line, block in zip(lines[:-1][-len(blocks) :] if moves else [], blocks, strict=True):
        assert line.startswith(b"G1") and len(protocol.frame_line(10**6, line)) <= 70
        state |= {letter: float(number) for letter, number in re.findall(r"([XYF])(-?[\d.]+)", line.decode())}
        assert state["X"] == pytest.approx(block.x, abs=5.1e-4) and state["Y"] == pytest.approx(block.y, abs=5.1e-4)
        assert state["F"] == pytest.approx(block.feed, abs=0.051)


@pytest.mark.parametrize(
    ("line", "meant"),
    [
        (b"ok\r\n", protocol.Ok()),
        (b"ok N12 P14 B3", protocol.Ok(12, 14, 3)),
        (b"ok P15 B3", protocol.Ok(None, 15, 3)),
        (b"ok T:21.3 /0.0 B:20.0 /0.0 @:0 B@:0", protocol.Ok()),
        (b"okay", protocol.Note("okay")),
        (b"Resend: 12", protocol.Resend(12)),
        (b"Resend:12", protocol.Resend(12)),
        (b"rs 12", protocol.Resend(12)),
        (b"rs N12", protocol.Resend(12)),
        (b"Error:checksum mismatch, Last Line: 11", protocol.Fault("checksum mismatch, Last Line: 11")),
        (
            b"Error:Line Number is not Last Line Number+1, Last Line: 3",
            protocol.Fault("Line Number is not Last Line Number+1, Last Line: 3"),
        ),
        (
            b"Error:No Checksum with line number, Last Line: 3",
            protocol.Fault("No Checksum with line number, Last Line: 3"),
        ),
        (b"Error:Printer halted. kill() called!", protocol.Error("Printer halted. kill() called!")),
        (b"echo:busy: processing", protocol.Busy(False)),
        (b"echo:busy: paused for user", protocol.Busy(True)),
        (b"start", protocol.Start()),
        (b"Cap:EMERGENCY_PARSER:1", protocol.Capability("EMERGENCY_PARSER", True)),
        (
            b"FIRMWARE_NAME:Marlin 2.1.2 (Jan 1 2023) SOURCE_CODE_URL:x PROTOCOL_VERSION:1.0",
            protocol.Identity("Marlin 2.1.2 (Jan 1 2023)"),
        ),
        (b"echo:  M201 X500.00 Y500.00 Z100.00", protocol.SettingsLine("M201", {"X": 500.0, "Y": 500.0, "Z": 100.0})),
        (
            b"echo:  M205 B20000.00 S0.00 T0.00 J0.08",
            protocol.SettingsLine("M205", {"B": 20000, "S": 0, "T": 0, "J": 0.08}),
        ),
        (b"X:10.00 Y:-2.50 Z:5.00 E:0.00 Count X:800 Y:-200 Z:2000", protocol.Position(10.0, -2.5, 5.0)),
        (b'echo:Unknown command: "M205 B0"', protocol.Unknown("M205 B0")),
        (b"echo:Home XY First", protocol.Unhomed()),
        (b"echo:endstops hit:  X:12.30", protocol.Struck("endstops hit:  X:12.30")),
        (b"//action:cancel", protocol.Note("//action:cancel")),
        (b"\xff\xfe", protocol.Note("\ufffd\ufffd")),
    ],
)
def test_replies(line, meant):
    assert protocol.reply(line) == meant
    assert type(protocol.reply(line)) is type(meant)


@given(st.binary(max_size=60))
def test_anything_is_some_reply(line):
    assert protocol.reply(line) is not None


def test_errors_have_plain_words():
    assert "switch it off and on" in protocol.Error("Printer halted. kill() called!").description
    assert "heater" in protocol.Error("Thermal Runaway, system stopped! Heater_ID: bed").description
    assert protocol.Error("something new").description == "“something new”"


def test_what_may_still_be_in_the_queue():
    held = PlannerQueue(queue=2, steps=80)
    for number, line in enumerate([b"G21\n", b"G1X10Y10F600\n", b"G1X20\n", b"G1X30\n"], 1):
        held.note_worked(line, number)
    assert held.executed_count == 2 and held.seconds == pytest.approx(2.0)
    held.note_worked(b"G1X30.05\n", 5)  # four steps make no block: their way is made with the next
    assert held.executed_count == 2
    held.note_worked(b"G1X30.1\n", 6)
    assert held.executed_count == 3
    held.at_most(1)
    assert held.executed_count == 4  # the last block makes the ways of 5 and 6
    held.note_worked(b"M400\n", 7)
    assert held.executed_count == 7 and held.seconds == 0


def test_a_file_says_what_it_is_and_has_no_numbers():
    from cursive import page

    made = plan(page(words=1), ON_Z)
    text = marlin.file(made, ON_Z).decode("ascii")
    lines = text.splitlines()
    assert lines[0] == "; written by handout" and "; machine: plotter-creality-ender-3" in lines
    body = [line for line in lines if not line.startswith(";")]
    assert body[:4] == ["G91", "G1Z2F300", "G90", "G28XY"] and body[-1] == "M400"
    assert "*" not in text and not any(line.startswith("N") for line in body) and max(map(len, body)) <= 70
