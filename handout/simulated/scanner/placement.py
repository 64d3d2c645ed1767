"""Where a sheet lies on the scanner's glass, how it bends, and the dust on the glass."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handout.simulated.scanner.flatbed import FlatbedSettings
from handout.values import Array, Drawing, Page, readonly

Floats = NDArray[np.float32]

_ORDER = 4  # cosines a side of the warp: what bends faster than a quarter of the sheet is a fold
_FINER = 4  # bits of a pixel's place
# dust, set by eye beside real scans: most is finer than a pen's line
_SIZE, _SPREAD, _LARGEST = 0.035, 0.5, 0.25  # mm radius, of its logarithm, mm
_HAIRS = 0.2  # of all specks
_CLEAR = (0.35, 0.9)  # light that a speck lets pass


@dataclass(frozen=True, eq=False)
class GlassPlacement:
    """A sheet on the glass.

    sheet : the sheet; glass : what is scanned, whose top left corner is the picture's.
    to_glass, to_sheet : (2, 3) float: from mm on the sheet to mm on the glass, and back, for a sheet without warp.
    bends : (2, k, k) cosines of the warp, mm.
    dpi : pixels an inch of the picture.
    """

    sheet: Page
    glass: Page
    to_glass: Array
    to_sheet: Array
    bends: Array
    dpi: float

    def __post_init__(self) -> None:
        for name in ("to_glass", "to_sheet"):
            object.__setattr__(self, name, readonly(getattr(self, name), 2, 3))

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the picture, pixels."""
        scale = self.dpi / 25.4
        return max(1, round(self.glass.height * scale)), max(1, round(self.glass.width * scale))

    @cached_property
    def to_pixels(self) -> Array:
        """(2, 3) float: places on the sheet, mm, to pixels of the picture, (0, 0) the middle of the first."""
        matrix = self.to_glass * (self.dpi / 25.4)
        matrix[:, 2] -= 0.5
        return readonly(matrix, 2, 3)

    def pixels(self, xy: Array) -> Array:
        """(n, 2) pixels of places (n, 2) mm on the sheet."""
        return np.asarray(xy @ self.to_pixels[:, :2].T + self.to_pixels[:, 2])

    def lay(self, drawing: Drawing) -> Drawing:
        """A drawing on the sheet, as it lies on the glass."""
        strokes = (replace(s, xy=s.xy @ self.to_glass[:, :2].T + self.to_glass[:, 2]) for s in drawing.strokes)
        return Drawing(tuple(strokes), self.glass, drawing.about)

    def on_sheet(self, rows: Array) -> tuple[Floats, Floats]:
        """(n, w) x and y on the sheet, mm, of the middles of all pixels in `rows` (n,), with the warp."""
        unit = 25.4 / self.dpi
        x, y = ((np.arange(self.shape[1]) + 0.5) * unit)[None, :], ((rows + 0.5) * unit)[:, None]
        u, v = x[0] / self.glass.width, y[:, 0] / self.glass.height
        (a, b, c), (d, e, f) = self.to_sheet
        across, down = a * x + b * y + c, d * x + e * y + f
        if self.bends.any():
            across += smooth_field(self.bends[0], u, v)
            down += smooth_field(self.bends[1], u, v)
        return across.astype(np.float32), down.astype(np.float32)


def lay(page: Page, dpi: float, flatbed: FlatbedSettings, rng: np.random.Generator) -> GlassPlacement:
    """Lay a sheet on the glass.  The same state of `rng` gives the same place at any resolution."""
    turned, aside = rng.normal(0.0, flatbed.skew), rng.normal(0.0, flatbed.slack, 2)
    angle = turned if flatbed.rotation is None else flatbed.rotation
    move = aside if flatbed.offset is None else np.asarray(flatbed.offset)
    cos, sin = math.cos(angle), math.sin(angle)
    size = np.array([page.width, page.height])
    # a sheet that lies on its side needs a glass that does too
    upright = abs(cos) >= abs(sin)
    room = size if upright else size[::-1]
    width, height = (room + 2 * flatbed.border).tolist()
    glass = Page(width, height, page.name)
    there, back = np.array([[cos, -sin], [sin, cos]]), np.array([[cos, sin], [-sin, cos]])
    shift = size / 2 - there @ (size / 2) + move + flatbed.border + (room - size) / 2
    return_shift = size / 2 - back @ (np.array([glass.width, glass.height]) / 2 + move)
    to_glass, to_sheet = np.column_stack([there, shift]), np.column_stack([back, return_shift])
    return GlassPlacement(page, glass, to_glass, to_sheet, bends(flatbed.warp, rng), dpi)


def bends(most: float, rng: np.random.Generator) -> Array:
    """(2, k, k) cosines of a smooth shift that is `most` mm where it is greatest."""
    u = np.linspace(0, 1, 41)
    fields = rng.normal(0.0, 1.0, (2, _ORDER, _ORDER)) / (1 + np.add.outer(np.arange(_ORDER), np.arange(_ORDER)))
    fields[:, 0, 0] = 0
    size = np.hypot(smooth_field(fields[0], u, u), smooth_field(fields[1], u, u)).max()
    return np.asarray(fields * (most / size))


def smooth_field(cosines: Array, u: Array, v: Array) -> Array:
    """(n, m) a sum of cosines (k, k) at u (m,) across and v (n,) down, both 0–1."""
    order = np.arange(len(cosines))
    return np.asarray(np.cos(np.pi * np.outer(v, order)) @ cosines @ np.cos(np.pi * np.outer(order, u)))


def dust(place: GlassPlacement, flatbed: FlatbedSettings, rng: np.random.Generator) -> Floats | None:
    """(h, w) float32 in 0–1: light that specks and short hairs on the glass let pass; None where it is clean."""
    import cv2

    area = place.glass.width * place.glass.height / 1e4
    count = int(rng.poisson(flatbed.dust * area))
    if not count:
        return None
    scale = place.dpi / 25.4
    clear = np.full(place.shape, 255, dtype=np.uint8)
    for _ in range(count):
        at = rng.uniform((0.0, 0.0), (place.glass.width, place.glass.height)) * scale - 0.5
        grey = round(255 * rng.uniform(*_CLEAR))
        size = min(_SIZE * math.exp(rng.normal(0.0, _SPREAD)), _LARGEST) * scale
        if rng.random() < _HAIRS:
            # a bent fibre of a millimetre or so
            heading = rng.uniform(0, 2 * math.pi) + np.cumsum(rng.normal(0.0, 0.25, 12))
            step = rng.uniform(0.05, 0.2) * scale
            fibre = at + np.cumsum(step * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
            points = np.rint(fibre * 2**_FINER).astype(np.int32)[:, None]
            cv2.polylines(clear, [points], False, grey, max(1, round(0.7 * size)), cv2.LINE_AA, _FINER)
        else:
            middle = tuple(np.rint(at * 2**_FINER).astype(int).tolist())
            cv2.circle(clear, middle, round(size * 2**_FINER), grey, -1, cv2.LINE_AA, _FINER)
    return clear.astype(np.float32) * np.float32(1 / 255)
