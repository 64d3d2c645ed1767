"""Reads pointer events of web pages in JSON: what a page notes of a pen that draws on it.

A list of events, or an object with such a list as its ``events``; each is an object with the names of the standard:
``x`` and ``y`` (or ``offsetX``, ``clientX``, ``pageX`` …; CSS pixels), ``timeStamp`` (ms), ``pressure`` (0–1),
``tiltX``, ``tiltY`` and ``twist`` (degrees), or ``altitudeAngle`` and ``azimuthAngle`` (rad).  A stroke begins with an
event of ``type`` ``pointerdown`` and ends with ``pointerup``; where events have no type, the pen is down where its
pressure is more than 0.  A list of such lists is a list of strokes.

Source: W3C, Pointer Events, Level 3; CSS pixels are 1/96 inch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import msgspec
import numpy as np

from handout.errors import InputError
from handout.sources import recorded
from handout.sources.recorded import Raw, lean
from handout.units import PX
from handout.values import Array, Drawing

_PLACES = (("x", "y"), ("offsetX", "offsetY"), ("clientX", "clientY"), ("pageX", "pageY"), ("screenX", "screenY"))
_TIMES = ("timeStamp", "time", "t")
_OVER = ("pointerup", "pointercancel", "pointerleave", "pointerout")


class _Event(msgspec.Struct):
    """The fields of an event that are read; others are skipped."""

    type: str = ""
    x: float | None = None
    y: float | None = None
    offsetX: float | None = None
    offsetY: float | None = None
    clientX: float | None = None
    clientY: float | None = None
    pageX: float | None = None
    pageY: float | None = None
    screenX: float | None = None
    screenY: float | None = None
    timeStamp: float | None = None
    time: float | None = None
    t: float | None = None
    pressure: float | None = None
    tiltX: float | None = None
    tiltY: float | None = None
    twist: float | None = None
    altitudeAngle: float | None = None
    azimuthAngle: float | None = None


class _Recording(msgspec.Struct):
    events: list[_Event]


def looks_like(data: bytes) -> bool:
    """Whether JSON could be pointer events: a list, or an object with events."""
    start = data.lstrip(b"\xef\xbb\xbf \t\r\n")
    return start.startswith(b"[") or (b'"events"' in start and b'"handout-' not in start[:200])


def from_pointer_events(data: bytes) -> Drawing:
    """Read pointer events in JSON. Raises InputError: not such JSON, or no event of a pen that is down."""
    try:
        read = msgspec.json.decode(data, type=list[_Event] | _Recording if data.lstrip()[:1] != b"[" else list[Any])
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"This is not pointer events in JSON: {error}.") from error
    return recorded.make_drawing([_raw(events) for events in _strokes(read)], "file of pointer events", {})


def _strokes(read: Any) -> Iterator[list[_Event]]:
    whole = read.events if isinstance(read, _Recording) else read
    lists = whole if whole and all(isinstance(each, list) for each in whole) else [whole]
    for part in lists:
        try:
            events = msgspec.convert(part, list[_Event])
        except msgspec.MsgspecError as error:
            raise InputError(f"This is not pointer events in JSON: {error}.") from error
        recorded.refuse_many(len(events), "file of pointer events")
        yield from [events] if len(lists) > 1 else _split_strokes(events)


def _split_strokes(events: Sequence[_Event]) -> Iterator[list[_Event]]:
    typed = any(event.type == "pointerdown" for event in events)
    stroke: list[_Event] = []
    for event in events:
        over = event.type in _OVER if typed else event.pressure == 0
        if stroke and (over or event.type == "pointerdown"):
            yield stroke
            stroke = []
        if not over and (stroke or not typed or event.type == "pointerdown"):
            stroke.append(event)
    if stroke:
        yield stroke


def _raw(events: Sequence[_Event]) -> Raw:
    places = (pair for pair in _PLACES if all(_values(events, name) is not None for name in pair))
    names = next(places, None)
    if names is None:
        raise InputError("This file has pointer events without places: x and y, offsetX and offsetY, or the like.")
    columns = [_values(events, name) for name in names]
    clocks = [values for name in _TIMES if (values := _values(events, name)) is not None]
    xy = np.stack([c for c in columns if c is not None], axis=1) * PX
    return Raw(xy, clocks[0] * 1e-3 if clocks else None, _pen_channels(events))


def _pen_channels(events: Sequence[_Event]) -> dict[str, Array]:
    pen = {}
    pressure, twist = _values(events, "pressure"), _values(events, "twist")
    altitude, azimuth = _values(events, "altitudeAngle"), _values(events, "azimuthAngle")
    tilt_x, tilt_y = _values(events, "tiltX"), _values(events, "tiltY")
    if pressure is not None:
        pen["pressure"] = np.clip(pressure, 0.0, 1.0)
    if altitude is not None and azimuth is not None:
        pen["tilt"], pen["azimuth"] = np.pi / 2 - altitude, azimuth
    elif tilt_x is not None and tilt_y is not None:
        pen["tilt"], pen["azimuth"] = lean(np.radians(tilt_x), np.radians(tilt_y))
    if twist is not None:
        pen["rotation"] = np.radians(twist)
    return pen


def _values(events: Sequence[_Event], name: str) -> Array | None:
    """(n,): a field of all events, or None if one lacks it."""
    values = [getattr(event, name) for event in events]
    return None if any(value is None for value in values) else np.array(values, dtype=np.float64)
