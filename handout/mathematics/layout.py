"""Where the parts of a formula go, and how large they are: as people write them, on the line and about its axis.

Lengths are in x-heights, y up from the baseline.  The leaves of a formula are words that the hand has set: only the
boxes of their ink are known here.  Sizes fall less than in print, for a pen's line stays as wide as it is: to 0.72 and
0.55 beside something (TeX: 0.7 and 0.5), to 0.88 in a fraction in a line (TeX: 0.7), to 0.95 in a displayed one.

Source: own method; which parts there are and how they nest is The TeXbook's, appendix G.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from handout.mathematics import signs
from handout.mathematics.formulas import (
    Accent,
    CellGrid,
    Fenced,
    Fraction,
    Gap,
    Large,
    Leaf,
    Node,
    Root,
    Row,
    Scripts,
    leaves,
)
from handout.mathematics.shapes import Wander, draw_accent, draw_root, draw_rule, draw_sign
from handout.values import Array


@dataclass(frozen=True)
class LayoutSettings:
    """Sizes and distances, x-heights; all set by eye, on pages in the three drawn hands.

    axis, wander : height about which fractions and brackets stand, and its standard deviation.
    script, least : size of what stands small beside something, and the smallest there is.
    inline : size of the parts of a fraction in a line of text, or within another; displayed : on a line of its own.
    near : between letters; binary, relation, after : around and behind signs of these kinds.
    clear : between a rule and what it parts, and between brackets and what they hold.
    beside : room behind an index, a lower limit and a fraction, before what stands on the line.
    sum_, integral : heights of these in a line, and displayed.
    """

    axis: float = 0.64
    wander: float = 0.03
    script: float = 0.72
    least: float = 0.55
    inline: float = 0.88
    displayed: float = 0.95
    near: float = 0.26
    binary: float = 0.52
    relation: float = 0.7
    after: float = 0.6
    clear: float = 0.3
    beside: float = 0.2
    sums: tuple[float, float] = (2.3, 3.0)
    integrals: tuple[float, float] = (3.0, 4.0)


SETTINGS = LayoutSettings()


@dataclass(frozen=True, eq=False)
class SetLeaf:
    """A leaf with its place: where the origin of its word is, and its size."""

    number: int
    x: float
    y: float
    size: float

    def move_by(self, x: float, y: float) -> SetLeaf:
        return replace(self, x=self.x + x, y=self.y + y)


@dataclass(frozen=True, eq=False)
class DrawnPart:
    """Strokes, each (n, 2)."""

    strokes: tuple[Array, ...]

    def move_by(self, x: float, y: float) -> DrawnPart:
        return DrawnPart(tuple(stroke + np.array([x, y]) for stroke in self.strokes))


@dataclass(frozen=True, eq=False)
class Box:
    """What is laid out, in the order of writing, and the box of its ink."""

    parts: tuple[SetLeaf | DrawnPart, ...]
    left: float
    bottom: float
    right: float
    top: float

    @property
    def width(self) -> float:
        return self.right - self.left

    def move_by(self, x: float, y: float) -> Box:
        parts = tuple(part.move_by(x, y) for part in self.parts)
        return Box(parts, self.left + x, self.bottom + y, self.right + x, self.top + y)


_EMPTY = Box((), 0.0, 0.0, 0.0, 0.0)


def lay_out(
    tree: Node,
    boxes: Sequence[tuple[float, float, float, float]],
    displayed: bool,
    wander: Wander,
    settings: LayoutSettings = SETTINGS,
) -> list[tuple[float, Box]]:
    """The pieces of a formula between which a line may end, each with the gap before it, its left end at x = 0.

    boxes : of each leaf as the hand sets it: left, bottom, right and top of its ink, x-heights.
    displayed : whether it has a line of its own.
    wander : of all variation.
    """
    layout = _Layout({id(leaf): n for n, leaf in enumerate(leaves(tree))}, boxes, wander, settings)
    items = tree.items if isinstance(tree, Row) else (tree,)
    cuts = [
        i
        for i, node in enumerate(items)
        if i and _kind(node) == signs.RELATION and _kind(items[i - 1]) != signs.RELATION
    ]
    pieces = []
    for begin, end in zip([0, *cuts], [*cuts, len(items)], strict=True):
        box = layout.row(items[begin:end], 1.0, displayed, first=begin == 0)
        pieces.append((settings.relation if begin else 0.0, box.move_by(-box.left, 0.0)))
    return pieces


def _kind(node: Node) -> str:
    """How a node stands to its neighbours; "" for what needs no room."""
    match node:
        case Leaf(kind=kind):
            return kind
        case Scripts(base=base):
            return _kind(base)
        case Large(sign=sign):
            return signs.RELATION if sign == "|" else signs.LARGE
        case Gap():
            return ""
    return signs.ORDINARY


def _join(boxes: Sequence[Box]) -> Box:
    """Boxes where they are, as one."""
    inked = [box for box in boxes if box.parts or box.width]
    if not inked:
        return _EMPTY
    return Box(
        tuple(part for box in inked for part in box.parts),
        min(box.left for box in inked),
        min(box.bottom for box in inked),
        max(box.right for box in inked),
        max(box.top for box in inked),
    )


def _drawn(strokes: Sequence[Array]) -> Box:
    xy = np.concatenate(strokes)
    (left, bottom), (right, top) = xy.min(axis=0).tolist(), xy.max(axis=0).tolist()
    return Box((DrawnPart(tuple(strokes)),), left, bottom, right, top)


@dataclass(frozen=True, eq=False)
class _Layout:
    numbers: dict[int, int]
    boxes: Sequence[tuple[float, float, float, float]]
    wander: Wander
    settings: LayoutSettings

    def row(self, items: Sequence[Node], size: float, displayed: bool, *, first: bool = True) -> Box:
        """Nodes side by side; first : whether nothing stands before them."""
        laid, end, before, gap = list[Box](), 0.0, None if first else signs.RELATION, 0.0
        for node in items:
            if isinstance(node, Gap):
                gap += node.width * size
                continue
            box = self.node(node, size, displayed)
            if not box.parts:
                continue
            kind = _kind(node)
            if kind == signs.BINARY and before in (
                None,
                signs.BINARY,
                signs.RELATION,
                signs.OPENING,
                signs.PUNCTUATION,
            ):
                kind = "sign"  # of a number
            room = self._room(before, kind) * size if laid else 0.0
            laid.append(box.move_by(end + room + gap - box.left, 0.0))
            end, before, gap = laid[-1].right, kind, 0.0
        whole = _join(laid)
        left = min(whole.left, 0.0)  # room at its ends is its own
        return replace(whole, left=left, right=whole.right + max(gap, 0.0)) if laid else whole

    def _room(self, before: str | None, kind: str) -> float:
        """Between two neighbours of some kinds."""
        own = self.settings
        if signs.RELATION in (before, kind):
            return own.relation
        if signs.BINARY in (before, kind):
            return own.binary
        if before == signs.PUNCTUATION:
            return own.after
        if signs.WORD in (before, kind):
            return own.near if kind == signs.OPENING else own.binary
        if signs.LARGE in (before, kind):
            return own.binary
        return 0.7 * own.near if kind == signs.PUNCTUATION else own.near

    def node(self, node: Node, size: float, displayed: bool) -> Box:
        """A node about the baseline, its left end anywhere near x = 0."""
        match node:
            case Leaf():
                number = self.numbers[id(node)]
                return Box((SetLeaf(number, 0.0, 0.0, size),), *(size * side for side in self.boxes[number]))
            case Row(items=items):
                return self.row(items, size, displayed)
            case Large():
                return self._large(node, size, displayed)
            case Fraction():
                return self._fraction(node, size, displayed)
            case Root():
                return self._root(node, size, displayed)
            case Scripts():
                return self._scripts(node, size, displayed)
            case Fenced():
                return self._fenced(node, size, displayed)
            case CellGrid():
                return self._grid(node, size, displayed)
            case Accent():
                body = self.node(node.body, size, displayed)
                marks = draw_accent(node.kind, (body.left, body.bottom, body.right, body.top), size, self.wander)
                return _join([body, _drawn(marks)])
        return _EMPTY

    def _axis(self, size: float) -> float:
        return size * (self.settings.axis + float(self.wander.draw(self.settings.wander)))

    def _smaller(self, size: float) -> float:
        return max(size * self.settings.script, min(size, self.settings.least))

    def _large(self, node: Large, size: float, displayed: bool) -> Box:
        if node.sign == "′":
            ticks = [
                np.array([(0.32 * k + 0.24, 1.3), (0.32 * k + 0.12, 0.95), (0.32 * k, 0.6)]) for k in range(node.count)
            ]
            return _drawn([tick * size + self.wander.draw(0.04 * size, (1, 2)) for tick in ticks])
        heights = self.settings.integrals if node.sign in "∫∮" else self.settings.sums
        half, axis = 0.5 * size * heights[displayed], self._axis(size)
        boxes, x = list[Box](), 0.0
        for _ in range(node.count):
            box = _drawn(draw_sign(node.sign, axis - half, axis + half, size, self.wander))
            boxes.append(box.move_by(x - box.left, 0.0))
            x = boxes[-1].right - 0.35 * boxes[-1].width
        return _join(boxes)

    def _fraction(self, node: Fraction, size: float, displayed: bool) -> Box:
        own, axis = self.settings, self._axis(size)
        inner = max(size * (own.displayed if displayed else own.inline), min(size, own.least))
        above, below = self.node(node.above, inner, False), self.node(node.below, inner, False)
        width, clear = max(above.width, below.width, 0.8 * size) + 0.4 * size, own.clear * size
        x = 0.5 * width + float(self.wander.draw(0.04)) * size
        above = above.move_by(x - 0.5 * (above.left + above.right), axis + clear - above.bottom)
        below = below.move_by(0.5 * width - 0.5 * (below.left + below.right), axis - clear - below.top)
        if not node.ruled:
            return _join([above, below])
        whole = _join([above, _drawn([draw_rule(0.0, width, axis, self.wander)]), below])
        return replace(whole, right=whole.right + own.beside * size)

    def _root(self, node: Root, size: float, displayed: bool) -> Box:
        body = self.node(node.body, size, displayed)
        body = body.move_by(-body.left, 0.0)
        bottom, top = min(body.bottom, 0.0) - 0.08 * size, max(body.top, size) + self.settings.clear * size
        sign = _drawn([draw_root(body.right, bottom, top, size, self.wander)])
        sign = sign.move_by(-0.2 * size, 0.0)
        if node.degree is None:
            return _join([sign, body])
        degree = self.node(node.degree, self._smaller(self._smaller(size)), False)
        height = bottom + min(0.48 * (top - bottom), 1.1 * size) + 0.25 * size
        degree = degree.move_by(sign.left + 0.4 * size - degree.right, height - degree.bottom)
        return _join([degree, sign, body])

    def _scripts(self, node: Scripts, size: float, displayed: bool) -> Box:
        base = self.node(node.base, size, displayed)
        small = self._smaller(size)
        lower = None if node.lower is None else self.node(node.lower, small, False)
        upper = None if node.upper is None else self.node(node.upper, small, False)
        drawn = isinstance(node.base, Large)
        if node.limits and (displayed or not drawn):
            return self._limits(base, lower, upper, size)
        x, parts = base.right + 0.24 * size, [base]
        if lower is not None:
            down = min(-0.52 * size, base.bottom + (0.1 if drawn else 0.2) * size)
            inset = 0.3 * base.width if isinstance(node.base, Large) and node.base.sign in "∫∮" else 0.0
            lower = lower.move_by(x - inset - lower.left, min(down, 0.5 * size - lower.top))
            parts.append(lower)
        if upper is not None:
            rise = max(0.85 * size, base.top - (0.7 if drawn else 0.95) * size, 0.5 * size - upper.bottom)
            if lower is not None:
                rise = max(rise, lower.top + 0.15 * size - upper.bottom)
            parts.append(upper.move_by(x - upper.left, rise))
        whole = _join(parts)  # what follows an index stands apart: a comma would be one of its signs
        return whole if lower is None else replace(whole, right=whole.right + self.settings.beside * size)

    def _limits(self, base: Box, lower: Box | None, upper: Box | None, size: float) -> Box:
        """A base with something right below and above it."""
        middle, clear, parts = 0.5 * (base.left + base.right), self.settings.clear * size, [base]
        if lower is not None:
            floor = min(base.bottom, -0.1 * size)
            parts.append(lower.move_by(middle - 0.5 * (lower.left + lower.right), floor - clear - lower.top))
        if upper is not None:
            parts.append(upper.move_by(middle - 0.5 * (upper.left + upper.right), base.top + clear - upper.bottom))
        whole, beside = _join(parts), self.settings.beside * size
        return replace(whole, left=whole.left - beside, right=whole.right + beside)

    def _fenced(self, node: Fenced, size: float, displayed: bool) -> Box:
        inner, x, clear = list[Box](), 0.0, self.settings.clear * size
        bodies = [self.node(part, size, displayed) for part in node.parts]
        whole = _join(bodies)
        bottom, top = min(whole.bottom, -0.2 * size) - 0.15 * size, max(whole.top, 1.7 * size) + 0.15 * size
        for number, body in enumerate([*bodies, None]):
            sign = node.left if number == 0 else "|" if body is not None else node.right
            if sign:
                drawn = _drawn(draw_sign(sign, bottom, top, size, self.wander))
                inner.append(drawn.move_by(x - drawn.left, 0.0))
                x = inner[-1].right + clear
            if body is not None:
                inner.append(body.move_by(x - body.left, 0.0))
                x = inner[-1].right + clear
        return _join(inner)

    def _grid(self, node: CellGrid, size: float, displayed: bool) -> Box:
        cells = [[self.node(cell, size, displayed) for cell in row] for row in node.rows]
        count = max(map(len, cells))
        widths = [max((row[k].width for row in cells if k < len(row)), default=0.0) for k in range(count)]
        starts, x = [], 0.0
        for k, width in enumerate(widths):
            starts.append(x)
            met = node.meeting and k % 2 == 0
            x += width + (self.settings.relation if met else node.gap) * size
        laid, y = list[Box](), 0.0
        for number, row in enumerate(cells):
            top = max([1.1 * size, *(box.top for box in row)])
            bottom = min([-0.1 * size, *(box.bottom for box in row)])
            y -= top + (0.6 * size if number else 0.0)
            for k, box in enumerate(row):
                side = node.sides[k % 2] if node.meeting else node.sides[min(k, len(node.sides) - 1)]
                spare = {"l": 0.0, "c": 0.5, "r": 1.0}[side] * (widths[k] - box.width)
                laid.append(box.move_by(starts[k] + spare - box.left, y))
            y += bottom
        whole = _join(laid)
        return whole.move_by(0.0, self._axis(size) - 0.5 * (whole.bottom + whole.top))
