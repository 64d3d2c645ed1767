"""Jobs whose pages are made while the first are drawn: whenever the power goes, all ink comes on its sheet, once."""

import dataclasses
import os
import sys

import numpy as np
import pytest
from cursive import page
from hypothesis import given, settings
from hypothesis import strategies as st

from handout import profiles
from handout.errors import DoesNotFit, InputError
from handout.plotting import bed
from handout.plotting.jobs import runner, store
from handout.plotting.jobs.pages import NewPage, ProducerProcess
from handout.plotting.jobs.store import JobOptions, load
from handout.values import Drawing
from handout_lab.ink_comparison import compare
from handout_lab.simulated import FaultyPlotter

PROFILE = profiles.find("simulated", "plotter")
OVERLAP = 6.0
TEXT = [page(seed, words=1) for seed in (1, 2, 3)]
SYNC = os.fsync


class PowerCut(BaseException):
    """The computer is off."""


class Power:
    """Stands for `os.fsync`: after so many calls the power goes, and with it what no call has made sure of."""

    def __init__(self):
        self.calls, self.safe = np.inf, {}

    def __call__(self, handle):
        if self.calls <= 0:
            raise PowerCut
        self.calls -= 1
        self.safe[os.fstat(handle).st_ino] = os.fstat(handle).st_size

    def lost(self, folder):
        """What the disk has forgotten when the computer is switched on again."""
        for path in folder.glob("*/journal"):
            os.truncate(path, self.safe.get(path.stat().st_ino, 0))


class Maker:
    """A supply that makes a page when it is asked for one, or when it is told to."""

    def __init__(self, folder, drawings=TEXT):
        self.folder, self.drawings = folder, drawings

    def make(self):
        job = load(self.folder)
        if job.whole:
            return
        if job.pages == len(self.drawings):
            store.complete(job)
            return
        store.add(job, job.pages, NewPage(self.drawings[job.pages], (job.pages + 1) / len(self.drawings)))

    wait = make

    def trouble(self):
        return ""


class Desk:
    """A plotter with somebody who puts in sheets and pushes the pen to its zero; what was drawn lies in a heap."""

    def __init__(self):
        self.plotter, self.heap, self.asked = FaultyPlotter(PROFILE), [], []
        self.sheet()

    def sheet(self):
        self.heap.append(self.plotter.executed_drawing().strokes if self.heap else ())
        self.plotter.lay(TEXT[0].page, bed.place(TEXT[0].page, PROFILE))

    def do(self, request):
        self.asked.append(request)
        if "Put in sheet" in request:
            self.sheet()
        elif "push it above" in request:
            self.plotter.stand_at_zero()

    def try_again(self, error):
        return False

    def opened(self):
        self.plotter.replug()
        return self.plotter

    def sheets(self):
        """Those with ink on them, in order."""
        self.sheet()
        return [strokes for strokes in self.heap if strokes]


def begun(place, options=None):
    return store.begin(
        [NewPage(TEXT[0], 1 / 3)], PROFILE, options or JobOptions(overlap=OVERLAP), {"any": 1}, place=place
    )


def one_life(desk, place, power, ahead, monkeypatch):
    """Plot what there is to plot until all is done, or the power goes; whether it did not."""
    monkeypatch.setattr("os.fsync", power)
    try:
        job = (store.list_kept_jobs(place) or [None])[0] or begun(place)
        maker = Maker(job.folder)

        def progress(share, left):  # pages are made in the middle of strokes, too
            if share > next(ahead, np.inf):
                maker.make()

        runner.run_job(job, desk.opened, desk, supply=maker, progress=progress)
    except PowerCut:
        power.lost(place)
        desk.plotter.power_on()
        return False
    finally:
        monkeypatch.setattr("os.fsync", SYNC)
    return True


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(st.lists(st.integers(0, 60), max_size=4), st.lists(st.floats(0, 0.9), max_size=4))
def test_the_power_goes_at_any_moment(tmp_path_factory, cuts, shares):
    place, desk = tmp_path_factory.mktemp("plots"), Desk()
    ahead, power = iter(sorted(shares)), Power()
    with pytest.MonkeyPatch.context() as patch:
        for power.calls in cuts:
            one_life(desk, place, power, ahead, patch)
        power.calls = np.inf
        assert one_life(desk, place, power, ahead, patch)
    for drawing, strokes in zip(TEXT, desk.sheets(), strict=True):
        told = compare(drawing, strokes)
        assert told.missing == 0 and told.dots == 0 and told.stray == 0 and told.deviation < 0.1, told
        assert told.doubled <= (OVERLAP + 0.1) * len(cuts), told
    (job,) = store.list_kept_jobs(place)
    assert job.standing().finished and not list(job.folder.glob(".*"))
    assert {path.name for path in job.folder.iterdir() if "page-" not in path.name} == {"job.json", "journal"}


def test_a_job_in_the_making_becomes_what_it_would_have_been_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)
    options = JobOptions(overlap=OVERLAP, copies=2, pause_every=60.0, order="travel")
    whole = store.create(TEXT, PROFILE, options, place=tmp_path / "whole")
    job = begun(tmp_path / "made", options)
    assert not job.whole and job.pages == 1 and job.parts == whole.parts[: len(job.parts)]
    assert job.ink == pytest.approx(whole.ink, rel=0.5)
    maker = Maker(job.folder)
    maker.make()
    some = load(job.folder)
    assert some.pages == 2 and some.share == pytest.approx(2 / 3) and some.parts == whole.parts[: len(some.parts)]
    maker.make()
    maker.make()
    done = load(job.folder)
    assert done.whole and (done.parts, done.pages, done.ink) == (whole.parts, whole.pages, whole.ink)
    assert (done.drawing(3).strokes[0].xy == whole.drawing(3).strokes[0].xy).all()


@pytest.mark.slow
def test_the_same_is_asked_for_whether_the_pages_are_there_or_not(tmp_path, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)
    options, asked = JobOptions(overlap=OVERLAP, copies=2, pause_every=100.0), []
    for job in (store.create(TEXT, PROFILE, options, place=tmp_path / "a"), begun(tmp_path / "b", options)):
        desk, shares = Desk(), []
        supply = None if job.whole else Maker(job.folder)
        runner.run_job(
            job, desk.opened, desk, supply=supply, progress=lambda share, left, shares=shares: shares.append(share)
        )
        assert shares[-1] == pytest.approx(1.0) and max(shares) <= 1.0
        asked.append(desk.asked)
    assert asked[0] == asked[1] and sum("Put in sheet" in one for one in asked[0]) == 5


def test_what_is_made_is_drawn_when_the_rest_cannot_be(tmp_path, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)
    said, desk, job = [], Desk(), begun(tmp_path)
    Maker(job.folder).make()
    program = ProducerProcess([sys.executable, "-c", "print('added 2'); print('failed The hand is gone.'); exit(2)"])
    while not program.trouble():
        pass
    with pytest.raises(InputError, match="The hand is gone"):
        runner.run_job(load(job.folder), desk.opened, desk, supply=program, log=said.append)
    program.close()
    assert len(desk.sheets()) == 2 and "The hand is gone. The pages before that are drawn." in said
    standing = job.standing()
    assert (standing.part, standing.begun, standing.finished) == (2, False, False)
    with pytest.raises(InputError, match="Only 2 pages"):
        runner.run_job(load(job.folder), desk.opened, desk)


@pytest.mark.parametrize("code", ["exit(1)", "pass"])
def test_a_program_that_makes_nothing_is_not_waited_for(tmp_path, monkeypatch, code):
    monkeypatch.setattr("os.fsync", lambda handle: None)
    program, desk, job = ProducerProcess([sys.executable, "-c", code]), Desk(), begun(tmp_path)
    with pytest.raises(InputError, match=r"ended with [01]"):
        runner.run_job(job, desk.opened, desk, supply=program)
    program.close()
    assert len(desk.sheets()) == 1


def test_a_page_that_cannot_be_kept_or_read_is_named(tmp_path):
    job = begun(tmp_path)
    far = Drawing(
        tuple(dataclasses.replace(stroke, xy=stroke.xy + np.array([900.0, 0.0])) for stroke in TEXT[1].strokes),
        TEXT[1].page,
    )
    with pytest.raises(DoesNotFit):
        store.add(job, 1, NewPage(far, 0.5))
    assert load(job.folder) == job
    store.add(job, 1, NewPage(TEXT[1], 0.5))
    (job.folder / "page-2.json").write_text("{")
    with pytest.raises(InputError, match="cannot be read"):
        load(job.folder)
    (job.folder / "page-1.json.gz").unlink()
    with pytest.raises(InputError, match=r"page-1\.json\.gz is missing"):
        job.drawing(0)
