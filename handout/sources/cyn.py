"""Reads CYN files: pages of strokes with all of a pen's pose, as the recordings of seed 001 are kept.

A head of some lines, the number of strokes, and then for each stroke ``stroke`` and its number, the number of its
samples, and one line a sample: its number, time (s), x and y (0–1 of the tablet, y down), pressure (0–1), rotation of
the barrel (degrees), and the tilts along x and y (−1 to 1).  The tilts are taken as shares of a right angle, and the
tablet as 200 mm wide and high, since the files say neither.

Source: the files that came with seed 001.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from handout.errors import InputError
from handout.sources import recorded
from handout.sources.recorded import Raw, lean
from handout.values import Array, Drawing

_SIDE = 200.0  # mm of a tablet, set: the files do not say it
_COLUMNS = 8


def from_cyn(data: bytes) -> Drawing:
    """Read a CYN file. Raises InputError: not CYN, a stroke that is cut off, or a sample that is not eight numbers."""
    recorded.refuse_many(data.count(b"\n"), "CYN file")
    raw = list[Raw]()
    for table in _strokes(data):
        _, t, x, y, pressure, rotation, tilt_x, tilt_y = table.T
        tilt, azimuth = lean(tilt_x * np.pi / 2, tilt_y * np.pi / 2)
        channels = {"pressure": np.clip(pressure, 0.0, 1.0), "tilt": tilt, "azimuth": azimuth}
        raw.append(Raw(np.column_stack([x, y]) * _SIDE, t, {**channels, "rotation": np.radians(rotation)}))
    return recorded.make_drawing(raw, "CYN file", {})


def _strokes(data: bytes) -> Iterator[Array]:
    lines = data.decode("latin-1").splitlines()
    heads = [at for at, line in enumerate(lines) if line.split()[:1] == ["stroke"]]
    if not heads:
        raise InputError("This is not CYN: it has no line that begins a stroke.")
    for number, at in enumerate(heads, 1):
        said = lines[at + 1].strip() if at + 1 < len(lines) else ""
        if not re.fullmatch(r"\d{1,9}", said, re.ASCII):
            raise InputError(f"Stroke {number} of this CYN file does not say how many samples it has.")
        rows = [line.split() for line in lines[at + 2 : at + 2 + int(said)]]
        try:
            table = np.array([[float(v) for v in row] for row in rows], dtype=np.float64).reshape(len(rows), _COLUMNS)
        except ValueError as error:
            raise InputError(
                f"Stroke {number} of this CYN file has a sample that is not {_COLUMNS} numbers."
            ) from error
        if len(rows) < int(said):
            raise InputError(f"This CYN file is cut off: stroke {number} has {len(rows)} of {said} samples.")
        if len(rows):
            yield table
