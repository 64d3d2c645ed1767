"""The person at the simulated printer: writes in the field of a chart with the pen of a handwriting."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.simulated.scanner import Flatbed
from handout.simulated.sheet import SimulatedSheet, WrittenSheet
from handout.simulated.spectra import WAVELENGTHS
from handout.values import Array

_ROUNDS = 12  # of the fixed-point iteration; set by eye
_INSET = 0.8  # mm from the frame
_BLUR = 0.06  # mm, standard deviation of what a scan at 300 dpi makes of a point
_MOST = 2.5  # of the usual amount


def ink_of(colour: Array, paper: Array, flatbed: Flatbed) -> Array:
    """(31,) density of an ink that a flatbed shows as `colour` on paper that it shows as `paper`, (3,) in 0–1.

    Between the middles of the sensor's colours it runs straight.
    """
    bands = flatbed.bands
    wanted = np.clip(np.asarray(colour) / np.asarray(paper), 0.02, 1.0) ** flatbed.gamma
    at = np.argmax(bands, axis=0)
    order = np.argsort(at)
    density = -np.log10(wanted)
    for _ in range(_ROUNDS):
        spectrum = np.interp(WAVELENGTHS, WAVELENGTHS[at[order]], density[order])
        density = np.maximum(density + np.log10((10**-spectrum @ bands) / wanted), 0)
    return np.interp(WAVELENGTHS, WAVELENGTHS[at[order]], density[order])


def write_on_sheet(sheet: SimulatedSheet, field: tuple[float, float, float, float], amount: NDArray[Any], dpi: float,
            density: Array, sharpened: float = 0.0) -> SimulatedSheet:  # fmt: skip
    """A sheet on which somebody wrote.

    Parameters
    ----------
    field : left, top, right, bottom, mm, of the frame; what does not fit into it is left out.
    amount : (h, w), how much ink, 1 where it is usual, at `dpi`.
    density : (31,) of the ink, see `WrittenSheet`.
    sharpened : how much is put back of what an earlier scan of the writing has blurred.
    """
    import cv2

    scale = sheet.dpi / 25.4
    left, top, right, bottom = (round(edge * scale) for edge in np.add(field, (_INSET, _INSET, -_INSET, -_INSET)))
    size = (round(amount.shape[1] * sheet.dpi / dpi), round(amount.shape[0] * sheet.dpi / dpi))
    ink = cv2.resize(np.asarray(amount, dtype=np.float32), size, interpolation=cv2.INTER_LINEAR)
    if sharpened:
        ink = ink + sharpened * (ink - cv2.GaussianBlur(ink, (0, 0), max(0.3, _BLUR * scale)))
    inked = np.clip(ink[: bottom - top, : right - left], 0, _MOST).astype(np.float32)
    return replace(sheet, written=(*sheet.written, WrittenSheet((top, left), inked, np.asarray(density))))
