"""What a pen did to boxes is told as a person would tell it."""

import cv2
import numpy as np
import pytest

from handout_lab.study import marks
from handout_lab.study.marks import DPI, Manner, Mark, decided
from handout_lab.study.sheets import BOX, EDGE, Row

UNIT = DPI / 25.4
ROW = Row("A", 1, ("real", "made"), np.array([[20.0, 20, 25, 25], [50.0, 20, 55, 25]]))
CROSS = Mark(0.3, 0.8, 0.05)
TICK, EMPTY, TRACE, FULL = Mark(0.12, 0.8), Mark(0.0, 0.0), Mark(0.02, 0.3), Mark(0.95, 0.8, 0.9)


def page(drawn=(), moved=((0, 0), (0, 0)), ink=0.7):
    """A page with both boxes, each moved by some mm, and what is drawn in them, from −1 to 1 of each box."""
    fine = np.zeros((round(45 * UNIT), round(75 * UNIT)), dtype=np.float32)
    for box, (dx, dy) in zip(ROW.boxes, moved, strict=True):
        left, top = (round((at + d) * UNIT) for at, d in zip(box[:2], (dx, dy), strict=True))
        cv2.rectangle(fine, (left, top), (left + round(BOX * UNIT), top + round(BOX * UNIT)), 0.9, round(EDGE * UNIT))
    for number, way, width in drawn:
        middle = (ROW.boxes[number, :2] + ROW.boxes[number, 2:]) / 2 + moved[number]
        points = np.rint((middle + BOX / 2 * np.array(way)) * UNIT).astype(np.int32)
        cv2.polylines(fine, [points.reshape(-1, 1, 2)], False, ink, max(1, round(width * UNIT)))
    return cv2.GaussianBlur(fine, (0, 0), 0.8)


DIAGONALS = [[(-1, -1), (1, 1)], [(1, -1), (-1, 1)]]
HATCHED = [[(-0.95, y), (0.95, y)] for y in np.linspace(-0.95, 0.95, 12)]


@pytest.mark.parametrize("moved", [((0, 0), (0, 0)), ((1.2, -0.9), (0.8, -1.4))])
def test_crosses_are_told_wherever_the_paper_has_gone(moved):
    for width in (0.25, 0.5, 1.0):
        held = marks.read_row(page([(1, way, width) for way in DIAGONALS], moved), ROW)
        assert [mark.touched for mark in held] == [False, True]
        assert decided(held) == marks.Decision(1)


def test_a_thick_cross_is_no_filled_box_and_a_hatched_one_is():
    cross = marks.read_row(page([(0, way, 1.1) for way in DIAGONALS]), ROW)[0]
    hatched = marks.read_row(page([(0, way, 0.35) for way in HATCHED]), ROW)[0]
    assert cross.sides < 0.35 < 0.6 < hatched.sides and hatched.share > 0.7


def test_a_page_without_boxes_has_none():
    assert marks.read_row(np.zeros((400, 600), dtype=np.float32), ROW) is None


def test_depth_is_of_the_paper_around_in_the_colour_that_misses_most():
    sheet = np.full((300, 300, 3), (200, 190, 150), dtype=np.uint8)
    sheet[100:110, 100:200] = (200, 20, 15)
    depth = marks.depth_of(sheet)
    assert depth[105, 150] == pytest.approx(0.9, abs=0.02) and depth[250, 250] < 0.01


@pytest.mark.parametrize(
    ("row", "how", "box", "why"),
    [
        ((CROSS, EMPTY), Manner(), 0, ""),
        ((EMPTY, TICK), Manner(), 1, ""),
        ((EMPTY, EMPTY), Manner(), None, "no box"),
        ((TRACE, EMPTY), Manner(), None, "only a trace"),
        ((CROSS, TICK), Manner(), None, "2 boxes"),
        ((FULL, CROSS), Manner(0.3, 0.8), 1, "withdrawn"),
        ((FULL, EMPTY), Manner(0.3, 0.8), None, "filled in"),
        ((FULL, EMPTY), Manner(0.9, 0.8), 0, ""),  # who answers so
        ((FULL, FULL), Manner(0.9, 0.8), None, "2 boxes"),
        ((CROSS, Mark(0.3, 0.2)), Manner(0.3, 0.8), 0, "trace"),  # rubbed out
        ((Mark(0.3, 0.2), EMPTY), Manner(0.3, 0.8), None, "only a trace"),
        ((CROSS, Mark(0.05, 0.8)), Manner(), 0, "runs over"),
    ],
)
def test_the_answer_is_what_is_plain(row, how, box, why):
    decision = decided(row, how)
    assert decision.box == box and why in decision.why and bool(why) == bool(decision.why)


def test_how_somebody_marks_is_told_from_rows_with_one_mark():
    assert marks.manner([(FULL, EMPTY), (EMPTY, FULL), (FULL, CROSS)]) == Manner(0.95, 0.8)
    assert marks.manner([(EMPTY, EMPTY)]) == Manner()
