"""Ink of several pens on one sheet, scanned ink in another colour, and pictures under the ink.

Ink is a filter before the paper: light that comes through one is what the next has to work on, so amounts of ink, the
logarithms of light, add up, and what is lighter or darker in a line stays so in any colour.

Source: own method (Beer–Lambert law, in device RGB, where scanned ink was found too).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from handout.inking.pen import rgb
from handout.values import Raster

Box = tuple[float, float, float, float]
_DARKEST = 1 / 255  # of the light: a black is printed no darker


def mix_inks(rasters: Iterable[Raster]) -> Raster:
    """The ink of some pages (at least one) of one size on one page; those before the last are not kept."""
    first, *others = rasters
    if not others:
        return first
    rgba = np.array(first.rgba)
    begin, end = _rows(first)
    for raster in others:
        top, bottom = _rows(raster)
        over, under = raster.rgba[top:bottom], rgba[top:bottom]
        at = np.nonzero(over[:, :, 3])
        under[at] = purest_ink(passed_light(over[at]) * passed_light(under[at]))
        begin, end = min(begin, top), max(end, bottom)
    return Raster(rgba, first.dpi, first.origin, (min(begin, end), end))


def recolour_ink(raster: Raster, was: str, colour: str) -> Raster:
    """Ink in another colour, as thick everywhere as it was.

    was, colour : ``"#rrggbb"``: the usual colour of the ink now, and what it is to be.
    """
    before, after = (-np.log(np.maximum(rgb(name), _DARKEST)) for name in (was, colour))
    rgba = np.zeros_like(raster.rgba)
    top, bottom = _rows(raster)
    part = raster.rgba[top:bottom]
    at = np.nonzero(part[:, :, 3])
    # the channels that the ink absorbs most tell best how much of it there is
    amount = -np.log(np.maximum(passed_light(part[at]), _DARKEST)) @ before / max(float(before @ before), 1e-6)
    rgba[top:bottom][at] = purest_ink(np.exp(-amount[:, None] * after))
    return Raster(rgba, raster.dpi, raster.origin, raster.rows)


def paste_pictures(
    sheet: NDArray[np.uint8],
    dpi: float,
    pictures: Sequence[tuple[NDArray[np.uint8], tuple[float, float, float, float]]],
) -> NDArray[np.uint8]:
    """A sheet (h, w, 3), device RGB, with pictures on it, each at its place: x, y, width, height in mm."""
    from PIL import Image

    page = sheet.copy()
    for picture, (x, y, width, height) in pictures:
        left, top, w, h = (round(side * dpi / 25.4) for side in (x, y, width, height))
        scaled = np.asarray(Image.fromarray(picture).resize((max(w, 1), max(h, 1)), Image.Resampling.LANCZOS))
        under = page[max(top, 0) : top + scaled.shape[0], max(left, 0) : left + scaled.shape[1]]
        # what is printed leaves the paper its grain
        light = scaled[: under.shape[0], : under.shape[1]].astype(np.float32) / 255
        under[:] = np.rint(under * light)
    return page


def _rows(raster: Raster) -> tuple[int, int]:
    return raster.rows if raster.rows is not None else (0, len(raster.rgba))


def passed_light(rgba: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(n, 3), 0–1: what passes through ink (n, 4), straight alpha."""
    return np.asarray(1 - rgba[:, 3:] * (255 - rgba[:, :3]).astype(np.float32) / (255 * 255), dtype=np.float32)


def purest_ink(light: NDArray[np.floating]) -> NDArray[np.uint8]:
    """(n, 4), straight alpha: the purest ink through which so much light (n, 3) passes."""
    clear = light.min(axis=1, keepdims=True)
    colour = (light - clear) / np.maximum(1 - clear, 1e-6)
    ink = np.rint(np.concatenate([colour, 1 - clear], axis=1) * 255).astype(np.uint8)
    return np.where(ink[:, 3:] > 0, ink, 0)
