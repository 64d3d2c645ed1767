"""`handout print` to a printer: where pages go, how they are fed, and how a batch is gone on with."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pikepdf
import pytest

from handout_lab.ipp.printer import Faults, SimulatedPrinter

ROOT = Path(__file__).resolve().parents[2]
PEOPLE = "name,street,city\nAnna,Weg 1,Ulm\nBen,Weg 2,Ulm\nCleo,Weg 3,Ulm\nDan,Weg 4,Ulm\n"
QUICK = ("--pen", "plain", "--hand", "house-print", "--variation", "0")


@pytest.fixture(autouse=True)
def table():
    path = Path("people.csv")
    path.write_text(PEOPLE, encoding="utf-8")
    return path


@pytest.fixture
def heard():
    """Ctrl-C reaches programs that are started: behind a shell's & it is shut out for all that are started below."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def about(path):
    with pikepdf.open(path) as document:
        return json.loads(str(document.docinfo["/Subject"]))


def placed(path):
    """The sheet as it is fed, mm, and where the ink lies on it: left, lower, right, upper edge."""
    with pikepdf.open(path) as document:
        (sheet,) = document.pages
        width, _, _, height, x, y = (float(v) for v in pikepdf.parse_content_stream(sheet)[1].operands)
        box = [float(v) * 25.4 / 72 for v in sheet.mediabox][2:]
    return box, [v * 25.4 / 72 for v in (x, y, x + width, y + height)]


@pytest.mark.slow
def test_a_jam_and_then_the_rest(call, table):
    with SimulatedPrinter(Path("out"), Faults(jam_at=2)) as printer:
        command = ("print", table, "--printer", "epson", "--queue", printer.uri, *QUICK)
        _, err = call(*command, code=3)
        assert "Row 3: job 2 was not printed: the printer gave it up, the paper has jammed." in err
        assert "Row 2 was sent; go on with the same command and --resume." in err
        assert "\nrows 4-5: not sent\n" in err
        _, err = call(*command, code=2)
        assert "--resume" in err and "--afresh" in err and len(printer.jobs) == 2
        _, err = call(*command, "--page", "C6", "--resume", code=2)
        assert "--page-name" not in err and "--page was DL and is now C6" in err
        printer.clear()  # somebody takes out what has jammed
        out, err = call(*command, "--resume", "--json")
        facts = json.loads(out)
        assert (facts["rows"], facts["before"], facts["unknown"]) == (3, [2], [])
        assert [job.name.split()[-1] for job in printer.printed] == ["2", "3", "4", "5"]
        # a batch has one seed, whoever goes on with it
        assert len({about(path)["seed"] for path in Path("out").glob("*.pdf")}) == 1


@pytest.mark.slow
def test_an_envelope_that_nobody_knows_of(call, table):
    with SimulatedPrinter(faults=Faults(lie_at=1)) as printer:
        command = ("print", table, "--printer", printer.uri, "--rows", "2-3", *QUICK)
        call(*command, code=3)
        printer.clear()
        _, err = call(*command, "--resume", code=4)
        assert re.search(r"row 2: it was sent as job 1, and .* --resume --again 2 makes it again", err)
        call(*command, "--resume", "--again", "2", "-q")
        assert [job.name.split()[-1] for job in printer.printed] == ["3", "2"]


@pytest.mark.slow
def test_ctrl_c_cancels_what_is_in_flight(table, heard):
    with SimulatedPrinter(faults=Faults(printing=60)) as printer:
        tell, followed = printer._report_job, threading.Event()
        printer._report_job = lambda request: followed.set() or tell(request)
        command = [sys.executable, "-m", "handout", "print", str(table), "--queue", printer.uri, "--printer", "epson"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        running = subprocess.Popen([*command, *QUICK], stderr=subprocess.PIPE, text=True, env=environment)
        try:
            while not followed.wait(0.02) and running.poll() is None:
                pass
            running.send_signal(signal.SIGINT)
            _, err = running.communicate(timeout=30)
        finally:
            running.kill()
        assert running.returncode == 130, err
        assert "Interrupted. Stopped at row 2. Nothing was sent; go on with the same command and --resume." in err
        assert [job.state.name for job in printer.jobs] == ["CANCELED"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "sheet", "corner"),
    [
        # the address stands in the right half of the envelope, below its middle; the flap is the upper edge
        ((), (110, 220), "upper right"),
        (("--flap", "right"), (110, 220), "lower left"),
        (("--feed", "long"), (220, 110), "lower right"),
        (("--feed", "long", "--flap", "trailing"), (220, 110), "upper left"),
    ],
)
def test_feed_and_flap(call, table, asked, sheet, corner):
    call("print", table, "--rows", 2, "--printer", "epson", "--queue", "file:out", *QUICK, *asked)
    box, (left, lower, right, upper) = placed("out/row-002.pdf")
    assert box == pytest.approx(sheet, abs=0.01)
    across, along = (left + right) / 2, (lower + upper) / 2
    assert corner == f"{'upper' if along > sheet[1] / 2 else 'lower'} {'right' if across > sheet[0] / 2 else 'left'}"


@pytest.mark.slow
def test_nudge(call, table):
    for folder, nudge in (("still", "0,0"), ("moved", "2mm,-1.5mm")):
        call(
            "print",
            table,
            "--rows",
            2,
            "--queue",
            f"file:{folder}",
            "--nudge",
            nudge,
            "--seed",
            1,
            "--feed",
            "long",
            *QUICK,
        )
    still, moved = placed("still/row-002.pdf")[1], placed("moved/row-002.pdf")[1]
    # to the right and, in the PDF's coordinates, up; to the nearest dot of 600 an inch
    assert [b - a for a, b in zip(still, moved, strict=True)] == pytest.approx([2, 1.5, 2, 1.5], abs=25.4 / 600)


@pytest.mark.slow
def test_the_tray_is_told(call, table):
    with SimulatedPrinter() as printer:
        command = ("print", table, "--rows", 2, "--printer", "epson", "--queue", printer.uri, *QUICK)
        _, err = call(*command, "--tray", "drawer", code=2)
        assert "no tray 'drawer'; trays that it lists: auto, rear, main" in err and printer.jobs == []
        call(*command, "--tray", "rear", "-q")
        assert any(one.name == "media-col" and "rear" in str(one) for one in printer.jobs[0].attributes)


@pytest.mark.slow
def test_the_printer_s_own_address_is_in_its_profile(call, table):
    with SimulatedPrinter() as printer:
        own = Path("config/handout/devices")
        own.mkdir(parents=True)
        (own / "printer-mine.toml").write_text(
            f'kind = "printer"\ntitle = "Mine"\ndpi = 300\nqueue = "{printer.uri}"\nformat = "pwg"\nflap = "right"\n'
            '[nudge]\nx = "-0.5mm"\n'
        )
        call("print", table, "--rows", "2", "--printer", "mine", *QUICK, "-q")
        assert printer.printed[0].document.startswith(b"RaS2PwgRaster")


@pytest.mark.slow
def test_ink_that_a_nudge_moves_beyond_the_margin_is_a_warning(call, table):
    _, err = call(
        "print", table, "--rows", 2, "--printer", "epson", "--queue", "file:out", "--nudge", "0mm,-50mm", *QUICK
    )
    assert "warning: row 2: ink" in err


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (("--nudge", "3mm"), "not two lengths"),
        (("--nudge", "3mm,80mm"), "more than 50 mm"),
        (("--flap", "leading"), "left or right, not leading; .*--feed long"),
        (("--resume", "--dry-run", "a.pdf"), "leave them out of a --dry-run"),
        (("--resume", "--afresh"), "give one of them"),
        (("--resume",), "There is nothing to resume: no batch of people.csv"),
        (("--again", "2"), "give --resume too"),
        (("--format", "png", "--queue", "ipp://127.0.0.1:9/ipp/print"), "takes no connections"),
        (("--queue", "ipp://"), "no printer's address"),
    ],
)
def test_what_cannot_be_is_one_sentence(call, table, asked, words):
    given = ("--queue", "file:out") if "--queue" not in asked else ()
    _, err = call("print", table, *given, *asked, *QUICK, code=3 if "connections" in words else 2)
    assert re.search(words, err) and not list(Path().glob("out/*"))


def test_names_are_never_lost_without_a_word(call):
    Path("g.csv").write_text(
        "Guest(s),Street Address,City/State/Zip,RSVP,Who\nAda & Bob,12 Elm St,Boston MA 02138,yes,Cy\n"
    )
    out, err = call("print", "g.csv", "--dry-run", "a.png", "--json", *QUICK)
    assert "g.csv: these columns are not used: 'RSVP', 'Who'." in err
    assert json.loads(out)["columns"] == {
        "used": [
            {"column": "Guest(s)", "as": "name"},
            {"column": "Street Address", "as": "street"},
            {"column": "City/State/Zip", "as": "place"},
        ],
        "unused": ["RSVP", "Who"],
        "notes": ["these columns are not used: 'RSVP', 'Who'"],
    }
    out, _ = call("print", "g.csv", "--dry-run", "a.png", "--json", "--columns", "name=Who,none=RSVP", *QUICK)
    assert json.loads(out)["columns"]["unused"] == ["Guest(s)", "RSVP"]


def test_a_table_without_names_needs_a_word(call):
    Path("n.csv").write_text("Street,City\n1 Lane,Ely\n")
    _, err = call("print", "n.csv", "--dry-run", "a.png", *QUICK, code=2)
    assert "no row has a name" in err and "--no-name" in err and not Path("a-002.png").exists()
    _, err = call("print", "n.csv", "--dry-run", "a.png", "--no-name", *QUICK)
    assert "warning: row 2: it has no name" in err and "1 of 1 envelope done" in err


@pytest.mark.slow
def test_a_batch_is_gone_on_with_by_the_same_columns(call):
    Path("o.csv").write_text("Who,Street,City,Work Street,Work City\n" + "Ada,1 Lane,Ely,2 Road,York\n" * 2)
    with SimulatedPrinter(faults=Faults(hold_at=1)) as printer:
        command = ("print", "o.csv", "--queue", printer.uri, "--columns", "name=Who", *QUICK)
        call(*command, code=3)
        _, err = call(*command, "--address", "work", "--resume", code=2)
        assert "--address was not given and is now work" in err
        _, err = call("print", "o.csv", "--queue", printer.uri, "--columns", "1=name", *QUICK, "--resume", code=2)
        assert "--columns was name=Who and is now 1=name" in err


def test_an_address_that_is_written_smaller_is_told(call):
    rows = ["Wolfgang Mommsenwammer,Wummwumm-Mammutweg 114,Mommwumm am Wummerswald", "Ada,Lane 1,Bath"]
    Path("long.csv").write_text("\n".join(["name,street,city", *rows]), encoding="utf-8")
    asked = ["print", "long.csv", "--dry-run", "a.svg", "--seed", 1]
    assert re.search(r"Written at [78]\d% of its size, so that it fits\.", call(*asked, "--rows", 2)[1])
    assert "Written smaller: 1 of 2 pages, down to " in call(*asked)[1]
    assert "smaller" not in call(*asked, "--rows", 3)[1]
