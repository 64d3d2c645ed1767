"""A drawing as JSON: every sample, exactly, in a form that any language reads.

::

    {"format": "handout-drawing", "version": 1,
     "page": {"width": 210.0, "height": 297.0, "name": "A4"},      mm
     "about": {"seed": 7, "hand": "house-joined", …},              anything
     "strokes": [{"t": [0.0, 0.005, …],                            s, increasing
                  "x": […], "y": […],                              mm, y down
                  "pressure": […],                                 0–1; this and the following only if known
                  "tilt": […], "azimuth": […], "rotation": […],    rad
                  "width": […],                                    mm
                  "nib": 2.0,                                      mm, length of a flat nib's edge; absent if round
                  "word": 3,                                       index of the word, absent if unknown
                  "layer": "flourishes", "colour": "#c01020"}, …],  absent if none
     "timed": false}                                               absent if the times mean something

Numbers are written with as many digits as it takes to read back the same double.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec
import numpy as np

from handout.errors import InputError
from handout.sinks import about
from handout.values import Drawing, Page, Stroke

_CHANNELS = ("pressure", "tilt", "azimuth", "rotation", "width")


class _Page(msgspec.Struct, forbid_unknown_fields=True):
    width: float
    height: float
    name: str = ""


class _Stroke(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    t: list[float]
    x: list[float]
    y: list[float]
    pressure: list[float] | None = None
    tilt: list[float] | None = None
    azimuth: list[float] | None = None
    rotation: list[float] | None = None
    width: list[float] | None = None
    word: int = -1
    nib: float | None = None
    layer: str = ""
    colour: str = ""


class _File(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    format: Literal["handout-drawing"]
    version: Literal[1]
    page: _Page
    about: dict[str, Any]
    strokes: list[_Stroke]
    timed: bool = True


def to_json(drawing: Drawing) -> bytes:
    """A page as JSON, in the form described at the top of this file."""
    page = _Page(float(drawing.page.width), float(drawing.page.height), about.plain(drawing.page.name))
    strokes = [_written(stroke) for stroke in drawing.strokes]
    return (
        msgspec.json.encode(_File("handout-drawing", 1, page, about.plain(drawing.about), strokes, drawing.timed))
        + b"\n"
    )


def from_json(data: bytes) -> Drawing:
    """Read what `to_json` wrote: the same Drawing, number by number.

    Raises
    ------
    InputError
        Not JSON, not of this form (the message says where), or strokes that cannot be.
    """
    try:
        file = msgspec.json.decode(data, type=_File)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"This is not a drawing in JSON: {error}.") from error
    if not (file.page.width > 0 and file.page.height > 0):
        raise InputError(f"A page of {file.page.width:g} x {file.page.height:g} mm cannot be.")
    strokes = tuple(_read(stroke, number) for number, stroke in enumerate(file.strokes, 1))
    return Drawing(strokes, Page(file.page.width, file.page.height, file.page.name), file.about, timed=file.timed)


def _written(stroke: Stroke) -> _Stroke:
    channels = {name: getattr(stroke, name) for name in _CHANNELS}
    lists = {name: values.tolist() for name, values in channels.items() if values is not None}
    notes = {
        "word": stroke.word,
        "layer": about.plain(stroke.layer),
        "colour": stroke.colour,
        "nib": stroke.nib or None,
    }
    return _Stroke(stroke.t.tolist(), stroke.xy[:, 0].tolist(), stroke.xy[:, 1].tolist(), **lists, **notes)


def _read(stroke: _Stroke, number: int) -> Stroke:
    if len(stroke.x) != len(stroke.y):
        raise InputError(f"Stroke {number} has {len(stroke.x)} values of x and {len(stroke.y)} of y.")
    known = {name: getattr(stroke, name) for name in (*_CHANNELS, "word", "layer", "colour")}
    try:
        xy = np.column_stack([stroke.x, stroke.y])
        return Stroke(np.array(stroke.t), xy, nib=stroke.nib or 0.0, **known)
    except ValueError as error:
        raise InputError(f"Stroke {number} cannot be used: {error}.") from error
