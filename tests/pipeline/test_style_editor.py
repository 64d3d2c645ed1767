"""A style on the desk is the style of its file, and what its page shows is what the command makes of what it saves."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError
from handout.motion.styles import style
from handout.pipeline import style_editor as desk
from handout.pipeline.drawings import draw_plans
from handout.pipeline.options import StyleDraft, StyleOptions
from handout.tables import parse_table

TARGETS = [[24, 62], [40, 34], [50, 74], [64, 38], [76, 72], [94, 40]]
PLAN = json.dumps({"targets": TARGETS, "pen_up": [2], "page": {"width": 148, "height": 105}}).encode()


def draft(name, **changed):
    facts = desk.open_style(name)
    base = name if facts["learned"] else ""
    return StyleDraft({**facts["values"], **changed}, base, facts["name"])


@pytest.mark.parametrize("name", style.names())
def test_every_style_is_the_same_after_it_was_opened_and_kept(name, tmp_path):
    output = tmp_path / f"{name}{'.style' if name == 'learned' else '.toml'}"
    desk.keep_movement(PLAN, draft(name), 1, output)
    again, before = style.read_style(output), style.find(name)
    assert again.title == before.title
    for key, value in desk.plain_values(before).items():
        assert desk.plain_values(again)[key] == value, key
    if before.model is not None:
        assert list(again.model.primers) == list(before.model.primers)


def test_every_key_of_a_style_has_a_knob_within_its_bounds():
    there = {f"{table}.{key}" for table in ("form", "movement", "covariance", "guide", "breaking", "flick", "ligature",
             "brush", "jitter", "learned") for key in getattr(desk._PLAIN, table).__struct_fields__}  # fmt: skip
    assert there | {"title", "notes"} == set(desk.plain_values(desk._PLAIN))
    for name in ("calm", "learned"):
        for group in desk.open_style(name)["groups"]:
            for knob in group["knobs"]:
                assert "options" in knob or knob["least"] <= knob["low"] < knob["high"] <= knob["most"], knob


@given(st.text(min_size=1, max_size=20), st.floats(0.05, 1), st.floats(-75, 75))
def test_any_title_and_numbers_survive_their_file(title, smooth, shear):
    tables = {"title": title, "movement": {"smooth": smooth, "order": 4}, "form": {"shear": f"{shear:.10g}deg"}}
    assert parse_table(desk.style_file.to_toml(tables)) == tables


@pytest.mark.parametrize("name", ["fast-tag", "learned"])
def test_the_page_s_path_is_that_of_the_command(name, tmp_path):
    made = draft(name, **({} if name == "learned" else {"jitter.size": 0.02, "covariance.spread": 0.5}))
    shown = desk.move_targets(PLAN, made, 7, samples=2)
    file, plan = tmp_path / f"mine{'.style' if made.base else '.toml'}", tmp_path / "targets.json"
    desk.keep_movement(PLAN, made, 7, file)
    plan.write_bytes(PLAN)
    desk.keep_movement(PLAN, StyleDraft(made.values, made.base, "mine"), 7, tmp_path / "page.svg")
    draw_plans(plan, [tmp_path / "command.svg"], StyleOptions(str(file), seed=7))
    assert (tmp_path / "page.svg").read_bytes() == (tmp_path / "command.svg").read_bytes()
    assert len(shown["strokes"]) == 2 and len(shown["samples"]) == 2
    assert shown["samples"][0][0]["x"] != shown["strokes"][0]["x"] != shown["samples"][1][0]["x"]
    ways = [np.hypot(np.diff(one["x"]), np.diff(one["y"])).sum() for one in shown["strokes"]]
    assert sum(ways) == pytest.approx(shown["length_mm"], rel=0.01)
    for one in shown["strokes"]:  # the speed is that of the places
        steps = np.hypot(np.diff(one["x"]), np.diff(one["y"])).sum() / (one["t"][-1] - one["t"][0])
        assert np.trapezoid(one["speed"], one["t"]) / (one["t"][-1] - one["t"][0]) == pytest.approx(steps, rel=0.05)


def test_ellipses_that_are_made_each_target_s_own_change_nothing():
    made = draft("fast-tag")
    shown = desk.move_targets(PLAN, made, 1)
    matrices = [[[a, b], [b, c]] for a, b, c in shown["ellipses"]]
    own = desk.move_targets(json.dumps({**json.loads(PLAN), "covariances": matrices}).encode(), made, 1)
    for one, other in zip(shown["strokes"], own["strokes"], strict=True):
        assert np.allclose(one["x"], other["x"], atol=0.03) and np.allclose(one["y"], other["y"], atol=0.03)
    assert own["ellipses"] == shown["ellipses"]
    rounder = desk.move_targets(PLAN, draft("fast-tag", **{"movement.smooth": 0.4}), 1)
    assert rounder["ellipses"][1][0] > shown["ellipses"][1][0] and rounder["length_mm"] < shown["length_mm"]


def test_a_word_s_targets_lead_through_its_letters():
    plain = draft("calm", **{"movement.smooth": 0.3})
    plan = desk.targets_of_word("no", "house-print", plain)
    strokes = desk.move_targets(json.dumps(plan).encode(), plain, 1)["strokes"]
    assert len(strokes) == len(plan["pen_up"]) + 1
    word = desk.word("no", "house-print", draft("calm"), 1)
    for one, there in zip(strokes, word["strokes"], strict=True):
        shapes = [np.ptp(part["x"]) / np.ptp(part["y"]) for part in (one, there)]
        assert shapes[0] == pytest.approx(shapes[1] / 1.08, rel=0.15)  # calm stretches its letters
    with pytest.raises(InputError):
        desk.word(" ", "house-print", plain, 1)


def test_styles_are_kept_by_name_and_never_over_another_unasked(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    mine = StyleDraft({"title": "Mine", "movement.smooth": 0.4}, "", "mine")
    kept = Path(desk.save_style(mine)["file"])
    assert style.find("mine").movement.smooth == 0.4 and kept.is_relative_to(tmp_path)
    with pytest.raises(InputError, match="already"):
        desk.save_style(mine)
    desk.save_style(StyleDraft({"movement.smooth": 0.2}, "", "mine"), replace_=True)
    assert style.find("mine").movement.smooth == 0.2
    with pytest.raises(InputError, match=r"name of a style of another kind"):
        desk.save_style(StyleDraft({}, "learned", "mine"), replace_=True)
    with pytest.raises(InputError, match="comes with the program"):
        desk.save_style(StyleDraft({}, "", "calm"), replace_=True)
    with pytest.raises(InputError, match="another kind"):
        desk.save_style(StyleDraft({}, "learned", "mine"), str(kept))
    assert desk.open_style(str(tmp_path / "new.toml"))["values"]["title"] == "new"


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"movement.smooth": 3.0}, "movement.smooth = 3 is outside"),
        ({"movement.smoth": 0.3}, "smooth"),
        ({"x": 1.0}, "x is not a known key"),
        ({"brush.kind": "chisel"}, "brush.kind"),
        ({"covariance.angles": [10.0, 12.0]}, "nearly the same"),
        ({"name": "x"}, "name"),
    ],
)
def test_values_that_none_can_have_are_named(values, said):
    with pytest.raises(InputError, match=said):
        desk.move_targets(PLAN, StyleDraft(values), 1)


def test_plans_that_are_none_are_refused():
    for plan in (b"[", b"{}", b'{"targets": []}', b'{"targets": [[1, 2]], "pen_up": [4]}'):
        with pytest.raises(InputError):
            desk.move_targets(plan, StyleDraft({}), 1)
