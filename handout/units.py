"""Quantities as people write them, such as ``"297mm"``, ``"0.5in"`` or ``"60mm/s"``, parsed once, where they come in.

Inside the program every length is in mm, every time in s, every angle in rad.  Add a unit in `_UNITS`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from handout.errors import InputError

_UNITS: dict[str, dict[str, float]] = {
    "length": {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "pt": 25.4 / 72, "um": 1e-3, "µm": 1e-3},
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "angle": {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180},
    "speed": {"mm/s": 1.0, "mm/min": 1 / 60, "m/s": 1000.0, "in/s": 25.4, "in/min": 25.4 / 60},
    "acceleration": {"mm/s2": 1.0, "mm/s²": 1.0, "m/s2": 1000.0, "m/s²": 1000.0},
}
POINT, PX = 25.4 / 72, 25.4 / 96  # mm: of PDF and of CSS
MOST_NAMED = 12  # words, rows or files that a sentence names; set by eye
GREATEST = 1e9  # of any quantity, in its first unit, and of any number in a file of settings; set by eye
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s].*?)?\s*\Z")


def parse(text: str, kind: str, what: str = "value", default: str | None = None) -> float:
    """Read a quantity such as ``"2.5mm"``.

    text : A number and a unit, e.g. ``"0.5in"``.
    kind : ``"length"`` → mm, ``"time"`` → s, ``"angle"`` → rad, ``"speed"`` → mm/s, ``"acceleration"`` → mm/s².
    what : the name of the quantity, for the error message.
    default : the unit of a bare number; without it a bare number is an error.

    Raises InputError: no number, no unit, or a unit of another kind.
    """
    units = _UNITS[kind]
    match = _QUANTITY.match(text)
    unit = (match.group(2) or default) if match else None
    if match is None or unit not in units:
        raise InputError(f"{what}: {text!r} is not a {kind}; write a number with one of {', '.join(units)}.")
    value = float(match.group(1)) * units[unit]
    if not abs(value) <= GREATEST:
        raise InputError(f"{what}: {text[:40]!r} is too large: no {kind} is beyond {GREATEST:g} {next(iter(units))}.")
    return value


def length(text: str, what: str = "length") -> float:
    """Length in mm; a bare number is taken as mm."""
    return parse(text, "length", what, default="mm")


def count(number: int, noun: str, plural: str = "") -> str:
    """A number of things: ``"1 job"``, ``"3 jobs"``; `plural` where it does not end in an s."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def listed(names: Iterable[str], most: int = MOST_NAMED) -> str:
    """Names for a sentence: the first few, and how many more."""
    every = list(names)
    return ", ".join(every[:most]) + (f" and {len(every) - most} more" if len(every) > most else "")


def duration(seconds: float) -> str:
    """A time as people read it: ``"48 s"``, ``"3 min 05 s"``, ``"1 h 02 min"``."""
    total = round(seconds)
    if total < 60:
        return f"{total} s"
    if total < 3600:
        return f"{total // 60} min {total % 60:02d} s"
    return f"{total // 3600} h {total % 3600 // 60:02d} min"
