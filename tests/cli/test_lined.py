"""Text on the lines of paper: ruled, squared, and pictures of sheets."""

import json
import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from handout.sources import read_drawing

sys.path.insert(0, str(Path(__file__).parents[1] / "scanning"))
from sheets import kinds, on_a_desk, photographed, printed, scanned, sheet

TEXT = "nun mum nun mum mun\n" * 5  # nothing below the line
# mm that a line stands off its rule at most: on 19 of 20 of 63 people's pages (docs/bibliography.md, Copiste d'un jour)
# the one furthest off stands .75 from where its writer's usually do; of 24 seeds .68, with letters of 2.7 mm
OFF = 0.75


def feet(path):
    """Where the lines of a page stand: for each the (x, y), mm, of the lowest places of its words, pen down."""
    words = {}
    for stroke in read_drawing(path).strokes:
        words.setdefault(stroke.word, []).append(stroke.xy)
    lows = np.array([max(np.concatenate(some).tolist(), key=lambda p: p[1]) for some in words.values()])
    return np.split(lows, np.flatnonzero(np.diff(lows[:, 1]) > 3) + 1)


def write(call, *options, seed=1):
    out, err = call("write", TEXT, "--page", "A5", "--seed", seed, "--json", "-o", "a.json", *options)
    return json.loads(out), err


def test_lines_are_as_far_apart_as_the_rules(call):
    facts, err = write(call, "--paper", "ruled:8mm", "-o", "a.png", "--dpi", 100)
    rules = facts["paper"]["first_mm"] + 8 * np.arange(5)
    assert len(feet("a.json")) == 5 and facts["paper"]["line_spacing_mm"] == 8
    assert "Lines 8 mm apart" in err and "small letters 2.7 mm tall" in err
    # the rules of the picture are there, too
    red = np.asarray(Image.open("a.png").convert("RGB"))[:, 5:30, 0].mean(axis=1)
    drawn = (np.flatnonzero((red[1:-1] < 235) & (red[1:-1] <= red[:-2]) & (red[1:-1] < red[2:])) + 1.5) * 0.254
    assert all(np.abs(drawn - rule).min() < 0.26 for rule in rules)


def test_rules_are_kept_to_on_the_whole(call):
    off = []
    for seed in range(1, 9):
        facts, _ = write(call, "--paper", "ruled:8mm", seed=seed)
        heights = [np.median(line[:, 1]) for line in feet("a.json")]
        off.append(np.subtract(heights, facts["paper"]["first_mm"] + 8 * np.arange(5)))
    # of 24 seeds half of the lines are within 0.2 mm, and their mean is 0.1: feet of letters reach below their line; on
    # half of people's pages letters are within .25 mm
    assert np.median(np.abs(off)) < 0.25 and abs(np.mean(off)) < 0.2 and np.abs(off).max() < OFF
    assert abs(np.diff(off, axis=1).mean()) < 0.1


def test_the_first_rule_of_a_real_sheet_can_be_given(call):
    facts, err = write(call, "--paper", "ruled:7.1mm,31mm")
    assert facts["paper"]["first_mm"] == 31 and "the upper one 31 mm below the edge" in err
    assert np.median(feet("a.json")[0][:, 1]) == pytest.approx(31, abs=OFF)


def test_sizes_that_are_given_and_do_not_contradict_are_kept(call):
    facts, err = write(call, "--paper", "ruled:8mm", "--line-spacing", "16mm", "--x-height", "3mm")
    assert facts["paper"]["line_spacing_mm"] == 16 and "every 2nd rule of 8 mm" in err and "letters 3 mm" in err
    facts, err = write(call, "--paper", "ruled:8mm", "--line-spacing", "9mm")
    assert (
        "--line-spacing 9mm is followed, and lines leave the paper's rules, which are 8 mm apart" in facts["notes"][0]
    )
    assert facts["notes"][0] in err
    heights = np.array([np.median(line[:, 1]) for line in feet("a.json")])
    assert np.diff(heights).mean() == pytest.approx(9, abs=0.6)


def test_every_second_line_of_squares(call):
    facts, err = write(call, "--paper", "squared:5mm")
    assert facts["paper"]["line_spacing_mm"] == 10 and facts["paper"]["first_mm"] % 5 == 0
    assert "every 2nd rule of 5 mm" in err and "small letters 2.8 mm" in err
    for line, rule in zip(feet("a.json"), facts["paper"]["first_mm"] + 10 * np.arange(5), strict=True):
        assert np.median(line[:, 1]) == pytest.approx(rule, abs=OFF)
    assert "only ruled paper" in call("write", "a", "-o", "a.png", "--paper", "squared:5mm,3mm", code=2)[1]


def test_rules_that_leave_no_room_are_said(call):
    err = call("write", "nun", "--page", "A6", "--paper", "ruled:8mm,200mm", "-o", "a.png", code=2)[1]
    assert "None of the paper's rules has room for letters of 2.7 mm" in err and not Path("a.png").exists()


@pytest.fixture
def photo():
    how, rules, margin, _ = kinds()["college"]
    made = photographed(sheet(**how, dpi=120), np.random.default_rng(5), turn=2.0)
    Image.fromarray(made.rgb).save("sheet.jpg", quality=90)
    return made, rules, margin


@pytest.mark.slow
def test_a_photographed_sheet_is_written_on_its_rules_and_inside_its_margin(call, photo):
    made, rules, margin = photo
    facts, err = write(call, "--paper", "sheet.jpg", "-o", "a.png", "--dpi", 100)
    paper = facts["paper"]
    assert f"lines {round(paper['pitch_mm'], 1):g} mm apart, margin at {round(paper['margin_mm'], 1):g} mm" in err
    assert "fall to the right by" in err or "rise to the right by" in err
    lines = feet("a.json")
    for line, rule in zip(lines, rules, strict=False):
        for x, y in line:
            u = np.array([made.seen(s, rule) for s in np.linspace(0, 148, 300)])
            assert abs(y - np.interp(x, u[:, 0], u[:, 1])) < OFF
    left = min(stroke.xy[:, 0].min() for stroke in read_drawing("a.json").strokes)
    assert left > max(made.seen(margin, 20)[0], made.seen(margin, 60)[0]) + 0.5


@pytest.mark.slow
def test_a_sheet_without_rules_is_said(call):
    made = scanned(sheet([], dpi=120), np.random.default_rng(2))
    Image.fromarray(made.rgb).save("blank.png")
    facts, err = write(call, "--paper", "blank.png")
    assert facts["paper"] == {"rules": 0} and "blank.png: no rules were found on it" in err
    Image.fromarray(made.rgb[:, :400]).save("cut.png")
    assert "cut.png is stretched to fill the page" in write(call, "--paper", "cut.png")[1]


@pytest.mark.slow
def test_a_scanned_sheet_says_its_own_size(call):
    how, *_ = kinds()["wide"]
    made = scanned(sheet(**how, size=(120.0, 180.0), dpi=120), np.random.default_rng(2))
    Image.fromarray(made.rgb).save("own.png", dpi=(120, 120))
    call("write", "nun mum", "--paper", "own.png", "-o", "b.svg", "--seed", 1)
    size = re.search(r'width="([\d.]+)mm" height="([\d.]+)mm"', Path("b.svg").read_text())
    assert [float(side) for side in size.groups()] == pytest.approx([120, 180], abs=0.3)


def test_a_plotter_writes_on_the_rules_now_and_when_it_goes_on(call, photo):
    out, err = call(
        "plot", "--dry-run", "b.json", TEXT, "--paper", "ruled:8mm,30mm", "--page", "A5", "--seed", 3, "--json"
    )
    assert json.loads(out)["paper"]["first_mm"] == 30 and "30 mm below the edge of the sheet" in err
    assert np.median(feet("b.json")[0][:, 1]) == pytest.approx(30, abs=OFF)


def test_the_pages_of_a_job_keep_the_rules_that_were_measured(photo):
    from handout.pipeline import job_pages
    from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions
    from handout.pipeline.texts import prepare
    from handout.writing.layout import Ruling

    writing, sheet, picture = WritingOptions(seed=4), SheetOptions("A5"), PictureOptions(paper="sheet.jpg")
    task = prepare(writing, sheet, picture)
    assert isinstance(task.layout.ruling, Ruling) and task.layout.ruling.pitch == pytest.approx(7.1, abs=0.3)
    kept = json.loads(json.dumps(job_pages.inputs(TEXT, task, writing, sheet, "A5")))
    Path("sheet.jpg").unlink()
    assert job_pages._reopen_task(kept, 1).layout == task.layout


def test_text_keeps_clear_of_what_is_printed_on_a_plain_sheet(call):
    made = printed(sheet([], dpi=100), at=(10, 10, 128, 30), holes=((16.0, 105.0),))
    Image.fromarray(scanned(made, np.random.default_rng(2)).rgb).save("head.png")
    facts, err = write(call, "--paper", "head.png")
    left, top, right, bottom = facts["paper"]["text_mm"]
    assert 20 < left < 26 and 44 < top < 54 and right > 130 and bottom > 190
    assert "printed or punched on it is left free" in err
    drawn = np.concatenate([stroke.xy for stroke in read_drawing("a.json").strokes])
    assert drawn[:, 0].min() > left - 2 and drawn[:, 1].min() > top
    facts, err = write(call, "--paper", "head.png", "--margin", "10mm")
    assert "--margin is followed" in err and "text_mm" not in facts["paper"]


@pytest.mark.slow
def test_a_sheet_on_a_desk_is_written_on_its_rules(call):
    how, rules, margin, _ = kinds()["college"]
    rgb, _ = on_a_desk(sheet(**how, dpi=100), np.random.default_rng(4))
    Image.fromarray(rgb).save("desk.jpg", quality=90)
    facts, err = write(call, "--paper", "desk.jpg", "-o", "a.png", "--dpi", 60)
    assert "cut out of its picture along its outline" in err and facts["paper"]["rules"] == len(rules)
    for line, rule in zip(feet("a.json"), rules, strict=False):
        assert np.median(line[:, 1]) == pytest.approx(rule, abs=OFF)
    assert min(stroke.xy[:, 0].min() for stroke in read_drawing("a.json").strokes) > margin
    assert np.asarray(Image.open("a.png").convert("L"))[3:-3, 3:-3].min() > 60  # no wood


def test_a_pdf_is_written_on_clear_of_its_print(call):
    from reportlab.pdfgen.canvas import Canvas

    canvas = Canvas("form.pdf", pagesize=(420, 595))
    canvas.setFont("Helvetica-Bold", 30)
    canvas.drawString(60, 500, "Letterhead")
    canvas.showPage()
    canvas.showPage()
    canvas.save()
    out, err = call("write", "nun mum", "--paper", "form.pdf", "-o", "b.json", "--seed", 3, "--json")
    assert "form.pdf is the first of 2 pages" in err
    assert 40 < json.loads(out)["paper"]["text_mm"][1] < 50  # mm; the heading stands at 33.5
    drawing = read_drawing("b.json")
    assert (drawing.page.width, drawing.page.height) == pytest.approx((148.2, 209.9), abs=0.2)
    assert "no such page" in call("write", "a", "--paper", "form.pdf:3", "-o", "b.json", code=2)[1]


@pytest.mark.slow
def test_the_sheet_of_the_documents_has_its_margin(call):
    """Its edge, which is a line as well, and a ghost beside the margin line slope otherwise than that."""
    runpy.run_path(str(Path(__file__).parents[2] / "examples" / "sheet.py"))["main"]("sheet.jpg")
    out, _ = call("write", "hi", "--paper", "sheet.jpg", "--page", "A5", "-o", "a.svg", "--json")
    assert json.loads(out)["paper"]["margin_mm"] == pytest.approx(27, abs=0.5)
