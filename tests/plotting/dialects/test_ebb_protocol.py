"""The EBB's language: commands as they are sent, answers in all their forms, slices of every firmware."""

from types import SimpleNamespace

import msgspec
import pytest
from cursive import page

from handout import profiles
from handout.errors import InputError
from handout.plotting import plan
from handout.plotting.dialects import MoveBlock, Pause, PenBlock, Timed
from handout.plotting.dialects.ebb import DIALECT as ebb
from handout.plotting.dialects.ebb import protocol
from handout.plotting.dialects.ebb.conversation import EbbConversation
from handout.plotting.dialects.ebb.protocol import About, Error, Note, Ok, Values
from handout.plotting.dialects.ebb.stepping import UNKNOWN, Version

PROFILE = profiles.find("axidraw-v3", "plotter")


def with_firmware(version, **bed):
    return msgspec.structs.replace(
        PROFILE, firmware=version, bed=msgspec.structs.replace(PROFILE.bed, **bed) if bed else PROFILE.bed
    )


def told(blocks, profile):
    """What is told after the opening."""
    commands = list(protocol.program(blocks, profile))[len(protocol.opening(profile)) :]
    return [command.data.decode() for command in commands], [command.done for command in commands]


@pytest.mark.parametrize(
    ("line", "meant"),
    [
        (b"OK", Ok("")), (b"LT", Ok("LT")), (b"SP\n", Ok("SP")),
        (b"!8 Err: Unknown command 'XX:5858'", Error(8, "!8 Err: Unknown command 'XX:5858'")),
        (b"SM,!4 Err: Missing parameter(s)", Error(4, "!4 Err: Missing parameter(s)")),
        (b"!0 Err: <axis1> step rate > 25K steps/second.", Error(0, "!0 Err: <axis1> step rate > 25K steps/second.")),
        (b"EBBv13_and_above EB Firmware Version 2.4.2", About(Version(2, 4, 2), False)),
        (b"V,EBBv13_and_above EB Firmware Version 3.0.3", About(Version(3, 0, 3), True)),
        (b"QM,1,0,1,1", Values("QM", (1, 0, 1, 1))), (b"1421,-429", Values("", (1421, -429))),
        (b"QS,-3,4", Values("QS", (-3, 4))), (b"0394,0300", Values("", (394, 300))), (b"3E", Values("QG", (0x3E,))),
        (b"1,50,1200,18634,9848", Values("", (1, 50, 1200, 18634, 9848))), (b"hello", Note("hello")),
        (b"Limit switch triggered. PortB=0E", Note("Limit switch triggered. PortB=0E")),
    ],
)  # fmt: skip
def test_answers_are_understood(line, meant):
    assert protocol.reply(line) == meant


def test_lines_end_as_they_like():
    pieces = [b"OK\r\n1421,-429\n\rOK\r\nQM,0,0,0,0\n\rLT\nS", b"P\n"]
    port = SimpleNamespace(read=lambda _: pieces.pop(0))
    board = EbbConversation(port, 1.0, print, lambda *_: None)
    told = [Ok(""), Values("", (1421, -429)), Ok(""), Values("QM", (0, 0, 0, 0)), Ok("LT")]
    assert board.replies(1.0) == told and board.replies(1.0) == [Ok("SP")]


def test_errors_are_said_in_words():
    assert "a command it does not know" in protocol.reply(b"!8 Err: Unknown command 'A:41'").description
    assert "unknown here" in protocol.reply(b"!99 Err: whatever").description


@pytest.mark.parametrize(("text", "version"), [("2.8.1", (2, 8, 1)), ("3.0", (3, 0, 0)), ("", UNKNOWN), ("x", UNKNOWN)])
def test_versions(text, version):
    assert Version.from_text(text) == version


def test_the_opening_sets_the_pen_and_goes_to_zero():
    assert protocol.opening(with_firmware("2.8.1")) == [
        b"SC,4,20641\r", b"SC,5,15248\r", b"SC,11,1423\r", b"SC,12,1028\r", b"SP,1,130\r", b"HM,1200\r"
    ]  # fmt: skip
    assert protocol.opening(with_firmware("2.8.1", zero="here"))[-1] == b"CS\r"
    assert protocol.opening(with_firmware("2.6.1"))[-1] == b"SP,1,130\r"  # HM is not known


def test_the_servo_has_arrived_before_the_pen_is_taken_for_down():
    for time in (0.0, 0.05, 0.2, 1.0):
        rate = protocol._rate(5393, time, protocol.SERVO_PERIOD)
        assert 5393 / rate * protocol.SERVO_PERIOD <= max(time, 0.024) and 1 <= rate <= 65535


def test_a_pen_comes_down_as_slowly_as_it_is_told_to():
    pen = msgspec.structs.replace(PROFILE.pen, ramp=profiles.Time(0.4))
    assert protocol.prepare_pen(pen)[3] == b"SC,12,324\r"  # 5393 in 400 ms, a little more every 24 ms
    assert protocol.pen(True, pen) == b"SP,0,547\r"  # and what the profile waits for, after most of that


def test_pens_are_not_repeated_and_rests_are_delays():
    blocks = [PenBlock(False), PenBlock(False), PenBlock(True), Pause(0.25), Pause(0.0), PenBlock(False)]
    commands, done = told(blocks, PROFILE)
    assert commands == ["SP,0,180\r", "SM,250,0,0\r", "SP,1,130\r"] and done == [3, 4, 6]  # the opening lifts it


def test_moves_that_keep_no_time_are_refused():
    with pytest.raises(InputError, match="another machine"):
        list(protocol.program([MoveBlock(1, 1, 1000)], PROFILE))


RUN = [Timed(1.0, 0.0, 0.010), Timed(2.5, 0.5, 0.010), Timed(3.0, 1.0, 0.0204), Timed(3.0, 1.0, 0.0206)]


def test_old_boards_are_told_whole_steps_and_milliseconds():
    commands, done = told(RUN, with_firmware("2.4.5"))
    assert commands == ["SM,10,80,80\r", "SM,10,160,80\r", "SM,20,80,0\r", "SM,21,0,0\r"] and done == [1, 2, 3, 4]
    assert told(RUN, with_firmware("")) == (commands, done)  # what every board knows
    assert told(RUN, with_firmware("2.4.5", gantry="cartesian"))[0][:2] == ["SM,10,80,0\r", "SM,10,120,40\r"]


@pytest.mark.parametrize(("version", "name"), [("2.5.3", "LM"), ("2.6.5", "LM"), ("2.7.0", "LT"), ("3.0.2", "LT")])
def test_newer_boards_are_told_accelerations(version, name):
    commands, _ = told(RUN, with_firmware(version))
    assert [command[:2] for command in commands[:3]] == [name] * 3
    if version < "3":
        assert commands[3] == "SM,21,0,0\r"
    if name == "LT":
        assert commands[0].startswith("LT,250,") and commands[0].endswith(",3\r")
        assert commands[1].count(",") == 5
        assert sum(int(command.split(",")[1]) for command in commands[:3]) == 1010


def test_every_command_of_a_page_is_short_ascii():
    made = plan(page(words=4), PROFILE)
    for version in ("2.2.7", "2.5.3", "2.8.1", "3.0.0"):
        profile = with_firmware(version)
        commands = list(ebb.program(made.blocks, profile))
        assert all(c.data.isascii() and c.data.endswith(b"\r") and len(c.data) < 65 for c in commands)
        done = [c.done for c in commands]
        assert done == sorted(done) and done[-1] == len(made.blocks)
        assert ebb.file(made, profile) == b"".join(c.data for c in commands)
