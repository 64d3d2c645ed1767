"""How an element of an SVG is drawn: what it inherits, its attributes, style sheets, and its own style.

Of style sheets the rules for elements, classes and ids count, alone or together (``path.thin``, ``#a``, ``.b, .c``);
those for a medium, a state or a descendant do not.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from handout.errors import InputError
from handout.sources.svg import frames

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
                    style = replace(style, size=max(frames.length(value, style.size, style.size, em=style.size), 0.0))
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
