import json

import msgspec
import pytest

from handout import page_sizes, profiles
from handout.errors import InputError, PrinterError, ProfileError
from handout.printing import printers
from handout.printing.printers import CupsQueue
from handout.printing.queue import SimulatedQueue, Ticket
from handout.profiles import Printer

PLAIN = Printer(kind="printer", title="P", dpi=300)


def options(call):
    return dict(call[i + 1].split("=", 1) for i, word in enumerate(call) if word == "-o")


@pytest.fixture
def page(tmp_path):
    path = tmp_path / "page.pdf"
    path.write_bytes(b"%PDF-1.6 not looked at")
    return path


def test_lp_is_told_the_media_the_tray_and_no_scaling(print_system, page):
    profile = msgspec.structs.replace(PLAIN, source="rear", options={"media-type": "envelope", "Ink": "Photo Black"})
    job = CupsQueue("envelopes").send(page, printers.ticket(profile, page_sizes.page("dl"), "handout row 2"))
    assert job == "envelopes-1"
    call = print_system.call(1)
    assert call[:4] == ["-d", "envelopes", "-t", "handout row 2"]
    assert call[-2:] == ["--", str(page)]
    assert options(call) == {
        "media": "iso_dl_110x220mm", "print-scaling": "none", "media-source": "rear", "media-type": "envelope",
        "Ink": "Photo Black",
    }  # fmt: skip
    assert print_system.pdf(1).read_bytes() == page.read_bytes()


def test_the_profile_has_the_last_word(print_system, page):
    profile = msgspec.structs.replace(PLAIN, options={"print-scaling": "auto"})
    CupsQueue("envelopes").send(page, printers.ticket(profile, page_sizes.page("a4"), "t"))
    assert options(print_system.call(1)) == {"media": "iso_a4_210x297mm", "print-scaling": "auto"}


def test_a_busy_queue_is_asked_again(print_system, page):
    for call in (1, 2):
        print_system.fail(call, "lp: Server is busy; try later\n")
    waited = []
    assert CupsQueue("envelopes", waited.append).send(page, Ticket("t", "m")) == "envelopes-3"
    assert waited == [1.0, 2.0]


def test_a_queue_that_stays_busy_is_given_up(print_system, page):
    for call in range(1, 9):
        print_system.fail(call, "lp: busy\n")
    waited = []
    with pytest.raises(PrinterError, match="refused the page: busy"):
        CupsQueue("envelopes", waited.append).send(page, Ticket("t", "m"))
    assert print_system.calls == 4 and sum(waited) == 7


def test_a_refusal_is_told_in_lp_s_own_words_and_not_repeated(print_system, page):
    print_system.fail(1, "lp: Error - The printer or class does not exist.\n")
    with pytest.raises(PrinterError, match="'nix' refused the page: The printer or class does not exist"):
        CupsQueue("nix").send(page, Ticket("t", "m"))
    assert print_system.calls == 1


def test_without_lp_the_way_out_is_told(tmp_path, monkeypatch, page):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert printers.queues() == []
    for attempt in (lambda: printers.open_queue(PLAIN), lambda: CupsQueue("q").send(page, Ticket("t", "m"))):
        with pytest.raises(PrinterError, match=r"lp is not installed.*--dry-run out.pdf") as caught:
            attempt()
        assert caught.value.exit_code == 3
    assert printers.resolve("epson").title == profiles.find("epson", "printer").title


def test_printers_by_name(print_system):
    epson = printers.resolve("epson")
    assert epson == profiles.find("printer-epson", "printer") and epson.queue == ""
    laser = printers.resolve("laser")
    assert laser.queue == "laser" and laser.dpi == 600 and laser.margins.left == 5
    assert printers.resolve("pdf").file and printers.resolve("printer-simulated").simulated


def test_a_queue_is_driven_by_the_profile_of_its_name(print_system):
    (print_system.folder / "queues").write_text("epson\n")
    found = printers.resolve("epson")
    assert found.queue == "epson" and found.envelope.margins.bottom == 20


def test_a_profile_in_a_file_of_the_users_own(print_system, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('kind = "printer"\ntitle = "Mine"\ndpi = 360\nqueue = "laser"\nfeed = "long"\n')
    found = printers.resolve(str(path))
    assert found.feed == "long" and printers.open_queue(found).name == "laser"


def test_an_unknown_printer_is_answered_with_the_known_ones(print_system):
    with pytest.raises(ProfileError, match=r"printer-epson.*envelopes, laser") as caught:
        printers.resolve("epsom")
    assert caught.value.exit_code == 2


def test_the_queue_of_a_profile(print_system):
    with pytest.raises(PrinterError, match=r"no default.*envelopes, laser.*--queue.*--dry-run"):
        printers.open_queue(PLAIN)
    (print_system.folder / "default").write_text("system default destination: laser\n")
    assert printers.open_queue(PLAIN).name == "laser"
    with pytest.raises(PrinterError, match=r"no print queue 'gone'.*envelopes, laser"):
        printers.open_queue(msgspec.structs.replace(PLAIN, queue="gone"))


def test_a_tray_that_the_profile_does_not_list():
    profile = msgspec.structs.replace(PLAIN, sources=("rear",), source="raer")
    with pytest.raises(ProfileError, match=r"'raer'.*rear"):
        printers.ticket(profile, page_sizes.page("dl"), "t")


def test_the_simulated_queue_keeps_jobs_and_tickets(tmp_path, page):
    queue = SimulatedQueue(tmp_path / "out" / "jobs", jam_at=3)
    assert [queue.send(page, Ticket(f"t{n}", "m", "rear", {"a": "b"})) for n in (1, 2)] == ["job-001", "job-002"]
    with pytest.raises(PrinterError, match="paper jam at job 3"):
        queue.send(page, Ticket("t3", "m"))
    folder = tmp_path / "out" / "jobs"
    assert sorted(path.name for path in folder.iterdir()) == ["job-001.pdf", "job-002.pdf", "jobs.jsonl"]
    entries = [json.loads(line) for line in (folder / "jobs.jsonl").read_text().splitlines()]
    assert entries[1] == {"job": "job-002", "title": "t2", "media": "m", "source": "rear", "options": {"a": "b"}}
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="Cannot make the folder"):
        SimulatedQueue(tmp_path / "file")
