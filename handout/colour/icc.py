"""ICC profiles of a calibrated printer, for other programs: version 2.4, with 16-bit tables, which all of them read.

An output profile ('prtr') tells what the printer makes of RGB as L*a*b* and which RGB gives an L*a*b*.  Its L*a*b*
are those of the scanner, whose RGB is taken for sRGB: it is right for what that scanner has scanned, and about as
near as the scanner is to sRGB for all else.  A device link ('link') is the colour table itself, scanned RGB → device
RGB.

Source: ICC.1:2001-04 (version 2.4.0), clauses 6.1 (header), 6.3.3 and 6.3.5 (tags that a profile must have), 6.5.7
(lut16Type), 6.5.17 (textDescriptionType), annex A (relative colorimetry).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from datetime import datetime

import numpy as np

from handout.values import Array

_D50 = (0.9642, 1.0, 0.8249)
_MOST = 65535
_ENTRIES = 4096  # of a curve; the most that lut16Type allows
_LICENCE = "No rights reserved: use it as you like."


def lut16(nodes: Array, curves: Sequence[Array]) -> bytes:
    """A 16-bit table.

    Parameters
    ----------
    nodes : (s, s, s, k) float, the first input changing slowest, as `clamped` understands them: what leaves 0–1 is cut
        after interpolation only, by the output curves.
    curves : three of (n,) float 0–1, even in the input: places in the table, 2 to 4096 of them.
    """
    low, high = min(0.0, float(nodes.min())), max(1.0, float(nodes.max()))
    ramp = np.clip(np.linspace(low, high, _ENTRIES), 0, 1)
    side, outputs = nodes.shape[0], nodes.shape[3]
    head = struct.pack(">4s4xBBBx", b"mft2", 3, outputs, side)
    matrix = struct.pack(">9i", *(65536 * np.eye(3, dtype=int)).ravel().tolist())
    (entries,) = {len(curve) for curve in curves}
    counts = struct.pack(">HH", entries, _ENTRIES)
    tables = [*curves, (nodes - low) / (high - low), *([ramp] * outputs)]
    return head + matrix + counts + b"".join(_words(values) for values in tables)


def _words(values: Array) -> bytes:
    return np.rint(np.clip(values, 0, 1) * _MOST).astype(">u2").tobytes()


def text(words: str) -> bytes:
    """textType: plain words, others than ASCII as '?'."""
    return b"text\0\0\0\0" + words.encode("ascii", "replace") + b"\0"


def description(words: str) -> bytes:
    """textDescriptionType, in ASCII and in Unicode."""
    plain = words.encode("ascii", "replace") + b"\0"
    wide = words.encode("utf-16-be") + b"\0\0"
    return struct.pack(">4s4xI", b"desc", len(plain)) + plain + struct.pack(">4xI", len(wide) // 2) + wide + bytes(70)


def sequence(steps: Sequence[str]) -> bytes:
    """profileSequenceDescType: what a device link was made of, one description each."""
    none = description("")
    return struct.pack(">4s4xI", b"pseq", len(steps)) + b"".join(bytes(20) + none + description(one) for one in steps)


def point(light: Sequence[float]) -> bytes:
    """XYZType of one colour, white Y = 1."""
    return b"XYZ \0\0\0\0" + _fixed(light)


def _fixed(values: Sequence[float]) -> bytes:
    return struct.pack(f">{len(values)}i", *(round(65536 * float(value)) for value in values))


def profile(kind: bytes, connection: bytes, made: datetime, said: str, tags: Mapping[bytes, bytes]) -> bytes:
    """The bytes of a profile.

    Parameters
    ----------
    kind : b"prtr" or b"link".
    connection : b"Lab " or, of a link, the space that it ends in, b"RGB ".
    made : when.
    said : what the profile is called.
    tags : by signature, of what `lut16` and its like give; equal ones are stored once.
    """
    every = {b"desc": description(said), b"cprt": text(_LICENCE), **tags}
    begin, places, body = 132 + 12 * len(every), {}, b""
    table = struct.pack(">I", len(every))
    for name, data in every.items():
        if data not in places:
            places[data] = begin + len(body)
            body += data + bytes(-len(data) % 4)
        table += struct.pack(">4sII", name, places[data], len(data))
    size = begin + len(body)
    return _header(size, kind, connection, made) + table + body


def _header(size: int, kind: bytes, connection: bytes, made: datetime) -> bytes:
    """128 bytes: relative colorimetric by default, made on no certain platform."""
    when = (made.year, made.month, made.day, made.hour, made.minute, made.second)
    start = struct.pack(">I4xI4s4s4s6H4s", size, 0x02400000, kind, b"RGB ", connection, *when, b"acsp")
    return start + bytes(24) + struct.pack(">I", 1) + _fixed(_D50) + bytes(48)
