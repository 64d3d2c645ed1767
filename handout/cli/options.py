"""What the verbs have in common: the options, where the text comes from, and how pictures look."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from handout import encodings, units
from handout.cli import results
from handout.cli.console import Console
from handout.errors import InputError
from handout.inking.pen import PENS
from handout.pipeline.options import PictureOptions, SheetOptions, WritingOptions, slip_rate

if TYPE_CHECKING:
    from handout.inking.papers import Paper
    from handout.inking.pen import Pen

F = TypeVar("F", bound=Callable[..., Any])

_MOST_TEXT = 2_000_000  # bytes; a longer file is surely not meant to be written by hand

_WRITING = (
    click.option(
        "--hand",
        default="house-joined",
        show_default=True,
        help="A built-in hand, your own, or a .hand or .toml file or .svg font.",
    ),
    click.option("--seed", type=int, help="Same seed, same writing; without it every run differs."),
    click.option("--x-height", "x_height", help="Height of a small letter; default: 2.5mm, or a scanned hand's own."),
    click.option("--line-spacing", help="Distance of lines, e.g. 9mm; default: the hand's own."),
    click.option(
        "--align", type=click.Choice(["left", "right", "centre", "ragged"]), default="ragged", show_default=True
    ),
    click.option(
        "--kinematics",
        type=click.Choice(["optimal-control", "sigma-lognormal"]),
        default="optimal-control",
        show_default=True,
        help="How the strokes move.",
    ),
    click.option("--speed", default="human", show_default=True, help="human, fast, or a factor such as 1.5."),
    click.option(
        "--variation",
        "--jitter",
        "jitter",
        type=float,
        default=1.0,
        show_default=True,
        help="1 as people vary, 0 none.",
    ),
    click.option("--haste", type=float, default=0.0, show_default=True, help="-1 careful, 0 as drawn, 1 hurried."),
    click.option("--fit", is_flag=True, help="Shrink what does not fit instead of refusing it."),
    click.option(
        "--fallback", is_flag=True, help="Take similar forms for characters that the hand lacks, leave out emoji."
    ),
)
_SAYING = (
    click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output."),
    click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors."),
)
_RASTER = (
    click.option("--dpi", type=click.FloatRange(36, 2400), default=300.0, show_default=True, help="Of PNG files."),
    click.option(
        "--pen",
        help=f"What the ink looks like, in PNG files and prints: {', '.join(PENS)}, by default ballpoint. A scanned "
        "hand has its own; another .hand file lends it that of its pages.",
    ),
    click.option("--pen-width", help="Width of the line, in pictures; default: the pen's own, plain 0.3mm."),
    click.option(
        "--ink", help="Colour of the ink, in pictures: #rrggbb, or a name such as navy; default: the pen's own."
    ),
    click.option(
        "--paper",
        default="none",
        show_default=True,
        help="plain laid ruled squared (ruled:8mm; ruled:8mm,25mm: the first rule 25mm from the top), or a picture of "
        "a sheet: behind the ink in PNG files, and written on its lines in all.",
    ),
    click.option("--transparent", is_flag=True, help="PNG files without any paper."),
)


Option = Callable[[Callable[..., object]], Callable[..., object]]
Verb = Callable[..., object]


def bind(name: str, kind: Callable[..., object], *made: Option) -> Callable[[Verb], Verb]:
    """Options of click that a verb gets as one value, in its parameter `name`.

    Parameters
    ----------
    kind : a frozen dataclass, or what makes one of keywords; the click options are called like its fields.
    made : what `click.option` returned, in the order of the help text.
    """

    def decorate(verb: Verb) -> Verb:
        @wraps(verb)
        def bound(*arguments: object, **values: object) -> object:
            mine = {field: values.pop(field) for field in fields}
            return verb(*arguments, **{name: kind(**mine)}, **values)

        inner = len(vars(verb).get("__click_params__", ()))
        result: Verb = bound
        for option in reversed(made):
            result = option(result)
        fields = [str(parameter.name) for parameter in vars(result)["__click_params__"][inner:]]
        return result

    return decorate


def sheet(usual_page: str) -> Callable[[Verb], Verb]:
    """--page (usually that one), --margin and --pages, as `sheet`: SheetOptions."""
    return bind(
        "sheet",
        partial(SheetOptions, usual_page=usual_page),
        click.option("--page", "page", help=f"{_SIZES}  [default: {usual_page}]"),
        click.option("--margin", help=_SIDES),
        click.option("--pages", type=click.IntRange(1), help="How many pages there may be."),
    )


_SIZES = "A3 A4 A5 A6 letter DL C6 C5 number-10 or WxHmm."
_SIDES = "e.g. 15mm, or 20mm,15mm (vertical, horizontal), or four from the top clockwise."


def _all(options: Sequence[Callable[[F], F]]) -> Callable[[F], F]:
    def decorate(function: F) -> F:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


manner_options = _all(_WRITING)
writing_options = _all((*_WRITING, *_SAYING))


def _slips(_context: click.Context, _option: click.Parameter, text: str | None) -> float:
    """Slips in 100 words: nothing, a number, or the option alone."""
    return slip_rate(text)


slips_option = click.option(
    "--slips",
    is_flag=False,
    flag_value="usual",
    metavar="[RATE]",
    callback=_slips,
    help="Words in 100 begun wrongly, struck out and written again; without a number 2. Never in addresses.",
)


def sheet_options(default: str) -> Callable[[F], F]:
    """--page (of that default), --margin and --pages."""
    return _all(
        (
            click.option("--page", "page_name", default=default, show_default=True, help=_SIZES),
            click.option("--margin", help=_SIDES),
            click.option("--pages", type=click.IntRange(1), help="How many pages there may be."),
        )
    )


picture_options = _all(_RASTER)
manner = bind("writing", WritingOptions, *_WRITING)  # WritingOptions without slips, for other programs' commands
writing = bind("writing", WritingOptions, *_WRITING, slips_option)
picture = bind("picture", PictureOptions, *_RASTER)
console = bind("console", Console, *_SAYING)


def text_of(words: Sequence[str], file: str | None) -> str:
    """The text to write: the arguments, a file, or standard input for ``-``; one argument may be the name of a file.

    Raises
    ------
    InputError
        None or two of them given; a file that is missing, too long, or not text.
    """
    if file is not None and words:
        raise InputError("Both a text and --file are given; give one of them.")
    if file is None and not words:
        raise InputError('Nothing to write: give a text, --file letter.txt, or "-" to read standard input.')
    if file is None and len(words) == 1 and _is_file(words[0]):
        file = words[0]
    if file is None and list(words) != ["-"]:
        return " ".join(words)
    name = "standard input" if file in (None, "-") else str(file)
    try:
        data = sys.stdin.buffer.read(_MOST_TEXT + 1) if file in (None, "-") else Path(str(file)).read_bytes()
    except OSError as error:
        raise InputError(f"Cannot read {name}: {error.strerror or error}.") from error
    return decoded(data, name)


def _is_file(word: str) -> bool:
    """Whether a text is the name of a file; most texts could not even be one."""
    try:
        return Path(word).is_file()
    except (OSError, ValueError):
        return False


def decoded(data: bytes, name: str) -> str:
    """The text in some bytes, whatever its encoding (see `handout.encodings`), without empty lines at its end.

    A guess at the encoding is told on standard error.

    Raises
    ------
    InputError
        They are too many, or no text; `name` says where they come from.
    """
    if len(data) > _MOST_TEXT:
        raise InputError(f"{name} is longer than {_MOST_TEXT} bytes: write it in parts.")
    try:
        found = encodings.decode(data)
    except encodings.NoText as error:
        at = f" (line {error.line})" if error.line else ""
        raise InputError(f"{name} is not text{at}: {error}; save it as UTF-8.") from error
    if found.guessed:
        results.note(f"{name} is not UTF-8 and was read as {found.encoding}: check {found.example!r}.")
    return found.text.rstrip("\n")


def pen(given: Mapping[str, Any]) -> Pen:
    """The pen that pictures are drawn with, from `picture_options`."""
    from handout.inking.pen import usual

    width, name = given["pen_width"], given["pen"] or "ballpoint"
    if name not in PENS and (name.endswith(".hand") or _is_scanned(name)):
        return usual("ballpoint", colour=given["ink"])  # of strokes, which have no scanned ink
    if name not in PENS:
        raise InputError(f"pen: {name!r} is not one of {', '.join(PENS)}.")
    return usual(name, None if width is None else units.length(width, "pen width"), given["ink"])


def _is_scanned(name: str) -> bool:
    from handout.hand.library import scanned

    return name in scanned()


def paper(given: Mapping[str, Any]) -> Paper:
    """The paper that pictures show, from `picture_options`: a name, a name and the pitch of its lines, or a file."""
    from handout.inking.papers import PAPERS, Paper

    name, colon, pitch = given["paper"].partition(":")
    if colon and name in ("ruled", "squared"):
        pitch, comma, first = pitch.partition(",")
        if comma and name == "squared":
            raise InputError(f"paper: {given['paper']!r}: only ruled paper has a first rule; write squared:{pitch}.")
        top = units.length(first, "first rule of the paper") if comma else None
        return Paper(name, units.length(pitch, "distance of the paper's lines"), top)
    if given["paper"] not in PAPERS and not Path(given["paper"]).is_file():
        raise InputError(f"paper: {given['paper']!r} is neither a picture nor one of {', '.join(PAPERS)}.")
    return Paper(given["paper"])


def page_of(given: Mapping[str, Any]) -> str:
    """The page that is written on: that of --page, or else a scanned sheet's own size."""
    from handout.cli.lined import page_name

    source = click.get_current_context().get_parameter_source("page_name")
    return page_name(given, chosen=source is not None and source.name != "DEFAULT")


def look(given: Mapping[str, Any]) -> dict[str, Any]:
    """How pictures look, from `picture_options`: what `write_drawings` takes besides pages and paths.

    Raises
    ------
    InputError
        A pen, a colour or a paper that there is not, or both a paper and --transparent.
    """
    found = paper(given)
    if given["transparent"] and found.name != "none":
        raise InputError("--transparent leaves the paper out and --paper puts it in: give one of them.")
    return {"pen": pen(given), "dpi": given["dpi"], "paper": found, "transparent": given["transparent"]}
