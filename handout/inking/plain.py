"""The plain pen: a line of even colour whose width follows pressure or speed, with round ends.

A stroke is cut into short straight pieces; each piece covers the pixels around it according to the distance of their
centres, and a pixel keeps the greatest coverage it was given.  So a line that crosses or retraces itself is one
line: an opaque pen leaves no darker spot there, and edges do not thicken.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.inking import curves
from handout.values import Array, Drawing, Raster, Stroke

_Pixels = NDArray[np.float32]

COLOUR = (0.1, 0.1, 0.18)  # a blue-black, device RGB
_FINEST = 0.02  # mm, no line is thinner
_LONGEST = 0.4  # mm, of a piece: the width is linear along it
_FLAT = 0.05  # pixels between a piece and the curve
_CHUNK = 1 << 17  # pixels worked on at a time: what fits a processor's cache


def widths(stroke: Stroke, width: float, variation: float = 0.15, pace: float = 30.0) -> Array:
    """(n,) float, mm: width of the line at each sample.

    The stroke's own `width` if it has one; else wider with pressure, `width` at a pressure of 0.5; else wider
    where the pen is slower, since more ink flows there: `width` at the speed `pace` (mm/s).

    Parameters
    ----------
    width : float
        mm.
    variation : float in 0–1
        By how much of `width` the line becomes wider at full pressure or at rest, and thinner at none or at
        high speed.
    """
    if stroke.width is not None:
        return np.maximum(stroke.width, _FINEST)
    if stroke.pressure is not None:
        lean = 2 * np.clip(stroke.pressure, 0.0, 1.0) - 1
    else:
        lean = (pace - stroke.speed) / (pace + stroke.speed)
    return np.maximum(width * (1 + variation * lean), _FINEST)


def ink(
    drawing: Drawing,
    dpi: float,
    *,
    width: float = 0.4,
    colour: tuple[float, float, float] = COLOUR,
    variation: float = 0.15,
) -> Raster:
    """Ink a drawing with a plain pen on a transparent page.

    Parameters
    ----------
    drawing : Drawing
    dpi : float
        20 to 4800.
    width : float
        Nominal width of the line, mm.
    colour : (r, g, b) in 0–1
    variation : float in 0–1
        See `widths`.

    Returns
    -------
    Raster
        The whole page, (h, w, 4); pixels without ink are all zeros, and take memory only where ink is near.

    Raises
    ------
    InputError
        A resolution, width or variation out of its bounds.
    """
    _check(dpi, width, variation)
    scale = dpi / 25.4
    rgba = np.zeros((max(1, round(drawing.page.height * scale)), max(1, round(drawing.page.width * scale)), 4), "f4")
    if drawing.strokes:
        _paint(rgba, _pieces(drawing, scale, width, variation), colour)
    return Raster(rgba, dpi)


def flatten(raster: Raster, paper: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> NDArray[np.uint8]:
    """(h, w, 3) uint8, device RGB: the raster on paper of an even colour (r, g, b in 0–1)."""
    height, width, _ = raster.rgba.shape
    base = np.asarray(paper, dtype=np.float32)
    flat = np.empty((height, width, 3), dtype=np.uint8)
    flat[:] = np.rint(np.clip(base, 0, 1) * 255)
    for top in range(0, height, 64):
        rows = raster.rgba[top : top + 64]
        y, x = np.nonzero(rows[..., 3])
        pixels = rows[y, x]
        mixed = base + (pixels[:, :3] - base) * pixels[:, 3:]
        flat[top + y, x] = np.rint(np.clip(mixed, 0, 1) * 255)
    return flat


def _check(dpi: float, width: float, variation: float) -> None:
    for name, value, least, greatest in (
        ("resolution (dpi)", dpi, 20, 4800),
        ("pen width (mm)", width, _FINEST, 50),
        ("variation", variation, 0, 1),
    ):
        if not least <= value <= greatest:
            raise InputError(f"{name}: {value:g} is outside {least:g} to {greatest:g}.")


def _pieces(drawing: Drawing, scale: float, width: float, variation: float) -> _Pixels:
    """(6, m) float64, pixels: x, y and half width at both ends of every straight piece."""
    fitted = curves.fit(drawing.strokes)
    held = [c if len(c.t) > 1 else curves.Curve(np.repeat(c.t, 2), np.repeat(c.points, 4, axis=0)) for c in fitted]
    corners = [np.concatenate([c.points[j : -3 + j or None : 3] for c in held]) for j in range(3)]
    return corners  # placeholder
