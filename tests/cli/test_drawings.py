"""A drawing in the place of a text: plotted, previewed, exported; what it is not is said."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from handout.cli import cli
from handout.errors import InputError
from handout.sources import read_drawing

SVG = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"
 width="60mm" height="40mm" viewBox="0 0 60 40"><g inkscape:groupmode="layer" inkscape:label="frame" fill="none"
 stroke="#c01020"><rect x="5" y="5" width="50" height="30"/></g><path d="M50 10h2M10 10h2M50 12h2" stroke="navy"
 fill="none"/><text>hello</text></svg>"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    (tmp_path / "drawing.svg").write_text(SVG, encoding="utf-8")
    return tmp_path


def run(*arguments):
    done = CliRunner().invoke(cli, list(arguments))
    if isinstance(done.exception, InputError):
        raise done.exception
    assert done.exit_code == 0, done.output
    return done


def test_a_drawing_is_previewed_and_what_is_left_out_is_said(folder):
    sheet = ("--page", "A5", "--margin", "9mm")
    done = run("plot", "drawing.svg", "--dry-run", "preview.json", "--json", "--svg-text", "leave", *sheet)
    facts = json.loads(done.stdout)
    assert (facts["strokes"], facts["pages"], facts["characters"]) == (4, 1, 0)
    assert "Left out of drawing.svg: 1 x text" in done.stderr
    assert "--page and --margin: a drawing keeps its own page." in done.stderr
    drawing = read_drawing("preview.json")
    assert [stroke.layer for stroke in drawing.strokes] == ["frame", "", "", ""] and not drawing.timed


def test_a_drawing_is_plotted_in_the_order_with_the_least_travel(folder):
    facts = json.loads(run("plot", "drawing.svg", "--port", "sim:", "--order", "travel", "--json", "-y").stdout)
    assert facts["pen_down_mm"] == pytest.approx(166, abs=0.1) and facts["executed_s"] > 1


@pytest.mark.slow
@pytest.mark.parametrize("what", ["drawing.svg", "the boats came home last night with the tide, and all was well"])
def test_a_preview_shows_the_order_of_travel_that_is_plotted(folder, what):
    def facts(*more):
        return json.loads(
            run("plot", what, "--page", "A6", "--device", "simulated", "--seed", "3", "--json", *more).stdout
        )

    written, moved = (facts("--dry-run", f"{order}.json", "--order", order) for order in ("writing", "travel"))
    assert moved["pen_up_mm"] < 0.95 * written["pen_up_mm"] and moved["pen_down_mm"] == written["pen_down_mm"]
    before, after = read_drawing("writing.json"), read_drawing("travel.json")
    assert after.pen_up == pytest.approx(moved["pen_up_mm"], abs=0.01)
    assert [s.xy[0].tolist() for s in after.strokes] != [s.xy[0].tolist() for s in before.strokes]
    clock = [t for stroke in after.strokes for t in (stroke.t[0], stroke.t[-1])]
    assert clock == sorted(clock) and after.duration == pytest.approx(before.duration)
    plotted = facts("--port", "sim:", "--order", "travel", "-y")
    assert plotted["pen_up_mm"] == moved["pen_up_mm"]


def test_travel_is_shown_in_previews_when_asked(folder):
    run("plot", "drawing.svg", "--dry-run", "p.svg", "--dry-run", "p.png", "--dry-run", "p.pdf", "--dpi", "72", "-q")
    run(
        *("plot", "drawing.svg", "--dry-run", "t.svg", "--dry-run", "t.png", "--dry-run", "t.pdf", "--dpi", "72", "-q"),
        "--show-travel",
    )
    assert 'id="travel" class="travel" display="none"' in (folder / "p.svg").read_text(encoding="utf-8")
    text = (folder / "t.svg").read_text(encoding="utf-8")
    assert 'class="show-travel"' in text and 'display="none"' not in text
    assert red(folder / "t.png") > red(folder / "p.png") + 50  # a stroke of the drawing is red itself
    assert len((folder / "t.pdf").read_bytes()) > len((folder / "p.pdf").read_bytes())


def red(path):
    """Pixels of the colour that travel is drawn in."""
    page = np.asarray(Image.open(path).convert("RGB")).astype(int)
    return int((page[..., 0] - page[..., 2] > 60).sum())


def test_travel_is_refused_where_it_cannot_be_seen(folder):
    for arguments in (["--dry-run", "a.json"], ["--dry-run", "a.png", "--transparent"], ["--port", "sim:"]):
        with pytest.raises(InputError, match=r"[Tt]ravel"):
            run("plot", "drawing.svg", "--show-travel", *arguments)


def test_a_drawing_is_exported(folder):
    run("export", "drawing.svg", "-o", "job.gcode", "--order", "travel", "-q")
    assert "G1" in (folder / "job.gcode").read_text(encoding="ascii")


def test_a_name_of_no_file_is_refused_and_not_written_out(folder):
    for verb in (("plot", "nosuch.svg", "--dry-run", "a.svg"), ("export", "nosuch.txt", "-o", "a.gcode")):
        with pytest.raises(InputError, match="There is no file nosuch"):
            run(*verb)
    run("plot", "see nosuch.svg", "--dry-run", "a.svg")
    assert (folder / "a.svg").exists() and not (folder / "a.gcode").exists()


def test_layers_have_pens_of_their_own_speed_and_may_be_left_out(folder):
    def planned(*layers):
        named = [word for layer in layers for word in ("--layer", layer)]
        done = run(
            "plot", "drawing.svg", "--layers", "colour", *named, "--dry-run", "a.json", "--dry-run", "a.svg", "--json"
        )
        return json.loads(done.stdout)["planned_s"], [stroke.colour for stroke in read_drawing("a.json").strokes]

    (usual, order), (slow, turned) = planned(), planned("#000080, speed=10%, pen=the fine one")
    assert slow > usual + 0.5 and (order[0], turned[0]) == ("#c01020", "#000080")
    quick, shown = planned("#c01020,out")
    assert quick < usual and set(shown) == {"#000080"}
    assert "#d2d2d2" in (folder / "a.svg").read_text(), "what is left out is pale"
    speeds = [(f"#c01020,speed={speed}", "5% to 2000%") for speed in ("fast", "0", "-50%", "nan", "5000%")]
    for wrong, says in (*speeds, ("navy", "no layer 'navy'; there are '#c01020', ")):
        with pytest.raises(InputError, match=says):
            planned(wrong)
    with pytest.raises(InputError, match="All layers are left out"):
        planned("#c01020,out", "#000080,out")
    with pytest.raises(InputError, match="say what makes one"):
        run("plot", "drawing.svg", "--layer", "#c01020,out", "--port", "sim:")
    done = run("plot", "drawing.svg", "--layers", "colour", "--layer", "#c01020,out", "--port", "sim:", "--json")
    assert json.loads(done.stdout)["pen_down_mm"] == pytest.approx(6, abs=0.2)


def test_a_drawing_is_not_written_out_as_a_text(folder):
    for given in (["drawing.svg"], ["--file", "drawing.svg"]):
        with pytest.raises(InputError, match=r"drawing\.svg is a drawing and no text: `handout plot"):
            run("write", *given, "-o", "a.png")
    assert not (folder / "a.png").exists()


def test_a_drawing_that_cannot_be_read_is_refused_and_nothing_is_written(folder):
    (folder / "bad.svg").write_text("<svg><path d='M0 0h1v1z'/></svg>")
    with pytest.raises(InputError, match=r"bad\.svg: There is no line to draw: 1 filled outline without a stroke"):
        run("plot", "bad.svg", "--dry-run", "p.svg")
    assert not (folder / "p.svg").exists()


TEXTS = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"
 width="100mm" height="80mm" viewBox="0 0 100 80"><g inkscape:groupmode="layer" inkscape:label="words">
 <text x="10" y="20" font-size="8">hum</text><text x="50" y="40" font-size="8" text-anchor="middle">num</text>
 <text x="90" y="20" font-size="8" style="text-anchor:end;fill:#2040c0">mum</text>
 <text transform="translate(20 70) rotate(-90)" font-size="10">
   <tspan>run</tspan></text>
 <text x="50" y="60" font-size="1em" xml:space="preserve">a<tspan dy="-4" font-size="5">n</tspan> m</text>
 <text x="50" y="70" font-size="6">\u65e5\u672c</text><text x="9" y="70" font-size="0.1">tiny</text></g></svg>"""


def test_texts_are_written_where_they_stand_and_it_is_said(folder):
    (folder / "texts.svg").write_text(TEXTS, encoding="utf-8")
    done = run("plot", "texts.svg", "--dry-run", "a.json", "--json", "--seed", "1", "--variation", "0")
    facts = json.loads(done.stdout)
    assert facts["drawing"]["page_mm"] == [100, 80] and set(facts["drawing"]["layers"]) == {"words"}
    assert set(facts["drawing"]["colours"]) == {"#000000", "#2040c0"} and facts["characters"] == 15
    assert any("\u65e5\u672c" in note and "no form" in note for note in facts["notes"])
    assert any("'tiny'" in note and "x-height" in note for note in facts["notes"])
    assert any(note.startswith("texts.svg asks for a sheet of 100 x 80 mm") for note in facts["notes"])
    strokes = read_drawing("a.json").strokes
    words = {}
    for stroke in strokes:
        words.setdefault(stroke.word, []).append(stroke.xy)
    boxes = [(np.concatenate(xy).min(axis=0), np.concatenate(xy).max(axis=0)) for xy in words.values()]
    (hum, num, mum, run_, *_) = boxes
    assert hum[0][0] == pytest.approx(10, abs=1.5) and hum[1][1] == pytest.approx(20, abs=0.5)
    assert (num[0][0] + num[1][0]) / 2 == pytest.approx(50, abs=1.5) and num[1][1] == pytest.approx(40, abs=0.5)
    assert mum[1][0] == pytest.approx(90, abs=1.5)
    assert run_[1][1] == pytest.approx(70, abs=1.5) and run_[1][0] == pytest.approx(20, abs=0.5)
    assert np.ptp(np.array(run_)[:, 1]) > 2 * np.ptp(np.array(run_)[:, 0])  # upwards
    assert np.ptp(np.array(num)[:, 1]) == pytest.approx(8 * 1.2 / 3.75, rel=0.2)  # the x-height


def test_texts_are_plotted_and_exported(folder):
    (folder / "texts.svg").write_text(TEXTS, encoding="utf-8")
    plotted = json.loads(run("plot", "texts.svg", "--port", "sim", "--json", "--seed", "1").stdout)
    exported = json.loads(run("export", "texts.svg", "-o", "a.gcode", "--json", "--seed", "1").stdout)
    assert plotted["drawing"] == exported["drawing"] and plotted["strokes"] == exported["strokes"] > 5
    over = run("plot", "drawing.svg", "--dry-run", "c.json")
    assert "'hello': it would go over the edge" in over.stderr and len(read_drawing("c.json").strokes) == 4
    left = run("export", "drawing.svg", "-o", "b.gcode", "--svg-text", "leave")
    assert "Left out of drawing.svg: 1 x text" in left.stderr


def test_a_file_of_text_alone_needs_a_size(folder):
    (folder / "a.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><text y="9">a</text></svg>')
    with pytest.raises(InputError, match="give its <svg> a width and a height"):
        run("plot", "a.svg", "--dry-run", "a.png")
