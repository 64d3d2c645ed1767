"""Each row is printed exactly once, whatever fails at whichever request of a batch."""

import itertools

import pytest
from doubles import block, print_all, rows, rule

from handout.errors import PrinterError
from handout.page_sizes import page
from handout.printing import journal
from handout.printing.ipp.client import Backoff, Client, Operation
from handout.printing.ipp.message import decode, encode
from handout.printing.ipp.queue import IppQueue
from handout.printing.ipp.transport import Transport, TransportError, parse_address
from handout.printing.printers import CupsQueue
from handout.printing.queue import Outcome, OutcomeUnknown, Ticket
from handout.printing.sending import PrintingStopped
from handout.profiles import Printer
from handout.values import Page
from handout_lab.ipp.printer import FAILURES, Faults, SimulatedPrinter
from handout_lab.ipp.server import Broken

SMALL = page("DL")
PLAIN = Printer(kind="printer", title="Test printer", dpi=20)
ROWS = [2, 3, 4, 5]
PAGE = Ticket("handout a1b2c3 row 2", "", "", {}, Page(110, 220))


class Clock:
    """Time goes on only when somebody waits."""

    def __init__(self):
        self.now, self.waits = 0.0, []

    def __call__(self):
        return self.now

    def wait(self, seconds):
        self.now += seconds
        self.waits.append(seconds)


class Wire(Transport):
    """A link to a simulated printer without a network in between; `silent_at` is a request that is not answered.

    What silence means is that the printer did what was asked, and that nothing came back in time.
    """

    def __init__(self, printer, silent_at=0):
        super().__init__(parse_address("ipp://printer.local"))
        self.printer, self.silent_at, self.posts = printer, silent_at, 0

    def post(self, request, document=b""):
        self.posts += 1
        asked, _ = decode(request)
        answer = self.printer.answer(asked, document)
        if self.posts == self.silent_at:
            raise TransportError("The printer has not answered for 30 s.", handed_over=True)
        if answer is None:
            raise TransportError("The printer broke the connection.", handed_over=True)
        if not isinstance(answer, Broken):
            return encode(answer)
        if answer.status == 200:
            return answer.body
        after = answer.headers.get("Retry-After")
        raise TransportError(
            f"The printer answered with HTTP status {answer.status}.",
            handed_over=True,
            retryable=answer.status == 503,
            after=float(after) if after else None,
        )


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch):
    """What is kept when the power fails is not what is tested here."""
    monkeypatch.setattr("os.fsync", lambda number: None)


@pytest.fixture
def hand(tmp_path):
    path = tmp_path / "hand.toml"
    path.write_text("a hand")
    return path


def simulated(**faults):
    clock = Clock()
    return SimulatedPrinter(faults=Faults(**{"printing": 0.6, **faults}), clock=clock), clock


def queue_of(printer, clock, silent_at=0, said=None):
    say = said.append if said is not None else lambda message: None
    return IppQueue(Client(Wire(printer, silent_at), say, clock.wait), say, clock.wait)


def whole_batch(tmp_path, hand, printer, clock, silent_at=0):
    """Print four rows, going on until nothing is left; the last report, and what was said on the way."""
    what, table = journal.batch(tmp_path / "table.csv", rows(4), hand, {}), rows(4)
    said: list[str] = []

    def run(kept):
        nonlocal silent_at
        with kept:
            now, silent_at = silent_at, 0
            queue = queue_of(printer, clock, now, said)
            return print_all(table, rule, PLAIN, SMALL, ink=block, queue=queue, journal=kept, select="")

    kept = journal.begin(what, 1, tmp_path / "state", afresh=True)
    for _ in range(3):
        try:
            return run(kept), said
        except PrinterError as stopped:
            said.append(str(stopped))
            if not isinstance(stopped, PrintingStopped):  # before anything was sent, and so without a journal
                kept = journal.begin(what, 1, tmp_path / "state", afresh=True)
                continue
        silent_at = 0
        kept = journal.resume(what, tmp_path / "state")
    raise AssertionError(said)


def printed(printer):
    return sorted(int(job.name.split("row ")[1]) for job in printer.printed)


def requests_of_a_batch(tmp_path, hand, **faults):
    printer, clock = simulated(**faults)
    whole_batch(tmp_path, hand, printer, clock)
    assert printed(printer) == ROWS
    return printer.requests


@pytest.mark.slow
@pytest.mark.parametrize("simple", [False, True])
@pytest.mark.parametrize("failure", [failure for failure in FAILURES if failure not in ("error", "text")])
def test_any_failure_at_any_request(tmp_path, hand, failure, simple):
    """Four rows, every request of them fails once; a printer that has shown no memory leaves one row to the user."""
    count = requests_of_a_batch(tmp_path, hand, simple=simple)
    assert count >= 16
    for at in range(1, count + 1):
        printer, clock = simulated(simple=simple, fail_at=at, fail_as=failure)
        report, said = whole_batch(tmp_path, hand, printer, clock)
        left = [one.row for one in report.unknown]
        assert sorted([*printed(printer), *left]) == ROWS, (at, said)
        # only where nothing but its memory could tell: a page given at once, before anything of ours was printed
        assert left in ([], [2]) and (not left or simple), (at, said)


@pytest.mark.slow
@pytest.mark.parametrize("simple", [False, True])
def test_silence_after_any_request(tmp_path, hand, simple):
    for at in range(1, requests_of_a_batch(tmp_path, hand, simple=simple) + 1):
        printer, clock = simulated(simple=simple)
        report, said = whole_batch(tmp_path, hand, printer, clock, silent_at=at)
        assert printed(printer) == ROWS and report.unknown == (), (at, said)


@pytest.mark.parametrize(
    ("simple", "failure"), list(itertools.product([False, True], ["done-500", "500", "done-drop"]))
)
def test_a_printer_that_forgets_is_never_believed_to_have_printed_nothing(tmp_path, hand, simple, failure):
    for at in range(1, 18):
        printer, clock = simulated(simple=simple, fail_at=at, fail_as=failure, forgetful=True, printing=0.0)
        what = journal.batch(tmp_path / "table.csv", rows(4), hand, {})
        try:
            with journal.begin(what, 1, tmp_path / "state", afresh=True) as kept:
                queue = queue_of(printer, clock)
                print_all(rows(4), rule, PLAIN, SMALL, ink=block, queue=queue, journal=kept)
        except PrinterError:
            pass
        numbers = printed(printer)
        assert len(numbers) == len(set(numbers)), at


@pytest.mark.slow
@pytest.mark.parametrize("simple", [False, True])
@pytest.mark.parametrize(("retry_after", "waits"), [(-1, {0.5, 1.0}), (7, {7.0})])
def test_a_passing_503_is_waited_for_as_long_as_it_asks(tmp_path, hand, retry_after, waits, simple):
    for at in range(1, 18):
        printer, clock = simulated(simple=simple, fail_at=at, fail_for=3, fail_as="503", retry_after=retry_after)
        report, said = whole_batch(tmp_path, hand, printer, clock)
        assert printed(printer) == ROWS and report.exit_code == 0
        assert not any("sent" in sentence for sentence in said), said
        assert waits <= set(clock.waits) and any("503. Waiting" in sentence for sentence in said)


def failing(printer, code, first=True):
    """The request at which this operation comes for the first time in a batch of one row."""
    seen, done = [], printer._carry_out

    def noting(request, document):
        seen.append(request.code)
        return done(request, document)

    printer._carry_out = noting
    return seen


def one_row(tmp_path, hand, printer, clock):
    what = journal.batch(tmp_path / "one.csv", rows(1), hand, {})
    with journal.begin(what, 1, tmp_path / "state", afresh=True) as kept:
        return print_all(rows(1), rule, PLAIN, SMALL, ink=block, queue=queue_of(printer, clock), journal=kept)


@pytest.mark.parametrize("failure", ["503", "500", "error"])
def test_a_printer_that_fails_for_good_after_taking_a_page_is_not_said_to_have_nothing(tmp_path, hand, failure):
    printer, clock = simulated()
    seen = failing(printer, Operation.GET_JOB_ATTRIBUTES)
    one_row(tmp_path, hand, printer, clock)
    at = seen.index(Operation.GET_JOB_ATTRIBUTES, seen.index(Operation.SEND_DOCUMENT)) + 1
    printer, clock = simulated(fail_at=at, fail_for=10**6, fail_as=failure)
    with pytest.raises(PrintingStopped, match=r"Row 2 was sent as job 1; go on with .*--resume") as caught:
        one_row(tmp_path, hand, printer, clock)
    assert "Nothing was sent" not in str(caught.value) and "cannot be told" in str(caught.value)
    assert caught.value.report.failed[0].reason != "not sent"
    assert sum(clock.waits) < 700


def test_a_server_that_is_never_there_again_is_given_up_within_the_bound(tmp_path, hand):
    printer, clock = simulated(fail_at=3, fail_for=10**6, fail_as="503")
    with pytest.raises(PrinterError, match="HTTP status 503"):
        one_row(tmp_path, hand, printer, clock)
    assert 500 < sum(clock.waits) < 1300
    printer, clock = simulated(fail_at=1, fail_for=10**6, fail_as="503", retry_after=86400)
    with pytest.raises(PrinterError, match="HTTP status 503"):
        one_row(tmp_path, hand, printer, clock)
    assert clock.waits == []


def test_the_pauses_and_their_bound():
    waits, said = [], []
    backoff = Backoff(waits.append, said.append)
    assert backoff.pause("Busy.", 0.0) and backoff.pause("Busy.") and backoff.pause("Busy.", 590.0)
    assert not backoff.pause("Busy.", 20.0) and backoff.pause("Busy.") and backoff.pause("Busy.", 1.0) is True
    assert waits[:3] == [0.5, 0.5, 590.0] and said == ["Busy."]


def test_over_the_network_a_500_after_the_page_was_taken(tmp_path):
    path = tmp_path / "page.pdf"
    path.write_bytes(b"%PDF-1.6" + bytes(5000))
    for simple in (True, False):
        with SimulatedPrinter(faults=Faults(fail_at=2 if simple else 3, fail_as="done-500", simple=simple)) as printer:
            queue = IppQueue(
                Client(Transport(parse_address(printer.uri)), wait=lambda seconds: None), wait=lambda seconds: None
            )
            job = queue.send(path, PAGE)
            while not printer.printed:
                queue.follow(job, PAGE.title)
            assert queue.follow(job, PAGE.title) == Outcome("completed") and len(printer.printed) == 1
            assert [kept.document for kept in printer.jobs] == [path.read_bytes()]


@pytest.mark.parametrize(("told", "after"), [("3", 3.0), ("Fri, 31 Dec 2027 23:59:59 GMT", None), ("soon", None)])
def test_retry_after_is_read_from_the_answer(told, after):
    with SimulatedPrinter() as printer:
        printer.answer = lambda request, document: Broken(503, {"Retry-After": told})
        with pytest.raises(TransportError) as caught:
            Transport(parse_address(printer.uri)).post(encode_any())
        assert caught.value.retryable and caught.value.handed_over
        if after is not None:
            assert caught.value.after == after
        else:  # a date is set against the printer's own clock, which the answer tells
            assert (caught.value.after is None) == (told == "soon")


def encode_any():
    from handout.printing.ipp.message import Message

    return encode(Message(Operation.GET_PRINTER_ATTRIBUTES))


def test_a_refusal_of_the_server_itself_is_final():
    with SimulatedPrinter() as printer:
        printer.answer = lambda request, document: Broken(413)
        with pytest.raises(PrinterError, match="413") as caught:
            Transport(parse_address(printer.uri)).post(encode_any())
        assert not isinstance(caught.value, TransportError)


def test_what_was_begun_when_the_program_died_is_stopped_at_the_printer(tmp_path, hand):
    printer, clock = simulated()
    queue = queue_of(printer, clock)
    client = queue._client
    client.create(queue._request(PAGE), client.capabilities())
    assert queue.outcome("", PAGE.title).state == "failed"
    assert [job.state.name for job in printer.jobs] == ["CANCELED"]


def test_an_older_job_that_is_still_listed_proves_that_a_newer_one_never_came(tmp_path):
    path = tmp_path / "page.pdf"
    path.write_bytes(b"%PDF")
    printer, clock = simulated()
    queue = queue_of(printer, clock)
    queue.follow(queue.send(path, PAGE), PAGE.title)
    assert queue.outcome("", "handout a1b2c3 row 3", {PAGE.title}) == Outcome("failed", "it did not arrive")
    assert queue.outcome("", "handout a1b2c3 row 3", {"handout ffffff row 2"}).state == "unknown"


def test_lp_that_does_not_end_may_have_queued_the_page(print_system, tmp_path, monkeypatch):
    import subprocess

    from handout.printing import printers

    def never(command, **given):
        raise subprocess.TimeoutExpired(command, 60)

    monkeypatch.setattr(printers.subprocess, "run", never)
    with pytest.raises(OutcomeUnknown, match="Whether the page was queued cannot be told"):
        CupsQueue("envelopes").send(tmp_path / "a.pdf", PAGE)
