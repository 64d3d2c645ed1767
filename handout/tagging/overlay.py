"""An aligned page to look at: borders of letters, leaning as the writing does, and the letters over them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from handout.tagging.alignment import DOUBTFUL, AlignedLine, Alignment, Letter

_COLOURS = ((208, 32, 32), (32, 96, 208))  # of every other letter
_DOUBTED = (224, 136, 0)
_UP, _DOWN = 2.1, 0.9  # x-heights that borders reach over and under the baseline
_PALE = 0.55  # of the page's own darkness that is kept


def overlay(rgb: NDArray[np.uint8], alignment: Alignment, zoom: float = 1.0) -> NDArray[np.uint8]:
    """A copy of the page, paler, with the alignment drawn over it.

    Parameters
    ----------
    rgb : (h, w, 3) uint8, the page.
    zoom : pixels of the picture a pixel of the page.

    Returns
    -------
    (zoom·h, zoom·w, 3) uint8: borders in red and blue by turns, doubtful letters in orange; a letter that was not found
    has no border and no name.
    """
    import cv2

    large = np.asarray(cv2.resize(rgb, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_CUBIC))
    picture = np.asarray(255 - _PALE * (255 - large.astype(np.float32)), dtype=np.uint8)
    for line in alignment.lines:
        for number, letter in enumerate(line.letters):
            if letter.present:
                _draw(picture, line, letter, _colour(letter, number), zoom)
    return np.asarray(picture)


def _colour(letter: Letter, number: int) -> tuple[int, int, int]:
    return _DOUBTED if letter.confidence < DOUBTFUL else _COLOURS[number % 2]


def _draw(picture: NDArray[np.uint8], line: AlignedLine, letter: Letter, colour: Sequence[int], zoom: float) -> None:
    import cv2

    frame = line.frame
    u = (np.array([letter.left, letter.right]) - frame.left) * frame.scale
    unit = frame.x_height * frame.scale
    for side, inward in zip(u, (0.04, -0.04), strict=True):
        ends = frame.to_page(np.full(2, side + inward * unit), np.array([_UP, -_DOWN]) * unit) * zoom
        start, stop = (tuple(int(v) for v in np.rint(end)) for end in ends)
        cv2.line(picture, start, stop, tuple(colour), 1, cv2.LINE_AA)
    size = frame.x_height * zoom / 45
    name = letter.text if letter.text.isascii() else "#"
    (width, _), _ = cv2.getTextSize(name, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    x, y = frame.to_page(np.array([u.mean()]), (_UP + 0.1) * unit)[0] * zoom
    place = (round(float(x) - width / 2), round(float(y)))
    cv2.putText(picture, name, place, cv2.FONT_HERSHEY_SIMPLEX, size, tuple(colour), 1, cv2.LINE_AA)
