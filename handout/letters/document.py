"""What a letter holds: its head, and blocks of spans, each with the line of its source."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import msgspec

from handout.errors import InputError
from handout.tables import Length, Table

Side = Literal["left", "right", "centre"]
Underline = Literal["", "straight", "double", "wavy"]


class SheetHead(Table, frozen=True):
    """What differs on the first page, or on those that follow: see `LetterHead`; "none" takes the background away."""

    margin: str | None = None
    background: str | None = None


class PlaceOnPage(Table, frozen=True):
    """A rectangle of the first page, from its upper left corner."""

    x: Length
    y: Length
    w: Length
    h: Length


class LetterHead(Table, frozen=True):
    """What the head of a letter file may say; None: what is usual, or what an option of the command says.

    page_numbers : in the middle of the foot or in the upper corner, from the second page on.
    paragraphs : a gap between them, or the first line of each indented.
    background : a PDF or picture that previews show behind the writing.
    box : places for the text of containers of the same name.
    """

    page: str | None = None
    margin: str | None = None
    hand: str | None = None
    pen: str | None = None
    pen_width: str | None = None
    ink: str | None = None
    paper: str | None = None
    x_height: str | None = None
    line_spacing: str | None = None
    align: Literal["left", "right", "centre", "ragged"] | None = None
    slips: float | None = None
    language: str | None = None
    page_numbers: Literal["none", "foot", "corner"] = "none"
    paragraphs: Literal["apart", "indented"] = "apart"
    background: str | None = None
    first: SheetHead = SheetHead()
    following: SheetHead = SheetHead()
    box: dict[str, PlaceOnPage] = msgspec.field(default_factory=dict)


@dataclass(frozen=True)
class SpanManner:
    """How a span is written.

    hand, ink : "" those of the letter; ink as ``"#rrggbb"``.
    size : of the letters, 1 as usual, at most `MOST_SIZE`.
    underline, struck : what is drawn under and through it.
    """

    hand: str = ""
    ink: str = ""
    size: float = 1.0
    underline: Underline = ""
    struck: bool = False


LEAST_SIZE, MOST_SIZE = 0.4, 6.0  # beyond which no writing on the same page looks to be of one person; set by eye


@dataclass(frozen=True)
class TextSpan:
    """Text that is written in one manner; a newline in it is a hard break.

    line : of the source, from 1.
    """

    text: str
    manner: SpanManner
    line: int


@dataclass(frozen=True)
class Paragraph:
    """Text that is broken into lines.

    level : of a heading, 1 to 6; 0 for no heading.
    kind : "text", "date" or "postscript".
    """

    spans: tuple[TextSpan, ...]
    line: int
    side: Side | None = None
    level: int = 0
    kind: Literal["text", "date", "postscript"] = "text"
    new_page: bool = False


@dataclass(frozen=True)
class Item:
    """One item of a list; label : its number, of no spans where there is none."""

    blocks: tuple[Block, ...]
    label: Paragraph
    line: int


@dataclass(frozen=True)
class List:
    """A list.

    marker : what stands before each item: "dash", "dot" or "ring", or behind its number "." or ")".
    tight : whether its items stand as near as lines.
    """

    items: tuple[Item, ...]
    marker: Literal["dash", "dot", "ring", ".", ")"]
    tight: bool
    line: int
    manner: SpanManner = field(default_factory=SpanManner)
    new_page: bool = False


@dataclass(frozen=True)
class DrawnRule:
    """A line across the page, or a flourish.

    kind : "short" in the middle, "wide" from margin to margin, or "flourish".
    """

    kind: Literal["short", "wide", "flourish"]
    line: int
    ink: str = ""
    new_page: bool = False


@dataclass(frozen=True)
class TableBlock:
    """A table: its rows, the first of them its head, of cells that are paragraphs."""

    rows: tuple[tuple[Paragraph, ...], ...]
    line: int
    manner: SpanManner = field(default_factory=SpanManner)
    new_page: bool = False


@dataclass(frozen=True)
class PictureRoom:
    """Room for a picture, which previews show; width : mm, None: a third of what there is; None side: alone."""

    path: Path
    line: int
    width: float | None = None
    side: Side = "centre"
    new_page: bool = False


@dataclass(frozen=True)
class Quote:
    """Blocks that stand further in."""

    blocks: tuple[Block, ...]
    line: int
    new_page: bool = False


@dataclass(frozen=True)
class Boxed:
    """Blocks that are written at the place of a box."""

    name: str
    blocks: tuple[Block, ...]
    line: int
    new_page: bool = False


@dataclass(frozen=True)
class Signature:
    """A stored signature, "" for none, above what else is written there; it is never parted from it."""

    name: str
    blocks: tuple[Block, ...]
    line: int
    side: Side = "left"
    size: float = 1.0
    ink: str = ""
    new_page: bool = False


Block = Paragraph | List | DrawnRule | TableBlock | PictureRoom | Quote | Boxed | Signature


@dataclass(frozen=True)
class LetterFile:
    """A letter file, read.

    name : of the file, for messages.
    folder : that its pictures are looked for in.
    dropped : sentences on what of the source is not written.
    lines : of the source.
    """

    blocks: tuple[Block, ...]
    head: LetterHead = field(default_factory=LetterHead)
    name: str = "the letter"
    folder: Path = Path()
    dropped: tuple[str, ...] = ()
    lines: tuple[str, ...] = ()

    def wrong(self, line: int, what: str, kind: type[InputError] = InputError) -> InputError:
        """The error that something in a line of the source is."""
        return kind(f"{self.name}, line {line}: {what}")

    @property
    def paragraphs(self) -> Iterator[Paragraph]:
        """All paragraphs, headings and cells, in the order of the source."""
        return (block for block in blocks_in(self.blocks) if isinstance(block, Paragraph))

    @property
    def hands(self) -> tuple[str, ...]:
        """The names of the hands of its spans, "" for that of the letter."""
        named = dict.fromkeys(span.manner.hand for paragraph in self.paragraphs for span in paragraph.spans)
        return tuple(named)

    @property
    def text(self) -> str:
        """Its words."""
        return "\n".join("".join(span.text for span in paragraph.spans) for paragraph in self.paragraphs)

    @property
    def boxes(self) -> Mapping[str, PlaceOnPage]:
        """The places of its boxes."""
        return self.head.box


def blocks_in(blocks: tuple[Block, ...]) -> Iterator[Block]:
    """Some blocks and all blocks within them, in the order of the source."""
    for block in blocks:
        yield block
        if isinstance(block, List):
            for item in block.items:
                yield item.label
                yield from blocks_in(item.blocks)
        elif isinstance(block, TableBlock):
            for row in block.rows:
                yield from row
        elif isinstance(block, Quote | Boxed | Signature):
            yield from blocks_in(block.blocks)
