"""Letters with gaps that a table fills: Jinja templates, of which only what a letter needs is allowed.

A gap is ``{{ first_name }}``, ``{{ gift|default("present") }}`` or ``{{ birthday|date }}``; ``{% if gift %}`` …
``{% else %}`` … ``{% endif %}``, ``{% for %}`` and ``{% set %}`` do what they do in Jinja.  Nothing can be called, no
attribute be looked up, and loops, texts and numbers are bounded, so that a letter from anywhere may be filled.  What
stands in a cell is never a template, and in Markdown never Markdown: it is written as it was typed, within a formula
numbers and single letters as parts of it, all else as words.
"""

from __future__ import annotations

import difflib
import operator
import re
import string
from collections.abc import Callable, Collection, Iterator, Mapping
from datetime import date, datetime
from functools import partial
from itertools import accumulate, zip_longest
from typing import Any

from jinja2 import StrictUndefined, TemplateError, TemplateSyntaxError, Undefined, UndefinedError, nodes, pass_context
from jinja2.sandbox import SandboxedEnvironment
from jinja2.visitor import NodeTransformer

from handout.errors import InputError
from handout.mathematics.parser import find_formulas

# all set by eye, far above what a letter by hand needs
_MOST_SOURCE = 200_000  # characters of a letter
_MOST_TEXT = 200_000  # characters of a filled letter
_MOST_CELL = 20_000  # characters of a cell, and of whatever is put together in a letter
_MOST_TURNS = 5_000  # turns of all loops of a row together
_MOST_NUMBER = 10**15
# names that no column has: what counts the turns of loops, and the language of the row
_COUNTED, _LANGUAGE = "_counted", "_language"
_ALLOWED = (
    *(nodes.Template, nodes.Output, nodes.TemplateData, nodes.Const, nodes.Name, nodes.If, nodes.For, nodes.Assign),
    *(nodes.Filter, nodes.Test, nodes.CondExpr, nodes.Compare, nodes.Operand, nodes.And, nodes.Or, nodes.Not),
    *(nodes.Neg, nodes.Add, nodes.Sub, nodes.Mul, nodes.Div, nodes.FloorDiv, nodes.Mod, nodes.Tuple, nodes.List),
    *(nodes.Getitem, nodes.Getattr, nodes.Slice, nodes.Keyword),
)
_LOOP = ("first", "last", "index", "length")  # what a letter may ask of a loop
_SUMS: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "//": operator.floordiv,
    "%": operator.mod,
}
_MARKS = {ord(mark): f"\\{mark}" for mark in string.punctuation}
_BEGIN, _END = "\ufdd0", "\ufdd1"  # around what fills a gap until all is there: characters that no text has
_CELL = re.compile(f"{_BEGIN}([^{_END}]*){_END}")
_OPEN, _SHUT = "\ufdd2", "\ufdd3"  # around a line that ends in a tag, which is left out if nothing is written in it
_EMPTY_LINE = re.compile(f"{_OPEN}[ \t{_BEGIN}{_END}]*{_SHUT}\n?")
_TAGS_ALONE = re.compile(r"\s*(\{(%|##)((?!\2\}).)*\2\}\s*)+")
_LAST_TAG = re.compile(r"(\{(%|##)((?!\2\}).)*)(?<![+-])\2\}$")
_QUANTITY = re.compile(r"[-+–−]?[\d.,]+|\w")  # what a formula takes as it is; anything else is words in it
_ISO = re.compile(r"(?P<y>\d{4})-(?P<m>\d\d?)-(?P<d>\d\d?)\Z")
_DOTTED = re.compile(r"(?P<d>\d\d?)\.\s?(?P<m>\d\d?)\.\s?(?P<y>\d{4})\Z")
_SLASHED = re.compile(r"(?P<a>\d\d?)/(?P<b>\d\d?)/(?P<y>\d{4})\Z")
_MOST_FORMAT = 40  # characters of the form of a date
# letters at which a name written in one case gets a capital: at its start, after a space, a hyphen, an apostrophe
_NAME_STARTS = re.compile(r"(?<![^\W\d_])(?<![^\W\d_]['’](?=\w\b))[^\W\d_]")


class LetterTemplate:
    """A letter as a template, read once and filled for every row.

    names : every name that it uses and the line on which it is first used; a header, asked for as ``row["…"]``, is
        there as it is.

    Raises InputError: it is no template, or has in it what a letter may not have; the message names the line.
    """

    def __init__(self, text: str, title: str, *, markdown: bool = False, first_line: int = 1) -> None:
        """`title` and `first_line` are for messages: what the letter is called, and where its text begins."""
        self.title, self._before, self._markdown, self._text = title, first_line - 1, markdown, text
        self.names: dict[str, int] = {}
        self._headers: set[str] = set()
        if len(text) > _MOST_SOURCE:
            raise InputError(f"{title} has {len(text)} characters, more than {_MOST_SOURCE}: no letter is as long.")
        self._turns = 0
        try:
            environment = self._environment()
            tree = environment.parse(text)
            self._check(tree)
            counted = _Counted().visit(tree)
            self._template = environment.from_string(counted)
        except TemplateSyntaxError as error:
            raise InputError(f"{title}, {self._line(error.lineno)}: {_plain_words(error)}.") from error
        except (RecursionError, SyntaxError, MemoryError, ValueError) as error:
            raise InputError(f"{title} is nested too deeply to be read as a letter: write it more simply.") from error

    def __reduce__(self) -> tuple[Callable[..., LetterTemplate], tuple[str, str]]:
        return partial(LetterTemplate, markdown=self._markdown, first_line=self._before + 1), (self._text, self.title)

    def wrong(self, name: str, what: str) -> InputError:
        """The error that something is with a name that the letter uses, with the line where it does first."""
        return InputError(f"{self.title}, {self._line(self.names[name])}: {what}.")

    def check(self, columns: Collection[str], headers: Collection[str], table: str) -> None:
        """Refuse names that no column has. Raises InputError: there is one; the message names the nearest."""
        for name in self.names:
            among = headers if name in self._headers else columns
            if name not in among:
                near = difflib.get_close_matches(name, among, 1, 0.6)
                hint = f" (did you mean {near[0]}?)" if near else ""
                has = ", ".join(among) or "none"
                raise self.wrong(name, f"{table} has no column {name!r}{hint}; it has {has}")

    def fill(self, values: Mapping[str, str], row: Mapping[str, str], language: str = "en") -> str:
        """The letter of one row.

        values : name → cell; row : header → cell.
        language : of the row, for dates.

        Raises InputError: a cell that is empty or too long, a loop without an end …; the message names the line.
        """
        for name, value in {**row, **values}.items():
            if len(value) > _MOST_CELL:
                raise InputError(f"the cell under {name!r} has {len(value)} characters, more than {_MOST_CELL}.")
        self._turns = 0
        cells = {name: value or _Empty(name) for name, value in values.items()}
        by_header = {name: value or _Empty(name) for name, value in row.items()}
        pieces, size = [], 0
        try:
            own = {"row": by_header, _LANGUAGE: language, _COUNTED: self._count_turns}
            for piece in self._template.generate(cells | own):
                pieces.append(piece)
                size += len(piece)
                if size > _MOST_TEXT:
                    raise _Refused(f"the letter grows beyond {_MOST_TEXT} characters")
        except (TemplateError, ArithmeticError, TypeError, ValueError, RecursionError, _Refused) as error:
            line, trace = 1, error.__traceback__  # the line of the letter at which it failed
            while trace is not None:
                if trace.tb_frame.f_code.co_filename in ("<template>", "<unknown>"):
                    line = trace.tb_lineno
                trace = trace.tb_next
            raise InputError(f"{self.title}, {self._line(line)}: {_plain_words(error)}.") from error
        text = _EMPTY_LINE.sub("", "".join(pieces))
        return self._place_cells(text.replace(_OPEN, "").replace(_SHUT, ""))

    def _environment(self) -> SandboxedEnvironment:
        environment = _Environment(
            undefined=StrictUndefined,
            finalize=self._write_gap,
            autoescape=False,
            optimized=False,
            trim_blocks=True,
            lstrip_blocks=True,
            keep_trailing_newline=True,
            comment_start_string="{##",
            comment_end_string="##}",
        )
        environment.filters = dict(_FILTERS)
        environment.tests = {name: environment.tests[name] for name in ("defined", "undefined")}
        environment.globals = {}
        return environment

    def _write_gap(self, value: object) -> str:
        """What a gap becomes on paper."""
        if isinstance(value, _Empty):
            value.refuse()
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise _Refused(f"a gap would be filled with {_kind(value)}, which cannot be written")
        text = f"{value:g}" if isinstance(value, float) else str(value)
        return _BEGIN + text.replace(_BEGIN, "").replace(_END, "") + _END

    def _place_cells(self, text: str) -> str:
        """The letter with what fills its gaps, so that it is read as it was typed where it stands."""
        parts = _CELL.split(text.replace(_BEGIN + _END, ""))
        shown = [part.replace("\\", ".").replace("$", "\\$") for part in parts[1::2]]
        shown = [part for pair in zip_longest(parts[::2], shown, fillvalue="") for part in pair][: len(parts)]
        formulas = list(find_formulas("".join(shown)))
        starts = list(accumulate(map(len, shown), initial=0))
        for number in range(1, len(parts), 2):
            cell, at = parts[number], starts[number]
            if any(begin < at < end for begin, end, _ in formulas):
                words = re.sub(r"([{}$\\])", r"\\\1", cell)
                parts[number] = cell if _QUANTITY.fullmatch(cell) else f"\\text{{{words}}}"
            else:
                parts[number] = escape_markdown(cell) if self._markdown else cell.replace("$", "\\$")
        return "".join(parts)

    def _count_turns(self, items: object) -> Iterator[object]:
        """The items of a loop, counted, for all loops of a row may turn only so often."""
        if isinstance(items, _Empty):
            items.refuse()
        if not isinstance(items, (list, tuple, str)):
            raise _Refused(f"a loop goes over {_kind(items)}; it can go over a list such as [1, 2, 3]")
        for item in items:
            self._turns += 1
            if self._turns > _MOST_TURNS:
                raise _Refused(f"its loops turn more than {_MOST_TURNS} times")
            yield item

    def _check(self, tree: nodes.Node) -> None:
        """Refuse what a letter may not have, and note the names that it uses."""
        own = {str(name.name) for name in tree.find_all(nodes.Name) if name.ctx != "load"}
        waiting = [tree]
        while waiting:  # without recursion: a letter may be nested as deeply as it likes
            node = waiting.pop()
            waiting += reversed(list(node.iter_child_nodes()))
            problem = _problem(node)
            if problem:
                raise TemplateSyntaxError(problem, node.lineno)
            if isinstance(node, nodes.Getitem) and isinstance(node.node, nodes.Name) and node.node.name == "row":
                header = str(getattr(node.arg, "value", ""))
                self.names.setdefault(header, node.lineno)
                self._headers.add(header)
            elif isinstance(node, nodes.Name) and node.ctx == "load" and node.name not in (*own, "row", "loop"):
                self.names.setdefault(node.name, node.lineno)

    def _line(self, number: int) -> str:
        return f"line {self._before + number}"


class _Refused(Exception):
    """What a letter asks for goes too far."""


class _Empty(Undefined):
    """An empty cell: false in a condition, and an error where it would be written without a default."""

    def __init__(self, name: str) -> None:
        super().__init__(name=name)

    @property
    def _undefined_message(self) -> str:
        name = self._undefined_name
        return f'{name!r} is empty: fill it in, or write {{{{ {name}|default("…") }}}} or {{% if {name} %}}'

    def refuse(self) -> None:
        """Raise what its use is."""
        raise UndefinedError(self._undefined_message)

    def __eq__(self, other: object) -> bool:
        return other == "" or isinstance(other, _Empty)

    def __hash__(self) -> int:
        return hash("")


class _Environment(SandboxedEnvironment):
    """A sandbox in which numbers and texts stay small."""

    intercepted_binops = frozenset(_SUMS)

    def parse(self, source: str, name: str | None = None, filename: str | None = None) -> nodes.Template:
        """See there; behind its last tag a line keeps its break, unless tags stand alone in it."""
        lines = source.split("\n")
        for number, line in enumerate(lines):
            if _LAST_TAG.search(line) and not _TAGS_ALONE.fullmatch(line):
                lines[number] = _OPEN + _LAST_TAG.sub(r"\1+\2}", line) + _SHUT
        return super().parse("\n".join(lines), name, filename)

    def call_binop(self, context: Any, operator: str, left: Any, right: Any) -> Any:
        """A sum of numbers, or two texts put together."""
        for side in (left, right):
            if isinstance(side, _Empty):
                side.refuse()
        texts = isinstance(left, str) and isinstance(right, str) and operator == "+"
        if not texts and not all(isinstance(side, (int, float)) for side in (left, right)):
            raise _Refused(
                f"{_kind(left)} {operator} {_kind(right)} cannot be worked out; |int makes a number of a text"
            )
        result = _SUMS[operator](left, right)
        if texts and len(result) > _MOST_CELL:
            raise _Refused(f"a text grows beyond {_MOST_CELL} characters")
        if texts:
            return result
        if abs(result) > _MOST_NUMBER:
            raise _Refused("a number grows too large")
        return result


class _Counted(NodeTransformer):
    """Has the turns of every loop counted."""

    def visit_For(self, node: nodes.For) -> nodes.Node:
        self.generic_visit(node)
        node.iter = nodes.Call(nodes.Name(_COUNTED, "load"), [node.iter], [], None, None, lineno=node.lineno)
        return node


def _problem(node: nodes.Node) -> str:
    """Why a node may not be in a letter; "" if it may."""
    if isinstance(node, nodes.Call):
        return "nothing can be called in a letter; of a text write |upper, |title, |trim …"
    if not isinstance(node, _ALLOWED):
        return f"a letter has gaps, if, for and set, and no {type(node).__name__.lower()}"
    if isinstance(node, nodes.Name) and node.name.startswith("_"):
        return f"{node.name} is no name of a column"
    if isinstance(node, nodes.Getattr) and not (
        isinstance(node.node, nodes.Name) and node.node.name == "loop" and node.attr in _LOOP
    ):
        names = '{{ first_name }} or {{ row["First name"] }}'
        return f".{node.attr} cannot be looked up; a column is named as it is, {names}"
    if isinstance(node, nodes.For) and node.recursive:
        return "a loop in a letter cannot be recursive"
    if isinstance(node, nodes.Filter) and node.name not in _FILTERS:
        return f"there is no filter {node.name!r}; there are {', '.join(sorted(_FILTERS))}"
    return ""


def escape_markdown(text: str) -> str:
    """A text as it stands in Markdown that is to show it as it was typed."""
    return "\\\n".join(line.strip().translate(_MARKS) for line in text.split("\n"))


def _kind(value: object) -> str:
    if isinstance(value, str):
        return "a text"
    if isinstance(value, (bool, int, float)):
        return "a number"
    return "a list" if isinstance(value, (list, tuple)) else "nothing"


def _text(value: object) -> str:
    """What a filter gets, as a text."""
    if isinstance(value, _Empty):
        value.refuse()
    if isinstance(value, Undefined) or not isinstance(value, (str, int, float)):
        raise _Refused(f"a filter gets {_kind(value)} where it needs a text")
    return str(value)


def _default(value: object, instead: object = "", _falsy: bool = False) -> object:
    return instead if isinstance(value, Undefined) else value


def _replace_text(value: object, old: str, new: str) -> str:
    text = _text(value)
    if len(text) + text.count(str(old)) * len(str(new)) > _MOST_CELL:
        raise _Refused(f"a text grows beyond {_MOST_CELL} characters")
    return text.replace(str(old), str(new))


def title_name(value: object) -> str:
    """A name that was typed in one case, with capitals: "ANNA O'BRIEN-SMITH" → "Anna O'Brien-Smith".

    A name that has both cases is left alone: "van der Berg" and "McDonald" are right as they are.
    """
    text = _text(value)
    if text != text.lower() and text != text.upper():
        return text
    return _NAME_STARTS.sub(lambda letter: letter.group().upper(), text.lower())


@pass_context
def _date(context: Any, value: object, form: str = "long", language: str = "") -> str:
    """A date in words: 2026-03-01, 1.3.2026 or 1/3/2026 → "1 March 2026", in the row's language or another.

    language : a code such as de or en-GB.
    form : long, full, medium, short, or a pattern of the Unicode CLDR such as ``d. MMMM``.
    """
    import babel
    import babel.dates

    text, language = _text(value).removesuffix(" 00:00:00"), language or str(context.get(_LANGUAGE, "en"))
    try:
        locale = babel.Locale.parse(language.replace("-", "_"))
    except (ValueError, babel.UnknownLocaleError) as error:
        raise _Refused(f"the language {language!r} is no code such as de or en-GB") from error
    if len(form) > _MOST_FORMAT:
        raise _Refused(f"the form of a date has more than {_MOST_FORMAT} characters")
    return babel.dates.format_date(_parse_date(text, language), form, locale)


def _parse_date(text: str, language: str) -> date:
    match = _ISO.match(text) or _DOTTED.match(text)
    parts = {name: int(number) for name, number in match.groupdict().items()} if match else {}
    if not match and (match := _SLASHED.match(text)):
        a, b = int(match.group("a")), int(match.group("b"))
        american = language.replace("-", "_").lower() in ("en_us", "en_ca")
        if language == "en" and a <= 12 and b <= 12 and a != b:
            raise _Refused(f"{text!r} is one date in Britain and another in America: write it as 2026-03-01")
        american = american or (language == "en" and b > 12)
        parts = {"y": int(match.group("y")), "m": a if american else b, "d": b if american else a}
    try:
        return datetime(parts["y"], parts["m"], parts["d"]).date()
    except (KeyError, ValueError) as error:
        raise _Refused(f"{text!r} is no date such as 2026-03-01") from error


def _number(value: object) -> int:
    text = _text(value).replace(" ", "").replace("\u00a0", "")
    if not re.fullmatch(r"-?\d{1,15}", text):
        raise _Refused(f"{text[:40]!r} is no whole number")
    return int(text)


_FILTERS: dict[str, Callable[..., object]] = {
    "date": _date,
    "default": _default,
    "int": _number,
    "lower": lambda value: _text(value).lower(),
    "replace": _replace_text,
    "title": title_name,
    "trim": lambda value: _text(value).strip(),
    "upper": lambda value: _text(value).upper(),
}


def _plain_words(error: BaseException) -> str:
    """What is wrong, as a clause without a full stop."""
    if isinstance(error, ZeroDivisionError):
        return "something is divided by zero"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, TypeError):
        return "a text is taken for a number, or the other way round; |int makes a number of a text"
    words = (error.message or "") if isinstance(error, TemplateSyntaxError) else str(error)
    if words.lower().startswith("unexpected end of template"):
        return "what is opened here, {{ or {% if %} or {% for %}, is never closed"
    return " ".join(words.split()).rstrip(".")
