"""A simulated flatbed scanner, which scans printed sheets: where a sheet lies on its glass, its optics, its tone curve.

All that happens before the tone curve is linear in light.  A worn one, and the one that scans handwriting, are in
`handout_lab.author.worn_flatbed`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.errors import InputError
from handout.libraries import cv2
from handout.simulated.spectra import WAVELENGTHS, SimulatedSheet
from handout.values import Array, Drawing, Page, readonly

# red, green and blue of the sensor with its lamp: middle and width, nm; near what explains the colours of a film and
# photo flatbed with white light-emitting diodes
_SENSOR = ((604.0, 12.0), (545.0, 20.0), (454.0, 26.0))
# what the sensor sees to linear sRGB, as scanner programs turn colours purer: rows sum to 1, so that white stays white
_PURER = np.array([[1.14, -0.11, -0.03], [-0.06, 1.12, -0.06], [0.01, -0.09, 1.08]])
_STEEP = 5.0  # of the S-shaped curve, at its middle; set by eye
# settings of a scanner other than the simulated one's usual, by name
SETTINGS: dict[str, dict[str, Any]] = {
    "scanner-gamma": {"gamma": 2.2 / 0.75},
    "scanner-automatic": {"middle": 0.66},
    "scanner-contrast": {"contrast": 0.6},
    "scanner-srgb": {"srgb": True},
}
# beyond these a picture is none, or the formulas leave their range; set by eye
_BOUNDS = {
    "crosstalk": (0.0, 0.3), "gamma": (0.2, 5.0), "black": (-0.5, 0.4), "white": (0.5, 1.5), "blur": (0.0, 1.0),
    "noise": (0.0, 0.2), "shading": (0.0, 0.8), "skew": (0.0, 0.1), "slack": (0.0, 20.0), "border": (0.0, 100.0),
    "lid": (0.0, 1.0), "contrast": (0.0, 1.0), "middle": (0.0, 0.95),
}  # fmt: skip
_FURTHEST = 100.0  # mm that a sheet may lie away from its place
_DPI = (50.0, 1200.0)  # that flatbeds have

Floats = NDArray[np.float32]
Picture = NDArray[np.uint8 | np.uint16]
Field = Callable[[NDArray[np.floating], NDArray[np.floating]], NDArray[np.floating]]
Lamp = Callable[[NDArray[np.floating], NDArray[np.floating]], Floats]
Kernels = list[tuple[Array, Array]]
Stain = Callable[[Array, Floats], Floats]  # rows of a picture (n,) and their light (n, w, 3) → light
Tone = tuple[Floats, Floats, float]  # black and white of each colour, power


@dataclass(frozen=True)
class Flatbed:
    """A simulated flatbed: what it does to a sheet.

    crosstalk : share of its light that each colour gets from each neighbour.
    gamma : what is shown is light to the power of 1 / gamma.
    black, white : light that is shown as 0 and as full; a white below that of the paper clips it.
    contrast : how much of an S-shaped curve lies on what is shown, 0–1.
    srgb : the scanner's program turns what the sensor sees into sRGB, by a matrix and the curve of sRGB.
    middle : the scanner sets gamma so that the mean of what is shown is this; 0: it does not.
    blur : mm, standard deviation of what optics and sensor make of a point, besides the pixel's own area.
    noise : standard deviation of the sensor's noise where it is white, of 1; it falls with the root of the light.
    shading : share of its light that the lamp loses from its brightest place on the glass to its darkest.
    rotation : rad, how far the sheet lies turned, any angle; None: another on every page, with deviation `skew`, rad.
    offset : (x, y) mm that the sheet lies away from its place; None: another each time, with deviation `slack`, mm.
    border : mm of the lid on every side of the sheet; lid : what the lid sends back, 0–1.
    bits : 8 or 16 of a colour.

    Raises InputError: a value out of its bounds.
    """

    crosstalk: float = 0.07
    gamma: float = 2.2
    black: float = 0.0
    white: float = 1.0
    contrast: float = 0.0
    srgb: bool = False
    middle: float = 0.0
    blur: float = 0.04
    noise: float = 0.004
    shading: float = 0.01
    rotation: float | None = None
    skew: float = 0.004
    offset: tuple[float, float] | None = None
    slack: float = 0.3
    border: float = 0.0
    lid: float = 0.9
    bits: int = 8

    def __post_init__(self) -> None:
        self.check(_BOUNDS)
        if self.bits not in (8, 16):
            raise InputError(f"flatbed: {self.bits} bits: use 8 or 16.")
        if not all(map(math.isfinite, (self.rotation or 0.0, *(self.offset or ())))):
            raise InputError("flatbed: rotation and offset must be finite numbers.")
        if not all(abs(value) <= _FURTHEST for value in self.offset or ()):
            raise InputError(f"flatbed: offset {self.offset} is outside −{_FURTHEST:g} to {_FURTHEST:g} mm.")

    def check(self, bounds: Mapping[str, tuple[float, float]]) -> None:
        """Refuse settings out of their bounds."""
        for name, (least, greatest) in bounds.items():
            value = getattr(self, name)
            if not least <= value <= greatest:
                raise InputError(f"flatbed: {name} {value:g} is outside {least:g} to {greatest:g}.")

    @classmethod
    def ideal(cls) -> Self:
        """One that shows the sheet where it lies, sharp, even and without noise; its colours are a scanner's still."""
        return cls(blur=0.0, noise=0.0, shading=0.0, rotation=0.0, offset=(0.0, 0.0))

    @property
    def bands(self) -> Array:
        """(31, 3) how much each wavelength counts for red, green and blue; white gives 1."""
        lobes = [np.exp(-0.5 * ((WAVELENGTHS - middle) / width) ** 2) for middle, width in _SENSOR]
        pure = np.stack([lobe / lobe.sum() for lobe in lobes], axis=1)
        c = self.crosstalk
        return np.asarray(pure @ np.array([[1 - c, c, 0.0], [c, 1 - 2 * c, c], [0.0, c, 1 - c]]))

    def see(self, spectra: ArrayLike) -> Array:
        """(n, 3) in 0–1, what is shown of even patches of (n, 31) reflectance, all else being ideal; not rounded."""
        span = self.white - self.black
        light = np.clip((np.asarray(spectra) @ self.bands - self.black) / span, 0, 1)
        return np.asarray(self.apply_tone(light, 1 / self.gamma))

    def show_light(self, light: NDArray[np.float32]) -> NDArray[np.float32]:
        """(…, 3) in 0–1, what is shown of light (…, 3), 1 being white; not rounded."""
        span = np.float32(1 / (self.white - self.black))
        between = np.clip((light - np.float32(self.black)) * span, 0, 1)
        return np.asarray(self.apply_tone(between, 1 / self.gamma))

    def apply_tone(self, light: Any, power: float) -> Any:
        """(…, 3) what is shown, 0–1, of light (…, 3) between black and white, 0–1."""
        if self.srgb:
            linear = np.clip(light @ _PURER.T.astype(light.dtype), 0, 1)
            shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        else:
            shown = light if power == 1 else light ** np.asarray(power, dtype=light.dtype)
        if self.contrast:
            least, most = (1 / (1 + math.exp(s * _STEEP / 2)) for s in (1, -1))
            curve = (1 / (1 + np.exp(-_STEEP * (shown - 0.5))) - least) / (most - least)
            shown = (1 - self.contrast) * shown + self.contrast * curve
        return shown.astype(light.dtype)

    def lay(self, page: Page, dpi: float, rng: np.random.Generator) -> GlassPlacement:
        """Lay a sheet on the glass.  The same state of `rng` gives the same place at any resolution."""
        turned, aside = rng.normal(0.0, self.skew), rng.normal(0.0, self.slack, 2)
        angle = turned if self.rotation is None else self.rotation
        move = aside if self.offset is None else np.asarray(self.offset)
        cos, sin = math.cos(angle), math.sin(angle)
        size = np.array([page.width, page.height])
        # a sheet that lies on its side needs a glass that does too
        upright = abs(cos) >= abs(sin)
        room = size if upright else size[::-1]
        width, height = (room + 2 * self.border).tolist()
        glass = Page(width, height, page.name)
        there, back = np.array([[cos, -sin], [sin, cos]]), np.array([[cos, sin], [-sin, cos]])
        shift = size / 2 - there @ (size / 2) + move + self.border + (room - size) / 2
        return_shift = size / 2 - back @ (np.array([glass.width, glass.height]) / 2 + move)
        to_glass, to_sheet = np.column_stack([there, shift]), np.column_stack([back, return_shift])
        return GlassPlacement(page, glass, to_glass, to_sheet, dpi)

    def optics(self, dpi: float) -> Kernels:
        """For red, green and blue the blur along x and along y."""
        return [(bell(self.blur * dpi / 25.4),) * 2] * 3

    def find_tone(self, light: Floats) -> Tone:
        """Black, white and power with which a sheet (h, w, 3) is shown."""
        black, white = (np.full(3, value, dtype=np.float32) for value in (self.black, self.white))
        if not self.middle:
            return black, white, 1 / self.gamma
        shown = np.clip((light[::4, ::4] - black) / (white - black), 0, 1)
        powers = np.linspace(0.2, 1.5, 131)
        return black, white, float(np.interp(-self.middle, [-float((shown**p).mean()) for p in powers], powers))

    def stain(self, place: GlassPlacement, light: Floats, rng: np.random.Generator) -> tuple[Stain, Stain]:
        """What dirt does on the glass, before the optics, and what is added behind the lamp: here nothing."""
        return (lambda rows, under: under), (lambda rows, lit: lit)

    def scan(self, sheet: SimulatedSheet, dpi: float, rng: np.random.Generator) -> Picture:
        """(h, w, 3) uint8, or uint16 with 16 bits: the picture of a printed sheet at `dpi` pixels an inch.

        The same state of `rng` lays the sheet and the lamp alike at any resolution.

        Raises InputError: a resolution outside 50–1200 dpi.
        """
        if not _DPI[0] <= dpi <= _DPI[1]:
            raise InputError(f"flatbed: {dpi:g} dpi is outside {_DPI[0]:g} to {_DPI[1]:g}.")
        place = self.lay(sheet.page, dpi, rng)
        lamp = _cosine_lamp(self.shading, rng)
        light = sheet.reflectance(self.bands)
        if dpi < sheet.dpi:  # a pixel of the scan sees all that lies under it
            down, across = (max(1, round(side * dpi / sheet.dpi)) for side in light.shape[:2])
            light = np.asarray(cv2.resize(light, (across, down), interpolation=cv2.INTER_AREA))
        dirt, streaks = self.stain(place, light, rng)
        black, white, power = self.find_tone(light)
        blur = self.optics(dpi)
        halo = reach(blur)
        picture: Picture = np.empty((*place.shape, 3), dtype=np.uint8 if self.bits == 8 else np.uint16)
        height, width = place.shape
        for start in range(0, height, ROWS):
            rows = np.arange(start - halo, min(start + ROWS, height) + halo, dtype=np.float64)
            under = dirt(rows, place.sample(light, rows, cv2.BORDER_CONSTANT, self.lid))
            inner = slice(halo, len(rows) - halo)
            lit = blur_rows(under, blur)[inner]
            lit = lit * lamp((np.arange(width) + 0.5) / width, (rows[inner] + 0.5) / height)[:, :, None]
            noisy = add_noise(streaks(rows[inner], lit), self.noise, rng)
            shown = np.asarray(self.apply_tone(np.clip((noisy - black) / (white - black), 0, 1), power))
            shown *= np.float32(2**self.bits - 1)
            picture[start : start + ROWS] = np.rint(shown, out=shown)
        return picture


ROWS = 512  # of a picture that are made at a time, so that one of 1200 dpi needs little memory beside itself
_SHARPEST = 0.2  # pixels: a finer blur is none


def lamp(loss: float, field: Field, sampled: NDArray[np.floating]) -> Lamp:
    """The lamp's light over the picture: 1 where `field` is least, less by the share `loss` where it is greatest.

    field : of places x (w,) and y (h,), (h, w); sampled : its values over the whole picture.
    """
    least, span = float(sampled.min()), max(float(np.ptp(sampled)), 1e-9)

    def light_at(x: NDArray[np.floating], y: NDArray[np.floating]) -> Floats:
        if not loss:
            return np.ones((len(y), len(x)), dtype=np.float32)
        return np.asarray(1 - loss * (field(x, y) - least) / span, dtype=np.float32)

    return light_at


def _cosine_lamp(loss: float, rng: np.random.Generator) -> Lamp:
    """The lamp over a picture, places counted 0–1: a few cosines."""
    cosines = rng.normal(0.0, 1.0, (3, 3)) * [[0.0, 1.0, 0.6], [1.0, 0.4, 0.2], [0.6, 0.2, 0.1]]
    u = np.linspace(0, 1, 41)

    def field(x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.floating]:
        return -smooth_field(cosines, np.asarray(x), np.asarray(y))

    return lamp(loss, field, field(u, u))


def reach(blur: Kernels) -> int:
    """Rows beyond a part of a picture that the blur brings into it."""
    return max(len(kernel) // 2 for pair in blur for kernel in pair)


def bell(sigma: float, shift: float = 0.0) -> Array:
    """(2 k + 1,) sum 1: a Gaussian about `shift` pixels, or what moves a picture by so much."""
    extent = math.ceil(4 * sigma + abs(shift)) if sigma > _SHARPEST else math.ceil(abs(shift))
    at = np.arange(-extent, extent + 1)
    if sigma > _SHARPEST:
        weight = np.exp(-0.5 * ((at - shift) / sigma) ** 2)
    else:
        weight = np.maximum(0.0, 1 - np.abs(at - shift))
    return np.asarray(weight / weight.sum())


def blur_rows(rows: Floats, blur: Kernels) -> Floats:
    """Rows (n, w, 3) after the optics."""
    if all(len(k) == 1 for pair in blur for k in pair):
        return rows
    # OpenCV correlates: a kernel is turned round to move the picture towards its shift
    return np.stack(
        [
            cv2.sepFilter2D(np.ascontiguousarray(rows[:, :, c]), -1, x[::-1], y[::-1], borderType=cv2.BORDER_REPLICATE)
            for c, (x, y) in enumerate(blur)
        ],
        axis=2,
    )


def add_noise(light: Floats, noise: float, rng: np.random.Generator) -> Floats:
    """Light after the sensor: photons are counted, so noise goes with the root of the light; some is in the dark."""
    if not noise:
        return light
    scatter = rng.standard_normal(light.shape, dtype=np.float32)
    scatter *= np.sqrt(np.float32(0.1) + np.float32(0.9) * np.maximum(light, 0)) * np.float32(noise)
    return np.asarray(light + scatter)


@dataclass(frozen=True, eq=False)
class GlassPlacement:
    """A sheet on the glass.

    sheet : the sheet; glass : what is scanned, whose top left corner is the picture's.
    to_glass, to_sheet : (2, 3) float: from mm on the sheet to mm on the glass, and back.
    dpi : pixels an inch of the picture.
    """

    sheet: Page
    glass: Page
    to_glass: Array
    to_sheet: Array
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

    def on_sheet(self, rows: Array) -> tuple[Array, Array]:
        """(n, w) x and y on the sheet, mm, of the middles of all pixels in `rows` (n,)."""
        unit = 25.4 / self.dpi
        x, y = ((np.arange(self.shape[1]) + 0.5) * unit)[None, :], ((rows + 0.5) * unit)[:, None]
        (a, b, c), (d, e, f) = self.to_sheet
        return a * x + b * y + c, d * x + e * y + f

    def sample(self, picture: Floats, rows: Array, mode: int, lid: float) -> Floats:
        """(n, w, 3) what of a picture of the whole sheet lies under pixels of `rows`; beside it by OpenCV's `mode`."""
        half, sides = np.float32(0.5), (self.sheet.width, self.sheet.height)
        places = zip(self.on_sheet(rows), picture.shape[1::-1], sides, strict=True)
        x, y = (at.astype(np.float32) * np.float32(n / side) - half for at, n, side in places)
        return np.asarray(cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=mode, borderValue=(lid,) * 3))


def smooth_field(cosines: Array, u: Array, v: Array) -> Array:
    """(n, m) a sum of cosines (k, k) at u (m,) across and v (n,) down, both 0–1."""
    order = np.arange(len(cosines))
    return np.asarray(np.cos(np.pi * np.outer(v, order)) @ cosines @ np.cos(np.pi * np.outer(order, u)))
