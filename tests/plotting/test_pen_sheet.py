"""The test sheet: what it shows is what the machine does."""

import re

import numpy as np
import pytest

from handout import profiles
from handout.errors import DoesNotFit
from handout.plotting import bed, plan, setup_sheet
from handout.plotting.setup_sheet import Caption
from handout.values import Drawing, Page, Stroke

SIM = profiles.find("simulated", "plotter")
EBB = profiles.find("axidraw-v3", "plotter")
PAGE = Page(200.0, 200.0)


def drawing(panel, *, at=20.0):
    """The lines of a panel alone, on one clock."""
    strokes, clock = [], 0.0
    for line in panel.lines:
        strokes.append(Stroke(line.t + clock, line.xy + at))
        clock += line.t[-1] + 0.2
    return Drawing(tuple(strokes), PAGE)


def with_play(lines, play):
    """The same lines on a machine whose axes have play, mm: they lag behind until the play is taken up."""
    at, moved = np.array([0.0, 0.0]), []
    for line in lines:
        drawn = []
        for point in line.xy:
            at = np.clip(at, point - play / 2, point + play / 2)
            drawn.append(at)
        moved.append(np.array(drawn))
    return moved


@pytest.mark.parametrize("along", [0, 1])
@pytest.mark.parametrize("play", [0.0, 0.15, 0.3, 0.55])
def test_the_vernier_reads_the_play(along, play):
    panel = setup_sheet.vernier(along, "X", SIM, 1.0)
    drawn = with_play(panel.lines, play)
    first, last = -4, 12
    count = last - first + 1
    up, down = drawn[1 : 1 + count], drawn[2 + count :][::-1]
    assert len(down) == count
    apart = [abs(a[-1, along] - b[-1, along]) for a, b in zip(up, down, strict=True)]
    assert setup_sheet.STEP * (first + int(np.argmin(apart))) == pytest.approx(play)
    labels = [caption.text for caption in panel.captions]
    assert labels == ["0", ".2", ".4", ".6", "X play"]


@pytest.mark.slow
@pytest.mark.parametrize("profile", [SIM, EBB], ids=["grbl", "ebb"])
@pytest.mark.parametrize("ladder", [setup_sheet.straight, setup_sheet.loops])
def test_a_ladder_is_drawn_at_the_speeds_it_says(profile, ladder):
    panel = ladder(profile, 1.0)
    made = plan(drawing(panel), profile)
    said = [float(caption.text) for caption in panel.captions if caption.text != "mm/s"]
    assert len(said) == len(panel.lines) >= 5 and said == sorted(set(said))
    assert max(said) <= profile.limits.draw_speed
    kept = [speeds(made, number) for number in range(len(said))]
    assert kept == pytest.approx(said, rel=0.06)


def speeds(made, number):
    """The greatest speed that a stroke of a plan keeps for a while, mm/s."""
    rows = np.flatnonzero(made.toolpath.draws & (made.toolpath.stroke == number))
    begin, end = made.starts[rows[0]], made.starts[rows[-1]] + made.motion.duration[rows[-1]]
    t = np.arange(begin, end, 0.004)
    at = np.array([made.pen_at(float(moment))[:2] for moment in t])
    fast = np.hypot(*np.diff(at, axis=0).T) / 0.004
    return float(np.percentile(fast, 90))


def test_lines_begin_with_the_rests_they_name():
    panel = setup_sheet.starts(SIM, 1.0)
    wanted = [int(caption.text) for caption in panel.captions if caption.text.isdigit()]
    xs = {round(float(line.xy[0, 0]), 6) for line in panel.lines}
    assert len(xs) == 1  # all begin on the rule
    for ms, line in zip(wanted, panel.lines[1:], strict=True):
        still = line.t[np.flatnonzero(np.hypot(*(line.xy - line.xy[0]).T) > 0)[0] - 1]
        assert 1000 * still == pytest.approx(ms)
    made = plan(drawing(panel), SIM)
    short = plan(Drawing(drawing(panel).strokes[:1], PAGE), SIM)
    moving = sum(line.length for line in panel.lines[1:]) / setup_sheet.pace(SIM)
    assert made.duration - short.duration > moving + sum(wanted) / 1000


@pytest.mark.parametrize("profile", [SIM, EBB], ids=["grbl", "ebb"])
def test_the_marks_of_tails_are_where_the_pen_would_be(profile):
    panel = setup_sheet.ends(profile, 1.0)
    rule = panel.lines[0].xy[0, 0]
    shown = [int(caption.text) for caption in panel.captions if caption.text.isdigit()]
    marks = [line.xy[0, 0] - rule for line in panel.lines[1 : 1 + len(shown)]]
    made = plan(drawing(panel), profile)
    first = 1 + len(shown)  # the first line that ends at the rule; the next is beyond the gap
    gap = np.flatnonzero((made.toolpath.stroke == first + 1) & made.toolpath.draws)[0] - 1
    while made.toolpath.draws[gap] or not np.ptp(made.toolpath.points[gap : gap + 2, 0]):
        gap -= 1
    rows = [gap]
    while not made.toolpath.draws[rows[0] - 1] and np.ptp(made.toolpath.points[rows[0] - 1 : rows[0] + 1, 0]):
        rows.insert(0, rows[0] - 1)
    leaves = float(made.starts[rows[0]])
    before = np.array(made.pen_at(leaves)[:2])
    for ms, mark in zip(shown, marks, strict=True):
        way = np.hypot(*(np.array(made.pen_at(leaves + ms / 1000)[:2]) - before))
        assert way == pytest.approx(mark, abs=0.25, rel=0.15)


@pytest.mark.parametrize("name", ["simulated", "midtbot", "hp-7475a"])
def test_the_sheet_fits_what_the_machine_reaches(name):
    profile = profiles.find(name, "plotter")
    page = setup_sheet.usual_page(profile)
    made = setup_sheet.test_sheet(profile, page, np.random.default_rng(1))
    assert bed.beyond_paper(made) is None
    place = bed.place(page, profile)
    bed.check(np.concatenate([place.to_machine(stroke.xy) for stroke in made.strokes]), profile)
    t = np.concatenate([stroke.t for stroke in made.strokes])
    assert (np.diff(t) > 0).all()
    sides = made.strokes[0].xy  # the square
    assert np.ptp(sides, axis=0)[0] == pytest.approx(np.ptp(sides, axis=0)[1])
    assert round(float(np.ptp(sides, axis=0)[0]), 6) in (150, 120, 100, 80, 60, 50, 40, 30, 20)


def test_a_page_that_is_too_small_is_refused():
    with pytest.raises(DoesNotFit, match=r"does not fit into the .* of a page of 40 x 40 mm: use a larger --page"):
        setup_sheet.test_sheet(SIM, Page(40.0, 40.0), np.random.default_rng(1))


def test_what_cannot_be_set_is_left_out():
    hp = profiles.find("hp-7475a", "plotter")
    names = [panel.name for panel in setup_sheet._panels(hp, ("X", "Y"), 60.0, 1.0)]
    assert "starts" not in names and "play X" in names
    assert not any("pen.down_time" in line for line in setup_sheet.how_to_read(hp))
    assert any("pen.down_time" in line for line in setup_sheet.how_to_read(SIM))


def test_captions_stand_where_they_are_put():
    captions = [Caption("80 mm", 30.0, 50.0, 1.5), Caption("play", 90.0, 120.0, 3.0)]
    made = setup_sheet.write_captions(captions, "house-print", PAGE, np.random.default_rng(2), 1.0)
    words = [[s.xy for s in made.strokes if (s.xy[:, 1].mean() < 80) == (n == 0)] for n in range(2)]
    for caption, strokes in zip(captions, words, strict=True):
        xy = np.concatenate(strokes)
        assert xy[:, 0].min() == pytest.approx(caption.x, abs=0.4)
        assert np.percentile(xy[:, 1], 70) == pytest.approx(caption.y, abs=0.7 * caption.x_height)


def test_the_sheet_says_what_its_pen_was_told(monkeypatch):
    drawn = []
    monkeypatch.setattr(setup_sheet, "_draw_parts", lambda placed, *_: drawn.append(placed[0][2].captions[0].text))
    setup_sheet.test_sheet(SIM, PAGE, np.random.default_rng(1))
    assert re.match(r"[ -~]+: up 40, down 90", drawn[0])
