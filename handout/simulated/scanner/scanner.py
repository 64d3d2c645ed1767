"""A flatbed scanner: what it does to a sheet, in mm and in shares of the light that white sends back.

The usual values follow real scans of handwriting, measured on 27 grey and 8 colour pages at 300 dpi by ballpoint and
on 3 colour pages at 400 dpi on old paper:

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
from dataclasses import dataclass

from handout.errors import InputError

_BOUNDS = {
    "skew": (0.0, 0.1),
    "slack": (0.0, 20.0),
    "border": (0.0, 100.0),
    "lid": (0.0, 1.0),
    "shadow": (0.0, 1.0),
    "blur": (0.0, 1.0),
    "noise": (0.0, 0.2),
    "black": (-0.5, 0.4),
    "white": (0.5, 1.5),
    "gamma": (0.2, 5.0),
    "unevenness": (0.0, 0.8),
    "dust": (0.0, 1000.0),
}


@dataclass(frozen=True)
class Scanner:
    """What a scanner does to a sheet.

    rotation : rad, how far the sheet lies turned (clockwise); None: another on every page, with deviation `skew`.
    skew : rad.
    offset : (x, y) mm that the sheet lies away from the corner of the picture; None: another on every page, with
        deviation `slack`.
    slack : mm.
    border : mm of the scanner's lid on every side of the sheet.
    lid : what the lid sends back; shadow : share of its light that is lost beside the sheet's edge.
    blur : mm, standard deviation of what optics and sensor make of a point, besides the pixel's own area.
    noise : standard deviation of the sensor's noise where it is white; it falls with the root of the light.
    misregistration : (x, y) mm of red and of blue beside green.
    black, white : light that is shown as 0 and as full; gamma : power of what lies between.
    unevenness : share of its light that the lamp loses towards one side or corner.
    dust : specks and short hairs on the glass, of a square decimetre.
    grey : whether the picture has no colour.

    Raises
    ------
    InputError
        A value out of its bounds.
    """

    rotation: float | None = None
    skew: float = 0.004
    offset: tuple[float, float] | None = None
    slack: float = 0.3
    border: float = 0.0
    lid: float = 0.9
    shadow: float = 0.3
    blur: float = 0.042
    noise: float = 0.003
    misregistration: tuple[tuple[float, float], tuple[float, float]] = ((-0.002, 0.008), (0.001, -0.004))
    black: float = 0.0
    white: float = 0.955
    gamma: float = 1.0
    unevenness: float = 0.004
    dust: float = 1.5
    grey: bool = False

    def __post_init__(self) -> None:
        for name, (least, greatest) in _BOUNDS.items():
            value = getattr(self, name)
            if not least <= value <= greatest:
                raise InputError(f"scanner: {name} {value:g} is outside {least:g} to {greatest:g}.")
        if self.rotation is not None and not abs(self.rotation) <= math.radians(10):
            raise InputError(f"scanner: a rotation of {self.rotation:g} rad is outside −0.17 to 0.17 (10 degrees).")
        for name, most, pairs in (
            ("offset", 100.0, (self.offset or (0.0, 0.0),)),
            ("misregistration", 1.0, self.misregistration),
        ):
            if not all(abs(value) <= most for pair in pairs for value in pair):
                raise InputError(f"scanner: {name} {getattr(self, name)} is outside −{most:g} to {most:g} mm.")

    @classmethod
    def ideal(cls) -> Scanner:
        """One that shows the sheet as it is."""
        still = ((0.0, 0.0), (0.0, 0.0))
        return cls(
            rotation=0.0, offset=(0.0, 0.0), shadow=0.0, blur=0.0, noise=0.0, misregistration=still, white=1.0,
            unevenness=0.0, dust=0.0,
        )  # fmt: skip

    @classmethod
    def worn(cls) -> Scanner:
        """An old one with its lid up: dust, tired lamp, dark border, paper not shown as white."""
        return cls(
            skew=0.009, slack=1.0, border=2.0, lid=0.25, shadow=0.5, blur=0.05, noise=0.010, white=1.0, gamma=1.05,
            misregistration=((-0.010, 0.014), (0.006, -0.010)), unevenness=0.08, dust=12.0,
        )  # fmt: skip
