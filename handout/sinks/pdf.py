"""Drawings as PDF: one page each, in their true size, as vector strokes; no fonts, no dates, same bytes every time.

The file is written here and not by a library, since it needs five kinds of objects and nothing else: a library would
bring fonts and dates that then have to be kept out.
"""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Sequence

import numpy as np

from handout import __version__
from handout.errors import InputError
from handout.inking import curves, outline, pen
from handout.inking.curves import Curve
from handout.sinks import about, paths
from handout.values import Array, Drawing

_POINT = 72 / 25.4  # points a mm


def to_pdf(
    drawings: Sequence[Drawing], *, pen_width: float = 0.5, colour: str = "#1a1a2e", show_travel: bool = False
) -> bytes:
    """Pages as one PDF file.

    drawings : at least one; each is a page of its own size.
    pen_width : mm, of strokes without a width of their own; one whose width varies, or of a flat nib, is filled as it
        is.
    colour : ``"#rrggbb"``, device RGB, of strokes without a colour of their own.
    show_travel : draw the moves between strokes, thin and red.

    Raises InputError: no drawing, no such colour, or a pen width outside 0.02–50 mm.
    """
    if not drawings:
        raise InputError("There is no page to write.")
    pen.check_width(pen_width)
    pen.rgb(colour)
    count = len(drawings)
    kids = " ".join(f"{4 + 2 * i} 0 R" for i in range(count))
    first = drawings[0]
    named = {
        "Title": about.title(first),
        "Subject": about.describe(first),
        "Keywords": about.json_text({"seed": first.about.get("seed"), "hand": first.about.get("hand")}),
        "Creator": f"handout {__version__}",
    }
    information = {key: text.encode("utf-16-be", "replace").hex().upper() for key, text in named.items()}
    objects = [
        b"<</Type/Catalog/Pages 2 0 R>>",
        f"<</Type/Pages/Count {count}/Kids[{kids}]>>".encode(),
        b"<<" + b"".join(f"/{key}<FEFF{value}>".encode() for key, value in information.items()) + b">>",
    ]
    for i, drawing in enumerate(drawings):
        size = f"{drawing.page.width * _POINT:.4f} {drawing.page.height * _POINT:.4f}"
        objects.append(
            f"<</Type/Page/Parent 2 0 R/MediaBox[0 0 {size}]/Resources<<>>/Contents {5 + 2 * i} 0 R>>".encode()
        )
        moves = paths.travel_moves(drawing) if show_travel else []
        operators = "\n".join([content(drawing, pen_width, colour), *travel(moves)])
        packed = zlib.compress(operators.encode("ascii"), 9)
        objects.append(f"<</Length {len(packed)}/Filter/FlateDecode>>stream\n".encode() + packed + b"\nendstream")
    return _file(objects)


def matrix(drawing: Drawing) -> str:
    """From mm of a page, y down, to points, y up."""
    return f"{_POINT:.8f} 0 0 {-_POINT:.8f} 0 {drawing.page.height * _POINT:.4f} cm"


def content(drawing: Drawing, pen_width: float, colour: str) -> str:
    """The operators that mark the strokes of a page."""
    ink = rgb(colour)
    lines = [f"{matrix(drawing)} 1 J 1 j {ink} RG"]
    before = ""
    filled = not all(stroke.is_even for stroke in drawing.strokes)
    if filled:
        lines.append(f"{ink} rg")
    for stroke, curve in zip(drawing.strokes, curves.fit(drawing.strokes), strict=True):
        if (stroke_ink := rgb(stroke.colour or colour)) != ink:
            ink = stroke_ink
            lines += [f"{ink} RG", *([f"{ink} rg"] if filled else [])]
        if not stroke.is_even:
            lines += [f"{polygon(piece)} f" for piece in outline.pieces(stroke, curve)]
            continue
        width = paths.short(round(paths.stroke_width(stroke, pen_width) * 1000))
        if width != before:
            lines.append(f"{width} w")
            before = width
        lines.append(_path(curve))
    return "\n".join(lines)


def travel(moves: Sequence[Array]) -> list[str]:
    """The operators that draw moves (n, 2), mm, of the lifted pen."""
    if not moves:
        return []
    lines = [f"{polygon(move)} S" for move in moves]
    return [f"{rgb(paths.TRAVEL_COLOUR)} RG {paths.short(round(paths.TRAVEL_WIDTH * 1000))} w", *lines]


def rgb(colour: str) -> str:
    """The operands of a colour, ``"#rrggbb"``."""
    return " ".join(f"{part:.4g}" for part in pen.rgb(colour))


def _path(curve: Curve) -> str:
    points = paths.microns(curve)
    x, y = points[0].tolist()
    begin = f"{paths.short(x)} {paths.short(y)} m"
    if (points == points[0]).all():
        return f"{begin} {paths.short(x + 1)} {paths.short(y)} l S"  # round caps make it a dot
    legs = points[1:].reshape(-1, 6).tolist()
    return " ".join([begin, *(" ".join(map(paths.short, leg)) + " c" for leg in legs), "S"])


def polygon(piece: Array) -> str:
    """The path of a polygon (n, 2), mm."""
    points = np.rint(piece * 1000).astype(np.int64).tolist()
    return " ".join(f"{paths.short(x)} {paths.short(y)} {'l' if k else 'm'}" for k, (x, y) in enumerate(points))


def _file(objects: Sequence[bytes]) -> bytes:
    """Number the objects from 1 (the first is the catalogue, the third the information) and index them."""
    data = bytearray(b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n")
    places = []
    for number, body in enumerate(objects, 1):
        places.append(len(data))
        data += f"{number} 0 obj\n".encode() + body + b"\nendobj\n"
    begin = len(data)
    # names the content and nothing else, so that equal pages have equal names
    name = hashlib.md5(data, usedforsecurity=False).hexdigest().upper()
    data += f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n".encode()
    data += b"".join(f"{place:010d} 00000 n \n".encode() for place in places)
    trailer = f"<</Size {len(objects) + 1}/Root 1 0 R/Info 3 0 R/ID[<{name}><{name}>]>>"
    return bytes(data) + f"trailer\n{trailer}\nstartxref\n{begin}\n%%EOF\n".encode()
