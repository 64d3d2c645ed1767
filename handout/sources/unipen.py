"""Reads UNIPEN files: recorded pens with labels, the exchange format of handwriting recognition in the 1990s.

Statements begin with a dot in the first column.  What is read: ``.INCLUDE``, ``.COORD``, ``.X_POINTS_PER_INCH`` (or
``_MM``) and the same of Y, ``.POINTS_PER_SECOND``, ``.PEN_DOWN``, ``.PEN_UP``, ``.SEGMENT``; the rest is passed over.
Where pressure is recorded and falls to nothing, the pen is lifted.

Source: I. Guyon, L. Schomaker, R. Plamondon, M. Liberman, S. Janet: UNIPEN project of on-line data exchange and
recognizer benchmarks, 1994.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from handout.errors import InputError
from handout.sources import recorded
from handout.sources.recorded import Raw
from handout.values import Array, Drawing

_STATEMENT = re.compile(r"^\.([A-Z_0-9]+)[ \t]*", re.MULTILINE)
_SEGMENT = re.compile(r'(\S+)\s+([0-9:,\-\s]+?)(?:\s+(\S+))?\s+"((?:[^"\\]|\\.)*)"\s*$')
_COMPONENT = re.compile(r"(\d{1,9})(?::.*)?\Z", re.ASCII)
_SAMPLE = re.compile(rb"^[ \t]*-?\d", re.MULTILINE)
_DEEPEST = 8  # files that include files
_POINTS = 10.0  # a mm, where the file says nothing
Include = Callable[[str], bytes | None]


class _Segment(NamedTuple):
    level: str
    components: list[int]
    label: str


@dataclass
class _UnipenState:
    """What has been read so far; components, pen down or up, are counted as segments count them."""

    coordinates: list[str] = field(default_factory=lambda: ["X", "Y"])
    per_mm: dict[str, float] = field(default_factory=dict)
    rate: float = 0.0
    components: list[tuple[bool, Array]] = field(default_factory=list)
    segments: list[_Segment] = field(default_factory=list)


def from_unipen(data: bytes, include: Include | None = None) -> Drawing:
    """Read a UNIPEN file.

    include : finds the bytes of an ``.INCLUDE``d file by its name; None if it is not there.

    Returns strokes of the pen on paper, y turned down.  `about["segments"]` lists the labels, each as ``{"level",
    "label", "strokes"}`` with the indices of its strokes; words are numbered by the segments of level WORD, else TEXT.

    Raises InputError: not UNIPEN, samples that are not numbers, or an included file that is missing.
    """
    state = _UnipenState()
    _read_statements(data, state, include or (lambda name: None), 0)
    if not state.components and not state.segments:
        raise InputError("This is not UNIPEN: it has neither .PEN_DOWN nor .SEGMENT.")
    parts = [(n, rows) for n in _drawn_components(state) for rows in _paper_rows(state, state.components[n][1])]
    # the segments that are words; where no words are marked, the texts
    levels = ([segment for segment in state.segments if segment.level == level] for level in ("WORD", "TEXT"))
    words = next(filter(None, levels), [])
    word_of = {index: word for word, segment in enumerate(words) for index in segment.components}
    raw = [_raw(state, state.components[index][1], rows, word_of.get(index, -1)) for index, rows in parts]
    labels = _labels(state.segments, [index for index, _ in parts])
    return recorded.make_drawing(raw, "UNIPEN file", {"segments": labels} if labels else {})


def _labels(segments: list[_Segment], component_of: list[int]) -> list[dict[str, object]]:
    """The segments with the indices of their strokes, given the component that each stroke is of."""
    strokes: dict[int, list[int]] = {}
    for stroke, index in enumerate(component_of):
        strokes.setdefault(index, []).append(stroke)
    return [
        {"level": s.level, "label": s.label, "strokes": [n for index in s.components for n in strokes.get(index, [])]}
        for s in segments
    ]


def _read_statements(data: bytes, state: _UnipenState, include: Include, depth: int) -> None:
    if depth > _DEEPEST:
        raise InputError(f"This UNIPEN file includes files more than {_DEEPEST} deep.")
    recorded.refuse_many(len(_SAMPLE.findall(data)), "UNIPEN file")  # before millions of lines are taken apart
    text = data.decode("latin-1")
    marks = list(_STATEMENT.finditer(text))
    for mark, after in zip(marks, [*marks[1:], None], strict=False):
        name, body = mark.group(1), text[mark.end() : after.start() if after else len(text)]
        if name == "INCLUDE":
            wanted = body.strip()
            more = include(wanted)
            if more is None:
                raise InputError(f"The included file {wanted} is missing: put it beside this file, or into include/.")
            _read_statements(more, state, include, depth + 1)
        elif name in ("PEN_DOWN", "PEN_UP"):
            width, number = len(state.coordinates), len(state.components)
            rows = [line.split()[:width] for line in body.splitlines() if line.strip()]
            try:
                samples = np.array([[*map(float, row)] for row in rows], dtype=np.float64).reshape(-1, width)
            except ValueError as error:
                wrong = f"has a sample that is not {width} numbers"
                raise InputError(f"Component {number} of this UNIPEN file {wrong}.") from error
            # an empty .PEN_UP only ends a movement; segments do not count it
            if name == "PEN_DOWN" or len(samples):
                state.components.append((name == "PEN_DOWN", samples))
        elif name == "SEGMENT":
            _segment(body, state)
        else:
            _declare(name, body, state)


def _declare(name: str, body: str, state: _UnipenState) -> None:
    match = re.fullmatch(r"([XY])_POINTS_PER_(INCH|MM)", name)
    if name == "COORD":
        if state.components:
            raise InputError("This UNIPEN file has .COORD behind samples: it has to stand before them.")
        state.coordinates = body.split()
    elif match or name == "POINTS_PER_SECOND":
        try:
            value = float(body.split()[0])
        except (ValueError, IndexError):
            value = 0.0
        if not 0 < value < 1e6:
            raise InputError(f".{name} of this UNIPEN file is not a positive number.")
        if match is None:
            state.rate = value
        else:
            state.per_mm[match.group(1)] = value / 25.4 if match.group(2) == "INCH" else value


def _segment(body: str, state: _UnipenState) -> None:
    match = _SEGMENT.match(" ".join(body.split()))
    if match is None:
        return
    numbers: list[int] = []
    for part in re.split(r"[,\s]+", match.group(2).strip()):
        ends = [int(end.group(1)) for piece in part.split("-") if (end := _COMPONENT.match(piece))]
        if ends and ends[-1] - ends[0] < 100_000:
            numbers += range(ends[0], ends[-1] + 1)
    label = re.sub(r"\\(.)", r"\1", match.group(4))
    state.segments.append(_Segment(match.group(1), numbers, label))


def _drawn_components(state: _UnipenState) -> list[int]:
    """Components of the pen down; of a file of labels, which uses part of the files it includes, those it labels."""
    down = [index for index, (is_down, _) in enumerate(state.components) if is_down]
    labelled = {component for segment in state.segments for component in segment.components}
    return [index for index in down if index in labelled] if labelled else down


def _paper_rows(state: _UnipenState, values: Array) -> list[slice]:
    """The rows of a component that are of the pen on paper: some tablets go on above it, with no pressure."""
    if "P" not in state.coordinates:
        return [slice(None)]
    down = np.concatenate([[False], values[:, state.coordinates.index("P")] > 0, [False]])
    if not down.any():  # nothing was measured
        return [slice(None)]
    return [slice(a, b) for a, b in np.flatnonzero(np.diff(down)).reshape(-1, 2).tolist()]


def _raw(state: _UnipenState, values: Array, rows: slice, word: int) -> Raw:
    """Some rows of a component."""
    names = state.coordinates
    if "X" not in names or "Y" not in names:
        raise InputError(f"The coordinates of this UNIPEN file are {' '.join(names)}; X and Y are needed.")
    t, values = _times(state, values), values[rows]
    x = values[:, names.index("X")] / state.per_mm.get("X", _POINTS)
    y = -values[:, names.index("Y")] / state.per_mm.get("Y", state.per_mm.get("X", _POINTS))
    channels = {}
    if "P" in names and len(values):
        k = names.index("P")
        most = max(float(every[:, k].max()) for _, every in state.components if len(every))
        channels["pressure"] = np.clip(values[:, k] / recorded.full_pressure(most), 0.0, 1.0)
    return Raw(np.column_stack([x, y]), None if t is None else t[rows], channels, word)


def _times(state: _UnipenState, values: Array) -> Array | None:
    """s; the unit of T is what comes nearest to the stated rate: files in ms (as the format says) and in µs exist."""
    if "T" in state.coordinates:
        t = values[:, state.coordinates.index("T")]
        if not state.rate or len(t) < 3 or not (np.diff(t) > 0).any():
            return np.asarray(t * 1e-3)
        step = float(np.median(np.diff(t)[np.diff(t) > 0]))
        unit = min((1.0, 1e-3, 1e-6), key=lambda u: abs(np.log(step * u * state.rate)))
        return np.asarray(t * unit)
    return np.arange(len(values)) / state.rate if state.rate else None
