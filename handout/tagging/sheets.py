"""A prompt sheet that was filled in: found in its scan, made flat, without what is printed on it."""

from __future__ import annotations

from dataclasses import dataclass

from handout.prompting.finding import find_sheet, printed_on, rectify
from handout.scanning.matting import fill_smooth
from handout.scanning.page import Scan


@dataclass(frozen=True, eq=False)
class Filled:
    """A sheet as a scan of its own: flat, its marks, codes and label replaced by paper; and what was to be copied."""

    scan: Scan
    transcript: str


def filled_sheet(scan: Scan) -> Filled | None:
    """The prompt sheet in a scan, or None if there is none.

    Raises
    ------
    InputError
        There are marks of a sheet, but too few; or its codes cannot be read.
    """
    import numpy as np

    sheet = find_sheet(np.asarray(scan.rgb))
    if sheet is None:
        return None
    dpi = float(round(sheet.dpi))
    flat = rectify(np.asarray(scan.rgb), sheet, dpi)
    bare = fill_smooth(flat, printed_on(sheet, dpi).astype(np.uint8))
    return Filled(Scan(bare, dpi, scan.source, told=True), sheet.transcript)
