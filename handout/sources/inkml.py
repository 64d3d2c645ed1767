"""Reads InkML: files of this program exactly, and those of other programs as far as described here.

Channels may have any order and unit, and X and Y suffice.  Values may be differences (``'`` and ``"``), repeated
(``*``) or hexadecimal.  Contexts, trace formats and ink sources may be references; resolutions are applied.  Traces of
a lifted pen are left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import msgspec
import numpy as np

from handout import markup
from handout.errors import InputError
from handout.sources import recorded
from handout.sources.drawing_json import JsonPage
from handout.sources.recorded import Raw
from handout.values import Array, Drawing, Stroke

_LENGTHS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "pt": 25.4 / 72, "pc": 25.4 / 6, "himetric": 0.01}
_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_TOKEN = re.compile(r"""\s*([!'"]?)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|\*|\?|[TF]|[-+]?\#[0-9A-Fa-f]+)""")
_COLOUR = re.compile("#[0-9a-f]{6}")
_DIGITS = 7  # of the number of a word; one of more is none


@dataclass(frozen=True)
class _InkmlChannel:
    """A channel's name, and the factor that turns its values into mm, s, rad or 0–1."""

    name: str
    factor: float


class _Notes(NamedTuple):
    """What a trace group's annotations, and its brush, say of its traces."""

    word: int = -1
    layer: str = ""
    colour: str = ""
    nib: float = 0.0


@dataclass(frozen=True)
class _Trace:
    channels: dict[str, Array]
    start: float | None  # s, if the trace says when it began
    notes: _Notes


_PLAIN = (_InkmlChannel("X", 1.0), _InkmlChannel("Y", 1.0))


def from_inkml(data: bytes, *, unit: float = 1.0) -> Drawing:
    """Read an InkML file.

    unit : mm, of lengths for which the file names neither a unit nor a resolution.

    Returns, of a file of this program, the drawing that was written, to 1e-6 of each unit; of another, a page as
    large as its writing, with times from 0; a file without times gets 100 samples a second, is not `timed`, and has a
    note in `about["timing"]`.  Samples at which the clock stands still are left out.

    Raises InputError: not well-formed, not InkML, several pages, or a trace that cannot be read (the message says
    which).
    """
    root = markup.parse(data, "InkML")
    if root.tag != "ink":
        raise InputError(f"This is not InkML: its root element is <{root.tag}>, not <ink>.")
    groups = [note for group in root.iter("traceGroup") for note in group.findall("annotation")]
    pages = {note.text for note in groups if note.get("type") == "page"}
    if len(pages) > 1:
        raise InputError(f"This InkML holds {len(pages)} pages, which would lie over one another: make a file of each.")
    notes = {note.get("type", ""): (note.text or "").strip() for note in root.findall("annotation")}
    traces = list(_traces(root, _Formats(root, unit)))
    if notes.get("program") == "handout":
        try:
            page = msgspec.json.decode(notes.get("page", ""), type=JsonPage).page()
            about = msgspec.json.decode(notes.get("about", "{}"), type=dict[str, Any])
        except (InputError, msgspec.MsgspecError, RecursionError) as error:
            said = "This InkML says it is by handout, but its annotations page and about are damaged."
            raise InputError(said) from error
        strokes = [_stroke(trace, number) for number, trace in enumerate(traces, 1)]
        return Drawing(tuple(strokes), page, about)
    raw = [
        Raw(_xy(each), each.channels.get("T"), _pen_channels(each), *each.notes[:3], start=each.start)
        for each in traces
    ]
    return recorded.make_drawing(raw, "InkML", {kind: text for kind, text in notes.items() if kind}, fit=False)


class _Formats:
    """Finds the channels of a trace, following references."""

    def __init__(self, root: Element, unit: float) -> None:
        self._named = {element.get("id"): element for element in root.iter() if element.get("id")}
        self.unit = unit

    def nib(self, element: Element) -> float | None:
        """mm, of the flat nib that is the brush of a group or a trace; None if it names no brush."""
        brush = self._named.get((element.get("brushRef") or "").partition("#")[2])
        if brush is None:
            return None
        properties = {p.get("name"): p for p in brush.findall("brushProperty")}
        if "width" not in properties or "tip" not in properties or properties["tip"].get("value") != "rectangle":
            return 0.0
        width = properties["width"]
        nib = (_number(width.get("value")) or 0.0) * _LENGTHS.get(width.get("units", ""), self.unit)
        return nib if 0 < nib < np.inf else 0.0

    def find_channels(
        self, element: Element, current: tuple[_InkmlChannel, ...], depth: int = 0
    ) -> tuple[_InkmlChannel, ...]:
        """The channels that `element` (trace, group, context, source or format) names, else `current`."""
        if element.tag == "traceFormat":
            return self._channels(element, None)
        if depth > 8:
            return current
        trace_format = element.find("traceFormat")
        if trace_format is not None:
            return self._channels(trace_format, element if element.tag == "inkSource" else element.find("inkSource"))
        for key in ("traceFormatRef", "inkSourceRef", "contextRef"):
            target = self._named.get((element.get(key) or "").partition("#")[2])
            if target is not None:
                return self.find_channels(target, current, depth + 1)
        source = element.find("inkSource")
        return current if source is None else self.find_channels(source, current, depth + 1)

    def _channels(self, form: Element, source: Element | None) -> tuple[_InkmlChannel, ...]:
        properties = [] if source is None else list(source.iter("channelProperty"))
        resolutions = {p.get("channel"): p for p in properties if p.get("name") == "resolution"}
        regular = [channel for part in (form, *form.findall("regularChannels")) for channel in part.findall("channel")]
        return tuple(
            _InkmlChannel(name, self._factor(name, c, resolutions.get(name)))
            for c in regular
            if (name := c.get("name", ""))
        ) or tuple(_InkmlChannel(c.name, self.unit) for c in _PLAIN)

    def _factor(self, name: str, channel: Element, resolution: Element | None) -> float:
        units = channel.get("units", "")
        if name in ("X", "Y", "W"):
            if resolution is not None:
                per = _LENGTHS.get(resolution.get("units", "").removeprefix("1/"))
                value = _number(resolution.get("value"))
                if per and value:
                    return per / value
            return _LENGTHS.get(units, self.unit)
        if name == "T":
            return _TIMES.get(units, 1e-3)
        if name == "F":
            return 1 / (_number(channel.get("max")) or 1.0)
        if name in ("OA", "OE", "OR", "OTx", "OTy"):
            return 1.0 if units == "rad" else np.pi / 180
        return 1.0


def _number(text: str | None) -> float | None:
    try:
        number = float(text or "")
    except ValueError:
        return None
    return number if np.isfinite(number) else None


def _traces(root: Element, formats: _Formats) -> Iterator[_Trace]:
    """All traces of a pen that is down, in the order of the file."""
    count = 0

    def walk(parent: Element, current: tuple[_InkmlChannel, ...], notes: _Notes) -> Iterator[_Trace]:
        nonlocal count
        for element in parent:
            if element.tag in ("context", "inkSource", "traceFormat"):
                current = formats.find_channels(element, current)
            elif element.tag == "traceGroup":
                yield from walk(
                    element, formats.find_channels(element, current), _notes(element, notes, formats.nib(element))
                )
            elif element.tag == "trace":
                count += 1
                values = _values((element.text or "").strip(), formats.find_channels(element, current), count)
                if element.get("type") != "penUp" and values:
                    start = _number(element.get("timeOffset"))
                    yield _Trace(values, None if start is None else start / 1000, notes)

    yield from walk(
        root, formats.find_channels(root, tuple(_InkmlChannel(c.name, formats.unit) for c in _PLAIN)), _Notes()
    )


def _notes(group: Element, outer: _Notes, nib: float | None) -> _Notes:
    notes = {n.get("type", ""): n.text or "" for n in group.findall("annotation")}
    word, colour = notes.get("word", "").strip(), notes.get("colour", "").strip().lower()
    return _Notes(
        int(word) if word.isdecimal() and len(word) < _DIGITS else outer.word,
        notes.get("layer", outer.layer),
        colour if _COLOUR.fullmatch(colour) else outer.colour,
        outer.nib if nib is None else nib,
    )


def _values(text: str, channels: tuple[_InkmlChannel, ...], number: int) -> dict[str, Array]:
    """Channel → values of a trace in mm, s, rad or 0–1; empty for an empty trace."""
    rows = [row for row in text.split(",") if row.strip()]
    names = [channel.name for channel in channels]
    if not rows:
        return {}
    if "X" not in names or "Y" not in names:
        raise InputError(f"Trace {number} has the channels {', '.join(names)}; X and Y are needed.")
    try:
        table = np.array([[float(v) for v in row.split()] for row in rows], dtype=np.float64)
        plain = table.ndim == 2 and table.shape[1] == len(channels)
    except ValueError:  # qualified values, values without spaces between them, or rows of several lengths
        plain = False
    if not plain:
        table = _decode(rows, len(channels), number)
    if not np.isfinite(table).all():
        raise InputError(f"Trace {number} has a value that is not a finite number.")
    return {c.name: table[:, i] * c.factor for i, c in enumerate(channels)}


def _decode(rows: list[str], width: int, number: int) -> Array:
    """(n, width): values with the standard's qualifiers resolved.

    A qualifier holds for its channel until the next: ``!`` marks values, ``'`` differences of values, ``"``
    differences of differences.  ``*`` repeats the last.
    """
    state = [_Decoder() for _ in range(width)]
    table = np.empty((len(rows), width))
    for at, row in enumerate(rows):
        tokens = _TOKEN.findall(row)
        if len(tokens) < width or _TOKEN.sub("", row).strip():
            raise InputError(f"Trace {number}, sample {at + 1}: {row.strip()!r} is not {width} numbers.")
        for i, (qualifier, text) in enumerate(tokens[:width]):
            if text == "?":
                raise InputError(f"Trace {number}, sample {at + 1}: the value of channel {i + 1} is unknown.")
            table[at, i] = state[i].decode_next(qualifier, text)
    return table


class _Decoder:
    """Decodes the values of one channel, in order."""

    mode, value, step = "!", 0.0, 0.0

    def decode_next(self, qualifier: str, text: str) -> float:
        self.mode = qualifier or self.mode
        if self.mode == "!":
            if text != "*":
                value = _decimal(text)
                self.value, self.step = value, value - self.value
            return self.value
        if text != "*":
            self.step = _decimal(text) + (self.step if self.mode == '"' else 0.0)
        self.value += self.step
        return self.value


def _decimal(text: str) -> float:
    if text in "TF":
        return float(text == "T")
    try:
        return float(int(text.replace("#", ""), 16)) if "#" in text else float(text)
    except OverflowError:
        return np.inf


def _xy(trace: _Trace) -> Array:
    return np.column_stack([trace.channels["X"], trace.channels["Y"]])


def _pen_channels(trace: _Trace) -> dict[str, Any]:
    """What a trace knows of the pen besides its place, by the names of `Stroke`."""
    c = trace.channels
    # tilt from the vertical and azimuth, rad, from elevation and azimuth or from tilts along the axes
    tilt, azimuth = np.pi / 2 - c["OE"] if "OE" in c else None, c.get("OA")
    if "OTx" in c and "OTy" in c:
        tilt, azimuth = recorded.lean(c["OTx"], c["OTy"])
    channels = {"pressure": c.get("F"), "tilt": tilt, "azimuth": azimuth, "rotation": c.get("OR"), "width": c.get("W")}
    return {name: values for name, values in channels.items() if values is not None}


def _stroke(trace: _Trace, number: int) -> Stroke:
    try:
        if "T" not in trace.channels:
            raise ValueError("it has no times")
        recorded.refuse_far(
            f"Trace {number}", _xy(trace), trace.channels["T"], nib=trace.notes.nib, **_pen_channels(trace)
        )
        return Stroke(trace.channels["T"], _xy(trace), **_pen_channels(trace), **trace.notes._asdict())
    except ValueError as error:
        raise InputError(f"Trace {number} cannot be used: {error}.") from error
