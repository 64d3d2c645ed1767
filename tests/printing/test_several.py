"""Several devices at once: each page once, whatever stops; a row's pages on one, or envelopes after their letters."""

import threading
import time
from collections import Counter
from contextlib import nullcontext
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handout.errors import DeviceError, PrinterError
from handout.printing import journal
from handout.printing.batch import BatchOptions, make_rows
from handout.printing.journal import ENVELOPE, Journal
from handout.printing.prepared import PreparedPage, PreparedRow
from handout.printing.queue import Outcome, OutcomeUnknown
from handout.printing.rows import TableRow
from handout.printing.sending import PrintingStopped
from handout.printing.several import Several
from handout.signals import interrupt
from handout.values import Page

PARTS = ("letter 1", ENVELOPE)


class Machine:
    """A device that remembers what it made, by title; at one sheet, from 1, it fails in a way of its own.

    refuses: it takes nothing.  lost: it makes the sheet, and nobody hears of it.  breaks: it makes half of it.
    """

    keeps = False

    def __init__(self, name, log, fails=0, how="refuses"):
        self.name, self.log, self.fails, self.how = name, log, fails, how
        self.made, self.half, self.count = [], set(), 0

    def take(self, title, pieces):
        self.count += 1
        if self.count == self.fails and self.how == "refuses":
            raise PrinterError("out of paper.")
        if self.count == self.fails and self.how == "breaks":
            self.half.add(title)
        else:
            self.made.append(title)
        self.log += [(self.name, piece) for piece in pieces]
        if self.count == self.fails and self.how == "lost":
            raise OutcomeUnknown("the cable was pulled.")
        return f"job of {title}"

    def follow(self, job, title):
        if title in self.half and self.count == self.fails:
            self.fails = 0  # it is mended before the next run
            raise DeviceError("the cable was pulled.")
        self.half.discard(title)
        self.made.append(title)
        return Outcome("completed")

    def outcome(self, job, title, earlier=()):
        if title in self.half:
            return Outcome("waiting", job="" if job else f"job of {title}")
        return Outcome("completed" if title in self.made else "failed")

    def cancel(self, job, title):
        return self.outcome(job, title)


class Spool(nullcontext):
    """Sends pages to a machine as they come, so many on a sheet, envelopes last."""

    prepare = None

    def __init__(self, machine, many=1):
        super().__init__(self)
        self.queue, self.many, self.pages = machine, many, set()

    def take(self, number, pages, copies):
        self.pages |= {(number, page.part, page.data) for page in pages}

    def sheets(self, pieces):
        sheet, last = [], []
        for piece in pieces:
            (sheet if piece.part != ENVELOPE else last).append(piece)
            if len(sheet) == self.many:
                yield sheet
                sheet = []
        yield from filter(None, [sheet, *([piece] for piece in last)])

    def ready(self, sheet):
        for piece in sheet:
            assert (piece.row, piece.part, f"{piece.row}{piece.part}".encode()) in self.pages

    def send(self, sheet, title):
        return self.queue.take(title, sheet)


def make(rows):
    for row in rows:
        yield PreparedRow(row.number, tuple(PreparedPage(p, Page(9, 9), f"{row.number}{p}".encode()) for p in PARTS))


def run(machines, kept, count, many=1, envelopes=()):
    place = Several([Spool(machine, many) for machine in machines], [Spool(machine) for machine in envelopes])
    with kept, place:
        return make_rows([TableRow(n, ("A",)) for n in range(2, count + 2)], make, place, BatchOptions(), kept)


def wanted(count):
    return Counter((n, part) for n in range(2, count + 2) for part in PARTS)


def made(log):
    return Counter((piece.row, piece.part) for _, piece in log)


def test_rows_are_shared_and_a_row_stays_on_one_device():
    log = []
    gate = threading.Barrier(3, timeout=10)

    class Slow(Machine):
        def take(self, title, pieces):
            if not self.count:
                gate.wait()  # every device has a sheet before any has its second
            return super().take(title, pieces)

    report = run([Slow(name, log) for name in "abc"], Journal(), 12)
    assert made(log) == wanted(12) and {name for name, _ in log} == set("abc") and report.rows == tuple(range(2, 14))
    assert len({(name, piece.row) for name, piece in log}) == 12
    assert {job.device for job in report.jobs} == set("abc")


def test_an_interrupt_is_heard_by_every_device_and_waits_for_all_of_them():
    gate, lifted = threading.Barrier(3, timeout=10), []

    class Drawing(Machine):
        def take(self, title, pieces):
            try:
                gate.wait()
                while True:
                    time.sleep(0.005)
            finally:
                time.sleep(0.1)
                lifted.append(self.name)

    def press(first):
        gate.wait()
        interrupt(first)

    threading.Thread(target=press, args=(threading.get_ident(),)).start()
    with pytest.raises(KeyboardInterrupt):
        run([Drawing(name, []) for name in "ab"], Journal(), 4)
    assert sorted(lifted) == ["a", "b"]


def test_an_interrupt_before_all_devices_have_begun_stops_those_that_have(monkeypatch):
    began, lifted, start = threading.Event(), [], threading.Thread.start

    class Drawing(Machine):
        def take(self, title, pieces):
            began.set()
            try:
                while True:
                    time.sleep(0.005)
            finally:
                lifted.append(self.name)

    def starting(thread):
        if thread.name == "b":
            assert began.wait(10)
            raise KeyboardInterrupt
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", starting)
    with pytest.raises(KeyboardInterrupt):
        run([Drawing(name, []) for name in "ab"], Journal(), 4)
    assert lifted == ["a"]


@pytest.mark.parametrize("many", [1, 3])
def test_what_a_device_refused_is_made_by_the_others(many):
    log = []
    report = run([Machine("a", log, 1), Machine("b", log), Machine("c", log, 1)], Journal(), 20, many)
    stopped = {job.row for job in report.jobs if job.device in "ac"}
    assert made(log) == wanted(20) and any("out of paper" in warning for warning in report.warnings)
    assert len({(name, piece.row) for name, piece in log}) == 20 and not stopped


def test_a_row_that_is_refused_last_is_made_by_a_device_that_had_nothing_left():
    log, taken = [], threading.Event()

    class Early(Spool):
        def take(self, number, pages, copies):
            super().take(number, pages, copies)
            taken.set()

    class Late(Spool):
        def sheets(self, pieces):
            taken.wait(10)
            return super().sheets(pieces)

    place = Several([Early(Machine("a", log, 1), 3), Late(Machine("b", log), 3)])
    with Journal() as kept, place:
        report = make_rows([TableRow(2, ("A",))], make, place, BatchOptions(), kept)
    assert made(log) == wanted(1) and {name for name, _ in log} == {"b"} and report.rows == (2,)


def test_when_all_stop_the_rest_is_named_and_gone_on_with(tmp_path):
    log = []
    what = journal.Batch(Path("table.csv"), {"a": 1})
    with pytest.raises(
        PrintingStopped, match=r"a: out of paper. .*go on with the same command and --resume"
    ) as stopped:
        run([Machine("a", log, 2), Machine("b", log, 2)], journal.begin(what, 1, tmp_path / "state"), 9)
    assert stopped.value.report.failed
    run([Machine("a", log), Machine("b", log)], journal.resume(what, tmp_path / "state"), 9)
    assert made(log) == wanted(9)


def test_envelopes_on_another_device_follow_their_letters():
    log = []
    report = run([Machine("a", log), Machine("b", log)], Journal(), 15, 2, [Machine("c", log)])
    assert made(log) == wanted(15) and report.exit_code == 0
    assert {(name, piece.part == ENVELOPE) for name, piece in log} <= {("a", False), ("b", False), ("c", True)}
    places = {(piece.row, piece.part): n for n, (_, piece) in enumerate(log)}
    assert all(places[row, PARTS[0]] < places[row, ENVELOPE] for row in range(2, 17))


def test_a_device_that_is_not_named_again_keeps_what_it_began(tmp_path):
    log = []
    what = journal.Batch(Path("table.csv"), {"a": 1})
    broken = Machine("a", log, 1, "breaks")
    with pytest.raises(PrintingStopped, match="the cable was pulled"):
        run([broken, Machine("b", log)], journal.begin(what, 1, tmp_path / "state"), 4)
    report = run([Machine("b", log), Machine("c", log)], journal.resume(what, tmp_path / "state"), 4)
    assert [row.reason for row in report.unknown if "sent as job" in row.reason] and "to a, which is not among" in (
        report.unknown[0].reason
    )
    run([broken, Machine("b", log)], journal.resume(what, tmp_path / "state"), 4)
    assert made(log) == wanted(4)


def test_what_a_device_had_begun_and_then_failed_is_said_to_be_left(tmp_path):
    log = []
    what = journal.Batch(Path("table.csv"), {"a": 1})
    broken = Machine("a", log, 2, "breaks")
    with pytest.raises(PrintingStopped):
        run([broken, Machine("b", log)], journal.begin(what, 1, tmp_path / "state"), 1)
    broken.follow = lambda job, title: Outcome("failed", "the sheet jammed")
    with pytest.raises(PrintingStopped, match="the sheet jammed") as stopped:
        run([broken, Machine("b", log)], journal.resume(what, tmp_path / "state"), 1)
    assert [row.row for row in stopped.value.report.failed] == [2]


FAILURES = st.tuples(st.integers(0, 9), st.sampled_from(["refuses", "lost", "breaks"]))


@pytest.mark.slow
@settings(max_examples=40)
@given(st.lists(FAILURES, min_size=2, max_size=4), st.integers(1, 3), st.booleans(), st.integers(1, 14))
def test_every_page_is_made_once_whatever_fails(failures, many, split, count):
    log, kept = [], Journal()
    machines = [Machine(str(n), log, *failure) for n, failure in enumerate(failures)]
    for _ in range(3):
        letters, envelopes = (machines[:-1], machines[-1:]) if split else (machines, [])
        try:
            run(letters, kept, count, many, envelopes)
            break
        except PrintingStopped:
            kept = Journal(resumed=True, steps=kept.steps, parts=kept.parts)
            for machine in machines:
                machine.fails = 0
    assert made(log) == wanted(count)
    if not split:
        assert len({(name, piece.row) for name, piece in log}) == count
