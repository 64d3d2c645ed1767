"""The options that `pipeline.declarations` declares, as click's; and verbs, whose parameters say what they take."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, MutableMapping
from dataclasses import Field, is_dataclass, replace
from functools import cache
from inspect import Parameter, signature
from pathlib import Path

import click
from click.core import ParameterSource

from handout.cli import configuration
from handout.cli.commands import VerbCommand
from handout.cli.configuration import SHARED, SharedOption
from handout.cli.console import Console
from handout.pipeline.declarations import (
    GENERAL,
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
