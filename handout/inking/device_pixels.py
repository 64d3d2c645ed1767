"""The colour of every pixel that a printer gets, or that a PDF of pixels holds, decided in one function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.inking.plain import flatten
from handout.values import Raster

# ink as it is → ink in the colours by which a printer makes it look so; paper stays transparent
Calibrate = Callable[[Raster], Raster]
WHITE = 255  # of 8 bits a channel, the most there is: device RGB that puts no ink on the paper


@dataclass(frozen=True, eq=False)
class DevicePixels:
    """Pixels on white as they are sent.

    rgb : (h, w, 3) uint8, device RGB; dpi : pixels an inch; origin : mm, the first pixel's upper left corner.
    """

    rgb: NDArray[np.uint8]
    dpi: float
    origin: tuple[float, float] = (0.0, 0.0)

    def crop_white(self) -> tuple[NDArray[np.uint8], int, int] | None:
        """The part that is not all white, and the pixel of the sheet at its corner; None if everything is white."""
        # a row's bytes as one: numpy takes many times as long over two axes at once
        rows = np.flatnonzero(self.rgb.reshape(len(self.rgb), -1).min(axis=1, initial=WHITE) != WHITE)
        if len(rows) == 0:
            return None
        top, inked = int(rows[0]), self.rgb[rows[0] : rows[-1] + 1]
        columns = np.flatnonzero(inked.min(axis=0).min(axis=1) != WHITE)
        x, y = (round(offset * self.dpi / 25.4) for offset in self.origin)
        left = int(columns[0])
        return inked[:, left : int(columns[-1]) + 1], x + left, y + top

    def trim_white(self) -> DevicePixels:
        """A copy without the white around it; itself, if all is white."""
        found = self.crop_white()
        if found is None:
            return self
        rgb, x, y = found
        left, top = (first - round(at * self.dpi / 25.4) for first, at in zip((x, y), self.origin, strict=True))
        pitch = 25.4 / self.dpi
        return DevicePixels(rgb.copy(), self.dpi, (self.origin[0] + left * pitch, self.origin[1] + top * pitch))


def device_pixels(ink: Raster, calibrate: Calibrate | None = None) -> DevicePixels:
    """The ink of a page as pixels for a printer.

    The ink, with its own colour and cover, goes through the printer's calibration (the correction by its pen and the
    colour table), is laid on white by its cover, and is rounded to the nearest of 256 levels.

    ink : as a pen or a scanned hand leaves it.
    calibrate : the calibration of printer and paper; without one colours are sent as they are.
    """
    raster = ink if calibrate is None else calibrate(ink)
    first, end = raster.rows or (0, len(raster.rgba))
    rows = Raster(raster.rgba[first : max(end, first + 1)], raster.dpi)  # the others are white
    return DevicePixels(flatten(rows), raster.dpi, (raster.origin[0], raster.origin[1] + first * 25.4 / raster.dpi))
