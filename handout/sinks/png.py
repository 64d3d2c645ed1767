"""Pixels as PNG, with their resolution and where they came from."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout import __version__
from handout.errors import InputError
from handout.inking import plain
from handout.sinks import about as origin
from handout.values import Raster


def to_png(
    image: Raster | NDArray[np.uint8],
    dpi: float | None = None,
    *,
    about: Mapping[str, Any] | None = None,
    paper: tuple[float, float, float] | None = (1.0, 1.0, 1.0),
    palette: NDArray[np.uint8] | None = None,
) -> bytes:
    """An image as PNG; the same pixels give the same bytes.

    Parameters
    ----------
    image : Raster, or (h, w, 3) or (h, w) uint8
        A raster is laid on `paper`.
    dpi : float, optional
        Pixels per inch, stored as ``pHYs``; None: that of the raster.
    about : mapping, optional
        Stored as text: ``seed``, ``hand``, and all of it as JSON under ``about``.
    paper : (r, g, b) in 0–1, or None
        None keeps a raster transparent.
    palette : (256, 3) uint8, optional
        Colours of the values of (h, w) pixels; a page of one ink takes half the bytes so.

    Raises InputError: pixels without a resolution, or of another form.
    """
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    pixels = _pixels(image, paper)
    resolution = image.dpi if dpi is None and isinstance(image, Raster) else dpi
    if resolution is None or not resolution > 0:
        raise InputError("A PNG of bare pixels needs a resolution: give dpi.")
    notes = PngInfo()
    notes.add_text("Software", f"handout {__version__}")
    for key in ("seed", "hand"):
        if about is not None and about.get(key) is not None:
            notes.add_text(key, str(origin.plain(about[key])))
    if about:
        notes.add_text("about", origin.json_text(about))
    out = io.BytesIO()
    picture = Image.fromarray(pixels)
    if palette is not None:
        picture.putpalette(palette.tobytes())
    # the grain of paper hardly shrinks for more effort, which would take longer than making it
    effort = 6 if palette is not None else 3
    picture.save(out, "PNG", dpi=(resolution, resolution), pnginfo=notes, compress_level=effort)
    return out.getvalue()


def _pixels(image: Raster | NDArray[np.uint8], paper: tuple[float, float, float] | None) -> NDArray[np.uint8]:
    if isinstance(image, Raster):
        if paper is not None:
            return plain.flatten(image, paper)
        return np.rint(np.clip(image.rgba, 0, 1) * 255).astype(np.uint8)
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] not in (3, 4)):
        raise InputError(f"A PNG needs (h, w, 3) or (h, w) of uint8, not {image.shape} of {image.dtype}.")
    return image
