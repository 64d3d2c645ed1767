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

# What a file has around its layers and lines: a pair of code and value in each line.  $INSUNITS 4 is mm.
_FRAME = """\
0 SECTION|2 HEADER|9 $ACADVER|1 AC1015|9 $DWGCODEPAGE|3 ANSI_1252|9 $INSUNITS|70 4|9 $MEASUREMENT|70 1
9 $HANDSEED|5 {seed:X}|9 $EXTMIN|10 {left:.4f}|20 {bottom:.4f}|30 0.0|9 $EXTMAX|10 {right:.4f}|20 {top:.4f}|30 0.0
9 $LIMMIN|10 0.0|20 0.0|9 $LIMMAX|10 {width:.4f}|20 {height:.4f}|0 ENDSEC
0 SECTION|2 CLASSES|0 ENDSEC|0 SECTION|2 TABLES
0 TABLE|2 VPORT|5 8|330 0|100 AcDbSymbolTable|70 0|0 ENDTAB
0 TABLE|2 LTYPE|5 5|330 0|100 AcDbSymbolTable|70 3
0 LTYPE|5 14|330 5|100 AcDbSymbolTableRecord|100 AcDbLinetypeTableRecord|2 ByBlock|70 0|3 |72 65|73 0|40 0.0
0 LTYPE|5 15|330 5|100 AcDbSymbolTableRecord|100 AcDbLinetypeTableRecord|2 ByLayer|70 0|3 |72 65|73 0|40 0.0
0 LTYPE|5 16|330 5|100 AcDbSymbolTableRecord|100 AcDbLinetypeTableRecord|2 Continuous|70 0|3 |72 65|73 0|40 0.0|0 ENDTAB
0 TABLE|2 LAYER|5 2|330 0|100 AcDbSymbolTable|70 {layers}
0 LAYER|5 10|330 2|100 AcDbSymbolTableRecord|100 AcDbLayerTableRecord|2 0|70 0|62 7|6 Continuous
{layer_table}
0 ENDTAB|0 TABLE|2 STYLE|5 3|330 0|100 AcDbSymbolTable|70 1
0 STYLE|5 11|330 3|100 AcDbSymbolTableRecord|100 AcDbTextStyleTableRecord|2 Standard
70 0|40 0.0|41 1.0|50 0.0|71 0|42 2.5|3 txt|4 |0 ENDTAB
0 TABLE|2 VIEW|5 6|330 0|100 AcDbSymbolTable|70 0|0 ENDTAB|0 TABLE|2 UCS|5 7|330 0|100 AcDbSymbolTable|70 0|0 ENDTAB
0 TABLE|2 APPID|5 9|330 0|100 AcDbSymbolTable|70 1
0 APPID|5 12|330 9|100 AcDbSymbolTableRecord|100 AcDbRegAppTableRecord|2 ACAD|70 0|0 ENDTAB
0 TABLE|2 DIMSTYLE|5 A|330 0|100 AcDbSymbolTable|70 0|100 AcDbDimStyleTable|0 ENDTAB
0 TABLE|2 BLOCK_RECORD|5 1|330 0|100 AcDbSymbolTable|70 2
0 BLOCK_RECORD|5 1F|330 1|100 AcDbSymbolTableRecord|100 AcDbBlockTableRecord|2 *Model_Space|340 22
0 BLOCK_RECORD|5 1B|330 1|100 AcDbSymbolTableRecord|100 AcDbBlockTableRecord|2 *Paper_Space|340 1E|0 ENDTAB|0 ENDSEC
0 SECTION|2 BLOCKS
0 BLOCK|5 20|330 1F|100 AcDbEntity|8 0|100 AcDbBlockBegin|2 *Model_Space|70 0|10 0.0|20 0.0|30 0.0|3 *Model_Space|1
0 ENDBLK|5 21|330 1F|100 AcDbEntity|8 0|100 AcDbBlockEnd
0 BLOCK|5 1C|330 1B|100 AcDbEntity|8 0|100 AcDbBlockBegin|2 *Paper_Space|70 0|10 0.0|20 0.0|30 0.0|3 *Paper_Space|1
0 ENDBLK|5 1D|330 1B|100 AcDbEntity|8 0|100 AcDbBlockEnd|0 ENDSEC
0 SECTION|2 ENTITIES
{entities}
0 ENDSEC|0 SECTION|2 OBJECTS
0 DICTIONARY|5 C|330 0|100 AcDbDictionary|281 1|3 ACAD_GROUP|350 E|3 ACAD_LAYOUT|350 D
0 DICTIONARY|5 E|330 C|100 AcDbDictionary|281 1
0 DICTIONARY|5 D|330 C|100 AcDbDictionary|281 1|3 Model|350 22|3 Layout1|350 1E
0 LAYOUT|5 22|330 D|100 AcDbPlotSettings|1 |2 |4 |6 |44 {width:.4f}|45 {height:.4f}|70 688|72 1|73 0|74 5
100 AcDbLayout|1 Model|70 1|71 0|10 0.0|20 0.0|11 {width:.4f}|21 {height:.4f}|330 1F
0 LAYOUT|5 1E|330 D|100 AcDbPlotSettings|1 |2 |4 |6 |44 {width:.4f}|45 {height:.4f}|70 688|72 1|73 0|74 5
100 AcDbLayout|1 Layout1|70 1|71 1|10 0.0|20 0.0|11 {width:.4f}|21 {height:.4f}|330 1B
0 ENDSEC|0 EOF"""
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
