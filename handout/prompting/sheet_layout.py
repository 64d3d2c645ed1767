"""Where everything is on a prompt sheet, mm on the page: fiducial marks, codes, lines, printed words.

The same numbers draw the sheet and find it again: from the marks at its corners to where every millimetre of it lies in
a picture (`register`).  The four fiducials at the corners are AprilTags of the family
36h11 (Wang and Olson 2016): 8 × 8 cells, black outside, numbered 4 × paper + corner.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import markers, page_sizes
from handout.errors import InputError
from handout.libraries import cv2
from handout.values import Array, Page, readonly

MARK_SIZE = 8.0  # mm, of the black square
MARK_QUIET = 2.0  # mm of white around it
MARK_SIDE = 10.0  # mm from the edge of the sheet, left, right and above
MARK_FOOT = 14.0  # mm from the lower edge: many printers reach less far there
MARK_CELLS = 8
MARK_CORNERS = ("top left", "top right", "bottom right", "bottom left")
PAPERS: tuple[Page, ...] = (page_sizes.page("A4"), page_sizes.page("letter"))
PITCH = (6.0, 20.0)  # mm
LETTER = 0.33  # width that a letter takes with its gaps, a pitch: an x-height of a quarter of it, and large writing
CODES = 6
CODE = 22.0  # mm a side
_MARGIN = 20.0  # left and right of the lines
_FIRST = 22.0  # top of the first line's space
_ABOVE_CODES = 7.0  # room for descenders, and white around the codes
# the printed words stand in the upper part of a line's space, where few ascenders reach: parts of the pitch
_WORDS_TOP, _WORDS_FOOT = 0.80, 0.53
_LABEL = (12.0, 17.0)  # mm, between the upper marks


def paper_of_name(name: str) -> Page:
    """The paper of that name. Raises InputError: sheets are not made in that size."""
    for page in PAPERS:
        if page.name.lower() == name.lower():
            return page
    sizes = " or ".join(page.name for page in PAPERS)
    raise InputError(f"Sheets to write on are {sizes}, not {name!r}.")


def mark_corners(page: Page) -> Array:
    """(4, 4, 2) float, mm: the corners of each mark, clockwise from its top left; the marks as in `MARK_CORNERS`."""
    left, right = MARK_SIDE, page.width - MARK_SIDE - MARK_SIZE
    top, bottom = MARK_SIDE, page.height - MARK_FOOT - MARK_SIZE
    origins = np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
    return np.asarray(origins[:, None, :] + MARK_SIZE * np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float64))


def mark_number(page: Page, corner: int) -> int:
    """The number of the mark at a corner of a sheet of that paper."""
    return 4 * PAPERS.index(page) + corner


def corner_of_mark(number: int) -> tuple[Page, int] | None:
    """The paper and corner of the mark of that number; None for a number that sheets do not use."""
    return (PAPERS[number // 4], number % 4) if 0 <= number < 4 * len(PAPERS) else None


@cache
def mark_dictionary() -> Any:
    """All tags of the family."""
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)


def mark_cells(number: int) -> NDArray[np.bool_]:
    """(8, 8) bool: the cells of the mark of that number; True is black."""
    return np.asarray(cv2.aruco.generateImageMarker(mark_dictionary(), number, MARK_CELLS) < 128)


@dataclass(frozen=True)
class SheetLayout:
    """The geometry of a sheet.

    page : A4 or letter.
    pitch : mm between lines.
    printed : whether words and lines are printed on it; else lines are to be laid under.
    """

    page: Page
    pitch: float = 10.0
    printed: bool = True

    def __post_init__(self) -> None:
        paper_of_name(self.page.name)
        low, high = PITCH
        if not low <= self.pitch <= high:
            raise InputError(f"ruling: {self.pitch:g} mm is outside {low:g} to {high:g} mm.")

    @property
    def lines(self) -> int:
        """How many lines fit."""
        foot = self.page.height - MARK_FOOT - CODE - _ABOVE_CODES
        return math.floor((foot - _FIRST) / self.pitch + 1e-9)

    def width(self, letter: float | None = None) -> int:
        """Letters to a line.

        letter : mm that the author's letters take, with the gaps between words; None: usual for the pitch.

        Raises InputError: fewer than ten or more than two hundred.
        """
        count = math.floor((self.right - self.left) / (letter or LETTER * self.pitch))
        if not 10 <= count <= 200:
            raise InputError(
                f"letter width: {letter or LETTER * self.pitch:g} mm makes {count} letters a line of "
                f"{self.right - self.left:g} mm; 10 to 200 are possible."
            )
        return count

    @property
    def left(self) -> float:
        """Where lines begin."""
        return _MARGIN

    @property
    def right(self) -> float:
        """Where lines end."""
        return self.page.width - _MARGIN

    @property
    def baselines(self) -> Array:
        """(lines,) heights of the lines to write on."""
        return np.asarray(_FIRST + self.pitch * np.arange(1, self.lines + 1, dtype=np.float64))

    @property
    def codes(self) -> Array:
        """(6, 4) left, top, right, bottom of each square code, white around it not included."""
        inside = MARK_SIDE + MARK_SIZE + 2 * MARK_QUIET
        x = np.linspace(inside, self.page.width - inside - CODE, CODES)
        top = self.page.height - MARK_FOOT - CODE
        return np.column_stack([x, np.full(CODES, top), x + CODE, np.full(CODES, top + CODE)])

    @property
    def label(self) -> Array:
        """(4,) the box of the words at the top."""
        inside = MARK_SIDE + MARK_SIZE + 2 * MARK_QUIET
        return np.array([inside, _LABEL[0], self.page.width - inside, _LABEL[1]])

    @property
    def masks(self) -> Array:
        """(k, 4) boxes in which nothing is the author's: marks, codes and label, with the white around them."""
        quiet = np.array([-1, -1, 1, 1]) * MARK_QUIET
        squares = mark_corners(self.page)
        marks = np.column_stack([squares[:, 0], squares[:, 2]])
        return np.vstack([marks + quiet, self.codes + quiet, self.label])

    @property
    def bands(self) -> Array:
        """(lines, 4) boxes of the printed words, through which ascenders may pass; none on a plain sheet."""
        if not self.printed:
            return np.zeros((0, 4))
        y = self.baselines
        ends = np.ones_like(y)
        return np.column_stack(
            [self.left * ends, y - _WORDS_TOP * self.pitch, self.right * ends, y - _WORDS_FOOT * self.pitch]
        )


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
        return markers.project(self.to_pixels, mm)

    def mm(self, pixels: Array) -> Array:
        """(n, 2) mm on the page of points (n, 2) in pixels."""
        return markers.project(np.linalg.inv(self.to_pixels), pixels)

    @property
    def dpi(self) -> float:
        """Pixels an inch of the sheet as it was meant to be printed, in its middle."""
        middle = np.array([self.page.width / 2, self.page.height / 2])
        a, b, c, d = self.pixels(middle + np.array([(-0.5, 0), (0.5, 0), (0, -0.5), (0, 0.5)], dtype=np.float64))
        along, down = b - a, d - c
        return float(math.sqrt(abs(along[0] * down[1] - along[1] * down[0])) * 25.4)


def register(image: NDArray[np.uint8]) -> Registration | None:
    """Find a sheet's marks in a picture.

    With all four the sheet may lie at any angle, with perspective, as on a photograph. With three, or with two
    opposite ones, it must lie flat, as on a scanner; with two, what the printer or scanner stretches by half a percent
    is off by up to 0.8 mm.

    image : (h, w) or (h, w, 3) uint8

    Returns a registration, or None where there is no mark at all.
    Raises InputError: too few marks, marks of several sheets, or marks that do not lie as on a sheet.
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
    residuals = markers.project(np.linalg.inv(matrix), measured) - nominal
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
    """The picture in shades of grey. Raises InputError: it is not (h, w) or (h, w, 3) of uint8, or it is empty."""
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
