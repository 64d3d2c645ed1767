"""What the verbs have in common: the options, where the text comes from, and how pictures look."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial, wraps
from typing import TYPE_CHECKING, Any, TypeVar

import click

from handout import page_sizes
from handout.cli import results
from handout.cli.console import Console
from handout.pipeline.options import PENS, PictureOptions, SheetOptions, WritingOptions, slip_rate

if TYPE_CHECKING:
    from handout.inking.pen import Pen

F = TypeVar("F", bound=Callable[..., Any])

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
            mine = {field: values.pop(field) for field in names}
            return verb(*arguments, **{name: kind(**mine)}, **values)

        inner = len(vars(verb).get("__click_params__", ()))
        result: Verb = bound
        for option in reversed(made):
            result = option(result)
        names = [str(parameter.name) for parameter in vars(result)["__click_params__"][inner:]]
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


_SIZES = page_sizes.HELP
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
    """As `pipeline.inputs.text_of`."""
    from handout.pipeline import inputs

    return inputs.text_of(words, file, results.Telling())


def decoded(data: bytes, name: str) -> str:
    """As `pipeline.inputs.decoded`."""
    from handout.pipeline import inputs

    return inputs.decoded(data, name, results.Telling())


def pictured(given: Mapping[str, Any]) -> PictureOptions:
    """The picture options among some others."""
    return PictureOptions(**{field.name: given[field.name] for field in fields(PictureOptions) if field.name in given})


def pen(given: Mapping[str, Any]) -> Pen:
    """As `pipeline.pictures.pen`."""
    from handout.pipeline import pictures

    return pictures.pen(pictured(given))


def page_of(given: Mapping[str, Any]) -> str:
    """As `pipeline.lined_paper.page_name`."""
    from handout.pipeline.lined_paper import page_name

    source = click.get_current_context().get_parameter_source("page_name")
    chosen = source is not None and source.name != "DEFAULT"
    name = given["page_name"]
    return page_name(SheetOptions(name if chosen else None, usual_page=name), pictured(given))


def look(given: Mapping[str, Any]) -> dict[str, Any]:
    """As `pipeline.pictures.look`, as keywords of `sinks.Look`."""
    from handout.pipeline import pictures

    return dict(vars(pictures.look(pictured(given))))
