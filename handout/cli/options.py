"""The options that `pipeline.declarations` declares, as click's, and how a verb gets them as one value."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import fields
from functools import cache, reduce, wraps
from pathlib import Path

import click
from click.core import ParameterSource

from handout.cli import configuration
from handout.cli.commands import group_under
from handout.cli.configuration import Option, Verb
from handout.cli.configuration import shared as shared
from handout.cli.console import Console
from handout.pipeline.declarations import GENERAL, MACHINE, Declaration, build_options, inner, list_declared
from handout.pipeline.options import PictureOptions, PoseOptions, SheetOptions, StyleOptions, WritingOptions

_OF_USER = (ParameterSource.COMMANDLINE, ParameterSource.ENVIRONMENT)
as_json = click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")
_QUIET = click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")
_CONSOLE = group_under(GENERAL, as_json, _QUIET)


def from_dataclass(
    kind: type, *, only: Collection[str] = (), leave_out: Collection[str] = (), **changed: Mapping[str, object]
) -> Option:
    """The options that a dataclass declares, those of dataclasses in it too, as one option of click.

    Parameters
    ----------
    only, leave_out : names of fields; without `only` all but those left out.
    changed : of a field what is declared otherwise for this verb.
    """
    found = [from_dataclass(type(usual), only=only, leave_out=leave_out, **changed) for usual in inner(kind).values()]
    for each, declaration in list_declared(kind, changed):
        if declaration.help and each.name not in leave_out and (not only or each.name in only):
            found.append(group_under(declaration.heading, _option(each.name, each.default, declaration)))
    return lambda verb: reduce(lambda done, one: one(done), reversed(found), verb)


def _option(name: str, default: object, declaration: Declaration) -> Option:
    """One option of click."""
    flags = list(declaration.flags) or [f"--{name.replace('_', '-')}"]
    settings: dict[str, object] = {"help": declaration.help, "metavar": declaration.metavar}
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
        return shared(*flags, name, unless=declaration.unless, **settings)
    return click.option(*flags, name, cls=click.Option, **settings)


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


def bind(name: str, kind: type, *options: Option, **fixed: object) -> Callable[[Verb], Verb]:
    """Options of click that a verb gets as one value, in its parameter `name`.

    Parameters
    ----------
    kind : a frozen dataclass; its options are called like its fields.
    options : of `from_dataclass` or `click.option`, in the order of the help; none: all that the dataclass declares.
    fixed : fields that are no options of this verb.
    """

    def decorate(verb: Verb) -> Verb:
        @wraps(verb)
        def call_verb(*arguments: object, **values: object) -> object:
            group = {field: values.pop(field) for field in names}
            return verb(*arguments, **{name: build_options(kind, {**fixed, **group})}, **values)

        inner = len(vars(verb).get("__click_params__", ()))
        result: Verb = call_verb
        for option in reversed(options or (from_dataclass(kind),)):
            result = option(result)
        names = [str(parameter.name) for parameter in vars(result)["__click_params__"][inner:]]
        return result

    return decorate


def port(*names: str, multiple: bool = False) -> Option:
    """--port of a plotter; one of the configuration is left aside where the result is to be a file."""
    help_ = "/dev/ttyUSB0, COM3, tcp://host, ws://host, auto, or sim: (simulated)."
    option = shared("--port", *names, multiple=multiple, unless=("dry_run", "output"), help=help_)
    return group_under(MACHINE, option)


def given_names() -> frozenset[str]:
    """The options of the running command that its user gave: they win over what the head of a letter says."""
    context = click.get_current_context()
    return frozenset(name for name in context.params if context.get_parameter_source(name) in _OF_USER)


def sheet(usual_page: str) -> Callable[[Verb], Verb]:
    """--page (usually that one), --margin and --pages, as `sheet`: SheetOptions."""
    page = from_dataclass(SheetOptions, page={"help": f"{_PAGE}  [default: {usual_page}]"})
    return bind("sheet", SheetOptions, page, usual_page=usual_page)


def console(verb: Verb) -> Verb:
    """--json and --quiet, as `console`: Console, which first says what the verb takes from a configuration."""

    @wraps(verb)
    def call_verb(*arguments: object, as_json: bool, quiet: bool, **values: object) -> object:
        terminal = Console(as_json, quiet)
        terminal.note(*configuration.sentences(click.get_current_context()))
        return verb(*arguments, console=terminal, **values)

    return _CONSOLE(call_verb)


_PAGE = next(each.metadata["option"].help for each in fields(SheetOptions) if each.name == "page")
# WritingOptions without slips, for other programs' commands
manner = bind("writing", WritingOptions, from_dataclass(WritingOptions, leave_out=("slips",)))
writing = bind("writing", WritingOptions)
picture = bind("picture", PictureOptions)
pose = bind("posing", PoseOptions)
style = bind("styling", StyleOptions)
