"""Line space: lines of writing made straight and upright, all of one size, and back; and features of their columns.

Line space has pixels, an x-height of 20, and its baseline 60 rows down; u runs along the line, to the right.

The features of a column say where strokes run around it, and in which direction.  The pen's width is thinned away; what
is left is blurred a little and sampled in a window wide enough to hold a letter and its neighbours, so that one column
tells both the letter and how far into it the column lies.

Source: own method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.scanning.text_lines import line_owners
from handout.values import Array, Indices

if TYPE_CHECKING:
    from handout.scanning.text_lines import TextLines
    from handout.scanning.written_page import WrittenPage


Image = NDArray[np.uint8]

X_HEIGHT = 20  # pixels
ABOVE, BELOW = 60, 40  # rows over and under the baseline
HEIGHT = ABOVE + BELOW
STEP = 2  # columns from one described column to the next
INKY = 110  # grey above which a pixel of a line's image is ink

DIRECTIONS = 4  # soft bins of the direction of strokes, 45° apart
_REACH, _ACROSS, _DOWN = 24, 4, 5  # half width of the window, and its grid
_ROWS = np.arange(2, HEIGHT, _DOWN)
_OFFSETS = np.arange(0, 2 * _REACH + 1, _ACROSS)
COUNT = DIRECTIONS * len(_ROWS) * len(_OFFSETS)
_FINE, _TENSOR, _BLUR = 1.2, 0.6, 2.2  # standard deviations of the three blurs, pixels
_SCALE = 100.0  # stored numbers a unit
_GAIN = 12.0
_MARGIN = 40  # columns of paper on both sides
_SLANTS = np.arange(-0.3, 1.21, 0.05)


def thin_image(image: Image) -> NDArray[np.float32]:
    """(HEIGHT, w) float32, 1 on the middle of every stroke, 0 elsewhere."""
    from skimage.morphology import skeletonize

    middle: NDArray[np.bool_] = skeletonize(image > INKY)  # type: ignore[no-untyped-call]
    return middle.astype(np.float32)


def directions(line: NDArray[np.float32]) -> NDArray[np.float32]:
    """(4, HEIGHT, w): the thinned strokes, each shared among four directions a quarter turn of the pen apart, blurred.

    The direction is that of the structure tensor's weaker axis, here from second derivatives.
    """
    import cv2

    soft = cv2.GaussianBlur(line, (0, 0), _FINE)
    xx, yy, xy = (
        cv2.GaussianBlur(cv2.Sobel(soft, cv2.CV_32F, i, j), (0, 0), _TENSOR) for i, j in ((2, 0), (0, 2), (1, 1))
    )
    double = np.arctan2(2 * xy, xx - yy)  # twice the angle of the normal
    bins = [np.maximum(np.cos(double - k * np.pi / 2), 0) ** 2 * line for k in range(DIRECTIONS)]
    blurred = np.stack([cv2.GaussianBlur(part, (0, 0), _BLUR) for part in bins])
    return np.asarray(blurred * np.float32(_GAIN), dtype=np.float32)


def column_count(image: Image) -> int:
    """How many columns of a line's image (HEIGHT, w) are described."""
    return int(-(-image.shape[1] // STEP))


def describe(image: Image, columns: Indices | None = None) -> Image:
    """(n, COUNT) uint8: the features of every second column of a line's image (HEIGHT, w), or of some of them.

    They are square roots, in hundredths, so that a crossing counts little more than a stroke.

    image : (HEIGHT, w) uint8
    columns : (n,) int, optional: which of the `column_count` described columns.
    """
    image = np.asarray(image)
    if image.ndim != 2 or image.shape[0] != HEIGHT:
        raise ValueError(f"expected ({HEIGHT}, w), got {image.shape}")
    channels = directions(np.pad(thin_image(image), ((0, 0), (_REACH, _REACH))))
    roots = np.sqrt(np.maximum(channels[:, _ROWS], 0)) * _SCALE
    quantised = np.minimum(roots + 0.5, 255).astype(np.uint8)
    described = np.arange(column_count(image)) if columns is None else columns
    windows = (described * STEP)[:, None] + _OFFSETS
    return np.ascontiguousarray(quantised[:, :, windows].transpose(2, 0, 1, 3)).reshape(len(windows), COUNT)


@dataclass(frozen=True)
class LineFrame:
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


def frames(page: WrittenPage) -> list[LineFrame]:
    """The lines of a page in its own pixels, 0 the middle of the first one."""
    return frames_of(page.text_lines, page.scan.pixel)


def frames_of(text_lines: TextLines, pixel: float) -> list[LineFrame]:
    """Written lines as frames in pixels of `pixel` mm, 0 the middle of the first one."""
    return [
        LineFrame(
            baseline=(line.curve[0] / pixel - 0.5, line.curve[1], line.curve[2] * pixel),
            x_height=text_lines.x_height / pixel,
            slant=text_lines.slant,
            middle=line.middle / pixel - 0.5,
            reach=(line.right - line.left) / 2 / pixel,
        )
        for line in text_lines.lines
    ]


def vertex_lines(page: WrittenPage) -> Indices:
    """(n,) int: the text line that each vertex of a page's graph belongs to, −1 for none."""
    return lines_at(line_owners(page.mask.ink, frames(page)), page.graph.uv)


def lines_at(owner: NDArray[np.integer], uv: Array) -> Indices:
    """(n,) the line that the ink at places (n, 2) in pixels belongs to, looking one pixel around; −1 for none."""
    x, y = (np.clip(np.rint(uv[:, k]).astype(np.intp), 1, owner.shape[1 - k] - 2) for k in (0, 1))
    line = owner[y, x].astype(np.intp)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            line = np.where(line < 0, owner[y + dy, x + dx], line)
    return line


@dataclass(frozen=True, eq=False)
class LineStrip:
    """One line of a page, straightened.

    image : (HEIGHT, w) uint8, 255 is ink.
    frame : where it lies.
    """

    image: Image
    frame: LineFrame


_straight: WeakKeyDictionary[TextLines, list[LineStrip]] = WeakKeyDictionary()


def straight_lines(ink: NDArray[np.bool_], text_lines: TextLines, pixel: float) -> list[LineStrip]:
    """`strips` of the lines that were found in some ink, of pixels of `pixel` mm, each page's once; none of none."""
    if text_lines not in _straight:
        _straight[text_lines] = strips(ink, frames_of(text_lines, pixel)) if text_lines.lines else []
    return _straight[text_lines]


def strips(mask: NDArray[np.bool_], frames: Sequence[LineFrame]) -> list[LineStrip]:
    """The lines of a page, straightened and made upright.

    mask : (h, w) bool, where there is ink.
    frames : of the lines; their own slants are replaced by the page's, found here.
    """
    owners = line_owners(mask, frames)
    # the rows that each line takes: looking through the whole page for every line would take most of the time
    rows = [np.flatnonzero((owners == i).any(axis=1)) for i in range(len(frames))]
    spans = [(int(of_line[0]), int(of_line[-1]) + 1) if len(of_line) else (0, 0) for of_line in rows]
    inks = [(owners[top:bottom] == i, top) for i, (top, bottom) in enumerate(spans)]
    flat = [straighten_line(*ink, replace(frame, slant=0.0)) for ink, frame in zip(inks, frames, strict=True)]
    slant = median_slant([strip.image for strip in flat])
    return [straighten_line(*ink, replace(frame, slant=slant)) for ink, frame in zip(inks, frames, strict=True)]


def median_slant(images: Sequence[Image]) -> float:
    """The tangent of the slant of straightened lines: the shear that gathers their ink in the fewest columns."""
    import cv2

    slants = []
    for image in images:
        sharpness = []
        for slant in _SLANTS:
            shear = np.array([[1, slant, -slant * ABOVE + HEIGHT], [0, 1, 0]], dtype=np.float32)
            upright = cv2.warpAffine(image, shear, (image.shape[1] + 2 * HEIGHT, HEIGHT))
            sharpness.append(float(np.square(upright.sum(axis=0, dtype=np.float64)).sum()))
        slants.append(_SLANTS[int(np.argmax(sharpness))])
    return float(np.median(slants))


def straighten_line(ink: NDArray[np.bool_], first: int, frame: LineFrame) -> LineStrip:
    """The ink of one line, rows of the page from `first` on, in line space; `frame.left` is where the strip begins."""
    import cv2

    y, x = np.nonzero(ink)
    if len(x) == 0:
        return LineStrip(np.zeros((HEIGHT, 2 * _MARGIN), np.uint8), frame)
    y += first
    feet = x - frame.slant * (frame.base(x) - y)
    scale = frame.scale
    left = float(feet.min()) - _MARGIN / scale
    placed = replace(frame, left=left)
    width = int((feet.max() - left) * scale) + _MARGIN
    top, bottom = int(y.min()), int(y.max()) + 1
    grey = ink[top - first : bottom - first].astype(np.uint8) * 255
    if scale < 1:
        grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), 0.45 / scale), dtype=np.uint8)
    u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(HEIGHT))
    places = placed.to_page(u, ABOVE - v).astype(np.float32)
    image = cv2.remap(grey, places[..., 0], places[..., 1] - np.float32(top), cv2.INTER_LINEAR)
    return LineStrip(np.asarray(image), placed)
