"""A sheet that is to be written on, as its picture or its PDF shows it: flat, and nothing but the sheet.

A photograph in which the sheet lies on something darker is cut out along its outline and made rectangular.

Source: own method; the outline is that of `page_layout.outline`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.scanning.checks import LEAST_DPI, MOST_DPI
from handout.scanning.page_layout import outline
from handout.scanning.picture_files import is_pdf, read_picture
from handout.values import Array

_PDF_DPI = 300.0  # at which a page of a PDF is drawn
_NUMBERED = re.compile(r"(?P<file>.+):(?P<page>[1-9]\d{0,5})")


@dataclass(frozen=True, eq=False)
class GivenSheet:
    """A sheet as pixels.

    name : of its file, and its page.
    rgb : (h, w, 3) uint8.
    size : width and height, mm, where the file tells them.
    straightened : whether it was cut out of a photograph.
    pages : how many its file holds, where none of them was named.
    """

    name: str
    rgb: NDArray[np.uint8]
    size: tuple[float, float] | None = None
    straightened: bool = False
    pages: int = 1


def sheet_file(name: str) -> tuple[Path, int | None] | None:
    """The file that a sheet's name means, ``FILE`` or ``FILE:2``, and the page; None where there is none."""
    if Path(name).is_file():
        return Path(name), None
    numbered = _NUMBERED.fullmatch(name)
    if numbered is not None and Path(numbered["file"]).is_file():
        return Path(numbered["file"]), int(numbered["page"])
    return None


def read_sheet(name: str) -> GivenSheet:
    """The sheet of a picture, or of a page of a PDF or TIFF file (the first, unless the name ends with another).

    Raises InputError: no such file, or one that cannot be read.
    """
    found = sheet_file(name)
    if found is None:
        raise InputError(f"There is no sheet {name}.")
    path, page = found
    return _read_sheet(path, page, path.stat().st_mtime_ns)


@lru_cache(maxsize=2)  # it is looked at for its size, for its lines, and for every picture of the writing
def _read_sheet(path: Path, page: int | None, _changed: int) -> GivenSheet:
    label = path.name if page is None else f"{path.name}:{page}"
    if is_pdf(path):
        from handout.scanning.pdf_pages import count_of_pdf, drawn_page

        rgb = drawn_page(path, page or 1, _PDF_DPI)
        height, width = (side / _PDF_DPI * 25.4 for side in rgb.shape[:2])
        return GivenSheet(label, _read_only(rgb), (width, height), pages=1 if page else count_of_pdf(path))
    picture = read_picture(path, page)
    measured = picture.own is not None and LEAST_DPI - 1 <= picture.own <= MOST_DPI and not picture.photographed
    if measured and picture.own is not None:
        height, width = (side / picture.own * 25.4 for side in picture.rgb.shape[:2])
        return GivenSheet(label, _read_only(picture.rgb), (width, height))
    flat = _straighten_sheet(picture.rgb)
    return GivenSheet(label, _read_only(picture.rgb if flat is None else flat), None, flat is not None)


def _read_only(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    rgb = rgb.view()
    rgb.flags.writeable = False
    return rgb


def _straighten_sheet(rgb: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """The sheet alone, (h, w, 3), its sides the edges of the picture; None where its outline is not to be seen."""
    import cv2

    sides = [side for side in outline(rgb) if side is not None]
    if len(sides) < 4:
        return None
    # the corners, clockwise from the upper left: each where a side meets the one before
    corners = np.array([_meeting_point(sides[k - 1], sides[k]) for k in range(4)])
    lengths = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    width, height = round(max(lengths[0], lengths[2])), round(max(lengths[1], lengths[3]))
    frame = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=np.float32)
    matrix = cv2.getPerspectiveTransform(corners.astype(np.float32), frame)
    flat = cv2.warpPerspective(rgb, matrix, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(flat, dtype=np.uint8)


def _meeting_point(a: Array, b: Array) -> Array:
    """Where two lines, each a point and a direction (2, 2), meet."""
    along = np.linalg.solve(np.column_stack([a[1], -b[1]]), b[0] - a[0])[0]
    return np.asarray(a[0] + along * a[1])
