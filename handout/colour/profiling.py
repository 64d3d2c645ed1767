"""A colour table as an ICC profile: an output profile, or a device link."""

from __future__ import annotations

from datetime import datetime

import numpy as np

from handout.colour import chart_tables, icc
from handout.colour.models import inverse
from handout.colour.models.forward import Forward
from handout.colour.table import ColourTable
from handout.values import Array

SIDE = 45  # of the table from L*a*b*: odd, so that greys lie on its nodes
_GAMUT_SIDE = 17
_FULL = 10.0  # ΔE00 out of reach that the gamut tag shows as full
_SEEN = 1.0  # ΔE00 from which a colour is out of reach
_D50 = np.array([96.42, 100.0, 82.49])
_LIGHT = chart_tables.srgb_to_xyz(np.eye(3))  # XYZ of red, green and blue at full
_EPSILON, _KAPPA = 216 / 24389, 24389 / 27
_CENTRE = 32768 / 65535
_BEND = 0.5  # how much finer than even the table is about grey


def output_profile(table: ColourTable, made: datetime, said: str) -> bytes:
    """The printer's profile: device RGB → L*a*b*, L*a*b* → device RGB, and what cannot be printed.

    L*a*b* is relative to the paper; with the intent "absolute colorimetric" colours are those of the scan, as the
    table has them.  The three other intents give the same: paper stays bare, and what is out of reach becomes the
    printable colour that looks nearest.

    Parameters
    ----------
    table : ColourTable
    made : datetime.  said : str, what the profile is called.
    """
    forward = Forward(np.asarray(table.seen, dtype=np.float64))
    white = chart_tables.srgb_to_xyz(forward.white[None])[0]
    seen = np.minimum(_encoded(_relative(table.seen.reshape(-1, 3).astype(float), white)), 1)
    side = len(table.seen)
    there = icc.lut16(seen.reshape(side, side, side, 3), [np.linspace(0, 1, 2)] * 3)
    places = np.linspace(0, 1, 4096)
    back = icc.lut16(_sent(forward, white), [places, _bent(places), _bent(places)])
    tags = {b"wtpt": icc.point(white / 100)}
    for intent in b"012":
        tags |= {b"A2B" + bytes([intent]): there, b"B2A" + bytes([intent]): back}
    tags[b"gamt"] = icc.lut16(_out_of_reach(forward, white), [np.linspace(0, 1, 2)] * 3)
    return icc.profile(b"prtr", b"Lab ", made, said, tags)


def device_link(table: ColourTable, made: datetime, said: str) -> bytes:
    """The table itself, scanned RGB → device RGB; full white is bare paper."""
    nodes = np.array(table.nodes, dtype=np.float64)
    nodes[-1, -1, -1] = np.maximum(nodes[-1, -1, -1], 1)
    steps = ("RGB of the scanner, taken for sRGB", said)
    tags = {b"A2B0": icc.lut16(nodes, [np.linspace(0, 1, 2)] * 3), b"pseq": icc.sequence(steps)}
    return icc.profile(b"link", b"RGB ", made, said, tags)


def _relative(scanned: Array, white: Array) -> Array:
    """(n, 3) L*a*b* relative to the paper, of (n, 3) scanned RGB; `white` is the paper's XYZ."""
    ratio = chart_tables.srgb_to_xyz(scanned) / white
    f = np.where(ratio > _EPSILON, np.cbrt(np.maximum(ratio, _EPSILON)), (_KAPPA * ratio + 16) / 116)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)


def _scanned(lab: Array, white: Array) -> Array:
    """(n, 3) scanned RGB, not cut to 0–1, of (n, 3) L*a*b* relative to the paper."""
    y = (lab[:, 0] + 16) / 116
    f = np.stack([y + lab[:, 1] / 500, y, y - lab[:, 2] / 200], axis=1)
    ratio = np.where(f**3 > _EPSILON, f**3, (116 * f - 16) / _KAPPA)
    light = np.linalg.solve(_LIGHT.T, (ratio * white).T).T
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055)


def _encoded(lab: Array) -> Array:
    """(n, 3) of 0–1: the 16-bit encoding of version 2, annex A.3 of ICC.1:2001-04."""
    return np.asarray((lab + np.array([0, 128, 128])) * np.array([652.8, 256, 256]) / 65535)


def _decoded(places: Array) -> Array:
    """(n, 3) L*a*b*; the inverse of `_encoded`."""
    return np.asarray(places * 65535 / np.array([652.8, 256, 256]) - np.array([0, 128, 128]))


def _bent(encoded: Array) -> Array:
    """Where an encoded a* or b* lies in the table: 0 at its middle node, and nodes closer about it."""
    away = np.clip((encoded - _CENTRE) / (1 - _CENTRE), -1, 1)
    return np.asarray(0.5 + 0.5 * np.sign(away) * np.abs((1 + _BEND) * away / (1 + _BEND * np.abs(away))))


def _straightened(places: Array) -> Array:
    """The inverse of `_bent`."""
    away = 2 * places - 1
    return np.asarray(_CENTRE + (1 - _CENTRE) * away / (1 + _BEND - _BEND * np.abs(away)))


def _sent(forward: Forward, white: Array) -> Array:
    """(s, s, s, 3) device RGB, unclamped, on the table's grid of L*a*b*."""
    axis = np.linspace(0, 1, SIDE)
    bent = _straightened(axis)
    grid = np.stack(np.meshgrid(axis, bent, bent, indexing="ij"), axis=-1).reshape(-1, 3)
    device = inverse.invert(forward, _scanned(_decoded(grid), white))
    return device.reshape(SIDE, SIDE, SIDE, 3)


def _out_of_reach(forward: Forward, white: Array) -> Array:
    """(s, s, s, 1): 0 where a colour can be printed, and else as much as it is off, `_FULL` giving 1."""
    axis = np.linspace(0, 1, _GAMUT_SIDE)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    lost = inverse.printable(forward, _scanned(_decoded(grid), white))[1]
    return np.where(lost > _SEEN, lost / _FULL, 0.0).reshape(_GAMUT_SIDE, _GAMUT_SIDE, _GAMUT_SIDE, 1)
