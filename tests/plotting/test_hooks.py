"""Hooks: steps are read, dips fall where they disturb least, and whatever breaks off in a pot goes on rightly."""

import functools
import itertools
import math
import re
import types

import hypothesis.strategies as st
import msgspec
import numpy as np
import pytest
from cursive import page
from hypothesis import given

from benchmarks import faults
from benchmarks.faults import EVERY, HOOKED, disturbed, drawing, perform, undisturbed, verdict
from handout import hooks, profiles
from handout.errors import DoesNotFit, InputError, ProfileError
from handout.hooks import Go, Lift, Lower, Send, Wait
from handout.plotting import open_port, plan
from handout.plotting.dialects import DIALECTS, PenBlock, UserLines, dialect
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.places import DrawnPlace, find_place
from handout.plotting.jobs.store import JobOptions
from handout.plotting.planning import hooking
from handout.profiles import Hooks, Length
from handout.simulated.plotter.options import SimulatorOptions as Simulated
from handout.values import Drawing, Page, Stroke

SIMULATED = profiles.find("simulated", "plotter")
DRAWING = page(words=4)


def hooked(profile=SIMULATED, **values):
    every = Length(values.pop("every", 0.0))
    return msgspec.structs.replace(profile, hooks=Hooks(dip_every=every, **values))


def line(word, length, begin=0.0, at=0.0):
    """A level stroke at 10 mm/s."""
    return Stroke([at, at + length / 10], [[begin, 10.0], [begin + length, 10.0]], word=word)


def test_steps_are_read():
    told = hooks.read_steps(
        ["go pot", "down 2mm", "wait 300ms", "up", "send M8", "send G4 P1", "go -5 2cm"], {"pot": "1 2"}, "x"
    )
    assert told == (Go(1, 2), Lower(2.0), Wait(0.3), Lift(), Send(("M8", "G4 P1")), Go(-5, 20))


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        (["dip"], "'dip' is none of: go X Y"),
        (["up 3"], "is none of"),
        (["go pot"], "go pot: not two lengths, such as 280mm 20mm; the places with names are edge"),
        (["go 3"], "go 3: not two lengths"),
        (["go edge", "wait 2"], "'2' is not a time"),
        (["wait 0s"], "more than 0 s"),
        (["down"], "would mark the sheet: go to a place first"),
        (["send M8!"], "other than \\? ! ~"),
        (["send"], "1 to 70"),
    ],
)
def test_what_is_no_step_is_named(steps, said):
    with pytest.raises(InputError, match=said):
        hooks.read_steps(steps, {"edge": "1mm 2mm"}, "hooks.dip")


def test_a_profile_with_wrong_hooks_is_refused_when_it_is_read(tmp_path):
    path = tmp_path / "plotter-mine.toml"
    text = (profiles.shipped.folder("devices") / "plotter-hp-7475a.toml").read_text(encoding="utf-8")
    for lines, said in [
        ('dip = ["go 1 2"]', "belong together"),
        ('dip = ["go 1 2"]\ndip_every = "5mm"', "less than 10 mm"),
        ('before_page = ["wait 1s"]', "HP-GL has no instruction to wait"),
        ('after_page = ["go 1 2", "down 3"]', "pen has no heights"),
        ('after_stroke = ["go home"]', "hooks.after_stroke: go home"),
    ]:
        path.write_text(f"{text}\n[hooks]\n{lines}\n", encoding="utf-8")
        with pytest.raises(ProfileError, match=said):
            profiles.read_profile(path)
    path.write_text(f'{text}\n[hooks]\nafter_page = ["go home"]\n[hooks.places]\nhome = "0 0"\n', encoding="utf-8")
    assert profiles.read_profile(path).hooks.steps("after_page") == (Go(0, 0),)


def test_a_pot_beside_the_bed_is_refused():
    with pytest.raises(
        DoesNotFit, match="x = 310 mm is outside the bed 0–300 mm of plotter-simulated: use another place in"
    ):
        plan(DRAWING, hooked(dip=("go 310 20",), every=50.0))


@given(st.lists(st.tuples(st.integers(0, 4), st.floats(0.5, 60.0)), min_size=1, max_size=14), st.floats(20.0, 80.0))
def test_no_load_is_too_great_and_no_fewer_dips_would_do(words, every):
    names = np.cumsum([step > 1 for step, _ in words]).tolist()  # a word has several strokes
    strokes = [
        line(name, length, begin=100.0 * n) for n, (name, (_, length)) in enumerate(zip(names, words, strict=True))
    ]
    chosen = hooking.dips(strokes, every)
    ends = [*sorted(chosen), len(strokes)]
    assert ends[0] == 0
    for a, b in itertools.pairwise(ends):
        assert b - a == 1 or sum(stroke.length for stroke in strokes[a:b]) <= every + 1e-5

    @functools.cache
    def least(at):  # (dips within words, dips) from a stroke on, by trying everything
        if at == len(strokes):
            return (0, 0)
        tries = []
        for end in range(at + 1, len(strokes) + 1):
            if end - at > 1 and sum(stroke.length for stroke in strokes[at:end]) > every:
                break
            within = end < len(strokes) and strokes[end].word == strokes[end - 1].word
            tries.append((least(end)[0] + within, least(end)[1] + 1))
        return min(tries)

    within = sum(strokes[at].word == strokes[at - 1].word for at in chosen if at)
    assert (within, len(chosen)) == least(0)


@given(st.floats(11.0, 300.0), st.floats(10.0, 100.0))
def test_long_strokes_are_parted_where_they_are_slow(length, every):
    t = np.linspace(0.0, 10.0, 400)
    x = length * (t / 10 + np.sin(2 * np.pi * 2 * t) / (2 * np.pi * 2 * 10) * 0.9)  # slow twice a second
    whole = Stroke(t, np.stack([x, np.zeros(400)], axis=1), word=3)
    parts = hooking.part_strokes(Drawing((whole,), Page(400, 100)), every).strokes
    assert max(part.length for part in parts) <= every + 1e-3 and all(part.word == 3 for part in parts)
    assert sum(part.length for part in parts) == pytest.approx(whole.length)
    assert all(hooking.is_join(parts, at) for at in range(1, len(parts)))
    assert length / every <= len(parts) <= math.ceil(length / (0.8 * every))
    again = hooking.part_strokes(Drawing(parts, Page(400, 100)), every)
    assert again.strokes == parts
    if every - length / len(parts) > length / 20:  # there is a slow place near every join
        assert all(part.speed[0] < 0.2 * whole.speed.mean() for part in parts[1:])


def test_a_dip_that_has_to_be_within_a_stroke_is_told():
    strokes = hooking.part_strokes(
        Drawing((line(0, 30.0), line(1, 90.0)), Page(100, 50), {"words": ["a", "long"]}), 50.0
    )
    (said,) = hooking.tell_hooks([strokes], hooked(dip=("go 290 200",), every=50.0))
    assert "is longer than the 50 mm" in said and said.endswith("1 time, in: long.")
    assert "lies on the sheet" in hooking.tell_hooks([strokes], hooked(before_page=("go 20 20",)))[0]


@pytest.mark.parametrize("name", DIALECTS)
def test_every_dialect_dips_and_says_what_it_is_told(name):
    profile = profiles.find(dialect(name).usual_device, "plotter")
    deep = "" if name in ("hpgl",) else f" {profile.pen.down + (profile.pen.down - profile.pen.up) * 0.1:.1f}"
    mine = hooked(
        profile,
        dip=("go 160 20", f"down{deep}", "go 165 20", "up"),
        every=60.0,
        before_page=("send M777",),
        after_page=("send M778",),
    )
    made, plain = plan(DRAWING, mine), plan(DRAWING, profile)
    assert made.pen_down >= plain.pen_down * 0.999 and made.dips >= made.pen_down / 60
    assert made.duration > plain.duration and 0 < made.hook_time < made.duration
    downs = [block for block in made.blocks if isinstance(block, PenBlock) and block.down]
    assert sum(not block.inks for block in downs) == made.dips
    assert sum(block.inks for block in downs) == len(made.drawing.strokes)
    told = [command.data for command in dialect(name).program(made.blocks, mine)]
    first, last = (next(n for n, data in enumerate(told) if word in data) for word in (b"M777", b"M778"))
    assert first < len(told) / 10 and last > len(told) * 0.9
    assert [command.done for command in dialect(name).program(made.blocks, mine)][-1] == len(made.blocks)
    closing = made.after_page()
    assert [block for block in closing.blocks if isinstance(block, UserLines)] == [UserLines(("M778",))]
    assert not closing.toolpath.draws.any() and plain.after_page() is None
    assert plan(DRAWING, mine, whole=(False, False)).opening_count == 0 < made.opening_count


@pytest.mark.parametrize("step", ["go 0 0", "up"])
def test_a_hook_may_ask_for_nothing(step):
    joined = Drawing((line(0, 9.0), line(0, 9.0, begin=9.0, at=2.0)), Page(100, 50))
    for drawn, name in ((DRAWING, "before_page"), (DRAWING, "after_page"), (joined, "before_stroke")):
        made = plan(drawn, hooked(**{name: (step,)}))
        assert made.after_page() is None and made.opening_count == 0
        done = 0 if name != "before_stroke" else 2 if "go" in step else 1  # on the way to the first stroke, and within
        assert len(made.hook_ways()) == len(made.toolpath.hooks) == done


def test_a_job_whose_last_hook_asks_for_nothing_is_finished(tmp_path, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)
    mine = hooked(after_page=("go 0 0",))
    job, person = store.create([page(words=1)], mine, JobOptions(), place=tmp_path), types.SimpleNamespace(do=str)
    with job.open() as journal:  # it broke off when all was drawn
        journal.begin(0)
        journal.note_drawn(DrawnPlace(len(job.drawing(0).strokes)))
    runner.run_job(job, lambda: open_port("sim:", mine), person)
    assert job.standing().finished


def test_heights_of_a_dip_are_the_dip_s_alone():
    for name, written in [
        ("simulated", ["M3S95", "M3S90"]),
        ("grbl-z", ["Z-2F", "Z0F"]),
        ("axidraw-v3", ["SC,5,15000", "SC,5,15248"]),
    ]:
        profile = profiles.find(name, "plotter")
        deep = {"simulated": "95", "grbl-z": "-2mm", "axidraw-v3": "15000"}[name]
        mine = hooked(profile, dip=("go 160 20", f"down {deep}"), every=1000.0)
        told = b" ".join(
            command.data for command in dialect(profile.dialect).program(plan(DRAWING, mine).blocks, mine)
        ).decode()
        assert told.count(written[0]) == 1 and told.index(written[0]) < told.index(written[1], told.index(written[0]))


def test_a_pen_in_its_pot_has_drawn_nothing():
    drawn = Drawing((line(0, 10.0), line(1, 10.0, begin=20.0, at=2.0)), Page(100, 50))
    on_the_way = np.array([25.0, 10.0])  # the way to the pot leads over the second stroke
    ways = [np.array([[60.0, 10.0]])]
    assert find_place(drawn, DrawnPlace(1), on_the_way, 30.0, detours=ways) == DrawnPlace(1)
    assert find_place(drawn, DrawnPlace(1), on_the_way, 30.0).time == pytest.approx(2.5)


@functools.cache
def short():
    return drawing("it")


extent = functools.cache(lambda machine: undisturbed(machine, short()))
BREAKS = [
    (HOOKED[n % len(HOOKED)], fault, 900 + n)
    for n, fault in enumerate(["power-cut", "ctrl-c", "crash", "unplugged"] * 3)
]


@pytest.mark.slow
@pytest.mark.parametrize(("machine", "fault", "seed"), BREAKS, ids=[f"{m.title} {f} {n}" for m, f, n in BREAKS])
def test_whatever_breaks_off_is_drawn_once_and_never_dry(machine, fault, seed):
    run = disturbed(machine, fault, seed, short(), extent(machine))
    assert run.finished and verdict(run) == "right" and 0 < run.load <= EVERY * 1.02 + 0.2, run


@pytest.mark.slow
@pytest.mark.parametrize("machine", [HOOKED[0], HOOKED[4]], ids=lambda machine: machine.title)
def test_power_that_fails_before_and_after_the_page_lets_that_be_done_again(machine, monkeypatch):
    visits = []
    monkeypatch.setattr(
        faults, "without_pots", lambda drawn, profile: visits.append(drawn) or hooking.without_pots(drawn, profile)
    )
    for share in (0.005, 0.995):
        run = faults.Run(machine, "power-cut", 0)
        at = int(extent(machine).bytes * share)
        perform(run, faults.desk(machine, Simulated(**dict(machine.options), fault="power-cut", at=at)), short())
        assert verdict(run) == "right" and run.stops, run
        wiped = visits[-1].strokes[-1].xy
        assert np.ptp(wiped[:, 0]) == pytest.approx(8.0, abs=0.1) or re.search("axidraw", machine.title)
