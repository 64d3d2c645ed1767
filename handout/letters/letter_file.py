"""Letter files read: Markdown with a TOML head → `LetterFile`, or one sentence that names the line that is wrong.

Markdown is CommonMark with tables, struck words, attributes, containers and front matter (`markdown-it-py`,
`mdit-py-plugins`).  What pens do not write is refused, or, where words lose nothing by it, told as dropped.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import accumulate, zip_longest
from pathlib import Path
from typing import Any, Literal

from markdown_it import MarkdownIt
from markdown_it.rules_block import StateBlock
from markdown_it.rules_inline import StateInline
from markdown_it.token import Token
from markdown_it.tree import SyntaxTreeNode
from mdit_py_plugins.attrs import attrs_block_plugin, attrs_plugin
from mdit_py_plugins.attrs.parse import ParseError, parse
from mdit_py_plugins.container import container_plugin
from mdit_py_plugins.front_matter import front_matter_plugin

from handout import atomic, encodings, units
from handout.errors import InputError
from handout.hand.places import graphemes
from handout.inking.pen import colour_code
from handout.letters.document import (
    LEAST_SIZE,
    MOST_SIZE,
    Block,
    Boxed,
    DrawnRule,
    Item,
    LetterFile,
    LetterHead,
    List,
    Paragraph,
    PictureRoom,
    Quote,
    Side,
    Signature,
    SpanManner,
    TableBlock,
    TextSpan,
    Underline,
    blocks_in,
)
from handout.mathematics.parser import WrongFormula, find_end, find_formulas, read_formula
from handout.tables import convert_table, parse_table
from handout.writing.text import find_unseen, normalise

MOST_TEXT = 200_000  # characters: a hundred pages; a longer file is surely no letter
_MOST_NESTED = 12  # blocks within blocks; set by eye: each list stands further in than the one around it
_PARSED_NESTED = 60  # levels that the parser goes down: more than are allowed, so that none is lost unseen
_MOST_BRACKETS = (
    10_000  # opening ones, none of which may close: the parser takes their square in time, here about a second
)
_SIZES = (1.55, 1.3, 1.12, 1.0, 1.0, 1.0)  # of headings by their level; set by eye
_SIDES: dict[str, Side] = {"left": "left", "right": "right", "centre": "centre", "center": "centre"}
_UNDERLINES: dict[str, Underline] = {"wavy": "wavy", "double": "double", "straight": "straight"}
_USUAL_UNDERLINE: dict[str, Underline] = {"em": "straight", "strong": "double"}
_MARKERS: dict[str, Literal["dash", "dot", "ring", ".", ")"]] = {
    "-": "dash",
    "*": "dot",
    "+": "ring",
    ".": ".",
    ")": ")",
}
_RULES: dict[str, Literal["short", "wide", "flourish"]] = {"-": "short", "_": "wide", "*": "flourish"}
_CONTAINERS = ("date", "ps", "signature")  # besides boxes
# what no pen writes, and what to do instead
_REFUSED = {
    "fence": "a block of code, which is set in type: write it as a paragraph",
    "code_block": "a block of code (it is indented by four spaces), which is set in type: indent it less",
    "code_inline": "code between backquotes, which is set in type: leave them out, or write \\` for a backquote",
    "html_block": "HTML, which is not written by hand: use Markdown, or write \\< for the sign itself",
    "image": "a picture stands within words: give it a paragraph of its own",
    "html_inline": "HTML, which is not written by hand: use Markdown, or write \\< for the sign itself",
}
_BRACES = re.compile(r"(?<!\\)\{[^{}\n]*\}")
_BARE_VALUE = re.compile(r"(?<=[\s{])([A-Za-z][\w-]*)=([^\s\"'{}]+)(?=[\s}])")
_EMPHASIS = ("em", "strong", "s")
_KEYS = ("ink", "size", "hand")
BARE = re.compile(r"[\w-]{1,80}")  # a name that leads to no file
_BARE_PAPER = re.compile(r"(none|plain|laid|ruled|squared)(:[0-9.]+mm(,[0-9.]+mm)?)?")
_UNCLOSED = re.compile(r"\*\*|~~|\]\(")


def load(
    source: str | Path, name: str = "the letter", folder: Path | None = Path(), *, alone: bool = False
) -> LetterFile:
    """A letter, of the path of its file, or of its text.

    name : what messages call a text; folder : where the pictures of a text are looked for; None: it has none.
    alone : whether names that lead to files are refused, but for those of pictures in the folder.

    Raises InputError: a file that cannot be read, or what cannot be written: one sentence with the line.
    """
    if isinstance(source, Path):
        try:
            text = encodings.decode(source.read_bytes()).text
        except (OSError, encodings.NoText) as error:
            raise InputError(f"Cannot read {source}: {getattr(error, 'strerror', None) or error}.") from error
        return load(text, source.name, source.parent)
    if len(source) > MOST_TEXT:
        raise InputError(
            f"{name} is {len(source)} characters long; letters have {MOST_TEXT} at most: write it in parts."
        )
    letter = _LetterReader(name, folder, alone).letter(source)
    if alone:
        _check_alone(letter)
    return letter


def _check_alone(letter: LetterFile) -> None:
    """Refuse a letter that names what could be a file."""
    head = letter.head
    named = {"hand": head.hand, "pen": head.pen, "background": head.background}
    named |= {"first.background": head.first.background, "following.background": head.following.background}
    for key, name in named.items():
        if name and not BARE.fullmatch(name):
            raise letter.wrong(1, f"{key}: {name!r} is no bare name, and this letter stands alone, without files.")
    if head.paper and not _BARE_PAPER.fullmatch(head.paper):
        raise letter.wrong(1, f"paper: {head.paper!r} is none that is known by name, and this letter stands alone.")
    spans = (span for paragraph in letter.paragraphs for span in paragraph.spans)
    used = [(span.manner.hand, span.line) for span in spans]
    used += [(block.name, block.line) for block in blocks_in(letter.blocks) if isinstance(block, Signature)]
    for name, line in used:
        if name and not BARE.fullmatch(name):
            raise letter.wrong(line, f"{name!r} is no bare name, and this letter stands alone, without files.")


def _take_formula(state: StateInline, silent: bool) -> bool:
    """A formula within words, as a rule of the parser."""
    begin, displayed = state.pos, state.src.startswith("$$", state.pos)
    end = find_end(state.src, begin, displayed=displayed) if state.src[begin] == "$" else 0
    if end and not silent:
        state.push("formula", "", 0).content = state.src[begin:end]
    state.pos = end or begin
    return end > 0


def _take_displayed(state: StateBlock, first: int, last: int, silent: bool) -> bool:
    """A displayed formula with lines of its own, as a rule of the parser: nothing in it is Markdown."""
    source = ""
    for number in range(first, last):
        source += state.getLines(number, number + 1, state.blkIndent, True)
        if not source.lstrip().startswith("$$") or not source.strip():
            return False
        content = source.strip()
        end = find_end(content, 0, displayed=True)
        if end and content[end:].strip() in ("", ".", ",", ";"):
            if not silent:
                token = state.push("displayed", "", 0)
                token.content, token.map = content, [first, number + 1]
                state.line = number + 1
            return True
        if end:
            return False
    return False


@lru_cache(maxsize=1)
def _markdown() -> MarkdownIt:
    markdown = MarkdownIt("commonmark", {"html": True, "maxNesting": _PARSED_NESTED})
    # characters that are escaped stay apart, so that a brace that is meant is told from one that opens nothing
    markdown.enable(["table", "strikethrough"]).disable("text_join")
    front_matter_plugin(markdown)
    attrs_plugin(markdown, spans=True)
    attrs_block_plugin(markdown)
    container_plugin(markdown, "container", validate=lambda _name, *_: True)
    markdown.inline.ruler.before("escape", "formula", _take_formula)
    markdown.block.ruler.before("code", "displayed", _take_displayed, {"alt": ["paragraph", "blockquote", "list"]})
    return markdown


@dataclass
class _Given:
    """The attributes of a block or span, checked."""

    manner: SpanManner
    side: Side | None = None
    kind: str = ""
    new_page: bool = False
    width: float | None = None
    underline: Underline = ""


@dataclass
class _LetterReader:
    """Reads one letter.

    line : of the source that is being read; verse : whether every line of the source is a line of the letter.
    """

    name: str
    folder: Path | None
    alone: bool = False
    line: int = 1
    verse: bool = False
    boxes: frozenset[str] = frozenset()
    lines: Sequence[str] = ()
    dropped: list[str] = field(default_factory=list)

    def letter(self, text: str) -> LetterFile:
        text = text.replace("\r\n", "\n").replace("\r", "\n").removeprefix("\ufeff")
        text, head = self._with_dashes(text), LetterHead()
        self.lines = text.split("\n")
        environment: dict[str, Any] = {}
        if text.count("[") > _MOST_BRACKETS:
            raise InputError(f"{self.name} has more than {_MOST_BRACKETS} brackets [: no letter has.")
        # the parser of containers looks one character past a last line that ends in "> " and no newline
        # the values of attributes in quotes, which those with a # or a point in them need
        quoted, done = "", 0
        for begin, end, _ in (*find_formulas(text), (len(text), len(text), False)):
            quoted += _BRACES.sub(lambda braces: _BARE_VALUE.sub(r'\1="\2"', braces.group()), text[done:begin])
            quoted, done = quoted + text[begin:end], end
        tokens = _markdown().parse(quoted + "\n", environment)
        self._check_nesting(tokens)
        nodes = SyntaxTreeNode(tokens).children
        for label, reference in environment.get("references", {}).items():
            self.line = reference["map"][0] + 1 if "map" in reference else 1
            self._drop(f"the address of [{label.lower()}] is not written")
        if nodes and nodes[0].type == "front_matter":
            head, nodes = self._head(nodes[0].content), nodes[1:]
        elif self.lines[0].strip() == "---":
            raise self._wrong("the head that begins here is not closed: put a line --- behind it, or *** for a rule.")
        for number, line in enumerate(self.lines, 1):
            self.line = number
            if names := [each.letter for each in find_unseen(line)]:
                self._drop(f"what is invisible is not written: {', '.join(names)}")
        self.boxes = frozenset(head.box)
        blocks = self._blocks(nodes, SpanManner())
        if not any(map(_leaves_ink, blocks_in(blocks))):
            raise InputError(f"{self.name} holds nothing to write.")
        return LetterFile(blocks, head, self.name, self.folder or Path(), tuple(self.dropped), tuple(self.lines))

    def _check_nesting(self, tokens: Sequence[Token]) -> None:
        """Refuse words within more emphasis and links than anybody writes; of blocks `_blocks` does."""
        for block in tokens:
            for depth in accumulate(token.nesting for token in block.children or ()):
                if depth > _MOST_NESTED:
                    self.line = block.map[0] + 1 if block.map else self.line
                    raise self._wrong(f"words stand within more than {_MOST_NESTED} emphases or links: nest them less.")

    def _wrong(self, what: str) -> InputError:
        return InputError(f"{self.name}, line {self.line}: {what}")

    def _drop(self, what: str) -> None:
        self.dropped.append(f"{self.name}, line {self.line}: {what}.")

    def _with_dashes(self, text: str) -> str:
        """A head between lines of +++, as TOML often stands, is one between lines of ---."""
        first, _, rest = text.partition("\n")
        if first.strip() != "+++":
            return text
        head, closed, body = rest.partition("\n+++\n")
        if rest.startswith("+++\n"):
            head, closed, body = "", "\n+++\n", rest[4:]
            return f"---\n---\n{body}"
        if not closed:
            raise self._wrong("the head that begins here is not closed: put a line +++ behind it.")
        return f"---\n{head}\n---\n{body}"

    def _head(self, content: str) -> LetterHead:
        try:
            return convert_table(parse_table(content), LetterHead)
        except tomllib.TOMLDecodeError as error:
            at = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)", str(error))
            self.line = 1 + (int(at.group(1)) if at and at.group(1) else len(content.split("\n")))
            problem = str(error)[: at.start()] if at else str(error)
            raise self._wrong(f"the head is no TOML: {problem[0].lower()}{problem[1:]}.") from error
        except ValueError as error:
            key = re.split(r"[ :]", str(error), maxsplit=1)[0].split(".")[-1]
            names = re.compile(rf'\s*"?{re.escape(key)}"?\s*=|\s*\[.*\b{re.escape(key)}"?\]')
            at_line = next((n for n, line in enumerate(content.split("\n"), 2) if names.match(line)), 1)
            self.line = at_line
            problem = str(error).rstrip(".")
            raise self._wrong(f"{problem}{'' if problem.endswith('?') else '.'}") from error

    # Blocks

    def _blocks(self, nodes: Sequence[SyntaxTreeNode], manner: SpanManner, depth: int = 0) -> tuple[Block, ...]:
        blocks: list[Block] = []
        for node in nodes:
            if node.map:
                self.line = node.map[0] + 1
            if depth > _MOST_NESTED:
                raise self._wrong(f"blocks stand within more than {_MOST_NESTED} others: nest them less.")
            blocks += self._block(node, manner, depth)
        return tuple(blocks)

    def _block(self, node: SyntaxTreeNode, manner: SpanManner, depth: int) -> list[Block]:
        line = self.line
        if node.type == "html_block" and node.content.strip().startswith("<!--"):
            self._drop("the comment is not written")
            return []
        if node.type in _REFUSED:
            raise self._wrong(f"{_REFUSED[node.type]}.")
        match node.type:
            case "paragraph" if _is_picture(node):
                return [self._picture(node)]
            case "paragraph" | "heading":
                return [self._paragraph(node, manner)]
            case "displayed":
                return [Paragraph((TextSpan(self._formula(node.content).strip(), manner, line),), line, "centre")]
            case "bullet_list" | "ordered_list":
                return [self._list(node, manner, depth)]
            case "hr":
                given = self._read_attributes(_attrs(node), SpanManner(), ("page",), ("ink",))
                return [DrawnRule(_RULES[node.markup[0]], line, given.manner.ink, given.new_page)]
            case "table":
                return [self._table(node, manner)]
            case "blockquote":
                given = self._read_attributes(_attrs(node), manner, ("page",))
                return [Quote(self._blocks(node.children, given.manner, depth + 1), line, given.new_page)]
            case _:
                return self._container(node, manner, depth)

    def _paragraph(self, node: SyntaxTreeNode, manner: SpanManner) -> Paragraph:
        line, level = self.line, int(node.tag[1]) if node.type == "heading" else 0
        given = self._read_attributes(_attrs(node), manner, ("left", "right", "centre", "center", "page", "date", "ps"))
        manner = given.manner
        if level:
            manner = self._size_span(manner, _SIZES[level - 1])
        if given.kind == "date":
            return self._date_paragraph(Paragraph(self._spans(node, manner), line, given.side, new_page=given.new_page))
        kind: Literal["text", "postscript"] = "postscript" if given.kind == "ps" else "text"
        return Paragraph(self._spans(node, manner), line, given.side, level, kind, given.new_page)

    def _date_paragraph(self, paragraph: Paragraph) -> Paragraph:
        return replace(paragraph, kind="date", side=paragraph.side or "right")

    def _list(self, node: SyntaxTreeNode, manner: SpanManner, depth: int) -> List:
        line = self.line
        own = {name: value for name, value in _attrs(node).items() if name != "start"}
        given = self._read_attributes(own, manner, ("page",))
        first = int(node.attrs.get("start", 1)) if node.type == "ordered_list" else 0
        items = []
        for number, child in enumerate(node.children, first):
            self.line = child.map[0] + 1 if child.map else self.line
            at = self.line
            label = f"{number}{node.markup}" if node.type == "ordered_list" else ""
            spans = (TextSpan(label, given.manner, at),) if label else ()
            items.append(Item(self._blocks(child.children, given.manner, depth + 1), Paragraph(spans, at), at))
        inner = [block for item in node.children for block in item.children if block.type == "paragraph"]
        tight = all(block.hidden for block in inner)
        return List(tuple(items), _MARKERS[node.markup[0]], tight, line, given.manner, given.new_page)

    def _table(self, node: SyntaxTreeNode, manner: SpanManner) -> TableBlock:
        line = self.line
        given = self._read_attributes(_attrs(node), manner, ("page",))
        rows = []
        for part in node.children:
            for row in part.children:
                self.line = row.map[0] + 1 if row.map else self.line
                rows.append(tuple(self._cell(cell, given.manner) for cell in row.children))
        return TableBlock(tuple(rows), line, given.manner, given.new_page)

    def _cell(self, node: SyntaxTreeNode, manner: SpanManner) -> Paragraph:
        line = self.line
        side = _SIDES.get(str(node.attrs.get("style", "")).removeprefix("text-align:"))
        return Paragraph(self._spans(node, manner), line, side)

    def _picture(self, node: SyntaxTreeNode) -> PictureRoom:
        image = node.children[0].children[0]
        own = {name: value for name, value in _attrs(image).items() if name not in ("src", "alt", "title")}
        given = self._read_attributes(own, SpanManner(), ("left", "right", "centre", "center", "page"), ("width",))
        source = str(image.attrs["src"])
        path = (self.folder or Path()) / source
        if self.folder is None or (self.alone and not (atomic.PLAIN_NAME.fullmatch(source) and path.is_file())):
            raise self._wrong(f"this letter stands alone, and no picture {source!r} was sent with it.")
        if not path.is_file():
            raise self._wrong(f"there is no picture {path}.")
        more = self._read_attributes(
            _attrs(node), SpanManner(), ("left", "right", "centre", "center", "page"), ("width",)
        )
        side = given.side or more.side or "centre"
        return PictureRoom(path, self.line, given.width or more.width, side, given.new_page or more.new_page)

    def _container(self, node: SyntaxTreeNode, manner: SpanManner, depth: int) -> list[Block]:
        line, (kind, _, name) = self.line, node.info.strip().partition(" ")
        self._check_container(node, kind)
        places = (*_SIDES, "page") if kind == "signature" else ("page",)
        given = self._read_attributes(_attrs(node), manner, places)
        inner = given.manner if kind != "signature" else replace(given.manner, size=manner.size)
        before, self.verse = self.verse, True  # lines of the source are lines of the letter, as in an address
        blocks = self._blocks(node.children, inner, depth + 1)
        self.verse = before
        if kind == "signature":
            size = given.manner.size / manner.size
            side = given.side or "left"
            return [Signature(name.strip(), blocks, line, side, size, given.manner.ink, given.new_page)]
        if kind == "date":
            return [self._date_paragraph(block) if isinstance(block, Paragraph) else block for block in blocks]
        if kind == "ps":
            return [replace(b, kind="postscript") if isinstance(b, Paragraph) else b for b in blocks]
        if depth:
            raise self._wrong(f"the box {kind} stands on the page, not within another block: put it outside.")
        return [Boxed(kind, blocks, line, given.new_page)]

    def _check_container(self, node: SyntaxTreeNode, kind: str) -> None:
        if not node.map or node.map[1] >= len(self.lines) or not self.lines[node.map[1]].strip().startswith(":::"):
            raise self._wrong(f"the block ::: {kind} that begins here is not closed: put a line ::: behind it.")
        known = (*_CONTAINERS, *sorted(self.boxes))
        if kind not in known:
            raise self._wrong(
                f"::: {kind} names no box of the head, nor {', '.join(_CONTAINERS)}{_nearest_name(kind, known)}; a box "
                f"is a table [box.{kind or 'address'}] of the head with x, y, w and h."
            )

    # Spans

    def _spans(self, node: SyntaxTreeNode, manner: SpanManner) -> tuple[TextSpan, ...]:
        spans = [span for inline in node.children for span in self._inline(inline.children, manner)]
        return tuple(span for span in spans if span.text)

    def _inline(self, nodes: Sequence[SyntaxTreeNode], manner: SpanManner) -> Iterator[TextSpan]:
        before: SyntaxTreeNode | None = None
        for node, following in zip_longest(nodes, nodes[1:]):
            match node.type:
                case "text":
                    # attributes that this begins with are of the emphasis before it
                    begin = _leading_attributes(node)[0] if before is not None and before.type in _EMPHASIS else 0
                    yield TextSpan(self._check_text(node.content[begin:]).replace("$", "\\$"), manner, self.line)
                case "text_special":
                    yield TextSpan(node.content.replace("$", "\\$"), manner, self.line)
                case "formula":
                    yield TextSpan(self._formula(node.content), manner, self.line)
                    self.line += node.content.count("\n")
                case "softbreak" | "hardbreak":
                    hard = self.verse or node.type == "hardbreak"
                    yield TextSpan("\n" if hard else " ", manner, self.line)
                    self.line += 1
                case "em" | "strong" | "s" | "span":
                    attrs = _attrs(node) if node.type == "span" else _leading_attributes(following)[1]
                    yield from self._inline(node.children, self._emphasise_span(node.type, attrs, manner))
                case "link":
                    self._drop(f"the address of the link, {node.attrs.get('href', '')}, is not written")
                    yield from self._inline(node.children, manner)
                case "html_inline" if node.content.startswith("<!--"):
                    self._drop("the comment is not written")
                case _:
                    raise self._wrong(f"{_REFUSED.get(node.type, f'{node.type} cannot be written')}.")
            before = node

    def _formula(self, source: str) -> str:
        """A formula, and what stands right behind it, in one line; a displayed one in a line of its own."""
        units = graphemes(normalise(source))
        try:
            for begin, end, displayed in find_formulas(units):
                read_formula(units, begin, end, displayed)
        except WrongFormula as error:
            before = "".join(units[: error.at]).split("\n")
            self.line += len(before) - 1
            raise self._wrong(f"formula, character {len(before[-1]) + 1}: {error}.") from error
        line = source.replace("\n", " ")
        return f"\n{line}\n" if line.startswith("$$") else line

    def _check_text(self, text: str) -> str:
        """Text without signs that were meant to open something."""
        if "{{" in text or "{%" in text:
            raise self._wrong(
                "{{ … }} and {% … %} are filled in from a table; here there is none: write \\{ for a brace itself."
            )
        if "{" in text or "}" in text:
            raise self._wrong(
                "a brace belongs to no attributes: they stand, closed and as in {.right ink=#a00}, right behind "
                "[words] or emphasis, or in a line of their own before a block and behind an empty one; write \\{ for "
                "a brace itself."
            )
        if unclosed := _UNCLOSED.search(text):
            self._drop(f"{unclosed.group()} opens or closes nothing and is written as it stands")
        return text

    # Attributes

    def _emphasise_span(self, kind: str, attrs: Mapping[str, Any], manner: SpanManner) -> SpanManner:
        given = self._read_attributes(attrs, manner, tuple(_UNDERLINES))
        underline = given.underline or _USUAL_UNDERLINE.get(kind, "")
        return replace(given.manner, underline=underline or manner.underline, struck=given.manner.struck or kind == "s")

    def _read_attributes(
        self, attrs: Mapping[str, Any], manner: SpanManner, classes: Sequence[str], keys: Sequence[str] = _KEYS
    ) -> _Given:
        """What attributes say, of those that may stand here."""
        given = _Given(manner)
        for key, value in attrs.items():
            if key == "class":
                for name in str(value).split():
                    self._class(name, given, classes)
            elif key not in keys:
                raise self._wrong(
                    f"the attribute {key} says nothing here{_nearest_name(key, keys)}; {_list_names(keys)} may stand."
                )
            else:
                self._value(key, str(value), given)
        return given

    def _class(self, name: str, given: _Given, classes: Sequence[str]) -> None:
        if name not in classes:
            some = [f".{each}" for each in classes if each != "center"]
            raise self._wrong(
                f".{name} says nothing here{_nearest_name(name, classes)}; {_list_names(some)} may stand."
            )
        if name in _SIDES:
            given.side = _SIDES[name]
        elif name in _UNDERLINES:
            given.underline = _UNDERLINES[name]
        elif name == "page":
            given.new_page = True
        else:
            given.kind = name

    def _value(self, key: str, value: str, given: _Given) -> None:
        factor = 1.0
        try:
            if key == "size":
                factor = float(value)
            elif key == "ink":
                digits = colour_code(value).removeprefix("#").lower()
                digits = digits if len(digits) == 6 else "".join(2 * digit for digit in digits)
                given.manner = replace(given.manner, ink=f"#{digits}")
            elif key == "hand":
                given.manner = replace(given.manner, hand=value)
            else:
                given.width = units.length(value, key)
        except ValueError as error:
            raise self._wrong(f"size={value} is no number, such as 1.3.") from error
        except InputError as error:
            raise self._wrong(str(error)) from error
        given.manner = self._size_span(given.manner, factor)

    def _size_span(self, manner: SpanManner, factor: float) -> SpanManner:
        size = manner.size * factor
        if not LEAST_SIZE <= size <= MOST_SIZE:  # nan, too
            raise self._wrong(f"size: letters {size:g} times as large are outside {LEAST_SIZE:g} to {MOST_SIZE:g}.")
        return replace(manner, size=size)


def _leaves_ink(block: Block) -> bool:
    """Whether a block is written or drawn even if those within it are empty; lists have their markers."""
    if isinstance(block, Paragraph):
        return any(span.text.strip() for span in block.spans)
    return isinstance(block, List | PictureRoom | DrawnRule) or (isinstance(block, Signature) and bool(block.name))


def _is_picture(node: SyntaxTreeNode) -> bool:
    """Whether a paragraph is nothing but a picture."""
    inline = node.children[0].children if node.children else []
    return len(inline) == 1 and inline[0].type == "image"


def _attrs(node: SyntaxTreeNode) -> dict[str, Any]:
    """All attributes of a node, those that the parser would keep from browsers too."""
    return {**node.attrs, **node.meta.get("insecure_attrs", {})}


def _leading_attributes(node: SyntaxTreeNode | None) -> tuple[int, Mapping[str, Any]]:
    """The attributes that a text begins with, and how long they are."""
    if node is None or node.type != "text" or not node.content.startswith("{"):
        return 0, {}
    try:
        end, attrs = parse(node.content)
    except ParseError:
        return 0, {}
    return end + 1, attrs


def _nearest_name(name: str, known: Sequence[str]) -> str:
    similar = difflib.get_close_matches(name, known, 1)
    return f" (did you mean {similar[0]}?)" if similar else ""


def _list_names(names: Sequence[str]) -> str:
    return ", ".join(names) if names else "none"
