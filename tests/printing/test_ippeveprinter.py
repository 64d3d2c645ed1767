"""The whole way to a real IPP printer: CUPS' ippeveprinter, where it is installed."""

import shutil
import subprocess
import tempfile
import threading
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from doubles import block, print_all, rule
from ippeve import Everywhere, Missing, services
from PIL import Image

from handout.inking.device_pixels import device_pixels
from handout.page_sizes import page
from handout.printing import documents, journal
from handout.printing.address_table import read_addresses
from handout.printing.ipp.client import Client, PrinterRefused
from handout.printing.ipp.queue import IppQueue
from handout.printing.ipp.transport import Transport, TransportError, parse_address
from handout.printing.media import Feeding
from handout.printing.queue import Outcome, Ticket
from handout.printing.sending import PrintingStopped
from handout.profiles import Printer
from handout.values import Page

TABLE = Path(__file__).resolve().parents[2] / "examples" / "envelope.csv"
PROFILE = Printer(kind="printer", title="Everywhere", dpi=72, source="main")
DL = page("DL")


@pytest.fixture(scope="module")
def house():
    """The services, in a folder whose path is short enough for a socket."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="eve-", ignore_cleanup_errors=True)))
        try:
            stack.enter_context(services(folder))
        except Missing as missing:
            pytest.skip(str(missing))
        yield folder


@pytest.fixture
def started(house):
    """Starts the printer, with the formats that it is to print."""
    printers = []

    def start(kinds="application/pdf,image/pwg-raster,image/urf"):
        for name in ("spool", "printed"):
            shutil.rmtree(house / name, ignore_errors=True)
        for name in ("slow", "begun"):
            (house / name).unlink(missing_ok=True)
        printers.append(Everywhere(house, kinds))
        try:
            printers[-1].start()
        except Missing as missing:
            pytest.skip(str(missing))
        return printers[-1]

    yield start
    for printer in printers:
        printer.kill()


def queue_of(printer, scheme="ipp", say=lambda message: None):
    def wait(seconds):
        threading.Event().wait(min(seconds, 0.05))

    return IppQueue(Client(Transport(parse_address(printer.uri(scheme)), 10.0), say, wait), say, wait)


def run(printer, kept=None, queue=None, **given):
    with kept or journal.Journal() as kept:
        queue = queue or queue_of(printer)
        return print_all(read_addresses(TABLE), rule, PROFILE, DL, ink=block, queue=queue, journal=kept, **given)


def test_one_that_cannot_be_started_is_switched_off_all_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name, path: None)
    printer = Everywhere(tmp_path)
    with pytest.raises(Missing, match="is not installed"):
        printer.start()
    printer.kill()


@pytest.mark.slow
def test_twelve_envelopes_arrive_as_they_were_sent(started, tmp_path):
    printer = started()
    report = run(printer)
    assert report.exit_code == 0 and len(report.jobs) == 12
    told = printer.told
    assert [one["IPP_JOB_NAME"].split()[-1] for one in told] == [str(row) for row in range(2, 14)]
    assert len({one["IPP_JOB_NAME"].split()[1] for one in told}) == 1
    sheet = "{media-size={x-dimension=11000 y-dimension=22000} media-source=main media-type=envelope}"
    assert {one["IPP_MEDIA_COL"] for one in told} == {sheet}
    assert {(one["IPP_COPIES"], one["IPP_SIDES"]) for one in told} == {("1", "one-sided")}
    assert {one["IPP_DOCUMENT_FORMAT_SUPPLIED"] for one in told} == {"application/pdf"}
    # byte for byte what a folder gets
    from handout.printing.queue import FolderQueue

    run(printer, queue=FolderQueue(tmp_path / "same"))
    assert printer.documents == [path.read_bytes() for path in sorted((tmp_path / "same").iterdir())]


def test_a_received_page_has_the_pixels_that_were_meant(started, tmp_path):
    printer = started()
    run(printer, select="2")
    (row,) = (row for row in read_addresses(TABLE) if row.number == 2)
    drawing = None

    def write(text, layout, number):
        nonlocal drawing
        drawing = rule(text, layout, number)
        return drawing

    print_all([row], write, PROFILE, DL, ink=block, out=tmp_path / "a.pdf")
    feeding = Feeding.for_page(DL, PROFILE)
    expected = documents.page_pixels(feeding.sheet, feeding.pixels(device_pixels(block(drawing, 72))))
    if shutil.which("gs") is None:
        pytest.skip("Ghostscript is not installed")
    (tmp_path / "page.pdf").write_bytes(printer.documents[0])
    command = ["gs", "-q", "-dBATCH", "-dNOPAUSE", "-sDEVICE=png16m", "-r72", f"-sOutputFile={tmp_path}/page.png"]
    subprocess.run([*command, str(tmp_path / "page.pdf")], check=True, capture_output=True)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "page.png").convert("RGB")), expected)


@pytest.mark.parametrize(("kind", "dpi"), [("pwg", 300), ("urf", 600)])
def test_raster_where_the_printer_reads_no_pdf(started, kind, dpi):
    printer = started(documents.MIME[kind])
    run(printer, select="2")
    (document,) = printer.documents
    assert document[:4] == {"pwg": b"RaS2", "urf": b"UNIR"}[kind]
    assert printer.told[0]["IPP_DOCUMENT_FORMAT_SUPPLIED"] == documents.MIME[kind]
    assert queue_of(printer).resolution(72) == dpi


def test_encrypted(started):
    printer = started()
    queue = queue_of(printer, "ipps")
    path = printer.folder / "page.pdf"
    path.write_bytes(b"%PDF-1.6" + bytes(200_000))
    ticket = Ticket("handout row 2", "", "main", {}, Page(110, 220), "envelope")
    assert queue.follow(queue.send(path, ticket), ticket.title) == Outcome("completed")
    assert printer.documents == [path.read_bytes()]


def test_a_sheet_that_it_does_not_take(started):
    with pytest.raises(PrinterRefused, match="asked for as media-col"):
        queue_of(started()).check(Ticket("t", "", "", {}, Page(50, 60)))


@pytest.mark.slow
def test_a_busy_printer_is_waited_for(started):
    printer = started()
    said = []
    queue = queue_of(printer, say=said.append)
    path = printer.folder / "page.pdf"
    path.write_bytes(b"%PDF-1.6")
    ticket = Ticket("handout row 2", "", "main", {}, Page(110, 220), "envelope")
    (printer.folder / "slow").touch()
    first = queue.send(path, ticket)
    while not (printer.folder / "begun").exists():
        threading.Event().wait(0.01)
    threading.Timer(0.3, (printer.folder / "slow").unlink).start()
    second = queue.send(path, ticket)
    assert queue.follow(second, ticket.title) == Outcome("completed") == queue.outcome(first, ticket.title)
    assert len(printer.documents) == 2
    assert said == [f"{printer.uri()} is busy; waiting for it."]


class Failing(Transport):
    """The way to the printer, which fails at one request: before it goes out, or when it has been answered."""

    def __init__(self, where, at, after, retryable):
        super().__init__(where, 10.0)
        self.posts, self.at, self.after, self.retryable = 0, at, after, retryable

    def post(self, request, document=b""):
        self.posts += 1
        data = super().post(request, document) if self.posts != self.at or self.after else b""
        if self.posts == self.at:
            raise TransportError("The printer answered with HTTP status 500.", True, retryable=self.retryable)
        return data


@pytest.mark.slow
@pytest.mark.parametrize(("after", "retryable"), [(True, False), (False, False), (False, True)])
def test_a_server_that_fails_at_any_request_prints_every_row_once(started, tmp_path, after, retryable):
    printer = started()
    hand = tmp_path / "hand.toml"
    hand.write_text("a hand")
    rows_ = read_addresses(TABLE)
    for at in range(3, 9):  # the first two are asked before there is a batch
        what = journal.batch(tmp_path / f"{at}.csv", rows_, hand, {"at": at})
        printed = len(printer.documents)
        link = Failing(parse_address(printer.uri()), at, after, retryable)
        queue = IppQueue(Client(link, wait=_short), wait=_short)
        try:
            report = run(printer, journal.begin(what, 1, tmp_path), queue, select="2-3")
        except PrintingStopped:
            report = run(printer, journal.resume(what, tmp_path), select="2-3")
        assert report.exit_code == 0 and link.posts > at
        new = [one["IPP_JOB_NAME"].split()[-1] for one in printer.told[printed:]]
        assert new == ["2", "3"], (at, new)


def _short(seconds):
    threading.Event().wait(min(seconds, 0.05))


@pytest.mark.slow
def test_killed_in_the_middle_and_gone_on_with(started, tmp_path):
    printer = started()
    hand = tmp_path / "hand.toml"
    hand.write_text("a hand")
    what = journal.batch(TABLE, read_addresses(TABLE), hand, {})
    queue = queue_of(printer)
    follow = queue.follow

    def cut(job, title):
        if job.partition("@")[0] == "6":
            printer.kill()
        return follow(job, title)

    queue.follow = cut
    send = queue.send

    def slow_at_the_sixth(path, ticket):
        if ticket.title.endswith("row 7"):
            (printer.folder / "slow").touch()
        return send(path, ticket)

    queue.send = slow_at_the_sixth
    with pytest.raises(PrintingStopped, match=r"Row 7: .* What became of job 6 cannot be told.*--resume"):
        run(printer, journal.begin(what, 1, tmp_path), queue)
    assert len(printer.documents) == 5
    (printer.folder / "slow").unlink()
    printer.start()
    report = run(printer, journal.resume(what, tmp_path))
    # it numbers its jobs anew, and so knows nothing of job 6: that one is for the user to look for
    assert [one.row for one in report.unknown] == [7] and report.before == (2, 3, 4, 5, 6)
    assert run(printer, journal.resume(what, tmp_path), again="7").exit_code == 0
    rows = [int(one["IPP_JOB_NAME"].split()[-1]) for one in printer.told]
    assert rows == [2, 3, 4, 5, 6, 8, 9, 10, 11, 12, 13, 7]
