"""Finding a sheet in a scan: where it lies, which page it is, what was to be written on which line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.libraries import cv2
from handout.prompting.sheet_codes import PARTS, PageRecord, join, read_codes, unpack
from handout.prompting.sheet_layout import Registration, SheetLayout, in_grey, register
from handout.values import Array, Page

# of the pitch, over a line: descenders of the line above end there, ascenders of that below begin under the rule
_BODY = (0.4, 0.06)
_DPI = (36.0, 2400.0)  # of a rectified page: bounds against slips


@dataclass(frozen=True, eq=False)
class DetectedSheet:
    """A sheet in a picture, and what it says of itself.

    registration : where it lies.
    record : what its codes say.
    layout : where everything is on it.
    """

    registration: Registration
    record: PageRecord
    layout: SheetLayout

    @property
    def page(self) -> Page:
        """The paper, mm."""
        return self.layout.page

    @property
    def masks(self) -> Array:
        """(k, 4) mm, left, top, right, bottom: marks, codes and label, where nothing is the author's."""
        return self.layout.masks

    @property
    def bands(self) -> Array:
        """(lines, 4) mm: the printed words, through which strokes may pass; (0, 4) if none are printed."""
        return self.layout.bands[: len(self.record.lines)]

    @property
    def fields(self) -> Array:
        """(lines, 4) mm: where only the letters of a line reach, no print and next to none of its neighbours'."""
        y, pitch = self.layout.baselines[: len(self.record.lines)], self.layout.pitch
        left, right = (np.full_like(y, end) for end in (self.layout.left, self.layout.right))
        return np.column_stack([left, y - _BODY[0] * pitch, right, y - _BODY[1] * pitch])

    @property
    def dpi(self) -> float:
        """Pixels an inch of the sheet; `rectify` at this loses and adds nothing."""
        return self.registration.dpi


def find_sheet(image: NDArray[np.uint8]) -> DetectedSheet | None:
    """Find a printed sheet in a scan or photograph.

    image : (h, w) or (h, w, 3) uint8: any resolution from about 150 dpi, any angle.

    Returns a sheet, or None if the picture has no mark of a sheet in it.
    Raises InputError: there are marks, but too few or misplaced; or the codes cannot be read.
    """
    grey = in_grey(image)
    registration = register(grey)
    if registration is None:
        return None
    boxes = SheetLayout(registration.page).codes
    parts = read_codes(grey, registration, boxes)
    data = join(parts)
    if data is None:
        raise InputError(
            f"Only {len(parts)} of the {len(boxes)} codes at the foot of the sheet can be read, and {PARTS} are "
            f"needed: is the picture sharp there, and the sheet flat and clean? Take it anew, at 200 dpi or more (this "
            f"has {registration.dpi:.0f})."
        )
    record = unpack(data)
    return DetectedSheet(registration, record, SheetLayout(registration.page, record.pitch, record.printed))


def rectify(
    image: NDArray[np.uint8], sheet: DetectedSheet | Registration, dpi: float | None = None
) -> NDArray[np.uint8]:
    """The page upright and flat, its upper left corner at the first pixel.

    image : (h, w) or (h, w, 3) uint8: the picture in which the sheet was found.
    sheet : where it is.
    dpi : of the result, 36–2400; by default that of the picture.

    Returns (height, width) or (height, width, 3) uint8: pixel (i, j) has its middle at ((j + ½), (i + ½)) · 25.4 / dpi
    mm; white outside the picture.
    Raises InputError: a resolution outside its bounds.
    """
    registration = sheet.registration if isinstance(sheet, DetectedSheet) else sheet
    wanted = registration.dpi if dpi is None else dpi
    if not _DPI[0] <= wanted <= _DPI[1]:
        raise InputError(f"dpi: {wanted:g} is outside {_DPI[0]:g} to {_DPI[1]:g}.")
    pixel = 25.4 / wanted
    width, height = (round(side / pixel) for side in (registration.page.width, registration.page.height))
    to_mm = np.array([[pixel, 0, pixel / 2], [0, pixel, pixel / 2], [0, 0, 1]])
    backwards = registration.to_pixels @ to_mm
    reduced = registration.dpi / wanted
    if reduced > 1.2:
        # what is finer than the result's pixels would come out as false patterns
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), 0.45 * reduced))
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    white = (255, 255, 255)
    warped = cv2.warpPerspective(image, backwards, (width, height), flags=flags, borderValue=white)
    return np.asarray(warped, dtype=np.uint8)


def printed_on(sheet: DetectedSheet, dpi: float) -> NDArray[np.bool_]:
    """Where the rectified page holds print: True in the marks, codes and label.

    dpi : that of `rectify`.

    Returns (height, width) bool
    """
    pixel = 25.4 / dpi
    mask = np.zeros((round(sheet.page.height / pixel), round(sheet.page.width / pixel)), dtype=bool)
    for left, top, right, bottom in np.rint(sheet.masks / pixel).astype(int).tolist():
        mask[max(top, 0) : bottom, max(left, 0) : right] = True
    return mask
