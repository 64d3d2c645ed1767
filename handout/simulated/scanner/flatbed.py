"""The settings of a simulated flatbed scanner, and its tone curve: what it shows of light.

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
from numpy.typing import ArrayLike, NDArray

from handout.errors import InputError
from handout.simulated.spectra import WAVELENGTHS
from handout.values import Array

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

    Raises
    ------
    InputError
        A value out of its bounds.
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
