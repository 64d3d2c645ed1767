"""Rows made by other processes: the same pages from any of them, in their order, whatever becomes of the processes."""

import json
import multiprocessing
import os
import pickle
import random
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from dataclasses import replace
from pathlib import Path

import pytest

import handout
from handout.errors import InputError
from handout.pipeline import merging
from handout.pipeline.merging import RowAccount, RowPages
from handout.pipeline.options import MergeOptions, PictureOptions, PrintOptions, SheetOptions, TableOptions
from handout.pipeline.options import WritingOptions as Writing
from handout.pipeline.results import SILENT
from handout.pipeline.row_work import MadeRow, ProcessWorkers, Remote, RowWork, WorkersLost, open_workers, row_work
from handout.printing.prepared import PreparedRow
from handout.printing.rows import TableRow

PEOPLE = "First name,Street,City,Pen\n" + "".join(f"Anna{n},Weg {n},Ulm,\n" for n in range(2, 8))
LETTER = '---\npage = "90x60mm"\n---\n# Dear {{ first_name }},\n\n{% if city %}\n- tea\n{% endif %}\n\n{{ city }}\n'


class Fake(Remote):
    """Processes that are none: rows are lost as told, by their numbers."""

    ahead = 3

    def __init__(self, lost=()):
        super().__init__(RowWork(None, None))
        self.lost, self.begun, self.taken = deque(lost), [], 0

    def submit(self, row, check):
        self.begun.append(row.number)
        assert len(set(self.begun)) - self.taken <= self.ahead
        return row

    def result(self, future):
        if self.lost and self.lost[0] == future.number:
            self.lost.popleft()
            return None
        self.taken += 1
        return MadeRow(PreparedRow(future.number), RowAccount())

    def recover(self, waiting):
        return [True] * len(waiting)


def numbered(count):
    return [TableRow(number, ("A",)) for number in range(count)]


def test_rows_come_in_their_order_and_no_more_are_begun_than_are_ahead():
    fake = Fake()
    rows = fake.make_each(iter(numbered(9)))
    assert fake.begun == []  # nothing is made before somebody asks
    for number in range(9):
        assert next(rows).row.number == number
        assert fake.begun == list(range(min(number + 3, 9)))  # while nobody takes more, no more is begun
    assert list(rows) == []


def test_what_is_lost_with_a_process_is_begun_again_but_not_for_ever():
    fake = Fake([1, 1, 4])
    assert [made.row.number for made in fake.make_each(numbered(6))] == list(range(6))
    with pytest.raises(WorkersLost, match=r"row 2 ended 5 times.*fewer --jobs"):
        list(Fake([2] * 5).make_each(numbered(6)))


class Plain:
    """A destination that keeps a page's pixels; at module level, so that it can be pickled."""

    def __call__(self, number, page):
        from handout.printing.prepared import PreparedPage

        return PreparedPage(page.part, page.drawing.page, page.pixels(40).rgb.tobytes())


@pytest.fixture
def work(tmp_path, monkeypatch):
    """A letter file and an envelope for every row."""
    monkeypatch.chdir(tmp_path)
    Path("people.csv").write_text(PEOPLE, encoding="utf-8")
    Path("letter.md").write_text(LETTER, encoding="utf-8")
    merged = merging.read_merge(
        Path("people.csv"), TableOptions(), MergeOptions("letter.md", with_envelopes=True), SILENT
    )
    sheet = SheetOptions(usual_page="A4")
    return row_work(RowPages(merged, Writing("house-print"), sheet, PictureOptions(pen="plain"), seed=3), Plain())


def pages(made):
    return {each.row.number: (each.row.pages, each.row.problem, each.account.tally) for each in made}


def test_a_row_is_the_same_in_any_order_and_from_a_pickled_work(work):
    rows = work.pages.merge.table.rows[:3]
    forwards = pages(map(work.make, rows))
    copy = pickle.loads(pickle.dumps(work))
    assert not copy.pages.merge.table.rows and copy.hands[0][0] == "house-print"
    copy.verify()
    assert pages(map(copy.make, reversed(rows))) == forwards
    assert all(len(made) == 2 and not problem for made, problem, _ in forwards.values())
    assert len({made[0].data for made, _, _ in forwards.values()}) == 3


def test_a_row_that_cannot_be_made_keeps_its_sentence(work):
    long = TableRow(2, ("A", "B"), ("odd",), cells={"First name": "a" * 90, "City": "Ulm"})
    for made in (work.make(long), work.check(long)):
        assert "letter.md, line 4" in made.row.problem and not made.row.pages and made.row.warnings == ("odd",)
    assert work.check(replace(long, problem="it is empty")).row.problem == "it is empty"
    good = work.check(work.pages.merge.table.rows[0])
    assert not good.row.problem and not good.row.pages and not good.account.tally.pages


def test_a_machine_where_pages_could_come_out_otherwise_is_refused(work):
    with pytest.raises(InputError, match=r"runs handout .*, and this is handout 9: install the same"):
        replace(work, program="handout 9").verify()
    with pytest.raises(InputError, match="has another hand house-print, or none"):
        replace(work, hands=(("house-print", "0" * 64),)).verify()
    with pytest.raises(InputError, match="has no folder"):
        replace(work, folder=Path("/nowhere")).verify()


@pytest.mark.slow
def test_no_cluster_is_one_sentence(work, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("handout.pipeline.row_work._ANSWER", 0.1)
    with pytest.raises(InputError, match="no scheduler answers at nowhere"), open_workers(work, 1, "nowhere:1", print):
        pass


@pytest.mark.slow
def test_processes_that_are_killed_at_random_leave_no_trace(work):
    rows, before = work.pages.merge.table.rows, set(multiprocessing.active_children())
    wanted, rng = pages(map(work.make, rows)), random.Random(1)
    with ProcessWorkers(work, 2) as workers:
        made = []
        for each in workers.make_each(rows):
            made.append(each)
            if len(made) in (1, 3):
                victim = rng.choice(sorted(set(multiprocessing.active_children()) - before, key=lambda one: one.pid))
                os.kill(victim.pid, signal.SIGKILL)
    assert list(pages(made)) == [row.number for row in rows] and pages(made) == wanted


@pytest.mark.slow
def test_workers_of_a_cluster_that_are_killed_at_random_leave_no_trace(work):
    distributed = pytest.importorskip("distributed")
    rows, rng = work.pages.merge.table.rows, random.Random(2)
    wanted = pages(map(work.make, rows))
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster,
        open_workers(work, 1, cluster.scheduler_address, print) as workers,
    ):
        made = []
        for each in workers.make_each(rows):
            made.append(each)
            if len(made) in (1, 3):
                alive = [worker.pid for worker in cluster.workers.values() if worker.pid]
                os.kill(rng.choice(alive), signal.SIGKILL)
    assert list(pages(made)) == [row.number for row in rows] and pages(made) == wanted


@pytest.mark.slow
def test_ctrl_c_ends_the_processes_and_says_how_to_go_on(work, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(Path(handout.__file__).parents[1]), "OMP_NUM_THREADS": "1"}
    environment["XDG_STATE_HOME"] = str(tmp_path / "state")
    Path("people.csv").write_text(PEOPLE + "Ben,Weg 9,Ulm,\n" * 300, encoding="utf-8")  # more than are made in the test
    program = "import signal, sys; signal.signal(2, signal.default_int_handler); from handout.cli import main; main()"
    command = [sys.executable, "-c", program, "print", "people.csv", "--letter", "letter.md", "--jobs", "2"]
    command += ["--printer", "small.toml", "--dry-run", "printed", "--skip-bad", "--pen", "plain"]
    Path("small.toml").write_text('kind = "printer"\ntitle = "Small"\ndpi = 72\nsimulated = true\n')
    with subprocess.Popen(command, stderr=subprocess.PIPE, env=environment, start_new_session=True) as process:
        watch = threading.Timer(60, process.kill)
        watch.start()
        while not Path("printed/job-001.pdf").exists() and process.poll() is None:
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: all of its processes hear it
        _, said = process.communicate()
        watch.cancel()
    assert process.returncode == 130 and b"Traceback" not in said and b"go on with" in said
    with pytest.raises(ProcessLookupError):  # nobody of the group is left
        for _ in range(100):
            os.killpg(process.pid, 0)
            time.sleep(0.05)


def test_jobs_are_no_part_of_what_a_batch_is():
    usual = merging._list_options(PrintOptions())
    assert merging._list_options(PrintOptions(jobs=7, cluster="tcp://a:1")) == usual and "jobs" not in json.dumps(usual)
