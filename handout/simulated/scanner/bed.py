"""Where a sheet lies on the scanner's glass, and what is seen of it and of the lid."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handout.simulated.scanner.scanner import Scanner
from handout.values import Array, Drawing, Page, readonly

_SEEN = 6.0  # mm of the shadow beside a sheet
_DEPTH = 1.1  # mm: the shadow's, which falls off as exp(−d / depth)


@dataclass(frozen=True, eq=False)
class Bed:
    """A sheet on the glass.

    sheet : the sheet; glass : what is scanned, whose top left corner is the picture's.
    turn : (2, 3) float: places on the sheet, mm, to places on the glass, mm.
    dpi : pixels an inch of the picture.
    """

    sheet: Page
    glass: Page
    turn: Array
    dpi: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "turn", readonly(self.turn, 2, 3))

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the picture, pixels."""
        scale = self.dpi / 25.4
        return max(1, round(self.glass.height * scale)), max(1, round(self.glass.width * scale))

    @cached_property
    def to_pixels(self) -> Array:
        """(2, 3) float: places on the sheet, mm, to pixels of the picture, (0, 0) the middle of the first."""
        matrix = self.turn * (self.dpi / 25.4)
        matrix[:, 2] -= 0.5
        return readonly(matrix, 2, 3)

    def pixels(self, xy: Array) -> Array:
        """(n, 2) pixels of places (n, 2) mm on the sheet."""
        return np.asarray(xy @ self.to_pixels[:, :2].T + self.to_pixels[:, 2])

    def lay(self, drawing: Drawing) -> Drawing:
        """What was drawn on the sheet, as it lies on the glass."""
        strokes = (replace(s, xy=s.xy @ self.turn[:, :2].T + self.turn[:, 2]) for s in drawing.strokes)
        return Drawing(tuple(strokes), self.glass, drawing.about)


def lay(page: Page, dpi: float, scanner: Scanner, rng: np.random.Generator) -> Bed:
    """Lay a sheet on the glass.  The same state of `rng` gives the same place at any resolution."""
    turned, aside = rng.normal(0.0, scanner.skew), rng.normal(0.0, scanner.slack, 2)
    angle = turned if scanner.rotation is None else scanner.rotation
    move = aside if scanner.offset is None else np.asarray(scanner.offset)
    c, s = math.cos(angle), math.sin(angle)
    matrix = np.array([[c, -s], [s, c]])
    middle = np.array([page.width, page.height]) / 2
    shift = middle - matrix @ middle + move + scanner.border
    glass = Page(page.width + 2 * scanner.border, page.height + 2 * scanner.border, page.name)
    return Bed(page, glass, np.column_stack([matrix, shift]), dpi)


def seen(bed: Bed, paper: NDArray[np.uint8], scanner: Scanner) -> NDArray[np.uint8]:
    """(h, w, 3) uint8: what lies on the glass: the paper (h', w', 3), turned, and the lid with the sheet's shadow."""
    import cv2

    lid = round(255 * scanner.lid)
    unit = 25.4 / bed.dpi
    margin = max(2, round(_SEEN / unit))
    height, width = paper.shape[:2]
    around = np.full((height + 2 * margin, width + 2 * margin, 3), lid, dtype=np.uint8)
    _shade(around, margin, unit, scanner)
    around[margin:-margin, margin:-margin] = paper
    matrix = bed.turn.copy()
    # places of pixels (their middles) on the padded sheet to those on the glass
    matrix[:, 2] = matrix[:, 2] / unit - 0.5 + matrix[:, :2] @ np.full(2, 0.5 - margin)
    size = (bed.shape[1], bed.shape[0])
    kind = cv2.INTER_CUBIC if np.abs(matrix - np.round(matrix)).max() > 1e-9 else cv2.INTER_NEAREST
    turned = cv2.warpAffine(
        around, matrix, size, flags=kind, borderMode=cv2.BORDER_CONSTANT, borderValue=(lid, lid, lid)
    )
    return np.asarray(turned, dtype=np.uint8)


def _shade(around: NDArray[np.uint8], margin: int, unit: float, scanner: Scanner) -> None:
    """The shadow of the sheet's edge on the lid, which is a little further away than the glass."""
    away = (np.arange(margin) + 0.5)[::-1] * unit
    light = 255 * scanner.lid * (1 - scanner.shadow * np.exp(-away / _DEPTH))
    ring = np.rint(light).astype(np.uint8)
    for i, value in enumerate(ring.tolist()):
        around[i : len(around) - i, [i, -1 - i]] = value
        around[[i, -1 - i], i : around.shape[1] - i] = value
