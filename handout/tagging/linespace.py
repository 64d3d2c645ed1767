"""Lines of writing made straight and upright, all of one size, and the way back to the page.

Line space: pixels, x-height 20, baseline 60 rows down; u along the line, growing to the right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.tagging.features import ABOVE, HEIGHT, X_HEIGHT, Image
from handout.values import Array

_MARGIN = 40  # columns of paper on both sides
_MIDDLE, _BAND = 0.5, 0.55  # x-heights: where the body of a line lies, and half its height
_UPPER = 0.9  # a speck above a line is nearer to it than one as far below: ascenders, dots and accents
_SHARED = 0.25  # a component with so much of its ink in a second body belongs to both lines
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


def owners(mask: NDArray[np.bool_], frames: Sequence[Frame]) -> NDArray[np.int16]:
    """(h, w) int16: the number of the line that every pixel of ink belongs to, −1 for paper.

    A component belongs to the line in whose body it lies.  One that lies in the bodies of several is shared among them
    along its strokes: every pixel goes to the body that is nearest on the way through the ink.
    """
    import cv2

    count, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    y, x = np.nonzero(mask)
    part = label[y, x]
    over = np.stack([(frame.base(x) - y) / frame.x_height - _MIDDLE for frame in frames])
    inside = np.abs(over) < _BAND
    body = np.stack([np.bincount(part[line], minlength=count) for line in inside])
    away = np.where(over > 0, over * _UPPER, -over)
    far = np.stack([np.bincount(part, line, minlength=count) for line in away])
    most = body.max(axis=0)
    owner = np.where(most > 0, body.argmax(axis=0), far.argmin(axis=0)).astype(np.int16)
    own = np.where(mask, owner[label], np.int16(-1))
    for number in np.flatnonzero((body > _SHARED * np.maximum(most, 1)).sum(axis=0) > 1):
        left, top, wide, high, _ = stats[number]
        corner = (slice(top, top + high), slice(left, left + wide))
        piece = label[corner] == number
        lines = np.flatnonzero(body[:, number] > _SHARED * most[number])
        own[corner][piece] = _shared(piece, (left, top), frames, lines)[piece]
    return own


def _shared(
    piece: NDArray[np.bool_], corner: tuple[int, int], frames: Sequence[Frame], lines: NDArray[np.intp]
) -> NDArray[np.int16]:
    """(h, w) the line of every pixel of a component that lies in the bodies of several lines."""
    from skimage.segmentation import watershed

    y, x = np.nonzero(piece)
    seeds = np.zeros(piece.shape, dtype=np.int32)
    for number in lines:
        frame = frames[number]
        over = (frame.base(x + corner[0]) - y - corner[1]) / frame.x_height - _MIDDLE
        core = np.abs(over) < _BAND
        seeds[y[core], x[core]] = number + 1
    # on a level floor the flood from the bodies meets half way along the strokes
    flooded = watershed(np.zeros(piece.shape, np.uint8), seeds, mask=piece)  # type: ignore[no-untyped-call]
    return np.asarray(flooded - 1, dtype=np.int16)


def strips(mask: NDArray[np.bool_], frames: Sequence[Frame], slant: float | None = None) -> list[Strip]:
    """The lines of a page, straightened and made upright.

    Parameters
    ----------
    mask : (h, w) bool, where there is ink.
    frames : of the lines; their own slants are replaced.
    slant : tangent; without it the page's, found here.
    """
    own = owners(mask, frames)
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
