"""Where an element of an SVG lies and how it is drawn: maps into mm; what it inherits, its attributes and styles.
sheets.

those for a medium, a state or a descendant do not.  A map is (2, 3): a point p goes to ``m[:, :2] @ p + m[:, 2]``.
those for a medium, a state or a descendant do not. A map is a (2, 3) array: a point p goes to ``m[:, :2] @ p + m[:,
2]``.

Source: SVG 1.1, §7 (coordinate systems, transforms, viewBox, preserveAspectRatio); CSS: 1 px = 1/96 in.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handout.errors import InputError
from handout.pathdata import numbers
from handout.values import Array

PX = 25.4 / 96  # mm
_UNITS = {"": 1.0, "px": 1.0, "mm": 1 / PX, "cm": 10 / PX, "in": 96.0, "pt": 96 / 72, "pc": 16.0, "q": 0.25 / PX}
_LENGTH = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*|%)\s*\Z")
_TRANSFORM = re.compile(r"([a-zA-Z]{1,20})[ ]?\(([^()]*)\)")
_ALIGN = {"xMin": 0.0, "xMid": 0.5, "xMax": 1.0, "YMin": 0.0, "YMid": 0.5, "YMax": 1.0}

IDENTITY: Array = np.eye(2, 3)


def length(text: str | None, whole: float, default: float = 0.0, em: float = 16.0) -> float:
    """A length in px (user units); `whole` is what 100 % means, `em` the size of letters.

    Raises InputError: not a length.
    """
    if text is None or not text.strip() or text.strip() == "auto":
        return default
    match = _LENGTH.match(text)
    unit = match.group(2).lower() if match else ""
    units = {**_UNITS, "%": whole / 100, "em": em, "ex": em / 2}
    if match is None or unit not in units:
        raise InputError(f"{text[:30]!r} is not a length")
    value = float(match.group(1)) * units[unit]
    if not math.isfinite(value):
        raise InputError(f"{text[:30]!r} is not a finite length")
    return value


def is_share(text: str | None) -> bool:
    """Whether a length is missing or one of its surroundings, which a file alone does not have."""
    return text is None or text.strip() in ("", "auto") or text.strip().endswith("%")


def compose_maps(outer: Array, inner: Array) -> Array:
    """The map that first does `inner`, then `outer`."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def transform(text: str | None) -> Array:
    """A list of transforms as a map. Raises InputError: one that does not exist, or does not take so many numbers."""
    matrix = IDENTITY
    if not text or text.strip() == "none":
        return matrix
    text = " ".join(text.split())
    if _TRANSFORM.sub("", text).strip(" ,"):
        raise InputError(f"the transform {text[:40]!r} cannot be read")
    for name, inside in _TRANSFORM.findall(text):
        try:
            matrix = compose_maps(matrix, _map_of(name, numbers(inside)))
        except (ValueError, TypeError, OverflowError):
            raise InputError(f"the transform {name}({inside[:30]}) cannot be read") from None
    return matrix


def _map_of(name: str, numbers: list[float]) -> Array:
    if name == "matrix":
        a, b, c, d, e, f = numbers
        return np.array([[a, c, e], [b, d, f]])
    if name == "translate":
        return shift(*numbers)
    if name == "scale":
        x, y = numbers * 2 if len(numbers) == 1 else numbers
        return np.array([[x, 0.0, 0.0], [0.0, y, 0.0]])
    if name == "rotate":
        return _rotate(*numbers)
    if name in ("skewX", "skewY"):
        (angle,) = numbers
        tangent = math.tan(math.radians(angle))
        return np.array([[1.0, tangent, 0.0], [0.0, 1.0, 0.0]] if name == "skewX" else [[1, 0, 0], [tangent, 1.0, 0]])
    raise ValueError(name)


def shift(x: float, y: float = 0.0) -> Array:
    """The map that moves everything."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y]])


def _rotate(angle: float, x: float = 0.0, y: float = 0.0) -> Array:
    cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0]])
    return compose_maps(shift(x, y), compose_maps(turn, shift(-x, -y)))


def view_box(text: str | None) -> tuple[float, float, float, float] | None:
    """x, y, width and height of a viewBox; None where there is none that can be used."""
    try:
        x, y, width, height = numbers(text or "")
    except ValueError:
        return None
    return (x, y, width, height) if width > 0 and height > 0 and np.isfinite([x, y, width, height]).all() else None


def viewport(attributes: Mapping[str, str], width: float, height: float) -> Array:
    """From the user units inside an element with a viewBox to those around its upper left corner."""
    box = view_box(attributes.get("viewBox"))
    if box is None or not (width > 0 and height > 0):
        return IDENTITY
    align, _, fit = (attributes.get("preserveAspectRatio") or "xMidYMid").strip().removeprefix("defer ").partition(" ")
    sx, sy = width / box[2], height / box[3]
    if align != "none":
        sx = sy = max(sx, sy) if fit.strip() == "slice" else min(sx, sy)
    left = (width - sx * box[2]) * _ALIGN.get(align[:4], 0.5)
    above = (height - sy * box[3]) * _ALIGN.get(align[4:], 0.5)
    return np.array([[sx, 0.0, left - sx * box[0]], [0.0, sy, above - sy * box[1]]])


_SIMPLE = re.compile(r"(\*|[A-Za-z][\w-]*)?((?:[.#][\w-]+)*)\Z")
_PARTS = re.compile(r"[.#][\w-]+")
_NONE = {"none", "transparent"}


@dataclass(frozen=True)
class SvgStyle:
    """What of a style matters for lines.

    stroke, fill, color : as they are written; visible : neither hidden nor transparent; line : the stroke has a width
    and is not transparent; dashed; size : of letters, px; anchor : which place of a text is at its point.
    """

    stroke: str = "none"
    fill: str = "black"
    color: str = "black"
    visible: bool = True
    shown: bool = True
    line: bool = True
    filling: bool = True
    dashed: bool = False
    size: float = 16.0
    anchor: str = "start"

    @property
    def is_stroked(self) -> bool:
        """Whether there is a line to draw."""
        return self.line and self.stroke not in _NONE

    @property
    def is_filled(self) -> bool:
        """Whether there is an area without a line."""
        return self.filling and self.fill not in _NONE

    @property
    def colour(self) -> str:
        """The colour of the line as ``"#rrggbb"``; "" where it is none, such as a gradient."""
        return hexadecimal(self.color if self.stroke.lower() == "currentcolor" else self.stroke)

    @property
    def text_colour(self) -> str:
        """The colour of letters, which are filled, or stroked alone."""
        paint = self.fill if self.is_filled else self.stroke
        return hexadecimal(self.color if paint.lower() == "currentcolor" else paint)

    def inside(self, properties: Mapping[str, str]) -> SvgStyle:
        """The style of an element with these properties inside one of this style."""
        style = self
        for name, value in properties.items():
            value = value.strip()
            if name == "font-size":
                with contextlib.suppress(InputError):  # a word such as "small" leaves them as large as those around
                    style = replace(style, size=max(length(value, style.size, style.size, em=style.size), 0.0))
            elif name in _PROPERTIES and value and value != "inherit":
                style = replace(style, **_PROPERTIES[name](value))
        return style


# property → what its value says of a `SvgStyle`; a property that matters for lines is added here
_PROPERTIES: dict[str, Callable[[str], dict[str, Any]]] = {
    "stroke": lambda value: {"stroke": value},
    "fill": lambda value: {"fill": value},
    "color": lambda value: {"color": value},
    "visibility": lambda value: {"visible": value == "visible"},
    "stroke-dasharray": lambda value: {"dashed": any(c in "123456789" for c in value)},
    "stroke-width": lambda value: {"line": not _nothing(value)},
    "stroke-opacity": lambda value: {"line": not _nothing(value)},
    "fill-opacity": lambda value: {"filling": not _nothing(value)},
    "display": lambda value: {"shown": False} if value == "none" else {},
    "opacity": lambda value: {"shown": False} if _nothing(value) else {},
    "text-anchor": lambda value: {"anchor": value},
}


def _nothing(value: str) -> bool:
    number = re.match(r"[-+]?[\d.]+", value)
    try:
        return number is not None and float(number.group()) <= 0
    except ValueError:
        return False


def hexadecimal(colour: str) -> str:
    """Any colour of CSS as ``"#rrggbb"``, "" for what is none."""
    from PIL import ImageColor

    try:
        return "#{:02x}{:02x}{:02x}".format(*ImageColor.getrgb(colour.strip().lower())[:3])
    except (ValueError, TypeError):
        return ""


class StyleRules:
    """The rules of the style sheets of a file, in order of their weight."""

    def __init__(self, texts: list[str]) -> None:
        self._rules: list[tuple[str, frozenset[str], dict[str, str]]] = []
        weighed = []
        for text in texts:
            first, *rest = text.replace("<!--", " ").replace("-->", " ").split("/*")
            uncommented = " ".join([first, *(part.partition("*/")[2] for part in rest)])
            rules = (rule.partition("{") for rule in _plain(uncommented).split("}"))
            for selectors, _, body in rules:
                for selector in selectors.split(","):
                    match = _SIMPLE.match(selector.strip())
                    if match and selector.strip():
                        parts = _PARTS.findall(match.group(2))
                        weight = (sum(p[0] == "#" for p in parts), len(parts), bool(match.group(1)))
                        weighed.append((weight, match.group(1) or "*", frozenset(parts), declarations(body)))
        weighed.sort(key=lambda rule: rule[0])
        self._rules = [rule[1:] for rule in weighed]

    def find_properties(self, tag: str, attributes: Mapping[str, str]) -> dict[str, str]:
        """The properties of an element: its attributes, what rules say of it, its own style."""
        properties = dict(attributes)
        if self._rules:
            marks = {f".{name}" for name in attributes.get("class", "").split()} | {f"#{attributes.get('id', '')}"}
            for element, parts, body in self._rules:
                if element in ("*", tag) and parts <= marks:
                    properties |= body
        if "style" in attributes:
            properties |= declarations(attributes["style"])
        return properties


def declarations(text: str) -> dict[str, str]:
    """Properties of ``name: value; …``."""
    pairs = (part.partition(":") for part in text.split(";"))
    return {name.strip(): value.replace("!important", "").strip() for name, colon, value in pairs if colon}


def _plain(text: str) -> str:
    """A style sheet without its rules for media, fonts and the like, which stand in braces of their own."""
    rules, depth, skipping = [], 0, -1
    for piece in re.split(r"([{}])", text):
        if piece == "{":
            depth += 1
        elif piece == "}":
            depth -= 1
            if depth == skipping:
                skipping = -1
                continue
        elif skipping < 0 and "@" in piece:
            piece, _, rule = piece.rpartition("@")
            if ";" in rule:  # @import and @charset have no braces
                piece += rule.partition(";")[2]
            else:
                rules.append(piece)
                skipping = depth
                continue
        if skipping < 0:
            rules.append(piece)
    return "".join(rules)
