"""Reads SVC files: recorded pens with pose, as tablets' test programs write them.

The first line is the number of samples; each further line is one sample: y, x (both in the tablet's lines, y upwards),
time (ms), whether the pen is on the paper (1) or above it (0), azimuth and altitude (tenths of a degree), pressure
(raw).

Source: SVC, as the format is described with the public samples of handwriting signal libraries.
"""

from __future__ import annotations

import re

import numpy as np

from handout.errors import InputError
from handout.sources import recorded
from handout.sources.recorded import Raw
from handout.values import Drawing

_LINE = 25.4 / 5080  # mm, of the tablets' usual 5080 lines an inch
_COLUMNS = 7


def from_svc(data: bytes) -> Drawing:
    """Read an SVC file; strokes of the pen on paper, y turned down, with pressure, tilt from the vertical and azimuth.

    Raises InputError: not SVC: a first line that is no number, lines that are not seven numbers, or fewer than it says.
    """
    recorded.refuse_many(data.count(b"\n") - 1, "SVC file")  # before millions of lines are taken apart
    lines = data.decode("latin-1").split("\n")
    if not re.fullmatch(r"\d{1,9}", lines[0].strip(), re.ASCII):
        raise InputError("This is not SVC: its first line is not the number of samples.")
    rows = [line.split() for line in lines[1:] if line.strip()]
    try:
        table = np.array([[float(v) for v in row] for row in rows], dtype=np.float64).reshape(len(rows), -1)
    except ValueError as error:
        raise InputError("This is not SVC: a sample is not seven numbers.") from error
    if len(rows) and table.shape[1] != _COLUMNS:
        raise InputError(f"This is not SVC: its samples have {table.shape[1]} columns, not {_COLUMNS}.")
    if not np.isfinite(table).all():
        raise InputError("This SVC has a value that is not a finite number.")
    announced = int(lines[0])
    if len(rows) < announced:
        raise InputError(f"This SVC is cut off: it has {len(rows)} of {announced} samples.")
    full = recorded.full_pressure(float(table[:, 6].max())) if len(rows) else 1.0
    raw = list[Raw]()
    down = np.concatenate([[False], table[:, 3] > 0, [False]]) if len(rows) else np.zeros(0)
    for a, b in np.flatnonzero(np.diff(down.astype(np.int8))).reshape(-1, 2).tolist():
        piece = table[a:b]
        channels = {
            "pressure": np.clip(piece[:, 6] / full, 0.0, 1.0),
            "azimuth": np.radians(piece[:, 4] / 10),
            "tilt": np.pi / 2 - np.radians(piece[:, 5] / 10),
        }
        raw.append(Raw(np.column_stack([piece[:, 1], -piece[:, 0]]) * _LINE, piece[:, 2] * 1e-3, channels))
    return recorded.make_drawing(raw, "SVC file", {})
