"""The IPP client against the simulated printer and each of its faults."""

import socket
import threading
from dataclasses import replace

import pytest

from handout.errors import InputError, PrinterError, ProfileError
from handout.printing.ipp import request
from handout.printing.ipp.client import Client, PrinterRefused
from handout.printing.ipp.message import AttributeGroup, Message, MessageTag, attribute
from handout.printing.ipp.queue import IppQueue
from handout.printing.ipp.request import Capabilities, JobState, job_attributes
from handout.printing.ipp.transport import Transport, TransportError, is_address, parse_address
from handout.printing.queue import Outcome, OutcomeUnknown, Ticket
from handout.values import Page
from handout_lab.ipp.printer import Faults, SimulatedPrinter

DL = Ticket("handout abc row 2", "iso_dl_110x220mm", "rear", {}, Page(110, 220), "envelope", "row-002")
DOCUMENT = b"%PDF-1.6 " + bytes(range(256)) * 400


class Waits:
    """Waits no longer than it must, and remembers what it was asked to."""

    def __init__(self):
        self.seconds = []

    def __call__(self, seconds):
        self.seconds.append(seconds)
        threading.Event().wait(0.005)


def connected(printer, *, timeout=60.0, format="", uri=""):
    said, waits = [], Waits()
    client = Client(Transport(parse_address(uri or printer.uri), timeout), said.append, waits)
    return IppQueue(client, said.append, waits, format), said, waits


@pytest.fixture
def page(tmp_path):
    path = tmp_path / "page.pdf"
    path.write_bytes(DOCUMENT)
    return path


def told(job):
    """The attributes of a job as plain values."""

    def plain(value):
        return (
            {one.name: plain(one.values[0]) for one in value.value}
            if value.tag == MessageTag.COLLECTION
            else value.value
        )

    return {one.name: plain(one.values[0]) for one in job.attributes}


def test_a_page_arrives_byte_for_byte_with_its_sheet_and_tray(page, tmp_path):
    with SimulatedPrinter(tmp_path / "out") as printer:
        queue, said, _ = connected(printer)
        queue.check(DL)
        job = queue.send(page, DL)
        assert queue.follow(job, DL.title) == Outcome("completed") == queue.outcome(job, DL.title)
        (kept,) = printer.printed
        assert kept.document == DOCUMENT and (tmp_path / "out" / "job-001.pdf").read_bytes() == DOCUMENT
        assert kept.name == DL.title and kept.format == "application/pdf"
        assert told(kept) == {
            "media-col": {
                "media-size": {"x-dimension": 11000, "y-dimension": 22000},
                "media-source": "rear",
                "media-type": "envelope",
            },
            "print-scaling": "none",
            "copies": 1,
            "sides": "one-sided",
        }
        assert said == []


def test_custom_sizes_are_in_hundredths_of_a_millimetre(page):
    ticket = Ticket("t", "", "", {}, Page(104.775, 241.3))
    with SimulatedPrinter() as printer:
        queue, _, _ = connected(printer)
        queue.send(page, ticket)
        # 104.775 mm is between two hundredths: the even one is taken
        assert told(printer.jobs[0])["media-col"] == {"media-size": {"x-dimension": 10478, "y-dimension": 24130}}


def test_options_of_a_profile_have_the_type_that_the_printer_gives_them(page):
    options = {"print-quality": "5", "print-scaling": "auto", "media-type": "stationery"}
    with SimulatedPrinter() as printer:
        queue, _, _ = connected(printer)
        queue.send(page, Ticket("t", "", "", options, Page(110, 220), "envelope"))
        found = told(printer.jobs[0])
        assert (found["print-quality"], found["print-scaling"]) == (5, "auto")
        assert found["media-col"]["media-type"] == "stationery"
        for option, said in (({"ink": "x"}, "no option 'ink'"), ({"print-quality": "best"}, "whole number")):
            with pytest.raises(ProfileError, match=said):
                queue.check(Ticket("t", "", "", option, Page(110, 220)))
        with pytest.raises(ProfileError, match=r"'fit' is not among the values.*auto, none"):
            queue.check(Ticket("t", "", "", {"print-scaling": "fit"}, Page(110, 220)))
        with pytest.raises(ProfileError, match="no tray 'top'; trays that it lists: auto, rear, main"):
            queue.check(Ticket("t", "", "top", {}, Page(110, 220)))


def test_an_old_printer_is_told_the_name_of_the_sheet():
    sheets = attribute("media-supported", MessageTag.KEYWORD, "iso_dl_110x220mm")
    old = Capabilities(Message(0, (AttributeGroup(MessageTag.PRINTER, (sheets,)),)))
    request = Ticket("t", "iso_dl_110x220mm", sheet=Page(110, 220), format="application/pdf")
    assert job_attributes(request, old) == (attribute("media", MessageTag.KEYWORD, "iso_dl_110x220mm"),)
    with pytest.raises(ProfileError, match="nobody choose a tray"):
        job_attributes(replace(request, source="rear"), old)


def test_a_printer_of_version_1_1_is_spoken_to_in_it(page):
    with SimulatedPrinter(faults=Faults(old=True)) as printer:
        queue, _, _ = connected(printer)
        assert queue.follow(queue.send(page, DL), DL.title) == Outcome("completed")


def test_a_busy_printer_is_asked_again_ever_less_often(page):
    with SimulatedPrinter(faults=Faults(busy=7)) as printer:
        queue, said, waits = connected(printer)
        queue.send(page, DL)
        assert waits.seconds == [0.5, 1.0, 2.0, 4.0, 8.0, 10.0, 10.0]
        assert len(printer.jobs) == 1 and said == [f"{printer.uri} is busy; waiting for it."]


@pytest.mark.slow
def test_a_printer_that_stays_busy_is_given_up(page):
    with SimulatedPrinter(faults=Faults(busy=10**6)) as printer:
        queue, _, waits = connected(printer)
        with pytest.raises(PrinterError, match="refused: it is busy"):
            queue.send(page, DL)
        assert 600 <= sum(waits.seconds) <= 620 and printer.jobs == []


def test_an_empty_tray_is_told_and_waited_for(page):
    with SimulatedPrinter(faults=Faults(empty_at=1)) as printer:
        queue, said, _ = connected(printer)
        job = queue.send(page, DL)

        def fill():
            while not said:
                threading.Event().wait(0.005)
            printer.clear()

        threading.Thread(target=fill, daemon=True).start()
        assert queue.follow(job, DL.title) == Outcome("completed")
        assert said == ["Job 1 waits: the tray is empty."]
        assert [kept.document for kept in printer.printed] == [DOCUMENT]


def test_a_job_that_the_printer_gives_up_has_failed(page):
    with SimulatedPrinter(faults=Faults(jam_at=1)) as printer:
        queue, _, _ = connected(printer)
        job = queue.send(page, DL)
        assert queue.follow(job, DL.title) == Outcome("failed", "the printer gave it up, the paper has jammed")
        assert printer.printed == []


def test_a_job_that_is_held_is_left_to_the_user(page):
    with SimulatedPrinter(faults=Faults(hold_at=1)) as printer:
        queue, _, _ = connected(printer)
        job = queue.send(page, DL)
        assert queue.follow(job, DL.title) == Outcome(
            "waiting", "it is held at the printer: it is held until a given time"
        )


def test_a_printer_that_lies_is_not_believed(page):
    with SimulatedPrinter(faults=Faults(lie_at=1)) as printer:
        queue, _, _ = connected(printer)
        outcome = queue.follow(queue.send(page, DL), DL.title)
        assert outcome.state == "unknown" and "jammed" in outcome.why and printer.printed == []


def test_a_sheet_that_the_printer_does_not_take_is_refused_before_any_work(page):
    with SimulatedPrinter(faults=Faults(no_envelopes=True)) as printer:
        queue, _, _ = connected(printer)
        sheets = r"as media-col.*\. The sheet is 110 x 220 mm; the nearest that it lists: 148 x 210, 210 x 297 mm\."
        with pytest.raises(PrinterRefused, match=sheets):
            queue.check(DL)
        with pytest.raises(PrinterRefused):
            queue.send(page, DL)
        assert printer.jobs == []


@pytest.mark.parametrize("fault", ["lost_at", "torn_at"])
def test_a_page_that_is_lost_on_the_way_is_sent_again(page, fault):
    page.write_bytes(DOCUMENT * 40)
    with SimulatedPrinter(faults=Faults(**{fault: 1})) as printer:
        queue, said, _ = connected(printer)
        job = queue.send(page, DL)
        assert queue.follow(job, DL.title) == Outcome("completed")
        assert [kept.document for kept in printer.printed] == [DOCUMENT * 40]
        assert len(said) == 1 and "sending it again" in said[0]


def test_a_page_whose_answer_is_lost_is_not_sent_twice(page):
    with SimulatedPrinter(faults=Faults(unanswered_at=1)) as printer:
        queue, said, _ = connected(printer)
        job = queue.send(page, DL)
        assert job.startswith("1@") and queue.follow(job, DL.title) == Outcome("completed")
        assert len(printer.printed) == 1 and said == []


def test_a_printer_that_is_gone_after_taking_a_page_is_unknown(page):
    printer = SimulatedPrinter(faults=Faults(unanswered_at=1))
    with printer:
        queue, _, _ = connected(printer)
        answer = printer.answer
        printer.answer = lambda request, document: answer(request, document) if not printer.jobs else None
        with pytest.raises(OutcomeUnknown, match="Whether the page arrived cannot be told"):
            queue.send(page, DL)
    with pytest.raises(PrinterError, match="takes no connections") as caught:
        queue.send(page, DL)
    assert not isinstance(caught.value, OutcomeUnknown)


@pytest.mark.slow
def test_a_slow_printer_is_waited_for_and_a_silent_one_is_not(page):
    with SimulatedPrinter(faults=Faults(slow=0.3)) as printer:
        queue, _, _ = connected(printer)
        assert queue.follow(queue.send(page, DL), DL.title) == Outcome("completed")
        printer.faults = Faults(slow=600)  # however long this test itself is kept waiting
        with pytest.raises(TransportError, match=r"has not answered for 0\.1 s"):
            connected(printer, timeout=0.1)


def test_a_silent_printer_while_a_job_is_followed(page):
    with SimulatedPrinter(faults=Faults(hold_at=9, printing=60)) as printer:
        queue, said, waits = connected(printer)
        job = queue.send(page, DL)
    with pytest.raises(OutcomeUnknown, match="What became of job 1 cannot be told"):
        queue.follow(job, DL.title)
    assert sum(waits.seconds) >= 60 and len(said) == 1 and "Asking again" in said[0]


def test_a_cancelled_job_does_not_come_out(page):
    with SimulatedPrinter(faults=Faults(printing=60)) as printer:
        queue, _, _ = connected(printer)
        job = queue.send(page, DL)
        assert queue.cancel("", DL.title) == Outcome("failed", "it was cancelled by the user")
        assert printer.jobs[0].state == JobState.CANCELED and printer.printed == []
        assert queue.outcome(job, DL.title).state == "failed"


def test_a_page_that_has_not_arrived_is_cancelled_by_that(page):
    with SimulatedPrinter() as printer:
        assert connected(printer)[0].cancel("", DL.title) == Outcome("failed", "it did not arrive")


def test_a_job_that_is_out_cannot_be_cancelled(page):
    with SimulatedPrinter() as printer:
        queue, _, _ = connected(printer)
        job = queue.send(page, DL)
        queue.follow(job, DL.title)
        assert queue.cancel(job, DL.title) == Outcome("completed")


def test_what_the_printer_has_forgotten_is_unknown(page):
    with SimulatedPrinter(faults=Faults(forgetful=True)) as printer:
        queue, _, _ = connected(printer)
        assert queue.follow(queue.send(page, DL), DL.title).state == "unknown"
        assert queue.outcome("", "handout abc row 3").state == "unknown"


def test_a_number_that_now_belongs_to_another_job_is_unknown(page):
    with SimulatedPrinter() as printer:
        queue, _, _ = connected(printer)
        job = queue.send(page, DL)
        queue.follow(job, DL.title)
        assert queue.outcome(job, "handout old row 9").state == "unknown"


def test_a_page_that_a_restart_took_is_not_done_because_a_strangers_job_of_its_number_is(page):
    with SimulatedPrinter(faults=Faults(restart_at=1)) as printer:
        queue, _, _ = connected(printer)
        job = queue.send(page, DL)
        assert queue.follow(job, DL.title).state == "unknown" and printer.printed == []
        assert printer.jobs[0].name == "Invoice 1" and printer.jobs[0].state == JobState.COMPLETED
        assert queue.outcome(job, DL.title).state == "unknown"


@pytest.mark.parametrize("simple", [False, True])
def test_a_job_is_its_number_its_name_and_when_it_was_made(page, simple):
    now = [100.0]
    with SimulatedPrinter(faults=Faults(simple=simple, printing=0), clock=lambda: now[0]) as printer:
        queue, _, _ = connected(printer)
        now[0] += 50
        job = queue.send(page, DL)
        assert job == "1@51" and queue.follow(job, DL.title) == Outcome("completed")
        printer.jobs[0].name = ""  # a printer may keep names to itself: the time still tells
        assert queue.outcome(job, DL.title) == queue.follow(job, DL.title) == Outcome("completed")
        assert queue.outcome("1@52", DL.title).state == queue.follow("1@52", DL.title).state == "unknown"
        printer.jobs[0].created = 0  # and times, which it may set to this when it is switched on
        assert queue.outcome(job, DL.title).state == "unknown"
        printer.jobs[0].name = DL.title
        assert queue.outcome(job, DL.title) == Outcome("completed")


def test_ctrl_c_does_not_cancel_a_strangers_job(page):
    with SimulatedPrinter(faults=Faults(printing=60)) as printer:
        queue, _, _ = connected(printer)
        job = queue.send(page, DL)
        printer.restart(3, JobState.HELD)
        assert queue.cancel(job, DL.title).state == "unknown"
        assert [job.state for job in printer.jobs] == [JobState.HELD] * 3


def test_a_page_that_breaks_off_at_a_restart_is_not_taken_for_a_strangers(page):
    with SimulatedPrinter(faults=Faults(unanswered_at=1)) as printer:
        queue, _, _ = connected(printer)
        accept = printer._accept
        printer._accept = lambda *given: (accept(*given), printer.restart(1))[0]
        with pytest.raises(OutcomeUnknown):
            queue.send(page, DL)


@pytest.mark.parametrize(
    ("formats", "asked", "chosen", "dpi"),
    [
        (("application/pdf", "image/pwg-raster"), "", "pdf", 720),
        (("image/urf", "image/pwg-raster"), "", "pwg", 600),
        (("image/urf", "image/jpeg"), "", "urf", 600),
        (("application/pdf", "image/pwg-raster"), "pwg", "pwg", 600),
    ],
)
def test_the_best_format_that_the_printer_takes(formats, asked, chosen, dpi):
    with SimulatedPrinter(faults=Faults(formats=formats)) as printer:
        queue, _, _ = connected(printer, format=asked)
        assert (queue.format, queue.resolution(720)) == (chosen, dpi)
        assert queue.resolution(200) == (200 if chosen == "pdf" else 300)


def test_formats_that_cannot_be():
    with SimulatedPrinter(faults=Faults(formats=("image/jpeg",))) as printer:
        with pytest.raises(PrinterError, match="neither PDF nor PWG Raster nor URF, only image/jpeg"):
            connected(printer)
        with pytest.raises(InputError, match="prints no urf"):
            connected(printer, format="urf")
        with pytest.raises(PrinterError, match="has no printer at /wrong"):
            connected(printer, uri=printer.uri.replace("/ipp/print", "/wrong"))


def test_what_is_no_ipp_is_a_plain_error():
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer():
            connection, _ = server.accept()
            connection.recv(65536)
            connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhello")
            connection.close()

        threading.Thread(target=answer, daemon=True).start()
        uri = f"ipp://127.0.0.1:{server.getsockname()[1]}/ipp/print"
        with pytest.raises(PrinterError, match="ends in the middle"):
            Client(Transport(parse_address(uri), 60.0)).capabilities()


def test_copies_are_told(page):
    with SimulatedPrinter() as printer:
        client = Client(Transport(parse_address(printer.uri)))
        client.print(
            Ticket("t", "", sheet=Page(110, 220), format="application/pdf", copies=3), client.capabilities(), DOCUMENT
        )
        assert told(printer.jobs[0])["copies"] == 3


@pytest.mark.parametrize(
    ("text", "uri"),
    [
        ("ipp://host", "ipp://host:631/ipp/print"),
        ("ipps://printer.local:8631/ipp/print/2", "ipps://printer.local:8631/ipp/print/2"),
        ("ipp://[fe80::1]/", "ipp://[fe80::1]:631/ipp/print"),
    ],
)
def test_addresses(text, uri):
    assert parse_address(text).uri == uri and is_address(text)


@pytest.mark.parametrize(
    "text", ["ipp://", "ipp://host:99999/", "http://host/", "ipp://me:secret@host/", "ipp://a b/", "ipp://h/x?y"]
)
def test_what_is_no_address(text):
    with pytest.raises(InputError, match="address"):
        parse_address(text)


def test_reasons_in_words():
    assert request.reason_phrase(["none"]) == "" == request.reason_phrase([])
    assert request.reason_phrase(["media-empty-error", "media-needed", "marker-supply-low-warning"]) == (
        "the tray is empty, it wants paper or envelopes put in, an ink is low"
    )
    assert request.reason_phrase(["document-format-error", "com.maker-odd-thing-report"]) == (
        "the printer found an error in the document, com.maker odd thing"
    )
    assert request.blocks_output(["media-jam-error"]) and not request.blocks_output(
        ["marker-supply-low", "media-empty-warning"]
    )
    assert request.is_jammed(["media-jam"]) and not request.is_jammed(["media-empty-error"])
    assert request.phrase(0x0507) == "it is busy" and request.phrase(0x0999) == "it answered with status 0x0999"
