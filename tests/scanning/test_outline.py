import cv2
import numpy as np
import pytest
import scribbles

from handout.errors import InputError
from handout.scanning.page_layout import flat_sheet, outline
from handout.scanning.scan import FilePicture

SHEET = np.float32([[0, 0], [1, 0], [1, 1], [0, 1]])


def laid(corners, ground=80):
    """A written sheet with its corners (4, 2) at these places of a picture of 700 × 900."""
    sheet = np.ascontiguousarray(scribbles.page(5).rgb)
    high, wide = sheet.shape[:2]
    matrix = cv2.getPerspectiveTransform(SHEET * np.float32([wide, high]), np.float32(corners))
    picture = cv2.warpPerspective(sheet, matrix, (900, 700), flags=cv2.INTER_AREA, borderValue=(ground,) * 3)
    return FilePicture(picture, 200.0, "photo.jpg")


def test_a_photograph_at_an_angle_is_made_flat():
    """What is seen of the sheet is the sheet alone, every place of it where it was written."""
    corners = np.array([[180, 90], [720, 90], [820, 600], [80, 600]])
    sheet = scribbles.page(5).rgb
    flat = flat_sheet(laid(corners)).rgb
    high, wide = flat.shape[:2]
    expected = cv2.resize(sheet, (wide, high), interpolation=cv2.INTER_AREA)
    for shown, true in ((flat, expected), (flat[: high // 3], expected[: high // 3])):
        dark = [255.0 - cv2.GaussianBlur(picture.min(axis=2), (0, 0), 3) for picture in (shown, true)]
        assert np.corrcoef(dark[0][9:-9, 9:-9].ravel(), dark[1][9:-9, 9:-9].ravel())[0, 1] > 0.9


@pytest.mark.parametrize("ground", [30, 90, 150])
def test_a_sheet_that_lies_askew_is_no_photograph(ground):
    turn = cv2.getRotationMatrix2D((450, 350), 6, 1.0)
    square = np.array([[130, 80], [770, 80], [770, 620], [130, 620]]) @ turn[:, :2].T + turn[:, 2]
    scan = laid(square, ground)
    assert all(side is not None for side in outline(scan.rgb))
    assert flat_sheet(scan) is scan


def test_a_sheet_that_fills_the_scan_has_no_outline():
    assert outline(scribbles.page(5).rgb) == [None] * 4
    for picture in (
        laid([[0, 0], [899, 0], [899, 699], [0, 699]]),
        FilePicture(np.full((400, 300, 3), 250, np.uint8), 300.0, "white.png"),
    ):
        assert flat_sheet(picture) is picture


def test_a_sheet_at_an_angle_that_an_edge_of_the_picture_cuts_is_refused():
    with pytest.raises(InputError, match=r"photo\.jpg was photographed at an angle.*\(at most 2°\).*all its edges in"):
        flat_sheet(laid([[220, -40], [690, -40], [830, 600], [80, 600]]))


def test_a_shadow_is_no_edge():
    scan = laid([[100, 60], [800, 60], [800, 640], [100, 640]])
    across = np.linspace(-0.4, 1, 900)[None, :, None] + np.linspace(-0.3, 0.5, 700)[:, None, None]
    dark = scan.rgb * (1 - 0.6 * np.clip(across, 0, 1))
    shadowed = FilePicture(dark.astype(np.uint8), 200.0, "shadow.jpg")
    assert flat_sheet(shadowed) is shadowed


def test_a_shadow_over_the_edge_takes_nothing_of_the_sheet():
    corners = np.array([[180, 90], [720, 90], [820, 600], [80, 600]])
    photo = laid(corners, ground=110)
    arm = np.zeros(photo.rgb.shape[:2], np.float32)
    cv2.line(arm, (450, 380), (860, 360), 1.0, 110)
    dark = photo.rgb * (1 - 0.5 * cv2.GaussianBlur(arm, (0, 0), 12))[:, :, None]
    sides = outline(dark.astype(np.uint8))
    assert all(side is not None for side in sides)
    upper_right = corners[1]
    point, direction = sides[1]
    away = np.array([-direction[1], direction[0]]) @ (upper_right - point)
    assert abs(away) < 3


def test_a_sheet_made_flat_has_its_own_proportions():
    """A4 that leans by 15° away from a camera whose picture is as long as the camera is far."""
    lean, corners = np.radians(15), np.array([[-105, -148.5], [105, -148.5], [105, 148.5], [-105, 148.5]])
    x, y, z = corners[:, 0], corners[:, 1] * np.cos(lean), 420 - corners[:, 1] * np.sin(lean)
    seen = np.column_stack([x, y]) / z[:, None] * 900 + (450, 350)
    high, wide = flat_sheet(laid(seen)).rgb.shape[:2]
    assert high / wide == pytest.approx(297 / 210, rel=0.01)
