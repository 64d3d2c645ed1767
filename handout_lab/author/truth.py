"""What is true of a simulated scan: every letter, path, density and matte.

Pixels are counted from the middle of the first, x to the right and y down, as in `LineGraph.uv`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handout.summary import one_line
from handout.values import Array, Drawing, Indices, Manuscript, readonly, readonly_indices

# Of the cover of one usual pass of the pen: where a line's edge is.  The middle between paper and ink would be .5, but
# light strokes and hairlines, blurred, never get there: at .5 a tenth of a ballpoint's line is lost, at a third hardly
# any.  People who paint masks paint them so, too: loops stay open down to .3 (handwriting specification, §2).
_EDGE = 1 / 3


@dataclass(frozen=True)
class Letter:
    """A written letter.

    text : its grapheme; at : its index among the graphemes of the text; its label in `Truth.labels` is at + 1.
    line : index of its line on the page; word : of its word.
    box : (left, top, right, bottom) pixels of its ink, right and bottom exclusive; None where no pixel is its own.
    """

    text: str
    at: int
    line: int
    word: int
    box: tuple[int, int, int, int] | None


@dataclass(frozen=True, eq=False)
class Path:
    """The way of the pen in one movement.

    xy : (n, 2) float, pixels.
    of : (n,) int, index of the letter's grapheme in the text.
    ligature : (n,) bool, on the way from the last point of a letter to the first of the next.
    """

    xy: Array
    of: Indices
    ligature: NDArray[np.bool_]

    __repr__ = one_line

    def __post_init__(self) -> None:
        object.__setattr__(self, "xy", readonly(self.xy, None, 2))
        object.__setattr__(self, "of", readonly_indices(self.of, len(self.xy)))


@dataclass(frozen=True)
class Split:
    """Where two joined letters part: (x, y) pixels, and the indices of their graphemes in the text.

    It is the middle, in motor time, of what is seen of the way between them: see `ink_ownership.parted`.
    """

    xy: tuple[float, float]
    before: int
    after: int


@dataclass(frozen=True, eq=False)
class Truth:
    """The truth about a scan of (h, w) pixels.

    labels : (h, w) int32, 1 + index in the text of the letter whose ink is seen, 0 where there is none.  Where
        letters cross or touch, a pixel belongs to the one whose path is nearer; the last written wins where both
        paths go through it.
    density : (h, w) float32, optical density of the ink before the scanner sees it, in the channel that it
        absorbs most: 1 for one usual pass of the pen, 0 without ink, about 2 where two lines cross.
    alpha : (h, w) float32, how much of the paper the ink hides in the picture (noise left out): the least share of
        a colour that, mixed with the clean paper, gives the pixel's colour.
    paper : (h, w, 3) like the picture: the scan of the same sheet without ink, dust and noise.
    usual : alpha of one usual pass.
    letters, paths, splits : in the order of writing.
    baselines : for each line (n, 2) float, pixels, from left to right.
    pixel : mm, side of a pixel; rule : pixels, distance of two lines; x_height : pixels; line : pixels, usual width
        of the pen's line.
    to_pixels : (2, 3) float: mm on the page to pixels.
    """

    labels: NDArray[np.int32]
    density: NDArray[np.float32]
    alpha: NDArray[np.float32]
    paper: NDArray[Any]
    usual: float
    letters: tuple[Letter, ...]
    paths: tuple[Path, ...]
    splits: tuple[Split, ...]
    baselines: tuple[Array, ...]
    pixel: float
    rule: float
    x_height: float
    line: float
    to_pixels: Array

    __repr__ = one_line

    def __post_init__(self) -> None:
        for name in ("labels", "density", "alpha", "paper"):
            pixels = getattr(self, name).view()
            pixels.flags.writeable = False
            object.__setattr__(self, name, pixels)

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """(h, w): where the picture shows ink: at least a third of what one usual pass of the pen hides."""
        return self.covered(_EDGE)

    def covered(self, share: float) -> NDArray[np.bool_]:
        """(h, w): where the ink hides at least `share` of what one usual pass of the pen hides."""
        return np.asarray(self.alpha >= share * self.usual)

    @cached_property
    def by_index(self) -> dict[int, Letter]:
        """The letters by the index of their grapheme."""
        return {letter.at: letter for letter in self.letters}


@dataclass(frozen=True, eq=False)
class Simulated:
    """A simulated scan and the truth about it.

    image : (h, w, 3) uint8 or uint16, device RGB.
    dpi : pixels an inch.
    manuscript, drawing : what was written, in mm on the page.
    """

    image: NDArray[Any]
    dpi: float
    truth: Truth
    manuscript: Manuscript
    drawing: Drawing

    __repr__ = one_line

    def __post_init__(self) -> None:
        pixels = self.image.view()
        pixels.flags.writeable = False
        object.__setattr__(self, "image", pixels)
