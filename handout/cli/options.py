"""Options of click that verbs share, and how a verb gets them as one value; see `pipeline.options`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import partial, wraps
from pathlib import Path

import click
from click.core import ParameterSource

from handout import page_sizes
from handout.cli import commands, configuration
from handout.cli.commands import under
from handout.cli.configuration import Option, Verb
from handout.cli.configuration import shared as shared
from handout.cli.console import Console
from handout.pipeline.options import (
    ALIGNMENTS,
    ENGINES,
    LAYERS,
    PENS,
    POSE_METHODS,
    MergeOptions,
    PictureOptions,
    PoseOptions,
    SheetOptions,
    StyleOptions,
    TableOptions,
    WritingOptions,
    slip_rate,
)
from handout.pipeline.plot_request import HookOptions

SIDES = "e.g. 15mm, or 20mm,15mm (vertical, horizontal), or four from the top clockwise."

_POSE = "Hold the pen as a pose library suggests: one that comes with the program, or a .pose file."
_METHOD = "How the pose is put together of the library's strokes."
_STYLE = "fast-tag, calm, blackletter, chancery, scrawl, learned, one of your own, or a .toml or .style file."
_MANNER = (
    shared("--prime", help="Of a learned style: the example that primes it, by its name, or a drawing's file."),
    shared("--temperature", type=float, help="Of a learned style: how much chance; 1 as in its examples."),
)
_HELD = (
    shared("--pose", help=_POSE),
    shared("--pose-method", type=click.Choice(POSE_METHODS), default=POSE_METHODS[0], show_default=True, help=_METHOD),
)
_HAND = under(
    commands.HAND,
    shared(
        "--hand",
        default="house-joined",
        show_default=True,
        help="A built-in hand, your own, or a .hand or .toml file or .svg font.",
    ),
    shared("--seed", type=int, help="Same seed, same writing; without it every run differs."),
    shared("--speed", default="human", show_default=True, help="human, fast, or a factor such as 1.5."),
    shared(
        "--variation",
        "--jitter",
        "jitter",
        type=float,
        default=1.0,
        show_default=True,
        help="1 as people vary, 0 none.",
    ),
    shared("--haste", type=float, default=0.0, show_default=True, help="-1 careful, 0 as drawn, 1 hurried."),
    shared(
        "--kinematics",
        type=click.Choice(ENGINES),
        default=ENGINES[0],
        show_default=True,
        help="How the strokes move.",
    ),
    shared("--fallback", is_flag=True, help="Take similar forms for characters that the hand lacks, leave out emoji."),
    shared("--strict", is_flag=True, help="Refuse a text of which a word, as written, reads as another."),
)
_LINES = under(
    commands.PAGE,
    shared("--x-height", "x_height", help="Height of a small letter; default: 2.5mm, or a scanned hand's own."),
    shared("--line-spacing", help="Distance of lines, e.g. 9mm; default: the hand's own."),
    shared(
        "--align",
        type=click.Choice(ALIGNMENTS),
        default="ragged",
        show_default=True,
        help="Of lines; ragged begins them on the left, not quite straight.",
    ),
    shared("--fit", is_flag=True, help="Shrink what does not fit instead of refusing it."),
)
_STYLED = under(
    commands.STYLE,
    shared("--style", help=f"Move through what is written in a handstyle: {_STYLE}"),
    *_MANNER,
    *_HELD,
)
_CONSOLE = under(
    commands.GENERAL,
    click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output."),
    click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors."),
)


ROWS = under(
    commands.TABLE,
    click.option("--rows", default="", help="Rows by their numbers in the file, the header is 1: 3-7,9 or 7-."),
    click.option(
        "--columns",
        multiple=True,
        metavar="WHAT=COLUMN",
        help='What columns hold: "name=Guest(s)" or "1=name"; also of a row its own hand, pen, language, copies, '
        "or its text.",
    ),
    click.option("--address", default="", help="Of several addresses of a row: home, business, 2 …"),
    click.option("--no-name", is_flag=True, help="Take a table that has no names."),
)
AFRESH = under(
    commands.TABLE,
    click.option("--afresh", is_flag=True, help="Make all of it, though an earlier run of it broke off."),
)
AGAIN = under(
    commands.TABLE,
    click.option("--again", default="", metavar="ROWS", help="With --resume: make these whatever became of them."),
)
WORKERS = under(
    commands.TABLE,
    shared("--jobs", type=click.IntRange(1), default=1, show_default=True, help="Processes that make pages."),
    shared("--cluster", default="", metavar="ADDRESS", help="Of a Dask scheduler: its workers make the pages."),
)
LETTERS = under(
    commands.TABLE,
    click.option(
        "--letter",
        type=click.Path(path_type=Path),
        help="A letter with gaps, {{ first_name }}, that every row of the table fills.",
    ),
    shared("--language", default="en", show_default=True, help="Of dates in letters: de, fr, en-GB …"),
    shared("--tick", is_flag=True, help="The row's number, small, on letter and envelope."),
    click.option("--approved", type=click.Path(path_type=Path), help="A proof's .json: refuse what differs from it."),
    shared("--skip-bad", is_flag=True, help="Make the rows that can be made, though others cannot."),
    shared("--once", is_flag=True, help="Of rows that are the same, make only the first."),
)
ENVELOPES = under(
    commands.ENVELOPES,
    click.option("--with-envelopes", is_flag=True, help="An envelope for every letter."),
    shared("--envelope", default="DL", show_default=True, help="The size of these envelopes."),
    shared("--return-address", default="", help="The sender on envelopes: a text, or its file."),
    shared(
        "--return-at",
        type=click.Choice(["corner", "back"]),
        default="corner",
        show_default=True,
        help="Where the sender stands: in the corner of the front, or on the back.",
    ),
    shared("--home-country", default="", help="The country that is left out of addresses."),
    shared("--window", default="", help="Address on the letter, for a window: DL, C5, #10, CH, CH-left or FR."),
)


def batch(**values: object) -> tuple[TableOptions, MergeOptions]:
    """The options of a table and of its letters, as a verb gets them."""
    names = {field.name for field in fields(TableOptions)}
    kinds: tuple[Callable[..., TableOptions], Callable[..., MergeOptions]] = TableOptions, MergeOptions
    own = {name: values.pop(name) for name in names & values.keys()}
    return kinds[0](**own), kinds[1](**values)


_STEPS = "go X Y; go NAME; down [VALUE]; up; wait TIME; send LINE"
_HOOKS = under(
    commands.HOOKS,
    click.option("--dip", metavar="STEPS", help=f"Ink for the pen, before it writes and on the way: {_STEPS}."),
    click.option("--dip-every", metavar="LENGTH", help="Ink between two dips at most, e.g. 150mm."),
    click.option("--before-page", metavar="STEPS", help="What the machine does before every page, in such steps."),
    click.option("--after-page", metavar="STEPS", help="And after it."),
    click.option("--before-stroke", metavar="STEPS", help="Before every stroke, with the pen lifted."),
    click.option("--after-stroke", metavar="STEPS", help="And after it."),
)


_PICTURE = under(
    commands.INK,
    shared("--dpi", type=click.FloatRange(36, 2400), default=300.0, show_default=True, help="Of PNG files."),
    shared(
        "--pen",
        help=f"What the ink looks like, in PNG files and prints: {', '.join(PENS)}, by default ballpoint; "
        "dry-brush, marker, sumi, crayon, or a .brush file. A scanned hand has its own; another .hand file lends it "
        "that of its pages.",
    ),
    shared("--pen-width", help="Width of the line, in pictures; default: the pen's own, plain 0.3mm."),
    shared("--ink", help="Colour of the ink, in pictures: #rrggbb, or a name such as navy; default: the pen's own."),
    shared(
        "--paper",
        unless=("transparent",),
        default="none",
        show_default=True,
        help="plain laid ruled squared (ruled:8mm; ruled:8mm,25mm: the first rule 25mm from the top), or a picture or "
        "PDF of a sheet (FILE, FILE:2): behind the ink in PNG files, and written on its lines and beside its print in "
        "all.",
    ),
    shared("--transparent", is_flag=True, unless=("paper",), help="PNG files without any paper."),
    shared(
        "--layer-by",
        type=click.Choice(LAYERS),
        default=LAYERS[0],
        show_default=True,
        help="What each layer of SVG and DXF files is.",
    ),
)


_OF_USER = (ParameterSource.COMMANDLINE, ParameterSource.ENVIRONMENT)


def bind(name: str, kind: Callable[..., object], *options: Option) -> Callable[[Verb], Verb]:
    """Options of click that a verb gets as one value, in its parameter `name`.

    Parameters
    ----------
    kind : a frozen dataclass, or what makes one of keywords; the click options are called like its fields.
    options : what `click.option` returned, in the order of the help text.
    """

    def decorate(verb: Verb) -> Verb:
        @wraps(verb)
        def bound(*arguments: object, **values: object) -> object:
            group = {field: values.pop(field) for field in names}
            return verb(*arguments, **{name: kind(**group)}, **values)

        inner = len(vars(verb).get("__click_params__", ()))
        result: Verb = bound
        for option in reversed(options):
            result = option(result)
        names = [str(parameter.name) for parameter in vars(result)["__click_params__"][inner:]]
        return result

    return decorate


def bind_hooked(name: str, kind: Callable[..., object], *options: Option) -> Callable[[Verb], Verb]:
    """As `bind`, with the options of hooks, which are a value of their own: the field `hooks` of the kind."""

    def whole(**values: object) -> object:
        hooks: Callable[..., HookOptions] = HookOptions
        own = {field.name: values.pop(field.name) for field in fields(HookOptions)}
        return kind(**values, hooks=hooks(**own))

    return bind(name, whole, *options, _HOOKS)


def port(*names: str, multiple: bool = False) -> Option:
    """--port of a plotter; one of the configuration is left aside where the result is to be a file."""
    help_ = "/dev/ttyUSB0, COM3, tcp://host, ws://host, auto, or sim: (simulated)."
    option = shared("--port", *names, multiple=multiple, unless=("dry_run", "output"), help=help_)
    return under(commands.MACHINE, option)


def given() -> frozenset[str]:
    """The options of the running command that its user gave: they win over what the head of a letter says."""
    context = click.get_current_context()
    return frozenset(name for name in context.params if context.get_parameter_source(name) in _OF_USER)


def sheet(usual_page: str) -> Callable[[Verb], Verb]:
    """--page (usually that one), --margin and --pages, as `sheet`: SheetOptions."""
    return bind(
        "sheet",
        partial(SheetOptions, usual_page=usual_page),
        under(
            commands.PAGE,
            shared("--page", "page", help=f"{page_sizes.HELP}  [default: {usual_page}]"),
            shared("--margin", help=SIDES),
            shared("--pages", type=click.IntRange(1), help="How many pages there may be."),
        ),
    )


def _slips(_context: click.Context, _option: click.Parameter, text: str | None) -> float:
    """Slips in 100 words: nothing, a number, or the option alone."""
    return slip_rate(text)


_SLIPS = shared(
    "--slips",
    is_flag=False,
    flag_value="usual",
    metavar="[RATE]",
    callback=_slips,
    help="Words in 100 begun wrongly, struck out and written again; without a number 2. Never in addresses.",
)


manner = bind(
    "writing", WritingOptions, _HAND, _LINES, _STYLED
)  # WritingOptions without slips, for other programs' commands
writing = bind("writing", WritingOptions, _HAND, _LINES, _STYLED, under(commands.HAND, _SLIPS))
picture = bind("picture", PictureOptions, _PICTURE)


def _console(as_json: bool, quiet: bool) -> Console:
    """The terminal, which first says what the verb takes from a configuration."""
    result = Console(as_json, quiet)
    result.note(*configuration.sentences(click.get_current_context()))
    return result


console = bind("console", _console, _CONSOLE)
_OWN_POSE = under(
    commands.STYLE,
    click.option("--pose", help=_POSE),
    click.option("--method", type=click.Choice(POSE_METHODS), default=POSE_METHODS[0], show_default=True, help=_METHOD),
    click.option("--trajectory", is_flag=True, help="Draw the strokes, too, as the library's writer draws."),
    click.option("--one-pass", is_flag=True, help="With --trajectory: hold the pen as the old strokes suggest."),
)
_OWN_STYLE = under(
    commands.STYLE,
    click.option(
        "--style",
        help=f"Default: fast-tag. Or {_STYLE.removeprefix('fast-tag, ')}",
    ),
    click.option("--smooth", type=float, help="0.05 to 1: how much the movement rounds; default: the style's."),
    click.option("--shear", help="Lean of the letters, such as 12deg; default: the style's."),
    click.option("--jitter", type=float, help="How much the hand varies, 1 as people do; default: the style's."),
    *_MANNER,
    click.option("--seed", type=int, help="Same seed, same bytes; without it every run may differ."),
)
pose = bind("posing", PoseOptions, _OWN_POSE)
style = bind("styling", StyleOptions, _OWN_STYLE)
