import cv2
import numpy as np
import pytest
import scribbles

from handout.errors import InputError
from handout.scanning.page_layout import outline, refuse_oblique
from handout.scanning.scan import Scan

SHEET = np.float32([[0, 0], [1, 0], [1, 1], [0, 1]])


def laid(corners, ground=80):
    """A written sheet with its corners (4, 2) at these places of a picture of 700 × 900."""
    sheet = np.ascontiguousarray(scribbles.page(5).rgb)
    high, wide = sheet.shape[:2]
    matrix = cv2.getPerspectiveTransform(SHEET * np.float32([wide, high]), np.float32(corners))
    picture = cv2.warpPerspective(sheet, matrix, (900, 700), flags=cv2.INTER_AREA, borderValue=(ground,) * 3)
    return Scan(picture, 200.0, "photo.jpg")


def test_a_photograph_at_an_angle_is_refused():
    with pytest.raises(
        InputError, match=r"photo\.jpg was photographed at an angle.*\d\.\d° apart \(at most 2°\).*hand prompt"
    ):
        refuse_oblique(laid([[180, 90], [720, 90], [820, 600], [80, 600]]))


@pytest.mark.parametrize("ground", [30, 90, 150])
def test_a_sheet_that_lies_askew_is_no_photograph(ground):
    turn = cv2.getRotationMatrix2D((450, 350), 6, 1.0)
    square = np.array([[130, 80], [770, 80], [770, 620], [130, 620]]) @ turn[:, :2].T + turn[:, 2]
    scan = laid(square, ground)
    assert all(side is not None for side in outline(scan.rgb))
    refuse_oblique(scan)


def test_a_sheet_that_fills_the_scan_has_no_outline():
    assert outline(scribbles.page(5).rgb) == [None] * 4
    refuse_oblique(laid([[0, 0], [899, 0], [899, 699], [0, 699]]))
    refuse_oblique(Scan(np.full((400, 300, 3), 250, np.uint8), 300.0))


def test_a_sheet_cut_by_one_edge_of_the_picture_is_still_seen():
    with pytest.raises(InputError, match="at an angle"):
        refuse_oblique(laid([[220, -40], [690, -40], [830, 600], [80, 600]]))


def test_a_shadow_is_no_edge():
    scan = laid([[100, 60], [800, 60], [800, 640], [100, 640]])
    across = np.linspace(-0.4, 1, 900)[None, :, None] + np.linspace(-0.3, 0.5, 700)[:, None, None]
    dark = scan.rgb * (1 - 0.6 * np.clip(across, 0, 1))
    refuse_oblique(Scan(dark.astype(np.uint8), 200.0))
