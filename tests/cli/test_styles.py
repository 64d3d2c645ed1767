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
