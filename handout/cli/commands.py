"""Verbs of click whose options stand under headings in the help, and whose switches can be turned off again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from handout.cli.configuration import options_of
from handout.pipeline.declarations import GENERAL, HEADINGS, OWN

if TYPE_CHECKING:
    from click.parser import _OptionParser

_FEW = 12  # options of a verb that need no headings
_WIDE = 30  # columns of names, as click has them at most


def group_options(command: click.Command, context: click.Context) -> dict[str, list[click.Option]]:
    """The options of a verb by their headings, in the order of the help; few stand under one heading."""
    options = [each for each in command.get_params(context) if isinstance(each, click.Option)]
    if len(options) <= _FEW:
        return {OWN: options}
    found = {heading: [each for each in options if _heading(each) == heading] for heading in HEADINGS}
    return {heading: those for heading, those in found.items() if those}


def records(options: Sequence[click.Option], context: click.Context) -> list[tuple[str, str]]:
    """How options are written, and their help."""
    return [record for option in options if (record := option.get_help_record(context))]


def _heading(option: click.Parameter) -> str:
    return str(vars(option).get("heading", GENERAL if "--help" in option.opts else OWN))


def switches(command: click.Command) -> list[tuple[str, click.Option]]:
    """The switches of a verb that can be configured, each with the option that turns it off: --fit has --no-fit.

    One that itself says no, as --no-browser does, is turned off by what is left of its name: --browser.
    """
    found = [each for each in options_of(command) if each.is_bool_flag and not each.secondary_opts]
    names = [(next(name for name in each.opts if name.startswith("--")), each) for each in found]
    return [(f"--{name[5:]}" if name.startswith("--no-") else f"--no-{name[2:]}", each) for name, each in names]


class VerbCommand(click.Command):
    """A verb: its options by headings, each switch with one that turns off what a configuration turned on."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """As click's, in the order of the help."""
        return sorted(super().get_params(ctx), key=lambda each: HEADINGS.index(_heading(each)))

    def make_parser(self, ctx: click.Context) -> _OptionParser:
        """As click's, with what turns switches off."""
        parser = super().make_parser(ctx)
        for name, option in switches(self):
            parser.add_option(option, [name], option.name, action="store_const", const=False)
        return parser

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options under their headings, all in the same two columns."""
        parts = {heading: records(options, ctx) for heading, options in group_options(self, ctx).items()}
        wide = min(_WIDE, max(len(name) for part in parts.values() for name, _ in part))
        for heading, part in parts.items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(wide), text) for name, text in part])
