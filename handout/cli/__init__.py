"""The command `handout`: one file a verb, loaded only when it is called, so that `--help` answers at once."""

from __future__ import annotations

import codecs
import gc
import io
import json
import os
import sys
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING

import click

from handout import __version__, signals
from handout.cli import streams
from handout.errors import HandoutError, at_border, shorten_message

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

# verb → what `handout --help` says of it; the code is in the module of that name
_VERBS = {
    "write": "Write a text to a file: SVG, PNG, PDF, InkML or JSON.",
    "export": "Write a text as the program of a plotter: G-code, HP-GL or EBB.",
    "plot": "Write a text with a pen plotter.",
    "pen": "Set up the pen of a plotter: a test sheet, its heights; move it by hand.",
    "proof": "Show every page of a table's letters and envelopes, before they are printed or plotted.",
    "print": "Address envelopes from a table and print them.",
    "fill": "Fill in a PDF form by hand.",
    "calibrate": "Make a printer's colours those of the ink.",
    "hand": "Make hands from scans, list and show them, and make sheets to write one on.",
    "brush": "Learn a brush from photographs of strokes, for --pen; show it.",
    "strokes": "Explain recorded or drawn strokes by the movements of a hand, and draw such plans.",
    "restyle": "Draw a drawing in another handstyle.",
    "pose": "Learn from recordings how a pen is held, and show it.",
    "style": "Learn a handstyle from examples.",
    "asemic": "Invent letters that mean nothing, and write them as a tag.",
    "devices": "List, show and check machines.",
    "studio": "Open a page in the browser: write, make hands, correct their letters.",
    "doctor": "Look at what the program needs of this computer, and say what to do about what is missing.",
    "config": "Keep defaults of options for all verbs, and say where each comes from.",
    "completion": "Print what makes bash, zsh or fish complete verbs, options and names.",
    "man": "Print or write manual pages.",
}
_WITHOUT_DEFAULTS = {"config", "doctor", "completion", "man"}  # verbs that work whatever a configuration says
_HELP = {"-h", "--help"}
# what numpy's and scipy's libraries of linear algebra ask when they are loaded, and processes that are started inherit;
# `one_thread` of handout/networks.py says why, and does the same for programs that call handout
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_OBJECTS = 50_000  # new ones, after which cycles are looked for: after Python's 700 it is a twentieth of a page's time


class _Verbs(click.Group):
    """A group that imports a verb's module only when the verb is called.

    Verbs of other packages are entry points of the group `handout.verbs`: a click command under the verb's name.
    """

    @cached_property
    def _other_verbs(self) -> dict[str, EntryPoint]:
        from importlib.metadata import entry_points

        return {point.name: point for point in entry_points(group="handout.verbs") if point.name not in _VERBS}

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*_VERBS, *self._other_verbs]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in _VERBS:
            command = import_module(f"handout.cli.{cmd_name}_").command
        elif cmd_name in self._other_verbs:
            command = self._other_verbs[cmd_name].load()
        else:
            return None
        assert isinstance(command, click.Command)
        if ctx.resilient_parsing and "_HANDOUT_COMPLETE" in os.environ:
            from handout.cli.completion_ import prepare

            prepare(command, cmd_name)
            command.short_help = _VERBS.get(cmd_name, command.short_help)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in _VERBS and args[0] not in self._other_verbs and not ctx.resilient_parsing:
            import difflib

            names = self.list_commands(ctx)
            near = difflib.get_close_matches(args[0], names, 1)
            hint = f" Did you mean {near[0]!r}?" if near else f" Use one of {', '.join(names)}."
            raise click.UsageError(f"There is no command {args[0]!r}.{hint}", ctx)
        name, command, rest = super().resolve_command(ctx, args)
        if name is not None and command is not None and name not in _WITHOUT_DEFAULTS:
            from handout.cli.configuration import provide

            provide(ctx, command, name, not (ctx.resilient_parsing or _HELP & set(rest)))
        return name, command, rest

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        others = [(name, point.load().get_short_help_str(120)) for name, point in self._other_verbs.items()]
        with formatter.section("Commands"):
            formatter.write_dl([*_VERBS.items(), *others])


@click.group(cls=_Verbs, context_settings={"help_option_names": sorted(_HELP), "max_content_width": 120})
@click.option(
    "--config",
    envvar="HANDOUT_CONFIG",
    type=click.Path(),
    metavar="FILE",
    help="Defaults of options from this file instead of your own and the project's; none: from nowhere.",
)
@click.version_option(__version__, prog_name="handout")
def cli(config: str | None) -> None:
    """Write any text in a person's handwriting and put it on paper."""


def main(args: list[str] | None = None) -> None:
    """Run the command and leave with its exit code: 0 done, 2 bad input, 3 device fault, 4 some rows failed."""
    for variable in _THREADS:
        os.environ.setdefault(variable, "1")
    gc.set_threshold(_OBJECTS)
    codecs.register_error("handout", _escape)
    streams.open_closed()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="handout")
    with signals.orderly():
        try:
            code = _run_command(args)
        except KeyboardInterrupt:  # a second one, while the first was told
            signals.ignore()
            code = signals.INTERRUPTED
    sys.exit(code)


def _escape(error: UnicodeError) -> tuple[str, int]:
    """What a terminal cannot show, or the code page of a file of Windows, as JSON writes it."""
    assert isinstance(error, UnicodeEncodeError)
    return json.dumps(error.object[error.start : error.end])[1:-1], error.end


def _sentence(error: Exception) -> str | None:
    """What is to be said of an error; None of one that click says itself, and of a fault of the program.

    Of a wrong value that is where a configuration has it, and of an option of another program what it is called here.
    """
    match error:
        case click.NoSuchOption(ctx=click.Context(info_name="plot" | "export")):
            from handout.cli.elsewhere import hint

            return hint(error.option_name)
        case click.BadParameter():
            from handout.cli.configuration import wrong

            return wrong(error)
        case HandoutError():
            return str(error)
        case ImportError(name=str(name)) if not name.startswith("handout"):
            return f"A package cannot be loaded ({error}): `handout doctor` says what to do."
        case OSError() | RecursionError():
            return at_border(error) or streams.explain_closed(error)
    return None


def _run_command(args: list[str] | None) -> int:
    try:
        result = cli.main(args=args, prog_name="handout", standalone_mode=False)
    except click.exceptions.Exit as leave:
        return leave.exit_code
    except (click.Abort, KeyboardInterrupt) as stop:
        signals.ignore()
        message, code = signals.last_words(stop)
        click.echo(message, err=True)
        return code
    except SystemExit as leave:
        streams.check_unread(leave)
        return 0
    except (click.ClickException, HandoutError, ImportError, OSError, RecursionError) as error:
        if sentence := _sentence(error):
            click.echo(f"handout: {shorten_message(sentence)}", err=True)
        elif isinstance(error, click.ClickException):
            vars(error)["message"] = shorten_message(error.message)
            error.show()
        else:
            raise
        return error.exit_code if isinstance(error, HandoutError) else 2
    return result if isinstance(result, int) else 0
