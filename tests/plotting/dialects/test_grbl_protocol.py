"""The dialect: what is written, what is understood."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout import profiles
from handout.plotting.dialects import MoveBlock, Pause, PenBlock
from handout.plotting.dialects.grbl import protocol

SERVO, ON_Z = profiles.find("grbl-servo", "plotter"), profiles.find("grbl-z", "plotter")
BLOCKS = [
    PenBlock(False), MoveBlock(10, 20, 6000), PenBlock(True), Pause(0.05), MoveBlock(10.5, 20, 900),
    MoveBlock(10.5, 20.25, 900), PenBlock(False),
]  # fmt: skip


def commands(blocks, profile):
    """As in a file, without what comes before the first block and after the last."""
    program = list(protocol.program(blocks, profile, absolute=True))
    before, after = len(protocol.MODES), 1
    assert [command.done for command in program[:before]] == [0] * before
    assert [command.done for command in program[-after:]] == [len(blocks)] * after
    return program[before:-after]


def written(blocks, profile):
    return b"".join(command.data for command in commands(blocks, profile)).decode().split()


def test_a_servo_waits_and_nothing_is_repeated():
    assert written(BLOCKS, SERVO) == [
        "M3S40", "G4P0.15", "G1X10Y20F6000", "M3S90", "G4P0.2", "G4P0.05", "X10.5F900", "Y20.25", "M3S40", "G4P0.15",
    ]  # fmt: skip


def test_a_z_axis_moves_at_its_own_feed():
    assert written(BLOCKS, ON_Z) == [
        "G1Z2.5F900", "G1X10Y20F6000", "G1Z0F900", "G4P0.05", "X10.5F900", "Y20.25", "G1Z2.5F900",
    ]  # fmt: skip


def test_the_pen_is_told_only_when_it_changes():
    assert written([PenBlock(True), PenBlock(True), PenBlock(False), PenBlock(False)], SERVO) == [
        "M3S90",
        "G4P0.2",
        "M3S40",
        "G4P0.15",
    ]


def test_commands_know_how_many_blocks_are_done():
    assert [command.done for command in commands(BLOCKS, SERVO)] == [0, 1, 2, 2, 3, 4, 5, 6, 6, 7]


@given(st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500), st.floats(1, 60000)), max_size=30))
def test_moves_are_read_back_as_they_were_meant(moves):
    state = {"X": None, "Y": None, "F": None}
    blocks = [MoveBlock(*move) for move in moves]
    lines = [command.data for command in commands(blocks, SERVO)]
    assert len(lines) == len(blocks)
    for line, block in zip(lines, blocks, strict=True):
        assert len(line) < 60 and not set(line) & set(b"?!~\x18 ")
        state |= {letter: float(number) for letter, number in re.findall(r"([XYF])(-?[\d.]+)", line.decode())}
        assert state["X"] == pytest.approx(block.x, abs=5.1e-4) and state["Y"] == pytest.approx(block.y, abs=5.1e-4)
        assert state["F"] == pytest.approx(block.feed, abs=0.051)


def test_on_the_wire_every_place_but_the_first_is_told_from_the_one_before():
    servo, on_z = ([c.data.decode().strip() for c in protocol.program(BLOCKS, p)][3:-1] for p in (SERVO, ON_Z))
    assert servo == [
        "M3S40", "G4P0.15", "G1X10Y20F6000", "M3S90", "G4P0.2", "G4P0.05", "G91X0.5F900", "Y0.25", "M3S40", "G4P0.15",
        "G90",
    ]  # fmt: skip
    assert on_z == [
        "G1Z2.5F900", "G1X10Y20F6000", "G1Z0F900", "G4P0.05", "G91X0.5F900", "Y0.25", "G90", "G1Z2.5F900",
    ]  # fmt: skip


@given(st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), min_size=1, max_size=40))
def test_relative_places_add_up_to_the_last_digit(points):
    relative, at = False, {"X": 0, "Y": 0}
    for line in (c.data.decode() for c in protocol.program([MoveBlock(*point, 600.0) for point in points], SERVO)):
        relative = (relative or "G91" in line) and "G90" not in line
        for letter, number in re.findall(r"([XY])(-?[\d.]+)", line):
            at[letter] = at[letter] * relative + round(1000 * float(number))
    assert at == {"X": round(1000 * points[-1][0]), "Y": round(1000 * points[-1][1])}


@pytest.mark.parametrize(
    ("line", "meant"),
    [
        (b"ok\r\n", protocol.Ok()),
        (b"error:9\r", protocol.Error(9)),
        (b"ALARM:2", protocol.Alarm(2)),
        (b"Grbl 1.1h ['$' for help]", protocol.Banner("Grbl 1.1h ['$' for help]")),
        (b"GrblHAL 1.1f", protocol.Banner("GrblHAL 1.1f")),
        (b"<Idle|MPos:0.0,0.0,0.0|Bf:15,128>", protocol.Status("Idle", "", "|MPos:0.0,0.0,0.0|Bf:15,128")),
        (b"<Hold:1|WPos:1,2,3>", protocol.Status("Hold", "1", "|WPos:1,2,3")),
        (b"$110=6000.000", protocol.Setting(110, 6000.0)),
        (b"[OPT:V,15,128]", protocol.Sizes(15, 128)),
        (b"[OPT:VNMZHTL,100,1024]", protocol.Sizes(100, 1024, forward=True)),
        (b"[MSG:Caution: Unlocked]", protocol.Note("[MSG:Caution: Unlocked]")),
        (b"\xff\xfe", protocol.Note("\ufffd\ufffd")),
        (b"okay", protocol.Note("okay")),
    ],
)  # fmt: skip
def test_replies(line, meant):
    assert protocol.reply(line) == meant
    assert type(protocol.reply(line)) is type(meant)


@given(st.binary(max_size=60))
def test_anything_is_some_reply(line):
    assert protocol.reply(line) is not None


def test_errors_and_alarms_have_plain_words():
    assert protocol.Error(9).description == "error:9, it is locked after an alarm"
    assert "travel" in protocol.Alarm(2).description
    assert "unknown" in protocol.Error(99).description
    assert set(protocol.ERRORS) == {*range(1, 18), *range(20, 39)} and set(protocol.ALARMS) >= set(range(1, 11))
