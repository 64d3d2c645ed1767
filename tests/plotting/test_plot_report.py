"""The report of a plot: what it says is what happened, of one page and of many."""

import dataclasses
import json

import msgspec
import numpy as np
import pytest
from cursive import page

from handout import profiles
from handout.errors import InputError
from handout.plotting import observation, open_port, plan, plot_report, run
from handout.profiles import Acceleration
from handout.values import Drawing, Page, Stroke

PROFILE = profiles.find("simulated", "plotter")
KEYS = {"correlation", "rms_of_peak", "intended_s", "executed_s", "stretched", "segments", "min_queue"}


def slower(acceleration):
    limits = msgspec.structs.replace(PROFILE.limits, acceleration=Acceleration(acceleration))
    return msgspec.structs.replace(PROFILE, limits=limits)


def test_predicted_and_measured_say_the_same():
    made = plan(page(words=5), PROFILE)
    predicted = plot_report.row(made, 1)
    port = open_port("sim:", PROFILE)
    measured = plot_report.tell_plotted_page(run(made, port, PROFILE), port, 1)
    assert predicted.keys() == measured.keys() and predicted.keys() >= KEYS
    assert (predicted["measured"], measured["measured"]) == (False, True)
    assert (
        measured["correlation"] == pytest.approx(predicted["correlation"], abs=0.002) and measured["correlation"] > 0.99
    )
    assert (
        measured["rms_of_peak"] == pytest.approx(predicted["rms_of_peak"], abs=0.005) and measured["rms_of_peak"] < 0.03
    )
    assert measured["in_place"]["correlation"] > 0.995
    assert measured["executed_s"] == pytest.approx(predicted["executed_s"], rel=0.01)
    assert measured["segments"] == predicted["segments"] == made.toolpath.draws.sum()
    assert predicted["min_queue"] >= 13 and 5 <= measured["min_queue"] <= 15
    assert predicted["stretched_at"] == [] and predicted["deviation_mm"] < 0.05


def test_a_stretch_is_told_with_its_place():
    lines = page(words=3)
    t, xy = lines.strokes[0].t, lines.strokes[0].xy
    hasty = t[0] + np.interp(t - t[0], [0, 0.4, 0.6, t[-1] - t[0]], [0, 0.4, 0.45, t[-1] - t[0] - 0.15])
    drawing = Drawing((Stroke(hasty, xy, word=7), *lines.strokes[1:]), lines.page)
    told = plot_report.row(plan(drawing, slower(1500)), 1)
    first = told["stretched_at"][0]
    assert first["stroke"] == 0 and first["word"] == 7
    assert first["worst"] > first["factor"] > 1 and 0.0 <= first["at_s"] < 0.5
    even = plot_report.stretches(
        drawing, Drawing(tuple(Stroke(1.2 * s.t, s.xy) for s in drawing.strokes), drawing.page)
    )
    moving = [number for number, stroke in enumerate(drawing.strokes) if stroke.length > 0]
    assert [found["stroke"] for found in even] == moving
    assert all(found["factor"] == pytest.approx(1.2) for found in even)
    assert plot_report.stretches(drawing, drawing) == []


def test_pages_are_summed_up(tmp_path):
    rows = [plot_report.row(plan(page(seed=seed, words=2), PROFILE), seed) for seed in (1, 2)]
    plot_report.write(tmp_path / "fidelity.json", rows)
    told = json.loads((tmp_path / "fidelity.json").read_text())
    assert told.keys() >= KEYS and told["pages"] == rows
    assert told["correlation"] == min(row["correlation"] for row in rows)
    assert told["intended_s"] == pytest.approx(sum(row["intended_s"] for row in rows))
    assert told["stretched"] == pytest.approx(told["executed_s"] / told["intended_s"], abs=1e-4)
    with pytest.raises(InputError, match="Cannot write"):
        plot_report.write(tmp_path / "nowhere" / "fidelity.json", rows)


def test_a_tick_too_short_for_a_speed_is_no_fault():
    tick = Drawing((Stroke([0.0, 0.004], [[20.0, 20.0], [20.3, 20.0]]),), Page(100, 100))
    assert plot_report.row(plan(tick, PROFILE), 1)["correlation"] is None


def test_a_part_is_told_of_by_what_was_drawn_last():
    drawing = page(words=3)
    port = open_port("sim:", PROFILE)
    report = run(plan(drawing, PROFILE), port, PROFILE)
    part = dataclasses.replace(report, plan=plan(Drawing(drawing.strokes[2:], drawing.page), PROFILE))
    told = plot_report.tell_plotted_page(part, port, 1)
    assert told["measured"] and told["correlation"] > 0.99
    more = Drawing((*drawing.strokes, drawing.strokes[0]), drawing.page)  # the sheet has not seen all of it
    assert not plot_report.tell_plotted_page(dataclasses.replace(report, plan=plan(more, PROFILE)), port, 1)["measured"]


def test_a_page_of_dots_has_nothing_to_compare():
    dots = tuple(Stroke([i, i + 0.05], [[20.0 + i, 30.0]] * 2) for i in range(3))
    told = plot_report.whole([plot_report.row(plan(Drawing(dots, Page(100, 100)), PROFILE), 1)])
    assert told["correlation"] is None and told["min_queue"] is None and told["stretched"] == 1.0


def test_a_drawing_without_time_is_compared_with_the_best_the_machine_can_do():
    square = np.array([[20.0, 20], [60, 20], [60, 60], [20, 60], [20, 20]])
    untimed = Drawing((Stroke(np.arange(5.0), square),), Page(100, 100), timed=False)
    made = plan(untimed, PROFILE, speed=0.1)
    assert made.speed == "fast" and made.stretched == pytest.approx(1, abs=0.02)
    assert made.motion.duration[made.toolpath.draws].sum() == pytest.approx(4 * (40 / 120 + 120 / 2000), rel=0.02)
    told = plot_report.row(made, 1)
    assert told["correlation"] > 0.98 and told["stretched"] == pytest.approx(1, abs=0.02)
    port = open_port("sim:", PROFILE)
    run(made, port, PROFILE)
    assert observation.deviation_of(untimed.strokes[0], port.executed_drawing().strokes[0]) < 0.05


def test_dots_without_time_are_no_rests():
    dot = Drawing((Stroke([0.0, 9.0], [[20.0, 20.0]] * 2),), Page(100, 100), timed=False)
    timed = Drawing(dot.strokes, dot.page)
    assert plan(timed, PROFILE).duration - plan(dot, PROFILE).duration == pytest.approx(1.0, abs=0.01)
