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

from typing import Any

import msgspec

from handout.sinks import about
from handout.values import Drawing

_CHANNELS = ("pressure", "tilt", "azimuth", "rotation", "width")


def to_json(drawing: Drawing) -> bytes:
    """A page as JSON, in the form described at the top of this file."""
    page, strokes = drawing.page, list[dict[str, Any]]()
    for stroke in drawing.strokes:  # fields in the order of the file; those that are not known are absent
        channels = {name: values.tolist() for name in _CHANNELS if (values := getattr(stroke, name)) is not None}
        word = {} if stroke.word == -1 else {"word": stroke.word}
        notes = {"nib": stroke.nib, "layer": about.plain(stroke.layer), "colour": stroke.colour}
        xy = {"x": stroke.xy[:, 0].tolist(), "y": stroke.xy[:, 1].tolist()}
        said = {name: note for name, note in notes.items() if note}
        strokes.append({"t": stroke.t.tolist(), **xy, **channels, **word, **said})
    file = {
        "format": "handout-drawing",
        "version": 1,
        "page": {"width": float(page.width), "height": float(page.height), "name": about.plain(page.name)},
        "about": about.plain(drawing.about),
        "strokes": strokes,
    }
    return msgspec.json.encode(file if drawing.timed else {**file, "timed": False}) + b"\n"
