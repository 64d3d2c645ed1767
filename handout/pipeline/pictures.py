"""How writing looks in pictures: the pen, the paper and the resolution that `PictureOptions` ask for."""

from __future__ import annotations

from pathlib import Path

from handout import units
from handout.errors import InputError
from handout.hand import library
from handout.inking.papers import PAPERS, Paper
from handout.inking.pen import PENS, Pen, brushes, is_brush, usual
from handout.pipeline.options import PictureOptions, millimetres
from handout.sinks import Look
from handout.sinks import check_outputs as check_outputs


def look(picture: PictureOptions) -> Look:
    """How pictures look that are asked for so.

    Raises
    ------
    InputError
        A pen, a colour or a paper that there is not, or both a paper and --transparent.
    """
    sheet = paper(picture.paper)
    if picture.transparent and sheet.name != "none":
        raise InputError("--transparent leaves the paper out and --paper puts it in: give one of them.")
    return Look(pen(picture), picture.dpi, sheet, picture.transparent)


def pen(picture: PictureOptions) -> Pen:
    """The pen of strokes; where a scanned hand lends its ink, a ballpoint, since strokes have no scanned ink."""
    name = picture.pen or "ballpoint"
    if is_scanned(name):
        return usual("ballpoint", colour=picture.ink)
    width = None if picture.pen_width is None else millimetres(picture.pen_width, "pen width")
    if is_brush(name):
        from handout.inking.brush.brushes import find

        brush = find(name)
        return usual(name, brush.width if width is None else width, picture.ink or brush.colour)
    if name not in PENS:
        raise InputError(f"pen: {name!r} is not one of {', '.join((*PENS, *brushes()))}, nor a .brush file.")
    return usual(name, width, picture.ink)


def is_scanned(name: str) -> bool:
    """Whether the name of a pen is that of a scanned hand, or of a .hand file."""
    return name not in PENS and (name.endswith(".hand") or name in library.scanned())


def paper(text: str) -> Paper:
    """The paper of a name, a name and the distance of its lines (and its first rule), or a file."""
    name, colon, pitch = text.partition(":")
    if colon and name in ("ruled", "squared"):
        pitch, comma, first = pitch.partition(",")
        if comma and name == "squared":
            raise InputError(f"paper: {text!r}: only ruled paper has a first rule; write squared:{pitch}.")
        top = units.length(first, "first rule of the paper") if comma else None
        return Paper(name, units.length(pitch, "distance of the paper's lines"), top)
    if text not in PAPERS and not Path(text).is_file():
        raise InputError(f"paper: {text!r} is neither a picture nor one of {', '.join(PAPERS)}.")
    return Paper(text)
