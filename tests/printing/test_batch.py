import json
import re
from pathlib import Path

import msgspec
import pikepdf
import pytest
from doubles import block, print_all, rows, rule

from handout import profiles
from handout.errors import InputError, PrinterError
from handout.page_sizes import page
from handout.pipeline.printing import UNCALIBRATED
from handout.printing import media
from handout.printing.address_table import read_addresses
from handout.printing.batch import RowsRefused
from handout.printing.queue import SimulatedQueue
from handout.printing.sending import Checked, PrintingStopped
from handout.profiles import Length, Margins, Printer
from handout.values import Drawing, Page

ROOT = Path(__file__).resolve().parents[2]
DL = page("DL")
QUEUE = Printer(kind="printer", title="Test printer", dpi=150, queue="envelopes")
FILE = Printer(kind="printer", title="File", dpi=150, file=True)
BAD = {
    "r4": {"lines": (), "problem": "there is no street, place or address in it"},
    "r6": {"lines": ("Bill £", "Street")},
}


def run(table, profile=QUEUE, **given):
    return print_all(table, rule, profile, DL, ink=block, **given)


def test_every_envelope_is_a_job_turned_to_the_feed(print_system):
    report = run(rows(3))
    assert [(job.row, job.name) for job in report.jobs] == [(2, "envelopes-1"), (3, "envelopes-2"), (4, "envelopes-3")]
    assert report.rows == (2, 3, 4) and report.exit_code == 0 and report.files == ()
    assert "media=iso_dl_110x220mm" in print_system.call(1) and "print-scaling=none" in print_system.call(1)
    assert re.fullmatch("handout [0-9a-f]{6} row 3", print_system.call(2)[3])
    with pikepdf.open(print_system.pdf(1)) as document:
        assert [float(v) for v in document.pages[0].mediabox] == pytest.approx([0, 0, 311.811, 623.622], abs=1e-3)
        assert json.loads(str(document.docinfo["/Subject"]))["row"] == 2


def test_the_direction_of_the_turn_is_the_profile_s(print_system, tmp_path):
    boxes = []
    for turn in ("left", "right"):
        run(rows(1), msgspec.structs.replace(QUEUE, turn=turn))
    for call in (1, 2):
        with pikepdf.open(print_system.pdf(call)) as document:
            matrix = pikepdf.parse_content_stream(document.pages[0])[1].operands
            boxes.append([float(v) for v in matrix])
    # the address stands right of the middle: at the top after a turn to the left, at the bottom after one to the right
    assert boxes[0][5] > 311 > boxes[1][5] + boxes[1][3]


def test_rows_that_fail_are_reported_together_and_the_others_are_done(print_system):
    report = run(rows(6, **BAD))
    assert [failed.row for failed in report.failed] == [4, 6]
    assert "no street" in report.failed[0].reason and "'£'" in report.failed[1].reason
    assert report.rows == (2, 3, 5, 7) and report.exit_code == 4
    assert print_system.calls == 4


def test_an_envelope_is_sent_before_the_next_is_made(print_system):
    calls = []
    run(rows(3), tell=lambda share, stage: calls.append((stage, print_system.calls)))
    assert calls == [("send 0/3", 0), ("send 1/3", 1), ("send 2/3", 2), ("send 3/3", 3)]


def test_where_one_row_keeps_all_from_being_made_nothing_is_sent_before_all_are_checked(print_system):
    calls = []
    run(
        rows(3),
        all_or_none=True,
        tell=lambda share, stage: stage.startswith("check") and calls.append(print_system.calls),
    )
    assert calls == [0] * 3 and print_system.calls == 3
    with pytest.raises(RowsRefused, match="Row 4 cannot be made, nor can 1 other"):
        run(rows(6, **BAD), all_or_none=True)
    assert print_system.calls == 3


def test_when_no_row_can_be_done_it_is_bad_input(print_system, tmp_path):
    report = run(rows(1, r2={"lines": (), "problem": "it is empty"}))
    assert report.exit_code == 2 and print_system.calls == 0
    report = run(rows(1, r2={"lines": ("£",)}), FILE, out=tmp_path / "a.pdf")
    assert report.exit_code == 2 and report.files == () and not (tmp_path / "a.pdf").exists()


def test_a_queue_that_fails_on_the_way_says_how_to_go_on(print_system):
    print_system.fail(3, "lp: Error - The printer or class does not exist.\n")
    with pytest.raises(PrintingStopped) as caught:
        run(rows(7, **BAD))
    stopped = caught.value
    assert stopped.exit_code == 3 and stopped.resume == "5-"
    assert "Row 5" in str(stopped) and "does not exist" in str(stopped)
    assert "Rows 2-3 were sent" in str(stopped) and "--rows 5-" in str(stopped)
    assert stopped.report.rows == (2, 3) and [job.row for job in stopped.report.jobs] == [2, 3]
    # that row 6 cannot be made would have been found after row 5
    assert [failed.row for failed in stopped.report.failed if failed.reason == "not sent"] == [5, 6, 7, 8]
    assert print_system.calls == 3
    resumed = run(rows(7, **BAD), select=stopped.resume)
    assert resumed.rows == (5, 7, 8)


def test_a_failure_between_copies_names_the_copies_that_went(tmp_path):
    with pytest.raises(PrintingStopped, match=r"Row 2 was sent and 1 of 2 copies of row 3; go on with --rows 3-5\."):
        run(rows(6), queue=SimulatedQueue(tmp_path, jam_at=4), copies=2, select="-5")


def test_an_interruption_is_told_how_to_go_on(tmp_path):
    class Interrupted(SimulatedQueue):
        def send(self, pdf, ticket):
            if ticket.title.endswith("3"):
                raise KeyboardInterrupt
            return super().send(pdf, ticket)

    with pytest.raises(KeyboardInterrupt) as caught:
        run(rows(3), queue=Interrupted(tmp_path))
    assert caught.value.__notes__ == ["Stopped at row 3. Row 2 was sent; go on with --rows 3-."]


def test_a_missing_queue_is_known_before_any_work(print_system):
    def never(*_):
        raise AssertionError("composed although there is no queue")

    with pytest.raises(PrinterError, match="no print queue 'gone'"):
        print_all(rows(2), never, msgspec.structs.replace(QUEUE, queue="gone"), DL)


def test_a_dry_run_needs_no_printer_and_gives_pages_as_they_are_read(tmp_path):
    out = tmp_path / "out.pdf"
    report = run(rows(3), out=out, copies=2)
    assert report.files == (out,) and report.jobs == ()
    with pikepdf.open(out) as document:
        assert len(document.pages) == 6
        assert [float(v) for v in document.pages[0].mediabox] == pytest.approx([0, 0, 623.622, 311.811], abs=1e-3)


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_pictures_are_numbered_as_the_rows(tmp_path, suffix):
    report = run(rows(3, r3=BAD["r4"]), FILE, out=tmp_path / f"e{suffix}", about={"seed": 1})
    assert [path.name for path in report.files] == [f"e-002{suffix}", f"e-004{suffix}"]
    assert all(path.stat().st_size > 100 for path in report.files)


def test_the_simulated_printer_keeps_what_it_would_print(tmp_path):
    profile = profiles.find("simulated", "printer")
    folder = tmp_path / "printed"
    report = run(rows(2), profile, out=folder)
    assert [job.name for job in report.jobs] == ["job-001", "job-002"]
    entry = json.loads((folder / "jobs.jsonl").read_text().splitlines()[0])
    assert re.fullmatch("handout [0-9a-f]{6} row 2", entry.pop("title"))
    assert entry == {
        "job": "job-001", "media": "iso_dl_110x220mm", "source": "rear", "options": {},
    }  # fmt: skip
    first = (folder / "job-001.pdf").read_bytes()
    run(rows(2), profile, out=folder)
    assert (folder / "job-001.pdf").read_bytes() == first
    assert run(rows(2), profile, out=tmp_path / "dry.pdf").files == (tmp_path / "dry.pdf",)


def test_ink_where_the_printer_cannot_reach_is_a_warning(tmp_path):
    reach = Length(100)
    near = Printer(kind="printer", title="Narrow", dpi=72, margins=Margins(top=reach), file=True)
    report = run(rows(1), near, out=tmp_path / "a.pdf")
    assert report.exit_code == 0
    assert len(report.warnings) == 1
    assert report.warnings[0].startswith("row 2: ink comes within") and "leading edge" in report.warnings[0]
    assert "Narrow cannot print nearer than 100 mm" in report.warnings[0]


def test_what_is_true_of_many_rows_is_said_once(tmp_path):
    reach = Length(100)
    near = Printer(kind="printer", title="Narrow", dpi=72, margins=Margins(top=reach), file=True)
    report = run(rows(4, r3={"warnings": ("check the accents",)}), near, out=tmp_path / "a.pdf")
    told, accents = report.warnings
    assert told.startswith("rows 2-5: ink comes within") and "by a larger --margin, or by another --feed" in told
    assert accents == "row 3: check the accents"


def test_of_rows_that_differ_the_worst_length_is_said():
    checked = Checked()
    for row, length in ((2, 9.4), (3, 10.9), (5, 9.9)):
        checked.warn(
            row, [f"ink comes within {length} mm of the edge, not 20 mm", f"ink reaches {length} mm beyond it"]
        )
    assert checked.warnings == [
        "rows 2-3,5: ink comes within 9.4 mm of the edge, not 20 mm",
        "rows 2-3,5: ink reaches 10.9 mm beyond it",
    ]


def test_a_card_is_not_held_to_the_margins_of_an_envelope():
    profile = profiles.find("epson", "printer")
    card, envelope = Page(148.0, 105.0), page("DL")
    assert media.printer_for(card, profile).margins.bottom == 3 < media.printer_for(envelope, profile).margins.bottom


def test_warnings_of_the_table_are_passed_on(tmp_path):
    report = run(rows(2, r3={"warnings": ("check the accents",)}), FILE, out=tmp_path / "a.pdf")
    assert report.warnings == ("row 3: check the accents",)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"copies": 0}, "copies: 0 is outside 1 to 100"),
        ({"select": "99"}, "names no row"),
        ({"out": "a.docx"}, ".pdf, .png or .svg"),
        ({"out": "none/a.pdf"}, "does not exist"),
        ({"out": "a.pdf", "x_height": 400.0}, "x-height"),
        ({}, "--dry-run out.pdf"),
    ],
)
def test_bad_input_is_refused_before_any_work(tmp_path, given, words):
    given = given | ({"out": tmp_path / given["out"]} if "out" in given else {})
    with pytest.raises(InputError, match=words):
        run(rows(2), FILE, **given)
    assert list(tmp_path.iterdir()) == []


def test_the_example_is_ready_to_print(tmp_path):
    table = read_addresses(ROOT / "examples" / "envelope.csv")
    assert len(table) == 12 and len({row.lines[-1] for row in table}) >= 10
    assert not any(row.problem or row.warnings for row in table)
    assert max(len(line) for row in table for line in row.lines) > 45
    report = run(table, FILE, out=tmp_path / "a.pdf")
    assert report.exit_code == 0 and len(report.rows) == 12


def test_uncalibrated_is_one_plain_sentence():
    assert UNCALIBRATED.count(".") == 1 and "not calibrated" in UNCALIBRATED


@pytest.mark.parametrize(
    ("inked", "says"),
    [((80, 50, 150, 80), []), ((80, 2, 150, 80), ["ink comes within"]), (None, ["nothing is written"])],
)
def test_scanned_ink_has_margins_too(tmp_path, inked, says):
    def write(text, layout, row):
        return Drawing((), layout.page, {}, lambda dpi: block(rule(text, layout, row), dpi), inked)

    near = Printer(kind="printer", title="Narrow", dpi=72, margins=Margins(top=Length(10), left=Length(10)), file=True)
    report = print_all(rows(1), write, near, DL, ink=lambda drawing, dpi: drawing.ink(dpi), out=tmp_path / "a.pdf")
    assert report.exit_code == 0 and len(report.warnings) == len(says)
    assert all(part in warning for part, warning in zip(says, report.warnings, strict=True))
