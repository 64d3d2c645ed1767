"""A drawing as SVG: strokes as smooth paths in mm, pen-up travel to be switched on, the writing to be replayed.

Nothing plays unless asked (a click, the key P, or the address ending in ``#play``), so that the file is the finished
page in print, in an image viewer, and wherever scripts do not run.  Strokes still to be written are hidden by a class
that counts on screens only; the stroke being written is drawn as a path of its own, cut from its Béziers at the
present moment, which is exact since these keep time.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from handout.inking import curves, pen
from handout.inking.curves import Curve
from handout.sinks import about, layers, paths
from handout.values import Drawing, Stroke

_INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
_STYLE = """
.travel{display:none}
.show-travel .travel,#travel:target{display:inline}
@media screen{.playing .later{visibility:hidden}}
@media print{.nib,.travel,#travel:target{display:none!important}}
"""

_SCRIPT = Path(__file__).with_name("replay.js").read_text(encoding="utf-8")


def to_svg(
    drawing: Drawing,
    *,
    pen_width: float = 0.5,
    colour: str = "#1a1a2e",
    show_travel: bool = False,
    by: layers.By = "ink",
) -> bytes:
    """A page as an SVG file; units are mm.

    Every stroke is a ``<path class="stroke">`` of cubic Béziers that stays within 0.01 mm of the samples, with
    ``data-t0`` and ``data-t1`` (s), ``data-k`` (ms that each Bézier takes), ``data-word`` and ``data-layer``; one with
    a colour of its own has it as ``stroke``.  Groups of the class ``ink`` are layers to Inkscape, and the groups in
    them lines and words, labelled with what is written.  The layer ``#travel`` has the moves between strokes; it is
    hidden, and shown by the class ``show-travel`` on the root, by ``file.svg#travel`` or by the key T.  A click, the
    key P or ``file.svg#play`` replays the writing at its own speed.

    pen_width : mm, of strokes without a width of their own.  A stroke whose width varies, or of a flat nib, is drawn in
        its greatest width and clipped to its mark; ``data-w`` (µm) has its width at the knots, ``data-nib`` its edge.
    colour : ``"#rrggbb"``, of strokes without a colour of their own.
    show_travel : show the moves between strokes from the beginning, in programs that do not know the style sheet too.
    by : "ink", "line" or "word": what a layer is, see `layers.layers`.

    Raises InputError: no such colour, or a pen width outside 0.02–50 mm.
    """
    pen.rgb(colour)
    pen.check_width(pen_width)
    shown = ' class="show-travel"' if show_travel else ""
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="{_INKSCAPE}" {_size(drawing)}{shown}>',
        f"<title>{about.escape_xml(about.title(drawing))}</title>",
        f"<desc>{about.escape_xml(about.describe(drawing))} Click, or press P, to see it being written.</desc>",
        f'<metadata id="about">{about.escape_xml(about.json_text(about.record(drawing)))}</metadata>',
        f"<style>{_STYLE}</style>",
        *_layers(drawing, pen_width, colour, by),
        *_travel(drawing, show_travel),
        f"<script>//<![CDATA[\n{_SCRIPT}//]]></script>",
        "</svg>\n",
    ]
    return "\n".join(parts).encode("utf-8")


def to_inline_svg(drawing: Drawing, *, pen_width: float = 0.5, colour: str = "#1a1a2e") -> str:
    """A page as an element that may stand among others on one web page: no script, no style, no name twice."""
    parts = [part for stroke in drawing.strokes for part in (stroke.xy, stroke.width, stroke.rotation)]
    checksum = zlib.crc32(b"".join(part.tobytes() for part in parts if part is not None))
    key = f"d{checksum:08x}-"  # drawings with equal marks may share their names
    first = f'<svg xmlns="http://www.w3.org/2000/svg" {_size(drawing)} style="background:#fff;max-width:100%">'
    title = f"<title>{about.escape_xml(about.title(drawing))}</title>"
    ink = f'<g id="{key}ink" {_look(drawing.strokes, pen_width, colour)}>'
    return "\n".join([first, title, ink, *_strokes(drawing, pen_width, key), "</g>", "</svg>"])


def _size(drawing: Drawing) -> str:
    width, height = _mm(drawing.page.width), _mm(drawing.page.height)
    return f'width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}"'


def _layers(drawing: Drawing, pen_width: float, colour: str, by: layers.By) -> list[str]:
    """The strokes in layers, and in these in lines and words where the drawing tells of any."""
    strokes = _strokes(drawing, pen_width)
    parts = []
    for number, (name, members) in enumerate((layers.layers(drawing, by) or {"Page 1": []}).items()):
        key = f"ink-{number + 1}" if number else "ink"
        look = _look([drawing.strokes[member] for member in members], pen_width, colour)
        parts += [f'<g id="{key}" class="ink" {_layer(name)} {look}>', *_groups(drawing, by, members, strokes), "</g>"]
    return parts


def _groups(drawing: Drawing, by: layers.By, members: Sequence[int], strokes: Sequence[str]) -> Iterator[str]:
    kind, groups = layers.group_inside(drawing, by, members)
    for name, inner in groups.items():
        parts = [strokes[number] for number in inner] if kind is None else _groups(drawing, kind, inner, strokes)
        yield from [f"<g {_label(name)}>", *parts, "</g>"] if name else parts


def _layer(name: str) -> str:
    return f'inkscape:groupmode="layer" {_label(name)}'


def _label(name: str) -> str:
    return f"inkscape:label={about.quote_attribute(about.xml_safe(name))}"


def _look(strokes: Sequence[Stroke], pen_width: float, colour: str) -> str:
    """How strokes of a group are drawn unless they say otherwise."""
    colours = {stroke.colour for stroke in strokes}
    colour = colours.pop() or colour if len(colours) == 1 else colour
    even = f'fill="none" stroke="{colour}" stroke-width="{_mm(pen_width)}"'
    return f'{even} stroke-linecap="round" stroke-linejoin="round"'


def _strokes(drawing: Drawing, pen_width: float, key: str = "") -> list[str]:
    return [
        _stroke(stroke, curve, pen_width, f"{key}mark-{number}")
        for number, (stroke, curve) in enumerate(zip(drawing.strokes, curves.fit(drawing.strokes), strict=True))
    ]


def _stroke(stroke: Stroke, curve: Curve, pen_width: float, name: str) -> str:
    mark, line = "", paths.stroke_width(stroke, pen_width)
    if not stroke.is_even:
        from handout.inking import outline

        mark, line = name, outline.reach(stroke)
    width = _mm(line)
    attributes = "" if width == _mm(pen_width) else f' stroke-width="{width}"'
    word = "" if stroke.word < 0 else f' data-word="{stroke.word}"'
    layer = f" data-layer={about.quote_attribute(about.xml_safe(stroke.layer))}" if stroke.layer else ""
    attributes += f' stroke="{stroke.colour}"' if stroke.colour else ""
    clock = np.rint((curve.t - curve.t[0]) * 1000).astype(np.int64)
    spans = f' data-k="{" ".join(map(str, np.diff(clock).tolist()))}"' if len(clock) > 1 else ""
    times = f'data-t0="{_mm(float(stroke.t[0]))}" data-t1="{_mm(float(stroke.t[-1]))}"'
    clip = f' clip-path="url(#{mark})"{_mark_notes(stroke, curve)}' if mark else ""
    # a beginning, and Béziers relative to where the last one ended
    points = paths.microns(curve)
    data = "M" + paths.join_numbers(points[0].tolist())
    if (points == points[0]).all():
        data += "h.001"  # round caps make it a dot; some programs draw nothing for no length at all
    else:
        legs = np.stack([points[1::3], points[2::3], points[3::3]], axis=1) - points[:-1:3, None]
        data += "".join("c" + paths.join_numbers(leg) for leg in legs.reshape(len(legs), 6).tolist())
    path = f'<path class="stroke" {times}{word}{layer}{attributes}{spans}{clip} d="{data}"/>'
    return f"{_mark(stroke, curve, mark)}\n{path}" if mark else path


def _mark_notes(stroke: Stroke, curve: Curve) -> str:
    """What the outline of a mark is made from, so that it can be read back."""
    notes = ""
    if stroke.width is not None:
        widths = np.rint(np.interp(curve.t, stroke.t, stroke.width) * 1000).astype(np.int64)
        notes += f' data-w="{" ".join(map(str, widths.tolist()))}"'
    if stroke.nib > 0 and stroke.rotation is not None:
        angles = np.rint(np.interp(curve.t, stroke.t, stroke.rotation) * 1000).astype(np.int64)
        turned = " ".join(map(str, angles[:1].tolist() if np.ptp(angles) == 0 else angles.tolist()))
        notes += f' data-nib="{_mm(stroke.nib)}" data-rotation="{turned}"'
    return notes


def _mark(stroke: Stroke, curve: Curve, name: str) -> str:
    """The outline that a stroke is clipped to; its pieces all turn the same way, so that one path is their union."""
    from handout.inking import outline

    pieces = ""
    for piece in outline.pieces(stroke, curve):
        points = np.rint(piece * 1000).astype(np.int64)
        legs = paths.join_numbers(np.diff(points, axis=0).ravel().tolist())
        pieces += f"M{paths.join_numbers(points[0].tolist())}l{legs}z"
    return f'<clipPath id="{name}"><path d="{pieces}"/></clipPath>'


def _travel(drawing: Drawing, shown: bool) -> list[str]:
    # the attribute hides it in programs that do not read the style sheet; for others the sheet decides
    hidden = "" if shown else ' display="none"'
    look = f'stroke="{paths.TRAVEL_COLOUR}" stroke-width="{_mm(paths.TRAVEL_WIDTH)}"'
    # AxiDraw's programs never plot a layer whose name begins so
    group = f'<g id="travel" class="travel"{hidden} {_layer("% travel of the lifted pen")} fill="none" {look}>'
    ways = paths.travel_moves(drawing)
    times = [
        f' data-t0="{_mm(float(a.t[-1]))}" data-t1="{_mm(float(b.t[0]))}"'
        for a, b in pairwise(paths.plotted_strokes(drawing))
    ]
    times += [""] * (len(ways) - len(times))
    parts = [group]
    for way, when in zip(ways, times, strict=True):
        first, *rest = np.rint(way * 1000).astype(np.int64).tolist()
        line = paths.join_numbers([side for place in rest for side in place])
        parts.append(f'<path{when} d="M{paths.join_numbers(first)}L{line}"/>')
    # a ring where the pen begins to write after it was dipped, and where it was
    dips = [way for way in paths.hook_ways(drawing) if way["name"] == "dip"]
    for number, dip in enumerate(dips, 1):
        for x, y in (dip["way"][-1], *dip["down"]):
            parts.append(f'<circle class="dip" cx="{_mm(x)}" cy="{_mm(y)}" r="1"><title>dip {number}</title></circle>')
    return [*parts, "</g>"]


def _mm(value: float) -> str:
    return paths.short(round(value * 1000))
