"""`handout restyle` and `handout asemic`: what they write, say and refuse."""

import json

import pytest

from handout.cli import main


def run(*args):
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in args])
    return left.value.code


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("styles") / "written.svg"
    assert run("write", "me", "--hand", "house-print", "--page", "A6", "--seed", 1, "-o", path, "-q") == 0
    return path


def test_restyles_what_write_wrote(written, tmp_path, capsys):
    out, pdf, ink = tmp_path / "out.svg", tmp_path / "out.pdf", tmp_path / "out.inkml"
    given = ("restyle", written, "--style", "blackletter", "--jitter", 1, "--shear", "5", "--smooth", 0.15, "--seed", 2)
    assert run(*given, "-o", out, "-o", pdf, "-o", ink, "--json", "-q") == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["style"] == "blackletter" and facts["strokes"] == facts["strokes_before"] and facts["duration_s"] > 1
    first = out.read_bytes()
    assert b"clipPath" in first and run(*given, "-o", out, "-q") == 0 and out.read_bytes() == first
    assert run("restyle", out, "--style", "calm", "-o", tmp_path / "again.svg", "-q") == 0


def test_writes_and_plots_in_a_style(tmp_path, capsys):
    ink, plain, previews = tmp_path / "ink.json", tmp_path / "plain.json", [tmp_path / f"{n}.json" for n in range(2)]
    given = ("write", "me", "--hand", "house-print", "--page", "A6", "--seed", 1, "-q")
    assert run(*given, "--style", "calm", "-o", ink) == 0 and run(*given, "-o", plain) == 0
    styled, before = (json.loads(path.read_text()) for path in (ink, plain))
    assert styled["about"]["style"] == "calm" and "style" not in before["about"]
    assert styled["strokes"][0]["width"] != before["strokes"][0].get("width")
    for path, style in zip(previews, ("calm", "blackletter"), strict=True):
        plot = ("plot", "me", "--device", "plotter-grbl-z", "--page", "A6", "--seed", 1, "--dry-run", path, "-q")
        assert run(*plot, "--style", style) == 0
    assert previews[0].read_bytes() != previews[1].read_bytes()
    capsys.readouterr()
    assert run(*given, "--style", "fats-tag", "-o", ink) == 2 and "nearest: fast-tag" in capsys.readouterr().err


def test_a_foreign_svg_and_a_style_of_ones_own(tmp_path, capsys):
    drawing, mine, out = tmp_path / "o.svg", tmp_path / "mine.toml", tmp_path / "out.svg"
    drawing.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="60mm" viewBox="0 0 60 60">'
        '<circle cx="30" cy="30" r="20" fill="none" stroke="#000"/><text>no</text></svg>',
        encoding="utf-8",
    )
    mine.write_text('title = "mine"\n[brush]\nkind = "round"\nwidth = 0.05\n', encoding="utf-8")
    assert run("restyle", drawing, "--style", mine, "-o", out, "--seed", 1) == 0
    assert "Left out: 1 x text" in capsys.readouterr().err and out.read_text().count('class="stroke"') == 1


def test_asemic(tmp_path, capsys):
    tags = [tmp_path / f"{n}.svg" for n in range(3)]
    for tag, seed in zip(tags, (3, 3, 4), strict=True):
        assert run("asemic", "--letters", 5, "--seed", seed, "-o", tag, "-q", "--json") == 0
    assert tags[0].read_bytes() == tags[1].read_bytes() != tags[2].read_bytes()
    assert json.loads(capsys.readouterr().out.splitlines()[0])["letters"] == 5


GML = """<gml><tag><environment><screenBounds><x>100</x><y>50</y></screenBounds></environment>{}</tag></gml>"""
PART = "<drawing><letter>{}</letter><stroke>{}</stroke></drawing>"


def points(xy):
    return "".join(f"<pt><x>{x}</x><y>{y}</y><t>{k * 0.02:.2f}</t></pt>" for k, (x, y) in enumerate(xy))


@pytest.fixture(scope="module")
def tag(tmp_path_factory):
    """Two letters of a file, of two strokes and one."""
    path = tmp_path_factory.mktemp("tag") / "tag.gml"
    a = [(0.1 + 0.02 * k, 0.5 + 0.3 * (k % 4 > 1)) for k in range(14)]
    b = [(0.5 + 0.03 * k, 0.4 + 0.02 * (k % 5) ** 2) for k in range(12)]
    parts = "</stroke><stroke>".join((points(a), points(a[:5])))
    path.write_text(GML.format(PART.format("a", parts) + PART.format("b", points(b))), encoding="utf-8")
    return path


def test_drawings_of_a_gml_are_kept_apart(tag):
    from handout.sources import read_drawing

    drawing = read_drawing(tag)
    assert [stroke.word for stroke in drawing.strokes] == [0, 0, 1]
    assert drawing.about["letters"] == ["a", "b"] and drawing.about["drawings"] == 2


@pytest.mark.slow
def test_learns_a_style_and_draws_in_it(written, tag, tmp_path, capsys, monkeypatch):
    from dataclasses import replace

    from handout.motion.learned import training

    monkeypatch.setattr(training, "ONE_STYLE", replace(training.ONE_STYLE, steps=8))
    style, outs = tmp_path / "mine.style", [tmp_path / f"{n}.svg" for n in range(3)]
    assert run("style", "learn", tag, "-o", style, "--json", "-q") == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["drawings"] == 2 and facts["primers"] == ["mine", "mine-1"] and facts["strokes"] > 4
    first = style.read_bytes()
    assert run("style", "learn", tag, "-o", style, "-q") == 0 and style.read_bytes() == first
    given = ("restyle", written, "--style", style, "--seed", 1, "-q")
    assert run(*given, "-o", outs[0]) == 0 and run(*given, "-o", outs[1], "--prime", "mine-1") == 0
    assert run(*given, "-o", outs[2], "--prime", tag, "--temperature", 0.1) == 0
    assert len({out.read_bytes() for out in outs}) == 3
    text = ("write", "me", "--page", "A6", "--seed", 1, "--style", style, "-o", outs[0])
    assert run(*text, "--temperature", 1.2) == 0
    for seed, out in zip((1, 1, 2), outs, strict=True):
        assert run("asemic", "--style", style, "--seed", seed, "-o", out, "-q") == 0
    assert outs[0].read_bytes() == outs[1].read_bytes() != outs[2].read_bytes()
    assert run("asemic", "--style", "calm", "--structure", style, "-o", outs[0]) == 2
    assert "calm moves by rules" in capsys.readouterr().err
    assert run("asemic", "--style", style, "--structure", "calm", "-o", outs[0]) == 2
    assert "has learned none" in capsys.readouterr().err
    for args, said in (
        ((*given, "-o", outs[0], "--prime", "no"), "'no' is no example of mine (mine, mine-1)"),
        ((*given, "-o", outs[0], "--temperature", 0), "learned.temperature = 0 is outside"),
        (("restyle", written, "-o", outs[0], "--prime", "x"), "fast-tag moves by rules"),
        (("write", "me", "-o", outs[0], "--temperature", 1), "name one with --style"),
    ):
        assert run(*args) == 2
        assert said in capsys.readouterr().err


def test_what_cannot_be_learned_is_named(tag, tmp_path, capsys):
    files = {}
    for name, xy in (
        ("empty", []),
        ("dot", [[(1, 1)]]),
        ("line", [[(1, 1), (9, 9)]]),
        ("many", [[(1, 1), (3, 2)]] * 6000),
    ):
        strokes = [{"t": [*range(len(s))], "x": [x for x, _ in s], "y": [y for _, y in s]} for s in xy]
        page = {"width": 10, "height": 10}
        file = {"format": "handout-drawing", "version": 1, "page": page, "about": {}, "strokes": strokes}
        files[name] = tmp_path / f"{name}.json"
        files[name].write_text(json.dumps(file))
    for args, said in (
        ((files["empty"], "-o", tmp_path / "a.style"), "no strokes"),
        ((files["dot"], "-o", tmp_path / "a.style"), "too little to learn from"),
        ((files["line"], "-o", tmp_path / "a.style"), "too little to learn from"),
        ((files["many"], "-o", tmp_path / "a.style"), "6000 strokes; at most 5000"),
        ((tag, "-o", tmp_path / "a.toml"), "use a.style"),
        ((tmp_path / "no.gml", "-o", tmp_path / "a.style"), "no.gml"),
    ):
        assert run("style", "learn", *args) == 2
        error = capsys.readouterr().err
        assert said in error and error.count("\n") == 1, error
    assert not (tmp_path / "a.style").exists()


def test_what_cannot_be_is_named(written, tmp_path, capsys):
    filled, wrong, out = tmp_path / "filled.svg", tmp_path / "wrong.toml", tmp_path / "out.svg"
    filled.write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0h9v9z"/></svg>', encoding="utf-8")
    wrong.write_text('title = "w"\n[brush]\nwidht = 1\n', encoding="utf-8")
    empty = tmp_path / "empty.json"
    empty.write_text(
        '{"format":"handout-drawing","version":1,"page":{"width":9,"height":9},"about":{},"strokes":[]}',
        encoding="utf-8",
    )
    for args, said in (
        (("restyle", tmp_path / "no.svg", "-o", out), "no.svg"),
        (("restyle", filled, "-o", out), "filled outline"),
        (("restyle", empty, "-o", out), "no stroke to restyle"),
        (("restyle", written, "--style", "fats-tag", "-o", out), "nearest: fast-tag"),
        (("restyle", written, "--style", wrong, "-o", out), "did you mean 'width'"),
        (("restyle", written, "--smooth", 4, "-o", out), "movement.smooth = 4 is outside"),
        (("restyle", written, "--shear", "80", "-o", out), "form.shear"),
        (("restyle", written, "--shear", "3mm", "-o", out), "shear: '3mm' is not a angle"),
        (("restyle", written, "--jitter", -1, "-o", out), "jitter.size"),
        (("restyle", written, "-o", tmp_path / "out.txt"), "out.txt"),
        (("asemic", "--letters", 0, "-o", out), "letters: 0 is outside 1 to 60"),
        (("asemic", "--seed", -1, "-o", out), "seed"),
    ):
        assert run(*args) == 2
        error = capsys.readouterr().err
        assert said in error and error.count("\n") == 1, error
    assert not out.exists()
