"""The settings of a simulated flatbed scanner, where a sheet lies on its glass, its optics, and its tone curve.

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
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handout.errors import InputError
from handout.simulated.spectra import WAVELENGTHS
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
    "noise": (0.0, 0.2), "shading": (0.0, 0.8), "flare": (0.0, 0.3), "glare": (0.0, 1.0), "skew": (0.0, 0.1),
    "slack": (0.0, 20.0), "border": (0.0, 100.0), "lid": (0.0, 1.0), "shadow": (0.0, 1.0), "warp": (0.0, 10.0),
    "dust": (0.0, 1000.0), "jpeg": (0, 100), "contrast": (0.0, 1.0), "middle": (0.0, 0.95),
}  # fmt: skip
_FURTHEST = {"offset": 100.0, "misregistration": 1.0}  # mm
_STILL = ((0.0, 0.0), (0.0, 0.0))  # mm: red and blue lie exactly on green


@dataclass(frozen=True)
class FlatbedSettings:
    """What a flatbed scanner does to a sheet.

    crosstalk : share of its light that each colour gets from each neighbour.
    gamma : what is shown is light to the power of 1 / gamma.
    black, white : light that is shown as 0 and as full; a white below that of the paper clips it.
    automatic : the scanner stretches every colour from its darkest to its lightest, and sets gamma by the mean.
    contrast : how much of an S-shaped curve lies on what is shown, 0–1.
    srgb : the scanner's program turns what the sensor sees into sRGB, by a matrix and the curve of sRGB.
    middle : the scanner sets gamma so that the mean of what is shown is this; 0: it does not.
    blur : mm, standard deviation of what optics and sensor make of a point, besides the pixel's own area.
    noise : standard deviation of the sensor's noise where it is white, of 1; it falls with the root of the light.
    shading : share of its light that the lamp loses from its brightest place on the glass to its darkest.
    flare : share of every pixel's light that comes from its surroundings, a centimetre or so.
    glare : light, of 1, that the middle of a bright streak across the sheet adds.
    rotation : rad, how far the sheet lies turned, any angle; None: another on every page, with deviation `skew`, rad.
    offset : (x, y) mm that the sheet lies away from its place; None: another each time, with deviation `slack`, mm.
    border : mm of the lid on every side of the sheet; lid : what the lid sends back, 0–1.
    warp : mm, how far paper that does not lie flat is shifted where it is most.
    shadow : share of its light that the lid loses beside the sheet's edge (of written sheets).
    misregistration : (x, y) mm of red and of blue beside green.
    dust : specks and short hairs on the glass, of a square decimetre.
    crop : (top, right, bottom, left) mm that are missing from the picture.
    grey : red, green and blue are all the mean of the three.
    bits : 8 or 16 of a colour.
    jpeg : quality with which the picture was kept, 1–100, 8 bits only; 0: without loss.

    Raises InputError: a value out of its bounds.
    """

    crosstalk: float = 0.07
    gamma: float = 2.2
    black: float = 0.0
    white: float = 1.0
    automatic: bool = False
    contrast: float = 0.0
    srgb: bool = False
    middle: float = 0.0
    blur: float = 0.04
    noise: float = 0.004
    shading: float = 0.01
    flare: float = 0.0
    glare: float = 0.0
    rotation: float | None = None
    skew: float = 0.004
    offset: tuple[float, float] | None = None
    slack: float = 0.3
    border: float = 0.0
    lid: float = 0.9
    shadow: float = 0.0
    misregistration: tuple[tuple[float, float], tuple[float, float]] = _STILL
    warp: float = 0.0
    dust: float = 0.0
    crop: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    grey: bool = False
    bits: int = 8
    jpeg: int = 0

    def __post_init__(self) -> None:
        for name, (least, greatest) in _BOUNDS.items():
            value = getattr(self, name)
            if not least <= value <= greatest:
                raise InputError(f"flatbed: {name} {value:g} is outside {least:g} to {greatest:g}.")
        if self.bits not in (8, 16) or (self.jpeg and self.bits != 8):
            raise InputError(f"flatbed: {self.bits} bits: use 8 or 16, and 8 for JPEG.")
        if not all(map(math.isfinite, (self.rotation or 0.0, *(self.offset or ())))):
            raise InputError("flatbed: rotation and offset must be finite numbers.")
        for name, pairs in (("offset", (self.offset or (0.0, 0.0),)), ("misregistration", self.misregistration)):
            most = _FURTHEST[name]
            if not all(abs(value) <= most for pair in pairs for value in pair):
                raise InputError(f"flatbed: {name} {getattr(self, name)} is outside −{most:g} to {most:g} mm.")
        if min(self.crop) < 0:
            raise InputError(f"flatbed: crop {self.crop} must be four lengths of 0 mm and more.")

    @classmethod
    def ideal(cls) -> Self:
        """One that shows the sheet where it lies, sharp, even and without noise; its colours are a scanner's still."""
        return cls(blur=0.0, noise=0.0, shading=0.0, rotation=0.0, offset=(0.0, 0.0))

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
        if self.grey:
            shown = np.repeat(shown.mean(axis=-1, keepdims=True), 3, axis=-1)
        return shown.astype(light.dtype)


Floats = NDArray[np.float32]
Field = Callable[[NDArray[np.floating], NDArray[np.floating]], NDArray[np.floating]]
Lamp = Callable[[NDArray[np.floating], NDArray[np.floating]], Floats]
Kernels = list[tuple[Array, Array]]

ROWS = 512  # of a picture that are made at a time, so that one of 1200 dpi needs little memory beside itself
_SHARPEST = 0.2  # pixels: a finer blur is none


def lamp(loss: float, field: Field, sampled: NDArray[np.floating]) -> Lamp:
    """The lamp's light over the picture: 1 where `field` is least, less by the share `loss` where it is greatest.

    Parameters
    ----------
    field : of places x (w,) and y (h,), (h, w); sampled : its values over the whole picture.
    """
    least, span = float(sampled.min()), max(float(np.ptp(sampled)), 1e-9)

    def light_at(x: NDArray[np.floating], y: NDArray[np.floating]) -> Floats:
        if not loss:
            return np.ones((len(y), len(x)), dtype=np.float32)
        return np.asarray(1 - loss * (field(x, y) - least) / span, dtype=np.float32)

    return light_at


def kernels(flatbed: FlatbedSettings, dpi: float) -> Kernels:
    """For red, green and blue the blur along x and along y, moved by the channel's misregistration."""
    scale = dpi / 25.4
    red, blue = flatbed.misregistration
    return [(_bell(flatbed.blur * scale, x * scale), _bell(flatbed.blur * scale, y * scale))
            for x, y in (red, (0.0, 0.0), blue)]  # fmt: skip


def reach(blur: Kernels) -> int:
    """Rows beyond a part of a picture that the blur brings into it."""
    return max(len(kernel) // 2 for pair in blur for kernel in pair)


def _bell(sigma: float, shift: float) -> Array:
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
    import cv2

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
