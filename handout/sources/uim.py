"""Reads UIM files: Universal Ink Model 3.1, as the ink of Wacom's programs is exchanged.

A RIFF file whose chunks are protocol buffers.  Read is the part ``INPT``, what the sensors of the pen reported:
samples of each channel as differences of whole numbers, times their precision and resolution.  Ink without sensor
data, which is geometry only, has nothing to learn from and is refused.

Source: Universal Ink Model, version 3.1 (format and channels); Protocol Buffers, encoding.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handout.errors import InputError
from handout.sources import recorded
from handout.sources.recorded import Raw
from handout.values import Array, Drawing

_CHANNELS = "will://input/3.0/channel/"
_MOST_DIGITS = 18  # of a precision


class _UimChannel(NamedTuple):
    """name : as the standard has it.  factor : of its numbers, to m, s, rad or a share."""

    name: str
    factor: float


Message = dict[int, list[int | bytes]]


def from_uim(data: bytes) -> Drawing:
    """Read a UIM file; strokes with pressure, tilt from the vertical, azimuth and rotation, where sensors had them.

    Raises InputError: not UIM, of another version, cut off, or without samples of a pen's sensors.
    """
    if data[:4] != b"RIFF" or data[8:12] != b"UINK":
        raise InputError("This is not UIM: it does not begin as a file of the Universal Ink Model.")
    try:
        parts, at = {}, 12
        while at + 8 <= len(data):
            kind, (size,) = data[at : at + 4], struct.unpack_from("<I", data, at + 4)
            if at + 8 + size > len(data):
                raise ValueError("a part is longer than the file")
            parts[kind] = data[at + 8 : at + 8 + size]
            at += 8 + size + size % 2
        if parts.get(b"HEAD", b"")[:2] != b"\x03\x01":
            raise InputError("This UIM is of another version than 3.1: save it anew with a newer program.")
        root = _message(parts.get(b"INPT", b""))
        known: dict[bytes, _UimChannel] = {}
        for context in _inner(root, 1):
            known |= _describe_channels(context)
        strokes = [raw for data in _inner(root, 2) if (raw := _raw(_samples(_message(data), known))) is not None]
    except (struct.error, IndexError, ValueError, OverflowError) as error:
        raise InputError("This UIM is cut off or damaged.") from error
    return recorded.make_drawing(strokes, "UIM file", {})


def _message(data: bytes) -> Message:
    """The fields of a protocol buffer: number → whole numbers, and what has a length or four or eight bytes, raw."""
    fields: Message = defaultdict(list)
    at = 0
    while at < len(data):
        key, at = _whole(data, at)
        kind = key & 7
        if kind == 0:
            value, at = _whole(data, at)
            fields[key >> 3].append(value)
            continue
        if kind not in (1, 2, 5):
            raise ValueError("no field of a protocol buffer")
        size, at = _whole(data, at) if kind == 2 else ({1: 8, 5: 4}[kind], at)
        if at + size > len(data):
            raise ValueError("a field is longer than its message")
        fields[key >> 3].append(data[at : at + size])
        at += size
    return fields


def _whole(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, at
        shift += 7
        if shift > 63:
            raise ValueError("a number is too long")


def _inner(message: Message, number: int) -> list[bytes]:
    return [value for value in message.get(number, []) if isinstance(value, bytes)]


def _number(message: Message, number: int) -> int:
    return next((value for value in message.get(number, []) if isinstance(value, int)), 0)


def _describe_channels(context: bytes) -> dict[bytes, _UimChannel]:
    """Channels by their identifiers, of the context of an input."""
    known = {}
    for sensor in _inner(_message(context), 5):
        for group in _inner(_message(sensor), 2):
            for each in map(_message, _inner(_message(group), 2)):
                (identity,), (name,) = _inner(each, 1)[:1], _inner(each, 2)[:1]
                (resolution,) = struct.unpack("<d", (_inner(each, 4) or [struct.pack("<d", 1.0)])[0])
                digits = _number(each, 7)
                if digits > _MOST_DIGITS or not resolution > 0:
                    raise ValueError("a channel without a unit")
                plain = name.decode("ascii").removeprefix(_CHANNELS)
                known[identity] = _UimChannel(plain, 10.0**-digits / resolution)
    return known


@dataclass(frozen=True, eq=False)
class _Sensed:
    """One movement: when it began, s, and the samples of its channels by their names."""

    start: float
    channels: dict[str, Array]


def _samples(message: Message, known: dict[bytes, _UimChannel]) -> _Sensed:
    channels = {}
    for each in map(_message, _inner(message, 5)):
        (identity,) = _inner(each, 1)[:1]
        if identity in known:
            packed = b"".join(_inner(each, 2))
            numbers, at = [], 0
            while at < len(packed):
                value, at = _whole(packed, at)
                numbers.append((value >> 1) ^ -(value & 1))
            recorded.refuse_many(len(numbers), "UIM file")
            channels[known[identity].name] = np.cumsum(np.array(numbers, dtype=np.float64)) * known[identity].factor
    return _Sensed(_number(message, 4) * 1e-3, channels)


def _raw(sensed: _Sensed) -> Raw | None:
    c = sensed.channels
    if "X" not in c or "Y" not in c or not len(c["X"]):
        return None
    pen = {}
    if "Pressure" in c:
        pen["pressure"] = np.clip(c["Pressure"], 0.0, 1.0)
    if "Altitude" in c:
        pen["tilt"] = np.pi / 2 - c["Altitude"]
    if "Azimuth" in c:
        pen["azimuth"] = c["Azimuth"]
    if "Rotation" in c:
        pen["rotation"] = c["Rotation"]
    xy = np.column_stack([c["X"], c["Y"]]) * 1e3
    if any(len(values) != len(xy) for values in (*pen.values(), c.get("Timestamp", xy))):
        raise ValueError("channels of several lengths")
    return Raw(xy, sensed.start + c["Timestamp"] if "Timestamp" in c else None, pen)
