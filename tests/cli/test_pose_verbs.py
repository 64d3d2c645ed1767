"""`handout pose`, and --pose in every verb that takes it: the whole way, and what is said of wrong files."""

import json
import re

import numpy as np
import pytest
from PIL import Image

from handout.sinks import write_drawings
from handout.sources import read_drawing
from handout.values import Drawing, Page, Stroke

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">
<path d="M5 20C10 5 15 5 20 20S30 35 35 20" fill="none" stroke="black"/><path d="M5 35H35" fill="none"
stroke="black"/></svg>"""


def recording(path, seed=0, **without):
    """Letters-like strokes, pressed more downwards."""
    rng, strokes = np.random.default_rng(seed), []
    for number in range(8):
        t = np.linspace(0, 1, 70)
        y = 3 * np.sin(2 * np.pi * (1 + rng.uniform(0, 1)) * t + rng.uniform(0, 6))
        x = 9 * t + rng.normal() * np.sin(5 * t)
        down = np.gradient(y) / np.hypot(np.gradient(x), np.gradient(y))
        pose = {"pressure": 0.5 + 0.35 * down, "tilt": 0.5 + 0.1 * down, "azimuth": 0.4 * down, "rotation": 0.3 * down}
        xy = np.column_stack([x + 10 + 11 * (number % 4), y + 10 + 12 * (number // 4)])
        strokes.append(Stroke(t + 2 * number, xy, **(pose | without)))
    write_drawings([Drawing(tuple(strokes), Page(60, 40))], [path])
    return path


@pytest.fixture
def artist(tmp_path, call):
    path = recording(tmp_path / "pen.inkml")
    out, _ = call("pose", "learn", path, "-o", "artist.pose", "--json")
    assert json.loads(out)["strokes"] == 8
    return tmp_path / "artist.pose"


def test_a_library_is_learned_and_shown(artist, call):
    out, _ = call("pose", "show", artist, "-o", "sheet.png", "--json")
    facts = json.loads(out)
    assert list(facts["channels"]) == ["pressure", "tilt", "azimuth", "rotation"]
    assert facts["title"] == "artist" and 1 < facts["letter_height_mm"] < 20
    with Image.open("sheet.png") as sheet:
        assert len(sheet.convert("RGB").getcolors(1 << 24)) > 50


def test_writing_has_the_pose_in_all_channels(artist, call):
    text = ("write", "Zoë", "--page", "60x30mm", "--seed", "1")
    call(*text, "-o", "bare.inkml")
    call(*text, "-o", "held.inkml", "-o", "held.svg", "-o", "held.png", "--pose", artist)
    bare, held = read_drawing("bare.inkml"), read_drawing("held.inkml")
    for before, after in zip(bare.strokes, held.strokes, strict=True):
        where = np.column_stack([np.interp(before.t, after.t, after.xy[:, i]) for i in (0, 1)])
        np.testing.assert_allclose(where, before.xy, atol=1e-4)
        assert set(after.pose) == {"pressure", "tilt", "azimuth", "rotation"}
    assert held.about["pose"] == "artist"
    longest = max(held.strokes, key=lambda s: s.length)
    down = np.gradient(longest.xy[:, 1]) / np.maximum(np.hypot(*np.gradient(longest.xy, axis=0).T), 1e-9)
    assert np.corrcoef(down, longest.pressure)[0, 1] > 0.5  # as the artist presses


def test_a_z_plotter_goes_as_deep_as_the_pen_is_pressed(artist, call, tmp_path):
    """The depths of a program follow the pose, not the pressure that drawn hands have by themselves."""
    depths = []
    for more in ((), ("--pose", artist)):
        call("write", "nun", "--page", "60x30mm", "--seed", "1", "-o", "page.gcode", "--device", "grbl-z", *more)
        program = (tmp_path / "page.gcode").read_text(encoding="ascii")
        depths.append([float(depth) for depth in re.findall(r"Z(-?[\d.]+)", program)])
    assert len(set(depths[1])) > 10 and depths[0] != depths[1]
    assert min(depths[1]) >= -0.5 and max(depths[1]) == 2.5


@pytest.mark.parametrize("method", ["optimal", "average", "closest"])
@pytest.mark.parametrize("more", [(), ("--trajectory",), ("--trajectory", "--one-pass")])
def test_a_drawing_gets_the_pose(artist, call, tmp_path, method, more):
    (tmp_path / "drawing.svg").write_text(SVG, encoding="utf-8")
    out, _ = call("restyle", "drawing.svg", "--pose", artist, "--method", method, *more, "-o", "out.json", "--json")
    assert json.loads(out)["pose"] == "artist"
    before, after = read_drawing("drawing.svg"), read_drawing("out.json")
    assert len(after.strokes) == 2 and all(len(s.pose) == 4 for s in after.strokes)
    moved = np.abs(after.strokes[0].xy[-1] - before.strokes[0].xy[-1]).max()
    assert moved < (4 if more else 1e-6)


def test_a_style_and_a_pose_go_together(artist, call, tmp_path):
    (tmp_path / "drawing.svg").write_text(SVG, encoding="utf-8")
    _, err = call("restyle", "drawing.svg", "--pose", artist, "--style", "calm", "-o", "out.json")
    assert "in the style calm with the pose of artist" in err


def test_the_plot_takes_the_pose(artist, call):
    _, err = call("plot", "nun", "--page", "60x30mm", "--seed", "1", "--pose", artist, "--dry-run", "preview.json")
    assert err.count("no pen.pressed") == 1
    assert read_drawing("preview.json").strokes[0].tilt is not None


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("pose", "learn", "none.svc", "-o", "a.pose"), "Cannot read none.svc"),
        (("pose", "learn", "drawing.svg", "-o", "a.pose"), "no pose to learn from these recordings"),
        (("pose", "learn", "drawing.svg", "-o", "a.json"), "kept as .pose: use a.pose"),
        (("pose", "show", "artist.pose", "-o", "a.pdf"), "shown as .png: use a.png"),
        (("pose", "show", "drawing.svg.pose", "-o", "a.png"), "cannot be used"),
        (("write", "a", "--pose", "nobody", "-o", "a.svg"), "No pose library is called 'nobody'"),
        (("restyle", "drawing.svg", "--trajectory", "-o", "a.svg"), "name it with --pose"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(artist, call, tmp_path, arguments, said):
    (tmp_path / "drawing.svg").write_text(SVG, encoding="utf-8")
    (tmp_path / "drawing.svg.pose").write_text(SVG, encoding="utf-8")
    _, err = call(*arguments, code=2)
    assert said in err and err.count("\n") == 1
    assert not list(tmp_path.glob("a.*"))


@pytest.mark.parametrize("verb", ["write", "export"])
@pytest.mark.parametrize(("device", "even"), [("axidraw-v3", 1), ("grbl-z", 0)])
def test_a_program_that_presses_the_pen_evenly_is_told_of(artist, call, verb, device, even):
    suffix = {"axidraw-v3": "ebb", "grbl-z": "gcode"}[device]
    page = ("--page", "60x30mm", "--margin", "2mm", "--seed", "1", "--device", f"plotter-{device}")
    _, err = call(verb, "nun", *page, "--pose", artist, "-o", f"program.{suffix}")
    assert err.count("no pen.pressed") == even
