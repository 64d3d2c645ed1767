"""Texts of several pages: the first is plotted while the others are written, and they are those of the preview."""

import contextlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import handout
from handout.errors import InputError
from handout.hand.library import path
from handout.pipeline import job_pages
from handout.plotting.jobs import store
from handout.plotting.jobs.store import load
from handout.sources.drawing_json import from_json

SMALL = ("--page", "60x40mm", "--margin", "6mm", "--seed", "5", "--hand")
TEXT = "All is well here, and the garden is green.\n  More about it soon.\nYours, Ada. "


@contextlib.contextmanager
def none_made(job):
    """A supply that makes nothing: only the first page is there when the plot breaks off."""
    yield None


def begun(call, monkeypatch, hand="house-print", text=TEXT, *more):
    """A job with one page, that broke off in it."""
    with monkeypatch.context() as patch:
        patch.setattr("handout.pipeline.plotting.job_pages.producer", none_made)
        call("plot", "--port", "sim:?fault=alarm&after=60", text, *SMALL, hand, *more, code=3)
    job = store.find()
    assert job.pages == 1 and not job.whole
    return job


@pytest.mark.slow
def test_what_is_made_later_is_what_the_preview_shows(call, monkeypatch):
    facts = json.loads(call("plot", TEXT, *SMALL, "house-print", "--dry-run", "x.json", "--json", "--slips", 40)[0])
    shown = [from_json(Path(file).read_bytes()) for file in facts["files"]]
    job = begun(call, monkeypatch, "house-print", TEXT, "--slips", 40)
    assert list(job_pages.complete(job.folder)) == [2, 3] and list(job_pages.complete(job.folder)) == []
    done = load(job.folder)
    assert done.whole and done.pages == len(shown) == 3 and done.inputs is None
    for number, drawing in enumerate(shown):
        kept = done.drawing(number)
        assert all(
            (a.t == b.t).all() and (a.xy == b.xy).all() for a, b in zip(kept.strokes, drawing.strokes, strict=True)
        )
    told = json.loads(call("plot", TEXT, *SMALL, "house-print", "--port", "sim:", "--json", "-q", "--slips", 40)[0])
    assert all(told[key] == pytest.approx(facts[key], abs=0.02) for key in ("pages", "characters", "pen_down_mm"))
    assert told["slips"] == facts["slips"]


@pytest.mark.slow
def test_a_job_that_broke_off_on_its_first_page_is_gone_on_with_to_its_last(call, monkeypatch):
    job = begun(call, monkeypatch)
    told = json.loads(call("plot", "show", job.name, "--json")[0])
    assert (told["sheets"], told["all_written"], told["finished"]) == (1, False, False)
    assert "1 sheet so far" in call("plot", "jobs")[0]
    assert "goes on with sheet 1, at stroke" in call("plot", "show", job.name)[0]
    told = json.loads(call("plot", "--resume", "--port", "sim:", "--json")[0])
    assert (told["sheets"], told["parts"], told["finished"]) == (2, 2, True)
    assert told["drawn_mm"] == told["pen_down_mm"]


@pytest.mark.slow
@pytest.mark.parametrize("harm", ["changed", "gone", "program"])
def test_what_the_pages_are_made_from_is_another_now(call, monkeypatch, harm):
    shutil.copy(path("house-print"), "mine.toml")
    job, hand = begun(call, monkeypatch, "mine.toml"), Path("mine.toml")
    was = hand.read_text(encoding="utf-8")
    if harm == "changed":
        hand.write_text(was + "\n# another\n", encoding="utf-8")
    elif harm == "gone":
        hand.unlink()
    else:
        monkeypatch.setattr("handout.pipeline.texts.__version__", "9.9")
    said = {"changed": "mine.toml has changed", "gone": "mine.toml is gone", "program": "from handout 9.9"}[harm]
    with pytest.raises(InputError, match=f"The pages behind page 1 were not made yet, and .*{re.escape(said)}"):
        list(job_pages.complete(job.folder))
    if harm == "changed":
        _, err = call("plot", "--resume", "--port", "sim:", code=2)
        assert said in err and f"The job is kept; go on with: handout plot --resume {job.name}" in err
        assert "goes on with what is written next" in call("plot", "show", job.name)[0]
        hand.write_text(was, encoding="utf-8")
        assert list(job_pages.complete(job.folder)) == [2]


def test_when_all_pages_are_there_the_hand_is_needed_no_longer(call, monkeypatch):
    shutil.copy(path("house-print"), "mine.toml")
    job = begun(call, monkeypatch, "mine.toml")
    with monkeypatch.context() as patch:
        patch.setattr("handout.plotting.jobs.store.complete", lambda job: None)
        assert list(job_pages.complete(job.folder)) == [2]
    assert not load(job.folder).whole
    Path("mine.toml").unlink()
    assert list(job_pages.complete(job.folder)) == [] and load(job.folder).whole


def test_pages_that_end_elsewhere_are_not_mixed(call, monkeypatch):
    job = begun(call, monkeypatch)
    record = job.folder / "page-1.json"
    record.write_text(record.read_text().replace('"share":0.', '"share":0.1'))
    with pytest.raises(InputError, match="Page 1 of the job does not end where it would end now"):
        list(job_pages.complete(job.folder))


@pytest.mark.slow
def test_the_program_that_makes_pages_stops_when_nobody_plots(call, monkeypatch):
    job = begun(call, monkeypatch, "house-print", TEXT * 8)
    environment = {"PYTHONPATH": str(Path(handout.__file__).parents[1]), "OMP_NUM_THREADS": "1"}
    program = subprocess.Popen(
        [sys.executable, "-m", "handout.pipeline.job_pages", job.folder],
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )
    assert program.stdout.readline() == "added 2\n"
    program.stdout.close()
    assert program.wait(60) == 0
    left = load(job.folder)
    assert 2 <= left.pages < 12 and not left.whole
    assert next(job_pages.complete(job.folder)) == left.pages + 1


def test_what_cannot_be_written_is_found_before_there_is_a_job(call):
    assert "no form for 'ժ'" in call("plot", "--port", "sim:", TEXT * 20 + "ժ", *SMALL, "house-print", code=2)[1]
    assert "lines" in call("plot", "--port", "sim:", TEXT * 3, *SMALL, "house-print", "--pages", 2, code=2)[1]
    assert call("plot", "jobs")[1] == "No plot is kept.\n"
