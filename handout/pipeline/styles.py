"""Handstyles: the one that is asked for, and writing in it."""

from __future__ import annotations

import msgspec

from handout import units
from handout.errors import InputError
from handout.motion.styles.style import Style, checked, find
from handout.pipeline.options import StyleOptions
from handout.tables import Angle

_USUAL_STYLE = "fast-tag"
_NOISE = 0.02  # heights of a letter: motor noise at --jitter 1; set by eye


def style_of(styling: StyleOptions) -> Style:
    """The style that is asked for, changed as asked.

    Raises
    ------
    InputError
        There is no such style, or a number is outside its bounds.
    """
    style = find(styling.style or _USUAL_STYLE)
    if styling.smooth is not None:
        movement = msgspec.structs.replace(style.movement, smooth=styling.smooth)
        style = msgspec.structs.replace(style, movement=movement)
    if styling.shear is not None:
        lean = Angle(units.parse(styling.shear, "angle", "shear", default="deg"))
        style = msgspec.structs.replace(style, form=msgspec.structs.replace(style.form, shear=lean))
    if styling.jitter is not None:
        noise = msgspec.structs.replace(style.jitter, size=_NOISE * styling.jitter)
        style = msgspec.structs.replace(style, jitter=noise)
    try:
        return checked(style)
    except ValueError as error:
        raise InputError(f"style {style.name}: {error}") from error
