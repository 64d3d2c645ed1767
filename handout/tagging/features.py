"""What a column of a straightened line looks like: where strokes run around it, and in which direction.

The pen's width is thinned away; what is left is blurred a little and sampled in a window wide enough to hold a letter
and its neighbours, so that one look tells both the letter and how far into it the column lies.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]

X_HEIGHT = 20  # pixels
ABOVE, BELOW = 60, 40  # rows over and under the baseline
HEIGHT = ABOVE + BELOW
STEP = 2  # columns from one described column to the next
INKY = 110  # grey above which a pixel of a line's image is ink

DIRECTIONS = 4
_REACH, _ACROSS, _DOWN = 24, 4, 5  # half width of the window, and its grid
_ROWS = np.arange(2, HEIGHT, _DOWN)
_OFFSETS = np.arange(0, 2 * _REACH + 1, _ACROSS)
COUNT = DIRECTIONS * len(_ROWS) * len(_OFFSETS)
_FINE, _TENSOR, _BLUR = 1.2, 0.6, 2.2  # standard deviations of the three blurs, pixels
_SCALE = 100.0  # stored numbers a unit
_GAIN = 12.0
SPREAD_FLOOR = 10.0  # added to the spread of each feature, so that rare ones do not shout


def thinned(image: Image) -> NDArray[np.float32]:
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


def describe(image: Image) -> Image:
    """(n, COUNT) uint8: the features of every second column of a line's image (HEIGHT, w).

    They are square roots, in hundredths, so that a crossing counts little more than a stroke.
    """
    image = np.asarray(image)
    if image.ndim != 2 or image.shape[0] != HEIGHT:
        raise ValueError(f"expected ({HEIGHT}, w), got {image.shape}")
    channels = directions(np.pad(thinned(image), ((0, 0), (_REACH, _REACH))))
    roots = np.sqrt(np.maximum(channels[:, _ROWS], 0)) * _SCALE
    quantised = np.minimum(roots + 0.5, 255).astype(np.uint8)
    columns = np.arange(0, image.shape[1], STEP)[:, None] + _OFFSETS
    return np.ascontiguousarray(quantised[:, :, columns].transpose(2, 0, 1, 3)).reshape(len(columns), COUNT)
