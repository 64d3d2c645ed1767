"""Sheets found again in scans, against the truth of how they were laid."""

import cv2
import numpy as np
import pytest
import scans

from handout.errors import InputError
from handout.prompting import sheet_codes, sheet_detection, sheet_layout
from handout.prompting.sheet_detection import find_sheet, rectify
from handout.prompting.sheet_layout import MARK_CORNERS, PAPERS, mark_corners

A4 = PAPERS[0]
GRID = np.stack(np.meshgrid(np.linspace(12, 198, 7), np.linspace(12, 280, 9)), axis=-1).reshape(-1, 2)


def turn(sheet):
    """rad from the picture's x axis to the page's, towards y, in the middle of the page."""
    middle = np.array([sheet.page.width / 2, sheet.page.height / 2])
    left, right = sheet.registration.pixels(middle + np.array([(-0.5, 0), (0.5, 0)]))
    return np.arctan2(*(right - left)[::-1])


def error(truth, found):
    """mm by which points of the page are off."""
    return np.linalg.norm(found.mm(scans.carried(truth, GRID)) - GRID, axis=1).max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("dpi", "laid", "worst"),
    [
        (150, {"angle": -5, "blur": 0.6}, 0.06),
        (150, {"angle": 92, "noise": 10, "shadow": 0.4}, 0.1),
        (200, {"angle": 3, "perspective": 0.15, "shadow": 0.3, "noise": 8}, 0.06),
        (300, {"angle": 181, "blur": 0.8, "noise": 8}, 0.05),
        (300, {"angle": 4.5, "stretch": 1.004}, 0.05),
        (600, {"angle": -90.4}, 0.05),
    ],
)
def test_sheets_are_found_however_they_lie(drawn, prompt, dpi, laid, worst):
    image, truth = scans.scanned(drawn, dpi, **laid)
    sheet = find_sheet(image)
    assert sheet.record.lines == prompt.pages[1]
    assert (sheet.record.number, sheet.record.pages, sheet.record.pitch) == (2, 2, 10.0)
    assert sheet.registration.marks == (0, 1, 2, 3)
    assert error(truth, sheet.registration) < worst
    if "perspective" not in laid:
        assert sheet.dpi == pytest.approx(dpi * laid.get("stretch", 1.0) ** 0.5, rel=2e-3)
        assert np.exp(1j * turn(sheet)) == pytest.approx(np.exp(1j * np.deg2rad(laid["angle"])), abs=4e-3)


def covered(image, truth, corners):
    """The scan with a piece of paper over some of the marks."""
    image = image.copy()
    for corner in corners:
        square = scans.carried(truth, mark_corners(A4)[corner])
        cv2.fillConvexPoly(image, np.rint(square).astype(np.int32), 240)
    return image


@pytest.mark.slow
@pytest.mark.parametrize("missing", [(0,), (2,), (0, 2), (1, 3)])
def test_two_opposite_marks_suffice_on_a_scanner(drawn, missing):
    image, truth = scans.scanned(drawn, 200, angle=-3)
    sheet = find_sheet(covered(image, truth, missing))
    assert sheet.registration.marks == tuple(sorted({0, 1, 2, 3} - set(missing)))
    assert error(truth, sheet.registration) < 0.1


@pytest.mark.parametrize(
    ("missing", "seen"), [((0, 1), "bottom right and bottom left"), ((0, 1, 2), "the bottom left")]
)
def test_too_few_marks_are_refused(drawn, missing, seen):
    image, truth = scans.scanned(drawn, 150)
    with pytest.raises(InputError, match=f"{seen} of the sheet"):
        find_sheet(covered(image, truth, missing))


@pytest.mark.slow
@pytest.mark.parametrize(("missing", "perspective"), [((3,), 0.2), ((1,), 0.03), ((0, 2), 0.03)])
def test_a_photograph_with_marks_missing_is_refused_and_not_guessed_at(drawn, missing, perspective):
    image, truth = scans.scanned(drawn, 200, perspective=perspective)
    with pytest.raises(InputError, match=f"mark at the {MARK_CORNERS[missing[0]]}.* cannot be seen"):
        find_sheet(covered(image, truth, missing))


def test_a_crumpled_sheet_is_refused(drawn):
    image, _ = scans.scanned(drawn, 100)
    crumpled = image.copy()
    patch = np.ascontiguousarray(image[20:120, 20:120])  # one mark with the paper around it, turned by 12 degrees
    turned = cv2.getRotationMatrix2D((50.0, 50.0), 12, 1)
    crumpled[20:120, 20:120] = cv2.warpAffine(patch, turned, (100, 100), borderMode=cv2.BORDER_REPLICATE)
    with pytest.raises(InputError, match="crumpled or bent"):
        find_sheet(crumpled)


def test_a_picture_without_a_sheet_is_none():
    rng = np.random.default_rng(1)
    assert find_sheet(rng.integers(0, 255, (400, 300), dtype=np.uint8)) is None
    assert find_sheet(np.full((50, 70, 3), 255, np.uint8)) is None
    assert find_sheet(np.full((1, 1), 255, np.uint8)) is None


@pytest.mark.parametrize("image", [np.zeros((4, 4)), np.zeros((4, 4, 4), np.uint8), np.zeros((0, 4), np.uint8)])
def test_what_is_no_picture_is_refused(image):
    with pytest.raises(InputError, match="of uint8"):
        find_sheet(image)


@pytest.mark.slow
def test_one_spoilt_code_is_made_up_for_and_two_are_not(drawn, prompt):
    image, truth = scans.scanned(drawn, 200, angle=1)
    boxes = sheet_detection.SheetLayout(A4).codes
    spoilt = image.copy()
    for count, box in enumerate(boxes[1:3]):
        corners = np.array([(box[0], box[1]), (box[2], box[1]), (box[2], box[3]), (box[0], box[3])])
        cv2.fillConvexPoly(spoilt, np.rint(scans.carried(truth, corners)).astype(np.int32), 90)
        if count == 0:
            assert find_sheet(spoilt).record.lines == prompt.pages[1]
    with pytest.raises(InputError, match=r"Only 4 of the 6 codes .*sharp.* 200 dpi or more \(this has 200\)"):
        find_sheet(spoilt)


@pytest.mark.slow
def test_codes_are_read_where_the_paper_has_moved(drawn):
    """A sheet that is not flat: codes lie off by most of a module, more than a plane explains."""
    image, _ = scans.scanned(drawn, 200)
    found = sheet_layout.register(image)
    boxes = sheet_detection.SheetLayout(A4).codes
    moved = boxes + np.array([0.35, -0.3, 0.35, -0.3])
    assert len(sheet_codes.read_codes(image, found, moved)) == 6
    assert sheet_codes.read_codes(image, found, boxes - 40.0) == []


def test_two_sheets_in_one_scan_are_refused(drawn):
    image, _ = scans.scanned(drawn, 100)
    with pytest.raises(InputError, match="more than one sheet"):
        find_sheet(np.hstack([image, image]))


@pytest.mark.slow
@pytest.mark.parametrize("colours", [1, 3])
def test_a_rectified_page_is_upright_and_in_its_place(drawn, colours):
    image, _ = scans.scanned(drawn, 240, angle=187)
    image = image if colours == 1 else np.repeat(image[..., None], 3, axis=2)
    sheet = find_sheet(image)
    upright = rectify(image, sheet, 200)
    assert upright.shape == ((2339, 1654) if colours == 1 else (2339, 1654, 3))
    grey = sheet_layout.in_grey(upright)
    again = find_sheet(upright)
    assert again.dpi == pytest.approx(200, rel=1e-4) and abs(turn(again)) < 1e-4
    truth = np.array([[200 / 25.4, 0, -0.5], [0, 200 / 25.4, -0.5], [0, 0, 1]])
    assert error(truth, again.registration) < 0.05
    # each ruled line is darkest at its height, and nothing is dark elsewhere but what is to be masked
    column = grey[:, 600:1000].mean(axis=1)
    for y in sheet.layout.baselines[: len(sheet.record.lines)]:
        row = y * 200 / 25.4 - 0.5
        near = np.arange(int(row) - 10, int(row) + 12)
        assert abs(near[np.argmin(column[near])] - row) < 1.0
    dark = grey < 150
    assert dark[sheet_detection.printed_on(sheet, 200)].sum() > 10_000
    assert dark[~sheet_detection.printed_on(sheet, 200)].sum() == 0
    assert rectify(image, sheet).shape[0] == round(297 / 25.4 * sheet.dpi)
    with pytest.raises(InputError, match="outside 36 to 2400"):
        rectify(image, sheet, 10)


@pytest.mark.slow
def test_letter_paper_is_told_by_its_marks(prompt):
    from handout.prompting import sheet_pdf
    from handout.prompting.prompt_pages import Prompt
    from handout.prompting.sheet_layout import SheetLayout

    layout = SheetLayout(PAPERS[1], 12.0, printed=False)
    short = Prompt((prompt.pages[0][: layout.lines],), ())
    image, _ = scans.scanned(scans.drawn(sheet_pdf.to_pdf(short, layout), 0), 150, angle=2)
    sheet = find_sheet(image)
    assert sheet.page.name == "letter" and not sheet.record.printed
    assert sheet.record.lines == short.pages[0] and len(sheet.record.lines) == layout.lines
    np.testing.assert_allclose(sheet.layout.baselines, layout.baselines)
    assert sheet.bands.shape == (0, 4)
