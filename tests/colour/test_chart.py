"""The chart: its colours, its places, its pixels."""

import hashlib
import itertools

import cv2
import numpy as np
import pytest

from handout.colour.chart import MARKS, chart, dictionary, letters, page_of_marks, whole
from handout.colour.chart_files import render
from handout.errors import DoesNotFit, InputError

EVERY = [("A4", 1), ("A4", 2), ("letter", 1), ("letter", 2)]


@pytest.mark.parametrize(("paper", "pages"), EVERY)
def test_all_colours_are_there(paper, pages):
    sent = {tuple(rgb) for rgb in np.rint(chart(paper, pages=pages).colours * 255).astype(int).tolist()}
    levels = [0, 36, 73, 109, 146, 182, 219, 255]
    assert sent == {*itertools.product(levels, repeat=3), *((grey,) * 3 for grey in range(256)), *repeats()}


def repeats():
    greys = [(level,) * 3 for level in (64, 128, 192)]
    return [*greys, *itertools.product((0, 255), repeat=3)]


@pytest.mark.parametrize(("paper", "pages"), EVERY)
def test_nothing_overlaps_and_marks_have_their_quiet_zone(paper, pages):
    for page in chart(paper, pages=pages).pages:
        cells = {tuple(cell) for cell in page.cells.tolist()}
        assert len(cells) == len(page.cells)
        for (x, y), corners in zip(page.mark_cells.tolist(), page.marks, strict=True):
            assert not cells & {(x + i, y + j) for i in (0, 1) for j in (0, 1)}
            module = (corners[1, 0] - corners[0, 0]) / 7
            place = np.array(page.origin) + np.array([x, y]) * page.pitch
            assert (corners[0] - place).tolist() == pytest.approx([module, module])
            assert (place + 2 * page.pitch - corners[2]).tolist() == pytest.approx([module, module])


@pytest.mark.parametrize(("paper", "pages"), EVERY)
def test_whites_are_spread_over_the_page(paper, pages):
    for page in chart(paper, pages=pages).pages:
        white = (page.device == 1).all(axis=1)
        part = (page.cells * 3 // [page.columns, page.rows])[white]
        counts = np.bincount(part[:, 0] * 3 + part[:, 1], minlength=9)
        assert counts.min() >= 2
        assert counts.max() <= 3 * counts.min() + 2


def test_order_is_shuffled():
    page = chart("A4").pages[0]
    light = page.device.mean(axis=1)
    for axis in (0, 1):
        assert abs(np.corrcoef(light, page.cells[:, axis])[0, 1]) < 0.1


def test_the_chart_of_a_version_never_changes():
    # printed charts lie on desks: a change of these bytes has to be a new version
    digests = {
        (paper, pages): hashlib.sha256(
            b"".join(
                np.rint(p.device * 255).astype(np.uint8).tobytes() + p.cells.astype("<i4").tobytes()
                + p.ids.astype("<i4").tobytes() + np.rint(p.boxes * 1000).astype("<i4").tobytes()
                for p in chart(paper, pages=pages).pages
            )
        ).hexdigest()[:16]
        for paper, pages in EVERY
    }  # fmt: skip
    assert digests == {
        ("A4", 1): "43e8e8e7c3dedcaa",
        ("A4", 2): "e3747d26c1d2fd01",
        ("letter", 1): "da2164edea7befa2",
        ("letter", 2): "7f453abb0cf0d883",
    }


def test_numbers_of_marks_say_which_page_it_is():
    numbers = set()
    for paper, pages in EVERY:
        made = chart(paper, pages=pages)
        assert made is chart(paper, pages=pages)
        for page in made.pages:
            assert len(page.ids) == MARKS
            for number in page.ids.tolist():
                assert page_of_marks(number) is page
                assert whole(page) is made
                numbers.add(number)
    assert len(numbers) == 6 * MARKS
    assert page_of_marks(999) is None


@pytest.mark.slow
@pytest.mark.parametrize("dpi", [300, 360, 600])
def test_pixels_are_the_colours_and_nothing_else(dpi):
    page = chart("A4").pages[0]
    pixels = render(page, dpi, ("Printer, paper", "2026-11-22"))
    assert pixels.shape == (round(297 / 25.4 * dpi), round(210 / 25.4 * dpi), 3)
    for (left, top, right, bottom), colour in zip(
        np.rint(page.boxes / 25.4 * dpi).astype(int), page.device, strict=True
    ):
        assert (pixels[top:bottom, left:right] == np.rint(colour * 255)).all()
    left, top, right, bottom = (np.array(page.bounds) / 25.4 * dpi).astype(int)
    outside = np.ones(pixels.shape[:2], dtype=bool)
    outside[top : bottom + 2, left : right + 2] = False
    assert (pixels[outside] == 255).all()


@pytest.mark.slow
def test_marks_are_what_any_reader_of_aruco_finds():
    page = chart("letter", pages=2).pages[1]
    grey = cv2.cvtColor(render(page, 300), cv2.COLOR_RGB2GRAY)
    small = cv2.resize(grey, None, fx=0.4, fy=0.4, interpolation=cv2.INTER_AREA)
    corners, numbers, _ = cv2.aruco.ArucoDetector(dictionary()).detectMarkers(small)
    assert sorted(numbers.ravel().tolist()) == page.ids.tolist()
    for number, found in zip(numbers.ravel().tolist(), corners, strict=True):
        at = (found.reshape(4, 2) + 0.5) / 0.4 / 300 * 25.4
        assert np.abs(at - page.marks[page.ids.tolist().index(number)]).max() < 0.4


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: chart("A5"), "A4 and letter, not for 'A5'"),
        (lambda: chart("A4", pages=3), "1 or 2 pages, not 3"),
        (lambda: render(chart().pages[0], 150), "150 dpi is outside 300 to 2400"),
        (lambda: render(chart().pages[0], 300, ("a", "b", "c")), "room for 2"),
        (lambda: render(chart().pages[0], 300, ("日本",)), "Western letters"),
        (lambda: render(chart().pages[0], 300, ("x" * 500,)), "too long for its line; use at most"),
    ],
)
def test_what_cannot_be_is_said(wrong, said):
    with pytest.raises(InputError, match=said):
        wrong()


def test_what_does_not_fit_is_refused():
    assert len(chart("A4", margins=(3, 3, 3, 3)).pages) == 1
    assert len(chart("A4", margins=(12, 12, 12, 12)).pages) == 2
    with pytest.raises(DoesNotFit, match=r"keeps 21.0 mm from the top of A4"):
        chart("A4", margins=(40, 3, 3, 3))


def test_columns_are_named_as_in_a_spreadsheet():
    assert [letters(i) for i in (0, 25, 26, 27)] == ["A", "Z", "AA", "AB"]
