"""`handout write letter.md` and `handout hand signature`, as they are typed."""

import json

import pytest
from click.testing import CliRunner
from PIL import Image, ImageDraw

from handout.cli import cli
from handout.errors import InputError

LETTER = '+++\npage = "A6"\nhand = "house-print"\n+++\n\nDear *Ann*,\n\n::: signature scribble.png\nBen\n:::\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("handout.shipped.user_folder", lambda name: tmp_path / "own" / name)
    scan = Image.new("L", (600, 240), 250)
    ImageDraw.Draw(scan).line([(60, 180), (160, 40), (230, 190), (320, 60), (520, 150)], 40, 6, joint="curve")
    scan.save("scribble.png", dpi=(300, 300))
    (tmp_path / "letter.md").write_text(LETTER)
    return tmp_path


def run(*words):
    return CliRunner().invoke(cli, words, catch_exceptions=False)


def test_write_takes_a_letter_and_the_command_wins_over_its_head(folder):
    facts = json.loads(run("write", "letter.md", "-o", "x.svg", "--seed", "1", "--json", "-q").stdout)
    assert (facts["hand"], facts["pages"]) == ("house-print", 1)
    assert 'width="105mm"' in (folder / "x.svg").read_text()
    run("write", "letter.md", "-o", "y.svg", "--seed", "1", "--hand", "house-joined", "--page", "A5", "-q")
    assert 'width="148mm"' in (folder / "y.svg").read_text()


def test_a_signature_is_ink_in_pictures_and_strokes_else(folder):
    assert run("hand", "signature", "add", "ben", "scribble.png", "-q").exit_code == 0
    with pytest.raises(InputError, match="--again"):
        run("hand", "signature", "add", "ben", "scribble.png", "-q")
    assert json.loads(run("hand", "signature", "list", "--json", "-q").stdout)["names"] == ["ben"]
    (folder / "letter.md").write_text(LETTER.replace("scribble.png", "ben"))
    assert run("write", "letter.md", "-o", "x.json", "-o", "x.png", "--dpi", "60", "--seed", "1", "-q").exit_code == 0
    strokes = json.loads((folder / "x.json").read_text())["strokes"]
    assert max(max(stroke["x"]) - min(stroke["x"]) for stroke in strokes) > 25


def test_what_is_wrong_is_said_and_nothing_made(folder):
    (folder / "letter.md").write_text("fine\n\n::: signature eve\n:::\n")
    with pytest.raises(InputError, match=r"letter\.md, line 3: no signature is called eve"):
        run("write", "letter.md", "-o", "x.svg")
    (folder / "letter.md").write_text("fine\n\nsnow 雪 man")
    with pytest.raises(InputError, match=r"'雪' \(line 3\)"):
        run("write", "letter.md", "-o", "x.svg")
    assert not (folder / "x.svg").exists()


def test_a_letter_is_plotted(folder):
    (folder / "card.md").write_text('+++\npage = "100x60mm"\n+++\n\nHi [Ann]{ink=#a00}')
    assert "Wrote" in run("plot", "card.md", "--dry-run", "x.svg", "--seed", "1", "--layers", "colour").output
    assert "--layers colour stops" in run("plot", "card.md", "--dry-run", "x.svg", "--seed", "1").output
    assert run("export", "card.md", "-o", "x.gcode", "--seed", "1", "-q").exit_code == 0
    assert (folder / "x.gcode").stat().st_size > 1000
