"""Jobs on the disk: kept whole or not at all, found by name, pruned when they are finished."""

import dataclasses
import json

import numpy as np
import pytest
from cursive import page

from handout import profiles
from handout.errors import DoesNotFit, InputError
from handout.plotting.jobs import store
from handout.plotting.jobs.places import START
from handout.plotting.jobs.store import JobOptions
from handout.values import Drawing, Page

SERVO = profiles.find("grbl-servo", "plotter")


@pytest.fixture(autouse=True)
def no_waiting_for_the_disk(monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)


def same(one, other):
    pairs = zip(one.strokes, other.strokes, strict=True)
    return one.page == other.page and all(
        (a.t == b.t).all() and (a.xy == b.xy).all() and a.word == b.word and a.layer == b.layer for a, b in pairs
    )


def finished(job):
    with job.open() as kept:
        kept.finish()
    job.drop_drawings()


def test_what_is_kept_comes_back_to_the_last_digit(tmp_path):
    drawings = [page(seed, words=3) for seed in (1, 2)]
    options = JobOptions(speed=0.5, overlap=3.25, copies=2)
    job = store.create(drawings, SERVO, options, title="Dear Ada", port="/dev/ttyUSB3", place=tmp_path)
    again = store.load(job.folder)
    assert again == job and again.profile == SERVO and type(again.profile.pen.up_time) is type(SERVO.pen.up_time)
    assert [part.page for part in again.parts] == [0, 1, 0, 1] and again.pages == 2
    assert same(again.drawing(3), drawings[1]) and again.drawing(0).about == drawings[0].about
    assert again.ink == pytest.approx(2 * sum(drawing.pen_down for drawing in drawings))
    standing = again.standing()
    assert (standing.part, standing.begun, standing.place, standing.finished) == (0, False, START, False)


def test_names_are_short_and_differ(tmp_path):
    names = [store.create([page(words=1)], SERVO, JobOptions(), place=tmp_path).name for _ in range(3)]
    assert [name.rsplit("-", 1)[1] for name in names] == ["1", "2", "3"] and all(len(name) == 7 for name in names)
    assert store.find(names[1], tmp_path).name == names[1]
    assert store.find(None, tmp_path, unfinished=True).name == names[2]
    finished(store.find(names[2], tmp_path))
    assert store.find(None, tmp_path, unfinished=True).name == names[1]
    assert store.find(None, tmp_path).name == store.find("last", tmp_path).name == names[2]
    (tmp_path / names[2] / "journal").unlink()  # as in the middle of its deletion
    assert store.find("last", tmp_path).name == names[1]
    with pytest.raises(InputError, match=f"no job 'mar99-1'; the last ones are {', '.join(names)}"):
        store.find("mar99-1", tmp_path)


def test_nothing_to_resume(tmp_path):
    with pytest.raises(InputError, match="nothing to resume"):
        store.find(None, tmp_path / "none", unfinished=True)
    with pytest.raises(InputError, match="none is kept"):
        store.find("a", tmp_path)


def test_what_fails_leaves_nothing(tmp_path):
    def failing():
        yield page(words=1)
        raise ZeroDivisionError

    far = Drawing(
        tuple(dataclasses.replace(s, xy=s.xy + np.array([900.0, 0])) for s in page(words=1).strokes), Page(1000, 100)
    )
    with pytest.raises(ZeroDivisionError):
        store.create(failing(), SERVO, JobOptions(), place=tmp_path)
    with pytest.raises(DoesNotFit):
        store.create([far], SERVO, JobOptions(), place=tmp_path)
    with pytest.raises(InputError, match="nothing to plot"):
        store.create([Drawing((), Page(100, 100))], SERVO, JobOptions(), place=tmp_path)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="Cannot keep the job in"):
        store.create([page(words=1)], SERVO, JobOptions(), place=tmp_path / "file")


def test_each_page_is_let_go_before_the_next_is_made(tmp_path):
    import weakref

    alive = []

    def pages():
        for seed in range(4):
            drawing = page(seed, words=1)
            alive.append(weakref.ref(drawing.strokes[0]))
            yield drawing
            del drawing
            assert sum(one() is not None for one in alive) <= 2

    store.create(pages(), SERVO, JobOptions(), place=tmp_path)


def test_finished_jobs_are_pruned_and_others_are_not(tmp_path):
    jobs = [store.create([page(words=1)], SERVO, JobOptions(), place=tmp_path) for _ in range(5)]
    for job in (jobs[0], jobs[2], jobs[3]):
        finished(job)
    assert sorted(path.name for path in jobs[0].folder.iterdir()) == ["job.json", "journal"]
    store.prune(tmp_path, keep=1)
    assert [job.name for job in store.list_kept_jobs(tmp_path)] == [jobs[1].name, jobs[3].name, jobs[4].name]
    store.prune(tmp_path, keep=0)
    assert [job.name for job in store.list_kept_jobs(tmp_path)] == [jobs[1].name, jobs[4].name]
    store.forget(jobs[1])
    assert [job.name for job in store.list_kept_jobs(tmp_path)] == [jobs[4].name]


def test_a_damaged_journal_is_never_pruned(tmp_path):
    job = store.create([page(words=1)], SERVO, JobOptions(), place=tmp_path)
    finished(job)
    path = job.folder / "journal"
    path.write_bytes(b"x" + path.read_bytes()[1:])
    store.prune(tmp_path, keep=0)
    assert store.list_kept_jobs(tmp_path) == [job]


def test_a_job_that_is_being_plotted_is_not_forgotten(tmp_path):
    job = store.create([page(words=1)], SERVO, JobOptions(), place=tmp_path)
    with job.open(), pytest.raises(InputError, match="being plotted"):
        store.forget(job)
    assert job.folder.exists()


def test_damage_is_named(tmp_path):
    job = store.create([page(words=1)], SERVO, JobOptions(), place=tmp_path)
    path = job.folder / "page-1.json.gz"
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(InputError, match=r"page-1\.json\.gz is missing or damaged"):
        job.drawing(0)
    facts = json.loads((job.folder / "job.json").read_text())
    facts["version"] = 2
    (job.folder / "job.json").write_text(json.dumps(facts))
    with pytest.raises(InputError, match=f"job {job.name} cannot be read"):
        store.load(job.folder)


def test_travel_order_is_settled_when_the_job_is_made(tmp_path):
    drawing = page(seed=8, words=30)
    job = store.create([drawing], SERVO, JobOptions(order="travel"), place=tmp_path)
    kept = job.drawing(0)
    assert sorted(s.xy.tolist() for s in kept.strokes) == sorted(s.xy.tolist() for s in drawing.strokes)
    assert kept.pen_up < drawing.pen_up
