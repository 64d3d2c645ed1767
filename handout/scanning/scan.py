"""The two nouns of input: a `FilePicture` as a file holds it, and a `Scan`, which is a picture of known resolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handout.libraries import cv2
from handout.summary import one_line


@dataclass(frozen=True, eq=False)
class FilePicture:
    """What a file holds.

    rgb : (h, w, 3) uint8, device RGB.
    own : pixels per inch, as the file says; None if it does not.
    source : the file, with the number of the page if it holds several: for messages.
    photographed : whether a camera took it.
    """

    rgb: NDArray[np.uint8]
    own: float | None
    source: str
    photographed: bool = False

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class Scan:
    """A scanned page.

    rgb : (h, w, 3) uint8, device RGB, read-only.
    dpi : pixels per inch.
    source : where it came from, for messages.
    told : whether the resolution was given by the user (it is believed then) or read from the file; None where it is a
        guess.
    origin : (x, y) of the first pixel in the file's own picture, pixels (not 0 where a border was cut off).
    """

    rgb: NDArray[np.uint8]
    dpi: float
    source: str = "the scan"
    told: bool | None = True
    origin: tuple[int, int] = (0, 0)

    __repr__ = one_line

    def __post_init__(self) -> None:
        rgb = np.asarray(self.rgb)
        if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[2] != 3:
            raise ValueError(f"expected (h, w, 3) of uint8, got {rgb.shape} of {rgb.dtype}")
        if not (np.isfinite(self.dpi) and self.dpi > 0):
            raise ValueError(f"expected a resolution above 0, got {self.dpi}")
        rgb = rgb.view()
        rgb.flags.writeable = False
        object.__setattr__(self, "rgb", rgb)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width, pixels."""
        return int(self.rgb.shape[0]), int(self.rgb.shape[1])

    @property
    def pixel(self) -> float:
        """Side of a pixel, mm."""
        return 25.4 / self.dpi

    def turn_quarters(self, quarters: int) -> Scan:
        """The scan turned anticlockwise by a number of quarter turns; places count from its own first pixel."""
        rgb = np.ascontiguousarray(np.rot90(self.rgb, quarters))
        return Scan(rgb, self.dpi, self.source, self.told)

    def enlarge(self, factor: int) -> Scan:
        """The scan with so many times the pixels, each way; places in it count in these pixels."""
        rgb = cv2.resize(self.rgb, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
        x, y = self.origin
        return Scan(
            np.asarray(rgb, dtype=np.uint8), factor * self.dpi, self.source, self.told, (factor * x, factor * y)
        )

    def pixels(self, length: float) -> float:
        """A length in mm as pixels of this scan."""
        return length / self.pixel
