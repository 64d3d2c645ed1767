"""Defaults of options from the environment and from files: `HANDOUT_…`, the project's `handout.toml`, the user's.

A key is what an option is called: ``hand`` for every verb in which it means the same (`SharedOption`), ``plot.port``
or ``hand.prompt.page`` for one verb.  Nearer places win, and in one place a verb's key wins over a bare one.
click takes the values as its own defaults (`Context.default_map`), so every option checks them as if they were typed.
"""

from __future__ import annotations

import difflib
import json
import os
import re
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeGuard

import click
from click.core import ParameterSource

from handout import atomic, shipped
from handout.errors import InputError
from handout.tables import parse_table

PROJECT = "handout.toml"
Value = str | int | float | bool | list[str | int | float]
SHARED: set[str] = set()  # what options are called that a bare key of the configuration sets
JOB_WORDS = ("jobs", "show", "forget")  # of `plot`, with which kept plots are asked about
_OF_TABLES = ("letter", "with_envelopes", "columns")  # parameters that make a plot one of a table's rows


class SharedOption(click.Option):
    """An option that means the same in every verb that has it, so that one key of the configuration sets it for all.

    unless : names of parameters; where one of them is given on the command line, what is configured is left aside.
    """

    unless: Sequence[str] = ()

    def consume_value(self, ctx: click.Context, opts: Mapping[str, click.Parameter]) -> tuple[object, ParameterSource]:
        """As click's; a configured value yields to `unless` and where a kept plot goes on as it began."""
        value, source = super().consume_value(ctx, opts)
        if source is not ParameterSource.DEFAULT_MAP:
            return value, source
        if _of_kept(ctx) or any(_is_typed(ctx, name) for name in self.unless):
            assert ctx.default_map is not None
            ctx.default_map.pop(str(self.name))
            return super().consume_value(ctx, opts)
        return value, source


def _of_kept(context: click.Context) -> bool:
    """Whether a plot that is kept goes on, is drawn again, or is asked about."""
    if any(_is_typed(context, name) for name in _OF_TABLES):  # of which --resume may have the name
        return False
    text = context.params.get("text")
    if context.info_name == "plot" and text and text[0] in JOB_WORDS:
        return not any(_is_typed(context, name) for name in ("file", "ports", "dry_run"))
    return text == () and (_is_typed(context, "resume") or _is_typed(context, "again"))


def _is_typed(context: click.Context, name: str) -> bool:
    """Whether an option is typed, and not to turn a switch off."""
    typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
    return typed and context.params.get(name) is not False


_META = "handout.configured"  # in `Context.meta`: (verb, parameter) → Setting


@dataclass(frozen=True)
class ConfiguredValue:
    """A value that is configured: as which key, in which place."""

    key: str
    value: Value
    layer: SettingsLayer

    @property
    def text(self) -> str:
        """The value as it is shown."""
        return _text(self.value)


@dataclass(frozen=True)
class SettingsLayer:
    """A place of settings.

    kind : "environment", "project" or "user"; file : none of the environment.
    """

    kind: str
    file: Path | None = None
    values: Mapping[str, Value] = field(default_factory=dict)

    def name_place(self, key: str) -> str:
        """Where a key stands, for people."""
        return f"environment {variable(key)}" if self.file is None else f"{self.kind} file {self.file}"

    def find(self, keys: Sequence[str]) -> ConfiguredValue | None:
        """The first of some keys that is here."""
        for key in keys:
            name = variable(key) if self.file is None else key
            if name in self.values:
                value = self.values[name]
                if isinstance(value, list):
                    value = [self._path_beside(each) if isinstance(each, str) else each for each in value]
                elif isinstance(value, str):
                    value = self._path_beside(value)
                return ConfiguredValue(key, value, self)
        return None

    def _path_beside(self, value: str) -> str:
        """A value; where it names a file beside this one, with its folder."""
        if self.file is None or not Path(value).suffix:
            return value
        try:
            beside = self.file.parent / value
            return str(beside) if beside.is_file() else value
        except OSError:  # a text that is longer than names of files may be
            return value


def variable(key: str) -> str:
    """The environment variable of a key: HANDOUT_PLOT_PORT of ``plot.port``."""
    return "HANDOUT_" + re.sub(r"[.-]", "_", key).upper()


def _text(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_text, value))
    return str(value).lower() if isinstance(value, bool) else str(value)


def user_file() -> Path:
    """Where the user's settings are kept; it need not exist."""
    return shipped.user_folder("config.toml")


def project_file() -> Path | None:
    """The nearest ``handout.toml`` of this folder and those that it is in."""
    try:
        here = Path.cwd()
    except OSError:  # the folder is gone
        return None
    every = (place / PROJECT for place in (here, *here.parents))
    return next((file for file in every if os.access(file, os.R_OK) and file.is_file()), None)


def strangers(file: Path) -> bool:
    """Whether a file belongs to neither this user nor the system's: what it says could send letters elsewhere."""
    return hasattr(os, "geteuid") and file.stat().st_uid not in (os.geteuid(), 0)


def layers(chosen: str | None = None) -> list[SettingsLayer]:
    """All places, the nearest first.

    chosen : a file that is read instead of the project's and the user's, or "none" for built-in defaults alone.

    Raises InputError: a file that is not TOML, or holds what no option takes.
    """
    if chosen == "none":
        return []
    variables: dict[str, Value] = {
        name: text for name, text in os.environ.items() if name.startswith("HANDOUT_") and text
    }
    found = [SettingsLayer("environment", None, variables)]
    if chosen is not None:
        return [*found, SettingsLayer("chosen", Path(chosen), read_settings(Path(chosen)))]
    project, user = project_file(), user_file()
    if project is not None and project != user and not strangers(project):
        found.append(SettingsLayer("project", project, read_settings(project)))
    return [*found, SettingsLayer("user", user, read_settings(user))] if user.is_file() else found


def read_settings(file: Path) -> dict[str, Value]:
    """The settings of a file by their whole keys: a table [plot] with port gives ``plot.port``.

    Raises InputError: no such file, not TOML, or a value that is no text, number, true or false, or list of these.
    """
    try:
        return dict(_flat(parse_table(file.read_text(encoding="utf-8-sig")), ""))
    except (OSError, ValueError) as error:
        raise InputError(
            f"{file}: cannot be read as a configuration: {getattr(error, 'strerror', 0) or error}."
        ) from error


def _flat(table: Mapping[str, object], prefix: str) -> Iterator[tuple[str, Value]]:
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        elif _is_value(value):
            yield prefix + name, value
        else:
            raise ValueError(f"{prefix}{name} is no text, number, true or false, nor a list of these")


def _is_value(value: object) -> TypeGuard[Value]:
    return all(isinstance(each, str | int | float) for each in _several(value))


def _several(value: object) -> list[object]:
    return value if isinstance(value, list) else [value]


def key_of(option: click.Option) -> str:
    """What an option is called in a configuration: its first long name without the dashes."""
    return next((name for name in option.opts if name.startswith("--")), option.opts[0]).lstrip("-")


def options_of(command: click.Command) -> list[click.Option]:
    """The options of a verb that can be configured."""
    return [each for each in command.params if isinstance(each, click.Option) and not each.is_eager]


def keys_of(path: str, option: click.Option) -> list[str]:
    """The keys that an option of a verb listens to, the verb's own first."""
    key = key_of(option)
    return [f"{path}.{key}", *([key] if isinstance(option, SharedOption) else [])]


def find(path: str, option: click.Option, places: Sequence[SettingsLayer]) -> ConfiguredValue | None:
    """What is configured for an option of a verb such as ``"plot"`` or ``"hand.prompt"``."""
    return next((found for layer in places if (found := layer.find(keys_of(path, option)))), None)


def provide(context: click.Context, command: click.Command, name: str, complaining: bool) -> None:
    """Give a verb that is about to be called what is configured for it.

    complaining : whether an error in a file is one of the command; it is none where only help is asked for.

    Raises InputError: as `layers`; or a key that no option is called.
    """
    try:
        places = layers(context.params.get("config"))
        if complaining:
            for layer in places:
                _check_keys(layer, context, command, name)
        found: dict[tuple[str, str], ConfiguredValue] = context.meta.setdefault(_META, {})
        context.default_map = {**(context.default_map or {}), name: _defaults(command, name, places, found)}
    except InputError:
        if complaining:
            raise


def _defaults(
    command: click.Command, path: str, places: Sequence[SettingsLayer], found: dict[tuple[str, str], ConfiguredValue]
) -> dict[str, object]:
    if isinstance(command, click.Group):
        return {name: _defaults(each, f"{path}.{name}", places, found) for name, each in command.commands.items()}
    values: dict[str, object] = {}
    for option in options_of(command):
        setting = find(path, option, places)
        if setting is not None:
            found[path, str(option.name)] = setting
            values[str(option.name)] = _fitting(option, setting)
    return values


def _fitting(option: click.Option, setting: ConfiguredValue) -> object:
    """A configured value as click wants it for its option."""
    value = setting.value
    if isinstance(value, list) and not option.multiple:
        raise InputError(f"{place(setting)}: one value is wanted, not a list.")
    if isinstance(value, bool) != option.is_flag and setting.layer.file is not None:
        wanted = "true or false is" if option.is_flag else "a text or a number is"
        raise InputError(f"{place(setting)}: {wanted} wanted.")
    # numbers as if they were typed: of 1.5 click would make the whole number 1
    words: list[object] = [each if isinstance(each, bool) else str(each) for each in _several(value)]
    return words if option.multiple else words[0]


def place(setting: ConfiguredValue) -> str:
    """Where a setting stands, and what it says: the beginning of a sentence on what is wrong with it."""
    layer = setting.layer
    if layer.file is None:
        return f"Environment variable {variable(setting.key)} = {setting.text!r}"
    return f"{layer.file}: {setting.key} = {json.dumps(setting.value, ensure_ascii=False)}"


def _check_keys(layer: SettingsLayer, context: click.Context, command: click.Command, name: str) -> None:
    """Check bare keys, and those of this verb; `handout config` and `doctor` look at all others."""
    if layer.file is None:
        return
    verbs = _leaves(command, name)
    for key in layer.values:
        path, _, last = key.rpartition(".")
        if not path and last not in SHARED:
            assert isinstance(context.command, click.Group)
            all_verbs(context.command)  # which makes the set whole
        if not path and last not in SHARED:
            raise unknown_key(f"{layer.file}: ", key, sorted(SHARED))
        if path == name or path.startswith(f"{name}."):
            choices = [key_of(option) for option in options_of(verbs[path])] if path in verbs else []
            if last not in choices:
                raise unknown_key(f"{layer.file}: ", key, [f"{path}.{choice}" for choice in choices])


def unknown_key(where: str, key: str, choices: Sequence[str]) -> InputError:
    """The error that no option is called so, with the nearest that are."""
    name = key.rpartition(".")[2]
    near = difflib.get_close_matches(key, choices, 3, 0.6) or [each for each in choices if name and name in each][:3]
    hint = f" Did you mean {' or '.join(near)}?" if near else " `handout config show --all` lists those that there are."
    return InputError(f"{where}no option is called {key!r}.{hint}")


def _leaves(command: click.Command, path: str) -> dict[str, click.Command]:
    """The verbs in a verb by their paths; itself where it has none in it."""
    if not isinstance(command, click.Group):
        return {path: command}
    found: dict[str, click.Command] = {}
    for name, each in command.commands.items():
        found |= _leaves(each, f"{path}.{name}")
    return found


def all_verbs(root: click.Group) -> dict[str, click.Command]:
    """Every verb by its path; loads all of them."""
    context, found = click.Context(root), dict[str, click.Command]()
    for name in root.list_commands(context):
        command = root.get_command(context, name)
        assert command is not None
        found |= _leaves(command, name)
    return found


def in_force(context: click.Context) -> dict[str, ConfiguredValue]:
    """Parameter → setting of what the running verb takes from a configuration, and would not have done without it."""
    found: Mapping[tuple[str, str], ConfiguredValue] = context.meta.get(_META, {})
    path = ".".join(context.command_path.split()[1:])
    usual = {option.name: option.default for option in options_of(context.command)}
    return {
        name: found[path, name]
        for name in context.params
        if context.get_parameter_source(name) is ParameterSource.DEFAULT_MAP
        and (path, name) in found
        and _text(found[path, name].value) != _text(usual.get(name))
    }


def sentences(context: click.Context) -> list[str]:
    """What the running verb takes from a configuration, a sentence a place.

    Raises InputError: a value that its option cannot take; the message names the place, the key and what it may be.
    """
    by_place: dict[str, list[str]] = {}
    options = {str(option.name): option for option in options_of(context.command)}
    for name, setting in in_force(context).items():
        check(options[name], setting)
        where = "the environment" if setting.layer.file is None else str(setting.layer.file)
        by_place.setdefault(where, []).append(f"{setting.key} = {setting.text}")
    return [f"From {where}: {', '.join(told)}." for where, told in by_place.items()]


def check(option: click.Option, setting: ConfiguredValue) -> None:
    """Raise InputError where a name, length or colour is configured that there is not.

    An option of one verb may mean another thing by the same name, as --paper of calibrate does: its verb checks it.
    """
    from handout.pipeline.names import CHECKS

    if isinstance(option, SharedOption) and option.name in CHECKS and isinstance(setting.value, str):
        try:
            CHECKS[option.name](setting.value)
        except InputError as error:
            raise InputError(f"{place(setting)}: {error}") from error


def wrong(error: click.BadParameter) -> str | None:
    """The sentence on a value that its option refused, where it comes from a configuration."""
    context, option = error.ctx, error.param
    if context is None or option is None or option.name is None:
        return None
    if context.get_parameter_source(option.name) is not ParameterSource.DEFAULT_MAP:
        return None
    setting = context.meta[_META].get((".".join(context.command_path.split()[1:]), option.name))
    return None if setting is None else f"{place(setting)}: {error.message}"


def change_text(text: str, key: str, value: Value | None) -> str:
    """The text of a configuration file with a key set to a value, or without it (None); all else stays as it is."""
    import tomlkit

    document = tomlkit.parse(text)
    table, _, name = key.rpartition(".")
    places = list[MutableMapping[str, object]]()
    # ["hand.prompt"], as it is written here, or [hand.prompt]
    for way in ([table], table.split(".")) if table else ([],):
        inner: object = document
        for part in way:
            inner = inner.get(part) if isinstance(inner, MutableMapping) else None
        places += [inner] if isinstance(inner, MutableMapping) else []
    place = next((each for each in places if name in each), places[0] if places else None)
    if value is None:
        if place is not None:
            place.pop(name, None)
    elif place is None:
        document[table] = tomlkit.table().add(name, value)
    else:
        place[name] = value
    return tomlkit.dumps(document)


def write(file: Path, key: str, value: Value | None) -> None:
    """Set a key in a file, or take it out (None), as a whole or not at all.

    Raises InputError: as `read_settings` and `atomic.write`.
    """
    text = ""
    if file.is_file():
        read_settings(file)
        text = file.read_text(encoding="utf-8-sig")
    try:
        result = change_text(text, key, value).encode()
        file.parent.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise InputError(f"Cannot write {file}: {getattr(error, 'strerror', 0) or error}") from error
    atomic.write(file, result)
