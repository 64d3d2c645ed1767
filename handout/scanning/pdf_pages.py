"""A page of a PDF as pixels, at the resolution of the picture that it holds.

Needs `pypdfium2`, an optional library.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.scanning.checks import page_index, refuse_large, source_of

_FINEST = 600.0  # dpi: finer pictures are drawn at this
_COVERED = 0.25  # of the page: pictures that cover less of it are no scan of one


def page_of_pdf(path: Path, page: int | None) -> tuple[NDArray[np.uint8], float, int]:
    """Pixels (h, w, 3) uint8 of a page, its resolution in dpi, and how many pages there are.

    Raises InputError: the library is missing; no such page; not a PDF, damaged, or locked by a password; a page without
    a picture; too large.
    """
    with _open_pdf(path) as document:
        count = len(document)
        index = page_index(count, page, path)
        sheet = document[index]
        width, height = sheet.get_size()  # points
        picture = _native(sheet, width * height)
        if picture is None:
            raise InputError(
                f"{source_of(path, page, count)} holds no picture of a page, only text or drawings: it is not a scan. "
                "Print and scan it, or save it as a PNG of 300 dpi."
            )
        dpi = min(picture, _FINEST)
        return *(_render_page(sheet, path, dpi), dpi), count


def count_of_pdf(path: Path) -> int:
    """How many pages there are.

    Raises InputError: the library is missing; not a PDF, damaged, locked, or without a page.
    """
    with _open_pdf(path) as document:
        return len(document)


def drawn_page(path: Path, page: int | None, dpi: float, content: bytes | None = None) -> NDArray[np.uint8]:
    """Pixels (h, w, 3) uint8 of a page, whatever is on it.

    content : of the file, where it is not on the disk.

    Raises InputError: as `page_of_pdf`, but for a page without a picture.
    """
    with _open_pdf(path, content) as document:
        return _render_page(document[page_index(len(document), page, path)], path, dpi)


def _render_page(sheet: Any, path: Path, dpi: float) -> NDArray[np.uint8]:
    width, height = sheet.get_size()  # points
    refuse_large(round(width / 72 * dpi), round(height / 72 * dpi), path)
    # pdfium rounds the size up: without the hair's breadth a picture would be stretched by a row
    bitmap = sheet.render(scale=dpi / 72 * (1 - 1e-6), rev_byteorder=True)
    return np.ascontiguousarray(bitmap.to_numpy()[:, :, :3])


@contextmanager
def _open_pdf(path: Path, content: bytes | None = None) -> Iterator[Any]:
    try:
        import pypdfium2  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        raise InputError(
            f"Reading {path} needs the library pypdfium2: pip install 'handout-driver[pdf]', "
            "or save the page as PNG or TIFF."
        ) from error
    document = None
    try:
        document = pypdfium2.PdfDocument(path if content is None else content)
        if not len(document):
            raise InputError(f"{path} is a PDF without a page: scan it again.")
        yield document
    except (pypdfium2.PdfiumError, FileNotFoundError) as error:
        locked = "password" in str(error).lower()
        reason = "it is locked by a password; save a copy without one" if locked else "it is damaged; scan it again"
        raise InputError(f"Cannot read {path}: {reason}, or save the page as PNG or TIFF.") from error
    finally:
        if document is not None:
            document.close()


def _native(sheet: Any, whole: float) -> float | None:
    """Pixels per inch of the largest picture on the page; None if pictures cover little of the `whole` of it."""
    import pypdfium2.raw  # type: ignore[import-not-found, unused-ignore]

    best, covered, answer = 0.0, 0.0, None
    for item in sheet.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_IMAGE]):
        left, bottom, right, top = item.get_bounds() if hasattr(item, "get_bounds") else item.get_pos()
        area = (right - left) * (top - bottom)
        pixels = item.get_px_size() if hasattr(item, "get_px_size") else item.get_size()
        covered += area
        if area > best:
            best = area
            answer = float(np.sqrt(pixels[0] * pixels[1] / max(area, 1e-6)) * 72)
    return answer if covered >= _COVERED * whole else None
