"""Where everything is on a prompt sheet, mm on the page: fiducial marks, codes, lines, printed words.

The same numbers draw the sheet and find it again.  The four fiducials at the corners are AprilTags of the family
36h11 (Wang and Olson 2016): 8 × 8 cells, black outside, numbered 4 × paper + corner.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import page_sizes
from handout.errors import InputError
from handout.values import Array, Page

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
    """The paper of that name.

    Raises InputError: sheets are not made in that size.
    """
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
    import cv2

    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)


def mark_cells(number: int) -> NDArray[np.bool_]:
    """(8, 8) bool: the cells of the mark of that number; True is black."""
    import cv2

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
