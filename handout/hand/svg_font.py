"""Single-line SVG fonts as hands: Hershey, EMS, Relief and the like, whose glyphs are the way of a pen.

A glyph's path becomes points on the curve, set where a hand would aim: at its ends and corners, and between them the
closer the more it bends.  There is one form of every letter, so all variety comes from how letters are set and from the
movement.  Letters are not joined; kerning is not used.

Source: SVG 1.1, §20 (fonts).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from handout import markup, pathdata
from handout.errors import InputError
from handout.hand.drawn import FURTHEST, Hand
from handout.hand.letter_classes import FLAT_FIRST
from handout.values import Array, Glyph

_LARGEST = 32 * 2**20  # bytes
_SMOOTH, _INTERVAL = 0.27, 0.07  # a careful hand
_FINE = 0.004  # x-heights between a curve and the points it is judged by
_CORNER, _AROUND = math.radians(50), 0.09  # a turn within that many x-heights on either side that is meant
_STRIDE, _BEND = 0.6, math.radians(75)  # x-heights and turn from one point to the next
_SAME = 0.004  # x-heights between points that are the same
_CLOSED = 0.02  # x-heights between the ends of a closed contour
_OUTLINES = 0.6  # share of letters that are nothing but closed contours: in a line font o, O, 0, D and few more are
_CAPITAL = 0.68  # x-height of a font of capitals, in their height
_PITCH = (3.9, 8.0)  # distance of lines, least and greatest


def read_svg_font(path: Path) -> Hand:
    """Read an SVG font as a hand.

    Raises InputError: not SVG, no font in it, a font without letters, one of outlines, or a glyph that cannot be read.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(_LARGEST + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read as a font: {error.strerror or error}.") from error
    if len(data) > _LARGEST:
        raise InputError(f"{path} is larger than {_LARGEST // 2**20} MiB: that is no font of single lines.")
    try:
        return _hand(markup.parse(data, "an SVG font", doctype=True), path.stem)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def holds_font(path: Path) -> bool:
    """Whether a file looks like an SVG font rather than a drawing."""
    if path.suffix.lower() != ".svg" or not path.is_file():
        return False
    with path.open("rb") as stream:
        return b"<font-face" in (data := stream.read(_LARGEST)) or b"<font " in data


def _hand(root: Element, name: str) -> Hand:
    font = next(root.iter("font"), None)
    if font is None:
        raise InputError("There is no <font> in it: a drawing is plotted, not written with; a font has glyphs.")
    face = font.find("font-face")
    facts: Mapping[str, str] = {} if face is None else face.attrib
    paths, advances = _font_glyphs(font)
    drawn = {letter: lines for letter, lines in paths.items() if lines and not letter.isspace()}
    if not drawn:
        raise InputError("The font has no glyph of a letter with a path: there is nothing to write with.")
    unit = _x_height(drawn, facts)
    _check_lines(drawn, unit)
    glyphs = {letter: (_glyph(letter, lines, advances[letter], unit),) for letter, lines in drawn.items()}
    tall = _number(facts, "ascent", 0.0) - _number(facts, "descent", 0.0)
    spaces = [wide / unit for letter, wide in advances.items() if letter in " \u00a0" and wide > 0]
    width = float(np.median([glyph.width for (glyph,) in glyphs.values()]))
    return Hand(
        name=name,
        title=facts.get("font-family") or font.get("id") or name,
        glyphs=glyphs,
        marks={},
        slant=0.0,
        smooth=_SMOOTH,
        drawn_at=_SMOOTH,
        delayed_after="letter",
        interval=_INTERVAL,
        word_space=min(max(spaces[0] if spaces else 0.8 * width, 0.4), 3.0),
        pitch=min(max(1.1 * tall / unit, _PITCH[0]), _PITCH[1]),
    )


def _font_glyphs(font: Element) -> tuple[dict[str, list[Array]], dict[str, float]]:
    """The paths and the advance of every glyph that stands for one character, in units of the font."""
    usual = _number(font.attrib, "horiz-adv-x", 0.0)
    letters = {letter: glyph for glyph in font.findall("glyph") if len(letter := glyph.get("unicode", "")) == 1}
    paths = {letter: _paths(glyph, letter) for letter, glyph in letters.items()}
    return paths, {letter: _number(glyph.attrib, "horiz-adv-x", usual) for letter, glyph in letters.items()}


def _number(attributes: Mapping[str, str], name: str, default: float) -> float:
    try:
        value = float(attributes[name])
    except (KeyError, ValueError):
        return default
    return value if math.isfinite(value) else default


def _paths(glyph: Element, letter: str) -> list[Array]:
    try:
        return pathdata.cubics(glyph.get("d", ""))
    except InputError as error:
        raise InputError(f"The glyph of {letter!r}: {error}.") from None


def _x_height(drawn: Mapping[str, list[Array]], facts: Mapping[str, str]) -> float:
    """The height of a small letter in units of the font: of its glyphs, for what fonts say is often wrong."""
    tops = {letter: max(float(path[:, 1].max()) for path in paths) for letter, paths in drawn.items()}
    flat = [tops[letter] for letter in FLAT_FIRST if letter in tops]
    capitals = [_CAPITAL * top for letter, top in tops.items() if letter.isupper()]
    declared = [_number(facts, "x-height", 0.0), 0.5 * _number(facts, "units-per-em", 0.0)]
    unit = next((value for value in (*flat[:1], *capitals[:1], *declared) if value > 0), 0.0)
    if not unit > 1e-6:
        raise InputError("Neither letters nor units-per-em say how high a small letter is: the font cannot be scaled.")
    return unit


def _check_lines(drawn: Mapping[str, list[Array]], unit: float) -> None:
    letters = [paths for letter, paths in drawn.items() if letter.isalpha()] or list(drawn.values())
    closed = sum(all(np.hypot(*(path[0] - path[-1])) < _CLOSED * unit for path in paths) for paths in letters)
    if closed > _OUTLINES * len(letters):
        raise InputError(
            f"It is a font of outlines ({closed} of {len(letters)} letters are closed contours), which a pen would "
            "draw hollow: use a single-line font."
        )


def _glyph(letter: str, paths: list[Array], advance: float, unit: float) -> Glyph:
    reach = max(abs(advance), *(float(np.abs(path).max()) for path in paths)) / unit
    if not reach <= FURTHEST:
        raise InputError(f"The glyph of {letter!r} reaches {reach:.4g} x-heights from its origin; at most {FURTHEST}.")
    strokes = tuple(aims(pathdata.flatten_path(path / unit, _FINE)[0]) for path in paths)
    right = max(float(stroke[:, 0].max()) for stroke in strokes)
    return Glyph(letter, strokes, (False,) * len(strokes), advance / unit if advance > 0 else right + 0.3)


def aims(line: Array) -> Array:
    """Points on a line (n, 2), in x-heights, from which the movement makes the line again.

    Both ends and all corners; between two of them points evenly in length and turn together.
    """
    line = line[np.concatenate([[True], np.hypot(*np.diff(line, axis=0).T) > _SAME])]
    if len(line) < 3:
        return line
    step = np.hypot(*np.diff(line, axis=0).T)
    way = np.concatenate([[0.0], np.cumsum(step)])
    if way[-1] < 2 * _AROUND:
        return line[[0, -1]]
    ends = [0, *_corners(line, way), len(line) - 1]
    heading = np.unwrap(np.arctan2(*np.diff(line, axis=0).T[::-1]))
    turn = np.concatenate([[0.0], np.abs(np.diff(heading)), [0.0]])
    points = [line[:1]]
    for a, b in pairwise(ends):
        # what a line turns at a vertex is spread over the segments beside it
        bend = (np.concatenate([[0.0], turn[a + 1 : b]]) + np.concatenate([turn[a + 1 : b], [0.0]])) / 2
        effort = np.concatenate([[0.0], np.cumsum(step[a:b] / _STRIDE + bend / _BEND)])
        at = np.linspace(0, effort[-1], max(1, math.ceil(effort[-1] - 0.25)) + 1)[1:]
        points.append(np.column_stack([np.interp(at, effort, line[a : b + 1, axis]) for axis in (0, 1)]))
    return np.concatenate(points)


def _corners(line: Array, way: Array) -> list[int]:
    """Vertices at which the line turns sharply: the sharpest of every neighbourhood."""
    before, after = (
        np.column_stack([np.interp(way + side, way, line[:, axis]) for axis in (0, 1)]) for side in (-_AROUND, _AROUND)
    )
    back, ahead = line - before, after - line
    turn = np.abs(np.arctan2(back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0], (back * ahead).sum(axis=1)))
    turn[(way < 0.5 * _AROUND) | (way > way[-1] - 0.5 * _AROUND)] = 0.0
    corners: list[int] = []
    for index in np.argsort(-turn, kind="stable").tolist():
        if turn[index] < _CORNER:
            break
        if all(abs(way[index] - way[other]) > _AROUND for other in corners):
            corners.append(index)
    return sorted(corners)
