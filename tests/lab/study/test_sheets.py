"""Sheets say whose they are, and can be read as they lie."""

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handout.errors import InputError
from handout.prompting.sheet_layout import PAPERS, mark_corners
from handout.scanning.pdf_pages import drawn_page
from handout_lab.study import answers, sheets
from handout_lab.study.answers import Answer
from handout_lab.study.design import Item, Person
from handout_lab.study.marks import Mark
from handout_lab.study.sheets import KINDS, SheetRecord
from handout_lab.study.snippets import Picture

STUDY = "0123456789ab"
WHO = Person(
    tuple(Item(k, "real") for k in range(10)),
    tuple(Item(k, "left") for k in range(10, 20)),
    tuple(Item(k, "made") for k in range(15)),
)


@given(st.integers(1, 9999), st.integers(1, 9), st.sampled_from(KINDS), st.integers(1, 60), st.integers(1, 30))
def test_codes_come_back(person, page, kind, first, count):
    record = SheetRecord(STUDY, person, page, 9, kind, first, count)
    data = record.packed()
    assert sheets.unpacked(data) == record
    assert sheets.unpacked(data[:-1] + bytes([data[-1] ^ 1])) is None


@pytest.mark.parametrize("page", PAPERS)
def test_all_rows_are_on_the_sheets_and_nothing_lies_over_marks(page):
    records = sheets.records(page, STUDY, 1, WHO, about=True)
    asked = [(record.kind, row.number) for record in records[1:] for row in sheets.rows(page, record)]
    assert asked == [(kind, k) for kind, count in (("A", 10), ("B", 10), ("E", 15)) for k in range(1, count + 1)]
    taken = [*sheets.codes(page), *(np.concatenate([c.min(axis=0), c.max(axis=0)]) for c in mark_corners(page))]
    for record in records:
        for box in np.concatenate([row.boxes for row in sheets.rows(page, record)]):
            assert (box[:2] > 10).all() and box[2] < page.width - 10
            assert all((box[2:] < t[:2] - 1).any() or (box[:2] > t[2:] + 1).any() for t in taken)


@pytest.fixture(scope="module")
def printed():
    """The pages of A and of B of a person, at 150 dpi, with where their rows are."""
    picture = Picture(np.full((60, 300, 3), 90, dtype=np.uint8), 40.0, 300.0)
    show = sheets.Show({(k, kind): (picture, 1.0) for k in range(20) for kind in ("real", "made")}, {0: (picture, 1.0)},
                       "Títle")  # fmt: skip
    records = sheets.records(PAPERS[0], STUDY, 12, WHO, about=False)
    chosen = [record for record in records if record.kind in "AB"][:2]
    pdf = sheets.to_pdf(PAPERS[0], [(record, WHO) for record in chosen], show)
    assert pdf == sheets.to_pdf(PAPERS[0], [(record, WHO) for record in chosen], show)
    return [(record, drawn_page(Path("s.pdf"), k, 150.0, pdf)) for k, record in enumerate(chosen, 1)]


def crossed(printed, marked):
    """A page with a cross in each box of `marked`: (row, box), both from 0."""
    record, picture = printed
    picture = picture.copy()
    rows = sheets.rows(PAPERS[0], record)
    for row, box in marked:
        left, top, right, bottom = np.rint(rows[row].boxes[box] * 150 / 25.4).astype(int).tolist()
        cv2.line(picture, (left, top), (right, bottom), (60, 60, 160), 2)
        cv2.line(picture, (left, bottom), (right, top), (60, 60, 160), 2)
    return picture


def test_filled_sheets_are_read_any_way_round(printed):
    a, b = printed
    upside = np.ascontiguousarray(np.rot90(crossed(a, [(k, k % 2) for k in range(9)]), 2))
    crooked = cv2.warpAffine(crossed(b, [(0, 1), (1, 0), (1, 1)]), cv2.getRotationMatrix2D((600, 800), 4, 0.9),
                             (1240, 1754), borderValue=(190, 190, 190))  # fmt: skip
    read = [answers.read_sheet(upside, "a.png"), answers.read_sheet(crooked, "b.png")]
    assert [sheet.record for sheet in read] == [a[0], b[0]]
    found, pictures = answers.answers([*read, read[0]])  # one of them was scanned twice
    said = {answer.place: answer for answer in found}
    assert [said[12, "A", str(k + 1)].answer for k in range(9)] == ["real", "made"] * 4 + ["real"]
    assert said[12, "B", "1"].answer == "right"
    doubts = {place: said[place].why for place in pictures}
    assert doubts == {
        (12, "A", "10"): "no box is marked",
        (12, "B", "2"): "2 boxes are marked",
        **{(12, "B", str(k)): "no box is marked" for k in range(3, b[0].count + 1)},
    }
    assert answers.repeated(read) == {} and answers.repeated([*read, read[0]]) == {(12, a[0].page): ["a.png"] * 2}
    assert answers.missing(read) == {12: [1, *range(4, a[0].pages + 1)]}


@pytest.mark.parametrize("scans", [(0, 1), (0, 1, 0), (1, 0, 0, 1)])
def test_sheets_scanned_several_times_are_doubtful_where_they_differ(scans):
    record = SheetRecord(STUDY, 12, 2, 5, "A", 1, 3)

    def scan(*boxes):
        held = [tuple(Mark(0.2 * (box == k)) for k in (0, 1)) for box in boxes]
        rows = zip(sheets.rows(PAPERS[0], record), held, strict=True)
        return answers.ReadSheet("a", record, tuple(answers.ReadRow(row, m, np.zeros(1, np.uint8)) for row, m in rows))

    read = [scan(0, None, None), scan(1, 1, None)]
    found, pictures = answers.answers([read[k] for k in scans])
    said = {answer.item: answer for answer in found}
    assert len(found) == 3 and said["1"].why == f"scanned {len(scans)} times: made, and real"
    assert (said["1"].answer, said["2"].answer, said["2"].state) == ("", "made", "plain")
    assert set(pictures) == {answer.place for answer in found if answer.state == "doubtful"}


def test_what_is_no_sheet_of_a_study_is_said(printed):
    with pytest.raises(InputError, match=r"x\.png: no sheet of a study"):
        answers.read_sheet(np.full((800, 600, 3), 240, dtype=np.uint8), "x.png")
    blank = printed[0][1].copy()
    for left, top, right, bottom in np.rint(sheets.codes(PAPERS[0]) * 150 / 25.4).astype(int).tolist():
        blank[top:bottom, left:right] = 255
    with pytest.raises(InputError, match="neither code"):
        answers.read_sheet(blank, "x.png")


def test_the_table_comes_back_with_what_a_person_wrote_into_it(tmp_path):
    rows = [Answer(STUDY, 1, "A", "1", "made"), Answer(STUDY, 1, "B", "2", "", "doubtful", "2 boxes", "x/1.png"),
            Answer(STUDY, 1, "P", "age", "20 to 39")]  # fmt: skip
    path = tmp_path / "answers.csv"
    path.write_bytes(answers.to_csv(rows))
    assert answers.from_csv(path) == rows
    path.write_text(path.read_text().replace("B,2,,", "B,2,LEFT,").replace("A,1,made", "A,1,fake"))
    assert [row.answer for row in answers.from_csv(path)] == ["made", "left", "20 to 39"]
    path.write_text(path.read_text().replace("LEFT", "upper"))
    with pytest.raises(InputError, match="line 3: 'upper' is not one of left, right"):
        answers.from_csv(path)
    path.write_text("name\nx\n")
    with pytest.raises(InputError, match="lacks the columns"):
        answers.from_csv(path)
    path.write_bytes(b"\x97")
    with pytest.raises(InputError, match="no table in UTF-8"):
        answers.from_csv(path)


@pytest.mark.parametrize("parted_by", [",", ";", "\t"])
@pytest.mark.parametrize("quoting", [csv.QUOTE_MINIMAL, csv.QUOTE_ALL])
def test_a_table_from_a_spreadsheet_is_read_and_no_answer_counts_twice(tmp_path, parted_by, quoting):
    rows = [Answer(STUDY, 1, "P", "consent", "yes"), Answer(STUDY, 1, "A", "1", "made"), Answer(STUDY, 1, "A", "2", "")]
    table = list(csv.reader(answers.to_csv(rows).decode().splitlines()))
    decided = [*table[3][:4], "real", "doubtful", "2 boxes", ""]
    path = tmp_path / "answers.csv"

    def saved(*lines):
        with path.open("w", newline="", encoding="utf-8-sig") as file:
            csv.writer(file, delimiter=parted_by, quoting=quoting).writerows(lines)
        return answers.from_csv(path)

    found = saved(*table, [""] * 8, table[2], decided)
    assert [(row.item, row.answer) for row in found] == [("consent", "yes"), ("1", "made"), ("2", "real")]
    with pytest.raises(InputError, match="line 5: person 1 answers A 1 twice, made and real"):
        saved(*table, [*table[2][:4], "real", "plain", "", ""])
    for wrong in (["study-s", "1", "X", "consent", "yes"], ["study-s", "\u00b2", "A", "1", "made"]):
        with pytest.raises(InputError, match="no answer of a study"):
            saved(*table, [*wrong, "", "", ""])


def test_writing_that_is_too_large_is_shown_smaller_as_far_as_that_goes():
    def picture(high, wide):
        return Picture(np.zeros((high, wide, 3), dtype=np.uint8), high * 0.6, 300.0)

    assert sheets.scale_of([picture(100, 700)] * 20) == 1
    scale = sheets.scale_of([picture(260, 700)] * 20)
    assert 0.5 < scale < 0.8 and sheets.fits(picture(260, 700), scale) and not sheets.fits(picture(300, 700), scale)
    with pytest.raises(InputError, match="so large"):
        sheets.scale_of([picture(900, 700)] * 20)
