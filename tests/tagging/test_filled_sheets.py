"""Filled prompt sheets: what is printed goes, what is written stays."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from handout.errors import InputError
from handout.prompting import sheet_detection
from handout.scanning.scan import Scan
from handout.tagging.page_sources import filled_sheet, refuse_shown_twice
from handout.values import Page

DPI, PAPER = 300.0, np.array([242, 240, 235])
WORDS, LINES, INK, BLACK = (245, 150, 90), (245, 195, 140), (50, 50, 130), (20, 20, 20)


def drawn(*, words=True, ink=True):
    image = np.full((472, 709, 3), PAPER, np.uint8)
    if words:
        cv2.putText(image, "printed words", (80, 150), cv2.FONT_HERSHEY_SIMPLEX, 1.2, WORDS, 4, cv2.LINE_AA)
        cv2.line(image, (60, 260), (650, 260), LINES, 3, cv2.LINE_AA)
    if ink:
        cv2.putText(image, "kept by me", (80, 255), cv2.FONT_HERSHEY_SCRIPT_SIMPLEX, 2.4, INK, 5, cv2.LINE_AA)
        cv2.line(image, (300, 80), (280, 300), INK, 5, cv2.LINE_AA)
    cv2.rectangle(image, (20, 20), (60, 60), BLACK, -1)
    return image


@pytest.fixture
def sheet(monkeypatch):
    """A sheet that lies straight and needs no finding."""
    found = SimpleNamespace(
        dpi=299.9, page=Page(60.0, 40.0), masks=np.array([[1.0, 1.0, 6.0, 6.0]]),
        bands=np.array([[5.0, 9.0, 55.0, 14.0], [5.0, 32.0, 55.0, 37.0]]),
        record=SimpleNamespace(lines=("kept by me", "lost words")),
        fields=np.array([[5.0, 18.0, 55.0, 21.5], [5.0, 28.0, 55.0, 31.5]]),
    )  # fmt: skip
    monkeypatch.setattr(sheet_detection, "find_sheet", lambda image: found)
    monkeypatch.setattr(sheet_detection, "rectify", lambda image, sheet, dpi: image.copy())
    return found


def test_print_goes_and_ink_stays(sheet):
    both = drawn()
    grain = np.random.default_rng(0).normal(0, 2, both.shape)
    filled = filled_sheet(Scan(np.clip(both + grain, 0, 255).astype(np.uint8), DPI, "sheet.png"))
    assert filled.transcript == "kept by me"
    assert filled.notes == (
        "sheet.png: nothing is written on line 2 (“lost words”) of the sheet; left out of its text.",
    )
    assert filled.scan.dpi == 300 and filled.scan.source == "sheet.png"
    bare = filled.scan.rgb.astype(float)
    want = drawn(words=False).astype(float)
    want[15:66, 15:66] = PAPER
    off = np.abs(cv2.GaussianBlur(bare - want, (0, 0), 1)).max(axis=2)
    # where ink crosses print its colour is a mixture; nowhere else does it differ from ink on bare paper
    crossing = np.abs(drawn().astype(float) - drawn(ink=False)).max(axis=2) > 20
    crossing = cv2.dilate(crossing.astype(np.uint8), np.ones((7, 7))) > 0
    assert off[~crossing].max() < 12
    assert np.median(off[crossing]) < 6
    dark = want[:, :, 0] < 90
    assert (bare[:, :, 0][dark] < 130).mean() > 0.99, "no stroke is broken"


def test_ink_over_print_has_the_colour_of_the_pen_in_a_shadow_too(sheet):
    printed, written, bare = drawn(ink=False) / 255, drawn(words=False) / 255, drawn(words=False, ink=False) / 255
    shadow = np.linspace(1.0, 0.55, 709)[None, :, None]
    both = shadow * printed * written / bare
    filled = filled_sheet(Scan(np.rint(255 * both).astype(np.uint8), DPI, "sheet.png"))
    ink = np.abs(drawn() - drawn(ink=False).astype(float)).max(axis=2) > 150
    over = ink & (np.abs(drawn(ink=False) - drawn(words=False, ink=False).astype(float)).max(axis=2) > 60)
    of_paper = (filled.scan.rgb / (255 * bare * shadow))[80:]
    over, ink = over[80:], ink[80:]
    assert over.sum() > 100
    colour = np.median(of_paper[ink & ~over], axis=0)
    assert np.abs(of_paper[over] - colour).max(axis=1).mean() < 0.06
    gone = ~(cv2.dilate(ink.astype(np.uint8), np.ones((7, 7))) > 0)
    assert np.abs(of_paper[gone] - 1).max() < 0.08, "no print is left"


def test_a_plain_sheet_keeps_all_colours(sheet):
    sheet.bands = np.zeros((0, 4))
    image = drawn()
    filled = filled_sheet(Scan(image, DPI, "sheet.png"))
    assert np.array_equal(filled.scan.rgb[80:], image[80:]) and filled.scan.rgb[:66, :66].min() > 200


def test_another_scan_is_no_sheet():
    assert filled_sheet(Scan(drawn(), DPI, "page.png")) is None


def test_two_pictures_of_one_sheet_are_refused_and_a_sheet_written_twice_is_not(sheet):
    again = np.clip(drawn() * 0.8 + np.random.default_rng(1).normal(0, 4, drawn().shape), 0, 255).astype(np.uint8)
    other = drawn()
    other[100:300] = np.roll(drawn(), 40, axis=1)[100:300]
    one, two, anew = (
        filled_sheet(Scan(image, DPI, name)) for image, name in ((drawn(), "a.jpg"), (again, "b.jpg"), (other, "c.jpg"))
    )
    refuse_shown_twice([one, anew])
    with pytest.raises(InputError, match=r"b\.jpg shows the same sheet as a\.jpg"):
        refuse_shown_twice([one, anew, two])


def test_pale_strokes_out_of_focus_stay_whole_where_they_cross_a_rule(sheet):
    printed, written, bare = drawn(ink=False) / 255, drawn(words=False) / 255, drawn(words=False, ink=False) / 255
    pale = bare * (written / bare) ** 0.3
    both, want = (cv2.GaussianBlur(layer, (0, 0), 2.5) for layer in (printed * pale / bare, pale))
    filled = filled_sheet(Scan(np.rint(255 * both).astype(np.uint8), DPI, "sheet.png"))
    taken, wanted = (1 - red / red.max() for red in (filled.scan.rgb[245:275, :, 0] / 255, want[245:275, :, 0]))
    inked = wanted > 0.1
    assert inked.sum() > 500
    assert (taken[inked] > 0.6 * wanted[inked]).mean() > 0.97


def test_a_red_pen_is_refused(sheet):
    red = drawn()
    red[np.all(red == INK, axis=2)] = (215, 40, 50)
    with pytest.raises(InputError, match=r"sheet\.png: its writing has the colour of the print.*--plain"):
        filled_sheet(Scan(red, DPI, "sheet.png"))


def test_a_blank_sheet_is_refused(sheet):
    with pytest.raises(InputError, match="nothing is written on the sheet"):
        filled_sheet(Scan(drawn(ink=False), DPI, "sheet.png"))


def test_print_without_colour_is_refused(sheet):
    both = drawn()
    cv2.putText(both, "printed words", (80, 425), cv2.FONT_HERSHEY_SIMPLEX, 1.2, WORDS, 4, cv2.LINE_AA)
    assert filled_sheet(Scan(both, DPI, "sheet.png")) is not None
    crossed = both.copy()  # by tall loops
    for x in range(80, 360, 20):
        cv2.line(crossed, (x, 395), (x + 6, 430), tuple(map(int, INK)), 4, cv2.LINE_AA)
    assert filled_sheet(Scan(crossed, DPI, "sheet.png")) is not None
    grey = np.repeat(cv2.cvtColor(both, cv2.COLOR_RGB2GRAY)[:, :, None], 3, axis=2)
    with pytest.raises(InputError, match=r"sheet\.png: its printed words are not orange.*in colour.*--plain"):
        filled_sheet(Scan(grey, DPI, "sheet.png"))
