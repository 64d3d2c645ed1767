"""Page images as the measures take them: grey, upright, 300 dpi, ink parted from paper by one threshold.

The ink of a scan that becomes a hand is found with much more care (`scanning.mask`), by its colour and with a cut that
smooths its edges.  A measure must not: what it says of a page would be what that method does to edges, and figures of
the literature, and those that people's pages were measured with, are Otsu's.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.scanning.picture_files import read_picture

DPI = 300.0
_DUST = 12  # pixels
_THIN = 25  # pixels: no line of writing is that long and that low
_EDGE = 12  # pixels, the outermost millimetre


def read_page(path: Path, dpi: float | None = None) -> NDArray[np.uint8]:
    """The page as (h, w) uint8 at 300 dpi, transparent parts white.

    Parameters
    ----------
    path : Path
        Any image that a scan may be, see `scanning.page`.
    dpi : float, optional
        Resolution; otherwise the file's own, and 300 where it says none.

    Raises
    ------
    InputError
        Not an image, one too large, or several pages in one file.
    """
    from PIL import Image

    picture = read_picture(path)
    grey = Image.fromarray(picture.rgb).convert("L")
    scale = DPI / (dpi or picture.own or DPI)
    if abs(scale - 1) > 0.02:
        size = (max(1, round(grey.width * scale)), max(1, round(grey.height * scale)))
        grey = grey.resize(size, Image.Resampling.LANCZOS)
    return np.asarray(grey, dtype=np.uint8)


def ink(grey: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """(h, w) bool: the ink of a page by Otsu's threshold, without specks and without what a scanner adds.

    Pieces of less than 12 pixels are dust.  A piece longer than a quarter of the page that is also straight and
    thin (a frame, a ruling, the shadow of the paper's edge) is not writing; nor is one that lies in the outermost
    millimetre.  Writing that reaches the edge of the image is kept.

    Parameters
    ----------
    grey : (h, w) uint8, dark ink on light paper, at about 300 dpi.
    """
    import cv2

    if grey.size == 0 or grey.min() == grey.max():
        return np.zeros(grey.shape, dtype=np.bool_)
    _, mask = cv2.threshold(grey, 0, 255, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    x, y, w, h, area = (stats[:, i] for i in range(5))
    height, width = grey.shape
    ruled = (w > width / 4) & (h < _THIN) | (h > height / 4) & (w < _THIN)
    edge = (x + w <= _EDGE) | (y + h <= _EDGE) | (x >= width - _EDGE) | (y >= height - _EDGE)
    keep = (area >= _DUST) & ~ruled & ~(edge if min(height, width) > 20 * _EDGE else False)
    keep[0] = False
    return np.asarray(keep[labels])
