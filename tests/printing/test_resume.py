"""A batch that breaks off is gone on with: nothing twice, nothing lost."""

import json
import threading
import time
from contextlib import contextmanager

import msgspec
import pytest
from doubles import block, print_all, rows, rule
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks import damages
from handout import atomic, journal_lines
from handout.errors import InputError
from handout.page_sizes import page
from handout.printing import journal
from handout.printing.ipp.client import Client
from handout.printing.ipp.queue import IppQueue
from handout.printing.ipp.request import JobState
from handout.printing.ipp.transport import Transport, parse_address
from handout.printing.printers import CupsQueue
from handout.printing.queue import FolderQueue, Outcome, OutcomeUnknown, SimulatedQueue, Ticket
from handout.printing.sending import PrintingStopped
from handout.profiles import Printer
from handout.values import Page
from handout_lab.ipp.printer import Faults, SimulatedPrinter

DL = page("DL")
PLAIN = Printer(kind="printer", title="Test printer", dpi=72)


@pytest.fixture
def what(tmp_path):
    return batch(tmp_path, rows(6))


def batch(tmp_path, table, **options):
    hand = tmp_path / "hand.toml"
    if not hand.exists():
        hand.write_text("a hand")
    return journal.batch(tmp_path / "table.csv", table, hand, {"page_name": "DL"} | options)


def queue_of(printer, wait=None):
    wait = wait or (lambda seconds: threading.Event().wait(0.005))
    return IppQueue(Client(Transport(parse_address(printer.uri), 5.0), wait=wait), wait=wait)


def run(kept, queue, count=6, **given):
    with kept:
        return print_all(rows(count), rule, PLAIN, DL, ink=block, queue=queue, journal=kept, **given)


def printed(printer):
    return [int(job.name.split("row ")[1].split()[0]) for job in printer.printed]


def begin(what, tmp_path, **given):
    return journal.begin(what, 7, tmp_path / "state", **given)


def resume(what, tmp_path):
    return journal.resume(what, tmp_path / "state")


def entries(tmp_path):
    (path,) = (tmp_path / "state").glob("*.jsonl")
    return [json.loads(text) for text in journal_lines.read_lines(path)]


def test_every_step_is_in_the_journal(what, tmp_path):
    with SimulatedPrinter() as printer:
        report = run(begin(what, tmp_path), queue_of(printer), 2)
    first, second, *steps, last = entries(tmp_path)
    assert first == second and {step["of"] for step in steps} == {first["run"]}
    assert [step["n"] for step in steps] == [1, 1, 1, 2, 2, 2]
    assert first["seed"] == 7 and first["run"] and "table.csv" in first["table"]
    assert [(s["row"], s["state"]) for s in steps] == [
        (n, state) for n in (2, 3) for state in ("sending", "sent", "completed")
    ]
    assert last["ended"] == "done" and report.rows == (2, 3)
    assert printer.jobs[0].name == f"handout {first['run']} row 2"


def test_after_a_jam_exactly_the_rest_is_sent(what, tmp_path):
    with SimulatedPrinter(faults=Faults(jam_at=4)) as printer:
        with pytest.raises(PrintingStopped, match=r"Row 5: job 4 was not printed: .* Rows 2-4 were sent; .*--resume"):
            run(begin(what, tmp_path), queue_of(printer))
        assert printed(printer) == [2, 3, 4]
        printer.clear()
        report = run(resume(what, tmp_path), queue_of(printer))
        assert printed(printer) == [2, 3, 4, 5, 6, 7]
        assert report.before == (2, 3, 4) and report.rows == (5, 6, 7) and report.exit_code == 0
        again = run(resume(what, tmp_path), queue_of(printer))
        assert again.before == (2, 3, 4, 5, 6, 7) and again.rows == () and len(printer.jobs) == 7


def test_a_batch_that_broke_off_is_not_begun_again_by_mistake(what, tmp_path):
    with SimulatedPrinter(faults=Faults(jam_at=2)) as printer:
        with pytest.raises(PrintingStopped):
            run(begin(what, tmp_path), queue_of(printer), 2)
        with pytest.raises(InputError, match=r"table.csv was begun on .* and broke off: .*--resume.*--afresh"):
            begin(what, tmp_path)
        printer.clear()
        run(begin(what, tmp_path, afresh=True), queue_of(printer), 2)
        assert printed(printer) == [2, 2, 3]
        assert run(resume(what, tmp_path), queue_of(printer), 2).before == (2, 3)
        assert begin(what, tmp_path).steps == {}


def test_a_run_that_sends_nothing_leaves_the_journal_as_it_was(what, tmp_path):
    with SimulatedPrinter(faults=Faults(jam_at=1)) as printer, pytest.raises(PrintingStopped):
        run(begin(what, tmp_path), queue_of(printer))
    before = entries(tmp_path)

    def failing(*_):
        raise RuntimeError("the power is gone")

    with pytest.raises(RuntimeError), begin(what, tmp_path, afresh=True) as kept:
        print_all(rows(6), failing, PLAIN, DL, ink=block, queue=FolderQueue(tmp_path / "f"), journal=kept)
    assert entries(tmp_path) == before


class Dies(BaseException):
    """The program is killed: nothing of it runs any more."""


@contextmanager
def killed_at(monkeypatch, step):
    """The program ends just after that many lines of the journal, whatever it was doing; as with SIGKILL."""
    write, count = journal.Journal._write, 0

    def dying(self, entry):
        nonlocal count
        if count == step:
            raise Dies
        write(self, entry)
        count += 1

    with monkeypatch.context() as patched:
        patched.setattr(journal.Journal, "_write", dying)
        patched.setattr(journal.Journal, "__exit__", lambda self, *_: self._file.close())
        with pytest.raises(Dies):
            yield


@pytest.mark.slow
@pytest.mark.parametrize("step", range(12))
def test_after_a_crash_at_any_step_nothing_is_lost_and_nothing_twice(what, tmp_path, monkeypatch, step):
    """Four envelopes make twelve lines; the printer is still on and is asked."""
    with SimulatedPrinter() as printer:
        with killed_at(monkeypatch, step):
            run(begin(what, tmp_path), queue_of(printer), 4)
        if step == 0:  # nothing was sent, nothing is known
            with pytest.raises(InputError, match="nothing to resume"):
                resume(what, tmp_path)
            return
        report = run(resume(what, tmp_path), queue_of(printer), 4)
        assert printed(printer) == [2, 3, 4, 5] and report.unknown == () and report.exit_code == 0


def test_a_crash_between_noting_and_sending_is_left_to_the_user(what, tmp_path, monkeypatch):
    with SimulatedPrinter() as printer:
        monkeypatch.setattr(IppQueue, "send", lambda *_: (_ for _ in ()).throw(Dies()))
        with pytest.raises(Dies):
            run(begin(what, tmp_path), queue_of(printer), 3)
        monkeypatch.undo()
        report = run(resume(what, tmp_path), queue_of(printer), 3)
        # no job of that name: it was not sent, or the printer has forgotten it, and the difference is an envelope
        assert printed(printer) == [3, 4] and [one.row for one in report.unknown] == [2]
        assert "it was being sent when the batch broke off" in report.unknown[0].reason


def test_what_nobody_knows_is_left_to_the_user(what, tmp_path):
    with SimulatedPrinter() as printer:
        queue = queue_of(printer)
        follow = queue.follow
        # the cable is pulled while the second envelope is printed, and the printer is switched off and on again
        queue.follow = lambda job, title: (
            follow(job, title) if job.startswith("1@") else (_ for _ in ()).throw(OutcomeUnknown("Gone."))
        )
        with pytest.raises(PrintingStopped, match="Row 3: Gone"):
            run(begin(what, tmp_path), queue, 3)
    with SimulatedPrinter() as printer:
        report = run(resume(what, tmp_path), queue_of(printer), 3)
        assert printed(printer) == [4] and report.before == (2,) and report.exit_code == 4
        assert [one.row for one in report.unknown] == [3] and "sent as job 2, and the printer does" in report.unknown[
            0
        ].reason
        report = run(resume(what, tmp_path), queue_of(printer), 3, again="3")
        assert printed(printer) == [4, 3] and report.unknown == () and report.exit_code == 0
    with pytest.raises(InputError, match=r"--again .* --resume"):
        print_all(rows(3), rule, PLAIN, DL, ink=block, queue=FolderQueue(tmp_path / "f"), again="3")


def test_a_printer_that_is_switched_off_and_on_in_the_middle_loses_no_page_silently(what, tmp_path):
    with SimulatedPrinter(faults=Faults(restart_at=3)) as printer:
        with pytest.raises(PrintingStopped, match=r"Row 4: what became of job 3 cannot be told: the printer does not"):
            run(begin(what, tmp_path), queue_of(printer))
        assert printed(printer) == [2, 3] and printer.jobs[2].state == JobState.COMPLETED
        report = run(resume(what, tmp_path), queue_of(printer))
        assert printed(printer) == [2, 3, 5, 6, 7] and report.before == (2, 3)
        assert [one.row for one in report.unknown] == [4] and report.exit_code == 4
        assert run(resume(what, tmp_path), queue_of(printer), again="4").exit_code == 0
        assert printed(printer) == [2, 3, 5, 6, 7, 4]


def test_a_lie_is_left_to_the_user_even_when_the_jam_is_gone(what, tmp_path):
    with SimulatedPrinter(faults=Faults(lie_at=2)) as printer:
        with pytest.raises(PrintingStopped, match=r"Row 3: what became of job 2 cannot be told.*Look"):
            run(begin(what, tmp_path), queue_of(printer), 3)
        printer.clear()
        report = run(resume(what, tmp_path), queue_of(printer), 3)
        assert printed(printer) == [2, 4] and [one.row for one in report.unknown] == [3]
        assert run(resume(what, tmp_path), queue_of(printer), 3, again="3").exit_code == 0
        assert printed(printer) == [2, 4, 3]


def test_ctrl_c_cancels_the_job_in_flight(what, tmp_path):
    printing = Faults(printing=60)
    with SimulatedPrinter() as printer:

        def wait(seconds):
            if len(printer.jobs) == 2 and not printer.jobs[1].state.is_over:
                wait_calls.append(seconds)
                if len(wait_calls) == 1:
                    raise KeyboardInterrupt
            threading.Event().wait(0.005)

        wait_calls = []
        queue = queue_of(printer, wait)
        send = queue.send

        def slower(path, ticket):
            if len(printer.jobs) == 1:
                printer.faults = printing
            return send(path, ticket)

        queue.send = slower
        with pytest.raises(KeyboardInterrupt) as caught:
            run(begin(what, tmp_path), queue, 3)
        assert caught.value.__notes__ == ["Stopped at row 3. Row 2 was sent; go on with the same command and --resume."]
        assert printer.jobs[1].state.name == "CANCELED" and printed(printer) == [2]
        printer.faults = Faults()
        run(resume(what, tmp_path), queue_of(printer), 3)
        assert printed(printer) == [2, 3, 4]


@pytest.mark.slow
def test_what_the_printer_still_has_is_waited_for_and_not_sent_again(what, tmp_path):
    with SimulatedPrinter(faults=Faults(hold_at=2)) as printer:
        with pytest.raises(PrintingStopped, match="Row 3: job 2 is not printed yet: it is held"):
            run(begin(what, tmp_path), queue_of(printer), 3)
        printer.faults = Faults(printing=0.3)
        printer.jobs[1].state, printer.jobs[1].since = JobState.PROCESSING, time.monotonic()
        report = run(resume(what, tmp_path), queue_of(printer), 3)
        assert printed(printer) == [2, 3, 4] and report.rows == (3, 4) and len(printer.jobs) == 3


def test_copies_are_envelopes_of_their_own(what, tmp_path):
    with SimulatedPrinter(faults=Faults(jam_at=4)) as printer:
        with pytest.raises(PrintingStopped, match=r"Row 3: .* Row 2 was sent and 2 of 2 copies of row 3"):
            run(begin(what, tmp_path), queue_of(printer), 3, copies=2)
        printer.clear()
        run(resume(what, tmp_path), queue_of(printer), 3, copies=2)
        assert printed(printer) == [2, 2, 3, 3, 4, 4] and printer.printed[-1].name.endswith("row 4 copy 2")


@pytest.mark.parametrize("format", ["pdf", "png", "pwg", "urf"])
def test_a_folder_as_a_printer(what, tmp_path, format):
    folder = tmp_path / "out"
    report = run(begin(what, tmp_path), FolderQueue(folder, format), 2, copies=2)
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        f"row-00{row}{copy}.{format}" for row in (2, 3) for copy in ("", "-2")
    )
    assert report.exit_code == 0 and run(resume(what, tmp_path), FolderQueue(folder, format), 2, copies=2).rows == ()


def test_the_simulated_queue_goes_on_with_its_numbers(what, tmp_path):
    simulated = msgspec.structs.replace(PLAIN, simulated=True)
    with pytest.raises(PrintingStopped):
        run(begin(what, tmp_path), SimulatedQueue(tmp_path / "out", jam_at=2), 3)
    with resume(what, tmp_path) as kept:
        print_all(rows(3), rule, simulated, DL, ink=block, out=tmp_path / "out", journal=kept)
    log = [json.loads(line) for line in (tmp_path / "out" / "jobs.jsonl").read_text().splitlines()]
    assert [entry["title"].split()[-1] for entry in log] == ["2", "3", "4"]
    assert [entry["job"] for entry in log] == ["job-001", "job-002", "job-003"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"page_name": "C6"}, "--page was DL and is now C6"),
        ({"flap": "left"}, "--flap was not given and is now left"),
    ],
)
def test_other_options_are_one_sentence(what, tmp_path, change, said):
    run(begin(what, tmp_path), FolderQueue(tmp_path / "out"))
    with pytest.raises(
        InputError, match=rf"^The batch of table.csv begun on .* cannot be resumed, because {said}: .*$"
    ):
        resume(batch(tmp_path, rows(6), **change), tmp_path)


def test_another_table_or_hand_is_one_sentence(what, tmp_path):
    run(begin(what, tmp_path), FolderQueue(tmp_path / "out"))
    with pytest.raises(InputError, match="because the content of the table has changed since:"):
        resume(batch(tmp_path, rows(6, r3={"lines": ("Another",)})), tmp_path)
    (tmp_path / "hand.toml").write_text("another hand")
    with pytest.raises(InputError, match="because the content of the hand's file has changed since:"):
        resume(batch(tmp_path, rows(6)), tmp_path)
    (tmp_path / "hand.toml").write_text("a hand")
    assert len(resume(batch(tmp_path, rows(6)), tmp_path).steps) == 6


def test_two_programs_do_not_print_one_batch(what, tmp_path):
    with begin(what, tmp_path) as kept:
        kept.note(journal.Piece(2, 1), "sending", title="t")
        with pytest.raises(InputError, match="by another program at this moment"):
            resume(what, tmp_path)
    assert resume(what, tmp_path).steps.keys() == {(2, 1, "")}


def test_the_journal_is_read_when_it_is_locked(what, tmp_path, monkeypatch):
    def other_first(stream):
        """Another program has the batch just before this one, and is through with it."""
        monkeypatch.setattr(atomic, "lock", lock)
        run(others(), SimulatedQueue(tmp_path / "other"))
        lock(stream)

    lock, others = atomic.lock, lambda: begin(what, tmp_path, afresh=True)
    monkeypatch.setattr(atomic, "lock", other_first)
    with pytest.raises(PrintingStopped), SimulatedPrinter(faults=Faults(jam_at=2)) as printer:
        run(begin(what, tmp_path), queue_of(printer))
    others = lambda: resume(what, tmp_path)  # noqa: E731
    monkeypatch.setattr(atomic, "lock", other_first)
    report = run(resume(what, tmp_path), SimulatedQueue(tmp_path / "own"))
    assert report.jobs == () and report.before == (2, 3, 4, 5, 6, 7)

    def breaks_off():
        kept = begin(what, tmp_path, afresh=True)
        kept.note(journal.Piece(2, 1), "sending", title="t")
        return kept

    def dies_first(stream):
        monkeypatch.setattr(atomic, "lock", lock)
        breaks_off()._file.close()
        lock(stream)

    monkeypatch.setattr(atomic, "lock", dies_first)
    with pytest.raises(InputError, match="broke off"):
        begin(what, tmp_path)


def changed(tmp_path, line, old, new):
    """The journal with a line, from 0 or from the end, damaged."""
    (path,) = (tmp_path / "state").glob("*.jsonl")
    lines = path.read_bytes().splitlines(keepends=True)
    assert old in lines[line]
    lines[line] = lines[line].replace(old, new)
    path.write_bytes(b"".join(lines))


def broken_off(what, tmp_path, at=4):
    """Of six rows three came out, the fourth jammed; what the printer remembers."""
    queue = SimulatedQueue(tmp_path / "out", jam_at=at)
    with pytest.raises(PrintingStopped):
        run(begin(what, tmp_path), queue)


def gone_on(what, tmp_path, **given):
    report = run(resume(what, tmp_path), SimulatedQueue(tmp_path / "out", go_on=True), **given)
    log = (tmp_path / "out" / "jobs.jsonl").read_text().splitlines()
    return report, [int(json.loads(entry)["title"].split()[-1]) for entry in log]


@pytest.mark.parametrize("step", range(1, 12))
def test_where_nothing_is_damaged_nothing_is_lost(what, tmp_path, monkeypatch, step):
    queue = SimulatedQueue(tmp_path / "out")
    for _ in range(3):
        with killed_at(monkeypatch, step):
            run(
                resume(what, tmp_path) if (tmp_path / "out" / "jobs.jsonl").exists() else begin(what, tmp_path),
                queue,
                40,
            )
        with resume(what, tmp_path) as kept:
            assert kept.lost == kept.damaged == 0
            assert kept.begun >= len(kept.steps)


def test_a_flipped_row_number_leaves_no_row_out(what, tmp_path):
    broken_off(what, tmp_path)
    changed(tmp_path, 4, b'"row": 2', b'"row": 6')  # which would be done, then, and never be made
    report, rows_made = gone_on(what, tmp_path)
    assert rows_made == [2, 3, 4, 5, 6, 7] and report.unknown == () and report.exit_code == 0
    assert [warning for warning in report.warnings if "line 5 of the journal" in warning]


def test_a_flipped_key_is_no_traceback_and_a_lost_beginning_is_known_from_what_follows(what, tmp_path):
    broken_off(what, tmp_path)
    changed(tmp_path, 2, b'"copy"', b'"copz"')
    changed(tmp_path, 0, b'"begun"', b'"cegun"')
    report, rows_made = gone_on(what, tmp_path)
    # of row 2 it is known that it came out, and the printer of no line is that of another
    assert rows_made == [2, 3, 4, 5, 6, 7] and report.unknown == () and report.before == (2, 3, 4)


def test_a_row_that_may_have_been_sent_in_a_damaged_line_is_named(what, tmp_path, monkeypatch):
    queue = SimulatedQueue(tmp_path / "out")
    with killed_at(monkeypatch, 7):  # of the third row it is noted that it is being sent
        run(begin(what, tmp_path), queue)
    changed(tmp_path, -1, b"sending", b"sendjng")
    report, rows_made = gone_on(what, tmp_path)
    unknown = [row.row for row in report.unknown]
    assert unknown == [4, 5] and rows_made == [2, 3, 4, 6, 7] and report.exit_code == 4
    assert "whether it was sent is not known: its journal is damaged at line 9" in report.unknown[0].reason
    report, rows_made = gone_on(what, tmp_path, again="5")  # who has looked
    assert rows_made == [2, 3, 4, 6, 7, 5] and [row.row for row in report.unknown] == [4]


def test_where_the_beginning_is_lost_what_is_known_is_said_and_nothing_is_made(what, tmp_path):
    broken_off(what, tmp_path)
    for line in (0, 1):
        changed(tmp_path, line, b'"begun"', b'"cegun"')
    for again in (lambda: resume(what, tmp_path), lambda: begin(what, tmp_path, afresh=True)):
        with pytest.raises(
            InputError, match=r"damaged at line 1, .* rows 2-4 came out; look what became of row 5\. .*--rows"
        ):
            again()


def test_a_journal_that_an_older_program_did_not_seal_is_gone_on_with(what, tmp_path):
    broken_off(what, tmp_path)
    (path,) = (tmp_path / "state").glob("*.jsonl")
    old = [{key: entry[key] for key in entry if key not in ("of", "n")} for entry in entries(tmp_path)[1:]]
    path.write_text("".join(json.dumps(entry) + "\n" for entry in old) + '{"row": 6, "co')
    report, rows_made = gone_on(what, tmp_path)
    assert rows_made == [2, 3, 4, 5, 6, 7] and report.before == (2, 3, 4) and report.warnings == ()


@pytest.mark.parametrize("seed", range(40))
def test_no_damaged_journal_loses_or_repeats_a_row_silently(seed):
    assert damages.batch_journal(seed) in ("right", "named", "refused")
    assert damages.plot_journal(seed) in ("right", "right, told")


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.data())
def test_a_journal_that_was_cut_off_is_read_up_to_there(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("journal")
    what = batch(folder, rows(6))
    steps = data.draw(
        st.lists(
            st.tuples(st.integers(2, 5), st.sampled_from(["sending", "sent", "completed", "failed"])),
            min_size=1,
            max_size=12,
        )
    )
    kept = begin(what, folder)
    for row, state in steps:
        kept.note(journal.Piece(row, 1), state, **({"title": f"t{row}"} if state == "sending" else {}))
    kept._file.close()
    whole = kept.path.read_bytes()
    first = whole.index(b"\n", whole.index(b"\n") + 1) + 1
    cut = first + round(data.draw(st.integers(0, 1000)) / 1000 * (len(whole) - first))
    kept.path.write_bytes(whole[:cut])
    # a line whose only loss is its end is still whole
    lines = [line[9:] for line in whole[first:cut].split(b"\n") if line.endswith(b"}")]
    found = resume(what, folder)
    expected = {}
    for line in lines:
        entry = json.loads(line)
        expected[entry["row"], entry["copy"], ""] = entry["state"]
    assert {piece: step.state for piece, step in found.steps.items()} == expected
    found.note(journal.Piece(9, 1), "completed")
    found._file.close()
    assert resume(what, folder).steps[9, 1, ""].state == "completed"


@contextmanager
def print_server(print_system, **faults):
    """A server that stands for CUPS' own, where ``lpstat -H`` says it is, with the three jobs that ``lp`` gave it."""
    with SimulatedPrinter(faults=Faults(**faults), path="/printers/envelopes") as server:
        (print_system.folder / "server").write_text(server.uri.removeprefix("ipp://").split("/")[0])
        client = Client(Transport(parse_address(server.uri), 5.0))
        for number in (1, 2, 3):
            client.print(
                Ticket(f"job {number}", "", sheet=Page(110, 220), format="application/pdf"),
                client.capabilities(),
                b"%PDF",
            )
        yield server


def test_cups_is_asked_what_became_of_a_job(print_system):
    queue = CupsQueue("envelopes")
    with print_server(print_system, hold_at=3) as server:
        server.jobs[1].state = JobState.CANCELED
        threading.Event().wait(0.05)
        outcomes = [queue.outcome(f"envelopes-{n}", f"job {n}").state for n in (1, 2, 3, 4)]
        assert outcomes == ["completed", "failed", "waiting", "unknown"]
        assert queue.outcome("envelopes-1", "job 9").state == "unknown"
        assert queue.outcome("", "job 1") == Outcome("completed", job="1@1")
        assert queue.outcome("1@1", "job 1") == Outcome("completed")
        assert queue.outcome("1@7", "job 1").state == "unknown"
    assert queue.outcome("envelopes-1", "job 1") == Outcome("unknown", "the print system cannot be asked about it")


def test_jobs_that_cups_keeps_are_not_sent_again(what, tmp_path, print_system):
    print_system.fail(3, "lp: Error - The printer is on fire.\n")
    with pytest.raises(PrintingStopped, match=r"Row 4: .* on fire"):
        run(begin(what, tmp_path), CupsQueue("envelopes"), 3)
    with print_server(print_system, hold_at=2) as server:
        for piece, step in zip(server.jobs, resume(what, tmp_path).steps.values(), strict=True):
            piece.name = step.title
        report = run(resume(what, tmp_path), CupsQueue("envelopes"), 3)
    assert [job.row for job in report.jobs] == [4] and print_system.calls == 4 and report.unknown == ()
