"""Page images as the measures take them: grey, upright as stored, 300 dpi."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError

DPI = 300.0
_MOST_PIXELS = 400_000_000


def read_page(path: Path, dpi: float | None = None) -> NDArray[np.uint8]:
    """The page as (h, w) uint8 at 300 dpi, transparent parts white.

    Parameters
    ----------
    path : Path
        Any image that Pillow reads.
    dpi : float, optional
        Resolution; otherwise the file's own, and 300 where it says none.

    Raises
    ------
    InputError
        Not an image, or one too large.
    """
    from PIL import Image

    Image.MAX_IMAGE_PIXELS = _MOST_PIXELS
    try:
        with Image.open(path) as image:
            own = image.info.get("dpi", (DPI, DPI))
            rgba = image.convert("RGBA")
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or "it is not an image that can be read"
        raise InputError(f"Cannot read {path}: {reason}.") from error
    paper = Image.new("RGBA", rgba.size, "white")
    grey = Image.alpha_composite(paper, rgba).convert("L")
    scale = DPI / (dpi or float(own[0]) or DPI)
    if abs(scale - 1) > 0.02:
        size = (max(1, round(grey.width * scale)), max(1, round(grey.height * scale)))
        grey = grey.resize(size, Image.Resampling.LANCZOS)
    return np.asarray(grey, dtype=np.uint8)
