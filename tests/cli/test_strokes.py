"""`handout strokes`: a page is explained, its plans are changed and drawn."""

import itertools
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


TARGETS = {"targets": [[0, 30], [8, 0], [16, 30], [24, 0], [32, 30], [45, 10], [55, 28]], "pen_up": [4]}
WIDE, ROUND = [[40, 0], [0, 1]], [[1, 0], [0, 1]]


def test_targets_alone_with_their_ellipses(tmp_path, capsys):
    plan, outs = tmp_path / "targets.json", [tmp_path / f"{n}.json" for n in range(4)]
    shifted = {"targets": TARGETS["targets"], "frame": {"origin": [0, 10], "angle": "5deg"}, "covariances": [ROUND] * 7}
    for out, more in zip(
        outs,
        ({}, {"covariances": [ROUND] * 7}, {"covariances": [ROUND, WIDE, *[ROUND] * 5]}, {"references": [shifted]}),
        strict=True,
    ):
        plan.write_text(json.dumps(TARGETS | more))
        assert run("strokes", "draw", plan, "--style", "calm", "--seed", "1", "-o", out, "--json", "-q") == 0
        assert json.loads(capsys.readouterr().out)["strokes"] == 2
    _plain, alike, loose, two = (json.loads(out.read_text())["strokes"][0] for out in outs)
    assert max(abs(a - b) for a, b in zip(alike["y"], loose["y"], strict=True)) > 1  # mm: a loose target is cut
    assert max(abs(a - b) for a, b in zip(alike["y"], two["y"], strict=True)) > 1  # between two references


def test_variations_on_a_sheet(trace, tmp_path, capsys):
    plan, sheet, targets = tmp_path / "plan.json", tmp_path / "sheet.json", tmp_path / "targets.json"
    assert run("strokes", "fit", trace, "-o", plan) == 0
    targets.write_text(json.dumps(TARGETS))
    for source in (plan, targets):
        assert run("strokes", "vary", source, "--copies", "4", "--seed", "2", "-o", sheet, "-q") == 0
        strokes = json.loads(sheet.read_text())["strokes"]
        each = len(strokes) // 4
        assert len(strokes) == 4 * each and all(a["t"][-1] < b["t"][0] for a, b in itertools.pairwise(strokes))
        if source == plan:
            shapes = [[x - s["x"][0] for x in s["x"][:20]] for s in strokes[::each]]
            assert shapes[0] != shapes[1] != shapes[2]


def test_what_cannot_be_is_named(trace, tmp_path, capsys):
    wrong = tmp_path / "wrong.json"
    wrong.write_text("{}")
    for args, said in (
        (("strokes", "fit", tmp_path / "no.inkml"), "no.inkml"),
        (("strokes", "fit", trace, "-o", tmp_path / "plan.txt"), "use plan.json"),
        (("strokes", "draw", wrong, "-o", tmp_path / "a.svg"), "not a page of plans"),
        (("strokes", "draw", tmp_path / "no.json", "-o", tmp_path / "a.svg"), "Cannot read"),
        (("strokes", "vary", wrong, "--copies", "0", "-o", tmp_path / "a.svg"), "copies: 0 is outside"),
    ):
        assert run(*args) == 2
        assert said in capsys.readouterr().err
    for more, said in (
        ({"targets": []}, "has 0 targets"),
        ({"pen_up": [9]}, "pen_up: 9 is no target"),
        ({"covariances": [WIDE]}, "1 covariances for 7 targets"),
        ({"covariances": [[[1, 0], [0, -1]]] * 7}, "not positive semi-definite"),
        ({"references": [{"targets": [[0, 0]]}]}, "same number of targets"),
        ({"references": [{"targets": TARGETS["targets"], "frame": {"scale": 0}}]}, "Reference 1: scale"),
        ({"target": 1}, "unknown field"),
    ):
        wrong.write_text(json.dumps(TARGETS | more))
        assert run("strokes", "draw", wrong, "-o", tmp_path / "a.svg") == 2
        assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [wrong]
