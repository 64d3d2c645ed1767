"""Walks an SVG and finds every line it strokes: Béziers in mm, with layer and colour; counts what it leaves out."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from xml.etree.ElementTree import Element

import numpy as np

from handout import pathdata
from handout.errors import InputError
from handout.sources.svg import styles
from handout.sources.svg.styles import StyleRules, SvgStyle
from handout.values import Array

_MOST_USED = 50_000  # elements drawn by use
_DEEPEST = 100
_GROUPS = {"g", "a", "svg", "switch", "symbol"}
_SHAPES = {"path", "line", "polyline", "polygon", "rect", "circle", "ellipse"}
_LEFT_OUT = {"text": "text", "flowRoot": "text", "image": "picture", "foreignObject": "foreign object"}
_DRAWN = {*_GROUPS, *_SHAPES, *_LEFT_OUT, "use"}
_BLANKS = re.compile(r"\s+")
_LEAST = 1e-9  # a shape or a scale that is smaller is nothing


@dataclass(frozen=True, eq=False)
class Subpath:
    """A stroked subpath.

    path : (3 k + 1, 2) mm, cubics, see `pathdata`.
    attributes : of its element.
    """

    path: Array
    layer: str
    colour: str
    attributes: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class Text:
    """A part of a text on one line, without its font.

    to_mm : (2, 3), the map from its px.
    x, y : px, the place of its chunk on its baseline; x None: it goes on behind the part before, and dx px further.
    size : of its letters, px; anchor : "start", "middle" or "end", what of its chunk is at x.
    after : how many lines are drawn before it.
    """

    text: str
    to_mm: Array
    x: float | None
    y: float
    dx: float
    size: float
    anchor: str
    layer: str
    colour: str
    after: int = 0


@dataclass(frozen=True, eq=False)
class _ElementFrame:
    """What holds where an element stands: the map into mm, the style, the layer, the size of the viewport in px."""

    to_mm: Array
    style: SvgStyle
    layer: str
    size: tuple[float, float]
    depth: int


@dataclass(eq=False)
class Walk:
    """A document while it is read.

    left_out : counts, in words, what is not in the lines; texts : found besides, if they are wanted.
    """

    root: Element
    left_out: Counter[str] = field(default_factory=Counter)
    texts: list[Text] | None = None

    def __post_init__(self) -> None:
        self._named = {name: element for element in self.root.iter() if (name := element.get("id"))}
        self._sheet = StyleRules([element.text or "" for element in self.root.iter("style")])
        self._used = self._lines = 0
        self._using: list[Element] = []

    def lines(self) -> Iterator[Subpath]:
        """All stroked lines in the order of painting.

        Raises InputError: an element that cannot be read; elements that use themselves, or so many others that there is
        no end.
        """
        width, height = size(self.root)
        to_mm = styles.compose_maps(np.eye(2, 3) * styles.PX, styles.viewport(self.root.attrib, width, height))
        box = styles.view_box(self.root.get("viewBox"))
        inside = (box[2], box[3]) if box else (width, height)
        style = SvgStyle().inside(self._sheet.find_properties("svg", self.root.attrib))
        if style.shown:
            yield from self._children(self.root, _ElementFrame(to_mm, style, "", inside, 0))

    def _children(self, parent: Element, frame: _ElementFrame) -> Iterator[Subpath]:
        for child in parent:
            yield from self._element(child, frame)
            if parent.tag == "switch" and child.tag in _GROUPS | _SHAPES | {"use"}:
                break

    def _element(self, element: Element, frame: _ElementFrame) -> Iterator[Subpath]:
        tag = element.tag
        if tag not in _DRAWN or (tag == "symbol" and element not in self._using):
            return
        self._used += bool(self._using)
        if self._used > _MOST_USED or frame.depth > _DEEPEST:
            raise InputError(f"More than {_MOST_USED} elements are drawn by <use>: simplify the drawing.")
        properties = self._sheet.find_properties(tag, element.attrib)
        style = frame.style.inside(properties)
        if not style.shown:
            return
        for name in ("clip-path", "mask"):
            if properties.get(name, "none") != "none":
                self.left_out[f"{name.partition('-')[0]} (what it hides is drawn)"] += 1
        try:
            to_mm = styles.compose_maps(frame.to_mm, styles.transform(properties.get("transform")))
        except InputError as error:
            raise InputError(f"<{element.tag}{_id(element)}>: {error}.") from None
        layer = frame.layer
        if element.tag == "g" and element.get("groupmode") == "layer":  # as Inkscape writes them
            layer = element.get("label") or element.get("id") or layer
        yield from self._content(element, _ElementFrame(to_mm, style, layer, frame.size, frame.depth + 1))

    def _content(self, element: Element, frame: _ElementFrame) -> Iterator[Subpath]:
        """What an element draws, given what holds inside it."""
        tag = element.tag
        if tag == "text" and self.texts is not None and frame.style.visible:
            self._text(element, frame)
        elif tag in _LEFT_OUT:
            self.left_out[_LEFT_OUT[tag]] += frame.style.visible
        elif tag == "use":
            yield from self._use(element, frame)
        elif tag in _GROUPS:
            inner = self._viewport(element, frame) if tag in ("svg", "symbol") else frame
            yield from self._children(element, inner)
        elif frame.style.visible:
            yield from self._shape(element, frame)

    def _use(self, element: Element, frame: _ElementFrame) -> Iterator[Subpath]:
        target = self._named.get((element.get("href") or "").removeprefix("#"))
        if target is None:
            return
        if target in self._using:
            raise InputError(f"<use{_id(element)}> uses what it is part of, without end: remove it.")
        at = styles.shift(self._length(element, "x", frame.size[0]), self._length(element, "y", frame.size[1]))
        to_mm = styles.compose_maps(frame.to_mm, at)
        self._using.append(target)
        yield from self._element(target, _ElementFrame(to_mm, frame.style, frame.layer, frame.size, frame.depth))
        self._using.pop()

    def _viewport(self, element: Element, frame: _ElementFrame) -> _ElementFrame:
        width = self._length(element, "width", frame.size[0], frame.size[0])
        height = self._length(element, "height", frame.size[1], frame.size[1])
        x, y = self._length(element, "x", frame.size[0]), self._length(element, "y", frame.size[1])
        inner = styles.compose_maps(styles.shift(x, y), styles.viewport(element.attrib, width, height))
        box = styles.view_box(element.get("viewBox"))
        inside = (box[2], box[3]) if box else (width, height)
        return _ElementFrame(styles.compose_maps(frame.to_mm, inner), frame.style, frame.layer, inside, frame.depth)

    def _length(self, element: Element, name: str, whole: float, default: float = 0.0) -> float:
        try:
            return styles.length(element.get(name), whole, default)
        except InputError as error:
            raise InputError(f"<{element.tag}{_id(element)}>: {name}: {error}.") from None

    def _shape(self, element: Element, frame: _ElementFrame) -> Iterator[Subpath]:
        style = frame.style
        if not style.is_stroked:
            self.left_out["filled outline without a stroke"] += style.is_filled
            return
        paths = self._paths(element, frame.size)
        if style.dashed and paths:
            self.left_out["dashes (their lines are drawn whole)"] += 1
        turn, away = frame.to_mm[:, :2], frame.to_mm[:, 2]
        for path in paths:
            with np.errstate(over="ignore", invalid="ignore"):  # refused in the next line
                placed = path @ turn.T + away
            if not np.isfinite(placed).all():
                raise InputError(f"<{element.tag}{_id(element)}> has a point that is infinitely far away.")
            self._lines += 1
            yield Subpath(placed, frame.layer, style.colour, element.attrib)

    def _text(self, element: Element, frame: _ElementFrame) -> None:
        """Take a text apart where its place, size or colour changes; runs of blanks are one, as SVG has them."""
        style = frame.style
        found = [Text("", frame.to_mm, 0.0, 0.0, 0.0, style.size, style.anchor, frame.layer, "", self._lines)]
        for string, style, moves in self._strings(element, frame, frame.style, {}):
            last, x, look = found[-1], moves.get("x"), (style.size, style.text_colour)
            if x is not None or not last.text or last.text.endswith(" "):
                string = string.lstrip()
            if not moves and (not string.strip() or look == (last.size, last.colour)):
                found[-1] = replace(last, text=last.text + string)
                continue
            y, dx = moves.get("y", last.y) + moves.get("dy", 0.0), moves.get("dx", 0.0)
            found.append(replace(last, text=string, x=x, y=y, dx=dx, size=look[0], anchor=style.anchor, colour=look[1]))
        if self.texts is not None and any(text.text.strip() for text in found):
            self.texts += found

    def _strings(
        self, element: Element, frame: _ElementFrame, style: SvgStyle, moves: dict[str, float]
    ) -> Iterator[tuple[str, SvgStyle, dict[str, float]]]:
        """The strings of a text in order, each with its style and where those elements put it that begin with it."""
        moves = moves | self._moves(element, frame.size, style.size)
        pieces: list[str | Element | None] = [element.text]
        for child in element:
            pieces += [child, child.tail]
        for piece in pieces:
            if isinstance(piece, Element):
                inner = style.inside(self._sheet.find_properties(piece.tag, piece.attrib))
                self.left_out["text on a path"] += piece.tag == "textPath" and inner.shown
                drawn = piece.tag in ("tspan", "a") and inner.shown and inner.visible
                strings = list(self._strings(piece, frame, inner, moves)) if drawn else []
            else:
                strings = [(_BLANKS.sub(" ", piece), style, moves)] if piece else []
            yield from strings
            moves = {} if strings else moves

    def _moves(self, element: Element, whole: tuple[float, float], em: float) -> dict[str, float]:
        """What an element of a text says of its place, px: x, y, dx and dy, of its first letter."""
        moves: dict[str, float] = {}
        for name in ("x", "y", "dx", "dy"):
            values = element.get(name, "").replace(",", " ").split()
            try:
                if values:
                    moves[name] = styles.length(values[0], whole[name[-1] == "y"], em=em)
            except InputError as error:
                raise InputError(f"<{element.tag}{_id(element)}>: {name}: {error}.") from None
            if len(values) > 1:
                self.left_out["list of places of letters (the first counts)"] += 1
        return moves

    def _paths(self, element: Element, size: tuple[float, float]) -> list[Array]:
        """The subpaths of a shape, in its own units."""
        tag = element.tag
        if tag == "path":
            try:
                return pathdata.cubics(element.get("d", ""))
            except InputError as error:
                raise InputError(f"<path{_id(element)}>: {error}.") from None
        if tag in ("polyline", "polygon"):
            return self._corners(element, closed=tag == "polygon")
        wide, high = size
        across = math.hypot(wide, high) / math.sqrt(2)
        if tag == "line":
            ends = [[self._length(element, f"x{i}", wide), self._length(element, f"y{i}", high)] for i in (1, 2)]
            return [pathdata.polyline(np.array(ends))]
        if tag == "rect":
            x, y = self._length(element, "x", wide), self._length(element, "y", high)
            width, height = self._length(element, "width", wide), self._length(element, "height", high)
            rx, ry = self._length(element, "rx", wide, -1.0), self._length(element, "ry", high, -1.0)
            rx, ry = (ry if rx < 0 else rx), (rx if ry < 0 else ry)
            return [pathdata.rectangle(x, y, width, height, rx, ry)] if min(width, height) > _LEAST else []
        cx, cy = self._length(element, "cx", wide), self._length(element, "cy", high)
        if tag == "circle":
            rx = ry = self._length(element, "r", across)
        else:
            rx, ry = self._length(element, "rx", wide), self._length(element, "ry", high)
        return [pathdata.ellipse(cx, cy, rx, ry)] if min(rx, ry) > _LEAST else []

    def _corners(self, element: Element, *, closed: bool) -> list[Array]:
        try:
            values = pathdata.numbers(element.get("points", ""))
        except ValueError as error:
            raise InputError(f"<{element.tag}{_id(element)}>: points: {error}.") from None
        points = np.array(values[: len(values) // 2 * 2]).reshape(-1, 2)
        if not np.isfinite(points).all():
            raise InputError(f"<{element.tag}{_id(element)}> has a point that is infinitely far away.")
        return [pathdata.polyline(points, closed)] if len(points) else []


def size(root: Element) -> tuple[float, float]:
    """Width and height of the whole in px; of the viewBox where the file does not say, else 0.

    Raises InputError: one of them is not a length.
    """
    box = styles.view_box(root.get("viewBox"))
    sides = []
    for index, name in enumerate(("width", "height")):
        whole = box[2 + index] if box else 0.0
        try:
            sides.append(whole if styles.is_share(root.get(name)) else styles.length(root.get(name), whole))
        except InputError as error:
            raise InputError(f"<svg>: {name}: {error}.") from None
    if box and styles.is_share(root.get("width")) != styles.is_share(root.get("height")):
        # one of them given: the other follows from the shape of the viewBox
        if styles.is_share(root.get("width")):
            sides[0] = sides[1] * box[2] / box[3]
        else:
            sides[1] = sides[0] * box[3] / box[2]
    return sides[0], sides[1]


def _id(element: Element) -> str:
    return f" id={element.get('id')!r}" if element.get("id") else ""
