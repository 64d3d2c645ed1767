"""A journal on a slow disk: the pen does not rest on the paper for it, and nothing is lost."""

import dataclasses
import os
import threading

import msgspec
import numpy as np
import pytest
from clocks import Clock, LateDisk
from cursive import page

from benchmarks.faults import Crash, Desk
from benchmarks.live import rests
from handout import profiles
from handout.errors import InputError
from handout.plotting.jobs import journal, runner, store
from handout.plotting.jobs.journal import PlotJournal, read_progress
from handout.plotting.jobs.places import DrawnPlace
from handout.simulated.plotter.options import SimulatorOptions as Simulated
from handout_lab.ink_comparison import compare
from handout_lab.simulated import FaultyPlotter

MACHINES = ["simulated", "grbl-z", "axidraw-v3", "marlin-servo"]
DRAWING = page(words=3)
LONGEST = max(stroke.length for stroke in DRAWING.strokes)


class Nobody:
    def do(self, request):
        return

    def try_again(self, error):
        return False


def profile_of(name):
    return profiles.find(name, "plotter")


def plotted(tmp_path, plotter, overlap=20.0, **more):
    """Plot a job; its reports, and what was said."""
    job = store.create([DRAWING], plotter.profile, store.JobOptions(overlap=overlap), place=tmp_path)
    said, reports = [], []
    runner.run_job(
        job, lambda: plotter, Nobody(), plotted=lambda report, port: reports.append(report), log=said.append, **more
    )
    return job, reports[0], [line for line in said if "disk" in line]


@pytest.fixture
def late(monkeypatch):
    """A clock, and a way to make the disk late by it."""
    clock = Clock()

    def disk(seconds):
        made = LateDisk(clock, seconds)
        monkeypatch.setattr(journal, "disk", lambda: made)
        return made

    monkeypatch.setattr("os.fsync", lambda handle: None)
    return clock, disk


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_a_disk_that_takes_a_second_does_not_stop_the_pen(tmp_path, late, name):
    clock, disk = late
    waiting = disk(1.0)
    plotter = FaultyPlotter(profile_of(name), clock=clock)
    job, report, said = plotted(tmp_path, plotter)
    assert rests(report.plan.intended_drawing(), plotter.executed_drawing()) == [] and report.observation.rests == ()
    assert report.unsecured > 20 and report.unsecured <= LONGEST * 1.02
    assert len(said) == 1 and f"up to {LONGEST:.0f} mm may be drawn twice" in said[0] and "overlap of 20 mm" in said[0]
    assert job.standing().finished and waiting.longest <= 3
    ink = compare(DRAWING, plotter.executed_drawing().strokes)
    assert ink.missing == 0 and ink.doubled == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("overlap", [8.0, 20.0])
def test_a_quick_disk_keeps_the_overlap_and_nothing_is_said(tmp_path, late, name, overlap):
    clock, disk = late
    disk(0.01)
    plotter = FaultyPlotter(profile_of(name), clock=clock)
    _, report, said = plotted(tmp_path, plotter, overlap)
    assert said == [] and report.unsecured <= overlap
    assert report.executed_s == pytest.approx(report.announced_s, rel=0.07)


def test_short_strokes_keep_the_overlap_on_a_slow_disk_too(tmp_path, late):
    clock, disk = late
    disk(0.5)
    plotter = FaultyPlotter(profile_of("simulated"), clock=clock)
    _, report, said = plotted(tmp_path, plotter, overlap=LONGEST + 25.0)
    assert said == [] and report.unsecured <= LONGEST + 25.0
    assert rests(report.plan.intended_drawing(), plotter.executed_drawing()) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("share", [0.15, 0.4, 0.8])
def test_the_computer_dies_while_the_disk_is_late(tmp_path, late, monkeypatch, name, share):
    clock, disk = late
    slow, kept = disk(1.0), {}

    def fsync(handle):
        if not slow.dead:
            kept[os.fstat(handle).st_ino] = os.fstat(handle).st_size

    monkeypatch.setattr("os.fsync", fsync)
    plotter = Desk(profile_of(name), Simulated(), clock)
    job = store.create([DRAWING], plotter.profile, store.JobOptions(), place=tmp_path)

    def dies(done, left):
        if done > share and not slow.dead:
            slow.dead = True
            raise Crash

    with pytest.raises(Crash):
        runner.run_job(job, lambda: plotter, Nobody(), progress=dies)
    path = job.folder / "journal"
    os.truncate(path, kept[path.stat().st_ino])
    assert not job.standing().finished
    plotter.replug()
    slow.dead = False
    disk(0.0)
    runner.run_job(job, lambda: plotter, Nobody())
    ink = compare(DRAWING, plotter.executed_drawing().strokes)
    assert ink.missing == 0 and ink.dots == 0 and ink.stray == 0 and ink.doubled <= 1.1 * LONGEST


class Held:
    """A disk, for the thread that waits for it: it keeps nothing while it is held."""

    def __init__(self, monkeypatch):
        self.free, self.waits = threading.Event(), 0
        self.free.set()
        monkeypatch.setattr("os.fsync", self.fsync)

    def fsync(self, handle):
        self.waits += not self.free.is_set()
        assert self.free.wait(30.0), "the plot waited for the disk"


class Lifting(FaultyPlotter):
    """Holds the disk when the pen is lowered, and frees it when the command to lift it has come."""

    held = None
    strokes = 0

    def write(self, data):
        super().write(data)
        if data == b"M3S60\n":
            self.held.free.clear()
        elif data == b"M3S40\n" and not self.held.free.is_set():
            self.strokes += 1
            self.held.free.set()


def test_all_of_a_stroke_is_sent_while_the_disk_is_held(tmp_path, monkeypatch):
    held = Held(monkeypatch)
    profile = profile_of("simulated")
    pen = msgspec.structs.replace(profile.pen, up=40.0, down=60.0, ramp=0.0)
    plotter = Lifting(msgspec.structs.replace(profile, pen=pen), clock=Clock())
    plotter.held = held
    job, report, _ = plotted(tmp_path, plotter)
    assert plotter.strokes == len(DRAWING.strokes) and held.waits >= 1 and report.unsecured > 20
    assert job.standing().finished and not [one for one in threading.enumerate() if one.name.startswith("journal")]


@pytest.mark.parametrize("number", [28, 30])
def test_an_error_of_the_disk_within_a_stroke_lifts_the_pen(tmp_path, monkeypatch, number):
    calls = []

    def full(handle):
        calls.append(handle)
        if len(calls) > 12:
            raise OSError(number, os.strerror(number))

    plotter = FaultyPlotter(profile_of("simulated"))
    job = store.create([DRAWING], plotter.profile, store.JobOptions(), place=tmp_path)
    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(InputError, match=f"Cannot write the journal .*: {os.strerror(number)}"):
        runner.run_job(job, lambda: plotter, Nobody())
    assert not plotter.pen_is_down and plotter.at_rest
    assert not [one for one in threading.enumerate() if one.name.startswith("journal")]
    monkeypatch.setattr("os.fsync", lambda handle: None)
    plotter.replug()
    runner.run_job(job, lambda: plotter, Nobody())
    ink = compare(DRAWING, plotter.executed_drawing().strokes)
    assert ink.missing == 0 and ink.dots == 0 and job.standing().finished


def test_what_is_known_is_on_the_disk_after_an_interrupt_that_finds_it_busy(tmp_path, late):
    clock, disk = late
    disk(1.0)
    plotter = FaultyPlotter(profile_of("simulated"), clock=clock)
    job = store.create([DRAWING], plotter.profile, store.JobOptions(), place=tmp_path)

    def stop(done, left):
        if done > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        runner.run_job(job, lambda: plotter, Nobody(), progress=stop)
    assert job.standing().stopped == "it was interrupted" and not plotter.pen_is_down
    plotter.replug()
    runner.run_job(job, lambda: plotter, Nobody())
    ink = compare(DRAWING, plotter.executed_drawing().strokes)
    assert ink.missing == 0 and ink.doubled <= 0.5


def test_places_do_not_pile_up_behind_a_slow_disk(tmp_path, monkeypatch):
    held = Held(monkeypatch)
    path = tmp_path / "journal"
    with PlotJournal(path) as kept:
        kept.begin(0)
        held.free.clear()
        pending = kept.secure() if kept.note_drawn(DrawnPlace(0, 0.5)) is None else None
        for at in range(5000):
            kept.note_drawn(DrawnPlace(1, at / 7))
        assert kept.standing.place == DrawnPlace(1, 4999 / 7) and kept.certain.place != kept.standing.place
        assert len(kept._waiting) <= 1 and not pending.done()
        held.free.set()
        kept.sync()
        assert kept.certain == kept.standing
    assert path.read_bytes().count(b"drawn") < 5 and read_progress(path).place == DrawnPlace(1, 4999 / 7)


def test_a_disk_that_takes_a_part_of_a_line_is_given_the_rest(tmp_path):
    path = tmp_path / "journal"
    with PlotJournal(path) as kept:
        real = kept._file._file

        class Bit:
            def write(self, data):
                return real.write(data[:5])

            def __getattr__(self, name):
                return getattr(real, name)

        kept._file._file = Bit()
        kept.begin(0)
        kept.note_drawn(DrawnPlace(2, 1.0))
        kept.sync()
    assert read_progress(path).place == DrawnPlace(2, 1.0)


def test_the_judge_sees_a_rest_that_is_there():
    stroke = DRAWING.strokes[0]
    at = len(stroke.t) // 2
    t = stroke.t + np.where(np.arange(len(stroke.t)) >= at, 0.3, 0.0)
    rested = dataclasses.replace(stroke, t=t)
    found = rests(DRAWING, dataclasses.replace(DRAWING, strokes=(rested, *DRAWING.strokes[1:])))
    assert [number for number, _, _ in found] == [0] and found[0][2] == pytest.approx(0.3, abs=0.05)
