"""A page of a PDF as pixels, at the resolution of the picture that it holds.

Needs `pypdfium2`, an optional library.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.scanning.page import choose_page, refuse_large

_DRAWN = 300.0  # dpi for a page that holds no picture


def page_of_pdf(path: Path, page: int | None) -> tuple[NDArray[np.uint8], float]:
    """Pixels (h, w, 3) uint8 of a page, and its resolution in dpi.

    Raises
    ------
    InputError
        The library is missing; no such page; not a PDF, damaged, or locked by a password; too large.
    """
    try:
        import pypdfium2  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        raise InputError(
            f"Reading {path} needs the library pypdfium2: pip install 'handout-driver[pdf]', "
            "or save the page as PNG or TIFF."
        ) from error
    try:
        document = pypdfium2.PdfDocument(path)
    except (pypdfium2.PdfiumError, FileNotFoundError) as error:
        reason = "no such file" if not path.is_file() else "it is not a PDF, is damaged, or needs a password"
        raise InputError(f"Cannot read {path}: {reason}.") from error
    try:
        return _drawn(document, choose_page(len(document), page, path), path)
    finally:
        document.close()


def _drawn(document: Any, index: int, path: Path) -> tuple[NDArray[np.uint8], float]:
    sheet = document[index]
    width, height = sheet.get_size()  # points
    dpi = _native(sheet) or _DRAWN
    size = round(width / 72 * dpi), round(height / 72 * dpi)
    refuse_large(*size, path)
    # pdfium rounds the size up: without the hair's breadth a picture would be stretched by a row
    bitmap = sheet.render(scale=dpi / 72 * (1 - 1e-6), rev_byteorder=True)
    return np.ascontiguousarray(bitmap.to_numpy()[:, :, :3]), dpi


def _native(sheet: Any) -> float | None:
    """Pixels per inch of the largest picture on the page."""
    import pypdfium2.raw  # type: ignore[import-not-found, unused-ignore]

    best, answer = 0.0, None
    for item in sheet.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_IMAGE]):
        left, bottom, right, top = item.get_bounds() if hasattr(item, "get_bounds") else item.get_pos()
        area = (right - left) * (top - bottom)
        pixels = item.get_px_size() if hasattr(item, "get_px_size") else item.get_size()
        if area > best:
            best = area
            answer = float(np.sqrt(pixels[0] * pixels[1] / max(area, 1e-6)) * 72)
    return answer
