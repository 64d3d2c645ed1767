"""The four marks at a sheet's corners: which corner of which size of paper each of them says it is.

They are AprilTags of the family 36h11 (Wang, Olson 2016): 8 × 8 cells, black outside. The number of one is
4 × paper + corner.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import page_sizes
from handout.errors import InputError
from handout.values import Array, Page

SIZE = 8.0  # mm, of the black square
QUIET = 2.0  # mm of white around it
SIDE = 10.0  # mm from the edge of the sheet, left, right and above
FOOT = 14.0  # mm from the lower edge: many printers reach less far there
CELLS = 8
CORNERS = ("top left", "top right", "bottom right", "bottom left")
PAPERS: tuple[Page, ...] = (page_sizes.page("A4"), page_sizes.page("letter"))


def paper(name: str) -> Page:
    """The paper of that name.

    Raises
    ------
    InputError
        Sheets are not made in that size.
    """
    for page in PAPERS:
        if page.name.lower() == name.lower():
            return page
    known = " or ".join(page.name for page in PAPERS)
    raise InputError(f"Sheets to write on are {known}, not {name!r}.")


def squares(page: Page) -> Array:
    """(4, 4, 2) float, mm: the corners of each mark clockwise from its top left; the marks in the order of CORNERS."""
    left, right = SIDE, page.width - SIDE - SIZE
    top, bottom = SIDE, page.height - FOOT - SIZE
    origins = np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
    return np.asarray(origins[:, None, :] + SIZE * np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float64))


def number(page: Page, corner: int) -> int:
    """The number of the mark at a corner of a sheet of that paper."""
    return 4 * PAPERS.index(page) + corner


def identify(found: int) -> tuple[Page, int] | None:
    """The paper and corner of the mark of that number; None if it is none of ours."""
    return (PAPERS[found // 4], found % 4) if 0 <= found < 4 * len(PAPERS) else None


@cache
def dictionary() -> Any:
    """The tags of which the marks are some."""
    import cv2

    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)


def cells(found: int) -> NDArray[np.bool_]:
    """(8, 8) bool: the cells of the mark of that number; True is black."""
    import cv2

    return np.asarray(cv2.aruco.generateImageMarker(dictionary(), found, CELLS) < 128)
