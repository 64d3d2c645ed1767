"""From the marks at a sheet's corners to where every millimetre of it lies in a picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout import markers
from handout.errors import InputError
from handout.prompting.sheet_layout import MARK_CELLS, MARK_CORNERS, corner_of_mark, mark_corners, mark_dictionary
from handout.values import Array, Page, readonly

# mm, root mean square: clean scans have 0.01 at 300 dpi and 0.07 at 100; more than this is a crumpled sheet
_WORST = 0.35
# mm and pixels, where marks are missing: only the shape of the others tells whether the sheet lay flat, and a view that
# is 1 % narrower at one end, which changes it by 0.06 mm, moves the far corner by 2 mm
_FLAT = (0.03, 0.4)
_OPPOSITE = ({0, 2}, {1, 3})


@dataclass(frozen=True, eq=False)
class Registration:
    """Where a sheet lies in a picture.

    page : its paper.
    to_pixels : (3, 3) float: homogeneous mm on the page to pixels, (x, y); pixel (0, 0) has its middle at 0, 0.
    marks : which corners were found, 0 top left and on clockwise.
    residual : mm, root mean square distance of the marks' corners from where they should be.
    """

    page: Page
    to_pixels: Array
    marks: tuple[int, ...]
    residual: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "to_pixels", readonly(self.to_pixels, 3, 3))

    def pixels(self, mm: Array) -> Array:
        """(n, 2) pixels of points (n, 2) on the page in mm."""
        return apply(self.to_pixels, mm)

    def mm(self, pixels: Array) -> Array:
        """(n, 2) mm on the page of points (n, 2) in pixels."""
        return apply(inverse(self.to_pixels), pixels)

    @property
    def dpi(self) -> float:
        """Pixels an inch of the sheet as it was meant to be printed, in its middle."""
        middle = np.array([self.page.width / 2, self.page.height / 2])
        a, b, c, d = self.pixels(middle + np.array([(-0.5, 0), (0.5, 0), (0, -0.5), (0, 0.5)], dtype=np.float64))
        along, down = b - a, d - c
        return float(math.sqrt(abs(along[0] * down[1] - along[1] * down[0])) * 25.4)


def apply(matrix: Array, points: Array) -> Array:
    """Points (n, 2) under a homography (3, 3)."""
    whole = np.asarray(points, dtype=np.float64) @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(whole[:, :2] / whole[:, 2:])


def inverse(matrix: Array) -> Array:
    """The homography (3, 3) back."""
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def register(image: NDArray[np.uint8]) -> Registration | None:
    """Find a sheet's marks in a picture.

    With all four the sheet may lie at any angle, with perspective, as on a photograph. With three, or with two
    opposite ones, it must lie flat, as on a scanner; with two, what the printer or scanner stretches by half a percent
    is off by up to 0.8 mm.

    Parameters
    ----------
    image : (h, w) or (h, w, 3) uint8

    Returns
    -------
    Registration or None
        None where there is no mark at all.

    Raises
    ------
    InputError
        Too few marks, marks of several sheets, or marks that do not lie as on a sheet.
    """
    grey = in_grey(image)
    page, corners_found = _sheet(
        markers.find(grey, mark_dictionary(), lambda number: corner_of_mark(number) is not None, 4)
    )
    if page is None:
        return None
    marks = tuple(sorted(corners_found))
    if len(marks) < 3 and set(marks) not in _OPPOSITE:
        names = " and ".join(MARK_CORNERS[corner] for corner in marks)
        raise InputError(
            f"Only the marks at the {names} of the sheet can be seen: all four are needed for a photograph, "
            "and two opposite ones for a scan. Scan the whole sheet, with nothing over its marks."
        )
    nominal = mark_corners(page)[list(marks)].reshape(-1, 2)
    measured = markers.refine_corners(grey, np.concatenate([corners_found[corner] for corner in marks]), MARK_CELLS)
    matrix = _fit(nominal, measured, len(marks))
    residuals = apply(inverse(matrix), measured) - nominal
    residual = float(np.sqrt(np.square(residuals).sum(axis=1).mean()))
    registration = Registration(page, matrix, marks, residual)
    _check(registration)
    return registration


def _check(registration: Registration) -> None:
    worst = _WORST if len(registration.marks) == 4 else _FLAT[0] + _FLAT[1] * 25.4 / registration.dpi
    if registration.residual < worst:
        return
    if len(registration.marks) == 4:
        raise InputError(
            f"The marks of the sheet lie {registration.residual:.2f} mm from where they should be (at most "
            f"{worst:.2f} mm): is it crumpled or bent? Lay it flat and scan it."
        )
    missing = " and ".join(name for corner, name in enumerate(MARK_CORNERS) if corner not in registration.marks)
    raise InputError(
        f"The mark at the {missing} of the sheet cannot be seen, and the others are not those of a sheet that lies "
        f"flat on a scanner (off by {registration.residual:.2f} mm, at most {worst:.2f} mm): scan the whole sheet."
    )


def in_grey(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The picture in shades of grey.

    Raises
    ------
    InputError
        It is not (h, w) or (h, w, 3) of uint8, or it is empty.
    """
    import cv2

    if image.dtype != np.uint8 or image.ndim not in (2, 3) or image.shape[2:] not in ((), (3,)) or not image.size:
        raise InputError(
            f"A picture is (h, w) or (h, w, 3) of uint8, and this is {image.shape} of {image.dtype}: convert it."
        )
    return np.asarray(image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def _sheet(marks: list[tuple[int, Array]]) -> tuple[Page | None, Mapping[int, Array]]:
    """The paper, and the corners found."""
    page: Page | None = None
    corners_found: dict[int, Array] = {}
    for number, corners in marks:
        page_of_mark, corner = corner_of_mark(number) or (page, -1)
        if corner in corners_found or (page is not None and page_of_mark != page):
            raise InputError("The picture shows the marks of more than one sheet: scan one sheet at a time.")
        page, corners_found[corner] = page_of_mark, corners
    return page, corners_found


def _fit(mm: Array, pixels: Array, marks: int) -> Array:
    """The homography, affinity or similarity (four, three, two marks) that takes mm to pixels best."""
    import cv2

    if marks == 4:
        # least squares in pixels; the middle of the points as origin keeps it well conditioned
        matrix, _ = cv2.findHomography(mm, pixels, 0)
        if matrix is None:
            raise InputError("The marks of the sheet do not lie in a plane: lay it flat and scan it.")
        return np.asarray(matrix, dtype=np.float64)
    rows = []
    for x, y in mm:
        if marks == 3:
            rows += [[x, y, 1, 0, 0, 0], [0, 0, 0, x, y, 1]]
        else:
            rows += [[x, -y, 1, 0], [y, x, 0, 1]]
    answer = np.linalg.lstsq(np.array(rows), pixels.reshape(-1), rcond=None)[0]
    if marks == 3:
        return np.vstack([answer.reshape(2, 3), [0, 0, 1]])
    a, b, tx, ty = answer
    return np.array([[a, -b, tx], [b, a, ty], [0, 0, 1]])
