"""Verbs of click, whose parameters say what they take: the options that `pipeline.declarations` declares."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, MutableMapping, Sequence
from dataclasses import Field, is_dataclass, replace
from functools import cache
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from handout.cli import configuration
from handout.cli.configuration import SHARED, SharedOption, options_of
from handout.cli.console import Console
from handout.pipeline.declarations import (
    GENERAL,
    HEADINGS,
    OWN,
    Bundle,
    Declaration,
    argument,
    build_options,
    bundle,
    inner,
    list_declared,
    option,
    read_declared,
)

if TYPE_CHECKING:
    from click.parser import _OptionParser

_FEW = 12  # options of a verb that need no headings
_WIDE = 30  # columns of names, as click has them at most
Values = dict[str, object]  # of the options of a call, by their names
_OF_USER = (ParameterSource.COMMANDLINE, ParameterSource.ENVIRONMENT)
JSON = option(False, "One JSON object on standard output.", GENERAL, flags=("--json",))
LISTENING = option(None, "Where it listens; default: 7217, or any that is free.", least=1, most=65535)
UNSEEN = option(False, "Print the link and open nothing.")
_QUIET = option(False, "Say nothing but errors.", GENERAL, flags=("--quiet", "-q"))


def verb(
    name: str,
    group: click.Group | None = None,
    *,
    help: str | None = None,
    short_help: str | None = None,
    context_settings: MutableMapping[str, object] | None = None,
) -> Callable[[Callable[..., object]], click.Command]:
    """Make a function a verb, of a group or by itself; its parameters say its arguments and options, in their order.

    One of a plain type is an argument, one with a default of `declarations` an option; a dataclass has the options that
    it declares, and the `Console`, whatever its place, --json and --quiet, which stand last.
    """

    def decorate(function: Callable[..., object]) -> click.Command:
        params, takes = list[click.Parameter](), dict[str, Callable[[Values], object]]()
        for each in sorted(signature(function).parameters.values(), key=lambda each: each.annotation == "Console"):
            found, takes[each.name] = _read_parameter(each, vars(sys.modules[function.__module__]))
            params += found

        def call_verb(**values: object) -> object:
            return function(**{name: take(values) for name, take in takes.items()})

        command = VerbCommand(
            name,
            params=params,
            callback=call_verb,
            help=help or function.__doc__,
            short_help=short_help,
            context_settings=context_settings,
        )
        if group is not None:
            group.add_command(command)
        return command

    return decorate


def _read_parameter(parameter: Parameter, known: Values) -> tuple[list[click.Parameter], Callable[[Values], object]]:
    """What of click a parameter of a verb takes, and how its value is made of the values of that."""
    name, usual, annotation = parameter.name, parameter.default, str(parameter.annotation)
    kind = known.get(annotation)
    if kind is Console:

        def open_console(values: Values) -> Console:
            terminal = Console(bool(values.pop("as_json")), bool(values.pop("quiet")))
            terminal.note(*configuration.sentences(click.get_current_context()))  # what it takes from a configuration
            return terminal

        switches = (("as_json", JSON), ("quiet", _QUIET))
        return [_option(one, False, declared.metadata["option"]) for one, declared in switches], open_console
    if isinstance(kind, type) and is_dataclass(kind):
        usual = kind() if usual is Parameter.empty else usual
        asked: Bundle = usual if isinstance(usual, Bundle) else bundle(usual)
        made = [*list_options(asked)]
        return [*made], lambda values: build_options(
            asked.usual, {str(one.name): values.pop(str(one.name)) for one in made}
        )
    declared: Field[object] = usual if isinstance(usual, Field) else argument()
    what = read_declared(declared, annotation)
    if what.help or what.flags:
        return [_option(name, declared.default, what)], lambda values: values.pop(name)
    make: Callable[..., click.Parameter] = click.Argument
    required, several = what.required or not (what.repeated or "None" in annotation), -1 if what.repeated else 1
    place = make([name], required=required, nargs=several, metavar=what.metavar, type=_kind(what, None))
    return [place], lambda values: values.pop(name)


def list_options(asked: Bundle) -> Iterator[click.Option]:
    """The options that a dataclass declares, those of dataclasses in it first."""
    for within in inner(asked.usual).values():
        yield from list_options(replace(asked, usual=within))
    for each, what in list_declared(asked.usual, asked.changed):
        if what.help and each.name not in asked.leave_out and (not asked.only or each.name in asked.only):
            help_ = f"{what.help}  [default: {getattr(asked.usual, what.usual)}]" if what.usual else what.help
            yield _option(each.name, each.default, replace(what, help=help_))


def _option(name: str, default: object, declaration: Declaration) -> click.Option:
    """One option of click."""
    flags = list(declaration.flags) or [f"--{name.replace('_', '-')}"]
    settings: Values = {"help": declaration.help, "metavar": declaration.metavar}
    if declaration.off:
        flags[0] += f"/{declaration.off}"
        settings |= {"default": default, "show_default": True}
    elif isinstance(default, bool):
        settings["is_flag"] = True
    elif declaration.repeated:
        settings |= {"multiple": True, "required": declaration.required}
    else:
        settings |= {"required": True} if declaration.required else {} if default is None else {"default": default}
        settings["show_default"] = default not in (None, "") and declaration.alone is None
    if declaration.alone is not None:
        settings |= {"is_flag": False, "flag_value": declaration.alone}
    if (kind := _kind(declaration, default)) is not None:
        settings["type"] = kind
    if declaration.shared:
        SHARED.add(flags[0].removeprefix("--"))
    make: Callable[..., click.Option] = SharedOption if declaration.shared else click.Option
    made = make([*flags, name], **settings)
    vars(made).update(heading=declaration.heading, unless=declaration.unless)
    return made


@cache
def _kind(declaration: Declaration, default: object) -> object:
    """What click makes of the text of an option; None: what it tells from the default."""
    if declaration.choices:
        return click.Choice(declaration.choices)
    kind = declaration.kind or (type(default) if isinstance(default, int | float) else None)
    if declaration.least is not None or declaration.most is not None:
        kinds: Callable[..., object] = click.IntRange if kind is int else click.FloatRange
        return kinds(declaration.least, declaration.most)
    return (
        click.Path(path_type=Path) if kind is Path else declaration.kind and click.types.convert_type(declaration.kind)
    )


def given_names() -> frozenset[str]:
    """The options of the running command that its user gave: they win over what the head of a letter says."""
    context = click.get_current_context()
    return frozenset(name for name in context.params if context.get_parameter_source(name) in _OF_USER)


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
        for name, switch in switches(self):
            parser.add_option(switch, [name], switch.name, action="store_const", const=False)
        return parser

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options under their headings, all in the same two columns."""
        parts = {heading: records(options, ctx) for heading, options in group_options(self, ctx).items()}
        wide = min(_WIDE, max(len(name) for part in parts.values() for name, _ in part))
        for heading, part in parts.items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(wide), text) for name, text in part])
