"""Lines of writing made straight and upright, all of one size, and the way back to the page.

Line space: pixels, x-height 20, baseline 60 rows down; u along the line, growing to the right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.scanning.text_lines import line_owners
from handout.tagging.features import ABOVE, HEIGHT, X_HEIGHT, Image
from handout.values import Array

_MARGIN = 40  # columns of paper on both sides
_SLANTS = np.arange(-0.3, 1.21, 0.05)


@dataclass(frozen=True)
class Frame:
    """Where a line of writing lies on its page, pixels.

    baseline : coefficients of its height, y = c₀ + c₁·d + c₂·d² …, d = x − middle.
    x_height : of its small letters.
    slant : tangent, dx for one up.
    left : x on the baseline where u = 0.
    middle, reach : beyond `reach` from the middle the baseline runs on straight.
    """

    baseline: tuple[float, ...]
    x_height: float
    slant: float = 0.0
    left: float = 0.0
    middle: float = 0.0
    reach: float = np.inf

    @property
    def scale(self) -> float:
        """Pixels of line space a pixel of the page."""
        return X_HEIGHT / self.x_height

    def base(self, x: ArrayLike) -> Array:
        """y of the baseline at x."""
        away = np.asarray(x, dtype=np.float64) - self.middle
        held = np.clip(away, -self.reach, self.reach)
        slope = np.polynomial.polynomial.polyder(self.baseline)
        run_on = (away - held) * np.polynomial.polynomial.polyval(held, slope)
        return np.asarray(np.polynomial.polynomial.polyval(held, self.baseline) + run_on)

    def to_page(self, u: ArrayLike, up: ArrayLike = 0.0) -> Array:
        """(n, 2): page pixels of places u along the line and `up` pixels of line space over its baseline."""
        height = np.broadcast_to(np.asarray(up, dtype=np.float64), np.shape(u)) / self.scale
        x = self.left + np.asarray(u) / self.scale + self.slant * height
        return np.stack([x, self.base(x) - height], axis=-1)

    def to_line(self, xy: Array) -> Array:
        """(n, 2): u and height over the baseline, pixels of line space, of page pixels (n, 2)."""
        x, y = np.asarray(xy, dtype=np.float64).T
        height = self.base(x) - y
        return np.column_stack([(x - self.left - self.slant * height) * self.scale, height * self.scale])


@dataclass(frozen=True, eq=False)
class Strip:
    """One line of a page, straightened.

    image : (HEIGHT, w) uint8, 255 is ink.
    frame : where it lies.
    """

    image: Image
    frame: Frame


def strips(mask: NDArray[np.bool_], frames: Sequence[Frame], slant: float | None = None) -> list[Strip]:
    """The lines of a page, straightened and made upright.

    Parameters
    ----------
    mask : (h, w) bool, where there is ink.
    frames : of the lines; their own slants are replaced.
    slant : tangent; without it the page's, found here.
    """
    own = line_owners(mask, frames)
    if slant is None:
        slant = slant_of([straightened(own == i, replace(f, slant=0.0)).image for i, f in enumerate(frames)])
    return [straightened(own == i, replace(frame, slant=slant)) for i, frame in enumerate(frames)]


def slant_of(images: Sequence[Image]) -> float:
    """The tangent of the slant of straightened lines: the shear that gathers their ink in the fewest columns."""
    import cv2

    found = []
    for image in images:
        sharpness = []
        for slant in _SLANTS:
            shear = np.array([[1, slant, -slant * ABOVE + HEIGHT], [0, 1, 0]], dtype=np.float32)
            upright = cv2.warpAffine(image, shear, (image.shape[1] + 2 * HEIGHT, HEIGHT))
            sharpness.append(float(np.square(upright.sum(axis=0, dtype=np.float64)).sum()))
        found.append(_SLANTS[int(np.argmax(sharpness))])
    return float(np.median(found))


def straightened(ink: NDArray[np.bool_], frame: Frame) -> Strip:
    """The ink of one line (h, w) in line space; `frame.left` is set to where the strip begins."""
    import cv2

    y, x = np.nonzero(ink)
    if len(x) == 0:
        return Strip(np.zeros((HEIGHT, 2 * _MARGIN), np.uint8), frame)
    feet = x - frame.slant * (frame.base(x) - y)
    scale = frame.scale
    left = float(feet.min()) - _MARGIN / scale
    placed = replace(frame, left=left)
    width = int((feet.max() - left) * scale) + _MARGIN
    top, bottom = int(y.min()), int(y.max()) + 1
    grey = ink[top:bottom].astype(np.uint8) * 255
    if scale < 1:
        grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), 0.45 / scale), dtype=np.uint8)
    u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(HEIGHT))
    places = placed.to_page(u, ABOVE - v).astype(np.float32)
    image = cv2.remap(grey, places[..., 0], places[..., 1] - np.float32(top), cv2.INTER_LINEAR)
    return Strip(np.asarray(image), placed)
