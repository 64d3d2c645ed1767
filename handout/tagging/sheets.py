"""A prompt sheet that was filled in: found in its scan, made flat, without what is printed on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.scanning.matting import fill_smooth
from handout.scanning.picture_files import ENOUGH_DPI
from handout.scanning.scan import Scan
from handout.scanning.written_page import Prepared, prepare

if TYPE_CHECKING:
    from handout.prompting.sheet_detection import Sheet
    from handout.scanning.scan import Picture

# printed words and lines take blue light and leave the red; pens take the red (red ones need a plain sheet)
_LESS_BLUE = 0.06  # of the paper's light: how much less blue than red there is where something is printed
_MOST_RED = 0.72  # of the paper's: darker than that is ink, on print or beside it

_LEAST_PAPER = 0.9


@dataclass(frozen=True, eq=False)
class Filled:
    """A sheet as a scan of its own: flat, everything printed on it replaced by paper; and what was to be copied."""

    scan: Scan
    transcript: str

    @property
    def prepared(self) -> Prepared:
        """The sheet with its light and inks known."""
        return prepare(self.scan)


def filled_sheet(scan: Scan | Picture) -> Filled | None:
    """The prompt sheet in a scan or photograph, or None if there is none; its marks say how large it is.

    Raises
    ------
    InputError
        There are marks of a sheet, but too few; or its codes cannot be read.
    """
    from handout.prompting.sheet_detection import find_sheet, printed_on, rectify

    try:
        sheet = find_sheet(np.asarray(scan.rgb))
    except InputError as error:
        raise InputError(f"{scan.source}: {error}") from error
    if sheet is None:
        return None
    dpi = min(float(round(sheet.dpi)), ENOUGH_DPI)
    flat = rectify(np.asarray(scan.rgb), sheet, dpi)
    bare = _without(flat, printed_on(sheet, dpi), sheet)
    return Filled(Scan(bare, dpi, scan.source, told=True), sheet.transcript)


def refuse_mirrored(scan: Scan | Picture) -> None:
    """Raise InputError for the mirror image of a sheet."""
    from handout.prompting.registration import register

    try:
        found = register(np.ascontiguousarray(scan.rgb[:, ::-1])) is not None
    except InputError:
        found = True
    if found:
        raise InputError(
            f"{scan.source} is mirrored: the marks of a sheet can be read only backwards. Scan it again without "
            "mirroring, or flip the picture from left to right."
        )


def _without(flat: NDArray[np.uint8], marks: NDArray[np.bool_], sheet: Sheet) -> NDArray[np.uint8]:
    """The sheet (h, w, 3) with paper in place of its marks, and of words and lines where no ink is over them."""
    import cv2

    light = flat.astype(np.float32) / np.median(flat.reshape(-1, 3)[::97], axis=0).astype(np.float32)
    # a scanner's colours lie a little apart at the edges of black strokes
    light = np.asarray(cv2.GaussianBlur(light, (0, 0), 0.8))
    red, blue = light[:, :, 0], light[:, :, 2]
    printed = marks.copy()
    if len(sheet.bands):
        words = (red - blue > _LESS_BLUE) & (red > _MOST_RED)
        printed |= (_grown(words, 1) > 0) & (red > _MOST_RED)
    # paper is taken from where there is neither print nor ink
    filled = fill_smooth(flat, (printed | (_grown(red < _LEAST_PAPER, 3) > 0)).astype(np.uint8))
    return np.where(printed[:, :, None], filled, flat)


def _grown(mask: NDArray[np.bool_], by: int) -> NDArray[np.uint8]:
    import cv2

    size = 2 * by + 1
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((size, size), np.uint8)), dtype=np.uint8)
