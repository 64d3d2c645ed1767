"""Reads drawings in JSON, as `sinks.drawing_json` writes and describes them: every sample exactly."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeVar

import msgspec
import numpy as np

from handout.errors import InputError
from handout.sources.recorded import LARGEST, MOST, refuse_far
from handout.values import Drawing, Page, Stroke

_CHANNELS = ("pressure", "tilt", "azimuth", "rotation", "width")


class JsonPage(msgspec.Struct, forbid_unknown_fields=True):
    """The field ``page`` of a file in JSON: a size in mm, and a name."""

    width: float
    height: float
    name: str = ""

    def page(self) -> Page:
        """The page; InputError if it has no area, or a greater one than any drawing."""
        if not (0 < self.width <= LARGEST and 0 < self.height <= LARGEST):
            raise InputError(
                f"A page of {self.width:.4g} x {self.height:.4g} mm cannot be: the greatest side is {LARGEST:g} mm."
            )
        return Page(self.width, self.height, self.name)


File = TypeVar("File", bound=msgspec.Struct)


def decode(data: bytes, form: type[File], what: str) -> File:
    """A file in JSON; InputError if it is not of that form."""
    try:
        return msgspec.json.decode(data, type=form)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"This is not {what} in JSON: {error}.") from error


class _JsonStroke(msgspec.Struct, forbid_unknown_fields=True):
    t: list[float]
    x: list[float]
    y: list[float]
    pressure: list[float] | None = None
    tilt: list[float] | None = None
    azimuth: list[float] | None = None
    rotation: list[float] | None = None
    width: list[float] | None = None
    word: Annotated[int, msgspec.Meta(ge=-1, le=MOST)] = -1
    nib: float | None = None
    layer: str = ""
    colour: str = ""


class _DrawingFile(msgspec.Struct, forbid_unknown_fields=True):
    format: Literal["handout-drawing"]
    version: Literal[1]
    page: JsonPage
    about: dict[str, Any]
    strokes: list[_JsonStroke]
    timed: bool = True


def from_json(data: bytes) -> Drawing:
    """Read what `sinks.drawing_json.to_json` wrote: the same Drawing, number by number.

    Raises InputError: not JSON, not of this form (the message says where), or strokes that cannot be.
    """
    file = decode(data, _DrawingFile, "a drawing")
    page = file.page.page()
    strokes = tuple(_read_stroke(stroke, number) for number, stroke in enumerate(file.strokes, 1))
    return Drawing(strokes, page, file.about, timed=file.timed)


def _read_stroke(stroke: _JsonStroke, number: int) -> Stroke:
    if len(stroke.x) != len(stroke.y):
        raise InputError(f"Stroke {number} has {len(stroke.x)} values of x and {len(stroke.y)} of y.")
    fields = {name: getattr(stroke, name) for name in (*_CHANNELS, "word", "layer", "colour")}
    xy = np.column_stack([stroke.x, stroke.y])
    refuse_far(f"Stroke {number}", xy, np.array(stroke.t), nib=stroke.nib, **{k: fields[k] for k in _CHANNELS})
    try:
        return Stroke(np.array(stroke.t), xy, nib=stroke.nib or 0.0, **fields)
    except ValueError as error:
        raise InputError(f"Stroke {number} cannot be used: {error}.") from error
