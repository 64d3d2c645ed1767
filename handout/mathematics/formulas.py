"""What a formula is made of: a tree whose leaves are words that the hand sets; places are graphemes of its text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Leaf:
    """A word of the hand: a letter, a number, a sign, the name of a function, or words of a text.

    text : its graphemes; at : the place of each.
    kind : of `signs`, how it stands to its neighbours; limits : whether what is below it stands right below.
    """

    text: tuple[str, ...]
    at: tuple[int, ...]
    kind: str
    limits: bool = False


@dataclass(frozen=True)
class Large:
    """A sign that is drawn as large as its place asks: a sum, an integral, a prime; `count` of them."""

    sign: str
    count: int
    limits: bool


@dataclass(frozen=True)
class Gap:
    """Room, x-heights."""

    width: float


@dataclass(frozen=True)
class Row:
    """Side by side."""

    items: tuple[Node, ...]


@dataclass(frozen=True)
class Fraction:
    """One above the other, with a rule between them unless `ruled` says no."""

    above: Node
    below: Node
    ruled: bool = True


@dataclass(frozen=True)
class Root:
    """The root of something; degree : None for a square root."""

    body: Node
    degree: Node | None = None


@dataclass(frozen=True)
class Scripts:
    """What stands small at the right of a base, or above and below it where `limits` says so; None of it: absent."""

    base: Node
    lower: Node | None
    upper: Node | None
    limits: bool = False


@dataclass(frozen=True)
class Fenced:
    """Between brackets that grow with it, "" for one that is not drawn; between `parts` a bar that grows as well."""

    left: str
    parts: tuple[Node, ...]
    right: str


@dataclass(frozen=True)
class CellGrid:
    """Rows of cells: a matrix, cases, aligned equations.

    sides : of each column, "l", "c" or "r"; the last holds for all further ones.
    gap : between columns, x-heights; of aligned equations two columns meet without one (`meeting`).
    """

    rows: tuple[tuple[Node, ...], ...]
    sides: str = "c"
    gap: float = 1.2
    meeting: bool = False


@dataclass(frozen=True)
class Accent:
    """Something drawn over, under or around a body: see `signs.ACCENTS`."""

    body: Node
    kind: str


Node = Leaf | Large | Gap | Row | Fraction | Root | Scripts | Fenced | CellGrid | Accent


@dataclass(frozen=True)
class Formula:
    """A formula in a text.

    source : its TeX; at : where it begins and where what follows it does, graphemes of the text, delimiters counted.
    displayed : whether it has a line of its own.
    """

    tree: Node = field(hash=False)
    source: str
    at: tuple[int, int]
    displayed: bool


def children(node: Node) -> Iterator[Node]:
    """The nodes right within a node, in the order in which they are written."""
    match node:
        case Row(items=items):
            yield from items
        case Fraction(above=above, below=below):
            yield from (above, below)
        case Root(body=body, degree=degree):
            yield from (degree, body) if degree is not None else (body,)
        case Scripts(base=base, lower=lower, upper=upper):
            yield from (part for part in (base, lower, upper) if part is not None)
        case Fenced(parts=parts):
            yield from parts
        case CellGrid(rows=rows):
            yield from (cell for row in rows for cell in row)
        case Accent(body=body):
            yield body


def leaves(node: Node) -> Iterator[Leaf]:
    """The leaves of a tree, in the order in which they are written."""
    if isinstance(node, Leaf):
        yield node
    for child in children(node):
        yield from leaves(child)


def is_tall(node: Node) -> bool:
    """Whether brackets around it are to grow."""
    if isinstance(node, Fraction | CellGrid | Root) or (isinstance(node, Large) and node.sign not in "′|"):
        return True
    if isinstance(node, Scripts) and node.limits:
        return True
    return any(map(is_tall, children(node)))
