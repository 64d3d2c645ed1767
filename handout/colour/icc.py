"""A colour table as an ICC profile, version 2.4 with 16-bit tables, which all programs read.

An output profile ('prtr') says what the printer makes of RGB as L*a*b*, and which RGB gives an L*a*b*.  Its L*a*b* are
those of the scanner, whose RGB is taken for sRGB: right for what that scanner has scanned, and about as near as the
scanner is to sRGB for all else.  A device link ('link') is the colour table itself, scanned RGB → device RGB.

Source: ICC.1:2001-04 (version 2.4.0), clauses 6.1 (header), 6.3.3 and 6.3.5 (tags that a profile must have), 6.5.7
(lut16Type), 6.5.17 (textDescriptionType), annex A (relative colorimetry).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from datetime import datetime

import numpy as np

from handout.colour import conversions
from handout.colour.models import inverse
from handout.colour.models.forward import Forward
from handout.colour.table import ColourTable
from handout.values import Array

SIDE = 45  # of the table from L*a*b*: odd, so that greys lie on its nodes
_GAMUT_SIDE = 17  # of the gamut tag, which shows whole areas
_FULL = 10.0  # ΔE00 out of reach that the gamut tag shows as full
_SEEN = 1.0  # ΔE00 from which a colour is out of reach
_CENTRE = 32768 / 65535  # a* or b* of 0 in the 16-bit encoding
_BEND = 0.5  # how much finer than even the table is about grey


def output_profile(table: ColourTable, date: datetime, title: str) -> bytes:
    """The printer's profile: device RGB → L*a*b*, L*a*b* → device RGB, and what cannot be printed.

    L*a*b* is relative to the paper; with the intent "absolute colorimetric" colours are those of the scan, as the
    table has them.  The three other intents give the same: paper stays bare, and what is out of reach becomes the
    printable colour that looks nearest.

    date : datetime.  said : str, what the profile is called.
    """
    forward = Forward(np.asarray(table.scanned, dtype=np.float64))
    white = conversions.xyz_d50(forward.white[None])[0]
    labs = np.minimum(_encode_lab(conversions.lab_of_xyz(conversions.xyz_d50(table.scanned.reshape(-1, 3)), white)), 1)
    side = len(table.scanned)
    there = lut16(labs.reshape(side, side, side, 3), [np.linspace(0, 1, 2)] * 3)
    places = np.linspace(0, 1, 4096)
    # device RGB, unclamped, on the table's grid of L*a*b*
    axis = np.linspace(0, 1, SIDE)
    away = 2 * axis - 1
    bent = _CENTRE + (1 - _CENTRE) * away / (1 + _BEND - _BEND * np.abs(away))  # the inverse of `_bend`
    grid = np.stack(np.meshgrid(axis, bent, bent, indexing="ij"), axis=-1).reshape(-1, 3)
    device = inverse.invert(forward, _read_scanned(grid, white))
    back = lut16(device.reshape(SIDE, SIDE, SIDE, 3), [places, _bend(places), _bend(places)])
    tags = {b"wtpt": point(white / 100)}
    for intent in b"012":
        tags |= {b"A2B" + bytes([intent]): there, b"B2A" + bytes([intent]): back}
    # (s, s, s, 1): 0 where a colour can be printed, and else as much as it is off, `_FULL` giving 1
    axis = np.linspace(0, 1, _GAMUT_SIDE)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    lost = inverse.printable(forward, _read_scanned(grid, white))[1]
    off = np.where(lost > _SEEN, lost / _FULL, 0.0).reshape(_GAMUT_SIDE, _GAMUT_SIDE, _GAMUT_SIDE, 1)
    tags[b"gamt"] = lut16(off, [np.linspace(0, 1, 2)] * 3)
    return profile(b"prtr", b"Lab ", date, title, tags)


def device_link(table: ColourTable, date: datetime, title: str) -> bytes:
    """The table itself, scanned RGB → device RGB; full white is bare paper."""
    nodes = np.array(table.nodes, dtype=np.float64)
    nodes[-1, -1, -1] = np.maximum(nodes[-1, -1, -1], 1)
    steps = ("RGB of the scanner, taken for sRGB", title)
    tags = {b"A2B0": lut16(nodes, [np.linspace(0, 1, 2)] * 3), b"pseq": sequence(steps)}
    return profile(b"link", b"RGB ", date, title, tags)


def _read_scanned(places: Array, white: Array) -> Array:
    """(n, 3) scanned RGB, not cut to 0–1, of (n, 3) encoded L*a*b* relative to the paper."""
    lab = np.asarray(places * 65535 / np.array([652.8, 256, 256]) - np.array([0, 128, 128]))  # undoes `_encode_lab`
    return conversions.rgb_of_xyz_d50(conversions.xyz_of_lab(lab, white))


def _encode_lab(lab: Array) -> Array:
    """(n, 3) of 0–1: the 16-bit encoding of version 2, annex A.3 of ICC.1:2001-04."""
    return np.asarray((lab + np.array([0, 128, 128])) * np.array([652.8, 256, 256]) / 65535)


def _bend(encoded: Array) -> Array:
    """Where an encoded a* or b* lies in the table: 0 at its middle node, and nodes closer about it."""
    away = np.clip((encoded - _CENTRE) / (1 - _CENTRE), -1, 1)
    return np.asarray(0.5 + 0.5 * np.sign(away) * np.abs((1 + _BEND) * away / (1 + _BEND * np.abs(away))))


_D50 = (0.9642, 1.0, 0.8249)  # XYZ of the connection space's white; clause 6.1.11
_MOST = 65535  # of a number of 16 bits
_ENTRIES = 4096  # of a curve; the most that lut16Type allows
_LICENCE = "No rights reserved: use it as you like."


def lut16(nodes: Array, curves: Sequence[Array]) -> bytes:
    """A 16-bit table.

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
    words = (np.rint(np.clip(values, 0, 1) * _MOST).astype(">u2").tobytes() for values in tables)
    return head + matrix + counts + b"".join(words)


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
    return struct.pack(">4s4xI", b"pseq", len(steps)) + b"".join(bytes(20) + none + description(step) for step in steps)


def point(light: Sequence[float]) -> bytes:
    """XYZType of one colour, white Y = 1."""
    return b"XYZ \0\0\0\0" + _pack_fixed(light)


def _pack_fixed(values: Sequence[float]) -> bytes:
    return struct.pack(f">{len(values)}i", *(round(65536 * float(value)) for value in values))


def profile(kind: bytes, connection: bytes, date: datetime, title: str, tags: Mapping[bytes, bytes]) -> bytes:
    """The bytes of a profile.

    kind : b"prtr" or b"link".
    connection : b"Lab " or, of a link, the space that it ends in, b"RGB ".
    date : when.
    title : what the profile is called.
    tags : by signature, of what `lut16` and its like give; equal ones are stored once.
    """
    every = {b"desc": description(title), b"cprt": text(_LICENCE), **tags}
    begin, places, body = 132 + 12 * len(every), {}, b""
    table = struct.pack(">I", len(every))
    for name, data in every.items():
        if data not in places:
            places[data] = begin + len(body)
            body += data + bytes(-len(data) % 4)
        table += struct.pack(">4sII", name, places[data], len(data))
    size = begin + len(body)
    # 128 bytes: relative colorimetric by default, made on no certain platform
    when = (date.year, date.month, date.day, date.hour, date.minute, date.second)
    start = struct.pack(">I4xI4s4s4s6H4s", size, 0x02400000, kind, b"RGB ", connection, *when, b"acsp")
    header = start + bytes(24) + struct.pack(">I", 1) + _pack_fixed(_D50) + bytes(48)
    return header + table + body
