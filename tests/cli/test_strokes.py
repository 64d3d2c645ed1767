"""`handout strokes`: a page is explained, its plans are changed and drawn."""

import json

import pytest

from handout.cli import main


def run(*args):
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in args])
    return left.value.code


@pytest.fixture(scope="module")
def trace(tmp_path_factory):
    path = tmp_path_factory.mktemp("strokes") / "trace.inkml"
    assert run("write", "me", "--hand", "house-print", "--page", "A6", "--seed", "7", "-o", path) == 0
    return path


def test_fit_and_draw(trace, tmp_path, capsys):
    plan, report = tmp_path / "plan.json", tmp_path / "fit.svg"
    assert run("strokes", "fit", trace, "-o", plan, "--report", report, "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["timed"] and facts["speed_db"] >= 25 and facts["path_db"] >= 30
    assert b"polyline" in report.read_bytes()
    changed = json.loads(plan.read_text())
    changed["movements"] = changed["movements"][:1]
    plan.write_text(json.dumps(changed))
    again = tmp_path / "again.svg"
    assert run("strokes", "draw", plan, "-o", again) == 0
    assert again.read_text().count('class="stroke"') == 1
    assert run("strokes", "fit", trace, "--shape-only", "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    assert not facts["timed"] and facts["speed_db"] is None and facts["path_db"] >= 35


def test_what_cannot_be_is_named(trace, tmp_path, capsys):
    wrong = tmp_path / "wrong.json"
    wrong.write_text("{}")
    for args, said in (
        (("strokes", "fit", tmp_path / "no.inkml"), "no.inkml"),
        (("strokes", "fit", trace, "-o", tmp_path / "plan.txt"), "ends in .json"),
        (("strokes", "draw", wrong, "-o", tmp_path / "a.svg"), "not a page of plans"),
        (("strokes", "draw", tmp_path / "no.json", "-o", tmp_path / "a.svg"), "Cannot read"),
    ):
        assert run(*args) == 2
        assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [wrong]
