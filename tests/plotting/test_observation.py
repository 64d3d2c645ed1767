"""What was executed, from a machine's answers: rests are found where they are, and none where there are none."""

import dataclasses
import math

import msgspec
import numpy as np
import pytest
from clocks import Clock
from cursive import page

from benchmarks import ebb
from benchmarks.live import rests
from handout import profiles
from handout.plotting import observation, plan, plot_report, run
from handout.plotting.dialects import dialect
from handout.plotting.observation import Observer
from handout.profiles import Acceleration
from handout.simulated.plotter.options import SimulatorOptions
from handout_lab.simulated import FaultyPlotter

DRAWING = dataclasses.replace(page(words=4), about={"words": ["kept", "in", "the", "harbour"]})
TELLING = ["simulated", "grbl-z", "axidraw-v3", "marlin-servo"]


class Away(FaultyPlotter):
    """A host that is away for a while before every so many writes; the machine goes on with what it has."""

    every, away, writes = 0, 0.0, 0

    def write(self, data):
        self.writes += 1
        if self.every and self.writes % self.every == 0:
            self._clock.sleep(self.away)
        super().write(data)


def profile_of(name):
    return profiles.find(name, "plotter")


def plotted(name, every=0, away=0.0, clock=True, **options):
    plotter = Away(profile_of(name), SimulatorOptions(**options), Clock() if clock else None)
    plotter.every, plotter.away = every, away
    report = run(plan(DRAWING, plotter.profile), plotter, plotter.profile)
    return plotter, report


@pytest.mark.slow
@pytest.mark.parametrize("name", TELLING)
@pytest.mark.parametrize("clock", [True, False], ids=["real", "virtual"])
def test_a_plot_without_rests_has_none(name, clock):
    plotter, report = plotted(name, clock=clock)
    told = report.observation
    assert rests(report.plan.intended_drawing(), plotter.executed_drawing()) == []
    assert told.unknown == "" and told.rests == () and told.least_s <= 0.03 and 0 < told.every_s < 0.1
    _, measured = ebb.in_time(report.plan.intended_drawing(), told.executed)
    _, true = ebb.in_time(report.plan.intended_drawing(), plotter.executed_drawing())
    assert measured == pytest.approx(true, abs=0.01)
    assert told.stretched == pytest.approx(report.plan.stretched, abs=0.01)
    assert "never rested on the paper for longer than 0.0" in plot_report.sentence([report])


@pytest.mark.slow
@pytest.mark.parametrize("name", TELLING)
@pytest.mark.parametrize(("every", "away"), [(190, 0.6), (131, 0.45)])
def test_rests_are_found_where_they_are(name, every, away):
    plotter, report = plotted(name, every, away)
    true = rests(report.plan.intended_drawing(), plotter.executed_drawing())
    told = report.observation.rests
    long = [rest for rest in true if rest[2] > 0.1]
    assert len(long) >= 2 and abs(len(told) - len(true)) <= 1
    assert 0.6 < report.observation.rested_s / sum(seconds for _, _, seconds in true) < 1.2
    for number in {stroke for stroke, at, _ in long if at > 0.3}:  # one at its very beginning cannot be seen
        true_s = sum(seconds for stroke, _, seconds in true if stroke == number)
        told_s = sum(rest.seconds for rest in told if rest.stroke == number)
        assert math.isclose(told_s, true_s, rel_tol=0.35, abs_tol=0.1)
    _, measured = ebb.in_time(report.plan.intended_drawing(), report.observation.executed)
    _, correlation = ebb.in_time(report.plan.intended_drawing(), plotter.executed_drawing())
    assert correlation < 0.97 and measured == pytest.approx(correlation, abs=0.15)


class Late(FaultyPlotter):
    """A host that hears some answers late, since its processor is busy, but never lets the queue run dry."""

    rng, mean = None, 0.0

    def read(self, timeout):
        said = super().read(timeout)
        if said and self.rng.random() < 0.2:
            self._clock.sleep(min(self.rng.exponential(self.mean), 0.08))
        return said


@pytest.mark.parametrize(("name", "mean"), [("simulated", 0.03), ("grbl-z", 0.03), ("axidraw-v3", 0.005)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_answers_that_are_heard_late_are_no_rests(name, mean, seed):
    drawing = page(seed=seed, words=2)
    plotter = Late(profile_of(name), SimulatorOptions(), Clock())
    plotter.rng, plotter.mean = np.random.default_rng(seed), mean
    report = run(plan(drawing, plotter.profile, speed=0.5), plotter, plotter.profile)
    meant, told = report.plan.intended_drawing(), report.observation
    assert rests(meant, plotter.executed_drawing()) == [] and told.rests == ()
    true = observation.measure_timing(meant, plotter.executed_drawing())
    assert told.least_correlation - 0.005 < true < told.correlation + 0.005
    assert told.stretched == pytest.approx(observation.measure_stretch(meant, plotter.executed_drawing()), abs=0.01)
    doubt = f"(r {told.least_correlation:.2f} to {told.correlation:.2f})"
    exact = told.correlation - told.least_correlation < 0.005
    assert (doubt in plot_report.sentence([report])) != exact


@pytest.mark.parametrize("share", [1.0, 1.3, 2.0])
def test_slow_going_is_no_rest(share):
    """Answers of a machine that takes so much longer than its plan for everything; and of one that stops as well."""
    made = plan(DRAWING, profile_of("axidraw-v3"))
    commands = list(dialect("ebb").program(made.blocks, made.profile))
    for stop in (0.0, 2.0):
        observer = Observer(made, commands)
        for number, command in enumerate(commands[:-1], 1):
            clock = float(made.begins[min(command.done, len(made.begins) - 1)])
            observer.note(share * clock + stop * (clock > made.duration / 2), number, None)
        told = observer.observation()
        assert told.stretched / made.stretched == pytest.approx(share, rel=0.02 if stop == 0.0 else 0.5)
        assert [rest.seconds for rest in told.rests] == ([] if stop == 0.0 else [pytest.approx(stop, abs=0.1)])


def test_where_it_rested_is_told_in_words_and_figures():
    plotter, report = plotted("simulated", 190, 0.6)
    row = plot_report.tell_plotted_page(report, plotter, 1)
    words = {rest["text"] for rest in row["rests"]}
    assert row["measured"] and words and words <= set(DRAWING.about["words"])
    assert row["rested_s"] == pytest.approx(sum(rest["seconds"] for rest in row["rests"]), abs=0.01)
    facts, said = plot_report.facts([report]), plot_report.sentence([report])
    assert facts["measured"] and facts["rests"] == len(row["rests"]) and facts["rested_s"] > 0.2
    assert f"the pen rested {facts['rests']} times, {facts['rested_s']:.2f} s in all, in: " in said
    assert all(word in said for word in words)
    twice = plot_report.facts([report, report])
    assert twice["rests"] == 2 * facts["rests"]


def test_a_real_machine_is_measured_too():
    """Over a port of which nothing but bytes is known."""
    plotter = FaultyPlotter(profile_of("simulated"))

    class Cable:
        def write(self, data):
            plotter.write(data)

        def read(self, timeout):
            return plotter.read(timeout)

        def close(self):
            plotter.close()

    report = run(plan(DRAWING, plotter.profile), Cable(), plotter.profile)
    row = plot_report.tell_plotted_page(report, Cable(), 1)
    assert row["measured"] and row["rests"] is not None and row["least_rest_s"] >= 0.02


def test_what_a_machine_does_not_say_is_not_known():
    _, report = plotted("hp-7475a")
    assert "not what it has drawn" in report.observation.unknown and report.observation.executed is None
    facts = plot_report.facts([report])
    assert not facts["measured"] and facts["rests"] is None and facts["rested_s"] is None and facts["unknown"]
    assert plot_report.sentence([report]).startswith("Whether the pen rested is not known: An HP-GL plotter")
    row = plot_report.tell_plotted_page(report, object(), 1)
    assert not row["measured"] and row["unknown"] and row["rests"] is None
    whole = plot_report.whole([row])
    assert whole["rests"] is None and whole["rested_s"] is None


def test_nothing_is_known_of_dots():
    dots = dataclasses.replace(DRAWING, strokes=tuple(
        dataclasses.replace(stroke, t=stroke.t[:1], xy=stroke.xy[:1]) for stroke in DRAWING.strokes[:2]
    ))  # fmt: skip
    profile = profile_of("simulated")
    report = run(plan(dots, profile), FaultyPlotter(profile), profile)
    assert "too short" in report.observation.unknown and not plot_report.facts([report])["measured"]


def test_a_machine_of_other_limits_is_measured_by_the_plan_that_was_drawn():
    profile = profile_of("simulated")
    slow = msgspec.structs.replace(profile.limits, acceleration=Acceleration(600.0))
    plotter = FaultyPlotter(profile, SimulatorOptions(acceleration=600.0))
    report = run(plan(DRAWING, profile), plotter, profile)
    assert report.plan.profile.limits.acceleration == slow.acceleration and report.observation.rests == ()
