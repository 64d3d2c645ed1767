"""TOML files read into frozen, validated structs, with errors that name the key.

A field of a struct is a plain number or word, or one of the quantities below, which a file gives with its unit.  To add
a kind of quantity: its units in `units`, a class here, and a line in `_KINDS`.
"""

from __future__ import annotations

import difflib
import tomllib
import types
import typing
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from handout import units
from handout.errors import InputError

T = TypeVar("T", bound=msgspec.Struct)


class Length(float):
    """mm, written in the file as ``"297mm"``."""


class Time(float):
    """s, written as ``"150ms"``."""


class Speed(float):
    """mm/s, written as ``"60mm/s"``."""


class Acceleration(float):
    """mm/s², written as ``"800mm/s2"``."""


class Angle(float):
    """rad, written as ``"40deg"``."""


_GREATEST_WHOLE = 2**64  # a seed may be as large
# kind of quantity, and a unit to show in an error message
_KINDS: dict[type, tuple[str, str]] = {
    Length: ("length", "mm"),
    Time: ("time", "ms"),
    Speed: ("speed", "mm/s"),
    Acceleration: ("acceleration", "mm/s2"),
    Angle: ("angle", "deg"),
}


class Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of a file; an unknown key is an error."""


def load_table(path: Path, what: str, error: type[InputError] = InputError) -> dict[str, Any]:
    """The values of a TOML file.

    what : what the file should be, for the message, such as "a style"; error : raised where it cannot be read as that.
    """
    try:
        return parse_table(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as reason:
        problem = getattr(reason, "strerror", None) or str(reason)
        raise error(f"{path}: cannot be read as {what}: {problem}.") from reason


def parse_table(text: str) -> dict[str, Any]:
    """The values of the text of a TOML file.

    Raises ValueError: not TOML (`tomllib.TOMLDecodeError`); with its key a fraction that is not finite or beyond
    `units.GREATEST`, or a whole number of more than 64 bits.
    """
    try:
        values = tomllib.loads(text)
    except RecursionError as error:
        raise ValueError("it is nested too deep") from error
    _check_numbers(values, "")
    return values


def _check_numbers(value: object, key: str) -> None:
    match value:
        case dict():
            for name, each in value.items():
                _check_numbers(each, f"{key}.{name}" if key else name)
        case list():
            for each in value:
                _check_numbers(each, key)
        case float() if not abs(value) <= units.GREATEST:
            raise ValueError(f"{key} = {value:g} is no number that can be used: it is beyond {units.GREATEST:g}")
        case int() if abs(value) >= _GREATEST_WHOLE:
            raise ValueError(f"{key} is a whole number of more than 64 bits")


def convert_table(values: Mapping[str, Any], kind: type[T]) -> T:
    """The values of a file as a struct.

    Raises ValueError: an unknown key (with the nearest known one), a missing one, a wrong type or unit; the message
    names the key.
    """
    try:
        return msgspec.convert(values, kind, dec_hook=_quantity)
    except msgspec.ValidationError as error:
        raise ValueError(_hint(str(error), kind)) from error


def check_bounds(table: msgspec.Struct, bounds: Mapping[str, tuple[float, float]]) -> None:
    """Raise ValueError for the first number outside its bounds; keys are paths such as ``bed.width``."""
    for key, (least, greatest) in bounds.items():
        value: Any = table
        for name in key.split("."):
            value = getattr(value, name, None)
        if value is not None and not least <= value <= greatest:
            raise ValueError(f"{key} = {value:g} is outside {least:g} to {greatest:g}.")


def _quantity(kind: type, value: Any) -> Any:
    name, unit = _KINDS[kind]
    if not isinstance(value, str):
        raise ValueError(f'needs a {name} with its unit in quotes, such as "12{unit}"')
    try:
        return kind(units.parse(value, name))
    except InputError as error:  # msgspec adds the path of the key to a ValueError only
        raise ValueError(str(error).removeprefix("value: ").rstrip(".")) from error


def _hint(message: str, kind: type[msgspec.Struct]) -> str:
    """The validation message in plain words: which key, what is wrong with it, and the nearest known key to a slip."""
    problem, _, place = message.partition(" - at `$")
    table = place.strip(".`")
    name = problem.split("`")[1] if "`" in problem else ""
    key = f"{table}.{name}" if table else name
    if "unknown field" in problem:
        fields = {field for table_kind in _tables(kind) for field in table_kind.__struct_fields__}
        similar = difflib.get_close_matches(name, fields, 1)
        return f"{key} is not a known key" + (f"; did you mean {similar[0]!r}?" if similar else ".")
    if "missing required field" in problem:
        return f"{key} is missing."
    return f"{table}: {problem[0].lower()}{problem[1:]}." if table else f"{problem}."


def _tables(kind: type[msgspec.Struct]) -> Iterator[type[msgspec.Struct]]:
    """A struct and all that its fields hold."""
    yield kind
    for hint in typing.get_type_hints(kind).values():
        parts = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
        for part in parts:
            if isinstance(part, type) and issubclass(part, msgspec.Struct):
                yield from _tables(part)
