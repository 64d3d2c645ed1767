"""`handout config`: defaults of options, kept in files; and where each comes from."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Sequence
from enum import Enum
from pathlib import Path
from typing import NamedTuple

import click
from click.core import ParameterSource

from handout.cli import configuration, options
from handout.cli.configuration import PROJECT, ConfiguredValue, SettingsLayer, Value
from handout.errors import InputError
from handout.pipeline import declarations

_OF_PROJECT = declarations.option(False, f"In the project's {PROJECT} instead of your own file.")


class _ConfiguredRow(NamedTuple):
    """A key, its value, and where that comes from."""

    key: str
    value: object
    place: str


@click.group("config")
def command() -> None:
    """Keep defaults of options for all verbs, and say where each comes from.

    What is typed wins over the environment (HANDOUT_HAND, HANDOUT_PLOT_PORT), that over the project's handout.toml in
    this folder or one above, that over your own file, and that over what is built in. What the head of a letter says
    wins over all but what is typed. A switch that is set, such as fit, is turned off for once by --no-fit.

    \b
    handout config set hand me               for every verb that writes
    handout config set plot.port COM3        for one verb
    handout config set page A5 --project
    handout config get hand
    handout config show
    handout config show plot --port sim:     where each option of a command comes from
    handout config unset plot.port
    """


@options.verb("set", command)
def set_default(
    key: str,
    values: tuple[str, ...] = declarations.argument(required=True, metavar="VALUE..."),
    project: bool = _OF_PROJECT,
) -> None:
    """Set the default of the option KEY, or VERB.KEY, to VALUE; options that may be repeated take several.

    \b
    handout config set hand house-quick
    handout config set plot.port /dev/ttyUSB0 /dev/ttyUSB1
    """
    name, owners = _owners(key)
    file = _file(project)
    value = _value(name, owners, values, file)
    configuration.write(file, name, value)
    click.echo(f"{name} = {ConfiguredValue(name, value, SettingsLayer('user', file)).text} in {file}.", err=True)


@options.verb("unset", command)
def unset_default(key: str, project: bool = _OF_PROJECT) -> None:
    """Take the default KEY, or VERB.KEY, out of the file.

    \b
    handout config unset hand
    """
    file, name = _file(project), _plain(key)
    there = configuration.read_settings(file) if file.is_file() else {}
    if name not in there:  # it may have another name; one that no option has is taken out all the same
        with contextlib.suppress(InputError):
            name, _ = _owners(key)
    if name not in there:
        raise InputError(f"{file}: {name} is not set there.")
    configuration.write(file, name, None)
    click.echo(f"{name} is no longer set in {file}.", err=True)


@options.verb("get", command)
def get(key: str) -> None:
    """Print the default of the option KEY, or VERB.KEY, and say where it comes from.

    \b
    handout config get plot.port
    """
    name, owners = _owners(key)
    path, option = owners[0]
    keys = [name] if "." not in name else configuration.keys_of(path, option)
    found = next((each for layer in _layers() if (each := layer.find(keys))), None)
    row = _row(found) if found else _ConfiguredRow(name, _built_in(option), "built-in")
    click.echo(_show_value(row.value))
    click.echo(f"From: {row.place}.", err=True)


@options.verb("show", command, context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False})
def show(
    every: bool = declarations.option(False, "Built-in defaults, too: every key that there is.", flags=("--all",)),
    as_json: bool = declarations.option(False, "One JSON object on standard output.", flags=("--json",)),
    words: tuple[str, ...] = declarations.argument(metavar="[VERB [WORDS]...]", kind=click.UNPROCESSED),
) -> None:
    """What is configured, and where each value comes from; after a VERB and its words, every option that it would take.

    \b
    handout config show
    handout config show --all
    handout config show write "Dear Ada" --hand house-quick
    """
    notes = problems()
    rows = list(_of_command(words)) if words else list(_list_configured(every))
    user, project = configuration.user_file(), configuration.project_file()
    files = {"user": str(user) if user.is_file() else None, "project": str(project) if project else None}
    if as_json:
        settings = [{"key": row.key, "value": row.value, "from": row.place} for row in rows]
        facts = {"settings": settings, "files": files, **({"notes": notes} if notes else {})}
        click.echo(json.dumps(facts, ensure_ascii=False))
    else:
        table = [(row.key, _show_value(row.value), row.place) for row in rows]
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        for cells in table:
            click.echo("  ".join(text.ljust(width) for text, width in zip(cells, widths, strict=True)).rstrip())
    if not rows and not as_json:
        click.echo(f"Nothing is configured: your own file would be {user}.", err=True)
    for note in notes:
        click.echo(note, err=True)


def _show_value(value: object) -> str:
    if isinstance(value, list | tuple):
        return " ".join(map(_show_value, value))
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _layers() -> list[SettingsLayer]:
    return configuration.layers(click.get_current_context().find_root().params.get("config"))


def _row(setting: ConfiguredValue) -> _ConfiguredRow:
    return _ConfiguredRow(setting.key, setting.value, setting.layer.name_place(setting.key))


def _built_in(option: click.Option) -> object:
    """The default that an option has of its own; None where it has none."""
    value = option.get_default(click.Context(click.Command("none")), call=True)
    # click from 8.3 on says by a member of an enumeration that there is none
    return list(value) if isinstance(value, tuple) else None if isinstance(value, Enum) else value


def _plain(key: str) -> str:
    """A key as it stands in files: ``--x-height`` and ``x_height`` are ``x-height``."""
    path, _, last = key.rpartition(".")
    last = last.lstrip("-").replace("_", "-")
    return f"{path}.{last}" if path else last


def _owners(key: str) -> tuple[str, list[tuple[str, click.Option]]]:
    """The key as it stands in files, and the options that it sets, with their verbs; never none.

    Raises InputError: no option is called so.
    """
    name, found = _plain(key), []
    prefix, _, last = name.rpartition(".")
    for path, option in _options():
        bare = not prefix and len(configuration.keys_of(path, option)) > 1
        if (bare or prefix == path) and last in {text.lstrip("-") for text in option.opts}:
            found.append((path, option))
    if not found:
        raise _unknown(name)
    path, option = found[0]
    return (f"{path}." if "." in name else "") + configuration.key_of(option), found


def _options() -> Iterator[tuple[str, click.Option]]:
    """Every option of every verb, with the verb's path."""
    root = click.get_current_context().find_root().command
    assert isinstance(root, click.Group)
    for path, verb in sorted(configuration.all_verbs(root).items()):
        yield from ((path, option) for option in configuration.options_of(verb))


def _unknown(name: str) -> InputError:
    """The error that no option is called so, or that only options of single verbs are."""
    keys = dict.fromkeys(key for path, option in _options() for key in configuration.keys_of(path, option))
    verbs = sorted(key for key in keys if key.endswith(f".{name}"))
    if verbs:
        return InputError(f"{name} is not the same in every verb: set it for one, such as {verbs[0]}.")
    return configuration.unknown_key("", name, [key for key in keys if ("." in key) == ("." in name)] or [*keys])


def _file(project: bool) -> Path:
    """The file that is written to."""
    chosen = click.get_current_context().find_root().params.get("config")
    if chosen == "none":
        raise InputError("--config none: there is no file to write to.")
    if chosen is not None:
        return Path(chosen)
    return (configuration.project_file() or Path.cwd() / PROJECT) if project else configuration.user_file()


def _value(name: str, owners: Sequence[tuple[str, click.Option]], words: Sequence[str], file: Path) -> Value:
    """What is written to the file for the words of a value, checked by every option that it sets.

    Raises InputError: no such value; the message says what it may be.
    """
    values = [_absolute(word, file) for word in words]
    single = [path for path, option in owners if not option.multiple]
    if len(values) > 1 and single:
        several = [f"{path}.{configuration.key_of(option)}" for path, option in owners if option.multiple]
        way_out = f"set it for one verb, such as {several[0]}" if several else "put quotes around words of one value"
        raise InputError(f"{name} takes one value in {single[0]}, not {len(values)}: {way_out}.")
    typed = [_convert_word(owners[0][1], value) for value in values]
    value: Value = typed if len(typed) > 1 else typed[0]
    for _, option in owners:
        _check(name, option, value)
    return value


def _check(name: str, option: click.Option, value: Value) -> None:
    """Raise InputError where an option does not take a value."""
    several = [value] if option.multiple and not isinstance(value, list) else value
    try:
        option.process_value(click.Context(click.Command(name)), several)
        configuration.check(option, ConfiguredValue(name, value, SettingsLayer("user")))
    except (click.BadParameter, InputError) as error:
        said = error.message if isinstance(error, click.BadParameter) else str(error.__cause__ or error)
        raise InputError(f"{name}: {said}") from error


def _convert_word(option: click.Option, word: str) -> str | int | float | bool:
    """A word as its option's type has it in a file."""
    kind: click.ParamType[object] = click.BOOL if option.is_flag else option.type
    try:
        value = kind.convert(word, option, None)
    except click.BadParameter as error:
        said = f"{word!r} is neither true nor false." if option.is_flag else error.message
        raise InputError(f"{configuration.key_of(option)}: {said}") from error
    return value if isinstance(value, bool | int | float) else word


def _absolute(word: str, file: Path) -> str:
    """A file that is here, so that it is found from everywhere: by its whole path, or from the project's folder."""
    path = Path(word)
    if not path.suffix or path.is_absolute() or not path.is_file():
        return word
    whole, folder = path.resolve(), file.parent.resolve()
    return whole.relative_to(folder).as_posix() if whole.is_relative_to(folder) else str(whole)


def problems() -> list[str]:
    """Keys that no option is called, and a project's file that is left aside."""
    notes, project = [], configuration.project_file()
    if project is not None and configuration.strangers(project):
        notes.append(f"{project} belongs to another user and is not read; --config {project} reads it all the same.")
    known = {key for path, option in _options() for key in configuration.keys_of(path, option)}
    variables = {configuration.variable(key) for key in known} | {"HANDOUT_CONFIG"}
    for layer in _layers():
        names = variables if layer.file is None else known
        where = layer.file or "environment"
        notes += [f"{where}: no option is called {name}." for name in layer.values if name not in names]
    return notes


def _list_configured(every: bool) -> Iterator[_ConfiguredRow]:
    """What is set, by keys; what a nearer place hides is told beside it."""
    layers, told = _layers(), set()
    for path, option in _options():
        own, *shared = configuration.keys_of(path, option)
        for key in (each for each in (*shared, own) if each not in told):
            places = [found for layer in layers if (found := layer.find([key]))]
            if places:
                hidden = [f"{found.layer.kind}: {found.text}" for found in places[1:]]
                row = _row(places[0])
                yield _ConfiguredRow(key, row.value, row.place + (f" (over {', '.join(hidden)})" if hidden else ""))
            elif every and (key in shared or not shared):
                yield _ConfiguredRow(key, _built_in(option), "built-in")
            told.add(key)


def _of_command(words: Sequence[str]) -> Iterator[_ConfiguredRow]:
    """Every option of a verb as it would be with some words."""
    root = click.get_current_context().find_root()
    context = click.Context(root.command, info_name="handout")
    context.params = dict(root.params)
    rest = list(words)
    while isinstance(context.command, click.Group):
        name, verb, rest = context.command.resolve_command(context, rest) if rest else (None, None, [])
        if name is None or verb is None:
            raise InputError(f"Which verb? One of {', '.join(context.command.list_commands(context))}.")
        if isinstance(verb, click.Group):
            context = click.Context(verb, parent=context, info_name=name)
        else:
            context = verb.make_context(name, rest, parent=context, resilient_parsing=True)
    typed = {ParameterSource.COMMANDLINE: "command line", ParameterSource.DEFAULT: "built-in"}
    path = ".".join(context.command_path.split()[1:])
    for option in configuration.options_of(context.command):
        source = context.get_parameter_source(str(option.name))
        found = configuration.find(path, option, _layers()) if source is ParameterSource.DEFAULT_MAP else None
        value = found.value if found else context.params.get(str(option.name))
        place = found.layer.name_place(found.key) if found else typed.get(source or ParameterSource.DEFAULT, "built-in")
        yield _ConfiguredRow(configuration.key_of(option), list(value) if isinstance(value, tuple) else value, place)
