"""Pages on beds: every placement is an isometry with a way back, and what does not fit is refused."""

import itertools
import re

import msgspec
import numpy as np
import pytest
from cursive import page
from hypothesis import given
from hypothesis import strategies as st

from handout import profiles
from handout.errors import DoesNotFit
from handout.plotting import bed, fit_to_bed, plan
from handout.profiles import Length
from handout.values import Drawing, Page, Stroke

PROFILE = profiles.find("simulated", "plotter")
A4, A5, A3 = Page(210, 297, "A4"), Page(148, 210, "A5"), Page(297, 420, "A3")


def machine(**changes):
    return msgspec.structs.replace(PROFILE, bed=msgspec.structs.replace(PROFILE.bed, **changes))


KINDS = list(itertools.product(["bottom-left", "top-left", "centre"], ["up", "down"]))


@given(st.sampled_from(KINDS), st.floats(20, 400), st.floats(20, 400), st.integers(0, 10**6))
def test_a_placement_keeps_distances_and_leads_back(kind, width, height, seed):
    placed = bed.place(Page(width, height), machine(origin=kind[0], y=kind[1]))
    xy = np.random.default_rng(seed).uniform(0, 300, (20, 2))
    there = placed.to_machine(xy)
    assert np.linalg.norm(np.diff(there, axis=0), axis=1) == pytest.approx(np.linalg.norm(np.diff(xy, axis=0), axis=1))
    assert placed.to_page(there) == pytest.approx(xy)
    mirrored = np.linalg.det(placed.turn) < 0
    assert mirrored == (kind[1] == "up")  # the page's y runs down: writing is mirrored only if the machine's does too


@pytest.mark.parametrize(("origin", "y"), KINDS)
@pytest.mark.parametrize("sheet", [A5, A4, Page(148, 100)])
def test_a_page_that_fits_lies_on_the_bed(origin, y, sheet):
    profile = machine(origin=origin, y=y)
    corners = np.array([[0, 0], [sheet.width, 0], [0, sheet.height], [sheet.width, sheet.height]], dtype=float)
    there = bed.place(sheet, profile).to_machine(corners)
    bed.check(there, profile)
    home = {"bottom-left": (0, 1), "top-left": (0, 0)}.get(origin)
    if home is None:
        assert there.mean(axis=0) == pytest.approx([0, 0])
    else:
        assert np.hypot(*there.T).min() == pytest.approx(0)


def test_an_upright_a4_is_turned_with_its_top_to_the_left():
    placed = bed.place(A4, PROFILE)
    assert placed.turned and not bed.place(A5, PROFILE).turned
    top, bottom = placed.to_machine(np.array([[105.0, 0.0], [105.0, 297.0]]))
    assert top == pytest.approx([0, 105]) and bottom == pytest.approx([297, 105])
    left, right = placed.to_machine(np.array([[0.0, 150.0], [210.0, 150.0]]))
    assert right[1] > left[1]  # text runs away from the reader


@pytest.mark.parametrize(("quarters", "corner", "right"), [
    (0, (20, 220), (1, 0)), (1, (20, 10), (0, 1)), (2, (168, 10), (-1, 0)), (3, (230, 158), (0, -1)),
])  # fmt: skip
def test_a_sheet_that_is_laid_is_drawn_as_it_lies(quarters, corner, right):
    """Its lower left corner, as it is seen, is moved by 20 and 10 mm; text runs to the right, away, back, nearer."""
    profile = msgspec.structs.replace(PROFILE, laid=profiles.LaidSheet(quarters, Length(20), Length(10)))
    placed = bed.place(A5, profile)
    assert placed.to_machine(np.zeros((1, 2)))[0] == pytest.approx(corner) and placed.turned == bed.TOPS[quarters]
    made = plan(Drawing((Stroke(np.linspace(0, 1, 5), np.linspace((0, 0), (40, 0), 5)),), A5), profile)
    pen_down = made.toolpath.points[np.flatnonzero(made.toolpath.draws), :2]
    assert np.ptp(pen_down, axis=0) @ np.abs(right) > 20 and made.placement.to_page(pen_down)[:, 1] == pytest.approx(0)


def test_outside_the_bed_says_where():
    far = Drawing((Stroke([0.0, 1.0], [[10.0, 10.0], [412.0, 20.0]]),), Page(450, 200))
    said = "x = 412 mm is outside the bed 0–300 mm of plotter-simulated: use --fit or a larger bed."
    with pytest.raises(DoesNotFit, match=re.escape(said)):
        plan(far, PROFILE)
    low = Drawing((Stroke([0.0, 1.0], [[10.0, 10.0], [100.0, 120.0]]),), Page(200, 100))
    with pytest.raises(DoesNotFit, match=r"y = -20 mm is outside the bed 0–220 mm"):
        plan(low, PROFILE)


@pytest.mark.slow
@pytest.mark.parametrize("size", [A3, Page(1000, 300), Page(250, 900), A4, A5])
@pytest.mark.parametrize(("origin", "y"), KINDS)
def test_fit_makes_everything_fit(size, origin, y):
    profile = machine(origin=origin, y=y)
    across = Stroke([90.0, 91.0], [[5.0, 5.0], [size.width - 5, size.height - 5]])
    drawing = Drawing((*page(words=10, size=size).strokes, across), size)
    fitted = fit_to_bed(drawing, profile)
    made = plan(fitted, profile)
    assert made.duration > 0
    scale = fitted.strokes[0].length / drawing.strokes[0].length
    assert scale == pytest.approx(fitted.page.width / drawing.page.width) and scale <= 1
    assert (scale == 1) == (size in (A4, A5)) and (fitted is drawing) == (size in (A4, A5))
    assert fitted is drawing or fitted.about["shrunk"] == [round(scale, 2)]


def test_fit_brings_back_what_hangs_over_the_edge():
    low = Drawing((Stroke([0.0, 1.0], [[-30.0, 10.0], [100.0, 120.0]], width=[1.0, 2.0]),), Page(200, 100))
    fitted = fit_to_bed(low, PROFILE)
    assert fitted.bounds == pytest.approx((0, 10, 130, 120))
    plan(fitted, PROFILE)


def test_a_larger_page_with_a_small_drawing_is_left_alone():
    profile = machine(origin="top-left", height=Length(200.0))
    note = Drawing((Stroke([0.0, 1.0], [[10.0, 10.0], [60.0, 40.0]]),), Page(500, 500))
    assert fit_to_bed(note, profile) is note


@pytest.mark.parametrize(("origin", "y"), [kind for kind in KINDS if kind[0] != "centre"])
def test_a_zero_inside_the_sheet(origin, y):
    """The same place of a page lies nearer to the zero by the inset, and the page's own corner out of reach."""
    inside = machine(origin=origin, y=y, inset_x=Length(10.0), inset_y=Length(4.0))
    sheet, places = Page(120.0, 90.0), np.array([[30.0, 40.0], [70.0, 60.0]])
    before, after = (bed.place(sheet, each).to_machine(places) for each in (machine(origin=origin, y=y), inside))
    assert np.abs(before) - np.abs(after) == pytest.approx(np.array([[10.0, 4.0]] * 2))
    with pytest.raises(DoesNotFit):
        bed.check(bed.place(sheet, inside).to_machine(np.array([[5.0, 45.0]])), inside)


@pytest.mark.parametrize("sheet", [Page(420, 297), Page(297, 420), Page(900, 100)])
def test_what_is_made_to_fit_keeps_off_the_edge_that_is_out_of_reach(sheet):
    inside = machine(inset_x=Length(20.0), inset_y=Length(4.0))
    corners = np.array([[1.0, 1.0], [sheet.width - 1, sheet.height - 1]])
    fitted = fit_to_bed(Drawing((Stroke(np.array([0.0, 1.0]), corners),), sheet), inside)
    there = bed.place(fitted.page, inside).to_machine(fitted.strokes[0].xy)
    bed.check(there, inside)
    assert (np.ptp(there, axis=0) / [inside.bed.width, inside.bed.height]).max() > 0.97


def test_what_hangs_off_the_paper_is_named():
    page = Page(100, 50)
    inside = Stroke(np.array([0.0, 1.0]), np.array([[0, 0], [100, 50]]))
    assert bed.beyond_paper(Drawing((inside,), page)) is None
    for xy, edge, far in (((-3, 10), "left", 3), ((10, -4), "upper", 4), ((105, 9), "right", 5), ((9, 56), "lower", 6)):
        out = Stroke(np.array([2.0, 3.0]), np.array([[50, 25], xy]), word=6)
        said = bed.beyond_paper(Drawing((inside, out), page))
        assert f"Stroke 2 (of word 7) reaches {far} mm beyond the {edge} edge of the paper (100 x 50 mm)" in said
