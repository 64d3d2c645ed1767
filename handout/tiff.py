"""TIFF files, opened in silence: what tifffile logs of damage is reported by whoever reads, if it matters."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tifffile import TiffFile, TiffPage


@contextmanager
def open_tiff(path: Path) -> Iterator[TiffFile]:
    """A TIFF file; raises whatever tifffile raises of one that is damaged, which is not one kind of error."""
    import tifffile

    logger = logging.getLogger("tifffile")
    before, logger.disabled = logger.disabled, True
    try:
        with tifffile.TiffFile(path) as file:
            yield file
    finally:
        logger.disabled = before


def resolution(page: TiffPage) -> tuple[float, float] | None:
    """Pixels an inch across and down; None if the file does not say it in a unit of length."""
    if page.resolutionunit not in (2, 3):  # TIFF 6.0: 2 is the inch, 3 the centimetre
        return None
    across, down = page.get_resolution(2)
    return float(across), float(down)
