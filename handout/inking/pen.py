"""The pen that pictures are drawn with."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from handout import shipped
from handout.errors import InputError

# width of the line, mm, and colour that are usual for a model: `pens` has how its ink looks
_USUAL = {
    "plain": (0.3, "#20223a"),
    "ballpoint": (0.36, "#6d6bb2"),
    "fineliner": (0.36, "#2b2c33"),
    "fountain": (0.44, "#34508f"),
    "pencil": (0.44, "#6a6a6e"),
    "brushpen": (1.1, "#2a2a30"),
    "chisel": (1.5, "#2f3a63"),
}
PENS = tuple(_USUAL)
TEXTURED = ("ballpoint", "fineliner", "fountain", "pencil")  # what scanned ink is taken for
BY_FOOTPRINT = ("brushpen", "chisel")  # whose width is all the footprint's; that of the others also the flow's
BRUSH_FILE = ".brush"  # suffix of files that hold a brush; see inking.brush
_HEX = re.compile(r"#(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6})\Z")


@dataclass(frozen=True)
class Pen:
    """A kind of pen, the width of its line and the colour of its ink.

    width : mm, 0.02 to 50.
    colour : ``"#rrggbb"``, of one pass of the pen at usual pressure on white.
    model : one of `PENS`, of which only ``plain`` draws a line without texture; or a brush, by name or file.

    Raises InputError: a width out of its bounds, no such colour, or no such model.
    """

    width: float = 0.3
    colour: str = "#20223a"
    model: str = "plain"

    def __post_init__(self) -> None:
        if self.model not in _USUAL and not is_brush(self.model):
            raise InputError(f"pen: {self.model!r} is not known; the pens are {', '.join((*PENS, *brushes()))}.")
        rgb(self.colour)
        check_width(self.width)


def brushes() -> dict[str, Path]:
    """The files of the shipped brushes and of the user's own, by their names."""
    return shipped.files("brushes", f"*{BRUSH_FILE}")


def is_brush(model: str) -> bool:
    """Whether a pen of this name is a brush or a file with one."""
    return model not in _USUAL and (model.endswith(BRUSH_FILE) or model in brushes())


def usual(model: str, width: float | None = None, colour: str | None = None) -> Pen:
    """A pen of the model, with the width (mm) and the ink (see `colour_code`) usual for it where none are given.

    Raises InputError: as `Pen`.
    """
    own_width, own_colour = _USUAL.get(model, (0.3, "#000000"))
    return Pen(own_width if width is None else width, own_colour if colour is None else colour_code(colour), model)


def colour_code(colour: str) -> str:
    """A colour as ``"#rrggbb"``, of that or of any way in which CSS writes colours, such as a name.

    Raises InputError: no colour, or one that is seen through.
    """
    from PIL import ImageColor

    if _HEX.match(colour):
        return colour
    parts: tuple[int, ...]
    try:
        parts = ImageColor.getrgb(colour.strip())
    except ValueError:
        parts = (0, 0, 0, 0) if colour.strip().lower() == "transparent" else ()
    if len(parts) == 4 and parts[3] < 255:
        raise InputError(f"colour: {colour!r} can be seen through, and ink is opaque here: give a colour such as navy.")
    if not parts or max(parts) > 255:
        raise InputError(
            f'colour: {colour!r} is not a colour; write it as "#rrggbb", such as "#1a1a2e", or by its name in CSS, '
            "such as navy or rebeccapurple."
        )
    return "#{:02x}{:02x}{:02x}".format(*parts[:3])


def rgb(colour: str) -> tuple[float, float, float]:
    """(r, g, b) in 0–1 of a colour written ``"#1a1a2e"`` or ``"#abc"``. Raises InputError: anything else."""
    if not _HEX.match(colour):
        raise InputError(f'colour: {colour!r} is not a colour; write it as "#rrggbb", such as "#1a1a2e".')
    digits = colour[1:] if len(colour) == 7 else "".join(digit * 2 for digit in colour[1:])
    red, green, blue = (int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4))
    return red, green, blue


def check_width(pen_width: float) -> None:
    """Raise InputError unless `pen_width` is 0.02 to 50 mm."""
    if not 0.02 <= pen_width <= 50:
        raise InputError(f"pen width: {pen_width:g} mm is outside 0.02 to 50 mm.")
