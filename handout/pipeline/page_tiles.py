"""The picture of a page in squares, at any size: of a hundred megapixels no more is worked out than is seen."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from handout.errors import InputError
from handout.hand.scanned import ScannedPage
from handout.libraries import cv2

TILE = 512  # pixels of a side of a tile
_LEVELS = 6  # the coarsest: an A3 page at 1200 dpi is one tile
_QUALITY = 88  # of tiles as JPEG, set by eye
_FADED = 0.5  # so strong is what of the scan was not taken for ink: it is seen, and seen to be none
_SEEN = 3  # the level from which that is not seen any more, and the scan of a large page need not be unpacked
_ROWS = 1024  # of a page that are made smaller at a time

Pixels = NDArray[np.uint8]


class Tiles:
    """The squares of one page.  Smaller sizes of its ink are made when they are first asked for, and kept."""

    def __init__(self, page: ScannedPage) -> None:
        self._texture, self._paper, self._shape, self._scan = page.texture, page.paper, page.shape, page.scan
        self._smaller: list[Pixels] = []
        self._tile = lru_cache(maxsize=64)(self._draw_tile)

    def shows(self, page: ScannedPage) -> bool:
        """Whether it is that page's picture."""
        return page.texture is self._texture

    def tile(self, level: int, column: int, row: int) -> bytes:
        """A square as JPEG; at `level` 1 it shows twice as much each way as at 0, and so on.

        Raises InputError: there is no such level, or the square is off the page.
        """
        if not 0 <= level <= _LEVELS:
            raise InputError(f"level: {level} is outside 0 to {_LEVELS}.")
        height, width = (-(-side // 2**level) for side in self._shape)
        if not (0 <= column * TILE < width and 0 <= row * TILE < height):
            raise InputError("That square is off the page.")
        return self._tile(level, column, row)

    def _draw_tile(self, level: int, column: int, row: int) -> bytes:
        height, width = (-(-side // 2**level) for side in self._shape)
        left, top = column * TILE, row * TILE
        right, low = min(left + TILE, width), min(top + TILE, height)
        picture = self._ground(level, (left, top, right, low))
        if self._scan is not None and level < _SEEN:
            part = self._scan.pixels[top * 2**level : low * 2**level, left * 2**level : right * 2**level]
            if level:
                part = np.asarray(cv2.resize(part, (right - left, low - top), interpolation=cv2.INTER_AREA))
            picture += _FADED * (part.astype(np.float32) - picture)
        while len(self._smaller) < level:
            finer = self._smaller[-1] if self._smaller else self._texture.pixels
            self._smaller.append(_halve(finer, not self._smaller, self._texture.blue_first))
        # (h, w, 4); made smaller, as `_premultiply` gives it
        ink = self._smaller[level - 1] if level else self._texture.pixels
        x, y = (at // 2**level for at in self._texture.corner)
        # of the ink's own pixels those within the square
        a, b = max(left, x), min(right, x + ink.shape[1])
        c, d = max(top, y), min(low, y + ink.shape[0])
        if a < b and c < d:
            part = ink[c - y : d - y, a - x : b - x]
            part = (part if level else _premultiply(part, self._texture.blue_first)).astype(np.float32)
            under = picture[c - top : d - top, a - left : b - left]
            picture[c - top : d - top, a - left : b - left] = under * (1 - part[:, :, 3:] / 255) + part[:, :, :3]
        made, data = cv2.imencode(".jpg", np.rint(picture).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        assert made
        return bytes(data)

    def _ground(self, level: int, box: tuple[int, int, int, int]) -> NDArray[np.float32]:
        """(h, w, 3) the paper of a square, blue first."""
        left, top, right, low = box
        high, wide = self._paper.shape[:2]
        x = ((np.arange(left, right) + 0.5) * 2**level / self._shape[1] * wide - 0.5).astype(np.float32)
        y = ((np.arange(top, low) + 0.5) * 2**level / self._shape[0] * high - 0.5).astype(np.float32)
        paper = self._paper[:, :, ::-1].astype(np.float32)
        across, down = np.meshgrid(x, y)
        return np.asarray(cv2.remap(paper, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))


def _premultiply(part: Pixels, blue_first: bool) -> Pixels:
    """(h, w, 4) some straight pixels with blue first, their colours multiplied by their opacity."""
    # the program does not care which colour is the first
    part = np.asarray(cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_RGBA2mRGBA), dtype=np.uint8)
    return part if blue_first else np.ascontiguousarray(part[:, :, [2, 1, 0, 3]])


def _halve(finer: Pixels, straight: bool, blue_first: bool) -> Pixels:
    """Half as large each way; `straight` pixels are laid first."""
    height, width = finer.shape[:2]
    half = np.zeros((-(-height // 2), -(-width // 2), 4), dtype=np.uint8)
    for top in range(0, height, _ROWS):
        part = finer[top : top + _ROWS]
        if straight:
            part = _premultiply(part, blue_first)
        if part.shape[0] % 2 or part.shape[1] % 2:
            part = np.pad(part, ((0, part.shape[0] % 2), (0, part.shape[1] % 2), (0, 0)), mode="edge")
        size = (part.shape[1] // 2, part.shape[0] // 2)
        half[top // 2 : top // 2 + size[1]] = cv2.resize(part, size, interpolation=cv2.INTER_AREA)
    return half
