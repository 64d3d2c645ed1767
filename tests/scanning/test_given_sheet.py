"""Sheets to write on, as files hold them: photographed on a desk, as a PDF; and what is printed on them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from reportlab.pdfgen.canvas import Canvas
from sheets import kinds, on_a_desk, photographed, printed, scanned, sheet

from handout.errors import InputError
from handout.scanning.page_layout import read_sheet, sheet_file
from handout.scanning.printed_lines import find_print, find_printed_lines, free_area


def taken(path, rgb, **how):
    Image.fromarray(rgb).save(path, **how)
    return read_sheet(str(path))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_a_sheet_on_a_desk_is_cut_out_and_made_flat(tmp_path, seed):
    rng = np.random.default_rng(seed)
    how, rules, margin, _ = kinds()["college"]
    rgb, _ = on_a_desk(sheet(**how, dpi=110), rng, turn=rng.uniform(-8, 8))
    found = taken(tmp_path / "a.png", rgb)
    assert found.straightened and found.size is None
    lines = find_printed_lines(found.rgb, 148.0, 210.0)
    assert lines is not None and len(lines.rules) == len(rules)
    assert np.array([line.at for line in lines.rules]) == pytest.approx(rules, abs=0.8)
    assert max(abs(line.slope) for line in lines.rules) < 0.004 and lines.left == pytest.approx(margin, abs=0.7)
    assert not find_print(found.rgb, 148.0, 210.0, lines).any()


def test_a_picture_that_is_all_sheet_stays_as_it_is(tmp_path):
    made = photographed(sheet(np.arange(30, 200, 8.0), dpi=80), np.random.default_rng(1))
    found = taken(tmp_path / "a.png", made.rgb)
    assert not found.straightened and (found.rgb == made.rgb).all()
    found = taken(tmp_path / "b.png", made.rgb, dpi=(150, 150))
    assert found.size == pytest.approx([side / 150 * 25.4 for side in made.rgb.shape[1::-1]], rel=1e-3)


def test_a_page_of_a_pdf_is_a_sheet(tmp_path):
    canvas = Canvas(str(tmp_path / "a.pdf"), pagesize=(300, 400))
    canvas.drawString(50, 350, "a heading")
    canvas.showPage()
    canvas.setPageSize((200, 100))
    canvas.showPage()
    canvas.save()
    first, second = read_sheet(str(tmp_path / "a.pdf")), read_sheet(f"{tmp_path}/a.pdf:2")
    assert first.size == pytest.approx((300 / 72 * 25.4, 400 / 72 * 25.4), abs=0.1) and first.pages == 2
    assert second.size == pytest.approx((200 / 72 * 25.4, 100 / 72 * 25.4), abs=0.1) and second.name == "a.pdf:2"
    assert first.rgb.min() < 60 and second.rgb.min() == 255
    with pytest.raises(InputError, match="no such page"):
        read_sheet(f"{tmp_path}/a.pdf:3")
    assert sheet_file("a:b:2") is None and sheet_file(str(tmp_path / "b.pdf")) is None


HOLES = ((9.0, 65.0), (9.0, 145.0))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["squared", "seyes"])
def test_headings_and_holes_are_found_among_lines(kind):
    how, *_ = kinds()[kind]
    made = printed(sheet(**how, dpi=110), at=(60, 8, 40, 9), holes=HOLES)
    rng = np.random.default_rng(2)
    for picture in (scanned(made, rng, skew=0.3), photographed(made, rng, tilt=0.01)):
        lines = find_printed_lines(picture.rgb, *picture.size)
        cells = find_print(picture.rgb, *picture.size, lines)
        truth = np.zeros(cells.shape, dtype=bool)
        truth[5:20, 56:104] = True
        for x, y in HOLES:
            truth[round(y) - 7 : round(y) + 7, round(x) - 7 : round(x) + 7] = True
        assert not (cells & ~truth).any()
        assert cells[8:16, 61:98].mean() > 0.7
        assert all(cells[round(y) - 1 : round(y) + 1, round(x) - 1 : round(x) + 1].all() for x, y in HOLES)


def test_text_goes_beside_holes_and_under_a_heading():
    cells = np.zeros((210, 148), dtype=bool)
    assert free_area(cells, (15, 20, 133, 190)) == (15, 20, 133, 190)
    cells[62:68, 14:20] = cells[142:148, 14:20] = True
    assert free_area(cells, (15, 20, 133, 190)) == pytest.approx((23, 20, 133, 190))
    cells[10:30, 60:100] = True
    assert free_area(cells, (15, 20, 133, 190)) == pytest.approx((23, 32, 133, 190))
    assert free_area(np.ones_like(cells), (15, 20, 133, 190)) is None


@given(st.lists(st.tuples(st.integers(0, 39), st.integers(0, 29)), max_size=6))
def test_no_rectangle_has_more_room(places):
    cells = np.zeros((30, 40), dtype=bool)
    for x, y in places:
        cells[y, x] = True
    blocked = np.zeros((30, 40), dtype=int)
    for x, y in places:
        blocked[max(y - 2, 0) : y + 3, max(x - 3, 0) : x + 4] = 1
    total = np.pad(blocked.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    best = 0
    for top in range(30):
        for bottom in range(top + 1, 31):
            clear = (total[bottom, 1:] - total[bottom, :-1] - total[top, 1:] + total[top, :-1]) == 0
            runs = np.diff(np.flatnonzero(np.concatenate([[True], ~clear, [True]]))) - 1
            width = int(runs.max())
            if width * (bottom - top) > 0.2 * 1200:
                best = max(best, width**2 * (bottom - top))
    area = free_area(cells, (0, 0, 40, 30))
    assert best == (0 if area is None else (area[2] - area[0]) ** 2 * (area[3] - area[1]))
    if area is not None:
        left, top, right, bottom = (round(side) for side in area)
        assert not blocked[top:bottom, left:right].any()
