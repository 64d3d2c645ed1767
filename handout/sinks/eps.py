"""A drawing as Encapsulated PostScript (EPSF-3.0): the marks of its strokes as `pdf` writes them, without a page.

Its bounding box is that of the ink; coordinates are those of the page, in points from its lower left corner.

Source: Adobe Systems, "Encapsulated PostScript File Format Specification 3.0" and "Document Structuring Conventions
Specification 3.0", 1992.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from handout import __version__
from handout.inking import curves, outline, pen
from handout.sinks import about, paths, pdf
from handout.values import Array, Drawing

# PDF's operators, which PostScript has under longer names
_PROLOGUE = """%%BeginProlog
40 dict begin
/cm {6 array astore concat} bind def /w /setlinewidth load def /J /setlinecap load def /j /setlinejoin load def
/RG /setrgbcolor load def /rg /setrgbcolor load def /m /moveto load def /l /lineto load def /c /curveto load def
/S /stroke load def /f /fill load def /h /closepath load def
%%EndProlog
"""
_LINE = re.compile(r"(.{1,240}) ")


def to_eps(drawing: Drawing, *, pen_width: float = 0.5, colour: str = "#1a1a2e", show_travel: bool = False) -> bytes:
    """The strokes of a page as an EPS file; parameters and errors are those of `pdf.to_pdf`."""
    pen.check_width(pen_width)
    pen.rgb(colour)
    moves = paths.travel_moves(drawing) if show_travel else []
    content = "\n".join([pdf.content(drawing, pen_width, colour), *pdf.travel(moves)])
    # corners of boxes that the marks fill together
    corners = []
    for stroke, curve in zip(drawing.strokes, curves.fit(drawing.strokes), strict=True):
        if not stroke.is_even:
            corners += outline.pieces(stroke, curve)
            continue
        half = paths.stroke_width(stroke, pen_width) / 2
        along = curve.places_at(np.linspace(curve.t[0], curve.t[-1], 8 * len(curve.t)))
        corners += [along.min(axis=0, keepdims=True) - half, along.max(axis=0, keepdims=True) + half]
    inked = [*corners, *moves]
    return _file(content, np.concatenate(inked) if inked else None, drawing)


def outlines_eps(drawing: Drawing, areas: Sequence[tuple[str, Sequence[Array]]]) -> bytes:
    """Closed outlines (n, 2), mm, of several inks, each ``"#rrggbb"``, filled; holes turn the other way."""
    places = [point for _, outlines in areas for point in outlines]
    shapes = [
        " ".join([f"{pdf.rgb(ink)} rg", *(pdf.polygon(outline) for outline in outlines), "f"])
        for ink, outlines in areas
    ]
    return _file("\n".join([pdf.matrix(drawing), *shapes]), np.concatenate(places) if places else None, drawing)


def _file(content: str, inked: Array | None, drawing: Drawing) -> bytes:
    """A file of `content`, in PDF's operators, whose marks reach as far as the points (n, 2), mm, do."""
    box = np.zeros(4)
    if inked is not None:
        (left, top), (right, bottom) = inked.min(axis=0), inked.max(axis=0)
        box = np.array([left, drawing.page.height - bottom, right, drawing.page.height - top]) * 72 / 25.4
    whole = [*np.floor(box[:2]).astype(int), *np.ceil(box[2:]).astype(int)]
    # what Latin 1 lacks is a question mark
    said = about.title(drawing).encode("latin-1", "replace")
    title = "".join(chr(b) if 32 <= b < 127 and b not in b"()\\" else f"\\{b:03o}" for b in said)
    head = [
        "%!PS-Adobe-3.0 EPSF-3.0",
        f"%%BoundingBox: {' '.join(map(str, whole))}",
        f"%%HiResBoundingBox: {' '.join(f'{side:.4f}' for side in box)}",
        f"%%Title: ({title})",
        f"%%Creator: (handout {__version__})",
        "%%LanguageLevel: 1",
        "%%Pages: 0",
        "%%EndComments",
    ]
    body = "\n".join(_LINE.sub(r"\1\n", line) if len(line) > 250 else line for line in content.splitlines())
    return "\n".join([*head, f"{_PROLOGUE}{body}", "end", "%%EOF\n"]).encode("ascii")
