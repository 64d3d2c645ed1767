"""Flatbeds that are worn, that correct by themselves, or that scan handwriting: what the product's scanner lacks.

The settings for handwriting follow real scans, measured on 27 grey and 8 colour pages at 300 dpi by ballpoint and on
3 colour pages at 400 dpi on old paper:

- The steepest tenth of stroke edges rises by .42–.46 of the ink's depth within a pixel of 300 dpi (the median .35).
- Paper is white: its median is 255 on every page, .07–.5 of 255 is its standard deviation, 0.3–11 % of it is below
  255, and what is below is coarser than a pixel (neighbours correlate by .6, every fourth pixel by .05).  The old
  paper lies at (212, 202, 177) ± 3.4 and its light varies by 3 % over the page.
- Red and blue lie .02–.16 pixels beside green, mostly along one side of the sheet.
- Stroke cores of black ballpoint lie at 97–130 of 255, of blue at about (105, 105, 180) in dark, (155, 150, 220) in
  pale pages.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from handout.errors import InputError
from handout.simulated.flatbed import Flatbed, Floats, GlassPlacement, Kernels, Picture, Stain, Tone, bell, smooth_field
from handout.simulated.spectra import SimulatedSheet
from handout.values import Array, Page

# beyond these a picture is none, or the formulas leave their range; set by eye
_BOUNDS = {
    "flare": (0.0, 0.3), "glare": (0.0, 1.0), "shadow": (0.0, 1.0), "warp": (0.0, 10.0), "dust": (0.0, 1000.0),
    "jpeg": (0, 100),
}  # fmt: skip
_FURTHEST = 1.0  # mm, of colours beside each other
_STILL = ((0.0, 0.0), (0.0, 0.0))  # mm: red and blue lie exactly on green
# flare, glare and what automatic programs aim at: set by eye, for tests of what names them
_FLARE = 8.0  # mm, how far flare reaches (standard deviation)
_FLARE_DPI = 25.4  # pixels of its field: a millimetre
_STREAK = 12.0  # mm, half the width of glare
_TAIL = 0.2  # per cent of the pixels that automatic levels give up at either end
_MIDDLE = 0.55  # to which automatic gamma brings the mean
_ORDER = 4  # cosines a side of the warp: what bends faster than a quarter of the sheet is a fold
_FINER = 4  # bits of a pixel's place
# dust, set by eye beside real scans: most is finer than a pen's line
_SIZE, _SPREAD, _LARGEST = 0.035, 0.5, 0.25  # mm radius, of its logarithm, mm
_HAIRS = 0.2  # of all specks
_CLEAR = (0.35, 0.9)  # light that a speck lets pass


@dataclass(frozen=True)
class WornFlatbed(Flatbed):
    """What a flatbed scanner does to a sheet besides what `Flatbed` says.

    automatic : the scanner stretches every colour from its darkest to its lightest, and sets gamma by the mean.
    flare : share of every pixel's light that comes from its surroundings, a centimetre or so.
    glare : light, of 1, that the middle of a bright streak across the sheet adds.
    warp : mm, how far paper that does not lie flat is shifted where it is most.
    shadow : share of its light that the lid loses beside the sheet's edge (of written sheets).
    misregistration : (x, y) mm of red and of blue beside green.
    dust : specks and short hairs on the glass, of a square decimetre.
    crop : (top, right, bottom, left) mm that are missing from the picture.
    grey : red, green and blue are all the mean of the three.
    jpeg : quality with which the picture was kept, 1–100, 8 bits only; 0: without loss.

    Raises InputError: a value out of its bounds.
    """

    automatic: bool = False
    flare: float = 0.0
    glare: float = 0.0
    shadow: float = 0.0
    misregistration: tuple[tuple[float, float], tuple[float, float]] = _STILL
    warp: float = 0.0
    dust: float = 0.0
    crop: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    grey: bool = False
    jpeg: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check(_BOUNDS)
        if self.jpeg and self.bits != 8:
            raise InputError(f"flatbed: {self.bits} bits: use 8 for JPEG.")
        if not all(abs(value) <= _FURTHEST for pair in self.misregistration for value in pair):
            raise InputError(
                f"flatbed: misregistration {self.misregistration} is outside −{_FURTHEST:g} to {_FURTHEST:g} mm."
            )
        if min(self.crop) < 0:
            raise InputError(f"flatbed: crop {self.crop} must be four lengths of 0 mm and more.")

    @classmethod
    def of_handwriting(cls) -> Self:
        """The one that scans a person's pages: paper is shown as white, light goes as it comes."""
        return cls(
            shadow=0.3, blur=0.042, noise=0.003, misregistration=((-0.002, 0.008), (0.001, -0.004)), white=0.955,
            gamma=1.0, shading=0.004, dust=1.5,
        )  # fmt: skip

    @classmethod
    def exact(cls) -> Self:
        """One that shows a written sheet as it is."""
        return replace(cls.ideal(), gamma=1.0)

    @classmethod
    def make_worn(cls) -> Self:
        """An old one with its lid up: dust, tired lamp, dark border, paper not shown as white."""
        return cls(
            skew=0.009, slack=1.0, border=2.0, lid=0.25, shadow=0.5, blur=0.05, noise=0.010, white=1.0, gamma=1 / 1.05,
            misregistration=((-0.010, 0.014), (0.006, -0.010)), shading=0.08, dust=12.0,
        )  # fmt: skip

    def apply_tone(self, light: Any, power: float) -> Any:
        """As of any flatbed; then grey, if it is."""
        shown = super().apply_tone(light, power)
        return np.repeat(shown.mean(axis=-1, keepdims=True), 3, axis=-1).astype(light.dtype) if self.grey else shown

    def lay(self, page: Page, dpi: float, rng: np.random.Generator) -> GlassPlacement:
        """Lay a sheet on the glass, warped; the same state of `rng` gives the same place at any resolution."""
        flat = super().lay(page, dpi, rng)
        return WarpedPlacement(page, flat.glass, flat.to_glass, flat.to_sheet, dpi, bends(self.warp, rng))

    def optics(self, dpi: float) -> Kernels:
        """The blur, moved by each channel's misregistration."""
        scale = dpi / 25.4
        red, blue = self.misregistration
        return [(bell(self.blur * scale, x * scale), bell(self.blur * scale, y * scale))
                for x, y in (red, (0.0, 0.0), blue)]  # fmt: skip

    def find_tone(self, light: Floats) -> Tone:
        """As of any flatbed, or the levels and the gamma that the scanner chooses for this sheet."""
        if not self.automatic:
            return super().find_tone(light)
        pixels = light[::4, ::4].reshape(-1, 3)
        black, white = np.percentile(pixels, [_TAIL, 100 - _TAIL], axis=0).astype(np.float32)
        white = np.maximum(white, black + np.float32(0.05))
        mean = float(np.clip((pixels - black) / (white - black), 0, 1).mean())
        power = math.log(_MIDDLE) / math.log(min(max(mean, 0.02), 0.98))
        return black, white, min(max(power, 1 / 3), 1.0)

    def stain(self, place: GlassPlacement, light: Floats, rng: np.random.Generator) -> tuple[Stain, Stain]:
        """Flare and dust on the glass, and the bright streak of glare."""
        import cv2

        angle, at = rng.uniform(0, math.pi), rng.uniform((0.25, 0.25), (0.75, 0.75))
        specks, unit = dust(place, self, rng), 25.4 / place.dpi
        across = np.cos(angle) * ((np.arange(place.shape[1]) + 0.5) * unit - at[0] * place.glass.width)
        size = tuple(max(1, round(side / 25.4 * _FLARE_DPI)) for side in (place.sheet.width, place.sheet.height))
        coarse = cv2.resize(light, size, interpolation=cv2.INTER_AREA)  # the surroundings, a pixel a millimetre
        sigma = _FLARE * _FLARE_DPI / 25.4
        flare: Floats = np.asarray(cv2.GaussianBlur(coarse, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE))

        def add_dirt(rows: Array, under: Floats) -> Floats:
            if self.flare:
                under *= np.float32(1 - self.flare)
                under += np.float32(self.flare) * place.sample(flare, rows, cv2.BORDER_REPLICATE, self.lid)
            if specks is not None:
                under *= specks[np.clip(rows, 0, place.shape[0] - 1).astype(int), :, None]
            return under

        def add_glare(rows: Array, lit: Floats) -> Floats:
            if not self.glare:
                return lit
            down = np.sin(angle) * ((rows + 0.5) * unit - at[1] * place.glass.height)
            away = np.add.outer(down, across).astype(np.float32) / np.float32(_STREAK)
            return np.asarray(lit + (np.float32(self.glare) * np.exp(-(away**2)))[:, :, None])

        return add_dirt, add_glare

    def scan(self, sheet: SimulatedSheet, dpi: float, rng: np.random.Generator) -> Picture:
        """The picture of a printed sheet, cropped and as it was kept in a file.

        Raises InputError: as of any flatbed; a crop that leaves nothing.
        """
        import cv2

        picture = super().scan(sheet, dpi, rng)
        top, right, bottom, left = (round(edge * dpi / 25.4) for edge in self.crop)
        height, width = picture.shape[:2]
        if top + bottom >= height or left + right >= width:
            raise InputError(f"flatbed: crop {self.crop} mm leaves nothing of the sheet.")
        picture = np.ascontiguousarray(picture[top : height - bottom, left : width - right])
        if not self.jpeg:
            return picture
        _, coded = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, self.jpeg])
        decoded = cv2.imdecode(coded, cv2.IMREAD_COLOR)
        return np.ascontiguousarray(np.asarray(decoded, dtype=np.uint8)[..., ::-1])


@dataclass(frozen=True, eq=False)
class WarpedPlacement(GlassPlacement):
    """A sheet on the glass that does not lie flat; bends : (2, k, k) cosines of the warp, mm."""

    bends: Array

    def on_sheet(self, rows: Array) -> tuple[Array, Array]:
        """(n, w) x and y on the sheet, mm, of the middles of all pixels in `rows` (n,), with the warp."""
        across, down = super().on_sheet(rows)
        if self.bends.any():
            unit = 25.4 / self.dpi
            u = np.asarray((np.arange(self.shape[1]) + 0.5) * unit / self.glass.width, dtype=np.float64)
            v = np.asarray((rows + 0.5) * unit / self.glass.height, dtype=np.float64)
            across, down = across + smooth_field(self.bends[0], u, v), down + smooth_field(self.bends[1], u, v)
        return across, down


def bends(most: float, rng: np.random.Generator) -> Array:
    """(2, k, k) cosines of a smooth shift that is `most` mm where it is greatest."""
    u = np.linspace(0, 1, 41)
    fields = rng.normal(0.0, 1.0, (2, _ORDER, _ORDER)) / (1 + np.add.outer(np.arange(_ORDER), np.arange(_ORDER)))
    fields[:, 0, 0] = 0
    size = np.hypot(smooth_field(fields[0], u, u), smooth_field(fields[1], u, u)).max()
    return np.asarray(fields * (most / size))


def dust(place: GlassPlacement, flatbed: WornFlatbed, rng: np.random.Generator) -> Floats | None:
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
