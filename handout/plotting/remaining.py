"""A drawing cut in two at a place: what is drawn, and what is left of it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from handout.plotting.places import Place
from handout.values import Array, Drawing, Stroke

_CHANNELS = ("pressure", "tilt", "azimuth", "rotation", "width")
_ANGLES = ("azimuth", "rotation")  # these come round again


def drawn(drawing: Drawing, place: Place) -> Drawing:
    """The part of a drawing that lies before a place."""
    whole = drawing.strokes[: place.stroke]
    broken = [_until(stroke, place.time) for stroke in drawing.strokes[place.stroke : place.stroke + 1]]
    return dataclasses.replace(drawing, strokes=(*whole, *(stroke for stroke in broken if stroke is not None)))


def remaining(drawing: Drawing, place: Place) -> Drawing:
    """What is left of a drawing behind a place: the broken stroke begins there; times, words and layers are kept."""
    if place.stroke >= len(drawing.strokes):
        return dataclasses.replace(drawing, strokes=())
    broken = _from(drawing.strokes[place.stroke], place.time)
    whole = drawing.strokes[place.stroke + 1 :]
    return dataclasses.replace(drawing, strokes=whole if broken is None else (broken, *whole))


def onward(before: Place, left: Drawing, whole: Drawing, after: Place) -> Place:
    """A place on what was left behind another place, as a place on the whole drawing."""
    return max(before, Place(after.stroke + len(whole.strokes) - len(left.strokes), after.time))


def _until(stroke: Stroke, time: float) -> Stroke | None:
    if time < stroke.t[0] or (time == stroke.t[0] and len(stroke.t) > 1):
        return None
    if time >= stroke.t[-1]:
        return stroke
    return _cut(stroke, np.append(stroke.t[stroke.t < time], time))


def _from(stroke: Stroke, time: float) -> Stroke | None:
    if (time <= stroke.t[0] and len(stroke.t) > 1) or time < stroke.t[0]:
        return stroke
    if time >= stroke.t[-1]:
        return None
    return _cut(stroke, np.append(time, stroke.t[stroke.t > time]))


def _cut(stroke: Stroke, t: Array) -> Stroke:
    """The stroke at the times t: its samples, and what lies between them at an end."""
    xy = np.stack([np.interp(t, stroke.t, stroke.xy[:, axis]) for axis in (0, 1)], axis=1)
    known = {name: values for name in _CHANNELS if (values := getattr(stroke, name)) is not None}
    channels: dict[str, Any] = {name: _between(name, t, stroke.t, values) for name, values in known.items()}
    return dataclasses.replace(stroke, t=t, xy=xy, **channels)


def _between(name: str, t: Array, known: Array, values: Array) -> Array:
    """A channel at the times t; its samples stay as they are, to the last digit."""
    found = np.interp(t, known, np.unwrap(values) if name in _ANGLES else values)
    at = np.minimum(np.searchsorted(known, t), len(known) - 1)
    return np.where(known[at] == t, values[at], found)
