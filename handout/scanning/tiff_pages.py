"""TIFF files that Pillow cannot read or misreads: colour of 16 bits, planes apart, rarer ways of packing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import tiff
from handout.errors import InputError
from handout.scanning.checks import page_index, refuse_large


def is_tiff(path: Path) -> bool:
    """Whether a file calls itself a TIFF and is not empty."""
    return path.suffix.lower() in (".tif", ".tiff") and path.is_file() and path.stat().st_size > 0


def count_of_tiff(path: Path) -> int:
    """How many pages a TIFF holds; 1 for one that cannot be read."""
    try:
        with tiff.open_tiff(path) as file:
            return max(1, len(file.pages))
    except Exception:  # what a damaged file raises there is not one kind
        return 1


def page_of_tiff(path: Path, page: int | None) -> tuple[NDArray[np.uint8], tuple[float, float] | None, int]:
    """One page of a TIFF: its pixels (h, w, 3), dpi across and down if the file says them, and how many pages it holds.

    Raises
    ------
    InputError
        Damaged, too large, no such page, or colours that cannot be read well.
    """
    import tifffile

    try:
        with tiff.open_tiff(path) as file:
            pages = file.pages
            page_file = pages[page_index(len(pages), page, path)]
            assert isinstance(page_file, tifffile.TiffPage)
            refuse_large(page_file.imagewidth, page_file.imagelength, path)
            values = page_file.asarray()
            photometric, planes = tifffile.PHOTOMETRIC(page_file.photometric).name, page_file.planarconfig
            dpi = tiff.resolution(page_file)
            orientation = page_file.tags.get(274)
            count = len(pages)
    except InputError:
        raise
    except Exception as error:  # what a damaged file raises there is not one kind
        raise InputError(
            f"Cannot read {path}: it is damaged or cut off, or packed in a way that cannot be read; scan it as PNG."
        ) from error
    if values.ndim == 3 and planes == 2:
        values = np.moveaxis(values, 0, -1)
    rgb = _turn_upright(_as_rgb(values, photometric, path), int(orientation.value) if orientation else 1)
    return rgb, dpi, count


def _turn_upright(rgb: NDArray[np.uint8], orientation: int) -> NDArray[np.uint8]:
    """The picture (h, w, 3) turned as the orientation of the TIFF, 1–8, asks for."""
    if orientation in (5, 6, 7, 8):
        rgb = rgb.transpose(1, 0, 2)
    if orientation in (3, 4, 7, 8):
        rgb = rgb[::-1]
    if orientation in (2, 3, 6, 7):
        rgb = rgb[:, ::-1]
    return np.ascontiguousarray(rgb)


def _as_rgb(values: NDArray[Any], photometric: str, path: Path) -> NDArray[np.uint8]:
    if photometric not in ("RGB", "MINISBLACK", "MINISWHITE") or values.ndim not in (2, 3):
        raise InputError(f"{path} is a TIFF of kind {photometric}: save it as RGB or grey.")
    if values.ndim == 2:
        values = values[:, :, None]
    full = np.iinfo(values.dtype).max if np.issubdtype(values.dtype, np.integer) else 1
    if full > 65535:
        raise InputError(f"{path} holds numbers of more than 16 bits: save it as an ordinary image of 8 or 16 bits.")
    colours = 3 if values.shape[2] >= 3 else 1
    rgb = np.empty((*values.shape[:2], 3), dtype=np.uint8)
    for k in range(3):  # a plane at a time: memory
        plane = values[:, :, min(k, colours - 1)]
        rgb[:, :, k] = (
            (plane >> 8) if full == 65535 else (plane if full == 255 else np.rint(np.clip(plane, 0, 1) * 255))
        )
    return 255 - rgb if photometric == "MINISWHITE" else rgb
