"""A recurrent network that tells made motion from real: what it may see, how writers are kept apart, its AUC."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from handout.cli import cli
from handout.errors import InputError
from handout.sinks.drawing_json import to_json
from handout.values import Drawing, Page, Stroke
from handout_lab.score import motion_judge
from handout_lab.score.motion_judge import Sample, judge, sample, steady


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """A network and windows that are learned in a moment."""
    for name, value in {"_LENGTH": 30, "_WARM": 5, "_HIDDEN": 6, "_BATCH": 8, "_UPDATES": 40, "_DRAWS": 200}.items():
        monkeypatch.setattr(motion_judge, name, value)


def writing(rng, strokes=6, scale=1.0):
    """Loops that are slow where they turn, as pens are."""
    made, clock = [], 0.0
    for n in range(strokes):
        t = np.arange(0.0, 0.7, 1 / 150)
        phase = 2 * np.pi * (2.5 + rng.normal(0, 0.1)) * t + rng.uniform(0, 6)
        xy = np.stack([9 * n + 9 * t + 0.9 * np.sin(phase), 30 + 3 * np.cos(phase)], axis=1)
        made.append(Stroke(clock + t, scale * xy))
        clock += 0.7 + rng.uniform(0.1, 0.3)
    return Drawing(tuple(made), Page(100, 60))


@pytest.fixture(scope="module")
def people():
    rng = np.random.default_rng(3)
    return {f"writer {n}": writing(rng) for n in range(4)}


def test_size_and_the_tablets_rate_do_not_tell(people):
    drawing = people["writer 0"]
    seen = sample(drawing, "a", False)
    assert seen.windows.shape[1:] == (30, 6) and len(seen.windows) >= 5
    large = replace(drawing, strokes=tuple(Stroke(s.t + 5, 40 * s.xy) for s in drawing.strokes))
    assert np.allclose(seen.windows, sample(large, "a", False).windows, atol=1e-4)
    coarse = replace(drawing, strokes=tuple(Stroke(s.t[::2], s.xy[::2]) for s in drawing.strokes))
    noise = np.random.default_rng(0)
    rough = replace(
        drawing, strokes=tuple(Stroke(s.t, s.xy + noise.normal(0, 0.01, s.xy.shape)) for s in drawing.strokes)
    )
    for other in (coarse, rough):
        assert np.abs(seen.windows[0] - sample(other, "a", False).windows[0]).mean() < 0.03
    assert np.isclose(np.square(seen.windows[..., :2]).sum(axis=2).mean(), 1, atol=0.1)
    dot = Drawing((Stroke(np.zeros(1), np.zeros((1, 2))),), Page(10, 10))
    assert sample(dot, "a", False).windows.shape == (0, 30, 6)
    with pytest.raises(InputError, match="no times"):
        sample(replace(drawing, timed=False), "a", False)


def test_steady_motion_has_one_speed_and_the_same_lifts(people):
    drawing = people["writer 1"]
    even = steady(drawing)
    speeds = np.concatenate([np.hypot(*np.diff(s.xy, axis=0).T) / np.diff(s.t) for s in even.strokes])
    assert np.ptp(speeds) < 0.02 * speeds.mean()
    lifts = [[b.t[0] - a.t[-1] for a, b in zip(d.strokes, d.strokes[1:], strict=False)] for d in (drawing, even)]
    assert np.allclose(*lifts)
    assert even.duration == pytest.approx(drawing.duration, rel=0.02)


def test_a_writer_is_in_one_fold_and_every_fold_has_both_kinds():
    fold = motion_judge._folds({False: ["a", "b"], True: ["a", "c"]}, np.random.default_rng(0))
    assert fold["b"] == fold["c"] != fold["a"]
    writers = {False: ["a", "b", "c", "d", "e", "f"], True: ["c", "d", "x", "y"]}
    fold = motion_judge._folds(writers, np.random.default_rng(0))
    assert set(fold) == set("abcdefxy") and set(fold.values()) == {0, 1, 2, 3}
    for number in range(4):
        assert all(any(fold[name] == number for name in writers[kind]) for kind in (False, True))


def test_the_area_is_that_of_all_pairs_which_one_network_judged():
    from sklearn.metrics import roc_auc_score  # which takes longer to load than all of these tests

    rng = np.random.default_rng(1)
    made, who, fold = rng.random(60) < 0.5, rng.integers(0, 5, 60), rng.integers(0, 2, 60)
    score = rng.normal(made * 0.7, 1).round(1)
    wins, pairs = motion_judge._duels(score, made, who, fold, 5)
    for number in (0, 1):
        here = fold == number
        one_wins, one_pairs = motion_judge._duels(score[here], made[here], who[here], fold[here], 5)
        assert one_wins.sum() / one_pairs.sum() == pytest.approx(roc_auc_score(made[here], score[here]))
        wins, pairs = wins - one_wins, pairs - one_pairs
    assert not wins.any() and not pairs.any()


@pytest.mark.slow
def test_steady_speeds_are_told_and_other_people_are_not(people):
    real = [sample(drawing, name, False) for name, drawing in people.items()]
    crude = [sample(steady(drawing), name, True) for name, drawing in people.items()]
    told = judge([*real, *crude], np.random.default_rng(0))
    assert told.auc > 0.8 and told.low > 0.6 and told.verdict == "told apart"
    assert (told.real_writers, told.made_writers) == (4, 4) and told.low <= told.auc <= told.high
    again = judge([*real, *crude], np.random.default_rng(0))
    assert again == told
    parted = [Sample(one.writer, n < 2, one.windows) for n, one in enumerate(real)]
    assert 0.1 < judge(parted, np.random.default_rng(0)).auc < 0.9
    with pytest.raises(InputError, match="1 real and 4 made writers"):
        judge([real[0], *crude], np.random.default_rng(0))


@pytest.mark.slow
def test_the_command_judges_folders(people, tmp_path):
    for kind, change in (("real", lambda drawing: drawing), ("made", steady)):
        for name, drawing in people.items():
            (tmp_path / kind / name).mkdir(parents=True)
            (tmp_path / kind / name / "page.json").write_bytes(to_json(change(drawing)))
    arguments = ["study", "judge", str(tmp_path / "real"), str(tmp_path / "made"), "--json", "--quiet"]
    done = CliRunner().invoke(cli, [*arguments, "--controls"])
    assert done.exit_code == 0, done.output
    facts = json.loads(done.output)
    assert facts["made"]["auc"] > 0.8 and facts["made"]["auc"] == facts["steady_control"]["auc"]
    assert {"low", "high", "verdict"} <= facts["real_control"].keys()
    (tmp_path / "real" / "writer 0" / "lines.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg"><path d="M1 1h9" stroke="#000"/></svg>', encoding="utf-8"
    )
    done = CliRunner().invoke(cli, arguments)
    assert isinstance(done.exception, InputError) and "lines.svg has no times" in str(done.exception)
    done = CliRunner().invoke(cli, ["study", "judge", "none", str(tmp_path / "made")])
    assert isinstance(done.exception, InputError) and "not a folder" in str(done.exception)
