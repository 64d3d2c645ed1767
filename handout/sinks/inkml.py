"""A drawing as InkML (W3C, 2011), for programs that take digital ink.

Channels: X, Y (mm, y down), T (s, on the clock of the page), and where a stroke has them F (pressure, 0–1), OE and OA
(elevation and azimuth of the pen, rad; elevation is what tilt lacks to a right angle), OR (rotation of the barrel,
rad) and W (width of the line, mm).  The page, and seed, hand and all else that is known about the drawing, are
annotations in JSON; strokes of a word form a group with the word's index, and with their layer and colour if they have
any; a flat nib is a brush with a rectangular tip as wide as its edge, which lies along OR.  Reading back gives the same
drawing to 1e-6 of each unit.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import groupby

import numpy as np

from handout.sinks import about
from handout.values import Array, Drawing, Stroke

# name in the file, its attributes, and how a stroke's samples become its values
_CHANNELS: tuple[tuple[str, str, Callable[[Stroke], Array | None]], ...] = (
    ("X", 'units="mm"', lambda s: s.xy[:, 0]),
    ("Y", 'units="mm"', lambda s: s.xy[:, 1]),
    ("T", 'units="s"', lambda s: s.t),
    ("F", 'min="0" max="1" units="dev"', lambda s: s.pressure),
    ("OE", 'units="rad"', lambda s: None if s.tilt is None else np.pi / 2 - s.tilt),
    ("OA", 'units="rad"', lambda s: s.azimuth),
    ("OR", 'units="rad"', lambda s: s.rotation),
    ("W", 'units="mm"', lambda s: s.width),
)
_ZEROS = re.compile(r"\.?0+(?=[ ,]|$)")


def to_inkml(drawing: Drawing) -> bytes:
    """A page as an InkML file, in the form described at the top of this file."""
    page = {"width": drawing.page.width, "height": drawing.page.height, "name": drawing.page.name}
    kinds = list(dict.fromkeys(_names(stroke) for stroke in drawing.strokes))
    nibs = list(dict.fromkeys(stroke.nib for stroke in drawing.strokes))
    definitions = list[str]()
    for number, names in enumerate(kinds):
        channels = "".join(f'<channel name="{n}" type="decimal" {kind}/>' for n, kind, _ in _CHANNELS if n in names)
        definitions.append(f'<context xml:id="pen{number}"><traceFormat>{channels}</traceFormat></context>')
    for number, nib in enumerate(nibs):
        if nib:
            width = f'name="width" value="{np.format_float_positional(nib, trim="-")}" units="mm"'
            properties = f'<brushProperty {width}/><brushProperty name="tip" value="rectangle"/>'
            definitions.append(f'<brush xml:id="nib{number}">{properties}</brush>')
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<ink xmlns="http://www.w3.org/2003/InkML">',
        '<annotation type="program">handout</annotation>',
        f'<annotation type="page">{about.escape_xml(about.json_text(page))}</annotation>',
        f'<annotation type="about">{about.escape_xml(about.json_text(drawing.about))}</annotation>',
        "<definitions>",
        *definitions,
        "</definitions>",
    ]
    for (notes, names, nib), group in groupby(drawing.strokes, lambda s: (_notes(s), _names(s), s.nib)):
        brush = f' brushRef="#nib{nibs.index(nib)}"' if nib else ""
        parts.append(f'<traceGroup contextRef="#pen{kinds.index(names)}"{brush}>{notes}')
        parts += [f"<trace>{_trace(stroke)}</trace>" for stroke in group]
        parts.append("</traceGroup>")
    return "\n".join([*parts, "</ink>\n"]).encode("utf-8")


def _notes(stroke: Stroke) -> str:
    word = "" if stroke.word < 0 else str(stroke.word)
    notes = {"word": word, "layer": about.escape_xml(about.xml_safe(stroke.layer)), "colour": stroke.colour}
    return "".join(f'<annotation type="{name}">{text}</annotation>' for name, text in notes.items() if text)


def _names(stroke: Stroke) -> tuple[str, ...]:
    return tuple(name for name, _, values in _CHANNELS if values(stroke) is not None)


def _trace(stroke: Stroke) -> str:
    columns = [values for _, _, read in _CHANNELS if (values := read(stroke)) is not None]
    if not (np.diff(np.round(stroke.t, 6)) > 0).all():
        # times closer than the last decimal: all their digits, so that they still increase
        rows = [[np.format_float_positional(v, trim="-") for v in row] for row in np.column_stack(columns)]
        return ", ".join(map(" ".join, rows))
    form = " ".join(["%.6f"] * len(columns))
    return _ZEROS.sub("", ", ".join([form % tuple(row) for row in np.column_stack(columns).tolist()]))
