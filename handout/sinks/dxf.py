"""A drawing as DXF (AutoCAD 2000), for laser and vinyl cutters and CAM: polylines in mm, on layers, y up.

Strokes are their centre lines, within 0.01 mm; scanned ink is its outlines.  A DXF knows neither times nor pressure,
and of colours only the 255 of its palette; lines have no width, for a cutter has its own.

Source: Autodesk, "DXF Reference", AutoCAD 2000 (AC1015): header variables, tables, LWPOLYLINE, the objects that a file
must have.
"""

from __future__ import annotations

import colorsys
import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import count
from pathlib import Path

import numpy as np

from handout import pathdata
from handout.inking import curves, pen
from handout.sinks import layers
from handout.values import Array, Drawing

_FLAT = 0.01 - curves.TOLERANCE  # mm between a curve and its chords: with what fitting took, 0.01
_DOT = 0.05  # mm: what has no length is left out by programs that read DXF; set by eye
_BLACK = 7  # drawn black on white and white on black
_NOT_IN_NAMES = re.compile(r'[<>/\\":;?*|=`,\x00-\x1f\x7f]')
_LONGEST = 200  # characters of a name, of 255
_FIRST_HANDLE = 0x100  # of what is drawn; the frame of a file has those below

# What a file has around its layers and lines: pairs of code and value with | between them.  $INSUNITS 4 is mm.
_FRAME = Path(__file__).with_name("dxf_frame.txt").read_text(encoding="ascii").rstrip("\n")
_LAYER = "0 LAYER|5 {:X}|330 2|100 AcDbSymbolTableRecord|100 AcDbLayerTableRecord|2 {}|70 0|62 {}|6 Continuous"
_LINE = "0 LWPOLYLINE|5 {:X}|330 1F|100 AcDbEntity|8 {}{}|100 AcDbPolyline|90 {}|70 {}|43 0.0|{}"


def to_dxf(drawing: Drawing, *, colour: str = "#1a1a2e", by: layers.By = "ink") -> bytes:
    """The strokes of a page as a DXF file; see the top of this file.

    colour : ``"#rrggbb"``, of strokes without a colour of their own.
    by : what a layer is, see `layers.layers`.
    """
    fitted = curves.fit(drawing.strokes)
    lines = []
    for name, numbers in layers.layers(drawing, by).items():
        for number in numbers:
            points = fitted[number].points
            if np.ptp(points, axis=0).any():
                line = pathdata.flatten_path(points, _FLAT)[0]
            else:
                line = points[:1] + np.array([[0.0, 0.0], [_DOT, 0.0]])
            lines.append((name, drawing.strokes[number].colour or colour, line, False))
    return _file(lines, drawing)


def outlines_dxf(drawing: Drawing, areas: Sequence[tuple[str, Sequence[Array]]]) -> bytes:
    """Closed outlines (n, 2), mm, of several inks, each ``"#rrggbb"`` with a layer of its own, as a DXF file."""
    # a closed polyline goes back to its first point by itself
    lines = [(f"ink {ink}", ink, outline[:-1], True) for ink, outlines in areas for outline in outlines]
    return _file(lines, drawing)


def _file(lines: Sequence[tuple[str, str, Array, bool]], drawing: Drawing) -> bytes:
    """A file of polylines: name of the layer, colour, points (n, 2) in mm with y down, whether closed."""
    names, height, handle = _names(line[0] for line in lines), float(drawing.page.height), count(_FIRST_HANDLE)
    shades = {name: _index(colour) for name, colour, *_ in reversed(lines)}  # of a layer, that of its first line
    layer_table = [_LAYER.format(next(handle), names[name], shades[name]) for name in names]
    entities, places = list[str](), [np.zeros((1, 2))] if not lines else []
    for name, colour, points, closed in lines:
        places.append(points * [1, -1] + [0, height])
        own = "" if _index(colour) == shades[name] else f"|62 {_index(colour)}"
        corners = "|".join(f"10 {x:.4f}|20 {y:.4f}" for x, y in places[-1].tolist())
        entities.append(_LINE.format(next(handle), names[name], own, len(points), int(closed), corners))
    (left, bottom), (right, top) = (
        np.min([p.min(axis=0) for p in places], 0),
        np.max([p.max(axis=0) for p in places], 0),
    )
    text = _FRAME.format(
        seed=next(handle), left=left, bottom=bottom, right=right, top=top, width=float(drawing.page.width),
        height=height, layers=1 + len(names), layer_table="\n".join(layer_table), entities="\n".join(entities),
    )  # fmt: skip
    pairs = (pair.partition(" ") for line in text.splitlines() if line for pair in line.split("|"))
    return "".join(f"{code:>3}\r\n{value}\r\n" for code, _, value in pairs).encode("ascii")


def _names(names: Iterable[str]) -> dict[str, str]:
    """Names of layers as DXF has them: some characters may not be in them, and A and a are the same name.

    What is not ASCII is written by its number in Unicode, which programs that read DXF show as the character.
    """
    allowed: dict[str, str] = {}
    taken = {"0"}
    for name in dict.fromkeys(names):
        plain = " ".join(_NOT_IN_NAMES.sub(" ", name).split())[:_LONGEST] or "layer"
        unique = next(each for n in count(1) if (each := plain if n == 1 else f"{plain} ({n})").lower() not in taken)
        taken.add(unique.lower())
        allowed[name] = "".join(c if c.isascii() else f"\\U+{ord(c):04X}" if ord(c) < 0x10000 else "_" for c in unique)
    return allowed


@lru_cache(maxsize=256)
def _index(colour: str) -> int:
    """The nearest colour of DXF's palette that can be told from black: 24 hues of three depths, whole and pale."""
    palette = {_BLACK: (0.0, 0.0, 0.0), 8: (0.5, 0.5, 0.5), 9: (0.75, 0.75, 0.75)}
    for hue in range(24):
        for depth, value in enumerate((1.0, 0.65, 0.5)):
            for pale in (0, 1):
                palette[10 + 10 * hue + 2 * depth + pale] = colorsys.hsv_to_rgb(hue / 24, 1 - 0.5 * pale, value)
    wanted = np.array(pen.rgb(colour))
    return min(palette, key=lambda index: (float(np.square(wanted - palette[index]).sum()), index))
