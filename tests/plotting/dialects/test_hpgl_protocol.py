"""HP-GL out of blocks and back: short instructions, nothing but ASCII, the path within half a plotter unit."""

import dataclasses
import itertools
import re

import msgspec
import numpy as np
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles, shipped
from handout.errors import ProfileError
from handout.plotting import plan
from handout.plotting.dialects import MoveBlock, Pause, PenBlock, dialect
from handout.plotting.dialects.hpgl import protocol
from handout.plotting.dialects.hpgl.controller import PenPosition

PROFILE = profiles.find("hp-7475a", "plotter")
ONE_PEN = profiles.find("hpgl", "plotter")
FAST = float(PROFILE.limits.travel_speed) * 60

places = st.floats(-400, 400).map(lambda v: round(v, 4))
strokes = st.lists(
    st.tuples(st.floats(3, 400), st.lists(st.tuples(places, places), min_size=1, max_size=40)), min_size=1, max_size=6
)


def blocks(drawn):
    """What planning tells of strokes, each a velocity (mm/s) and its places."""
    told = [PenBlock(False)]
    for speed, points in drawn:
        told += [
            MoveBlock(*points[0], FAST),
            PenBlock(True),
            *(MoveBlock(*point, speed * 60) for point in points[1:]),
            PenBlock(False),
        ]
    return [*told, MoveBlock(0.0, 0.0, FAST)]


def drawn(instructions):
    """The strokes that instructions draw, in units, each with the velocity at its end."""
    found, at, down, speed = [], None, False, None
    for name, numbers in instructions:
        points = list(zip(numbers[::2], numbers[1::2], strict=True)) if name in ("PU", "PD") else []
        if name == "VS":
            (speed,) = numbers
        elif name == "PD":
            if not down:
                found.append([[at], None])
            found[-1][0] += points
            found[-1][1] = speed if points else found[-1][1]
        down = name == "PD" if name in ("PU", "PD") else down
        at = points[-1] if points else at
    return found


@settings(deadline=None, max_examples=40)
@given(strokes)
def test_a_path_comes_back_within_half_a_unit(meant):
    commands = list(protocol.program(blocks(meant), PROFILE, absolute=True))
    data = b"".join(command.data for command in commands)
    assert data.isascii() and re.fullmatch(rb"([A-Z]{2}[-0-9.,]*;)+", data)
    assert max(len(command.data) for command in commands) <= 40
    back = drawn(protocol.read_instructions(data))
    assert len(back) == len(meant)
    for (points, speed), (wanted, path) in zip(back, meant, strict=True):
        assert np.abs(np.array(points) - np.array(path) * PROFILE.limits.steps_per_mm).max() <= 0.5 + 1e-9
        assert speed is None or speed * 10 == pytest.approx(wanted, abs=0.05 + 1e-9)


@settings(deadline=None, max_examples=40)
@given(strokes)
def test_every_block_is_done_by_one_command(meant):
    told = blocks(meant)
    done = [command.done for command in protocol.program(told, PROFILE)]
    assert done == sorted(done) and done[0] == 0 and done[-1] == len(told)
    moves = 0
    for command in protocol.program(told, PROFILE):
        moves += sum(len(instruction.points) for instruction in protocol.read_instructions(command.data))
        assert moves == sum(isinstance(block, MoveBlock) for block in told[: command.done])


def test_a_program_word_by_word():
    told = [
        PenBlock(False),
        MoveBlock(10, 20, FAST),
        PenBlock(True),
        MoveBlock(11, 20, 2280),
        MoveBlock(11, 21.5, 2280),
        MoveBlock(12, 22, 4560),
    ]
    told += [Pause(1.0), PenBlock(False), MoveBlock(0, 0, FAST)]
    data = [command.data for command in protocol.program(told, PROFILE, absolute=True)]
    assert data[:3] == [b"IN;", b"SP1;", b"PU;"]
    assert data[3:8] == [b"PU;", b"PU402,804;", b"PD;", b"VS3.8;", b"PD442,804,442,864;"]
    assert data[8:] == [b"VS7.6;", b"PD482,884;", b"PU;", b"PU0,0;", b"PU;", b"SP0;"]


def test_on_the_wire_places_are_told_from_one_to_the_next_and_the_pen_twice():
    told = [
        PenBlock(False),
        MoveBlock(10, 20, FAST),
        PenBlock(True),
        MoveBlock(11, 20, 2280),
        MoveBlock(11, 21.5, 2280),
        PenBlock(False),
    ]
    data = [command.data for command in protocol.program([*told, MoveBlock(0, 0, FAST)], PROFILE)]
    assert data[3:] == [
        b"PU;PU;", b"PA402,804;", b"PD;PD;", b"VS3.8;", b"PR40,0,0,60;", b"PU;PU;", b"PR-442,-864;", b"PU;", b"SP0;"
    ]  # fmt: skip


@settings(deadline=None, max_examples=40)
@given(strokes)
def test_what_is_told_from_one_to_the_next_leads_to_the_same_places(meant):
    followed = [PenPosition(), PenPosition()]
    for plotter, absolute in zip(followed, (True, False), strict=True):
        for command in protocol.program(blocks(meant), PROFILE, absolute=absolute):
            assert len(command.data) <= 40
            plotter.send(command.data)
    assert followed[0].at == followed[1].at and not followed[1].is_missed(*followed[0].at)


def test_pens_and_rotation_are_those_of_the_profile():
    turned = msgspec.structs.replace(ONE_PEN, hpgl=msgspec.structs.replace(ONE_PEN.hpgl, rotation=90, pen=3))
    data = [command.data for command in protocol.program([PenBlock(False)], turned, absolute=True)]
    assert data == [b"IN;", b"RO90;", b"IP;", b"IW;", b"SP3;", b"PU;", b"PU;", b"PU;"]


def test_a_velocity_is_not_repeated():
    data = b"".join(command.data for command in protocol.program(plan(page(words=4), PROFILE).blocks, PROFILE))
    told = [numbers[0] for name, numbers in protocol.read_instructions(data) if name == "VS"]
    assert told and all(a != b for a, b in itertools.pairwise(told))
    steps = np.array(told) / 0.38
    assert np.abs(steps - np.round(steps)).max() < 1e-6


def test_a_file_says_what_the_wire_says():
    made = plan(page(words=2), PROFILE)
    data = dialect("hpgl").file(made, PROFILE)
    assert data.isascii() and max(map(len, data.splitlines())) <= 40
    assert data.replace(b"\n", b"") == b"".join(
        command.data for command in protocol.program(made.blocks, PROFILE, absolute=True)
    )


@settings(deadline=None, max_examples=10)
@given(st.text())
def test_user_text_reaches_no_file(text):
    drawing = page(words=1)
    titled = dataclasses.replace(drawing, about={"title": text, "hand": text})
    files = {dialect("hpgl").file(plan(each, PROFILE), PROFILE) for each in (drawing, titled)}
    assert len(files) == 1


@pytest.mark.parametrize(
    ("answer", "numbers"),
    [(b"812", (812.0,)), (b" 0,-12,1\r", (0.0, -12.0, 1.0)), (b"7475A", None), (b"", None), (b"\xff1", None)],
)
def test_answers(answer, numbers):
    assert protocol.numbers(answer) == numbers


def test_errors_are_explained():
    assert protocol.error(8) == (
        "HP-GL error 8, a move while its pinch wheels were raised: load the paper, lower the lever"
    )
    assert "bytes were lost" in protocol.line_error(16) and "unknown" in protocol.error(99)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('lift = "own"', 'lift = "servo"', 'pen.lift = "own" and dialect = "hpgl" belong together'),
        ("pens = 1\npen = 1", "pens = 1\npen = 2", r"hpgl\.pen = 2 is beyond hpgl\.pens = 1"),
        ('speed_step = "10mm/s"', 'speed_step = "0mm/s"', r"hpgl\.speed_step = 0 is outside 0.1 to 100"),
        ('origin = "bottom-left"', 'zero = "here"', "bed.zero = 'here' must be \"kept\""),
        ('speed_step = "10mm/s"', "rotation = 45", r"hpgl\.rotation: .*45"),
    ],
)
def test_a_slip_in_a_profile_is_refused(tmp_path, old, new, said):
    text = (shipped.folder("devices") / "plotter-hpgl.toml").read_text(encoding="utf-8")
    assert text.count(old) == 1
    (tmp_path / "plotter-mine.toml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ProfileError, match=said):
        profiles.read_profile(tmp_path / "plotter-mine.toml")
