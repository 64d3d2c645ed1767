"""The wizard's steps as the page Calibration asks for them: what each shows, what a bad scan changes, who is first."""

import shutil
from dataclasses import replace
from functools import partial

import msgspec
import numpy as np
import pytest
from PIL import Image

from handout.calibrating import store
from handout.calibrating.wizard import Step
from handout.colour import table
from handout.errors import InputError
from handout.pipeline import calibrating
from handout.pipeline import calibration_desk as desk
from handout.pipeline.options import CalibrationOptions, CalibrationPlace
from handout.pipeline.results import Attendant
from handout.printing import printers
from handout.simulated import print_and_scan as loop
from handout.simulated.flatbed import Flatbed

DPI = 80
PLACE = CalibrationPlace("sim", "white")


@pytest.fixture(autouse=True)
def coarse(monkeypatch, profile):
    monkeypatch.setattr(printers, "resolve", lambda name: profile)


def taken(wizard, path, folder, **options):
    folder.mkdir(exist_ok=True)
    options = CalibrationOptions(**options)
    return desk.take_scans(CalibrationPlace("sim", "white", options=options, folder=folder, scans=(path,)))


def test_the_chart_is_printed_and_given_as_a_file(tmp_path):
    first = desk.open_calibration(PLACE)
    assert (first["number"], first["step"], first["resumed"]) == (1, str(Step.PRINT), False)
    printed = desk.print_page(replace(PLACE, folder=tmp_path))
    assert printed["step"] == str(Step.SCAN) and "frame under the coloured fields" in printed["request"]
    assert (tmp_path / "chart.pdf").read_bytes().startswith(b"%PDF") and desk.open_calibration(PLACE)["resumed"]
    with pytest.raises(InputError, match="to scan the chart"):
        desk.print_page(replace(PLACE, folder=tmp_path))


def test_the_grid_and_the_pen_are_shown(wizard, picture, tmp_path):
    field, mm = wizard.chart.pages[0].scribble_field, 300 / 25.4
    fine = np.array(Image.fromarray(picture).resize([round(side * 300 / DPI) for side in picture.shape[1::-1]]))
    left, top = (round(at * mm) for at in field[:2])
    for line in range(4):  # as a pen would: four long strokes in blue
        fine[top + 40 + 35 * line : top + 45 + 35 * line, left + 60 : left + 900] = (40, 60, 140)
    loop.write(fine, 300, tmp_path / "written.tif")
    facts = taken(wizard, tmp_path / "written.tif", tmp_path / "out")
    assert facts["accepted"] and facts["step"] == str(Step.BUILD) and facts["kept"] == 1
    (shown,) = facts["pictures"]
    assert shown["used"] == shown["patches"] and shown["marks"] == 16 and not shown["unread"] and not shown["faults"]
    drawn = np.array(Image.open(facts["files"][0]))
    assert drawn.shape[:2] == (shown["height"], shown["width"])
    assert ((drawn[..., 1] > 170) & (drawn[..., 0] < 120) & (drawn[..., 2] < 140)).sum() > 2000  # green grid
    red, green, blue = bytes.fromhex(facts["pen"]["colour"][1:])
    assert blue > green > red and facts["files"][1].endswith("pen.png") and "no hand" in facts["pen"]["kind"]


def test_a_cropped_page_shows_what_is_missing_and_changes_nothing(wizard, picture, tmp_path):
    loop.write(np.ascontiguousarray(picture[: -round(60 / 25.4 * DPI)]), DPI, tmp_path / "cropped.tif")
    facts = taken(wizard, tmp_path / "cropped.tif", tmp_path / "out")
    assert not facts["accepted"] and facts["step"] == str(Step.SCAN) and facts["kept"] == 0
    codes = {one["code"]: one["sentence"] for one in facts["findings"]}
    assert "cut off" in codes["cropped"] and facts["findings"][0]["where"] == "cropped.tif"
    below = [max(y for _, y in fault["at"]) for fault in facts["pictures"][0]["faults"] if fault["code"] == "cropped"]
    assert len(below) > 50 and min(below) > 0.95 and facts["pictures"][0]["unread"]


def test_a_wrong_page_is_shown_as_it_is(wizard, tmp_path):
    Image.new("RGB", (827, 1169), "white").save(tmp_path / "blank.png", dpi=(DPI, DPI))
    facts = taken(wizard, tmp_path / "blank.png", tmp_path / "out")
    assert not facts["accepted"] and [one["code"] for one in facts["findings"]] == ["no-marks"]
    assert facts["pictures"][0]["label"] == "" and Image.open(facts["files"][0]).size == (827, 1169)
    with pytest.raises(InputError, match=r"text\.txt"):
        (tmp_path / "text.txt").write_text("no picture")
        taken(wizard, tmp_path / "text.txt", tmp_path / "out")
    assert store.list_stored() == []


def test_a_meddling_scanner_is_named(wizard, picture, tmp_path):
    exposed = np.clip(picture * 1.25, 0, 255).astype(np.uint8)
    loop.write(exposed, DPI, tmp_path / "exposed.tif")
    facts = taken(wizard, tmp_path / "exposed.tif", tmp_path / "out")
    assert not facts["accepted"] and "clipped-whites" in {one["code"] for one in facts["findings"]}
    loop.write(np.rint(255 * (picture / 255.0) ** 2.2).astype(np.uint8), DPI, tmp_path / "linear.tif")
    facts = taken(wizard, tmp_path / "linear.tif", tmp_path / "out")
    (tone,) = [one for one in facts["findings"] if one["code"] == "tone"]
    assert tone["severity"] == "warn" and tone["where"] == "linear.tif" and facts["accepted"]


def test_who_looks_at_an_older_step_is_told(wizard, scan, tmp_path):
    with pytest.raises(desk.StaleCalibration, match="elsewhere"):
        desk.open_calibration(CalibrationPlace("sim", "white", step=str(Step.BUILD)))
    taken(wizard, scan, tmp_path / "out")
    back = desk.scan_again(CalibrationPlace("sim", "white", step=str(Step.BUILD)))
    assert back["step"] == str(Step.SCAN) and back["kept"] == 0


@pytest.mark.slow
def test_the_whole_way_to_what_is_stored(with_table, profile, tmp_path):
    printer = loop.make_loop(profile, "white")
    printer.dpi, printer.flatbed = 150, Flatbed(shading=0.0)
    printed = desk.print_page(replace(PLACE, folder=tmp_path))
    assert printed["step"] == str(Step.VERIFY)
    wrong = desk.take_scans(replace(PLACE, folder=tmp_path, scans=tuple(with_table.scans)))
    assert not wrong["accepted"] and wrong["findings"][0]["code"] == "another-chart" and wrong["pictures"]
    (strip,) = printer.scan(tmp_path / "strip.pdf", tmp_path / "strip.tif")
    facts = desk.take_scans(replace(PLACE, folder=tmp_path, scans=(strip,)))
    assert facts["accepted"] and facts["helps"] and facts["step"] == str(Step.STORE)
    assert facts["verified"]["after"]["mean"] < 1 < facts["verified"]["before"]["mean"]
    assert [row[0] for row in facts["shades"]] == ["Ink", "Greys"] and len(facts["shades"][0][2]) > 40
    stored = desk.store_calibration(PLACE)
    (listed,) = desk.calibrations()["stored"]
    assert listed == stored["stored"] and listed["shades"] == facts["shades"] and listed["report"]
    desk.give_report(replace(PLACE, made=listed["made"], folder=tmp_path))
    assert "Before and after" in (tmp_path / "report.html").read_text(encoding="utf-8")
    with pytest.raises(InputError, match="no report"):
        desk.give_report(replace(PLACE, made="2001-01-01", folder=tmp_path))
    shutil.rmtree(store.folder())
    assert desk.calibrations()["stored"] == []


class Person(Attendant):
    """Gives these files when asked for scans, and tries again; keeps what is asked and said."""

    watches = True

    def __init__(self, *scans):
        self.scans, self.asked, self.heard = list(scans), [], []

    def say(self, *sentences):
        self.heard += sentences

    def do(self, request, needed=True):
        self.asked.append(request)

    def file_of(self, what):
        self.asked.append(what)
        return self.scans.pop(0)


@pytest.mark.slow
def test_what_the_page_began_the_terminal_ends(profile, scan, monkeypatch, tmp_path):
    monkeypatch.setattr(printers, "resolve", lambda name: msgspec.structs.replace(profile, simulated=False, file=True))
    monkeypatch.setattr(table, "build", partial(table.build, size=17))
    printed = desk.print_page(replace(PLACE, folder=tmp_path, to_printer=False))
    assert printed["step"] == str(Step.SCAN) and printed["writes_files"] and printed["files"]
    Image.new("RGB", (827, 1169), "white").save(tmp_path / "blank.png", dpi=(DPI, DPI))
    person = Person(tmp_path / "blank.png", scan)
    options = CalibrationOptions(output=tmp_path / "charts", no_verify=True)
    made = calibrating.calibrate(replace(PLACE, options=options), attendant=person)
    assert person.asked == ["the scan of the chart"] * 2 and made.calibration.paper == "white"
    assert next(part for part in person.heard if part.startswith("\n")) == "\n2/6  Scan the chart"
    told = " ".join(person.heard)
    assert "Going on with the calibration of simulated/white" in told and "16 square marks" in told
    assert "misses its own patches by" in told and "Nothing is written in the frame" in told
    assert desk.calibrations()["stored"][0]["verified"] is None
    assert desk.open_calibration(PLACE)["step"] == str(Step.PRINT)  # the next one begins anew
