"""G-code files: complete, the same every time, and harmless in their comments."""

import dataclasses

import msgspec
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles
from handout.plotting import open_port, plan, to_gcode
from handout.plotting.dialects.gcode import comment

PROFILE = profiles.find("simulated", "plotter")
MADE = plan(page(words=1), PROFILE)
BODY = [line for line in to_gcode(MADE).split(b"\n") if not line.startswith(b";")]


def test_the_header_says_what_it_is():
    text = to_gcode(plan(page(words=3), PROFILE)).decode("ascii")
    header = [line for line in text.splitlines() if line.startswith(";")]
    for said in (
        "; title: loops",
        "; hand: none",
        "; seed: 1",
        "; page: A5 148 x 210 mm",
        "; machine: plotter-simulated",
    ):
        assert said in header
    assert any(line.startswith("; time: ") for line in header)
    body = text.splitlines()[len(header) :]
    assert body[:4] == ["G21", "G90", "G94", "M3S40"] and body[-2:] == ["X0Y0F9000", "G4P0"]
    assert "M2" not in body and "M30" not in body


def test_the_same_drawing_gives_the_same_bytes():
    assert to_gcode(plan(page(), PROFILE)) == to_gcode(plan(page(), PROFILE))


def test_a_file_sent_line_by_line_draws_the_drawing():
    drawing = page(words=2)
    port = open_port("sim:", PROFILE)
    program = to_gcode(plan(drawing, PROFILE))
    while port.read(1.0):
        pass
    answers = []
    for line in program.splitlines(keepends=True):
        port.write(line)
        answers.append(port.read(10.0).strip())
    assert set(answers) == {b"ok"}
    assert len(port.executed_drawing().strokes) == len(drawing.strokes)


def test_zero_here_is_said_once_at_the_beginning():
    here = msgspec.structs.replace(PROFILE, bed=msgspec.structs.replace(PROFILE.bed, zero="here"))
    lines = to_gcode(MADE, here).split(b"\n")
    assert lines.count(b"G92X0Y0") == 1 and b"G92X0Y0" not in BODY
    assert next(line for line in lines if not line.startswith(b";")) == b"G92X0Y0"


@pytest.mark.slow
@given(st.text())
def test_comments_cannot_command_the_machine(text):
    kept = comment(text)
    assert kept.isascii() and not set(kept) & set("?!~\x18\r\n")


@settings(deadline=None, max_examples=30)
@given(st.dictionaries(st.sampled_from(["title", "hand", "seed"]), st.text(max_size=120)))
def test_no_line_of_a_file_is_long_or_more_than_plain_ascii(about):
    text = to_gcode(dataclasses.replace(MADE, drawing=dataclasses.replace(MADE.drawing, about=about)))
    lines = text.split(b"\n")
    assert text.isascii() and not set(text) & set(b"?!~\x18\r") and max(map(len, lines)) <= 70
    assert [line for line in lines if not line.startswith(b";")] == BODY


def test_a_shouted_title_does_not_hold_the_machine():
    drawing = dataclasses.replace(page(words=1), about={"title": "Dear all!\nWho? é ~ ü"})
    text = to_gcode(plan(drawing, PROFILE))
    assert b"; title: Dear all Who e u\n" in text
    assert not set(text) & set(b"?!~\x18")
