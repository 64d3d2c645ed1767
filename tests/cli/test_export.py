"""`handout export`: programs of plotters as files, for the machine that is named or the usual one of the suffix."""

import json
from pathlib import Path

import pytest

from handout import profiles
from handout.plotting import open_port


def draws(name, device, ends):
    """How many strokes a file draws, sent to the simulated machine one instruction after the other."""
    profile = profiles.find(device, "plotter")
    port = open_port("sim:", profile)
    while port.read(1.0):
        pass
    for line in Path(name).read_bytes().splitlines():
        port.write(line + ends)
        port.read(20.0)
    return len(port.executed_drawing().strokes)


def test_one_text_for_two_machines(call):
    Path("letter.txt").write_text("Dear Ada!", encoding="utf-8")
    facts = json.loads(call("export", "letter.txt", "-o", "a.gcode", "-o", "a.hpgl", "--seed", 1, "--json")[0])
    assert facts["characters"] == len("DearAda!") and facts["files"] == ["a.gcode", "a.hpgl"]
    assert set(facts["devices"]) == {"plotter-grbl-servo", "plotter-hpgl"} and min(facts["devices"].values()) > 5
    assert draws("a.gcode", "grbl-servo", b"\n") == draws("a.hpgl", "hpgl", b"") == facts["strokes"]
    assert b"Ada" not in Path("a.hpgl").read_bytes()


def test_the_same_seed_gives_the_same_program_and_write_gives_it_too(call):
    call("export", "Dear Ada", "-o", "a.hpgl", "--page", "A5", "--seed", 3, "-q")
    call("write", "Dear Ada", "-o", "b.hpgl", "-o", "b.svg", "--page", "A5", "--seed", 3, "-q")
    assert Path("a.hpgl").read_bytes() == Path("b.hpgl").read_bytes()
    call("write", "Dear Ada", "-o", "c.hpgl", "--page", "A5", "--seed", 3, "-q", "--device", "hp-7475a")
    assert b"SP0;" in Path("c.hpgl").read_bytes() and b"SP0;" not in Path("b.hpgl").read_bytes()


def test_pages_are_numbered_and_told(call):
    out, err = call("export", "word " * 90, "--page", "A6", "-o", "job.plt", "--seed", 1, "--speed", "fast")
    assert out == "" and "Wrote job-1.plt, job-2.plt" in err and "on plotter-hpgl; seed 1" in err
    assert not Path("job.plt").exists()


def test_fit_makes_a_page_smaller_than_the_bed(call):
    wide = ["export", "a word and another word that go on " * 8, "--page", "420x297mm", "--margin", "5mm"]
    wide += ["-o", "a.hpgl", "--device", "hp-7475a"]
    refused = call(*wide, code=2)[1]
    assert "is outside the bed 0–" in refused and "plotter-hp-7475a: use --fit" in refused
    told = call(*wide, "--fit")[1]
    assert Path("a.hpgl").stat().st_size > 10_000 and "Written at 65% of its size, so that it fits." in told


def test_how_much_smaller_a_text_is_written_is_told(call):
    long = ["word " * 90, "--page", "A6", "--fit", "--seed", 1]
    (shrunk,) = json.loads(call("write", *long, "-o", "a.json", "--json")[0])["shrunk"]
    assert 0.6 < shrunk < 0.95 and json.loads(Path("a.json").read_text())["about"]["x_height"] == 2.5 * shrunk
    for verb in (["write", "-o", "a.png"], ["export", "-o", "a.gcode"], ["plot", "--dry-run", "a.svg"]):
        assert f"Written at {shrunk:.0%} of its size" in call(*verb, *long)[1]
    assert "of its size" not in call("write", "a word", *long[1:], "-o", "a.svg")[1]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-o", "a.hpgl", "--device", "grbl-z"], "a.hpgl: plotter-grbl-z speaks grbl, whose files end in .gcode"),
        (["-o", "a.gcode", "--device", "hp-7550a"], "a.gcode: plotter-hp-7550a speaks hpgl, whose files end in .hpgl"),
        (["-o", "a.svg"], "a.svg: programs of plotters end in .gcode"),
        (["-o", "a.gcode", "--device", "printer-pdf"], "printer-pdf is a printer"),
        (["-o", "a.gcode", "-o", "a.gcode"], "Two outputs would be written to a.gcode"),
        (["-o", "no/where.hpgl"], "no"),
    ],
)
def test_what_does_not_fit_is_one_sentence(call, arguments, said):
    out, err = call("export", "abc", *arguments, code=2)
    assert said in err and err.count("\n") == 1 and out == ""
    assert list(Path().iterdir()) == []


def test_write_refuses_the_same(call):
    err = call("write", "abc", "-o", "a.hpgl", "--device", "grbl-z", code=2)[1]
    assert "speaks grbl" in err and not Path("a.hpgl").exists()
